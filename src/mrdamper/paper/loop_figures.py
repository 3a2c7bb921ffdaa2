"""Loops as tested, as identified and as predicted [Qian et al. 2024, Fig. 3–6, 9, 10, 24, 25]."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from mrdamper.data import Condition, Floats, Run
from mrdamper.paper.claims_on_tests import friction_along
from mrdamper.paper.recipes import CONSISTENT, LITERAL, TRADITIONAL
from mrdamper.paper.results import SAME, Reproduction
from mrdamper.physics.motion import equivalent_sine, measured_motion
from mrdamper.physics.simulation import simulate
from mrdamper.report.plots.style import (
    MEASURED,
    MM,
    PALETTE,
    PREDICTED,
    current_colours,
    house_style,
    label,
    new_figure,
    thin,
)

Made = Figure | str  # or why there is none
_MOST = 9  # loops in one panel
_LOOPS = 400  # points of a loop
_QUANTITIES: Mapping[str, tuple[Callable[[Condition], float], Callable[[Condition], str]]] = {
    "current": (lambda c: round(c.current_A, 2), lambda c: f"{c.current_A:.3g} A"),
    "frequency": (lambda c: round(np.log(c.frequency_Hz) / SAME), lambda c: f"{c.frequency_Hz:.3g} Hz"),
    "amplitude": (lambda c: round(np.log(c.amplitude_m) / SAME), lambda c: f"{MM * c.amplitude_m:.3g} mm"),
}


def friction_figure(study: Reproduction) -> Made:
    """Slow test: force over displacement, and the friction in it along the stroke."""
    run = study.friction
    if run is None:
        return "the data hold no friction test"
    with house_style():
        figure, axes = new_figure(1, 2, 2.9)
        axes[0].plot(MM * thin(run.displacement, 1500), thin(run.force, 1500), color=MEASURED, lw=0.6)
        label(axes[0], "Displacement (mm)", "Force (N)")
        x, friction = friction_along(run)
        axes[1].plot(MM * x, friction, color=PALETTE[1])
        axes[1].set_ylim(bottom=0)
        label(axes[1], "Displacement (mm)", "Friction (N)")
        return figure


def loops_by(vary: str, place: int, study: Reproduction) -> Made:
    """Draw measured loops of runs that differ in one quantity, for the motion at a place in order of amplitude."""
    runs = {run.id: run for run in (*study.train, *study.held_out)}
    groups: dict[tuple[float, ...], dict[float, tuple[Run, Condition]]] = {}
    for loop in study.loops:
        fixed = tuple(key(loop.condition) for name, (key, _) in _QUANTITIES.items() if name != vary)
        groups.setdefault(fixed, {}).setdefault(
            _QUANTITIES[vary][0](loop.condition), (runs[loop.run_id], loop.condition)
        )
    most = max(map(len, groups.values()))
    if most < 2:
        return f"no two runs differ in {vary} alone"

    def order(group: dict[float, tuple[Run, Condition]]) -> tuple[bool, float, float, float]:
        first = next(iter(group.values()))[1]
        own = any(run.split == "train" for run, _ in group.values())
        return not own, first.amplitude_m, -first.current_A, first.frequency_Hz

    tested = [g for g in groups.values() if len(g) == most and not order(g)[0]] or [
        g for g in groups.values() if len(g) == most
    ]
    largest = sorted(tested, key=order)[place]
    group = [largest[key] for key in sorted(largest)][:_MOST]
    with house_style():
        figure, axes = new_figure(1, 2, 3.2, right=1.5)
        shades = current_colours([float(k) for k in range(len(group))])
        for k, (run, condition) in enumerate(group):
            x, v, force = _last_cycle(run, run.force)
            name = _QUANTITIES[vary][1](condition)
            axes[0].plot(x, force, color=shades[float(k)], lw=0.9, label=name)
            axes[1].plot(v, force, color=shades[float(k)], lw=0.9, label=name)
        same = ", ".join(text(group[0][1]) for name, (_, text) in _QUANTITIES.items() if name != vary)
        label(axes[0], "Displacement (mm)", "Force (N)", same)
        label(axes[1], "Velocity (m/s)", "Force (N)")
        axes[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
        return figure


def identified_loops(place: int, study: Reproduction) -> Made:
    """Draw tested loops with the literal identification of each, at one amplitude, a column a frequency."""
    literal = study.contender(LITERAL)
    if literal is None:
        return "the literal method could not be followed"
    known = {i.run_id: i for i in literal.identifications}
    runs = [run for run in study.amplitude_group(place) if run.id in known]
    forces = [simulate(known[run.id].model, measured_motion(run)).force for run in runs]
    return _tested_and_model(runs, forces) if runs else "no run was identified"


def predicted_loops(title: str, study: Reproduction) -> Made:
    """Draw the loops of the validation runs with the prediction of one method, all currents."""
    method = study.contender(title)
    if method is None or not method.validation.runs:
        return "nothing predicts a validation run"
    shown = [run for run in study.held_out if run.id in {score.run_id for score in method.validation.runs}]
    return _tested_and_model(shown, [method.damper.predict_run(run).force for run in shown])


def _tested_and_model(runs: Sequence[Run], forces: Sequence[Floats]) -> Figure:
    """Draw force over displacement and over velocity, a column a frequency; the model dashed."""
    conditions = [equivalent_sine(run).condition for run in runs]
    columns: dict[float, list[int]] = {}
    for i in sorted(range(len(runs)), key=lambda i: conditions[i].frequency_Hz):
        near = [f for f in columns if abs(np.log(conditions[i].frequency_Hz / f)) < SAME]
        columns.setdefault(near[0] if near else conditions[i].frequency_Hz, []).append(i)
    shown = list(columns.items())[:3]
    with house_style():
        figure, axes = new_figure(2, len(shown), 5.2, right=0.9)
        shades = current_colours([round(c.current_A, 2) for c in conditions])
        for k, (_, members) in enumerate(shown):
            for i in sorted(members, key=lambda i: conditions[i].current_A):
                colour, current = shades[round(conditions[i].current_A, 2)], f"{conditions[i].current_A:.3g} A"
                for line, force in (("-", runs[i].force), ("--", forces[i])):
                    x, v, seen = _last_cycle(runs[i], force)
                    style = {"ls": line, "lw": 0.9, "color": colour, "label": current if line == "-" else None}
                    axes[k].plot(x, seen, **style)
                    axes[len(shown) + k].plot(v, seen, **style)
            first = conditions[members[0]]
            title = f"{first.frequency_Hz:.2g} Hz, {MM * first.amplitude_m:.3g} mm"
            label(axes[k], "Displacement (mm)", "Force (N)" if k == 0 else "", title)
            label(axes[len(shown) + k], "Velocity (m/s)", "Force (N)" if k == 0 else "")
        axes[len(shown) - 1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=7)
        return figure


def predicted_over(study: Reproduction) -> Made:
    """Draw validation loops as measured, and as the literal, the consistent and the traditional model predict them."""
    shown, methods = _spread(study.held_out), study.named(LITERAL, CONSISTENT, TRADITIONAL)
    if not shown or not methods:
        return "nothing predicts a validation run"
    return _loops_beside(
        shown, {c.recipe.title: [c.damper.predict_run(run).force for run in shown] for c in methods}, "velocity"
    )


def _loops_beside(runs: Sequence[Run], curves: Mapping[str, Sequence[Floats]], channel: str) -> Figure:
    text = "Displacement (mm)" if channel == "displacement" else "Velocity (m/s)"
    with house_style():
        figure, axes = new_figure(1, len(runs), 3.1, top=0.5)
        for k, (run, panel) in enumerate(zip(runs, axes, strict=True)):
            drawn: dict[str, tuple[Floats, str, dict[str, Any]]] = {
                "tested": (run.force, MEASURED, {"lw": 1.4, "alpha": 0.6})
            }
            for (title, forces), colour in zip(curves.items(), (PREDICTED, PALETTE[1], PALETTE[3]), strict=False):
                drawn[title] = forces[k], colour, {"lw": 0.9}
            for title, (force, colour, line) in drawn.items():
                x, v, seen = _last_cycle(run, force)
                panel.plot(x if channel == "displacement" else v, seen, color=colour, label=title, **line)
            label(panel, text, "Force (N)" if k == 0 else "", str(equivalent_sine(run).condition))
            panel.title.set_fontsize(7)
        figure.legend(*axes[0].get_legend_handles_labels(), loc="upper center", ncols=1 + len(curves), fontsize=7)
        return figure


def _last_cycle(run: Run, force: Floats) -> tuple[Floats, Floats, Floats]:
    """Displacement [mm], velocity [m/s] and a force [N] in the last cycle inside a run's steady window."""
    end = run.window[1] if run.window else float(run.time[-1])
    last = (run.time <= end) & (run.time >= end - 1.02 / equivalent_sine(run).condition.frequency_Hz)
    motion = measured_motion(run)
    x, v, force = (thin(channel[last], _LOOPS) for channel in (motion.displacement, motion.velocity, force))
    return MM * x, v, force


def _spread(runs: Sequence[Run], most: int = 3) -> list[Run]:
    """Some runs over the currents."""
    ordered = sorted(runs, key=lambda run: float(np.mean(run.current)))
    picks = np.unique(np.linspace(0, len(ordered) - 1, min(most, len(ordered))).round().astype(int)) if ordered else []
    return [ordered[i] for i in picks]
