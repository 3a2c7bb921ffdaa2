"""Figures of the measured tests: matrix, loops, and quantities of the loops without a model."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mrdamper.data import Dataset, same_motion
from mrdamper.identification.loop_analysis import DynamicRange, LoopAnalysis
from mrdamper.physics.motion import centred_motion
from mrdamper.report.plots.cycle import draw_loop, last_cycle, spread_out
from mrdamper.report.plots.drawing import INCH
from mrdamper.report.plots.figure import Axes, Figure, new_figure
from mrdamper.report.plots.style import KN, MM, MOST_NAMED, current_colours, levels, motion_colours, motion_name

_BESIDE = 0.07  # inches between the marks of two currents
_MOST_MOTIONS = 5  # of the loops at one current


def test_matrix(loops: Sequence[LoopAnalysis]) -> Figure:
    """Draw measured frequency over amplitude, one colour per current; hollow marks are validation runs."""
    steps = levels([loop.condition.current_A for loop in loops])
    colours = current_colours(steps)
    entries = len({(step, loop.split) for step, loop in zip(steps, loops, strict=True)})
    figure, axes = new_figure(1, 1, max(3.0, 0.8 + 0.16 * entries), right=1.7)
    for number, (current, colour) in enumerate(colours.items()):
        # Marks of one motion are drawn side by side, one per current.
        aside = (number - (len(colours) - 1) / 2) * _BESIDE
        for split, face in (("train", colour), ("validate", "none")):
            pairs = zip(steps, loops, strict=True)
            chosen = [loop.condition for step, loop in pairs if step == current and loop.split == split]
            if not chosen:
                continue
            x, y = [c.frequency_Hz for c in chosen], [MM * c.amplitude_m for c in chosen]
            name = f"{current:g} A" + ("" if split == "train" else ", validation")
            axes.plot(x, y, "o", ms=5, color=colour, mfc=face, mew=1.1, shift=aside, label=name)
    axes.label("Frequency (Hz)", "Amplitude (mm)")
    wide, beside = axes.width / INCH, (len(colours) / 2 + 1) * _BESIDE
    axes.x.margin = beside / (wide - 2 * beside)
    axes.y.low = 0.0
    axes.legend("right")
    return figure


def measured_loops(dataset: Dataset, loops: Sequence[LoopAnalysis]) -> Figure:
    """Force–displacement and force–velocity loops: over current, then over the motion at one current."""
    figure, *axes = new_figure(2, 2, 5.6, right=1.7)
    over_current = _over_current(loops)
    colours = current_colours(list(over_current))
    for current, loop in over_current.items():
        _draw_loop(axes[0], axes[1], dataset, loop, f"{current:g} A", colours[current])
    first = next(iter(over_current.values())).condition
    axes[0].title = f"{first.frequency_Hz:.3g} Hz, {MM * first.amplitude_m:.3g} mm"
    axes[1].legend("right")

    over_motion = _over_motion(loops)
    shades = current_colours([loop.condition.peak_velocity for loop in over_motion])
    for loop in over_motion:
        name, colour = motion_name(loop.condition), shades[loop.condition.peak_velocity]
        _draw_loop(axes[2], axes[3], dataset, loop, name, colour)
    axes[2].title = f"{over_motion[0].condition.current_A:.3g} A"
    axes[3].legend("right")
    return figure


def test_analysis(loops: Sequence[LoopAnalysis], ranges: Sequence[DynamicRange]) -> Figure:
    """Peak force, dissipated energy, equivalent damping and dynamic range over current."""
    figure, *axes = new_figure(2, 2, 5.2, right=1.75)
    quantities: list[tuple[str, Callable[[LoopAnalysis], float]]] = [
        ("Peak force (N)", lambda loop: loop.peak_force),
        ("Dissipated energy (J per cycle)", lambda loop: loop.dissipated_energy),
        ("Equivalent damping (kN s/m)", lambda loop: KN * loop.equivalent_damping),
    ]
    groups = [[loops[i] for i in g] for g in same_motion([loop.condition for loop in loops])]
    groups.sort(key=lambda g: g[0].condition.peak_velocity)
    shades = motion_colours(figure, [group[0].condition for group in groups])
    for panel, (name, value) in zip(axes, quantities, strict=False):
        for group in groups:
            condition = group[0].condition
            ordered = sorted(group, key=lambda loop: loop.condition.current_A)
            currents, text = [loop.condition.current_A for loop in ordered], motion_name(condition)
            style = {"ls": "-", "ms": 3.5, "color": shades[condition.peak_velocity], "label": text}
            panel.plot(currents, [value(loop) for loop in ordered], "o", **style)
        panel.label("Current (A)", name)
        panel.y.low = 0.0
    for entry in ranges:
        speed = min(shades, key=lambda s: abs(s - 2 * np.pi * entry.frequency_Hz * entry.amplitude_m))
        axes[3].plot(entry.currents_A, entry.ratios, "o", ls="-", ms=3.5, color=shades[speed])
    axes[3].label("Current (A)", "Dynamic range (–)")
    if ranges:
        axes[3].y.low = 0.0
    else:
        axes[3].text(0.5, 0.5, "no motion was tested at two currents", anchor="middle")
    if len(groups) <= MOST_NAMED:
        axes[1].legend("right")
    return figure


def _over_current(loops: Sequence[LoopAnalysis]) -> dict[float, LoopAnalysis]:
    """Return the motion tested at the most currents, by current."""
    steps = levels([loop.condition.current_A for loop in loops])
    best = max(same_motion([loop.condition for loop in loops]), key=lambda g: len({steps[i] for i in g}))
    return dict(sorted({steps[i]: loops[i] for i in best}.items()))


def _over_motion(loops: Sequence[LoopAnalysis]) -> list[LoopAnalysis]:
    steps = levels([loop.condition.current_A for loop in loops])
    common = max(sorted(set(steps)), key=steps.count)
    chosen = [loop for step, loop in zip(steps, loops, strict=True) if step == common]
    chosen.sort(key=lambda loop: loop.condition.peak_velocity)
    return spread_out(chosen, _MOST_MOTIONS)


def _draw_loop(left: Axes, right: Axes, dataset: Dataset, loop: LoopAnalysis, name: str, colour: str) -> None:
    run = dataset[loop.run_id]
    last = last_cycle(run, loop.condition.frequency_Hz)
    draw_loop((left, right), centred_motion(run).part(last), run.force[last], color=colour, label=name)
    left.label("Displacement (mm)", "Force (N)")
    right.label("Velocity (m/s)", "Force (N)")
