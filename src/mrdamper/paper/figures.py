"""Figures of the paper under their numbers, and those of this study, which have names.

Figures 1, 2, 7 and 8 of the paper show its damper, its rig and two schemes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from mrdamper.data import Condition, Floats, Run
from mrdamper.data.progress import Progress
from mrdamper.data.wording import number
from mrdamper.errors import IdentificationError
from mrdamper.identification.loop_analysis import dynamic_ranges
from mrdamper.paper.assumptions import SAME
from mrdamper.paper.claims_on_tests import friction_along
from mrdamper.paper.options import CONSISTENT, LITERAL, TRADITIONAL
from mrdamper.paper.results import Reproduction, function_of, motions, rate_rows, values
from mrdamper.physics.motion import equivalent_sine, measured_motion
from mrdamper.physics.simulation import simulate
from mrdamper.report.plots.comparison import overlaid_loops
from mrdamper.report.plots.cycle import draw_loop, last_cycle
from mrdamper.report.plots.figure import Axes, Figure, new_figure
from mrdamper.report.plots.rig_tests import test_analysis, test_matrix
from mrdamper.report.plots.style import (
    MEASURED,
    MM,
    PALETTE,
    Picture,
    current_colours,
    motion_name,
    picture_of,
    powered,
    thin,
)
from mrdamper.statistics.functions.fitting import fit_function
from mrdamper.statistics.functions.forms import ParameterFunction, features
from mrdamper.statistics.metrics import explained_variance

NO_SEEDS = "no noise seeds were asked for, or the data are not of the virtual rig (mrdamper reproduce --seeds 10)"
_MOST_LOOPS = 9  # in one panel
_LINE, _SMALL = 0.9, 7  # width of a line, size of the letters of a legend [pt]
_POINTS = {"mark": "o", "ms": 3.5, "lw": _LINE}

Texts = Sequence[tuple[str, str]]  # of the axes of each panel
Drawing = Figure | str  # or why there is none


@dataclass(frozen=True)
class Entry:
    """A figure: caption, place in the paper, axes, and the function that draws it."""

    title: str
    source: str  # section or equation of Qian et al. 2024; empty for figures of this study
    axes: Texts  # texts of the axes of each panel; of figures with several columns, those of one column
    make: Callable[[Reproduction, Texts], Drawing]  # of the study and the axes


def caption(name: str) -> str:
    """Return the caption of a figure, with the paper's number if it has one."""
    entry = FIGURES[name]
    number = f"Fig. {int(name[3:])}. " if name.startswith("fig") else ""
    return f"{number}{entry.title}{f' [{entry.source}]' if entry.source else ''}."


def pictures(
    study: Reproduction, also: tuple[str, ...], names: tuple[str, ...], progress: Progress
) -> dict[str, Picture | str]:
    """Draw figures by name, or state why they cannot be drawn."""
    drawn: dict[str, Picture | str] = {}
    for place, name in enumerate(names):
        progress(f"figure {name}", place / len(names))
        figure = FIGURES[name].make(study, FIGURES[name].axes)
        drawn[name] = figure if isinstance(figure, str) else picture_of(figure, also)
    return drawn


def _figure(axes: Texts, height: float, **margins: Any) -> tuple[Figure, *tuple[Axes, ...]]:
    figure, *panels = new_figure(1, len(axes), height, **margins)
    for panel, texts in zip(panels, axes, strict=True):
        panel.label(*texts)
    return figure, *panels


def _listed_above(panel: Axes) -> None:
    panel.legend("above", size=_SMALL, columns=min(sum(bool(one.label) for one in panel.series), 4))


def _name_rows(panel: Axes, names: Sequence[str]) -> None:
    """Write names on the vertical axis, from the top; row k lies at −k."""
    panel.y.places, panel.y.texts = [-row for row in range(len(names))], names


# Loops as tested, as identified and as predicted.

_QUANTITIES: Mapping[str, tuple[Callable[[Condition], float], Callable[[Condition], str]]] = {
    "current": (lambda c: round(c.current_A, 2), lambda c: f"{c.current_A:.3g} A"),
    "frequency": (lambda c: round(np.log(c.frequency_Hz) / SAME), lambda c: f"{c.frequency_Hz:.3g} Hz"),
    "amplitude": (lambda c: round(np.log(c.amplitude_m) / SAME), lambda c: f"{MM * c.amplitude_m:.3g} mm"),
}


def _friction(study: Reproduction, axes: Texts) -> Drawing:
    if study.friction is None:
        return "the data hold no friction test"
    x, force = (thin(channel, 1500) for channel in (study.friction.displacement, study.friction.force))
    at, friction = friction_along(study.friction)
    figure, slow, along = _figure(axes, 2.9)
    slow.plot(MM * x, force, color=MEASURED, lw=0.6)
    along.plot(MM * at, friction, color=PALETTE[1], lw=_LINE)
    along.y.low = 0.0
    return figure


def _loops_by(vary: str, place: int, study: Reproduction, axes: Texts) -> Drawing:
    """Draw measured loops of runs that differ in one quantity, for the motion at a place in order of amplitude."""
    groups: dict[tuple[float, ...], dict[float, tuple[Run, Condition]]] = {}
    runs = {run.id: run for run in (*study.train, *study.held_out)}
    for loop in study.loops:
        fixed = tuple(key(loop.condition) for name, (key, _) in _QUANTITIES.items() if name != vary)
        own = _QUANTITIES[vary][0](loop.condition)
        groups.setdefault(fixed, {}).setdefault(own, (runs[loop.run_id], loop.condition))
    most = max(map(len, groups.values()))
    if most < 2:
        return f"no two runs differ in {vary} alone"

    def order(group: Mapping[float, tuple[Run, Condition]]) -> tuple[float, float, float]:
        first = next(iter(group.values()))[1]
        return first.amplitude_m, -first.current_A, first.frequency_Hz

    largest = [group for group in groups.values() if len(group) == most]
    identified = [group for group in largest if any(run.split == "train" for run, _ in group.values())]
    chosen = sorted(identified or largest, key=order)[place]
    group = [chosen[key] for key in sorted(chosen)][:_MOST_LOOPS]
    shades = current_colours([float(k) for k in range(len(group))])
    figure, over_x, over_v = _figure(axes, 3.2, right=1.5)
    for k, (run, condition) in enumerate(group):
        _plot_loop((over_x, over_v), run, run.force, label=_QUANTITIES[vary][1](condition), color=shades[float(k)])
    over_x.title = ", ".join(text(group[0][1]) for name, (_, text) in _QUANTITIES.items() if name != vary)
    over_v.legend("right", size=_SMALL)
    return figure


def _identified(place: int, study: Reproduction, axes: Texts) -> Drawing:
    literal = study.contender(LITERAL)
    models = {i.run_id: i.model for i in (literal.identifications if literal else ())}
    runs = [run for run in study.amplitude_group(place) if run.id in models]
    if not runs:
        return "the literal method could not be followed"
    return _tested_and_model(axes, runs, [simulate(models[run.id], measured_motion(run)).force for run in runs])


def _predicted(title: str, study: Reproduction, axes: Texts) -> Drawing:
    method = study.contender(title)
    scored = {score.run_id for score in method.validation.runs} if method else set()
    runs = [run for run in study.held_out if run.id in scored]
    if method is None or not runs:
        return "nothing predicts a validation run"
    return _tested_and_model(axes, runs, [method.damper.predict(run).force for run in runs])


def _tested_and_model(axes: Texts, runs: Sequence[Run], forces: Sequence[Floats]) -> Figure:
    """Draw force over displacement and velocity, one column per frequency, one colour per current; the model dashed."""
    conditions = [equivalent_sine(run).condition for run in runs]
    columns: dict[float, list[int]] = {}
    for i in sorted(range(len(runs)), key=lambda i: conditions[i].frequency_Hz):
        near = [f for f in columns if abs(np.log(conditions[i].frequency_Hz / f)) < SAME]
        columns.setdefault(near[0] if near else conditions[i].frequency_Hz, []).append(i)
    shades = current_colours([round(c.current_A, 2) for c in conditions])
    shown = list(columns.values())[:3]
    figure = Figure(2, len(shown), 5.2, right=0.9)
    for column, members in enumerate(shown):
        panels = figure.axes[column :: len(shown)]
        for i in sorted(members, key=lambda i: conditions[i].current_A):
            colour = shades[round(conditions[i].current_A, 2)]
            _plot_loop(panels, runs[i], runs[i].force, label=f"{conditions[i].current_A:.3g} A", color=colour)
            _plot_loop(panels, runs[i], forces[i], color=colour, ls="--")
        for panel, (x, y) in zip(panels, axes, strict=True):
            panel.label(x, "" if column else y)
        panels[0].title = motion_name(conditions[members[0]])
    figure.axes[len(shown) - 1].legend("right", size=_SMALL)
    return figure


def _plot_loop(panels: Sequence[Axes], run: Run, force: Floats, **look: Any) -> None:
    last = last_cycle(run, equivalent_sine(run).condition.frequency_Hz)
    draw_loop(panels, measured_motion(run).part(last), force[last], lw=_LINE, **look)


def _methods_at_currents(study: Reproduction, axes: Texts) -> Drawing:
    runs = sorted(study.held_out, key=lambda run: float(np.mean(run.current)))
    dampers = {c.recipe.title: c.damper for c in study.named(LITERAL, CONSISTENT, TRADITIONAL)}
    if not runs or not dampers:
        return "nothing predicts a validation run"
    return overlaid_loops([runs[i] for i in sorted({0, len(runs) // 2, len(runs) - 1})], dampers)


# Parameters over the current for each motion, and their functions.


def _parameter(study: Reproduction, name: str) -> Floats:
    """Return F0, phi or f0 of the tests, or a literal parameter scaled to the preset A."""
    if name in ("phase", "offset"):
        return np.array([getattr(reading, name) for reading in study.readings])
    return study.options.scaled(name, 1.0) * values(study, LITERAL, name)


def _over_current(name: str, form: str, study: Reproduction, axes: Texts) -> Drawing:
    """Draw a quantity over the current, one colour per motion, with a function of each motion or of all runs."""
    values, log, whole = _parameter(study, name), name == "beta", function_of(study, name)
    if not values.size:
        return "the literal method could not be followed"
    if form == "whole" and whole is None:
        return f"{name} has no function"
    (x, y), power = axes[0], 1.0
    if not log:
        y, power = powered(y, float(np.max(np.abs(values))))
    figure, panel = _figure([(x, y)], 3.4, right=2.3)
    shades = current_colours([study.conditions[g[0]].peak_velocity for g in motions(study)])
    for group in motions(study):
        conditions = [study.conditions[i] for i in group]
        first, currents = conditions[0], np.array([c.current_A for c in conditions])
        colour = shades[first.peak_velocity]
        function, text = _function_at(study, name, form, conditions, values[group])
        panel.plot(currents, power * values[group], color=colour, ls="" if form else "-", **_POINTS)
        if function is not None:
            dense = np.linspace(currents.min(), currents.max(), 60)
            scale = power * (study.options.scaled(name, 1.0) if form == "whole" else 1.0)
            curve = scale * function(dense, first.frequency_Hz, first.amplitude_m) * np.ones(60)
            panel.plot(dense, curve, color=colour, lw=_LINE)
        name_and_fit = f"{motion_name(first)}: {text}" if text else motion_name(first)
        panel.plot([], [], label=name_and_fit, color=colour, ls="" if function is None else "-", **_POINTS)
    panel.title, panel.y.log = _r2(whole.r2, " over all runs") if whole and form == "whole" else "", log
    panel.legend("right", size=_SMALL)
    return figure


def _function_at(
    study: Reproduction, name: str, form: str, conditions: Sequence[Condition], values: Floats
) -> tuple[ParameterFunction | None, str]:
    """Return the function drawn through the values of a motion, and a note on its fit."""
    log = name == "beta"
    if form == "whole" and (whole := function_of(study, name)):
        curve = study.options.scaled(name, 1.0) * whole.function(*features(conditions))
        return whole.function, _r2(explained_variance(*((np.log(values), np.log(curve)) if log else (values, curve))))
    if not form:
        return None, ""
    try:
        fit = fit_function(form, conditions, values, log=log)
    except IdentificationError:
        return None, "too few currents"
    if form == "constant":  # R² of a mean is zero: state its value instead
        return fit.function, number(fit.function.coefficients[0])
    exact = len(fit.function.coefficients) + len(fit.function.rates) >= len(conditions)
    return fit.function, "through its points" if exact else _r2(fit.r2)


def _r2(share: float, over: str = "") -> str:
    return f"R² {share:z.3f}{over}" if np.isfinite(share) else ""


def _r2_over_motions(name: str, form: str, study: Reproduction, axes: Texts) -> Drawing:
    values = _parameter(study, name)
    if values.size != len(study.conditions):
        return f"{name} was not identified on every run"
    shares: dict[str, float] = {}
    for group in motions(study):
        with suppress(IdentificationError):
            conditions = [study.conditions[i] for i in group]
            fit = fit_function(form, conditions, values[group], log=name == "beta")
            shares[motion_name(conditions[0])] = fit.r2
    if not shares:
        return "too few currents at every motion"
    figure, panel = _figure(axes, 2.7, bottom=0.6)
    for at, (motion, share) in enumerate(shares.items()):
        panel.plot([at], [share], label=motion, color=MEASURED, **_POINTS)
    panel.x.places, panel.x.texts = range(len(shares)), [motion.replace(", ", "\n") for motion in shares]
    panel.y.low = min(0.0, *shares.values())
    return figure


def _constant_term(name: str, form: str, study: Reproduction, axes: Texts) -> Drawing:
    """Draw a quantity less its function of current, one point per motion, over frequency or f · A.

    A plane has a line an amplitude [Qian et al. 2024, Eq. 34].
    """
    values = _parameter(study, name)
    if values.size != len(study.conditions):
        return f"{name} was not identified on every run"
    values = np.log(np.maximum(values, 1e-12)) if name == "beta" else values
    try:
        function = fit_function(form, study.conditions, values).function
    except IdentificationError as error:
        return str(error)
    firsts = [study.conditions[group[0]] for group in motions(study)]
    left = beside_current_law(function, study.conditions, values)
    level = np.array([float(np.mean(left[group])) for group in motions(study)])
    fitted = np.array([float(function(0.0, c.frequency_Hz, c.amplitude_m)) for c in firsts])
    (x, y), by_speed = axes[0], name == "F0"
    y, power = powered(y, float(np.max(np.abs(level))))
    u = [MM * c.frequency_Hz * c.amplitude_m if by_speed else c.frequency_Hz for c in firsts]
    amplitudes = [round(np.log(c.amplitude_m) / SAME) for c in firsts]
    steps = amplitudes if form == "plane" else [c.peak_velocity for c in firsts]
    shades, dash = current_colours(steps), {"mark": "_", "ms": 11, "mew": 1.4}
    figure, panel = _figure([(x, y)], 3.0, right=2.0)
    for c, step, at, value, curve in zip(firsts, steps, u, power * level, power * fitted, strict=True):
        panel.plot([at], [value], label=motion_name(c), color=shades[step], **_POINTS)
        panel.plot([at], [curve], color=shades[step], **dash)
    dense = np.linspace(min(u), max(u), 40)
    lines = {step: (dense, c.amplitude_m) for step, c in zip(amplitudes, firsts, strict=True)}
    for step, (f, A) in {0: (np.ones(40), dense / MM)}.items() if by_speed else lines.items():
        color, label = (shades[step], f"{MM * A:.3g} mm") if form == "plane" else (MEASURED, "")
        panel.plot(dense, power * function(0.0, f, A) * np.ones(40), lw=0.7, alpha=0.6, color=color, label=label)
    panel.plot([], [], label="by the function", color=MEASURED, **dash)
    panel.title = _r2(explained_variance(level, fitted), " over the motions") or "one motion: no R²"
    panel.legend("right", size=_SMALL)
    return figure


def beside_current_law(function: ParameterFunction, conditions: Sequence[Condition], values: Floats) -> Floats:
    """Return values less the function of the current alone [Qian et al. 2024, Eq. 24, 28, 33, 37]."""
    I, f, A = features(conditions)
    return values - (function(I, f, A) - function(np.zeros(I.size), f, A))


# Methods compared, searches, noise seeds, sensitivities.


def _accuracy_rate(study: Reproduction, axes: Texts) -> Drawing:
    rows = [row for row in rate_rows(study) if np.isfinite(row["nrmse_pp"])]
    if not rows:
        return "nothing predicts a validation run"
    figure, *panels = _figure(axes, 2.9, top=0.5)
    scales = {"nrmse_pp": 100, "mean_relative_error": 100, "forces_until_settled": 1}
    for panel, (name, scale) in zip(panels, scales.items(), strict=True):
        panel.y.log = name == "forces_until_settled"
        for method, colour in zip(dict.fromkeys(row["method"] for row in rows), PALETTE[1:], strict=False):
            own = [(r["current_A"], scale * r[name]) for r in rows if r["method"] == method and r[name] is not None]
            x, y = np.reshape(own, (-1, 2)).T
            panel.plot(x, y, label=method, color=colour, ls="-", **_POINTS)
    _listed_above(panels[0])
    return figure


def _errors(study: Reproduction, axes: Texts) -> Drawing:
    if not study.held_out:
        return "nothing predicts a validation run"
    figure, panel = _figure(axes, 3.4, right=2.6)
    for rank, method in enumerate(study.contenders):
        again, place = divmod(rank, 7)  # yellow is hardly visible on white
        runs = sorted(method.validation.runs, key=lambda r: r.condition.current_A)
        errors = [100 * r.scores.nrmse_pp for r in runs]
        look = {"color": PALETTE[place], "ls": ("-", "--", ":")[min(again, 2)], **_POINTS}
        panel.plot([r.condition.current_A for r in runs], errors, label=method.recipe.title, **look)
    panel.y.log = True
    panel.legend("right", size=_SMALL)
    return figure


def _genetic(study: Reproduction, axes: Texts) -> Drawing:
    if not study.genetic:
        return "no genetic search was made"
    figure, panel = _figure(axes, 2.8, top=0.5)
    for check, colour in zip(study.genetic, PALETTE[1:], strict=False):
        # The search uses a part of the samples; its error is converted to that of all samples.
        carried = check.minimum.history * check.reached / check.minimum.cost
        excess = np.maximum(carried / check.optimum - 1, 1e-6)
        panel.plot(np.arange(1, excess.size + 1), excess, label=str(check.condition), color=colour, lw=_LINE)
    panel.y.log = True
    _listed_above(panel)
    return figure


def _seeds(study: Reproduction, axes: Texts) -> Drawing:
    if not study.seed_errors:
        return NO_SEEDS
    figure, panel = _figure(axes, 2.4, left=2.2)
    for row, errors in enumerate(study.seed_errors.values()):
        panel.plot(100 * errors, np.full(errors.size, -row), "|", ms=9, color=PALETTE[1])
    _name_rows(panel, list(study.seed_errors))
    panel.x.low = 0.0
    return figure


def _sensitivity(study: Reproduction, axes: Texts) -> Drawing:
    effects, indices = study.sensitivity, study.sobol
    if not effects or indices is None:
        return "no run was identified by the consistent method"
    figure, single, total = _figure(axes, 3.2, left=1.3, gap=1.3, top=0.45)
    left = [max(e.left, 1e-8) for e in effects]
    rows = -np.arange(len(effects))
    single.plot([e.effect for e in effects], rows, label="others held", color=PALETTE[6], **_POINTS)
    single.plot(left, rows, label="others identified anew", color=PALETTE[2], **_POINTS)
    single.x.log = True
    total.plot(indices.total, -np.arange(indices.total.size), color=PALETTE[6], **_POINTS)
    ends = zip(indices.total - indices.total_confidence, indices.total + indices.total_confidence, strict=True)
    for row, pair in enumerate(ends):
        total.plot(pair, [-row, -row], color=PALETTE[6], lw=_LINE)
    for panel, names in ((single, [e.name for e in effects]), (total, indices.names)):
        _name_rows(panel, [name.replace("_", " ") for name in names])
    _listed_above(single)
    return figure


_X, _V, _F = "Displacement (mm)", "Velocity (m/s)", "Force (N)"
_LOOPS, _I, _HZ = ((_X, _F), (_V, _F)), "Current (A)", "Frequency (Hz)"
_MOTION = ("Motion", "R² (–)")
FIGURES: Mapping[str, Entry] = MappingProxyType({
    "fig03": Entry("Friction at 0.01 mm/s: force, and half the force between the strokes", "section 2",
                   ((_X, _F), (_X, "Friction (N)")), _friction),
    "fig04": Entry("One current and amplitude, several frequencies", "section 2", _LOOPS,
                   partial(_loops_by, "frequency", 0)),
    "fig05": Entry("Several currents, the motion of the smallest amplitude", "section 2", _LOOPS,
                   partial(_loops_by, "current", 0)),
    "fig06": Entry("Several currents, the motion of the largest amplitude", "section 2", _LOOPS,
                   partial(_loops_by, "current", -1)),
    "fig09": Entry("Identified (dashed) and tested loops at the smaller amplitude, all currents", "section 4.3",
                   _LOOPS, partial(_identified, 0)),
    "fig10": Entry("Identified (dashed) and tested loops at the larger amplitude, all currents", "section 4.3",
                   _LOOPS, partial(_identified, -1)),
    "fig11": Entry("F0 over the current, a curve a condition", "section 5.1", ((_I, "F0 (N)"),),
                   partial(_over_current, "F0", "")),
    "fig12": Entry("F0 fitted by quadratics of the current", "Eq. 23", ((_I, "F0 (N)"),),
                   partial(_over_current, "F0", "quadratic-current")),
    "fig13": Entry("R² of the fits of Fig. 12", "Eq. 23", (_MOTION,),
                   partial(_r2_over_motions, "F0", "quadratic-current")),
    "fig14": Entry("Constant term b of F0 over f · A, a quadratic", "Eq. 25", (("f · A (mm Hz)", "b (N)"),),
                   partial(_constant_term, "F0", "quadratic-current-speed")),
    "fig15": Entry("m fitted by quadratics of the current", "Eq. 27", ((_I, "m (kg)"),),
                   partial(_over_current, "m", "quadratic-current")),
    "fig16": Entry("R² of the fits of Fig. 15", "Eq. 27", (_MOTION,),
                   partial(_r2_over_motions, "m", "quadratic-current")),
    "fig17": Entry("Constant term m3 of m over the frequency", "Eq. 30", ((_HZ, "m3 (kg)"),),
                   partial(_constant_term, "m", "mass-exponential")),
    "fig18": Entry("α fitted by quadratics of the current", "Eq. 32", ((_I, "α (N/m)"),),
                   partial(_over_current, "alpha", "quadratic-current")),
    "fig19": Entry("R² of the fits of Fig. 18", "Eq. 32", (_MOTION,),
                   partial(_r2_over_motions, "alpha", "quadratic-current")),
    "fig20": Entry("Constant term d of α over the frequency, a line an amplitude", "Eq. 34", ((_HZ, "d (N/m)"),),
                   partial(_constant_term, "alpha", "plane")),
    "fig21": Entry("β fitted by exponentials of the current", "Eq. 37", ((_I, "β (m⁻ⁿ)"),),
                   partial(_over_current, "beta", "decaying-current")),
    "fig22": Entry("R² of the fits of Fig. 21", "Eq. 37", (_MOTION,),
                   partial(_r2_over_motions, "beta", "decaying-current")),
    "fig23": Entry("Constant term q of β over the frequency, as ln β", "Eq. 39", ((_HZ, "ln β (–)"),),
                   partial(_constant_term, "beta", "mass-exponential")),
    "fig24": Entry("Modified model (dashed) and test at the prediction motion, all currents", "section 6", _LOOPS,
                   partial(_predicted, LITERAL)),
    "fig25": Entry("Traditional Bouc–Wen model (dashed) and test at the prediction motion, all currents", "section 6",
                   _LOOPS, partial(_predicted, TRADITIONAL)),
    "fig26": Entry("Accuracy and identification rate of the methods over the current at the prediction motion; rate: "
                   "forces computed until a genetic search is within 1 % of its end, for the Ali-type and the "
                   "traditional model, by least squares, until its end", "section 6, Eq. 44",
                   ((_I, "nrmse_pp (%)"), (_I, "Relative error, Eq. 44 (%)"), (_I, "Forces computed (–)")),
                   _accuracy_rate),
    "matrix": Entry("Test matrix; hollow marks are validation runs", "", (), lambda s, _: test_matrix(s.loops)),
    "analysis": Entry("Peak force, energy, equivalent damping and dynamic range before any model", "", (),
                      lambda s, _: test_analysis(s.loops, dynamic_ranges(s.loops))),
    "phase": Entry("Phase by which the first harmonic of the force leads the displacement", "Eq. 16",
                   ((_I, "Phase φ (rad)"),), partial(_over_current, "phase", "")),
    "offset": Entry("Offset force f0, and its mean for every motion", "Eq. 20", ((_I, "f0 (N)"),),
                    partial(_over_current, "offset", "constant")),
    "function_c": Entry("c by the closed form, and its function", "Eq. 26", ((_I, "c (N s/m)"),),
                        partial(_over_current, "c", "whole")),
    "function_m": Entry("m by the closed form, and its function", "Eq. 31", ((_I, "m (kg)"),),
                        partial(_over_current, "m", "whole")),
    "function_alpha": Entry("α and its function", "Eq. 36", ((_I, "α (N/m)"),),
                            partial(_over_current, "alpha", "whole")),
    "function_beta": Entry("β and its function", "Eq. 40", ((_I, "β (m⁻ⁿ)"),),
                           partial(_over_current, "beta", "whole")),
    "predicted": Entry("Validation runs: tested, and predicted by three methods", "", _LOOPS, _methods_at_currents),
    "genetic": Entry("Genetic search with the paper's settings, 500 generations of 100 in each box", "section 4.3",
                     (("Generation", "Error above the least (–)"),), _genetic),
    "errors": Entry("Error of every validation run", "", ((_I, "Validation nrmse_pp (%)"),), _errors),
    "seeds": Entry("Median validation error over noise seeds", "",
                   (("Median validation nrmse_pp (%), one mark a seed", ""),), _seeds),
    "sensitivity": Entry("Change of the force when one coordinate changes by a tenth, the others held or identified "
                         "anew (less than 1e-8 is drawn there), and total Sobol indices with 95 % intervals",
                         "section 4", (("Change of force (of its deviation)", ""), ("Total Sobol index (–)", "")),
                         _sensitivity),
})  # fmt: skip
