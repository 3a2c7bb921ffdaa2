"""What the identified parameters and the ways say: the closed forms, the functions, the search, the predictions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrdamper.data import Condition, Floats
from mrdamper.paper.recipes import ALI, CONSISTENT, LITERAL, TRADITIONAL
from mrdamper.paper.results import Reproduction, function_of, values
from mrdamper.paper.verdicts import Measured, measured, unknown


def viscosity(study: Reproduction) -> Measured:
    """The closed form of c over the balance that counts the hysteretic force once."""
    literal, consistent = values(study, LITERAL, "c"), values(study, CONSISTENT, "c")
    if not literal.size or literal.size != consistent.size:
        return unknown("one of the two balances could not be followed on every run")
    return measured(
        "viscosity",
        np.median(literal / np.maximum(consistent, 1e-9)),
        evidence=f"closed form {literal.min():.0f}–{literal.max():.0f} N s/m, consistent balance "
        f"{consistent.min():.0f}–{consistent.max():.0f} N s/m",
    )


def mass(study: Reproduction) -> Measured:
    """The mass over current and frequency, over the amplitude, and its sign."""
    literal, fit = values(study, LITERAL, "m"), function_of(study, "m")
    if fit is None or not fit.function.form.startswith("mass") or not np.ptp(literal):
        return unknown("m is held, or the runs determine no function of current and frequency for it")
    truth = f"; true {study.rig.mass:g} kg" if study.rig else ""
    evidence = f"closed form {literal.min():.0f}…{literal.max():.0f} kg{truth}"
    return measured("mass", fit.r2, amplitude_spread(study.conditions, literal), literal.min(), evidence=evidence)


def alpha(study: Reproduction) -> Measured:
    """Which way the plane of alpha slopes."""
    fit = function_of(study, "alpha")
    if fit is None or fit.function.form != "plane":
        return unknown("too few motions for a plane over frequency and amplitude")
    _, _, e1, e2, _ = fit.function.coefficients
    evidence = f"{1e-3 * e1:+.3g} kN/m per Hz, {1e-6 * e2:+.3g} kN/m per mm"
    return measured("alpha", np.sign(e1), np.sign(e2), fit.r2, evidence=evidence)


def beta(study: Reproduction) -> Measured:
    """Whether the curves of beta over the current come together."""
    fit, contender = function_of(study, "beta"), study.contender(LITERAL)
    if fit is None or contender is None:
        return unknown("the literal recipe could not be followed")
    ln_beta = np.log(np.maximum(values(study, LITERAL, "beta"), 1e-9))
    first, last = scatter_over_motions(study.conditions, ln_beta)
    if not np.isfinite(first):
        return unknown("no two currents were tested at three motions")
    if first < 1e-6:
        return unknown("at the lowest current every run ended at the same limit of the box: nothing to compare")
    limit = float(np.mean(["beta" in i.at_bounds for i in contender.identifications]))
    return measured(
        "beta",
        last / first,
        fit.r2,
        limit,
        evidence=f"median β {np.exp(np.median(ln_beta)):.3g} m⁻ⁿ; runs at the limit are in every number, as for α",
    )


def presets(study: Reproduction) -> Measured:
    """What wrong presets cost once the other parameters are identified anew."""
    left = {effect.name: effect.left for effect in study.sensitivity}
    if not left:
        return unknown("no run to judge by")
    evidence = f"each preset wrong by {100 * study.sensitivity[0].change:.0f} %"
    return measured("presets", *(left.get(name, np.nan) for name in ("n", "asymmetry", "A")), evidence=evidence)


def search(study: Reproduction) -> Measured:
    """By what factors the genetic searches miss the optimum."""
    if not study.ended:
        return unknown("no genetic search was made")
    ends = [[getattr(end, name) for end in study.ended] for name in ("alpha", "beta")]
    worst = " and ".join(f"{max(factor(end) for end in side):.3g}" for side in ends)
    return measured(
        "search",
        *(factors(side) for side in ends),
        evidence=f"{len(study.ended)} runs, a seed each; worst factors {worst}; largest error over the least "
        f"{max(e.error for e in study.ended):.3g}",
    )


def accuracy(study: Reproduction) -> Measured:
    """Compare the validation errors, ours and Eq. 44, with those of the traditional Bouc–Wen model."""
    literal, traditional = study.contender(LITERAL), study.contender(TRADITIONAL)
    if literal is None or traditional is None or not (literal.validation.runs and traditional.validation.runs):
        return unknown("no validation run to predict by both methods")
    (own, relative), (other, other_relative) = (
        (c.validation.median(), c.validation.median("mean_relative_error")) for c in (literal, traditional)
    )
    evidence = (
        f"nrmse_pp {100 * own:.2f} % against {100 * other:.2f} %, relative error {100 * relative:.0f} % against "
        f"{100 * other_relative:.0f} % at the prediction motion, median over the currents"
    )
    return measured("accuracy", own / other, relative / other_relative, evidence=evidence)


def few_parameters(study: Reproduction) -> Measured:
    """Held-out error and searched parameters beside Ali's model."""
    literal, ali = study.contender(LITERAL), study.contender(ALI)
    if literal is None or ali is None or not (ali.validation.runs and literal.validation.runs):
        return unknown("Ali's model could not be followed on these runs, or no run is held out")
    worst = [100 * c.validation.worst().scores.nrmse_pp for c in (literal, ali)]
    return measured(
        "few parameters",
        literal.validation.median() / ali.validation.median(),
        2 / max(ali.parameters_per_run, 1),
        evidence=f"held out {100 * literal.validation.median():.1f} % against {100 * ali.validation.median():.1f} %; "
        f"worst {worst[0]:.1f} % and {worst[1]:.1f} %; 2 searched against {ali.parameters_per_run}",
    )


def fast(study: Reproduction) -> Measured:
    """Forces computed until the searches settle."""
    if not study.direct or not study.ended:
        return unknown("no genetic searches to count")
    own, other = float(np.median([end.to_settle for end in study.ended])), float(np.median(list(study.direct.values())))
    return measured(
        "fast",
        own / other,
        evidence=f"median {own:.0f} forces computed against {other:.0f}; seconds stand in seconds.csv",
    )


def generalisation(study: Reproduction) -> Measured:
    """Held-out error over that of identification, and the worst."""
    literal, consistent = study.contender(LITERAL), study.contender(CONSISTENT)
    if literal is None or not literal.validation.runs:
        return unknown("the literal recipe could not be followed, or predicts no held-out run")
    median, worst = literal.validation.median(), literal.validation.worst()
    error = worst.scores.nrmse_pp
    beside = f"; consistent {100 * consistent.validation.median():.1f} %" if consistent else ""
    return measured(
        "generalisation",
        median / literal.per_run,
        error,
        evidence=f"median {100 * median:.1f} %, worst {100 * error:.1f} % at {worst.condition}{beside}",
    )


def amplitude_spread(conditions: Sequence[Condition], values: Floats) -> float:
    """Largest spread of values over amplitudes at one current and frequency, over the mean magnitude of all."""
    keys = [(round(c.current_A, 2), round(c.frequency_Hz, 2)) for c in conditions]
    spreads = [
        float(np.ptp(values[[i for i, k in enumerate(keys) if k == key]])) for key in set(keys) if keys.count(key) > 1
    ]
    return max(spreads) / float(np.mean(np.abs(values))) if spreads else float("nan")


def scatter_over_motions(conditions: Sequence[Condition], values: Floats) -> tuple[float, float]:
    """Standard deviation over the motions at the lowest and at the highest current tested at three motions or more."""
    currents = np.round([c.current_A for c in conditions], 2)
    levels = [level for level in np.unique(currents) if np.sum(currents == level) > 2]
    if len(levels) < 2:
        return float("nan"), float("nan")
    return float(np.std(values[currents == levels[0]])), float(np.std(values[currents == levels[-1]]))


def factor(end: float) -> float:
    """Factor by which a value misses one, whichever side it lies on."""
    return float(np.exp(np.abs(np.log(max(end, 1e-12)))))


def factors(ends: Sequence[float]) -> float:
    """Median factor by which values miss one."""
    return float(np.exp(np.median(np.abs(np.log(np.maximum(ends, 1e-12))))))
