"""The comparison as one HTML file: no script, no network, prints well."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files

import jinja2

from mrdamper.report.html import inline_svg


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
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    template = environment.from_string((files("mrdamper.report") / "comparison.html.j2").read_text(encoding="utf-8"))
    return template.render(title=title, chapters=chapters, footer=footer, svg=inline_svg, percent=_percent)


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.1f}"
