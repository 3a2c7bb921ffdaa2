"""Figures of identified parameters, predicted loops, errors and residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mrdamper.dampers.bands import band
from mrdamper.dampers.base import Damper
from mrdamper.dampers.modified import ModifiedFit
from mrdamper.data import Floats, Run, same_motion
from mrdamper.physics.motion import equivalent_sine
from mrdamper.report.plots.cycle import draw_loop, last_cycle
from mrdamper.report.plots.figure import Figure, new_figure, room_beside
from mrdamper.report.plots.style import (
    MEASURED,
    MOST_NAMED,
    PALETTE,
    PREDICTED,
    current_colours,
    levels,
    motion_colours,
    motion_name,
    powered,
)
from mrdamper.study.validation import Validation

BAND_LEVEL = 0.9  # level of the prediction intervals of reports
_WORST_SHOWN = 25.0  # per cent; a run beyond is drawn as an arrow at the edge
_AXES = {
    "c": ("Viscous damping c (N s/m)", 1.0),
    "fy": ("Yield force (N)", 1.0),
    "yield_force": ("Yield force (N)", 1.0),
    "yield_displacement": ("Yield displacement (mm)", 1e3),
    "k1": ("Stiffness k1 (N/m)", 1.0),
    "k3": ("Cubic stiffness k3 (N/m³)", 1.0),
    "f0": ("Offset force f0 (N)", 1.0),
    "m": ("Equivalent mass m (kg)", 1.0),
}


def predicted_loops(damper: Damper, runs: Sequence[Run]) -> Figure:
    """Measured and predicted force–velocity and force–displacement loops, last cycle in the window."""
    columns = 2 if len(runs) in (1, 2, 4) else 3
    figure, *axes = new_figure(2 * -(-len(runs) // columns), columns, 4.6 * -(-len(runs) // columns))
    for number, run in enumerate(runs):
        row, column = divmod(number, columns)
        over_x, over_v = panels = axes[2 * row * columns + column], axes[(2 * row + 1) * columns + column]
        prediction = damper.predict(run)
        last = last_cycle(run, prediction.condition.frequency_Hz)
        motion = prediction.motion.part(last)
        curves: list[tuple[Floats, dict[str, Any]]] = [(run.force[last], {"color": MEASURED, "label": "measured"})]
        if around := band(damper, prediction, BAND_LEVEL, last):
            edge = {"color": PREDICTED, "lw": 0.6, "ls": ":"}
            curves += [(around.low, edge), (around.high, {**edge, "label": f"{100 * BAND_LEVEL:.0f} % interval"})]
        curves.append((prediction.force[last], {"color": PREDICTED, "label": "predicted"}))
        for force, look in curves:
            draw_loop(panels, motion, force, **look)
        over_x.size = over_v.size = 9.0 if columns == 2 else 7.0  # a condition as title fits its column
        over_x.label("Displacement (mm)", "Force (N)" if column == 0 else "", str(prediction.condition))
        over_v.label("Velocity (m/s)", "Force (N)" if column == 0 else "")
    axes[0].legend("center", size=7)
    return figure


def motions_of(fit: ModifiedFit) -> list[list[int]]:
    """Return the conditions of each motion by their position; up to `MOST_NAMED` motions have a curve each."""
    return same_motion(fit.conditions, tolerance=0.08)


def parameter_curves(fit: ModifiedFit) -> Figure:
    """Return identified values over current, one colour per motion, and the fitted functions."""
    names = [name for name in fit.functions if np.ptp(fit.values[name]) > 0] or list(fit.functions)
    rows = -(-len(names) // 2)
    figure, *axes = new_figure(rows, 2, 2.5 * rows, right=1.75)
    groups = sorted(motions_of(fit), key=lambda g: fit.conditions[g[0]].peak_velocity)
    few, firsts = len(groups) <= MOST_NAMED, [fit.conditions[g[0]] for g in groups]
    shades = motion_colours(figure, firsts)
    dense = np.linspace(0, fit.damper.envelope.current_A[1], 60)
    middle = fit.conditions[len(fit.conditions) // 2]
    lines = firsts if few else [middle]
    for panel, name in zip(axes, names, strict=False):
        function = fit.functions[name].function
        text, scale = _AXES.get(name, (name, 1.0))
        curves = [scale * function(dense, c.frequency_Hz, c.amplitude_m) for c in lines]
        largest = float(np.max(np.abs([*np.ravel(curves), *np.ravel(scale * np.asarray(fit.values[name]))])))
        text, more = powered(text, 0.0 if function.log else largest)
        for first, group in zip(firsts, groups, strict=True):
            currents = [fit.conditions[i].current_A for i in group]
            values = more * scale * fit.values[name][group]
            panel.plot(currents, values, "o", ms=3.5, color=shades[first.peak_velocity], label=motion_name(first))
        for condition, curve in zip(lines, curves, strict=True):
            panel.plot(dense, more * curve, lw=0.9, color=shades[condition.peak_velocity] if few else MEASURED)
        panel.y.log = function.log
        panel.label("Current (A)", text)
    if few:
        axes[min(1, len(names) - 1)].legend("right")
    return figure


def score_strip(validations: Mapping[str, Validation]) -> Figure:
    """Draw nrmse_pp of every run, a row per model and split; bars: medians, ticks: scatter, arrows: beyond 25 %."""
    figure, axes = new_figure(1, 1, 0.8 + 0.3 * len(validations), left=room_beside(validations))
    for row, validation in enumerate(validations.values()):
        colour = PALETTE[1 + row % (len(PALETTE) - 2)]
        values = 100 * np.array([run.scores.nrmse_pp for run in validation.runs])
        floors = [100 * run.floor for run in validation.runs if run.floor is not None]
        near, far = values[values <= _WORST_SHOWN], values[values > _WORST_SHOWN]
        axes.plot(near, np.full(near.size, row), "o", ms=4, color=colour, alpha=0.65)
        axes.plot(np.full(far.size, _WORST_SHOWN), np.full(far.size, row), ">", ms=5, color=colour, alpha=0.65)
        axes.plot(floors, np.full(len(floors), row - 0.25), "|", ms=5, color="#888888")
        axes.plot([min(np.median(values), _WORST_SHOWN)] * 2, [row - 0.3, row + 0.3], color=colour, lw=2.2)
    axes.y.places, axes.y.texts, axes.y.reversed, axes.y.grid = range(len(validations)), list(validations), True, False
    axes.x.low = 0.0
    axes.label("nrmse_pp (%); grey ticks: cycle-to-cycle scatter", "")
    return figure


def residual_map(damper: Damper, runs: Sequence[Run]) -> Figure:
    """Draw mean and spread of the residual over velocity and phase, relative to the peak-to-peak force."""
    figure, over_v, over_phase = new_figure(1, 2, 2.8, right=1.1, share_y=True)
    steps = levels([run.mean_current for run in runs])
    colours = current_colours(steps)
    for step, run in zip(steps, runs, strict=True):
        prediction = damper.predict(run)
        inside = run.in_window
        motion = prediction.motion.part(inside)
        error = 100 * (prediction.force - run.force)[inside] / np.ptp(run.force[inside])
        omega = 2 * np.pi * equivalent_sine(run).condition.frequency_Hz
        phase = np.degrees(np.arctan2(motion.displacement, motion.velocity / omega)) % 360
        colour = colours[step]
        for axes, key, bins in (
            (over_v, motion.velocity / np.max(np.abs(motion.velocity)), np.linspace(-1, 1, 41)),
            (over_phase, phase, np.linspace(0, 360, 61)),
        ):
            index = np.digitize(key, bins) - 1
            mean = [error[index == i].mean() if np.any(index == i) else np.nan for i in range(bins.size - 1)]
            axes.plot((bins[1:] + bins[:-1]) / 2, mean, color=colour, lw=0.9, alpha=0.8)
    for current, colour in colours.items():
        over_phase.plot([], [], color=colour, label=f"{current:g} A")
    over_phase.legend("right")
    over_v.label("Velocity over its peak (–)", "Residual (% of peak-to-peak)")
    over_phase.label("Phase of the motion (°)", "")
    over_phase.x.places = (0, 90, 180, 270, 360)
    return figure
