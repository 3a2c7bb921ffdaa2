"""Comparison of models: scores of every entry, and loops of measured runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.data import Run
from mrdamper.physics.motion import centred_motion, equivalent_sine
from mrdamper.report.plots.cycle import draw_loop, last_cycle
from mrdamper.report.plots.figure import Figure, new_figure, room_beside
from mrdamper.report.plots.style import MEASURED, PALETTE


def ranking(scores: Mapping[str, tuple[float, float, float]]) -> Figure:
    """Draw the median error of every model, best first: identification, cross-validation, validation runs."""
    figure, axes = new_figure(1, 1, 0.9 + 0.24 * len(scores), left=room_beside(scores), right=0.3)
    rows = np.arange(len(scores))[::-1]
    marks = zip(
        ("identification", "cross-validation", "validation"), "osD", (PALETTE[i] for i in (6, 1, 2)), strict=True
    )
    for column, (name, mark, colour) in enumerate(marks):
        values = 100 * np.array([entry[column] for entry in scores.values()])
        if np.isfinite(values).any():
            axes.plot(values, rows, mark, ms=4.5, color=colour, label=name)
    axes.y.places, axes.y.texts, axes.x.log = rows.tolist(), list(scores), True
    axes.y.low, axes.y.high = -0.7, len(scores) - 0.3
    axes.label("nrmse_pp (%), median over runs", "")
    axes.legend("above", columns=3)
    return figure


def overlaid_loops(runs: Sequence[Run], dampers: Mapping[str, Damper]) -> Figure:
    """Draw the last measured cycle of each run, one per row, with the loops of some dampers."""
    figure = Figure(len(runs), 2, 0.9 + 2.5 * len(runs), top=0.5)
    for row, run in enumerate(runs):
        condition, motion = equivalent_sine(run).condition, centred_motion(run)
        last = last_cycle(run, condition.frequency_Hz)
        left, right = panels = figure.axes[2 * row : 2 * row + 2]
        draw_loop(panels, motion.part(last), run.force[last], label="measured", color=MEASURED, lw=1.8, alpha=0.55)
        for number, (title, damper) in enumerate(dampers.items()):
            force, colour = damper.force_along(motion, condition)[last], PALETTE[1 + number % (len(PALETTE) - 2)]
            draw_loop(panels, motion.part(last), force, label=title, color=colour, lw=0.9)
        left.label("Displacement (mm)", "Force (N)", str(condition))
        right.label("Velocity (m/s)", "Force (N)")
    figure.axes[0].legend("above", size=6.5, columns=1 + len(dampers))
    return figure
