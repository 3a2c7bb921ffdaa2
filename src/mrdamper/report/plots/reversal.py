"""Force over the distance since the last reversal, which shows free play."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.data import Floats, Run
from mrdamper.report.plots.figure import Figure, new_figure
from mrdamper.report.plots.style import MM, PREDICTED, current_colours, levels

_DISTANCES = np.linspace(0.0, 1.5e-3, 76)  # m
_FIRST = 5  # number of the first distance at which a run has a force in every stroke, to be drawn with others


def force_since_reversal(runs: Sequence[Run], damper: Damper) -> Figure:
    """Draw the mean force along the motion over the distance since the reversal, by current; thin lines: predicted."""
    figure, axes = new_figure(1, 1, 3.0, right=1.2)
    steps = levels([run.mean_current for run in runs])
    colours = current_colours(steps)
    for current, colour in colours.items():
        members = [run for step, run in zip(steps, runs, strict=True) if step == current]
        curves = np.array([_means(run, damper) for run in members])
        complete = np.isfinite(curves[:, 0, _FIRST:]).all(axis=1)  # the others only where no run is
        mean = np.mean(curves[complete] if complete.any() else curves, axis=0)
        for row, (width, shade) in zip(mean, ((1.8, colour), (0.8, PREDICTED)), strict=True):
            finite = np.isfinite(row)
            axes.plot(MM * _DISTANCES[finite], row[finite], lw=width, color=shade)
        axes.plot([], [], color=colour, lw=1.8, label=f"{current:g} A")
    axes.plot([], [], color=PREDICTED, lw=0.8, label="predicted")
    axes.legend("right")
    axes.x.low, axes.x.high = 0.0, MM * _DISTANCES[-1]
    axes.label("Distance since the reversal (mm)", "Force along the motion over its peak (–)")
    return figure


def _means(run: Run, damper: Damper) -> Floats:
    """Rows: measured, predicted; mean over the strokes, linearly interpolated in each; NaN where a stroke has none."""
    prediction = damper.predict(run)
    path, inside = prediction.motion.path, run.in_window
    direction, distance = path.direction[inside], path.distance[inside]
    strokes = np.split(np.arange(distance.size), np.flatnonzero(np.diff(distance) < 0) + 1)
    whole = [s for s in strokes[1:] if distance[s[-1]] >= _DISTANCES[-1]] or strokes[1:-1] or strokes
    rows = []
    for force in (run.force, prediction.force):
        centred = direction * (force[inside] - np.mean(force[inside])) / (np.ptp(run.force[inside]) / 2)
        curves = [np.interp(_DISTANCES, distance[s], centred[s], np.nan, np.nan) for s in whole]
        rows.append(np.mean(curves, axis=0))
    return np.array(rows)
