"""Comparison of models: scores of every entry, and loops of measured runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.data import Run
from mrdamper.physics.motion import centred_motion, equivalent_sine
from mrdamper.report.plots.figure import Figure, room_beside
from mrdamper.report.plots.style import MEASURED, MM, PALETTE


def ranking(scores: Mapping[str, tuple[float, float, float]]) -> Figure:
    """Draw the median error of every model, best first: identification, cross-validation, validation runs."""
    figure = Figure(1, 1, 0.9 + 0.24 * len(scores), left=room_beside(scores), right=0.3)
    (axes,) = figure.axes
    rows = np.arange(len(scores))[::-1]
    marks = zip(
        ("identification", "cross-validation", "validation"), "osD", (PALETTE[i] for i in (6, 1, 2)), strict=True
    )
    for column, (name, mark, colour) in enumerate(marks):
        values = 100 * np.array([entry[column] for entry in scores.values()])
        axes.plot(values, rows, mark, ms=4.5, color=colour, label=name)
    axes.y.places, axes.y.texts, axes.x.log = rows.tolist(), list(scores), True
    axes.y.low, axes.y.high = -0.7, len(scores) - 0.3
    axes.label("nrmse_pp (%), median over runs", "")
    axes.legend("above", columns=3)
    return figure


def overlaid_loops(runs: Sequence[Run], dampers: Mapping[str, Damper]) -> Figure:
    """Draw the last measured cycle of each run, one per row, with the loops of some dampers."""
    figure = Figure(len(runs), 2, 0.7 + 2.5 * len(runs))
    for row, run in enumerate(runs):
        sine = equivalent_sine(run)
        motion = centred_motion(run)
        last = int(np.flatnonzero(run.in_window)[-1])
        first = int(np.searchsorted(run.time, run.time[last] - 1 / sine.condition.frequency_Hz))
        cycle = slice(max(first - 1, 0), last + 1, max(1, (last - first) // 400))
        curves: list[tuple[str, Any, dict[str, Any]]] = [
            ("measured", run.force, {"color": MEASURED, "lw": 1.8, "alpha": 0.55})
        ]
        for number, (title, damper) in enumerate(dampers.items()):
            style = {"color": PALETTE[1 + number % (len(PALETTE) - 2)], "lw": 0.9}
            curves.append((title, damper.force_along(motion, sine.condition), style))
        left, right = figure.axes[2 * row : 2 * row + 2]
        for title, force, style in curves:
            left.plot(MM * motion.displacement[cycle], force[cycle], label=title, **style)
            right.plot(motion.velocity[cycle], force[cycle], **style)
        left.label("Displacement (mm)", "Force (N)", str(sine.condition))
        right.label("Velocity (m/s)", "Force (N)")
    figure.axes[0].legend(size=6.5)
    return figure
