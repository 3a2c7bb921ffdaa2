"""Figures as data, panels of lines, and one function that draws them in the style of the reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import ArrayLike

from mrdamper.report.plots.style import house_style, label, new_figure


@dataclass(frozen=True)
class Series:
    """One series: points, label, and properties of the line."""

    x: ArrayLike
    y: ArrayLike
    label: str = ""
    style: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Panel:
    """Axes with lines over them.

    Attributes
    ----------
    axes : (str, str)
        Texts of the two axes: quantity and unit.
    lines : sequence of Series
    title : str
    log : str
        Axes with a logarithmic scale: "x", "y".
    rows : sequence of str
        Names on the vertical axis, from the top; row k lies at −k.
    columns : sequence of str
        Names on the horizontal axis; column k lies at k.
    low : float or None
        Lower end of the axis of values.
    """

    axes: tuple[str, str]
    lines: Sequence[Series] = ()
    title: str = ""
    log: str = ""
    rows: Sequence[str] = ()
    columns: Sequence[str] = ()
    low: float | None = None


@dataclass(frozen=True)
class FigureLayout:
    """Panels of one figure; `legend` is "right", "above" or "", `margins` are those of `new_figure`."""

    panels: Sequence[Panel]
    height: float = 3.2
    legend: str = "right"
    rows: int = 1
    margins: Mapping[str, float] = field(default_factory=dict)


def draw(chart: FigureLayout) -> Figure:
    """Draw a figure."""
    with house_style():
        columns = len(chart.panels) // chart.rows
        figure, axes = new_figure(chart.rows, columns, chart.height, **chart.margins)
        for panel, on in zip(chart.panels, axes, strict=True):
            _fill(panel, on)
        first = axes[columns - 1]
        if chart.legend == "right":
            first.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
        elif chart.legend == "above":
            handles, texts = axes[0].get_legend_handles_labels()
            figure.legend(handles, texts, loc="upper center", ncols=min(len(texts), 4), fontsize=7)
        return figure


def _fill(panel: Panel, axes: Axes) -> None:
    for line in panel.lines:
        axes.plot(line.x, line.y, label=line.label or None, **{"lw": 0.9, **line.style})
    for name in panel.log:
        getattr(axes, f"set_{name}scale")("log")
        axis = getattr(axes, f"{name}axis")
        axis.set_major_locator(LogLocator(numticks=6))
        axis.set_minor_formatter(NullFormatter())
    if panel.rows:
        axes.set_yticks(-np.arange(len(panel.rows)), panel.rows)
    if panel.low is not None:
        (axes.set_xlim if panel.rows else axes.set_ylim)(panel.low)
    label(axes, *panel.axes, panel.title)
    if panel.columns:
        axes.set_xticks(range(len(panel.columns)), panel.columns, fontsize=7)
