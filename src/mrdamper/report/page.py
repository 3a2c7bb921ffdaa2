"""Pages as one HTML file each: no script, no network, prints well.

Templates stand in `templates/`; each extends `base.html.j2`, which holds the frame and the style.
"""

from __future__ import annotations

import base64
from importlib.metadata import version

import jinja2
import numpy as np
from markupsafe import Markup

from mrdamper.data import Dataset


def render_page(template: str, title: str, footer: str, **facts: object) -> str:
    """The HTML of a template that is given facts.

    Parameters
    ----------
    template : str
        Name of a file in `templates/`.
    title : str
    footer : str
        How the page was made.
    """
    return _ENVIRONMENT.get_template(template).render(title=title, footer=footer, **facts)


def made_from(*datasets: Dataset) -> str:
    """How a page's footer begins: this program's version and what was studied."""
    said = "; ".join(f"{dataset.name}, {len(dataset)} runs" for dataset in datasets)
    return f"mrdamper {version('mrdamper')}; dataset{'s' if len(datasets) > 1 else ''}: {said}"


def inline_svg(picture: bytes, alt: str) -> Markup:
    """An SVG as an image inside the page."""
    data = base64.b64encode(picture).decode("ascii")
    return Markup('<img alt="{}" src="data:image/svg+xml;base64,{}">').format(alt, data)


def number(value: float | None, digits: int = 4) -> str:
    """A value to some significant digits, or a dash where there is none."""
    return "–" if value is None or not np.isfinite(value) else f"{value:.{digits}g}"


def whole(value: float) -> str:
    """A value without decimals, three digits where it is small, or a dash where there is none."""
    return f"{value:.0f}" if abs(value) >= 100 else number(value, 3)


def percent(share: float | None, digits: int = 1) -> str:
    """A share in per cent, or a dash where there is none."""
    return "–" if share is None or not np.isfinite(share) else f"{100 * share:.{digits}f}"


_ENVIRONMENT = jinja2.Environment(
    loader=jinja2.PackageLoader("mrdamper.report"),
    autoescape=True,
    trim_blocks=True,
    lstrip_blocks=True,
    undefined=jinja2.StrictUndefined,
)
_ENVIRONMENT.globals |= {
    "svg": inline_svg,
    "number": number,
    "whole": whole,
    "percent": percent,
    "mm": lambda v: 1e3 * v,
}
