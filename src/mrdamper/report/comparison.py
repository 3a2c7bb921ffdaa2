"""The comparison as one HTML file: no script, no network, prints well."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files

from mrdamper.report.page import render_page


def render_comparison(title: str, chapters: list[Mapping[str, object]], footer: str) -> str:
    """The comparison's HTML.

    Parameters
    ----------
    title : str
    chapters : list of mapping
        One a rig: what the template shows, figures included.
    footer : str
        How it was made.
    """
    template = files("mrdamper.report") / "comparison.html.j2"
    return render_page(template, title=title, chapters=chapters, footer=footer, percent=_percent)


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.1f}"
