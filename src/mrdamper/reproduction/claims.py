"""Claim by claim: what the paper says of its damper and its method, and whether it holds here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mrdamper.dampers.modified import ModifiedFit
from mrdamper.data import Floats, Run, same_motion
from mrdamper.errors import IdentificationError
from mrdamper.functions.fitting import fit_function
from mrdamper.motion import equivalent_sine, measured_motion
from mrdamper.reproduction.study import Reproduction
from mrdamper.reproduction.ways import CONSISTENT, LITERAL, SLOWEST, TRADITIONAL

Verdict = Literal["holds", "holds in part", "does not hold", "cannot be judged"]


@dataclass(frozen=True)
class Claim:
    """One claim of the paper.

    Attributes
    ----------
    text : str
    source : str
        Equation or section of Qian et al. 2024.
    verdict : str
    evidence : str
        The numbers it rests on.
    figure : str
        Name of the figure that shows it.
    """

    text: str
    source: str
    verdict: Verdict
    evidence: str
    figure: str


def judge(study: Reproduction) -> tuple[Claim, ...]:
    """Judge every claim."""
    return tuple(check(study) for check in _CHECKS)


def friction_along(run: Run) -> tuple[Floats, Floats]:
    """Positions [m] and friction [N] of a slow test: half the force between out-stroke and in-stroke.

    At one position the gas spring is the same in both strokes and drops out.
    """
    path = measured_motion(run).path
    longest = np.argsort(np.bincount(path.stroke))[-2:]
    sweeps = []
    for stroke in longest:
        inside = path.stroke == stroke
        order = np.argsort(run.displacement[inside])
        width = max(1, order.size // 60)
        keep = order.size // width * width
        x, force = (c[inside][order][:keep].reshape(-1, width).mean(1) for c in (run.displacement, run.force))
        sweeps.append((x, force, float(np.median(path.direction[inside]))))
    (xa, fa, direction), (xb, fb, _) = sweeps
    low, high = max(xa[0], xb[0]), min(xa[-1], xb[-1])
    x = np.linspace(low + 0.05 * (high - low), high - 0.05 * (high - low), 80)
    return x, direction * (np.interp(x, xa, fa) - np.interp(x, xb, fb)) / 2


def lost_length(run: Run, damping: float) -> float:
    """Distance [m] after a reversal in which the force is back at 90 % of its mid-stroke value; median.

    The viscous force, at a damping [N s/m], is taken out: it lags the stroke end for another reason.
    """
    steady = run.steady()
    motion, centre = measured_motion(steady), equivalent_sine(run).centre
    path, force = motion.path, steady.force - np.mean(steady.force) - damping * motion.velocity
    amplitude = float(np.ptp(motion.displacement)) / 2
    middle = np.abs(motion.displacement - centre) < 0.3 * amplitude
    full = 0.9 * float(np.median((path.direction * force)[middle]))
    found = []
    for stroke in range(1, path.stroke[-1]):
        inside = path.stroke == stroke
        back = np.flatnonzero(path.direction[inside] * force[inside] >= full)
        if back.size:
            found.append(path.distance[inside][back[0]])
    return float(np.median(found)) if found else float("nan")


def _gas_series(study: Reproduction) -> Claim:
    text, source = "A series of third order replaces the gas force.", "Eq. 3–7"
    if study.gas is None:
        return Claim(text, source, "cannot be judged", "the gas spring of this rig is not known", "matrix")
    X = max(loop.condition.amplitude_m for loop in study.loops)
    error = study.gas.taylor_error(X)
    verdict: Verdict = "holds" if error < 0.02 else "does not hold"
    return Claim(
        text, source, verdict, f"it errs by {100 * error:.2f} % of the gas force within ±{1e3 * X:.0f} mm", "matrix"
    )


def _friction(study: Reproduction) -> Claim:
    text, source = "Seal friction is 25–100 N at 0.01 mm/s and may be neglected.", "section 2"
    if study.friction is None:
        return Claim(text, source, "cannot be judged", "the data hold no friction test", "friction")
    _, friction = friction_along(study.friction)
    smallest = min(loop.peak_force for loop in study.loops)
    share = float(np.mean(friction)) / smallest
    verdict: Verdict = "holds" if share < 0.05 else "holds in part"
    return Claim(
        text,
        source,
        verdict,
        f"{friction.min():.0f}–{friction.max():.0f} N along the stroke; "
        f"without current that is {100 * share:.0f} % of the "
        "smallest peak force, with current little",
        "friction",
    )


def _phase(study: Reproduction) -> Claim:
    phase = np.array([r.phase for r in study.readings])
    currents = np.array([c.current_A for c in study.conditions])
    spread = max(float(np.ptp(phase[group])) for group in _motions(study)) if np.ptp(currents) else 0.0
    inside = float(np.mean((phase > 1.4) & (phase < 1.5)))
    verdict: Verdict = (
        "holds" if inside == 1 and spread < 0.02 else "holds in part" if inside > 0.5 else "does not hold"
    )
    return Claim(
        "The force leads by 1.4–1.5 rad whatever the current, and its sine may be taken as 1.",
        "Eq. 16–19",
        verdict,
        f"{phase.min():.3f}–{phase.max():.3f} rad, {100 * inside:.0f} % of the runs inside; "
        f"at one motion it changes by up to "
        f"{spread:.3f} rad with the current; smallest sine {np.sin(phase).min():.3f}",
        "first_harmonic",
    )


def _quadratic(study: Reproduction) -> Claim:
    F0 = _amplitudes(study)
    fits = []
    for group in _motions(study):
        try:
            fits.append(fit_function("quadratic-current", [study.conditions[i] for i in group], F0[group]).r2)
        except IdentificationError:
            continue
    text, source = "At every motion F0 is a quadratic of the current.", "Eq. 23"
    if not fits:
        return Claim(text, source, "cannot be judged", "no motion was tested at three currents", "first_harmonic")
    verdict: Verdict = "holds" if min(fits) > 0.98 else "holds in part" if min(fits) > 0.9 else "does not hold"
    return Claim(
        text, source, verdict, f"R² {min(fits):.4f}–{max(fits):.4f} over {len(fits)} motions", "first_harmonic"
    )


def _speed_shift(study: Reproduction) -> Claim:
    text, source = "f · A shifts the quadratic of F0 (and so c X ω) without bending it.", "Eq. 24–26"
    try:
        fit = fit_function("quadratic-current-speed", study.conditions, _amplitudes(study))
    except IdentificationError:
        return Claim(text, source, "cannot be judged", "too few currents or motions", "first_harmonic")
    verdict: Verdict = "holds" if fit.r2 > 0.98 else "holds in part" if fit.r2 > 0.9 else "does not hold"
    return Claim(text, source, verdict, f"one curve for all runs has R² {fit.r2:.4f}", "first_harmonic")


def _saturation(study: Reproduction) -> Claim:
    currents, F0 = np.array([c.current_A for c in study.conditions]), _amplitudes(study)
    text, source = "The magnetic circuit saturates near 1.5 A.", "section 3"
    levels = np.unique(np.round(currents, 3))
    if levels.max() < 1.75 or levels.size < 5:
        return Claim(text, source, "cannot be judged", f"tested up to {levels.max():g} A only", "first_harmonic")
    mean = np.array([F0[np.abs(currents - level) < 1e-3].mean() for level in levels])
    low = np.polyfit(levels[levels <= 1.0], mean[levels <= 1.0], 1)[0]
    high = np.polyfit(levels[levels >= 1.5], mean[levels >= 1.5], 1)[0]
    verdict: Verdict = "holds" if high < 0.4 * low else "does not hold"
    fit = fit_function("quadratic-current", study.conditions, F0).function
    turn = -fit.coefficients[1] / (2 * fit.coefficients[0])
    return Claim(
        text,
        source,
        verdict,
        f"F0 rises by {low:.0f} N/A up to 1 A and by {high:.0f} N/A above 1.5 A; "
        f"the quadratic turns over at {turn:.2f} A and "
        "must not be used beyond",
        "first_harmonic",
    )


def _mass(study: Reproduction) -> Claim:
    literal = _values(study, LITERAL, "m")
    f, X = (np.array([getattr(c, name) for c in study.conditions]) for name in ("frequency_Hz", "amplitude_m"))
    consistent = _values(study, CONSISTENT, "m")
    corr = float(np.corrcoef(1 / (X * (2 * np.pi * f) ** 2), literal)[0, 1]) if np.ptp(literal) else float("nan")
    truth = f", the true mass {study.rig.mass:g} kg" if study.rig else ""
    return Claim(
        "The equivalent mass falls off with frequency and does not depend on the amplitude.",
        "Eq. 27–31",
        "does not hold" if literal.min() < 0 else "holds in part",
        f"the closed form gives {literal.min():.0f}…{literal.max():.0f} kg, the consistent balance "
        f"{consistent.min():.1f}…{consistent.max():.1f} kg{truth}. What falls off is the hysteretic force over X ω²: "
        f"correlation {corr:.2f} with 1/(X ω²)",
        "c_m",
    )


def _viscosity(study: Reproduction) -> Claim:
    literal, consistent = _values(study, LITERAL, "c"), _values(study, CONSISTENT, "c")
    ratio = literal / np.maximum(consistent, 1e-9)
    verdict: Verdict = (
        "holds" if np.median(ratio) < 1.1 else "holds in part" if np.median(ratio) < 1.5 else "does not hold"
    )
    return Claim(
        "F0 sin φ/(X ω) is the viscous damping.",
        "Eq. 19",
        verdict,
        f"the closed form gives {literal.min():.0f}–{literal.max():.0f} N s/m, the consistent balance "
        f"{consistent.min():.0f}–{consistent.max():.0f} N s/m: "
        f"{np.median(ratio):.1f} times as much at the median, because the "
        "first harmonic of α z is in it and is then identified again",
        "c_m",
    )


def _alpha(study: Reproduction) -> Claim:
    fit = study.contender(LITERAL).fit
    text, source = (
        "α rises with the frequency and falls with the amplitude, in a plane beside its current law.",
        "Eq. 32–36",
    )
    if not isinstance(fit, ModifiedFit) or fit.functions["alpha"].function.form != "plane":
        return Claim(text, source, "cannot be judged", "too few motions", "functions")
    found = fit.functions["alpha"]
    _, _, e1, e2, _ = found.function.coefficients
    right = (e1 > 0) + (e2 < 0)
    verdict: Verdict = "holds" if right == 2 and found.r2 > 0.9 else "holds in part" if right else "does not hold"
    evidence = f"slope {e1:+.3g} N/m per Hz, {1e-3 * e2:+.3g} N/m per mm, R² {found.r2:.2f}"
    return Claim(text, source, verdict, evidence, "functions")


def _beta(study: Reproduction) -> Claim:
    text, source = "β over current: curves that differ at small current merge at large current.", "Eq. 37–40"
    inside = np.array(["beta" not in i.at_bounds for i in study.contender(LITERAL).identifications])
    beta = np.log(_values(study, LITERAL, "beta")[inside])
    currents = np.array([c.current_A for c in study.conditions])[inside]
    levels = [level for level in np.unique(np.round(currents, 2)) if np.sum(np.abs(currents - level) < 0.01) > 2]
    if len(levels) < 2:
        return Claim(text, source, "cannot be judged", "no two currents were tested at three motions", "functions")
    first, last = (float(np.std(beta[np.abs(currents - level) < 0.01])) for level in (levels[0], levels[-1]))
    verdict: Verdict = "holds" if last < 0.5 * first else "does not hold"
    evidence = (
        f"scatter of ln β over the motions {first:.2f} at {levels[0]:g} A, {last:.2f} at {levels[-1]:g} A; "
        f"median β {np.exp(np.median(beta)):.3g} m⁻²; "
        f"{np.sum(~inside)} runs ended at the limit of the box"
    )
    return Claim(text, source, verdict, evidence, "functions")


def _stroke_end(study: Reproduction) -> Claim:
    top = max(c.current_A for c in study.conditions)
    damping = _values(study, CONSISTENT, "c")
    pairs = [
        (condition.peak_velocity, run, c)
        for condition, run, c in zip(study.conditions, study.train, damping, strict=True)
        if condition.current_A > top - 0.01
    ]
    text, source = "After each stroke end the force is missing for a length that grows with speed.", "section 2"
    slow, fast = min(pairs, key=lambda p: p[0]), max(pairs, key=lambda p: p[0])
    if fast[0] < 1.3 * slow[0]:
        return Claim(text, source, "cannot be judged", "one speed at the highest current", "loops")
    lengths = [1e3 * lost_length(run, c) for _, run, c in (slow, fast)]
    verdict: Verdict = "holds" if lengths[1] > 1.2 * lengths[0] else "does not hold"
    return Claim(
        text,
        source,
        verdict,
        f"at {top:g} A 90 % of the force beyond the viscous one is back after "
        f"{lengths[0]:.2f} mm at {slow[0]:.2f} m/s and after {lengths[1]:.2f} mm "
        f"at {fast[0]:.2f} m/s; no model compared here can follow it",
        "loops",
    )


def _prediction(study: Reproduction) -> Claim:
    errors = {c.recipe.title: c.held_out.median() for c in study.contenders}
    literal, traditional, consistent = errors[LITERAL], errors[TRADITIONAL], errors[CONSISTENT]
    slowest = errors[SLOWEST]
    verdict: Verdict = (
        "holds" if literal < traditional else "holds in part" if consistent < traditional else "does not hold"
    )
    return Claim(
        "The modified model predicts an untested motion better than the traditional Bouc–Wen model.",
        "section 5",
        verdict,
        f"median nrmse_pp on the held-out runs: literal {100 * literal:.1f} %, "
        f"consistent {100 * consistent:.1f} %, traditional "
        f"{100 * traditional:.1f} % from the motion nearest in speed, {100 * slowest:.1f} % from the slowest; "
        f"best is “{study.best.recipe.title}” with "
        f"{100 * study.best.held_out.median():.1f} %",
        "predicted",
    )


def _search(study: Reproduction) -> Claim:
    text, source = "The genetic algorithm finds α and β.", "section 4.3, Eq. 21–22"
    if not study.genetic:
        return Claim(text, source, "cannot be judged", "pymoo is not installed", "genetic")
    excess = [check.reached / check.optimum - 1 for check in study.genetic]
    verdict: Verdict = "holds" if max(excess) < 0.01 else "holds in part" if max(excess) < 0.1 else "does not hold"
    return Claim(
        text,
        source,
        verdict,
        f"with the boxes narrowed it ends {100 * max(excess):.2g} % or less above the least error there is, after "
        f"{study.genetic[0].minimum.evaluations} evaluations and "
        f"{study.genetic[0].seconds:.0f} s a run; a search over β alone "
        "with α solved for gets there in some 60 evaluations",
        "genetic",
    )


def _motions(study: Reproduction) -> list[list[int]]:
    return same_motion(study.conditions, tolerance=0.08)


def _amplitudes(study: Reproduction) -> Floats:
    return np.array([r.amplitude for r in study.readings])


def _values(study: Reproduction, title: str, name: str) -> Floats:
    return np.array([float(getattr(i.model, name)) for i in study.contender(title).identifications])


_CHECKS: tuple[Callable[[Reproduction], Claim], ...] = (
    _gas_series,
    _friction,
    _stroke_end,
    _phase,
    _quadratic,
    _speed_shift,
    _saturation,
    _viscosity,
    _mass,
    _alpha,
    _beta,
    _search,
    _prediction,
)
