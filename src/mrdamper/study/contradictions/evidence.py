"""Evidence of one linear model for a set of runs, to compare explanations of runs that disagree.

The force of a run is linear in elements of a damper: offset, spring, mass, viscous damping, friction
over velocity, friction whose sign depends on the displacement, too, and stop operators, which are
elastic-plastic elements [Prandtl and Ishlinskii] and may leak; every coefficient is a smooth function of the
current, a Gaussian process. Gain and offset of a run vary as they do between sessions. The logarithm
of the evidence (marginal likelihood) of a set of runs follows from sums over its runs, so that
leaving out a run or changing it costs one factorisation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import product
from typing import TypeVar

import numpy as np

from mrdamper.data import Floats, current_levels
from mrdamper.statistics.linear import inverse_of_triangle
from mrdamper.study.contradictions.tracks import Track

_YIELDS = (0.015, 0.06, 0.2, 0.6)  # yield displacements of the stop operators, relative to the median amplitude
# Yield displacements of stop operators that leak, and velocities from which they yield: a bypass over a compliance.
_LEAKY = tuple(product((0.06, 0.2), (0.3, 1.0)))
_VELOCITIES = (0.03, 0.1, 0.3)  # velocities at which friction saturates, relative to the median peak velocity
_LEADS = (0.1, 0.4)  # displacements that count as velocity in friction, relative to the median amplitude
R = TypeVar("R", "Moments", "RowProducts")
T = TypeVar("T")
_ELEMENTS = 7 + len(_VELOCITIES) + len(_LEADS) + len(_YIELDS) + len(_LEAKY)
_MAX_ELEMENT = 20.0  # size of an element relative to its usual one
_MAX_NODES = 7  # currents at which coefficients are estimated
_COMMON_DEVIATION, _SLOPE_DEVIATION = 1.5, 1.5  # standard deviations of a coefficient, relative to the median force
_CORRELATION_LENGTH = 0.5  # correlation length of a coefficient over the current, relative to the highest current
_MISFIT = 0.05  # standard deviation of the model error, relative to the run's force
_MIN_MISFIT = 0.03  # the same, relative to the median force
_INDEPENDENT_SAMPLES = 12.0  # independent samples of a run's model error


@dataclass(frozen=True)
class AssumedScatter:
    """Assumed differences between a run and the model of all runs."""

    misfit: float = 1.0  # factor of the model error that is usual
    gain: float = 0.06  # standard deviation of a run's gain
    offset: float = 0.04  # standard deviation of a run's offset, relative to the median force
    # current at which the course that all coefficients have over the current saturates, relative to the highest
    saturation: float = 4.0
    # standard deviation of a coefficient about the course that all have over the current, relative to the median force
    bend: float = 0.8
    # weight of the stop operators that leak: none, or that of the other elements
    leak: float = 0.0


@dataclass(frozen=True, eq=False)
class RowProducts:
    """Products of the rows of a run, in units of the median force."""

    gram: Floats  # (E, E), or (P, P) where the current changes
    moment: Floats  # (E,) or (P,)
    power: float
    rows: int
    size: float  # half the peak-to-peak force
    over: Floats | None  # (K,) shares of the nodes at the run's constant current
    misfit: float = 1.0  # factor of the model error that is usual at the run's motion, over that of all runs
    gain: float | None = None  # standard deviation of the run's gain, where it is not that of sessions

    def unexplained(self, expected: Floats, most_gain: float) -> float:
        """RMS error of an expected force, at the best gain up to `most_gain` and the best offset."""
        one = self.constant
        table = np.column_stack([expected, one])
        best = np.linalg.lstsq(table.T @ self.gram @ table, table.T @ self.moment, rcond=1e-10)[0]
        force = table @ np.clip(best, [1 / most_gain, -np.inf], [most_gain, np.inf])
        power = self.power - 2 * float(force @ self.moment) + float(force @ self.gram @ force)
        return float(np.sqrt(max(power, 0.0) / self.rows))

    @property
    def constant(self) -> Floats:
        """(E,) or (P,) coefficients of a force of one."""
        return _constant(len(self.gram))

    def with_force(self, gain: float, offset: float) -> RowProducts:
        """Return the same with another gain and offset of the force."""
        one = self.constant
        power = gain**2 * self.power + 2 * gain * offset * float(one @ self.moment) + self.rows * offset**2
        moment = gain * self.moment + offset * self.gram @ one
        return replace(self, moment=moment, power=power, size=abs(gain) * self.size)


@dataclass(frozen=True, eq=False)
class Moments:
    """Weighted products of the rows of a run, for its probability."""

    gram: Floats  # (E, E), or (P, P) where the current changes
    moment: Floats  # (E,) or (P,)
    power: float
    over: Floats | None  # (K,) shares of the nodes at the run's constant current


@dataclass(frozen=True, eq=False)
class Posterior:
    """Coefficients determined by a set of runs: mean and covariance."""

    mean: Floats  # (P,)
    root: Floats  # (P, P) the covariance is root root'
    evidence: Evidence
    log_evidence: float = 0.0  # logarithm of the evidence that the runs follow one model
    # mean and covariance at the currents that were asked for
    known: dict[bytes, tuple[Floats, Floats]] = field(default_factory=dict[bytes, tuple[Floats, Floats]])

    def at(self, over: Floats | None) -> tuple[Floats, Floats]:
        """Mean and covariance of the coefficients at a constant current, or of all of them."""
        key = b"" if over is None else over.tobytes()
        if key not in self.known:
            mean, root = self.mean, self.root
            if over is not None:
                size = mean.size // over.size
                mean = over @ mean.reshape(over.size, size)
                root = (over @ root.reshape(over.size, -1)).reshape(size, -1)
            self.known[key] = mean, root @ root.T
        return self.known[key]

    def weigh(self, runs: Sequence[RowProducts]) -> list[Moments]:
        """Weighted products of runs that are compared with these coefficients."""
        return self.evidence.weigh(runs, self)

    def log_probabilities(self, runs: Sequence[Moments]) -> list[float]:
        """Logarithm of the probability density of each run's force."""
        return _of_each_size(runs, lambda alike: _log_probabilities(_stacked(alike), *self._stacked_at(alike)))

    def without(self, run: Moments) -> tuple[Floats, Floats]:
        """Mean and covariance of the coefficients at a run's current, without that run."""
        mean, covariance = self._without([run])
        return mean[0], covariance[0]

    def log_probabilities_by_others(self, runs: Sequence[Moments]) -> list[float]:
        """Logarithm of the probability density of each run's force, by the other runs alone."""
        return _of_each_size(runs, lambda alike: _log_probabilities(_stacked(alike), *self._without(alike)))

    def _stacked_at(self, runs: Sequence[Moments] | Sequence[RowProducts]) -> tuple[Floats, Floats]:
        """(M, E) means and (M, E, E) covariances of the coefficients at the currents of runs of one size."""
        means, covariances = zip(*(self.at(run.over) for run in runs), strict=True)
        return np.array(means), np.array(covariances)

    def _without(self, runs: Sequence[Moments]) -> tuple[Floats, Floats]:
        """Means and covariances at the currents of runs of one size, each without that run."""
        gram, moment, _ = _stacked(runs)
        mean, covariance = self._stacked_at(runs)
        left = _identity(mean.shape[1]) - covariance @ gram
        kept = mean - (covariance @ moment[:, :, None])[:, :, 0]
        moments: Floats = np.linalg.solve(left, np.concatenate([kept[:, :, None], covariance], axis=2)).astype(float)
        return moments[:, :, 0], moments[:, :, 1:]


def _of_each_size(runs: Sequence[R], function: Callable[[list[R]], Iterable[T]]) -> list[T]:
    """Results of a function of runs of one size, for runs of several; in their order."""
    results: dict[int, T] = {}
    for size in {len(run.gram) for run in runs}:
        places = [k for k, run in enumerate(runs) if len(run.gram) == size]
        results |= zip(places, function([runs[k] for k in places]), strict=True)
    return [results[k] for k in range(len(runs))]


def _stacked(runs: Sequence[Moments] | Sequence[RowProducts]) -> tuple[Floats, Floats, Floats]:
    """(M, E, E), (M, E) and (M,) products of runs of one size."""
    return np.array([r.gram for r in runs]), np.array([r.moment for r in runs]), np.array([r.power for r in runs])


def _log_probabilities(runs: tuple[Floats, Floats, Floats], mean: Floats, covariance: Floats) -> list[float]:
    gram, moment, power = runs
    left = (gram @ mean[:, :, None])[:, :, 0]
    rest = moment - left
    matrix = _identity(mean.shape[1]) + gram @ covariance
    solved = (covariance @ np.linalg.solve(matrix, rest[:, :, None]))[:, :, 0]
    log_determinant = np.linalg.slogdet(matrix)[1]
    explained = np.sum(rest * solved - mean * (left - 2 * moment), axis=1)
    return (0.5 * (explained - power - log_determinant)).tolist()


@cache
def _identity(size: int) -> Floats:
    return np.eye(size)


@cache
def _constant(size: int) -> Floats:
    return np.tile(np.eye(_ELEMENTS)[0], size // _ELEMENTS)


class Evidence:
    """A linear model whose scales suit a set of runs."""

    def __init__(self, tracks: Sequence[Track]) -> None:
        self.spread = AssumedScatter()
        self.force = float(np.median([track.half_range for track in tracks])) or 1.0
        self.amplitude = float(np.median([np.ptp(t.displacement) / 2 for t in tracks])) or 1.0
        self._velocity = float(np.median([np.max(np.abs(t.velocity)) for t in tracks])) or 1.0
        self._acceleration = float(np.median([np.max(np.abs(t.acceleration)) for t in tracks])) or 1.0
        self.nodes = _nodes(tracks)
        self._shares: dict[float, Floats] = {}
        self._priors: dict[tuple[float, float, float], tuple[Floats, Floats, Posterior]] = {}

    @property
    def prior(self) -> Posterior:
        """Coefficients before any run."""
        return self._course[2]

    @property
    def _course(self) -> tuple[Floats, Floats, Posterior]:
        """Root of the covariance of a coefficient at the nodes, weights of the elements there, and the prior.

        (K, K), (P,), and the coefficients before any run.
        """
        course = self.spread.saturation, self.spread.bend, self.spread.leak
        if course not in self._priors:
            nodes = _root_covariance(self.nodes, self.spread.saturation, self.spread.bend)
            weights = np.repeat([1.0, self.spread.leak], [_ELEMENTS - len(_LEAKY), len(_LEAKY)])
            root: Floats = np.asarray(np.kron(nodes, np.diag(weights)), dtype=float)
            prior = Posterior(np.zeros(len(root)), root, self)
            self._priors[course] = nodes, np.tile(weights, self.nodes.size), prior
        return self._priors[course]

    def posterior(self, members: Sequence[Moments]) -> Posterior:
        """Coefficients determined by runs."""
        gram, moment = self._scaled(members)
        factor = np.linalg.cholesky(gram)
        inverse = inverse_of_triangle(factor)
        nodes, weights, _ = self._course
        spread, half = weights[:, None] * _along_nodes(nodes, inverse.T), inverse @ moment
        power = sum(member.power for member in members)
        log_evidence = 0.5 * float(half @ half - power) - float(np.sum(np.log(factor.diagonal())))
        return Posterior(spread @ half, spread, self, log_evidence)

    def log_evidence(self, members: Sequence[Moments]) -> float:
        """Logarithm of the evidence that runs follow one model."""
        gram, moment = self._scaled(members)
        # The last row of the factor is the solution for the others: no eigenvalue of the products is below one.
        bordered = np.zeros((len(moment) + 1, len(moment) + 1))
        bordered[:-1, :-1], bordered[-1, :-1], bordered[-1, -1] = gram, moment, 1 + moment @ moment
        factor = np.linalg.cholesky(bordered)
        half, diagonal = factor[-1, :-1], factor.diagonal()[:-1]
        power = sum(member.power for member in members)
        return float(0.5 * (half @ half) - np.sum(np.log(diagonal)) - 0.5 * power)

    def weigh(self, runs: Sequence[RowProducts], expected: Posterior) -> list[Moments]:
        """Weighted products of runs; the gain of a run multiplies the force that is expected of it."""
        return _of_each_size(runs, lambda alike: self._weigh_alike(alike, expected))

    def _weigh_alike(self, runs: Sequence[RowProducts], expected: Posterior) -> Iterable[Moments]:
        spread, one = self.spread, runs[0].constant
        gram, moment, power = _stacked(runs)
        mean = np.array([expected.at(run.over)[0] for run in runs])
        rows, size, level, gain = np.array(
            [
                (r.rows, r.size, (spread.misfit * model_error(r)) ** 2, spread.gain if r.gain is None else r.gain)
                for r in runs
            ]
        ).T
        varied = gain[:, None] * (mean - (((one @ gram) * mean).sum(axis=1) / rows)[:, None] * one)
        shared = np.stack([varied, (spread.offset * np.sqrt(np.maximum(size, 0.1)))[:, None] * one], axis=1)
        weight = _INDEPENDENT_SAMPLES / (rows * level)
        gram, moment = weight[:, None, None] * gram, weight[:, None] * moment
        along = shared @ np.concatenate([gram, moment[:, :, None]], axis=2)
        inside = along[:, :, :-1] @ shared.transpose(0, 2, 1)
        a, b, d = 1 + inside[:, 0, 0], inside[:, 0, 1], 1 + inside[:, 1, 1]
        determinant = a * d - b * b
        inverse = np.array([[d, -b], [-b, a]] / determinant).transpose(2, 0, 1)
        weighted = inverse @ along
        explained = along[:, :, :-1].transpose(0, 2, 1) @ weighted
        power = weight * power - (along[:, :, -1] * weighted[:, :, -1]).sum(axis=1)
        power += _INDEPENDENT_SAMPLES * np.log(level / size**2) + np.log(determinant)
        grams, moments = gram - explained[:, :, :-1], moment - explained[:, :, -1]
        return map(Moments, grams, moments, power.tolist(), (run.over for run in runs))

    def products(self, tracks: Sequence[Track]) -> list[RowProducts]:
        """Products of the rows of runs."""
        yields = np.array([*_YIELDS, *(length for length, _ in _LEAKY)]) * self.amplitude
        velocities = np.array([*(0.0 for _ in _YIELDS), *(velocity for _, velocity in _LEAKY)]) * self._velocity
        stops = stop_operators(tracks, yields, velocities / yields)
        return [self._of_rows(track, stop[track.rows] / yields) for track, stop in zip(tracks, stops, strict=True)]

    def _of_rows(self, track: Track, stops: Floats) -> RowProducts:
        rows = track.rows
        x, v = track.displacement[rows] / self.amplitude, track.velocity[rows] / self._velocity
        friction = [np.tanh(v / scale) for scale in _VELOCITIES]
        led = [np.tanh((v + lead * x) / _VELOCITIES[1]) for lead in _LEADS]
        linear = [np.ones(rows.size), x, x * x, v, track.acceleration[rows] / self._acceleration]
        uneven = [np.abs(v), np.abs(friction[1])]
        table = np.clip(np.column_stack([*linear, *friction, *led, *uneven, stops]), -_MAX_ELEMENT, _MAX_ELEMENT)
        over = None if track.current_changes else self.share(float(track.current[0]))
        if over is None:
            table = (self.shares(track.current[rows])[:, :, None] * table[:, None, :]).reshape(rows.size, -1)
        y = track.force[rows] / self.force
        return RowProducts(table.T @ table, table.T @ y, float(y @ y), rows.size, track.half_range / self.force, over)

    def share(self, current: float) -> Floats:
        """(K,) shares of the nodes at one current [A]."""
        if current not in self._shares:
            self._shares[current] = self.shares(np.array([current]))[0]
        return self._shares[current]

    def shares(self, current: Floats) -> Floats:
        """(N, K) shares of the nodes at currents [A]."""
        return np.column_stack([np.interp(current, self.nodes, hat) for hat in np.eye(self.nodes.size)])

    def _scaled(self, members: Sequence[Moments]) -> tuple[Floats, Floats]:
        """Return sums of the moments of runs over all nodes in units of the prior, which adds one to the products."""
        root, weights, _ = self._course
        count = self.nodes.size
        gram, moment = np.zeros((count * _ELEMENTS, count * _ELEMENTS)), np.zeros(count * _ELEMENTS)
        if changing := [member for member in members if member.over is None]:
            gram = _along_nodes(root.T, sum((member.gram for member in changing), gram))
            gram = _along_nodes(root.T, gram.T)
            moment = _along_nodes(root.T, sum((member.moment for member in changing), moment))
        constant = [(member.over, member) for member in members if member.over is not None]
        if constant:
            over = np.array([shares for shares, _ in constant]) @ root
            grams, moments, _ = _stacked([member for _, member in constant])
            pairs = (over[:, :, None] * over[:, None, :]).reshape(len(over), -1)
            summed = (pairs.T @ grams.reshape(len(grams), -1)).reshape(count, count, _ELEMENTS, _ELEMENTS)
            gram += summed.transpose(0, 2, 1, 3).reshape(gram.shape)
            moment += (over.T @ moments).ravel()
        gram *= weights[:, None] * weights
        gram.flat[:: len(gram) + 1] += 1
        return gram, weights * moment


def model_error(run: RowProducts) -> float:
    """Return standard deviation of the model error of a run, before the factor of all runs."""
    return run.misfit * math.sqrt((_MISFIT * run.size) ** 2 + _MIN_MISFIT**2 * min(1.0, run.size))


def _along_nodes(matrix: Floats, array: Floats) -> Floats:
    """Multiply the coefficients at the nodes, the rows of an array (P, ...), by a matrix (K, K)."""
    return (matrix @ array.reshape(len(matrix), -1)).reshape(array.shape)


def stop_operators(tracks: Sequence[Track], yields: Floats, rates: Floats) -> list[Floats]:
    """(L, Y) outputs [m] of elastic-plastic elements of some yield displacements [m] that leak at some rates [1/s]."""
    longest = max(track.displacement.size for track in tracks)
    steps, kept = np.zeros((2, longest, len(tracks), yields.size))
    for i, track in enumerate(tracks):
        leak = np.diff(track.time, prepend=track.time[:1])[:, None] * rates
        kept[: leak.shape[0], i] = np.exp(-leak)
        share = np.divide(-np.expm1(-leak), leak, out=np.ones_like(leak), where=leak > 0)
        steps[: leak.shape[0], i] = np.diff(track.displacement, prepend=track.displacement[:1])[:, None] * share
    state, least = np.zeros((len(tracks), yields.size)), -yields
    outputs = np.empty_like(steps)
    for step, held, row in zip(steps, kept, outputs, strict=True):
        np.multiply(state, held, out=row)
        np.add(row, step, out=row)
        np.minimum(row, yields, out=row)
        state = np.maximum(row, least, out=row)
    return [outputs[: track.displacement.size, i] for i, track in enumerate(tracks)]


def _nodes(tracks: Sequence[Track]) -> Floats:
    """Currents at which coefficients are estimated [A]: the tested levels, or some of many."""
    constant = [float(t.current[0]) for t in tracks if not t.current_changes]
    levels: set[float] = set(current_levels(constant)) if constant else set()
    for track in tracks:
        if track.current_changes:
            levels |= set(np.percentile(track.current, (0, 50, 100)).tolist())
    values = np.array(sorted(levels))
    if values.size > _MAX_NODES:
        values = np.unique(np.quantile(values, np.linspace(0, 1, _MAX_NODES)))
    return values


def _root_covariance(nodes: Floats, saturation: float, bend: float) -> Floats:
    """(K, K) root of the covariance of a coefficient at the nodes."""
    share = nodes / (nodes.max() or 1.0)
    near = np.exp(-0.5 * ((share[:, None] - share) / _CORRELATION_LENGTH) ** 2)
    rise = np.tanh(share / saturation) / np.tanh(1 / saturation)
    covariance = _COMMON_DEVIATION**2 + _SLOPE_DEVIATION**2 * rise[:, None] * rise + bend**2 * near
    return np.asarray(np.linalg.cholesky(covariance + 1e-6 * np.eye(nodes.size)), dtype=float)
