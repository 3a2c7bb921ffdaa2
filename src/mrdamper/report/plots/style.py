"""How figures look: journal sizes, engineers' units, colours that survive colour blindness and grey print."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from mrdamper.data import Floats

# Okabe and Ito's palette, black first.
PALETTE = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#F0E442")
MEASURED, PREDICTED = PALETTE[0], PALETTE[2]
WIDTH = 7.2  # inches, two journal columns
MM, KN = 1e3, 1e-3

_RC: dict[Any, Any] = {
    "font.size": 9,
    "font.family": "sans-serif",
    "font.sans-serif": ["Arial", "Helvetica", "DejaVu Sans"],
    "axes.titlesize": 9,
    "axes.titley": 1.0,  # where it goes anyway; looking for the place takes a sixth of the drawing
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
    "savefig.dpi": 150,
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


def new_figure(
    rows: int, columns: int, height: float, *, left: float = 0.78, right: float = 0.12, **options: object
) -> tuple[Figure, list[Axes]]:
    """Make a figure of the house width; axes come as a flat list, row by row.

    Margins are fixed, in inches: an automatic layout would draw every figure twice, which is
    most of the time a study's report takes.
    """
    top, bottom, gap = 0.28, 0.46, 0.78
    figure = Figure(figsize=(WIDTH, height))
    wide = (WIDTH - left - right - (columns - 1) * gap) / columns
    tall = (height - top - bottom - (rows - 1) * (gap + 0.1)) / rows
    figure.subplots_adjust(
        left=left / WIDTH,
        right=1 - right / WIDTH,
        top=1 - top / height,
        bottom=bottom / height,
        wspace=gap / wide,
        hspace=(gap + 0.1) / tall,
    )
    axes = figure.subplots(rows, columns, squeeze=False, **options)  # type: ignore[arg-type]
    return figure, list(axes.ravel())


def current_colours(currents: Sequence[float]) -> dict[float, tuple[float, float, float, float]]:
    """One colour a current, dark to light with rising current."""
    levels = sorted(set(currents))
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, max(len(levels), 2)))
    return {level: tuple(shades[i]) for i, level in enumerate(levels)}  # type: ignore[misc]


def label(axes: Axes, x: str, y: str, title: str = "") -> None:
    """Name the axes; quantities first, units in brackets."""
    axes.set_xlabel(x)
    if axes.get_xscale() == "linear":
        axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
    axes.set_ylabel(y)
    if title:
        axes.set_title(title, loc="left")


def thin(array: Floats, most: int = 400) -> Floats:
    """Every n-th sample, so that a curve keeps at most so many points."""
    return array[:: max(1, array.size // most)]


@dataclass(frozen=True)
class Picture:
    """A figure as the bytes of an SVG, and of a PNG where one is wanted."""

    svg: bytes
    png: bytes | None = None

    @classmethod
    def of(cls, figure: Figure, png: bool = False) -> Self:
        """Draw a figure; as PNG too costs as much again."""
        vector, raster = io.BytesIO(), io.BytesIO()
        with house_style():
            figure.savefig(vector, format="svg", metadata={"Date": None})
            if png:
                figure.savefig(raster, pil_kwargs={"compress_level": 2})  # a fifth faster, a twentieth larger
        return cls(vector.getvalue(), raster.getvalue() if png else None)

    def save(self, stem: Path) -> bytes:
        """Write what there is beside each other; returns the SVG."""
        stem.with_name(f"{stem.name}.svg").write_bytes(self.svg)
        if self.png is not None:
            stem.with_name(f"{stem.name}.png").write_bytes(self.png)
        return self.svg


def save_figure(figure: Figure, stem: Path, png: bool = False) -> bytes:
    """Write a figure as SVG, and as PNG where one is wanted; returns the SVG."""
    return Picture.of(figure, png).save(stem)
