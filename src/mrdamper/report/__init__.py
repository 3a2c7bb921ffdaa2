"""One self-contained HTML report of a study."""

from mrdamper.report.page import render_report

__all__ = ["render_report"]
