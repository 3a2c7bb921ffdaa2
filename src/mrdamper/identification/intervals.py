"""Intervals of parameters as numbers and as text, and descriptions of parameters that are not identifiable."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from mrdamper.data.arrays import Floats
from mrdamper.data.conditions import Condition
from mrdamper.data.wording import number
from mrdamper.errors import InputError

_STRONG_CORRELATION = 0.98  # correlation from which two parameters are strongly correlated
_SAME_MOTION = 0.03  # frequencies and amplitudes this close are one
_MAX_RATIO = 1e3  # of an interval's half width to its estimate, or of its ends: beyond, it is not identifiable
NOT_IDENTIFIABLE = "not identifiable from these runs"
_SERIES_DEGREES_OF_FREEDOM = 1000.0  # degrees of freedom from which the series of the quantile is exact to rounding
_MOST_DEGREES_OF_FREEDOM, _HALVINGS = 1e6, 30  # that a quantile is looked for in, and steps of bisection
_RULE_END, _NODES = 3.2, 81  # of the tanh-sinh rule: the weights beyond its end are below rounding
_MAX_NEWTON_STEPS = 200  # of Newton's method
_FRACTION_TERMS = 200  # pairs of terms of a continued fraction
_LOPSIDED = 0.1  # share of an interval's half width: less asymmetric, it is written with ±


def student(level: float, dof: float) -> float:
    """Two-sided quantile of Student's t, to 1e-10 for levels up to 0.999 [Abramowitz and Stegun 1972, 26.7.3, 26.7.5].

    Raises `InputError` (E_LEVEL) if the level is not between 0 and 1.
    """
    if not 0 < level < 1:
        raise InputError(f"level {level:g}", remedy="give a share between 0 and 1, as 0.9", code="E_LEVEL")
    return _student(float(level), max(float(dof), 1.0))


@lru_cache(maxsize=256)
def _student(level: float, dof: float) -> float:
    """Quantile t = √dof tan θ from the integral of cos^(dof − 1) θ; for many degrees of freedom by its series."""
    if dof > _SERIES_DEGREES_OF_FREEDOM:
        from statistics import NormalDist

        z = NormalDist().inv_cdf((1 + level) / 2)
        first, second = (z**3 + z) / 4, (5 * z**5 + 16 * z**3 + 3 * z) / 96
        return z + first / dof + second / dof**2 + (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384 / dof**3
    whole = 0.5 * math.sqrt(math.pi) * math.exp(math.lgamma(dof / 2) - math.lgamma((dof + 1) / 2))
    nodes, weights = _tanh_sinh()
    angle = 0.0
    for _ in range(_MAX_NEWTON_STEPS):  # the integral is concave: Newton's method converges from below
        reached = angle / 2 * float(weights @ np.cos(angle / 2 * (nodes + 1)) ** (dof - 1))
        step = (level * whole - reached) / max(math.cos(angle) ** (dof - 1), 1e-300)
        angle = min(angle + step, math.pi / 2 - 1e-12)
        if step <= 1e-15:
            break
    return math.sqrt(dof) * math.tan(angle)


@lru_cache
def _tanh_sinh() -> tuple[Floats, Floats]:
    """Return nodes and weights on −1...1; those of Gauss and Legendre would load NumPy's polynomials."""
    at = np.linspace(-_RULE_END, _RULE_END, _NODES)
    inner = np.pi / 2 * np.sinh(at)
    return np.tanh(inner), (at[1] - at[0]) * np.pi / 2 * np.cosh(at) / np.cosh(inner) ** 2


def f_exceedance(ratio: float, dof_above: float, dof_below: float) -> float:
    """Probability that the ratio of two estimates of one variance is larger, of F's distribution, to 1e-10.

    An incomplete beta function [Abramowitz and Stegun 1972, 26.6.2 and 26.5.8], whose import from SciPy is slow.
    """
    a, b, share = dof_below / 2, dof_above / 2, dof_below / (dof_below + dof_above * ratio)
    if share > (a + 1) / (a + b + 2):  # where the continued fraction of the other share converges faster
        return 1 - f_exceedance(1 / ratio, dof_below, dof_above) if ratio > 0 else 1.0
    fraction = 1.0
    for m in range(_FRACTION_TERMS, 0, -1):
        odd = -(a + m) * (a + b + m) * share / ((a + 2 * m) * (a + 2 * m + 1))
        fraction = 1 + m * (b - m) * share / ((a + 2 * m - 1) * (a + 2 * m)) / (1 + odd / fraction)
    log_beta = math.lgamma(a) + math.lgamma(b) - math.lgamma(a + b)
    front = math.exp(a * math.log(share) + b * math.log1p(-share) - log_beta) / a
    return front / (1 - (a + b) * share / (a + 1) / fraction)


def dof_of_quantile(quantile: float, level: float) -> float:
    """Degrees of freedom at which Student's t has a two-sided quantile: at least one, and many for a normal one."""
    few, many = 0.0, math.log(_MOST_DEGREES_OF_FREEDOM)
    for _ in range(_HALVINGS):
        middle = (few + many) / 2
        few, many = (middle, many) if student(level, math.exp(middle)) > quantile else (few, middle)
    return math.exp(many)


def interval_about(
    value: float, error: float, dof: float, level: float, log: bool, exponent: float = 0.0
) -> tuple[float, float] | None:
    """Calculate the ends of an interval; of a logarithm where `log`, then `error` is that of the logarithm.

    None where the parameter is not identifiable: an error that is not finite, ends a factor of more
    than a thousand apart, or a half width of more than a thousand times the estimate. For a coefficient that enters the
    logarithm of a parameter as `exponent` times it, these ends are those of the parameter.
    """
    half = student(level, dof) * error
    if not math.isfinite(half) or relative_width(value, half, log, exponent) > 1:
        return None
    return (value * math.exp(-half), value * math.exp(half)) if log else (value - half, value + half)


def relative_width(value: float, half: float, log: bool, exponent: float = 0.0) -> float:
    """Half an interval over the widest one of an identifiable parameter; `exponent` as for `interval_about`."""
    if log or exponent:
        return half * (1.0 if log else exponent) / (math.log(_MAX_RATIO) / 2)
    return half / (_MAX_RATIO * abs(value)) if value else math.inf if half else 0.0


_SHOWN = {"-": (1.0, ""), "m": (1e3, "mm"), "m/s": (1e3, "mm/s")}  # unit on screens


def written(value: float, ends: tuple[float, float] | None, unit: str = "") -> str:
    """Write a number with its interval and unit, to two digits of the half width: 730 ± 110 N s/m, 0.3 (0.1 to 0.9) mm.

    Lengths and speeds in millimetres, as on every screen; `ends` is None where there are none.
    """
    factor, unit = _SHOWN.get(unit, (1.0, unit))
    value, ends = factor * value, ends and (factor * ends[0], factor * ends[1])
    if ends is None or not all(map(math.isfinite, ends)):
        return f"{number(value)} {unit}".strip()
    low, high = ends
    half = (high - low) / 2
    if half == 0:
        return f"{number(value, 6)} ± 0 {unit}".strip()
    largest = max(abs(value), half)
    digits = math.floor(math.log10(largest)) - math.floor(math.log10(half)) + 2
    estimate, least, most = (number(each, digits, largest) for each in (value, low, high))
    if abs(high + low - 2 * value) > _LOPSIDED * half:
        return f"{estimate} ({least} to {most}) {unit}".strip()
    return f"{estimate} ± {number(half, 2, largest)} {unit}".strip()


def weaknesses(
    names: Sequence[str],
    covariance: Floats,
    alike: Sequence[Sequence[int]] = (),
    conditions: Sequence[Condition] = (),
) -> list[str]:
    """List the parameters that are not, or only roughly, determined, in words.

    The covariance (P, P) is infinite on the diagonal for parameters that are not determined; `alike` are those with the
    same effect on the force. Single values of the conditions of the tests are the probable reasons.
    """
    reason = _only_one(conditions)
    sentences = [
        f"{_listed([names[i] for i in group])} are not {_both(group)} identifiable{reason}: "
        "they do the same to the force"
        for group in alike
    ]
    grouped = {i for group in alike for i in group}
    lost = [n for i, n in enumerate(names) if np.isinf(covariance[i, i]) and i not in grouped]
    if lost:
        sentences.append(f"{_listed(lost)}: not identifiable{reason}, the force does not depend on it")
    return sentences + [
        f"{_listed([names[i] for i in group])} are strongly correlated (|r| up to {largest:.3f})"
        if len(group) > 2
        else f"{names[group[0]]} and {names[group[1]]} are strongly correlated (r = {largest:.3f})"
        for group, largest in _correlated(covariance)
    ]


def _correlated(covariance: Floats) -> list[tuple[list[int], float]]:
    """Group the parameters that are linked by strong correlations, each group with its largest coefficient [-]."""
    variances = np.diag(covariance)
    finite = [i for i, variance in enumerate(variances) if np.isfinite(variance) and variance > 0]
    links = {
        (i, j): float(covariance[i, j] / np.sqrt(variances[i] * variances[j]))
        for a, i in enumerate(finite)
        for j in finite[a + 1 :]
    }
    links = {pair: r for pair, r in links.items() if abs(r) > _STRONG_CORRELATION}
    groups: list[set[int]] = []
    for pair in links:
        joined = [group for group in groups if group & set(pair)]
        groups = [group for group in groups if group not in joined] + [set(pair).union(*joined)]
    sentences: list[tuple[list[int], float]] = []
    for group in groups:
        largest = max((r for (i, _), r in links.items() if i in group), key=abs)
        sentences.append((sorted(group), largest if len(group) == 2 else abs(largest)))
    return sentences


def _both(group: Sequence[int]) -> str:
    return "both" if len(group) == 2 else "all"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _only_one(conditions: Sequence[Condition]) -> str:
    """List quantities of which the tests have one value only, as a reason."""
    if not conditions:
        return ""
    values = {
        "frequency": [c.frequency_Hz for c in conditions],
        "amplitude": [c.amplitude_m for c in conditions],
        "current": [abs(c.current_A) for c in conditions],
    }
    single = [name for name, v in values.items() if max(v) - min(v) <= _SAME_MOTION * max(v)]
    if "current" in single and max(values["current"]) == 0:
        return " without current" if len(single) == 1 else " from one motion without current"
    if not single or len(single) == 3:
        return " from one condition" if single else " from these runs"
    return f" from one {' and one '.join(single)}"
