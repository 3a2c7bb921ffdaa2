"""Measurements on identified parameters and methods: closed forms, functions, searches, predictions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrdamper.data import Condition, Floats
from mrdamper.data.wording import number, span
from mrdamper.paper.options import ALI, CONSISTENT, LITERAL, TRADITIONAL
from mrdamper.paper.results import Measured, Reproduction, function_of, unknown, values
from mrdamper.study.recipe import RecipeResult

_SEARCHED = 2  # parameters that the paper's method searches per run


def viscosity(study: Reproduction) -> Measured:
    """Compare the closed form of c with the consistent balance."""
    literal, consistent = values(study, LITERAL, "c"), values(study, CONSISTENT, "c")
    if not literal.size or literal.size != consistent.size:
        return unknown("one of the two balances could not be followed on every run")
    return Measured.of(
        np.median(literal / np.maximum(consistent, 1e-9)),
        evidence=f"closed form {span(literal.min(), literal.max(), 'N s/m')}, consistent balance "
        f"{span(consistent.min(), consistent.max(), 'N s/m')}",
    )


def mass(study: Reproduction) -> Measured:
    """Measure the fit of the mass over current and frequency, its spread over the amplitude, and its sign."""
    literal, fit = values(study, LITERAL, "m"), function_of(study, "m")
    if fit is None or not fit.function.form.startswith("mass") or not np.ptp(literal):
        return unknown("m is held, or the runs determine no function of current and frequency for it")
    truth = f"; true {study.rig.mass:g} kg" if study.rig else ""
    evidence = f"closed form {span(literal.min(), literal.max(), 'kg')}{truth}"
    return Measured.of(fit.r2, amplitude_spread(study.conditions, literal), literal.min(), evidence=evidence)


def alpha(study: Reproduction) -> Measured:
    """Return the signs of the slopes of the plane of alpha, and its R²."""
    fit = function_of(study, "alpha")
    if fit is None or fit.function.form != "plane":
        return unknown("too few motions for a plane over frequency and amplitude")
    _, _, e1, e2, _ = fit.function.coefficients
    evidence = f"{number(1e-3 * e1, 3, sign='+')} kN/m per Hz, {number(1e-6 * e2, 3, sign='+')} kN/m per mm"
    return Measured.of(np.sign(e1), np.sign(e2), fit.r2, evidence=evidence)


def beta(study: Reproduction) -> Measured:
    """Compare the scatter of ln beta over the motions at the highest and the lowest current."""
    fit, literal = function_of(study, "beta"), study.contender(LITERAL)
    if fit is None or literal is None:
        return unknown("the literal method could not be followed")
    ln_beta = np.log(np.maximum(values(study, LITERAL, "beta"), 1e-9))
    first, last = scatter_over_motions(study.conditions, ln_beta)
    if not np.isfinite(first):
        return unknown("no two currents were tested at three motions")
    if first < 1e-6:
        return unknown("at the lowest current every run ended at the same limit of the box: nothing to compare")
    limit = float(np.mean(["beta" in i.at_bounds for i in literal.identifications]))
    evidence = f"median β {number(np.exp(np.median(ln_beta)), 3)} m⁻ⁿ; runs at the limit are in every value, as for α"
    return Measured.of(last / first, fit.r2, limit, evidence=evidence)


def presets(study: Reproduction) -> Measured:
    """Return the errors of wrong presets once the other parameters are identified anew."""
    left = {effect.name: effect.left for effect in study.sensitivity}
    if not left:
        return unknown("no run could be identified by the consistent method")
    evidence = f"each preset wrong by {100 * study.sensitivity[0].change:.0f} %"
    return Measured.of(*(left.get(name, np.nan) for name in ("n", "asymmetry", "A")), evidence=evidence)


def search(study: Reproduction) -> Measured:
    """Return the ratios of the results of the genetic searches to the optimum."""
    if not study.ended:
        return unknown("no genetic search was made")
    factors = np.array([(miss_factor(end.alpha), miss_factor(end.beta)) for end in study.ended])
    a, b = factors.max(axis=0)
    error = max(end.error for end in study.ended)
    return Measured.of(
        *np.exp(np.median(np.log(factors), axis=0)),
        evidence=f"{len(factors)} runs, a seed each; worst factors {number(a, 3)} and {number(b, 3)}; largest error "
        f"over the least {number(error, 3)}",
    )


def accuracy(study: Reproduction) -> Measured:
    """Compare the validation errors, nrmse_pp and Eq. 44, with those of the traditional Bouc–Wen model."""
    if not (pair := _validated(study, LITERAL, TRADITIONAL)):
        return unknown("no validation run to predict by both methods")
    (own, relative), (other, other_relative) = (
        (c.validation.median(), c.validation.median("mean_relative_error")) for c in pair
    )
    evidence = (
        f"nrmse_pp {100 * own:.2f} % against {100 * other:.2f} %, relative error {100 * relative:.0f} % against "
        f"{100 * other_relative:.0f} % at the prediction motion, median over the currents"
    )
    return Measured.of(own / other, relative / other_relative, evidence=evidence)


def few_parameters(study: Reproduction) -> Measured:
    """Compare validation error and searched parameters with those of Ali's model."""
    if not (pair := _validated(study, LITERAL, ALI)):
        return unknown("Ali's model could not be followed on these runs, or there is no validation run")
    own, other = (100 * c.validation.median() for c in pair)
    worst, other_worst = (100 * c.validation.worst().scores.nrmse_pp for c in pair)
    count = pair[1].parameters_per_run
    evidence = (
        f"validation {own:.1f} % against {other:.1f} %; worst {worst:.1f} % and {other_worst:.1f} %; {_SEARCHED} "
        f"searched against {count}"
    )
    return Measured.of(own / other, _SEARCHED / max(count, 1), evidence=evidence)


def fast(study: Reproduction) -> Measured:
    """Compare the numbers of forces computed until the searches converge."""
    if not study.direct or not study.ended:
        return unknown("no genetic searches to count")
    own, other = float(np.median([end.to_settle for end in study.ended])), float(np.median(list(study.direct.values())))
    return Measured.of(
        own / other, evidence=f"median {own:.0f} forces computed against {other:.0f}; seconds are in seconds.csv"
    )


def generalisation(study: Reproduction) -> Measured:
    """Compare the validation error with that of identification, and return the worst."""
    if not (pair := _validated(study, LITERAL)):
        return unknown("the literal method could not be followed, or there is no validation run")
    (literal,), consistent = pair, study.contender(CONSISTENT)
    median, worst = literal.validation.median(), literal.validation.worst()
    error = worst.scores.nrmse_pp
    other = f"; consistent {100 * consistent.validation.median():.1f} %" if consistent else ""
    evidence = f"median {100 * median:.1f} %, worst {100 * error:.1f} % at {worst.condition}{other}"
    return Measured.of(median / literal.per_run, error, evidence=evidence)


def _validated(study: Reproduction, *titles: str) -> list[RecipeResult]:
    methods = [method for title in titles if (method := study.contender(title)) and method.validation.runs]
    return methods if len(methods) == len(titles) else []


def amplitude_spread(conditions: Sequence[Condition], values: Floats) -> float:
    """Return the largest spread over amplitudes at one current and frequency, over the mean magnitude of all."""
    keys = [(round(c.current_A, 2), round(c.frequency_Hz, 2)) for c in conditions]
    spreads = [
        float(np.ptp(values[[i for i, k in enumerate(keys) if k == key]])) for key in set(keys) if keys.count(key) > 1
    ]
    return max(spreads) / float(np.mean(np.abs(values))) if spreads else float("nan")


def scatter_over_motions(conditions: Sequence[Condition], values: Floats) -> tuple[float, float]:
    """Return standard deviations over motions at the lowest and highest current tested at three motions or more."""
    currents = np.round([c.current_A for c in conditions], 2)
    levels = [level for level in np.unique(currents) if np.sum(currents == level) > 2]
    if len(levels) < 2:
        return float("nan"), float("nan")
    return float(np.std(values[currents == levels[0]])), float(np.std(values[currents == levels[-1]]))


def miss_factor(ratio: float) -> float:
    """Return the larger of a ratio and its inverse."""
    return float(np.exp(np.abs(np.log(max(ratio, 1e-12)))))
