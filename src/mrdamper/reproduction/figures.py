"""The paper's figures by their numbers, and those that only this study has.

Figures 1, 2, 7 and 8 of the paper are photographs and sketches. Which of 13 to 23 shows which
parameter was not seen; the order here is that of the equations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from mrdamper.dampers.modified import ModifiedFit
from mrdamper.data import Condition, Floats, Run, same_motion
from mrdamper.errors import IdentificationError
from mrdamper.functions.fitting import FunctionFit, fit_function
from mrdamper.functions.forms import ParameterFunction, features
from mrdamper.identification import Identification
from mrdamper.identification.loop_analysis import dynamic_ranges
from mrdamper.motion import Excitation, equivalent_sine, measured_motion
from mrdamper.report.plots.rig_tests import test_analysis, test_matrix
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
from mrdamper.reproduction.claims import friction_along
from mrdamper.reproduction.found import GeneticCheck, Reproduction
from mrdamper.reproduction.sensitivity import OneAtATime, Sobol
from mrdamper.reproduction.ways import CONSISTENT, LITERAL, TRADITIONAL
from mrdamper.simulation import simulate
from mrdamper.study.recipe import Scored

Made = Figure | str  # or why there is none
_SAME = 0.08
_LIMITED = 8  # motions told apart in one panel


def figures(study: Reproduction) -> tuple[dict[str, tuple[Figure, str]], dict[str, str]]:
    """Every figure with its caption, by name, and why the others cannot be drawn."""
    drawn: dict[str, tuple[Figure, str]] = {}
    missing: dict[str, str] = {}
    for name, caption, make in _FIGURES:
        made = make(study)
        if isinstance(made, str):
            missing[name] = made
        else:
            drawn[name] = made, caption
    single, indices = study.sensitivity, study.sobol
    if single:
        drawn["sensitivity"] = (
            sensitivity_figure(single, indices),
            "Change of the force when one coordinate changes by a tenth: the others held (bars), identified anew "
            "(marks; what is less stands at 1e-8)"
            + ("; total Sobol indices with 95 % intervals (right)." if indices else "."),
        )
    return drawn, missing


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


def loops_by(vary: str) -> Callable[[Reproduction], Made]:
    """Measured loops of runs that differ in one quantity; the largest such group of the tests."""

    def make(study: Reproduction) -> Made:
        group = _group_varying(study, vary)
        if len(group) < 2:
            return f"no two runs differ in {vary} alone"
        with house_style():
            figure, axes = new_figure(1, 2, 3.2, right=1.5)
            shades = current_colours([float(k) for k in range(len(group))])
            for k, (run, condition) in enumerate(group):
                motion, force = last_cycle(run, condition)
                axes[0].plot(MM * motion.displacement, force, color=shades[float(k)], lw=0.9)
                axes[1].plot(motion.velocity, force, color=shades[float(k)], lw=0.9, label=_named(condition, vary))
            label(axes[0], "Displacement (mm)", "Force (N)", _fixed(group[0][1], vary))
            label(axes[1], "Velocity (m/s)", "")
            axes[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
            return figure

    return make


def identified_over(channel: str) -> Callable[[Reproduction], Made]:
    """Tested loops with those of the literal and the consistent identification of the same run."""

    def make(study: Reproduction) -> Made:
        shown = _spread(study.train)
        found = {
            t: {i.run_id: i for i in c.identifications} for t in (LITERAL, CONSISTENT) if (c := study.contender(t))
        }
        shown = [run for run in shown if all(run.id in known for known in found.values())]
        if not shown or not found:
            return "no run was identified both ways"
        curves = {title: [_identified_force(known[run.id], run) for run in shown] for title, known in found.items()}
        return _loops_beside(study, shown, curves, channel)

    return make


def predicted_over(channel: str) -> Callable[[Reproduction], Made]:
    """Held-out loops as measured, and as the literal, the consistent and the traditional model predict them."""

    def make(study: Reproduction) -> Made:
        shown = _spread(study.held_out)
        ways = [c for title in (LITERAL, CONSISTENT, TRADITIONAL) if (c := study.contender(title))]
        if not shown or not ways:
            return "nothing predicts a held-out run"
        curves = {c.recipe.title: [c.damper.predict_run(run).force for run in shown] for c in ways}
        return _loops_beside(study, shown, curves, channel)

    return make


def readings_figure(name: str, text: str, fit: str = "") -> Callable[[Reproduction], Made]:
    """F0, phi or f0 over current, motion by motion, with a function and its R² where one is asked for."""

    def make(study: Reproduction) -> Made:
        values = np.array([getattr(r, name) for r in study.readings])
        return by_motion(study, values, text, fit)

    return make


def parameter_figure(name: str, text: str, fit: str = "") -> Callable[[Reproduction], Made]:
    """A parameter of the literal identifications over current: fits motion by motion, or the one function of all."""

    def make(study: Reproduction) -> Made:
        contender = study.contender(LITERAL)
        if contender is None:
            return "the literal recipe could not be followed"
        values = np.array(
            [study.switches.scaled(name, float(getattr(i.model, name))) for i in contender.identifications]
        )
        whole = None
        if not fit:
            if not isinstance(contender.fit, ModifiedFit) or name not in contender.fit.functions:
                return f"{name} has no function"
            whole = contender.fit.functions[name]
        scale = study.switches.scaled(name, 1.0)
        return by_motion(study, values, text, fit, whole, log=name == "beta", scale=scale)

    return make


def by_motion(
    study: Reproduction,
    values: Floats,
    text: str,
    fit: str = "",
    whole: FunctionFit | None = None,
    *,
    log: bool = False,
    scale: float = 1.0,
) -> Made:
    """Values over current, one colour a motion; the fit of every motion, or one function of all, with its R²."""
    with house_style():
        figure, (axes,) = new_figure(1, 1, 3.4, right=2.3)
        for motion, points, colour in _by_motion(study):
            conditions = [study.conditions[i] for i in points]
            currents = np.array([c.current_A for c in conditions])
            axes.plot(currents, values[points], "o", ms=3.5, color=colour)
            dense = np.linspace(currents.min(), currents.max(), 60)
            name = motion
            try:
                curve, r2 = None, float("nan")
                if fit:
                    found = fit_function(fit, conditions, values[points], log=log)
                    curve, r2 = found.function, found.r2
                elif whole is not None:
                    curve, r2 = whole.function, _r2(values[points] / scale, whole, conditions, log)
                if curve is not None:
                    shape = curve(dense, conditions[0].frequency_Hz, conditions[0].amplitude_m)
                    axes.plot(dense, scale * shape if whole is not None else shape, lw=0.9, color=colour)
                    name = f"{motion}: R² {r2:.3f}" if np.isfinite(r2) else motion
                    if fit == "constant":  # a mean explains nothing: its value says more than an R² of zero
                        name = f"{motion}: {shape[0]:.4g}"
            except IdentificationError:
                name = f"{motion}: too few currents"
            axes.plot([], [], "o-", ms=3.5, lw=0.9, color=colour, label=name)
        if log:
            axes.set_yscale("log")
        title = "" if whole is None else f"{whole.function.form}: R² {whole.r2:.3f} over all runs"
        label(axes, "Current (A)", text, title)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
        return figure


def over_motion(
    values_of: str, over: str, text: str, form: str, source: Callable[[Reproduction], Floats | None]
) -> Callable[[Reproduction], Made]:
    """What is left of a parameter beside its current law, over frequency or speed, beside the function, with its R²."""

    def make(study: Reproduction) -> Made:
        values = source(study)
        if values is None or values.size != len(study.conditions):
            return f"{values_of} was not identified on every run"
        try:
            found = fit_function(form, study.conditions, values).function
        except IdentificationError as error:
            return str(error)
        groups, (u, text_of_axis) = _motions(study), _OVER[over]
        motions = [study.conditions[group[0]] for group in groups]
        left = beside_current_law(found, study.conditions, values)
        level = np.array([float(np.mean(left[group])) for group in groups])
        curve = np.array([float(found(0.0, c.frequency_Hz, c.amplitude_m)) for c in motions])
        r2 = 1 - np.sum((level - curve) ** 2) / max(float(np.sum((level - level.mean()) ** 2)), 1e-300)
        with house_style():
            figure, (axes,) = new_figure(1, 1, 3.0, right=2.0)
            shades = current_colours([c.peak_velocity for c in motions])
            for c, value, fitted in zip(motions, level, curve, strict=True):
                name = f"{c.frequency_Hz:.2g} Hz, {MM * c.amplitude_m:.3g} mm"
                axes.plot(u(c), value, "o", ms=4, color=shades[c.peak_velocity], label=name)
                axes.plot(u(c), fitted, "_", ms=11, mew=1.4, color=shades[c.peak_velocity])
            axes.plot([], [], "_", ms=11, mew=1.4, color=MEASURED, label="by the function")
            label(axes, text_of_axis, text, f"{form}: R² {r2:.3f} over the motions")
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
            return figure

    return make


def beside_current_law(function: ParameterFunction, conditions: Sequence[Condition], values: Floats) -> Floats:
    """Values less what the function says of the current alone [Qian et al. 2024, Eq. 24, 28, 33, 37]."""
    I, f, A = features(conditions)
    return values - (function(I, f, A) - function(np.zeros(I.size), f, A))


def accuracy_rate(study: Reproduction) -> Made:
    """Median and worst held-out error, and seconds an identification takes, by way."""
    ways = [c for c in study.contenders if c.held_out.runs]
    if not ways:
        return "nothing predicts a held-out run"
    with house_style():
        figure, axes = new_figure(1, 2, 1.0 + 0.26 * len(ways), left=2.4)
        rows = np.arange(len(ways))[::-1]
        axes[0].barh(rows, [100 * c.held_out.median() for c in ways], color=PALETTE[6], label="median")
        axes[0].plot([100 * c.held_out.worst().scores.nrmse_pp for c in ways], rows, "k|", ms=8, label="worst run")
        axes[0].set_yticks(rows, [c.recipe.title for c in ways])
        axes[0].legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, fontsize=7)
        label(axes[0], "Held-out nrmse_pp (%)", "")
        rates = [_seconds_a_run(study, c) for c in ways]
        axes[1].barh(rows, rates, color=PALETTE[3])
        axes[1].set_xscale("log")
        axes[1].xaxis.set_major_locator(LogLocator())
        axes[1].xaxis.set_minor_formatter(NullFormatter())
        axes[1].set_yticks(rows, [""] * len(ways))
        label(axes[1], "Identification, s a run", "")
        return figure


def _seconds_a_run(study: Reproduction, way: Scored) -> float:
    """Time of an identification; the paper's own is its genetic search, where that was made."""
    if way.recipe.title == LITERAL and study.ended:
        return float(np.mean([end.seconds for end in study.ended]))
    return way.seconds / max(len(way.identifications), 1)


def genetic_figure(study: Reproduction) -> Made:
    """Lowest error over the generations, above the least there is."""
    checks: Sequence[GeneticCheck] = study.genetic
    if not checks:
        return "no genetic search was made"
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


def errors_figure(study: Reproduction) -> Made:
    """Error of every held-out run by contender, over current."""
    if not any(c.held_out.runs for c in study.contenders):
        return "nothing predicts a held-out run"
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


def seeds_figure(study: Reproduction) -> Made:
    """Held-out error over noise seeds."""
    errors = study.seed_errors
    if not errors:
        return "noise seeds need a virtual rig"
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
        figure, axes = new_figure(1, 2, 3.0, left=1.3, gap=1.3)
        names = [s.name.replace("_", " ") for s in single]
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
            axes[1].set_yticks(np.arange(len(indices.names)), [name.replace("_", " ") for name in indices.names])
            label(axes[1], f"Total Sobol index, all ±{100 * indices.spread:.0f} %", "")
        else:
            axes[1].set_visible(False)
        return figure


def last_cycle(run: Run, condition: Condition) -> tuple[Excitation, Floats]:
    """Motion and force of the last cycle inside a run's steady window."""
    end = run.window[1] if run.window else float(run.time[-1])
    last = (run.time <= end) & (run.time >= end - 1.02 / condition.frequency_Hz)
    pick = np.flatnonzero(last)
    pick = pick[:: max(1, pick.size // 400)]
    return measured_motion(run).part(pick), run.force[pick]


def _loops_beside(study: Reproduction, runs: Sequence[Run], curves: dict[str, list[Floats]], channel: str) -> Figure:
    with house_style():
        figure, axes = new_figure(1, len(runs), 3.1, top=0.5)
        for k, (run, panel) in enumerate(zip(runs, axes, strict=True)):
            motion = measured_motion(run)
            condition = equivalent_sine(run).condition
            end = run.window[1] if run.window else float(run.time[-1])
            last = (run.time <= end) & (run.time >= end - 1.02 / condition.frequency_Hz)
            x = MM * motion.displacement[last] if channel == "displacement" else motion.velocity[last]
            panel.plot(thin(x), thin(run.force[last]), color=MEASURED, lw=1.4, alpha=0.6, label="tested")
            for (title, forces), colour in zip(curves.items(), (PREDICTED, PALETTE[1], PALETTE[3]), strict=False):
                panel.plot(thin(x), thin(forces[k][last]), color=colour, lw=0.9, label=title)
            label(
                panel,
                "Displacement (mm)" if channel == "displacement" else "Velocity (m/s)",
                "Force (N)" if k == 0 else "",
                str(condition),
            )
            panel.title.set_fontsize(7)
            panel.xaxis.set_major_locator(MaxNLocator(4))
        figure.legend(*axes[0].get_legend_handles_labels(), loc="upper center", ncols=1 + len(curves), fontsize=7)
        return figure


def _identified_force(found: Identification, run: Run) -> Floats:
    return simulate(found.model, measured_motion(run)).force


def _spread(runs: Sequence[Run], most: int = 3) -> list[Run]:
    """Some runs over the currents."""
    ordered = sorted(runs, key=lambda run: float(np.mean(run.current)))
    picks = np.unique(np.linspace(0, len(ordered) - 1, min(most, len(ordered))).round().astype(int)) if ordered else []
    return [ordered[i] for i in picks]


def _group_varying(study: Reproduction, vary: str) -> list[tuple[Run, Condition]]:
    """Largest group of runs that differ in one of current, frequency and amplitude alone, in its order."""
    runs = {run.id: run for run in (*study.train, *study.held_out)}
    keys = {"current": lambda c: round(c.current_A, 2), "frequency": lambda c: round(np.log(c.frequency_Hz) / _SAME),
            "amplitude": lambda c: round(np.log(c.amplitude_m) / _SAME)}  # fmt: skip
    groups: dict[tuple[object, ...], dict[object, tuple[Run, Condition]]] = {}
    for loop in study.loops:
        if loop.run_id not in runs:
            continue
        fixed = tuple(key(loop.condition) for name, key in keys.items() if name != vary)
        groups.setdefault(fixed, {}).setdefault(keys[vary](loop.condition), (runs[loop.run_id], loop.condition))
    largest = max(groups.values(), key=lambda g: (len(g), max(c.current_A for _, c in g.values())))
    return [largest[key] for key in sorted(largest)][: _LIMITED + 1]  # type: ignore[type-var]


def _named(condition: Condition, vary: str) -> str:
    texts = {"current": f"{condition.current_A:.3g} A", "frequency": f"{condition.frequency_Hz:.3g} Hz",
             "amplitude": f"{MM * condition.amplitude_m:.3g} mm"}  # fmt: skip
    return texts[vary]


def _fixed(condition: Condition, vary: str) -> str:
    return ", ".join(_named(condition, name) for name in ("current", "frequency", "amplitude") if name != vary)


def _motions(study: Reproduction) -> list[list[int]]:
    return same_motion(study.conditions, tolerance=_SAME)


def _r2(values: Floats, whole: FunctionFit, conditions: Sequence[Condition], log: bool) -> float:
    """R² of a function of all runs on the runs of one motion."""
    found = np.array([float(whole.function(c.current_A, c.frequency_Hz, c.amplitude_m)) for c in conditions])
    target, found = (np.log(values), np.log(found)) if log else (values, found)
    spread = float(np.sum((target - target.mean()) ** 2))
    return 1 - float(np.sum((found - target) ** 2)) / spread if spread > 0 else float("nan")


def _literal(name: str) -> Callable[[Reproduction], Floats | None]:
    def values(study: Reproduction) -> Floats | None:
        contender = study.contender(LITERAL)
        if contender is None:
            return None
        return np.array([study.switches.scaled(name, float(getattr(i.model, name))) for i in contender.identifications])

    return values


def _log_literal(name: str) -> Callable[[Reproduction], Floats | None]:
    def values(study: Reproduction) -> Floats | None:
        found = _literal(name)(study)
        return None if found is None else np.log(np.maximum(found, 1e-12))

    return values


def _readings(study: Reproduction) -> Floats:
    return np.array([r.amplitude for r in study.readings])


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


_OVER: dict[str, tuple[Callable[[Condition], float], str]] = {
    "frequency": (lambda c: c.frequency_Hz, "Frequency (Hz)"),
    "speed": (lambda c: MM * c.frequency_Hz * c.amplitude_m, "f · A (mm Hz)"),
}
_FIGURES: tuple[tuple[str, str, Callable[[Reproduction], Made]], ...] = (
    (
        "fig03_friction",
        "Fig. 3. Friction test at 0.01 mm/s; right: half the force between the strokes.",
        friction_figure,
    ),
    ("fig04_loops_current", "Fig. 4. Loops over current.", loops_by("current")),
    ("fig05_loops_frequency", "Fig. 5. Loops over frequency.", loops_by("frequency")),
    ("fig06_loops_amplitude", "Fig. 6. Loops over amplitude.", loops_by("amplitude")),
    (
        "fig09_identified_displacement",
        "Fig. 9. Identified against tested, over displacement.",
        identified_over("displacement"),
    ),
    ("fig10_identified_velocity", "Fig. 10. Identified against tested, over velocity.", identified_over("velocity")),
    (
        "fig11_F0",
        "Fig. 11. F0 over current, a quadratic for every motion [Eq. 23].",
        readings_figure("amplitude", "F0 (N)", "quadratic-current"),
    ),
    ("fig12_phase", "Fig. 12. Phase of the first harmonic over current.", readings_figure("phase", "Phase φ (rad)")),
    ("fig13_f0", "Fig. 13. Offset force over current.", readings_figure("offset", "f0 (N)", "constant")),
    (
        "fig14_F0_shift",
        "Fig. 14. F0 beside its common current law, over f · A [Eq. 24–25].",
        over_motion("F0", "speed", "b (N)", "quadratic-current-speed", _readings),
    ),
    ("fig15_c", "Fig. 15. c by the closed form, and its function [Eq. 26].", parameter_figure("c", "c (N s/m)")),
    (
        "fig16_m",
        "Fig. 16. m by the closed form, a quadratic for every motion [Eq. 27].",
        parameter_figure("m", "m (kg)", "quadratic-current"),
    ),
    (
        "fig17_m3",
        "Fig. 17. m beside its common current law, over frequency [Eq. 29–30].",
        over_motion("m", "frequency", "m3 (kg)", "mass-exponential", _literal("m")),
    ),
    ("fig18_m_function", "Fig. 18. m and its function [Eq. 31].", parameter_figure("m", "m (kg)")),
    (
        "fig19_alpha",
        "Fig. 19. α, a quadratic for every motion [Eq. 32].",
        parameter_figure("alpha", "α (N/m)", "quadratic-current"),
    ),
    (
        "fig20_alpha_d",
        "Fig. 20. α beside its common current law, over frequency [Eq. 33–35].",
        over_motion("alpha", "frequency", "d (N/m)", "plane", _literal("alpha")),
    ),
    (
        "fig21_beta",
        "Fig. 21. β, an exponential for every motion [Eq. 37].",
        parameter_figure("beta", "β (m⁻ⁿ)", "decaying-current"),
    ),
    (
        "fig22_beta_q",
        "Fig. 22. ln β beside its common current law, over frequency [Eq. 39–40].",
        over_motion("beta", "frequency", "ln β (–)", "mass-exponential", _log_literal("beta")),
    ),
    ("fig23_alpha_function", "Fig. 23. α and its function [Eq. 36].", parameter_figure("alpha", "α (N/m)")),
    ("fig23_beta_function", "Fig. 23. β and its function [Eq. 40].", parameter_figure("beta", "β (m⁻ⁿ)")),
    (
        "fig24_predicted_displacement",
        "Fig. 24. Held-out runs predicted, over displacement.",
        predicted_over("displacement"),
    ),
    ("fig25_predicted_velocity", "Fig. 25. Held-out runs predicted, over velocity.", predicted_over("velocity")),
    (
        "fig26_accuracy_rate",
        "Fig. 26. Accuracy on held-out runs, and seconds an identification takes, the fit over conditions shared "
        "out; “paper, literal” by its genetic search where that was made, else by the optimum it is after.",
        accuracy_rate,
    ),
    ("matrix", "Test matrix; hollow marks are held out.", lambda study: test_matrix(study.loops)),
    (
        "analysis",
        "Peak force, energy, equivalent damping and dynamic range before any model.",
        lambda study: test_analysis(study.loops, dynamic_ranges(study.loops)),
    ),
    ("genetic", "Genetic search with the paper's settings, 500 generations of 100 in each box.", genetic_figure),
    ("errors", "Error of every held-out run.", errors_figure),
    ("seeds", "Median held-out error over noise seeds.", seeds_figure),
)
