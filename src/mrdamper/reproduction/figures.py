"""Figures of the study that no other page has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from mrdamper.dampers.modified import ModifiedFit
from mrdamper.data import Floats, Run, same_motion
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.report.plots.style import MEASURED, MM, PALETTE, current_colours, house_style, label, new_figure, thin
from mrdamper.reproduction.claims import friction_along
from mrdamper.reproduction.sensitivity import OneAtATime, Sobol
from mrdamper.reproduction.study import GeneticCheck, Reproduction
from mrdamper.reproduction.ways import CONSISTENT, LITERAL
from mrdamper.study.recipe import Scored


def friction_figure(run: Run) -> Figure:
    """Slow test: force over displacement, and the friction in it along the stroke."""
    with house_style():
        figure, axes = new_figure(1, 2, 2.9)
        axes[0].plot(MM * thin(run.displacement, 1500), thin(run.force, 1500), color=MEASURED, lw=0.6)
        label(axes[0], "Displacement (mm)", "Force (N)")
        x, friction = friction_along(run)
        axes[1].plot(MM * x, friction, color=PALETTE[1])
        axes[1].set_ylim(bottom=0)
        label(axes[1], "Displacement (mm)", "Friction (N)")
        return figure


def first_harmonic_figure(study: Reproduction) -> Figure:
    """F0 and phi over current, one colour a motion."""
    with house_style():
        figure, axes = new_figure(1, 2, 3.0, right=1.45)
        for name, points, colour in _by_motion(study):
            currents = [study.conditions[i].current_A for i in points]
            axes[0].plot(currents, [study.readings[i].amplitude for i in points], "o-", ms=3, lw=0.7, color=colour)
            phases = [study.readings[i].phase for i in points]
            axes[1].plot(currents, phases, "o-", ms=3, lw=0.7, color=colour, label=name)
        axes[1].axhspan(1.4, 1.5, color="#eeeeee", zorder=0)
        label(axes[0], "Current (A)", "F0 (N)")
        label(axes[1], "Current (A)", "Phase φ (rad)")
        axes[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
        return figure


def damping_and_mass_figure(study: Reproduction) -> Figure:
    """C and m over current: closed form and consistent balance."""
    with house_style():
        figure, axes = new_figure(2, 2, 5.0)
        for row, (name, text) in enumerate((("c", "c (N s/m)"), ("m", "m (kg)"))):
            for column, title in enumerate((LITERAL, CONSISTENT)):
                panel = axes[2 * row + column]
                found = study.contender(title).identifications
                for motion, points, colour in _by_motion(study):
                    currents = [study.conditions[i].current_A for i in points]
                    values = [getattr(found[i].model, name) for i in points]
                    panel.plot(currents, values, "o-", ms=3, lw=0.7, color=colour, label=motion)
                label(panel, "Current (A)", text, title)
        axes[1].legend(fontsize=6, loc="lower right")
        return figure


def functions_figure(contender: Scored, names: Sequence[str]) -> Figure:
    """Identified values and the functions through them, with R²."""
    fit = contender.fit
    assert isinstance(fit, ModifiedFit)
    shown = [name for name in names if name in fit.functions]
    units = {info.name: info.unit for info in BoucWen.parameters()} | {"yield_force": "N", "yield_displacement": "m"}
    with house_style():
        rows = -(-len(shown) // 2)
        figure, axes = new_figure(rows, 2, 2.5 * rows)
        groups = same_motion(fit.conditions, tolerance=0.08)[:8]
        shades = current_colours([fit.conditions[g[0]].peak_velocity for g in groups])
        dense = np.linspace(*fit.damper.envelope.current_A, 60)
        for panel, name in zip(axes, shown, strict=False):
            found = fit.functions[name]
            for group in groups:
                first = fit.conditions[group[0]]
                colour = shades[first.peak_velocity]
                panel.plot(
                    [fit.conditions[i].current_A for i in group], fit.values[name][group], "o", ms=3, color=colour
                )
                curve = found.function(dense, first.frequency_Hz, first.amplitude_m)
                panel.plot(dense, curve, lw=0.8, color=colour)
            if found.function.log:
                panel.set_yscale("log")
            varies = np.ptp(fit.values[name]) > 1e-9 * np.max(np.abs(fit.values[name]))
            label(
                panel,
                "Current (A)",
                f"{name} ({units[name]})",
                f"{found.function.form}, R² {found.r2:.3f}" if varies else "held",
            )
        for unused in axes[len(shown) :]:
            unused.set_visible(False)
        return figure


def genetic_figure(checks: Sequence[GeneticCheck]) -> Figure:
    """Lowest error over the generations, above the least there is."""
    with house_style():
        figure, (axes,) = new_figure(1, 1, 2.8)
        for check, colour in zip(checks, PALETTE[1:], strict=False):
            # The search sees a part of the samples; its error is carried over to all of them.
            carried = check.minimum.history * check.reached / check.minimum.cost
            excess = np.maximum(carried / check.optimum - 1, 1e-6)
            axes.semilogy(np.arange(1, excess.size + 1), excess, color=colour, label=str(check.condition))
        per_box = checks[0].minimum.history.size // len(checks[0].minimum.boxes)
        for start in range(per_box, checks[0].minimum.history.size, per_box):
            axes.axvline(start, color="#999999", lw=0.6, ls=":")
        label(axes, "Generation (dotted: a narrower box begins)", "Error above the least (–)")
        axes.legend()
        return figure


def errors_figure(study: Reproduction) -> Figure:
    """Error of every held-out run by contender, over current."""
    with house_style():
        figure, (axes,) = new_figure(1, 1, 3.2, right=2.6)
        for number, contender in enumerate(study.contenders):
            again, place = divmod(number, len(PALETTE))
            runs = sorted(contender.held_out.runs, key=lambda r: r.condition.current_A)
            currents = [r.condition.current_A for r in runs]
            axes.plot(
                currents,
                [100 * r.scores.nrmse_pp for r in runs],
                ("o-", "s--", "^:")[min(again, 2)],
                ms=3,
                lw=0.8,
                color=PALETTE[place],
                label=contender.recipe.title,
            )
        axes.set_ylim(bottom=0)
        label(axes, "Current (A)", "nrmse_pp of held-out runs (%)")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
        return figure


def seeds_figure(errors: dict[str, Floats]) -> Figure:
    """Held-out error over noise seeds."""
    with house_style():
        figure, (axes,) = new_figure(1, 1, 2.4, left=2.2)
        for row, values in enumerate(errors.values()):
            axes.plot(100 * values, np.full(values.size, row), "|", ms=9, color=PALETTE[1])
        axes.set_yticks(range(len(errors)), list(errors))
        axes.set_ylim(-0.6, len(errors) - 0.4)
        axes.set_xlim(left=0)
        label(axes, "Median nrmse_pp of the held-out runs (%), one mark a seed", "")
        return figure


def sensitivity_figure(single: Sequence[OneAtATime], indices: Sobol | None) -> Figure:
    """One-at-a-time effects, what is left after identifying anew, and Sobol indices."""
    with house_style():
        figure, axes = new_figure(1, 2, 3.0)
        names = [s.name for s in single]
        rows = np.arange(len(names))
        axes[0].barh(rows, [s.effect for s in single], color=PALETTE[6], label="others held")
        axes[0].plot(
            [max(s.left, 1e-8) for s in single], rows, "o", ms=4, color=PALETTE[2], label="others identified anew"
        )
        axes[0].set_xscale("log")
        axes[0].set_yticks(rows, names)
        axes[0].legend(fontsize=7, loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
        label(axes[0], f"Change of force for {100 * single[0].change:.0f} % (of its deviation)", "")
        if indices is not None:
            axes[1].barh(np.arange(len(indices.names)), indices.total, xerr=indices.total_confidence, color=PALETTE[6])
            axes[1].set_yticks(np.arange(len(indices.names)), list(indices.names))
            label(axes[1], f"Total Sobol index, all parameters ±{100 * indices.spread:.0f} %", "")
        else:
            axes[1].set_visible(False)
        return figure


def _by_motion(study: Reproduction) -> list[tuple[str, list[int], tuple[float, ...]]]:
    groups = same_motion(study.conditions, tolerance=0.08)
    shades = current_colours([study.conditions[g[0]].peak_velocity for g in groups])
    found = []
    for group in groups:
        first = study.conditions[group[0]]
        ordered = sorted(group, key=lambda i: study.conditions[i].current_A)
        found.append(
            (f"{first.frequency_Hz:.2g} Hz, {MM * first.amplitude_m:.3g} mm", ordered, shades[first.peak_velocity])
        )
    return found
