"""Style of figures: journal sizes, engineers' units, colours that are distinct in colour blindness and grey print."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from mrdamper.data import Floats, current_levels
from mrdamper.data.encoding import csv_text

# Okabe and Ito's palette, black first.
PALETTE = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#F0E442")
MEASURED, PREDICTED = PALETTE[0], PALETTE[2]
_SCALE = "scale of colours"  # what such axes are called
WIDTH = 7.2  # inches, two journal columns
MM, KN = 1e3, 1e-3
MOST_NAMED = 10  # motions a list beside a figure can name; more are read off a scale

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
    rows: int,
    columns: int,
    height: float,
    *,
    left: float = 0.78,
    right: float = 0.12,
    top: float = 0.28,
    gap: float = 0.78,
    **options: object,
) -> tuple[Figure, list[Axes]]:
    """Make a figure of the house width; axes come as a flat list, row by row.

    Margins are fixed, in inches: an automatic layout would draw every figure twice, which is
    most of the time a study's report takes.
    """
    bottom = 0.46
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
    """One colour a value, dark to light with rising value."""
    levels = sorted(set(currents))
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, max(len(levels), 2)))
    return {level: tuple(shades[i]) for i, level in enumerate(levels)}  # type: ignore[misc]


def levels(currents: Sequence[float]) -> list[float]:
    """The level of the test matrix of each current [A]: what differs by noise alone has one colour."""
    return current_levels([abs(current) for current in currents])


def speed_colours(
    figure: Figure, speeds: Sequence[float], text: str = "Peak velocity (m/s)"
) -> dict[float, tuple[float, float, float, float]]:
    """One colour a value on a scale that is drawn in the right margin: for more values than a list can name."""
    shades = ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, 256)))
    low, high = min(speeds), max(speeds)
    scale = ScalarMappable(Normalize(low, high if high > low else low + 1), shades)
    place = figure.subplotpars
    bar = figure.add_axes(
        (place.right + 0.35 / WIDTH, place.bottom, 0.12 / WIDTH, place.top - place.bottom), label=_SCALE
    )
    figure.colorbar(scale, cax=bar, label=text)
    return {speed: tuple(scale.to_rgba(speed)) for speed in speeds}  # type: ignore[misc]


def powered(text: str, largest: float) -> tuple[str, float]:
    """An axis title with its unit in a power of a thousand, and what to multiply by: no power floats above an axis."""
    power = 3 * int(np.floor(np.log10(largest) / 3)) if largest >= 1e5 or 0 < largest < 1e-3 else 0
    if not power:
        return text, 1.0
    name, _, unit = text.rpartition("(")
    return f"{name}($10^{{{power}}}$ {unit}", 10.0**-power


def label(axes: Axes, x: str, y: str, title: str = "") -> None:
    """Name the axes; quantities first, units in brackets; as many ticks as there is room for."""
    axes.set_xlabel(x)
    if axes.get_xscale() == "linear" and (figure := axes.get_figure(root=True)) is not None:
        wide = axes.get_position().width * figure.get_size_inches()[0]
        axes.xaxis.set_major_locator(MaxNLocator(int(np.clip(wide / 0.42, 2, 6)), steps=[1, 2, 2.5, 5, 10]))
    axes.set_ylabel(y)
    if title:
        axes.set_title(title, loc="left")


def letter(figure: Figure) -> None:
    """(a), (b), ... before the title of each panel, where there are several."""
    panels = [axes for axes in figure.axes if axes.get_visible() and axes.get_label() != _SCALE]
    if len(panels) < 2:
        return
    for number, axes in enumerate(panels):
        name, title = chr(ord("a") + number % 26) * (1 + number // 26), axes.get_title(loc="left")
        if not title.startswith(f"({name})"):
            axes._left_title.set_text(f"({name}) {title}".strip())  # type: ignore[attr-defined]  # its size stays


def thin(array: Floats, most: int = 400) -> Floats:
    """Every n-th sample, so that a curve keeps at most so many points."""
    return array[:: max(1, array.size // most)]


HOW_SAVED: Mapping[str, dict[str, Any]] = {  # the same figure has the same bytes
    "svg": {"metadata": {"Date": None}},
    "pdf": {"metadata": {"CreationDate": None}},
    "png": {"pil_kwargs": {"compress_level": 2}},  # a fifth faster, a twentieth larger
}


@dataclass(frozen=True)
class Picture:
    """A figure as files: an SVG, its data as CSV, and further formats where they are wanted.

    Attributes
    ----------
    files : mapping of str to bytes
        By the ending of the file's name.
    """

    files: Mapping[str, bytes]

    @classmethod
    def of(cls, figure: Figure, also: Sequence[str] = ()) -> Self:
        """Draw a figure.

        Parameters
        ----------
        figure : Figure
        also : sequence of str
            "png" or "pdf" beside the SVG; each costs as much again.
        """
        drawn = {}
        with house_style():
            letter(figure)
            for kind in ("svg", *also):
                buffer = io.BytesIO()
                figure.savefig(buffer, format=kind, **HOW_SAVED[kind])
                drawn[kind] = buffer.getvalue()
        return cls({**drawn, "csv": figure_data(figure).encode()})

    @property
    def svg(self) -> bytes:
        """The picture a page holds."""
        return self.files["svg"]

    def save(self, stem: Path) -> bytes:
        """Write what there is beside each other; returns the SVG."""
        for kind, data in self.files.items():
            stem.with_name(f"{stem.name}.{kind}").write_bytes(data)
        return self.svg


def figure_data(figure: Figure) -> str:
    """The points of every line and every cloud of marks of a figure as CSV, one row a point."""
    names, rows = ("panel", "x_is", "y_is", "series"), ["panel,x_is,y_is,series,x,y\n"]
    head = csv_text([], names)
    for number, axes in enumerate(figure.axes, 1):
        series = [(line.get_label(), np.column_stack(line.get_data(orig=True))) for line in axes.get_lines()]
        series += [
            (c.get_label(), np.asarray(c.get_offsets())) for c in axes.collections if np.size(c.get_offsets()) > 2
        ]
        for name, points in series:
            label_ = "" if str(name).startswith("_") else str(name)
            about = dict(zip(names, (number, axes.get_xlabel(), axes.get_ylabel(), label_), strict=True))
            begin = csv_text([about]).removeprefix(head).removesuffix("\n")
            rows += [f"{begin},{x!r},{y!r}\n" for x, y in points.tolist()]
    return "".join(rows)


def save_figure(figure: Figure, stem: Path, also: Sequence[str] = ()) -> bytes:
    """Write a figure as SVG and CSV, and in further formats; returns the SVG."""
    return Picture.of(figure, also).save(stem)
