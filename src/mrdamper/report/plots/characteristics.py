"""Figures of the tests: peak force over peak velocity (PVP), force through the cycle (CVP)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from mrdamper.data import Dataset
from mrdamper.identification.characteristics import Characteristics
from mrdamper.physics.motion import centred_motion
from mrdamper.report.plots.cycle import draw_loop, last_cycle
from mrdamper.report.plots.figure import Figure, new_figure
from mrdamper.report.plots.style import current_colours, motion_name

_MARKS = ("o", "s", "^", "D", "v", "P")


def peak_velocity_plot(
    specimens: Mapping[str, Characteristics], limits: Sequence[tuple[float, float, float, float]] = ()
) -> Figure:
    """Draw peak force over peak velocity (PVP), rebound above and compression below, gas force subtracted.

    Currents are distinguished by colour, specimens by mark. Limits are current [A], velocity [m/s], lower and upper
    force [N], each drawn as a bar.
    """
    figure, axes = new_figure(1, 1, 4.2, right=1.9)
    colours = _colours(specimens)
    for mark, key, specimen, current in _series(specimens):
        strokes = specimen.at(current)
        for side, sign in ((0, 1.0), (1, -1.0)):
            x = [s.peak_velocity[side] for s in strokes]
            y = [sign * specimen.damping_force(s, side) for s in strokes]
            speeds, forces = specimen.curve(current, side)
            axes.plot(speeds, sign * forces, ls="-" if mark == _MARKS[0] else "--", lw=1.0, color=colours[current])
            axes.plot(x, y, mark, label="" if side else key, ms=3.5, color=colours[current])
    for current, velocity, lower, upper in limits:
        near = min(colours, key=lambda level: abs(level - current))
        axes.plot([velocity, velocity], [lower, upper], color=colours[near], lw=1.4)
        axes.plot([velocity, velocity], [lower, upper], "_", color=colours[near], ms=9, mew=1.4)
    axes.line("x", 0)
    axes.label("Peak velocity (m/s)", "Peak force, gas force subtracted (N)")
    axes.x.low = 0.0
    axes.text(0.01, 0.95, "rebound")
    axes.text(0.01, 0.02, "compression")
    axes.legend("right")
    return figure


def continuous_velocity_plot(dataset: Dataset, specimen: Characteristics) -> Figure:
    """Draw force over velocity and displacement (CVP) of the fastest motion at each current."""
    figure, *axes = new_figure(1, 2, 3.4)
    colours = current_colours(list(specimen.currents))
    for current in specimen.currents:
        stroke = specimen.at(current)[-1]
        run = dataset[stroke.run_id]
        last = last_cycle(run, stroke.condition.frequency_Hz)
        name = f"{current:g} A, {motion_name(stroke.condition)}"
        draw_loop(axes[::-1], centred_motion(run).part(last), run.force[last], color=colours[current], label=name)
    axes[0].label("Velocity (m/s)", "Force (N)")
    axes[1].label("Displacement (mm)", "Force (N)")
    low, high = axes[0].ends()[1]
    axes[0].y.high = high + 0.07 * len(specimen.currents) * (high - low)
    axes[0].legend("upper left", size=7)
    return figure


def figures_over_current(specimens: Mapping[str, Characteristics]) -> Figure:
    """Draw mean resisting force and zero-force velocity over peak velocity, one line per current."""
    figure, *axes = new_figure(1, 2, 3.2, right=1.9)
    colours = _colours(specimens)
    for mark, key, specimen, current in _series(specimens):
        strokes = specimen.at(current)
        speed = [s.condition.peak_velocity for s in strokes]
        style = {"mark": mark, "ms": 3.5, "color": colours[current], "label": key}
        axes[0].plot(speed, [s.energy / (4 * s.condition.amplitude_m) for s in strokes], **style)
        axes[1].plot(speed, [1e3 * s.zero_force_velocity for s in strokes], **style)
    axes[0].label("Peak velocity (m/s)", "Mean force, W / 4X (N)")
    axes[1].label("Peak velocity (m/s)", "Zero-force velocity (mm/s)")
    for panel in axes:
        panel.x.low = panel.y.low = 0.0
    axes[1].legend("right")
    return figure


def _colours(specimens: Mapping[str, Characteristics]) -> dict[float, str]:
    return current_colours([current for specimen in specimens.values() for current in specimen.currents])


def _series(specimens: Mapping[str, Characteristics]) -> Iterator[tuple[str, str, Characteristics, float]]:
    """Mark, name in the legend, specimen and current of every series."""
    for mark, (name, specimen) in zip(_MARKS * len(specimens), specimens.items(), strict=False):
        for current in specimen.currents:
            key = f"{current:g} A" if len(specimens) == 1 else f"{name}, {current:g} A"
            yield mark, key, specimen, current
