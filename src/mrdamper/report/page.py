"""Pages as single HTML files without scripts or network access.

Templates are in `templates/`; each extends `base.html.j2` with layout and style.
"""

from __future__ import annotations

import base64
import re
from importlib.metadata import version
from itertools import compress

import jinja2
import numpy as np
from markupsafe import Markup

from mrdamper.data import Dataset
from mrdamper.data.wording import counted, number, raised, span
from mrdamper.errors import UnknownNameError

PAPERS = ("a4", "letter")  # sizes of the pages of a PDF
_TABLE = re.compile(r"<table(?! class)[^>]*>.*?</table>", re.DOTALL)  # with headings; a table of facts has a class
_ROW, _CELL = re.compile(r"(<tr\b[^>]*>)(.*?)</tr>", re.DOTALL), re.compile(r"<(th|td)\b.*?>(.*?)</\1>", re.DOTALL)


def paper_size(name: str) -> str:
    """Return the size of the pages of a PDF as it is known here; raises `UnknownNameError` if it is not."""
    if name.lower() not in PAPERS:
        raise UnknownNameError.of("paper size", name, PAPERS)
    return name.lower()


def render_page(template: str, title: str, footer: str, **facts: object) -> str:
    """Render a template of `templates/`; the footer states the origin of the page."""
    page = _ENVIRONMENT.get_template(template).render(title=title, footer=footer, **facts)
    return _TABLE.sub(_without_empty_columns, page)


def _without_empty_columns(table: re.Match[str]) -> str:
    """Leave out the columns of a table that have no value in any row below their heading."""
    _, *rows = ([cell[2] for cell in _CELL.finditer(row[0])] for row in _ROW.finditer(table[0]))
    filled = [any(text not in ("", "–") for text in column) for column in zip(*rows, strict=True)]
    if all(filled):
        return table[0]
    return _ROW.sub(
        lambda row: f"{row[1]}{''.join(cell[0] for cell in compress(_CELL.finditer(row[2]), filled))}</tr>", table[0]
    )


def made_from(*datasets: Dataset) -> str:
    """Return the start of a footer: version of mrdamper and the datasets."""
    text = "; ".join(f"{dataset.name}, {counted(len(dataset), 'run')}" for dataset in datasets)
    return f"mrdamper {version('mrdamper')}; dataset{'s' if len(datasets) > 1 else ''}: {text}"


def inline_svg(picture: bytes, alt: str) -> Markup:
    """Embed an SVG as an image."""
    data = base64.b64encode(picture).decode("ascii")
    return Markup('<img alt="{}" src="data:image/svg+xml;base64,{}">').format(alt, data)


def plain(value: float | None) -> str:
    """Format a value to three digits and decimals, as a condition in a test plan; a dash where there is none.

    Examples
    --------
    >>> plain(1.5003), plain(-0.0004), plain(0.500000000013146)
    ('1.5', '0', '0.5')
    """
    return number(value and round(value, 3), 3)


def whole(value: float) -> str:
    """Format a value without decimals, three digits below 100; a dash where there is none."""
    return f"{value:.0f}" if abs(value) >= 100 else number(value, 3)


def median_worst(median: float | None, worst: float | None) -> str:
    """Write an error as per cent and the largest in parentheses; a dash where there is none."""
    text = percent(median)
    return text if text == "–" else f"{text} ({percent(worst)})"


def percent(share: float | None, digits: int = 1) -> str:
    """Format a share in per cent; a dash where there is none."""
    return "–" if share is None or not np.isfinite(share) else f"{100 * share:z.{digits}f}"


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
    "span": span,
    "raised": raised,
    "plain": plain,
    "whole": whole,
    "median_worst": median_worst,
    "percent": percent,
    "mm": lambda v: 1e3 * v,
}
