"""Standard formulas of control charts, capability and gauge studies.

References
----------
NIST/SEMATECH e-Handbook of Statistical Methods, 6.1.6 (capability), 6.3.2.2 (individuals), 6.3.2.4
(EWMA); ISO 22514-2 (percentiles of other distributions); Bissell 1990, Applied Statistics 39, 331
(interval of a capability index); Efron and Tibshirani 1993, An Introduction to the Bootstrap, chapter 13.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter
from scipy.stats import shapiro

from mrdamper.data import Floats

_D2, _D4 = 1.128, 3.267  # of moving ranges of two, as printed in the tables
_FEWEST_NORMALITY, _MOST_NORMALITY = 8, 5000
_NOT_NORMAL = 0.005  # significance at which a distribution counts as not normal
_TAIL = 0.00135  # share beyond three standard deviations of a normal distribution
FEWEST_PERCENTILES = math.ceil(10 / _TAIL)  # values, ten of which are expected beyond each percentile
_PERCENTILES = (_TAIL, 0.5, 1 - _TAIL)
_RESAMPLES, _SEED = 1000, 20240813  # of the bootstrap


@dataclass(frozen=True, eq=False)
class ControlChart:
    """A control chart."""

    values: Floats  # (N,) charted values
    lower: Floats  # (N,) its limits
    upper: Floats
    centre: float

    @property
    def signals(self) -> tuple[int, ...]:
        """Points outside the limits."""
        return tuple(np.flatnonzero((self.values < self.lower) | (self.values > self.upper)).tolist())


def individuals(values: Floats) -> tuple[ControlChart, ControlChart]:
    """Individuals and moving ranges of two [NIST 6.3.2.2]."""
    ranges = np.abs(np.diff(values))
    mean, spread = float(np.mean(values)), float(np.mean(ranges)) if ranges.size else 0.0
    lower, upper = (np.full(values.size, mean + side * spread / _D2) for side in (-3, 3))
    first = ControlChart(values, lower, upper, mean)
    return first, ControlChart(ranges, np.zeros(ranges.size), np.full(ranges.size, _D4 * spread), spread)


def ewma(values: Floats, target: float, deviation: float, weight: float = 0.2, width: float = 3.0) -> ControlChart:
    """Exponentially weighted moving average, limits for each point's own age [NIST 6.3.2.4].

    Target and deviation are the mean and standard deviation of the process in control, `weight` is λ of the newest
    value, and the limits are `width` standard deviations of the average.
    """
    averages = np.asarray(lfilter([weight], [1, weight - 1], values, zi=[(1 - weight) * target])[0])
    age = np.arange(1, values.size + 1)
    half = width * deviation * np.sqrt(weight / (2 - weight) * (1 - (1 - weight) ** (2 * age)))
    return ControlChart(averages, target - half, target + half, target)


@dataclass(frozen=True)
class Capability:
    """Capability of a process: its distribution relative to the limits."""

    ppk: float  # NaN where the values are too few for percentiles
    low: float  # ends of its 95 % interval
    high: float
    way: str  # "normal", "percentiles", or why there is none


def is_normal(values: Floats) -> bool:
    """Tell if Shapiro and Wilk's test accepts a normal distribution; of many values, a regular subset is tested."""
    if values.size < _FEWEST_NORMALITY or np.ptp(values) == 0:
        return True
    step = -(-values.size // _MOST_NORMALITY)
    return float(shapiro(values[::step]).pvalue) >= _NOT_NORMAL


def beyond(values: Floats, lower: float | None, upper: float | None) -> np.ndarray:
    """(N,) mask of the values outside the limits."""
    return (values < (-np.inf if lower is None else lower)) | (values > (np.inf if upper is None else upper))


def capability(values: Floats, lower: float | None, upper: float | None) -> Capability | None:
    """Ppk from the overall mean and deviation, or from percentiles where the values are not normal.

    Percentiles of 0.135 and 99.865 % require 7408 values, so that ten are expected beyond each; their interval is that
    of the bootstrap. None for under two values, or no spread. [NIST 6.1.6; interval: Bissell 1990; ISO 22514-2; Efron
    and Tibshirani 1993]
    """
    if values.size < 2 or np.ptp(values) == 0:
        return None
    count = values.size
    if is_normal(values):
        middle, deviation = np.mean(values), np.std(values, ddof=1)
        ppk = float(_nearest(middle + deviation * np.array([-3.0, 0.0, 3.0]), lower, upper))
        half = 1.959963985 * float(np.sqrt(1 / (9 * count) + ppk**2 / (2 * (count - 1))))
        return Capability(ppk, ppk - half, ppk + half, "normal")
    if count < FEWEST_PERCENTILES:
        return Capability(np.nan, np.nan, np.nan, f"not normal; percentiles need {FEWEST_PERCENTILES} values")
    ppk = float(_nearest(np.asarray(np.quantile(values, _PERCENTILES), dtype=float), lower, upper))
    low, high = np.quantile(_nearest(_resampled(values), lower, upper), [0.025, 0.975]).tolist()
    return Capability(ppk, low, high, "percentiles")


def _resampled(values: Floats) -> Floats:
    """(3, B) percentiles of bootstrap samples, by the ranks that ordered uniform draws have in the sample.

    The draws at some ranks of n uniform ones are beta distributed, each given the one below it.
    """
    rng, count, below, rank = np.random.default_rng(_SEED), values.size, np.zeros(_RESAMPLES), 0
    percentiles = []
    for share in _PERCENTILES:
        at = round(share * (count - 1)) + 1
        below = below + (1 - below) * rng.beta(at - rank, count - at + 1, _RESAMPLES)
        percentiles.append(np.sort(values)[np.minimum((below * count).astype(int), count - 1)])
        rank = at
    return np.array(percentiles)


def _nearest(percentiles: Floats, lower: float | None, upper: float | None) -> Floats:
    """Distance of the nearer limit from the middle, over that of the percentile on its side."""
    bottom, middle, top = percentiles
    sides = [(middle - lower) / np.maximum(middle - bottom, 1e-300)] if lower is not None else []
    sides += [(upper - middle) / np.maximum(top - middle, 1e-300)] if upper is not None else []
    return np.min(sides, axis=0)


@dataclass(frozen=True)
class Gauge:
    """Sources of the variation of master dampers, as standard deviations."""

    repeatability: float  # remainder after dampers and sessions
    reproducibility: float  # from session to session
    parts: float  # from damper to damper of the population

    @property
    def gauge(self) -> float:
        """Of the rig: both together."""
        return float(np.hypot(self.repeatability, self.reproducibility))

    @property
    def share(self) -> float:
        """Share of the rig in the total variation (%GRR as a fraction)."""
        return self.gauge / float(np.hypot(self.gauge, self.parts)) if self.parts or self.gauge else np.nan


def gauge_study(table: Floats, line: Floats) -> Gauge | None:
    """Two-way analysis of variance without replication; None for under two sessions.

    `table` (G, S) contains the master dampers by sessions, without gaps; `line` (N,) the values of the population,
    whose variation includes that of the rig, which is subtracted.
    """
    dampers, sessions = table.shape
    if sessions < 2 or dampers < 1:
        return None
    mean, by_damper, by_session = table.mean(), table.mean(axis=1), table.mean(axis=0)
    between = dampers * float(np.sum((by_session - mean) ** 2)) / (sessions - 1)
    if dampers == 1:  # sessions and repeats cannot be separated: the rig's variation is the sum
        repeat, session = 0.0, between
    else:
        left = table - by_damper[:, None] - by_session[None, :] + mean
        repeat = float(np.sum(left**2)) / ((dampers - 1) * (sessions - 1))
        session = max(0.0, (between - repeat) / dampers)
    total = float(np.var(line, ddof=1)) if line.size > 1 else 0.0
    return Gauge(np.sqrt(repeat), np.sqrt(session), np.sqrt(max(0.0, total - repeat - session)))
