"""Prediction intervals calibrated on runs that were predicted by models identified without them.

The error model gives the shape of an interval: a standard deviation at every sample, of the peak force and of the
dissipated energy. The number of standard deviations for a stated coverage follows from cross-validated residuals: by
samples pooled over independent units of equal weight [Dunn, Wasserman and Ramdas 2023, J. Am. Stat. Assoc. 118, 2491],
and by runs for the peak force and the energy [Vovk, Gammerman and Shafer 2005, between two order statistics: Beran and
Hall 1993, J. R. Stat. Soc. B 55, 643; with several runs per unit: Lee, Barber and Willett 2023, arXiv:2306.06342].
Residuals of cross-validation replace those of a calibration set [Barber, Candès, Ramdas and Tibshirani 2021, Ann. Stat.
49, 486: the jackknife, whose level holds for stable fits].
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.distance import Distance
from mrdamper.dampers.sessions import GainOffset
from mrdamper.data.arrays import Floats, index_at
from mrdamper.data.runs import Run, once_per_run
from mrdamper.data.sessions import session_of
from mrdamper.data.strict_text import STRICT
from mrdamper.data.wording import counted, number
from mrdamper.identification.intervals import student
from mrdamper.physics.motion.sines import equivalent_sine, sine_condition
from mrdamper.statistics.linear import nonnegative_least_squares
from mrdamper.statistics.metrics import dissipated_power, peak_force
from mrdamper.statistics.peaks import cycle_extremes, cycle_starts, extreme_forces

Quantity = Literal["force", "peak", "energy"]
QUANTITIES: tuple[Quantity, ...] = ("force", "peak", "energy")
StandardizedErrors = dict[Quantity, Floats]  # of samples, peaks and energies of a run, magnitudes
LEVELS = (0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95, 0.975, 0.99)  # at which factors are stored
REPORTED_LEVEL = 0.9  # of the coverage that a study states
_MAX_SAMPLES = 400  # of a run
_ENOUGH_UNITS = 9  # independent units that reach a level of 90 %
_MAX_FACTOR = 1e3  # standard deviations, to which larger errors are limited
_MAX_GROWTH = 10.0  # relative error per unit of distance, to which larger ones are limited
# Growth by each distance that is typical of dampers of known truth (`benchmarks.synthetic_choice`): alone where no fold
# is so far from its tests (one motion, two currents, random records alone), and beside the folds that are, which count
# as much, because dampers differ
_TYPICAL_GROWTH = (0.15, 0.25, 0.25)
_NORMAL_DOF = 1e9  # of a normal distribution
_SHOWN = (0.02, 0.05, 0.1)  # distances of a fold from its tests from which it shows growth
_NONE: Mapping[str, Floats] = {}  # relative variances of runs by the parameters, where none are known
_ROUNDING = 1e-9  # of a number of units
_NORMAL_MEDIAN = 1.4826  # standard deviation of a normal distribution over its median absolute deviation


@dataclass(frozen=True, eq=False)
class PredictedRun:
    """A run and its prediction, inside the steady window."""

    run_id: str
    session: str | None  # None where it is not known
    predicted: Floats  # (N,) at most some hundred samples [N]
    measured: Floats  # (N,) [N]
    peak: Floats  # (L,) measured over predicted peak-to-peak force of each loop (`_loops`)
    energy: Floats  # (L,) the same of the dissipated energy
    away: Callable[[], Distance] = Distance  # calculates the distance from the runs the model was identified from

    @classmethod
    def of(cls, run: Run, predicted: Floats, velocity: Floats, away: Callable[[], Distance] = Distance) -> PredictedRun:
        """From the prediction (N,) [N] along the whole run; raises E_CLOCK as `session_of`."""
        at, loops = steady_samples(run), _loops(run)
        measured, powers = (
            np.array([dissipated_power(force[loop], velocity[loop], run.time[loop]) for loop, _ in loops])
            for force in (run.force, predicted)
        )
        peaks = np.array([_half(cycle_extremes(predicted[loop], cycles)) for loop, cycles in loops])
        thin = slice(at.start, at.stop, max(1, (at.stop - at.start) // _MAX_SAMPLES))
        return cls(
            run.id,
            session_of(run),
            predicted[thin].copy(),
            run.force[thin].copy(),
            _peaks(run) / np.maximum(peaks, 1e-300),
            np.divide(measured, powers, out=np.full(len(loops), np.inf), where=powers != 0),
            away,
        )

    @classmethod
    def joined(cls, run_id: str, parts: Sequence[PredictedRun]) -> PredictedRun:
        """Return the run of stretches of about one length."""
        thin = slice(None, None, len(parts))
        return cls(
            run_id,
            parts[0].session,
            np.concatenate([part.predicted[thin] for part in parts]),
            np.concatenate([part.measured[thin] for part in parts]),
            np.concatenate([part.peak for part in parts]),
            np.concatenate([part.energy for part in parts]),
            parts[0].away,
        )

    @cached_property
    def distance(self) -> Distance:
        """Distance from the runs that the model was identified from; intervals of a selected damper alone take it."""
        return self.away()

    @property
    def half(self) -> float:
        """Half the peak-to-peak predicted force [N]."""
        return peak_force(self.predicted) or 1.0

    @property
    def reading(self) -> GainOffset:
        """Least squares of the measured force on the predicted one."""
        return GainOffset.of(self.measured, self.predicted)


@once_per_run
def steady_samples(run: Run) -> slice:
    """Return the samples inside the steady window of a run."""
    inside = np.flatnonzero(run.in_window)
    return slice(int(inside[0]), int(inside[-1]) + 1)


@once_per_run
def _loops(run: Run) -> list[tuple[slice, NDArray[np.intp]]]:
    """Return the samples of each loop whose peak and energy are compared, the window of a sine at one current, and
    where among them its cycles begin.

    A record of another motion, or of changing current, is cut into cycles of its mean frequency: over the whole record
    errors at its motions and currents cancel. Cycles of less than half its mean amplitude have no loop.
    """
    sine, at = equivalent_sine(run), steady_samples(run)
    frequency = sine.condition.frequency_Hz
    loops, count = [at], int(np.ptp(run.time[at]) * frequency)
    if count >= 2 and sine_condition(run) is None:
        ends = pairwise([at.start, *(at.start + cycle_starts(at.stop - at.start, count)[1:]).tolist(), at.stop])
        cycles = [slice(begin, end) for begin, end in ends]
        moved = [np.ptp(run.displacement[cycle]) for cycle in cycles]
        loops = [c for c, swing in zip(cycles, moved, strict=True) if swing >= sine.condition.amplitude_m] or [at]
    sizes = [loop.stop - loop.start for loop in loops]
    counts = [min(max(int(np.ptp(run.time[loop]) * frequency), 1), n) for loop, n in zip(loops, sizes, strict=True)]
    return [(loop, cycle_starts(n, cycles)) for loop, n, cycles in zip(loops, sizes, counts, strict=True)]


@once_per_run
def _peaks(run: Run) -> Floats:
    """(L,) measured peak forces [N] of the loops."""
    return np.array([_half(extreme_forces(run.force[loop], cycles)) for loop, cycles in _loops(run)])


def measured_peak(run: Run) -> float:
    """Half the peak-to-peak force [N] in the steady window of a run, for comparison with the interval of the peak.

    It is the median over the cycles of a sine, because the first may contain the start of the motion, and one a spike.
    """
    peaks = _peaks(run)
    return float(peaks[0]) if peaks.size == 1 else peak_force(run.force[run.in_window])


def _half(ends: tuple[float, float]) -> float:
    return (ends[0] - ends[1]) / 2


@dataclass(frozen=True)
class ModelError:
    """Standard deviations of the residuals after gain and offset of a run, and of these between runs."""

    force: float  # over half the peak-to-peak predicted force
    peak: float  # relative
    energy: float  # relative
    gain: float  # of all runs about the prediction, including sessions [-]
    offset: float  # the same [N]


def model_error(runs: Sequence[PredictedRun]) -> ModelError:
    """Root mean square of the residual after gain and offset of each run, one at least; median spread of these."""
    corrected = [(run, run.reading) for run in runs]
    rests = [r.rest / run.half**2 for run, r in corrected]
    gains, offsets = [r.gain - 1 for _, r in corrected], [r.offset for _, r in corrected]
    peaks, energies = (
        [getattr(run, name) / r.gain - 1 for run, r in corrected if r.gain > 0] for name in ("peak", "energy")
    )

    def root(errors: Sequence[Floats]) -> float:
        finite = [own for e in errors if (own := e[np.isfinite(e)]).size]
        return float(np.sqrt(np.mean([np.mean(e**2) for e in finite]))) if finite else 0.0

    def spread(values: Sequence[float]) -> float:
        return _NORMAL_MEDIAN * float(np.median(np.abs(values)))

    return ModelError(float(np.sqrt(np.mean(rests))), root(peaks), root(energies), spread(gains), spread(offsets))


def scatter_between_sessions(runs: Sequence[PredictedRun]) -> tuple[float, float] | None:
    """Estimate the standard deviations of the gain and of the offset [N] between sessions.

    The runs were predicted by models identified without their session. The mean of a session, predicted by the mean of
    the S - 1 others, has an error of S / (S - 1) times the variance. Runs beyond the currents of the others do not
    count, because extrapolation changes their gain, too; None if fewer than two sessions remain.
    """
    own: dict[str | None, list[tuple[float, float]]] = {}
    for run in runs:
        if not run.distance.beyond:
            own.setdefault(run.session, []).append((run.reading.gain, run.reading.offset))
    if len(own) < 2:
        return None
    means = np.array([np.mean(values, axis=0) for values in own.values()]) - [1.0, 0.0]
    sessions = len({run.session for run in runs})
    gain, offset = np.sqrt((1 - 1 / sessions) * np.mean(means**2, axis=0)).tolist()
    return gain, offset


@dataclass(frozen=True)
class Growth:
    """Standard deviations by which the error of the form grows with the distance from the tests."""

    __pydantic_config__: ClassVar = STRICT

    # force, peak, energy: per unit of `Distance.between`, `beyond` and `motion`, of the force over half its
    # peak-to-peak value, of the peak force and of the dissipated energy, relative
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    peak: tuple[float, float, float] = (0.0, 0.0, 0.0)
    energy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    dof: tuple[float, float, float] = (_NORMAL_DOF, _NORMAL_DOF, _NORMAL_DOF)  # of their squares, by distance

    def half_width(self, quantity: Quantity, distance: Distance, level: float) -> float:
        """Half the relative interval by a distance alone."""
        quantiles = [student(level, dof) for dof in self.dof]
        return float(np.sqrt(np.square(np.multiply(getattr(self, quantity), quantiles)) @ distance.squares))

    def variance(self, quantity: Quantity, distance: Distance) -> float:
        """Relative variance that a distance adds."""
        return float(np.square(getattr(self, quantity)) @ distance.squares)

    @classmethod
    def of(
        cls,
        runs: Sequence[PredictedRun],
        at_tests: ModelError,
        by_parameters: Mapping[str, Floats] = _NONE,
        curvature: Floats | None = None,
    ) -> Growth:
        """Least squares of the squared errors in excess of those at the tests, by the squared distances.

        The fastest motions, or the highest current, are one fold, which may show no growth by chance. The variances of
        the folds, of the typical growth and of the curvature have one degree of freedom each and are pooled [moderated
        variances: Smyth 2004, Stat. Appl. Genet. Mol. Biol. 3, 3]; a distance that no run has has no fold.

        The runs were predicted by models identified without a condition, a current, or the fastest motions.
        `by_parameters`: by run, (3,) relative variances of the force, the peak and the energy by the parameters, which
        an interval counts beside growth. `curvature` (3,): their growth by motion that the curvature over the velocity
        shows (`growth_by_curvature`).
        """
        evidence, dof = np.tile(np.square(_TYPICAL_GROWTH), (3, 1)), np.ones(3)
        if away := [run for run in runs if run.distance.squares.any()]:
            table = np.array([run.distance.squares for run in away])
            size = np.sqrt(np.mean(table**2, axis=0))
            size[size == 0] = 1.0
            shown = table.max(axis=0) > np.square(_SHOWN)
            excess = np.array(
                [_squared_errors(r) - _expected(r, at_tests) - by_parameters.get(r.run_id, np.zeros(3)) for r in away]
            )
            slopes = np.array([nonnegative_least_squares(table / size, column)[0] for column in excess.T]) / size
            evidence += np.where(shown, np.minimum(slopes, _MAX_GROWTH**2), 0.0)
            dof += shown
        if curvature is not None:
            evidence[:, 2] += curvature**2
            dof[2] += 1
        columns: list[Any] = np.vstack([np.sqrt(evidence / dof), dof]).tolist()
        return cls(*map(tuple, columns))


def _squared_errors(run: PredictedRun) -> Floats:
    """(3,) squared relative errors of the force, the peak and the energy; values that are not finite count as one."""
    with np.errstate(over="ignore", invalid="ignore"):  # of a prediction that runs away
        force = np.array([np.mean((run.measured - run.predicted) ** 2) / run.half**2])
        squares = [force, (run.peak - 1) ** 2, (run.energy - 1) ** 2]
    return np.array([float(np.mean(np.where(np.isfinite(of), of, 1.0))) for of in squares])


def _expected(run: PredictedRun, at_tests: ModelError) -> Floats:
    """(3,) expected squared errors at the tests."""
    gain = at_tests.gain**2
    moved = gain * float(np.mean(run.predicted**2)) / run.half**2 + (at_tests.offset / run.half) ** 2
    return np.array([moved + at_tests.force**2, gain + at_tests.peak**2, gain + at_tests.energy**2])


@dataclass(frozen=True)
class Calibration:
    """Factors on the standard deviations of the error model, and their observed coverage."""

    __pydantic_config__: ClassVar = STRICT

    unit: Literal["run", "session"]  # taken as independent
    units: int
    # force, peak, energy: factor on the quantile of a normal distribution at each of `LEVELS` that these units reach
    force: tuple[float, ...]
    peak: tuple[float, ...]
    energy: tuple[float, ...]
    # share of samples, peak forces and energies inside their interval of 90 %, or of the level that can be reached,
    # each unit omitted from the calibration in turn
    coverage: tuple[float, float, float]

    @property
    def reachable(self) -> float:
        """Highest level that this many independent units support."""
        return self.units / (self.units + 1)

    @property
    def level(self) -> float:
        """Level of the observed coverage."""
        return min(REPORTED_LEVEL, self.reachable)

    @property
    def summary(self) -> str:
        """Coverage as a sentence without its full stop."""
        force, peak, energy = (f"{100 * share:.0f} %" for share in self.coverage)
        few = ""
        if self.units < _ENOUGH_UNITS:
            few = f"; {100 * REPORTED_LEVEL:.0f} % requires {_ENOUGH_UNITS} independent {self.unit}s"
        return (
            f"{number(100 * self.level, 3)} % prediction intervals covered {force} of the samples, "
            f"{peak} of the peak forces and {energy} of the energies of "
            + counted(self.units, f"cross-validated {self.unit}")
            + f" (conditions omitted, not currents){few}"
        )

    def factor(self, quantity: Quantity, level: float) -> float:
        """Factor on a normal interval; beyond the reachable level that of the highest one."""
        values: tuple[float, ...] = getattr(self, quantity)
        return float(np.interp(level, LEVELS[: len(values)], values)) if values else 1.0

    @classmethod
    def of(cls, runs: Sequence[PredictedRun], scores: Sequence[StandardizedErrors]) -> Calibration:
        """From R cross-validated runs and their errors over the standard deviation of the error model."""
        sessions = {run.session for run in runs}
        by_session = None not in sessions and len(sessions) >= _ENOUGH_UNITS
        names = [run.session if by_session else run.run_id for run in runs]
        units = [[s for s, n in zip(scores, names, strict=True) if n == name] for name in dict.fromkeys(names)]
        factors = {q: _factors(units, q) for q in QUANTITIES}
        whole = cls("session" if by_session else "run", len(units), **factors, coverage=(0.0, 0.0, 0.0))
        others = [[other for other in units if other is not unit] for unit in units]
        coverage = tuple(_covered(units, others, q, whole.level) for q in QUANTITIES)
        return cls(whole.unit, whole.units, whole.force, whole.peak, whole.energy, coverage)  # type: ignore[arg-type]


def standardized(run: PredictedRun, force: Floats, peak: float, energy: float) -> StandardizedErrors:
    """Return the errors of a run over standard deviations of the force (N,) [N], and of peak and energy, relative."""

    def over(error: Floats, deviation: Floats | float) -> Floats:
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.atleast_1d(np.abs(error) / deviation)
        return np.nan_to_num(ratio, nan=0.0, posinf=np.inf)

    errors = run.measured - run.predicted, run.peak - 1, run.energy - 1
    return dict(zip(QUANTITIES, map(over, errors, (force, peak, energy)), strict=True))


def _factors(units: Sequence[Sequence[StandardizedErrors]], quantity: Quantity) -> tuple[float, ...]:
    """Quantiles of the scores over those of a normal distribution, at the levels that can be reached."""
    reach = len(units) / (len(units) + 1)
    return tuple(
        min(_quantile(units, quantity, level) / student(level, np.inf), _MAX_FACTOR)
        for level in LEVELS
        if level <= reach
    )


def _quantile(units: Sequence[Sequence[StandardizedErrors]], quantity: Quantity, level: float) -> float:
    """Quantile of the scores with equal weight of units.

    If runs have one value each, the quantile accounts for a future unit and lies between two order statistics: the
    larger one alone covers up to 1 / (n + 1) more than the level [Beran and Hall 1993]. Samples, and peaks and energies
    of the loops of long records, are pooled.
    """
    scores = [scored[quantity] for unit in units for scored in unit]
    sizes = [len(unit) for unit in units for _ in unit]
    weights = [np.full(s.size, 1 / s.size / size) for s, size in zip(scores, sizes, strict=True)]
    values, weight = np.concatenate(scores), np.concatenate(weights)
    order = np.argsort(values)
    reached = np.cumsum(weight[order])

    def smallest(count: float) -> float:
        return float(values[order[min(index_at(reached, count * (1 - 1e-12)), values.size - 1)]])

    if quantity == "force" or all(s.size > 1 for s in scores):
        return smallest(level * len(units))
    below, share = divmod(level * (len(units) + 1) + _ROUNDING, 1.0)
    low, high = smallest(below), smallest(below + 1)
    return low + share * (high - low) if share > 2 * _ROUNDING and low < high else low


def _covered(
    units: Sequence[Sequence[StandardizedErrors]],
    others: Sequence[Sequence[Sequence[StandardizedErrors]]],
    quantity: Quantity,
    level: float,
) -> float:
    """Share of scores that factors from the other units cover, with equal weight of units."""
    shares: list[float] = []
    for unit, rest in zip(units, others, strict=True):
        reached = min(level, len(rest) / (len(rest) + 1)) if rest else 0.0
        most = _quantile(rest, quantity, reached) if rest else np.inf
        shares.append(float(np.mean([np.mean(scored[quantity] <= most) for scored in unit])))
    return float(np.mean(shares))
