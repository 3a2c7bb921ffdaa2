"""Force over the distance since the last reversal, which shows free play."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.data import Floats, Run
from mrdamper.report.plots.figure import Figure, new_figure
from mrdamper.report.plots.style import MM, PREDICTED, current_colours, levels

_FARTHEST = 1.5e-3  # m


def force_since_reversal(runs: Sequence[Run], damper: Damper) -> Figure:
    """Draw the mean force along the motion over the distance since the reversal, by current; thin lines: predicted."""
    figure, axes = new_figure(1, 1, 3.0, right=1.2)
    steps = levels([run.mean_current for run in runs])
    colours = current_colours(steps)
    bins = np.concatenate([np.linspace(0, 0.6e-3, 31), np.linspace(0.65e-3, _FARTHEST, 18)])
    middle = (bins[1:] + bins[:-1]) / 2
    for current, colour in colours.items():
        members = [run for step, run in zip(steps, runs, strict=True) if step == current]
        curves = np.array([_means(run, damper, bins) for run in members])
        counts = np.isfinite(curves).sum(axis=0)
        mean = np.where(counts > 0, np.nansum(curves, axis=0) / np.maximum(counts, 1), np.nan)
        for row, (width, shade) in enumerate(((1.8, colour), (0.8, PREDICTED))):
            finite = np.isfinite(mean[row])
            axes.plot(MM * middle[finite], mean[row][finite], lw=width, color=shade)
        axes.plot([], [], color=colour, lw=1.8, label=f"{current:g} A")
    axes.plot([], [], color=PREDICTED, lw=0.8, label="predicted")
    axes.legend("right")
    axes.x.low, axes.x.high = 0.0, MM * _FARTHEST
    axes.label("Distance since the reversal (mm)", "Force along the motion over its peak (–)")
    return figure


def _means(run: Run, damper: Damper, bins: Floats) -> Floats:
    """Rows: measured, predicted; mean in each bin, linearly interpolated in bins without a sample."""
    prediction = damper.predict(run)
    path, inside = prediction.motion.path, run.in_window
    direction, distance = path.direction[inside], path.distance[inside]
    peak = np.ptp(run.force[inside]) / 2
    index = np.digitize(distance, bins) - 1
    rows = []
    for force in (run.force, prediction.force):
        centred = direction * (force[inside] - np.mean(force[inside])) / peak
        valid = index < bins.size - 1
        total = np.bincount(index[valid], centred[valid], minlength=bins.size - 1)
        count = np.bincount(index[valid], minlength=bins.size - 1)
        full = np.flatnonzero(count)
        rows.append(np.interp(np.arange(count.size), full, total[full] / count[full], np.nan, np.nan))
    return np.array(rows)
