"""How figures look: journal sizes, engineers' units, colours that survive colour blindness and grey print."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mrdamper.data import Floats

# Okabe and Ito's palette, black first.
PALETTE = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#F0E442")
MEASURED, PREDICTED = PALETTE[0], PALETTE[2]
WIDTH = 7.2  # inches, two journal columns
MM, KN = 1e3, 1e-3

_RC = {
    "font.size": 9,
    "font.family": "sans-serif",
    "font.sans-serif": ["Arial", "Helvetica", "DejaVu Sans"],
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "svg.fonttype": "none",
    "svg.hashsalt": "mrdamper",
    "savefig.dpi": 200,
    "figure.dpi": 100,
}


@contextmanager
def house_style() -> Iterator[None]:
    """Draw inside this block to get the house style."""
    # "Arial" is asked for first and rarely installed; silence per-glyph warnings of the search.
    import logging

    logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)
    with matplotlib.rc_context(_RC):
        yield


def new_figure(rows: int, columns: int, height: float, **options: object) -> tuple[Figure, list[Axes]]:
    """Make a figure of the house width; axes come as a flat list, row by row."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, **options)  # type: ignore[arg-type]
    return figure, list(axes.ravel())


def current_colours(currents: Sequence[float]) -> dict[float, tuple[float, ...]]:
    """One colour a current, dark to light with rising current."""
    levels = sorted(set(currents))
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, max(len(levels), 2)))
    return {level: tuple(shades[i]) for i, level in enumerate(levels)}


def label(axes: Axes, x: str, y: str, title: str = "") -> None:
    """Name the axes; quantities first, units in brackets."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if title:
        axes.set_title(title, loc="left")


def thin(array: Floats, most: int = 400) -> Floats:
    """Every n-th sample, so that a curve keeps at most so many points."""
    return array[:: max(1, array.size // most)]


def save_figure(figure: Figure, stem: Path) -> None:
    """Write a figure as PNG and SVG."""
    with house_style():
        figure.savefig(stem.with_suffix(".png"))
        figure.savefig(stem.with_suffix(".svg"), metadata={"Date": None})
