"""Figures as data, panels of lines, and one function that draws them in the style of the reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import ArrayLike

from mrdamper.report.plots.figure import Axes, Figure


@dataclass(frozen=True)
class Series:
    """One series: points, label, and properties of the line."""

    x: ArrayLike
    y: ArrayLike
    label: str = ""
    style: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Panel:
    """Axes with lines over them."""

    axes: tuple[str, str]  # texts of the two axes: quantity and unit
    lines: Sequence[Series] = ()
    title: str = ""
    log: str = ""  # axes with a logarithmic scale: "x", "y"
    rows: Sequence[str] = ()  # names on the vertical axis, from the top; row k lies at −k
    columns: Sequence[str] = ()  # names on the horizontal axis; column k lies at k
    low: float | None = None  # lower end of the axis of values


@dataclass(frozen=True)
class FigureLayout:
    """Panels of one figure; `legend` is "right", "above" or "", `margins` are those of `Figure`."""

    panels: Sequence[Panel]
    height: float = 3.2
    legend: str = "right"
    rows: int = 1
    margins: Mapping[str, Any] = field(default_factory=dict)


def draw(chart: FigureLayout) -> Figure:
    """Draw a figure."""
    columns = len(chart.panels) // chart.rows
    figure = Figure(chart.rows, columns, chart.height, **chart.margins)
    for panel, on in zip(chart.panels, figure.axes, strict=True):
        _fill(panel, on)
    if chart.legend == "right":
        figure.axes[columns - 1].legend("right", size=7)
    elif chart.legend == "above":
        names = sum(bool(line.label) for line in chart.panels[0].lines)
        figure.axes[0].legend("above", size=7, columns=max(1, min(names, 4)))
    return figure


def _fill(panel: Panel, axes: Axes) -> None:
    for line in panel.lines:
        axes.plot(line.x, line.y, label=line.label, **{"lw": 0.9, **line.style})
    axes.x.log, axes.y.log = "x" in panel.log, "y" in panel.log
    if panel.rows:
        axes.y.places, axes.y.texts = [-row for row in range(len(panel.rows))], panel.rows
    if panel.low is not None:
        (axes.x if panel.rows else axes.y).low = panel.low
    axes.label(*panel.axes, panel.title)
    if panel.columns:
        axes.x.places, axes.x.texts = range(len(panel.columns)), panel.columns
