"""Figures of the tests: peak force over peak velocity (PVP), force through the cycle (CVP)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from mrdamper.data import Dataset
from mrdamper.identification.characteristics import Characteristics
from mrdamper.identification.loop_analysis import whole_cycles
from mrdamper.physics.motion import analyse_motion, measured_motion
from mrdamper.report.plots.style import MM, current_colours, house_style, label, new_figure, thin

_MARKS = ("o", "s", "^", "D", "v", "P")


def peak_velocity_plot(
    specimens: Mapping[str, Characteristics], limits: Sequence[tuple[float, float, float, float]] = ()
) -> Figure:
    """Draw peak force over peak velocity (PVP), rebound above and compression below, gas force subtracted.

    Parameters
    ----------
    specimens : mapping of str to Characteristics
        Currents are distinguished by colour, specimens by mark.
    limits : sequence of (float, float, float, float)
        Current [A], velocity [m/s], lower and upper force [N] of each limit, drawn as a bar.
    """
    with house_style():
        figure, (axes,) = new_figure(1, 1, 4.2, right=1.9)
        colours = current_colours([c for specimen in specimens.values() for c in specimen.currents])
        for mark, (name, specimen) in zip(_MARKS * len(specimens), specimens.items(), strict=False):
            for current in specimen.currents:
                strokes = specimen.at(current)
                for side, sign in ((0, 1.0), (1, -1.0)):
                    ordered = sorted(strokes, key=lambda s: s.peak_velocity[side])
                    axes.plot(
                        [s.peak_velocity[side] for s in ordered],
                        [sign * specimen.damping_force(s, side) for s in ordered],
                        marker=mark,
                        ms=3.5,
                        lw=1.0,
                        ls="-" if mark == _MARKS[0] else "--",
                        color=colours[current],
                        label=_key(name, current, specimens) if side == 0 else None,
                    )
        for current, velocity, lower, upper in limits:
            near = min(colours, key=lambda level: abs(level - current))
            axes.plot([velocity, velocity], [lower, upper], color=colours[near], marker="_", ms=9, mew=1.4, lw=1.4)
        axes.axhline(0, color="black", lw=0.6)
        label(axes, "Peak velocity (m/s)", "Peak force, gas force subtracted (N)")
        axes.set_xlim(left=0)
        axes.text(0.01, 0.98, "rebound", transform=axes.transAxes, va="top", fontsize=8)
        axes.text(0.01, 0.02, "compression", transform=axes.transAxes, va="bottom", fontsize=8)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        return figure


def continuous_velocity_plot(dataset: Dataset, specimen: Characteristics) -> Figure:
    """Draw force over velocity and displacement (CVP) of the fastest motion at each current."""
    with house_style():
        figure, axes = new_figure(1, 2, 3.4)
        colours = current_colours(list(specimen.currents))
        for current in specimen.currents:
            stroke = specimen.at(current)[-1]
            run = dataset[stroke.run_id].steady()
            motion = measured_motion(run).about(analyse_motion(run).series.mean)
            whole = whole_cycles(run.time, stroke.condition.frequency_Hz)
            one = whole_cycles(run.time[: whole.stop], stroke.condition.frequency_Hz / 1.02)
            size = min(one.stop, round(whole.stop / max(1.0, analyse_motion(run).cycles)) + 1)
            last = slice(max(0, whole.stop - size), whole.stop)
            x, v, force = (thin(array[last]) for array in (motion.displacement, motion.velocity, run.force))
            c = stroke.condition
            name = f"{current:g} A, {c.frequency_Hz:.2g} Hz, {MM * c.amplitude_m:.3g} mm"
            axes[0].plot(v, force, color=colours[current], label=name)
            axes[1].plot(MM * x, force, color=colours[current], label=name)
        label(axes[0], "Velocity (m/s)", "Force (N)", "(a)")
        label(axes[1], "Displacement (mm)", "Force (N)", "(b)")
        axes[0].legend(loc="upper left", fontsize=7)
        low, high = axes[0].get_ylim()
        axes[0].set_ylim(low, high + 0.07 * len(specimen.currents) * (high - low))
        return figure


def figures_over_current(specimens: Mapping[str, Characteristics]) -> Figure:
    """Draw mean resisting force and zero-force velocity over peak velocity, one line per current."""
    with house_style():
        figure, axes = new_figure(1, 2, 3.2, right=1.9)
        colours = current_colours([c for specimen in specimens.values() for c in specimen.currents])
        for mark, (name, specimen) in zip(_MARKS * len(specimens), specimens.items(), strict=False):
            for current in specimen.currents:
                strokes = specimen.at(current)
                speed = [s.condition.peak_velocity for s in strokes]
                style = {"marker": mark, "ms": 3.5, "lw": 0, "color": colours[current]}
                axes[0].plot(speed, [s.energy / (4 * s.condition.amplitude_m) for s in strokes], **style)
                named = _key(name, current, specimens)
                axes[1].plot(speed, [1e3 * s.zero_force_velocity for s in strokes], label=named, **style)
        label(axes[0], "Peak velocity (m/s)", "Mean force, W / 4X (N)", "(a)")
        label(axes[1], "Peak velocity (m/s)", "Zero-force velocity (mm/s)", "(b)")
        for panel in axes:
            panel.xaxis.set_major_locator(MaxNLocator(4))
            panel.set_xlim(left=0)
            panel.set_ylim(bottom=0)
        axes[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        return figure


def _key(name: str, current: float, specimens: Mapping[str, Characteristics]) -> str:
    return f"{current:g} A" if len(specimens) == 1 else f"{name}, {current:g} A"
