"""The study as one HTML file: no script, no network, prints well."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable

import jinja2
import numpy as np
from markupsafe import Markup

_ENVIRONMENT = jinja2.Environment(
    autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
)


def render_report(title: str, chapters: list[Mapping[str, object]], footer: str) -> str:
    """The report's HTML.

    Parameters
    ----------
    title : str
    chapters : list of mapping
        One a rig: what the template shows, figures included.
    footer : str
        How it was made.
    """
    helpers = {"mm": lambda v: 1e3 * v, "number": _number, "percent": _percent}
    template = files("mrdamper.report") / "report.html.j2"
    return render_page(template, title=title, chapters=chapters, footer=footer, **helpers)


def render_page(template: Traversable, **facts: object) -> str:
    """The HTML of a template that is given facts, and `svg` to put figures into the page."""
    return _ENVIRONMENT.from_string(template.read_text(encoding="utf-8")).render(svg=inline_svg, **facts)


def inline_svg(picture: bytes, alt: str) -> Markup:
    """An SVG as an image inside the page."""
    data = base64.b64encode(picture).decode("ascii")
    return Markup('<img alt="{}" src="data:image/svg+xml;base64,{}">').format(alt, data)


def _number(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "–"


def _percent(value: float | None, digits: int = 1) -> str:
    return "–" if value is None or not np.isfinite(value) else f"{100 * value:.{digits}f}"
