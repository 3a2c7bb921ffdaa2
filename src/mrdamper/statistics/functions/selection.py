"""Rule for the selection between a smaller and a larger model, its folds, and physical laws.

A model, a form of a parameter function or a term of a model is selected by cross-validation: the smaller one is
selected within one standard error of the difference [Breiman et al. 1984, §3.4.3; Hastie, Tibshirani and Friedman 2009,
§7.10], provided that it is no worse in the kind of fold in which it is worst, and worse by more than two standard
errors in no kind, so that a kind of few, scattered units does not hide a clear difference in another. A form is no
candidate if the tests do not determine it: at most one parameter fewer than current levels in a law over the current,
and two fewer than distinct motions over the motion; nor if it violates a physical law within the tested ranges or 20 %
beyond.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mrdamper.data import Condition, Floats, level_groups, same_condition, same_motion
from mrdamper.statistics.functions.forms import Form, ParameterFunction, form_named
from mrdamper.statistics.functions.motion_hull import MotionHull

Errors = Mapping[str, Floats]  # by kind of fold: the error of every omitted unit, in one order for all models
BEYOND = 1.2  # largest current [of the largest tested] up to which a function obeys physical laws
_CLEAR = 2.0  # standard errors of a difference that no other kind of fold outweighs
_ROUNDING = 1e-12  # relative difference of errors below which they are equal
_SEVERAL = 5  # units of a kind from which its standard error is its own
_MOTIONS = 0.05  # frequencies and amplitudes this close are one motion
_FALL = 0.01  # fall of a yield force [of its largest value] below which it does not fall


def mean_error(errors: Errors) -> float:
    """Mean over the kinds of fold of the mean error in each; infinite without folds."""
    means = [_mean(values) for values in errors.values() if len(values)]
    return sum(means) / len(means) if means else float("inf")


def _mean(values: Floats) -> float:
    """Mean of a few values: a quarter of the time of NumPy's, which is asked for thousands."""
    return float(np.add.reduce(values)) / len(values)


def smaller_wins(smaller: Errors, larger: Errors) -> bool:
    """Decide between two models by their cross-validated errors of the same omitted units, by kind of fold.

    True if the smaller model is within one standard error of the larger one, over all kinds and in the kind in which it
    is worst, and within two in every kind of several units. Kinds that only one of them has do not count.
    """
    kinds = [kind for kind in smaller if kind in larger and len(smaller[kind])]
    if not kinds:
        return True
    means = {kind: _mean(smaller[kind]) for kind in kinds}
    worst = max(kinds, key=means.__getitem__)
    if not all(math.isfinite(_mean(larger[kind])) for kind in kinds):
        return True
    if not all(map(math.isfinite, means.values())):
        return False
    excess = {kind: _mean_and_variance(np.asarray(smaller[kind]) - np.asarray(larger[kind])) for kind in kinds}
    over_kinds = sum(mean for mean, _ in excess.values()) / len(kinds)
    standard_error = math.sqrt(sum(variance for _, variance in excess.values())) / len(kinds)
    clearly = any(
        mean > _CLEAR * math.sqrt(variance)
        for kind, (mean, variance) in excess.items()
        if len(smaller[kind]) >= _SEVERAL
    )
    mean, variance = excess[worst]
    return not clearly and over_kinds <= standard_error and mean <= math.sqrt(variance) + _ROUNDING * means[worst]


def _mean_and_variance(values: Floats) -> tuple[float, float]:
    """Mean, and its squared standard error; zero for a single value."""
    mean = _mean(values)
    apart = values - mean
    return mean, float(apart @ apart) / (values.size - 1) / values.size if values.size > 1 else 0.0


def fold_groups(conditions: Sequence[Condition]) -> dict[str, list[list[int]]]:
    """Group the indices of conditions omitted together, by kind of fold: a condition, an inner current, a motion.

    A form is selected for interpolation: a fold without the lowest or the highest current would need an extrapolation
    that two remaining levels do not support. Dampers are scored on these, too (`study.cross_validation`).
    """
    groups = {"condition": same_condition(conditions)}
    currents = [*level_groups([c.current_A for c in conditions]).values()]
    motions = same_motion(conditions, _MOTIONS)
    if len(currents) > 2:
        groups["current"] = currents[1:-1]
    if len(motions) > 2:
        groups["motion"] = motions
    return groups


def supported(form: Form, conditions: Sequence[Condition]) -> bool:
    """Tell if a form has few enough parameters for the current levels and distinct motions that were tested.

    Two levels determine a straight line: a function of current has a parameter fewer than there are levels, but at
    least two if there are several.
    """
    over_current, over_motion = _supported_terms(tuple(conditions))
    return form.current_terms <= over_current and form.motion_terms <= over_motion


@lru_cache(maxsize=256)  # asked for every form of every parameter
def _supported_terms(conditions: tuple[Condition, ...]) -> tuple[int, int]:
    """Largest number of parameters over the current and over the motion."""
    levels = len(level_groups([c.current_A for c in conditions]))
    return 1 if levels < 2 else max(levels - 1, 2), max(len(same_motion(conditions, _MOTIONS)) - 2, 0)


def broken_law(function: ParameterFunction, conditions: Sequence[Condition], unit: str) -> str:
    """Return the physical law that a function of a dissipating parameter violates within the tests and 20 % beyond.

    It is of a parameter that must not be negative: a yield force [N], a viscous damping. A parameter in N is a yield
    force and may not fall where a straight line over the current does not. Empty if it violates none.
    """
    currents, tested = _currents_of_laws(tuple(conditions))
    motions = MotionHull.of(conditions).corners[: None if form_named(function.form).follows_motion else 1]
    values = np.array([np.broadcast_to(function(currents, *motion), currents.shape) for motion in motions])
    if values.min() < 0:
        where = np.unravel_index(values.argmin(), values.shape)
        return f"negative at {currents[where[1]]:.3g} A"
    rise = np.diff(values, axis=1)
    slack = _FALL * np.abs(values).max()
    for row, one in zip(rise, values, strict=True):
        if not row.size or not (row.min() < 0 < row.max()):
            continue
        falls, climbs = (float(np.sum(part[part > 0])) for part in (-row, row))
        shown = np.diff(one[tested])
        if unit == "N" and falls > slack:
            return "a yield force that falls with the current"
        if min(falls, climbs) > slack and (shown.size < 2 or not shown.min() < 0 < shown.max()):
            return "an extremum over the current that no test shows"
    return ""


@lru_cache(maxsize=256)  # the same for every function of a damper
def _currents_of_laws(conditions: tuple[Condition, ...]) -> tuple[Floats, NDArray[np.bool_]]:
    """Currents [A] at which functions are checked, within the tests and beyond, and which of them were tested."""
    tested = np.array([*level_groups([c.current_A for c in conditions])])
    currents = np.unique(np.concatenate([np.linspace(0.0, BEYOND * float(tested[-1]), 61), tested]))
    return currents, np.isin(currents, tested)


def rises(shorter: ParameterFunction, longer: ParameterFunction, unit: str, conditions: Sequence[Condition]) -> bool:
    """Tell if a straight line replaces a constant without a test: the yield force rises with current."""
    if (shorter.form, longer.form, unit) != ("constant", "linear-current", "N"):
        return False
    highest = max(abs(c.current_A) for c in conditions)
    return bool(longer.coefficients[0] > 0 and highest > 0)
