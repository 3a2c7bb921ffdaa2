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
from functools import cache, lru_cache
from itertools import chain, product
from typing import Any, Self, TypeVar

import numpy as np

from mrdamper.data import Floats, current_levels
from mrdamper.data.arrays import blocks
from mrdamper.statistics.linear import inverse_of_triangle
from mrdamper.study.contradictions.tracks import Track

_YIELDS = (0.015, 0.06, 0.2, 0.6)  # yield displacements of the stop operators, relative to the median amplitude
# Yield displacements of stop operators that leak, and velocities from which they yield: a bypass over a compliance.
_LEAKY = (*product((0.06, 0.2), (0.3, 1.0)), (0.06, 2.5))
_VELOCITIES = (0.03, 0.1, 0.3)  # velocities at which friction saturates, relative to the median peak velocity
_LEADS = (0.1, 0.4)  # displacements that count as velocity in friction, relative to the median amplitude
S = TypeVar("S")
T = TypeVar("T")
Scale = Any  # a number, or an array (B,) of several choices
_ELEMENTS = 7 + len(_VELOCITIES) + len(_LEADS) + len(_YIELDS) + len(_LEAKY)
_MAX_ELEMENT = 20.0  # size of an element relative to its usual one
_MAX_NODES = 7  # currents at which coefficients are estimated
_COMMON_DEVIATION, _SLOPE_DEVIATION = 1.5, 1.5  # standard deviations of a coefficient, relative to the median force
_CORRELATION_LENGTH = 0.5  # correlation length of a coefficient over the current, relative to the highest current
_FIRST, _SECOND = np.eye(2)[:, :, None]
_MISFIT = 0.05  # standard deviation of the model error, relative to the run's force
_MIN_MISFIT = 0.03  # the same, relative to the median force
_TRACKS_PER_BLOCK = 100  # runs whose stop operators are computed at once
_INDEPENDENT_SAMPLES = 12.0  # independent samples of a run's model error


@dataclass(frozen=True)
class AssumedScatter:
    """Assumed differences between a run and the model of all runs: one choice of them, or arrays (B,) of several.

    Results of several choices have them as first axis.
    """

    misfit: Scale = 1.0  # factor of the model error that is usual
    gain: Scale = 0.06  # standard deviation of a run's gain
    offset: Scale = 0.04  # standard deviation of a run's offset, relative to the median force
    # current at which the course that all coefficients have over the current saturates, relative to the highest
    saturation: Scale = 4.0
    # standard deviation of a coefficient about the course that all have over the current, relative to the median force
    bend: Scale = 0.8
    # weight of the stop operators that leak: none, or that of the other elements
    leak: Scale = 0.0

    @classmethod
    def several(cls, choices: Sequence[Self]) -> Self:
        """Return several choices at once; the scatter or the course, if they have it in common, is computed once."""
        values: Floats = np.array([list(vars(choice).values()) for choice in choices]).T
        vary = np.repeat(np.any(values != values[:, :1], axis=1).reshape(2, 3).any(axis=1), 3)
        return cls(*(own if varies else float(own[0]) for own, varies in zip(values, vary, strict=True)))


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
    """Weighted products of the rows of a run, for its probability, of one choice of scatter or several (B, ...)."""

    gram: Floats  # (E, E), or (P, P) where the current changes
    moment: Floats  # (E,) or (P,)
    power: Scale
    over: Floats | None  # (K,) shares of the nodes at the run's constant current


@dataclass(frozen=True, eq=False)
class Posterior:
    """Coefficients determined by a set of runs, mean and covariance, for one choice of scatter or several (B, ...)."""

    mean: Floats  # (P,)
    root: Floats  # (P, P) the covariance is root root'
    evidence: Evidence
    log_evidence: Scale = 0.0  # logarithm of the evidence that the runs follow one model
    # mean and covariance at the currents that were asked for
    known: dict[bytes, tuple[Floats, Floats]] = field(default_factory=dict[bytes, tuple[Floats, Floats]])

    def at(self, over: Floats | None) -> tuple[Floats, Floats]:
        """Mean and covariance of the coefficients at a constant current, or of all of them."""
        return self.at_each([over])[0]

    def at_each(self, overs: Sequence[Floats | None]) -> list[tuple[Floats, Floats]]:
        """Return `at` for several currents."""
        keys = [b"" if over is None else over.tobytes() for over in overs]
        missing = {key: over for key, over in zip(keys, overs, strict=True) if key not in self.known}
        if missing.pop(b"", missing) is None:
            self.known[b""] = self.mean, self.root @ self.root.swapaxes(-1, -2)
        if missing:
            mean, root, shares = self.mean, self.root, np.array(list(missing.values()))
            means = shares @ mean.reshape(*mean.shape[:-1], shares.shape[1], -1)
            roots = shares @ root.reshape(*root.shape[:-2], shares.shape[1], -1)
            roots = roots.reshape(*means.shape, root.shape[-1])
            pairs = zip(_parted(means, 1), _parted(roots @ roots.swapaxes(-1, -2), 2), strict=True)
            self.known.update(zip(missing, pairs, strict=True))
        return [self.known[key] for key in keys]

    def weigh(self, runs: Sequence[RowProducts]) -> list[Moments]:
        """Weighted products of runs that are compared with these coefficients."""
        return self.evidence.weigh(runs, self)

    def log_probabilities(self, runs: Sequence[Moments]) -> list[Any]:
        """Logarithm of the probability density of each run's force."""
        return _of_each_kind(runs, _size, lambda alike: _log_probabilities(*self._beside(alike)))

    def without(self, run: Moments) -> Floats:
        """Mean of the coefficients at a run's current, without that run."""
        return _without(*self._beside([run]))[0][0]

    def log_probabilities_by_others(self, runs: Sequence[Moments]) -> list[Any]:
        """Logarithm of the probability density of each run's force, by the other runs alone."""
        return _of_each_kind(runs, _size, lambda alike: _log_probabilities_by_others(*self._beside(alike)))

    def _beside(self, runs: Sequence[Moments]) -> list[Floats]:
        """Products of runs of one size, and means and covariances of the coefficients at their currents."""
        means, covariances = zip(*self.at_each([run.over for run in runs]), strict=True)
        return [*_products(runs), _joined(means, 1), _joined(covariances, 2)]


def _size(run: Moments | RowProducts) -> int:
    return run.gram.shape[-1]


def _of_each_kind(
    items: Sequence[S], kind: Callable[[S], object], function: Callable[[list[S]], Iterable[T]]
) -> list[T]:
    """Results of a function of items of one kind, for items of several; in their order."""
    places: dict[object, list[int]] = {}
    for k, item in enumerate(items):
        places.setdefault(kind(item), []).append(k)
    results: dict[int, T] = {}
    for at in places.values():
        results |= zip(at, function([items[k] for k in at]), strict=True)
    return [results[k] for k in range(len(items))]


def _products(runs: Sequence[Moments] | Sequence[RowProducts]) -> list[Floats]:
    """(M, E, E), (M, E) and (M,) products of runs of one size."""
    return [_joined([getattr(r, name) for r in runs], k) for k, name in ((2, "gram"), (1, "moment"), (0, "power"))]


def _joined(arrays: Sequence[Any], axes: int) -> Floats:
    """Arrays of runs as one, in which the runs precede the last axes of one choice."""
    joined = np.array(arrays)
    return joined if joined.ndim == 1 + axes else np.moveaxis(joined, 0, -1 - axes)


def _parted(array: Floats, axes: int) -> Iterable[Any]:
    """Arrays of runs that `_joined` joined."""
    return array if array.ndim == 1 + axes else np.moveaxis(array, -1 - axes, 0)


def _times(matrix: Floats, vector: Floats) -> Floats:
    product: Floats = (matrix @ vector[..., None])[..., 0]
    return product


def _log_probabilities(gram: Floats, moment: Floats, power: Floats, mean: Floats, covariance: Floats) -> Iterable[Any]:
    left = _times(gram, mean)
    rest = moment - left
    matrix = _identity(mean.shape[-1]) + gram @ covariance
    solved = _times(covariance, np.asarray(np.linalg.solve(matrix, rest[..., None])[..., 0], dtype=float))
    explained = np.sum(rest * solved - mean * (left - 2 * moment), axis=-1)
    return _parted(0.5 * (explained - power - np.linalg.slogdet(matrix)[1]), 0)


def _without(gram: Floats, moment: Floats, power: Floats, mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """Means at the currents of runs, each without that run, and the matrix that divides the covariance without it."""
    left = _identity(mean.shape[-1]) - covariance @ gram
    kept = np.linalg.solve(left, (mean - _times(covariance, moment))[..., None])[..., 0]
    return np.asarray(kept, dtype=float), left


def _log_probabilities_by_others(
    gram: Floats, moment: Floats, power: Floats, mean: Floats, covariance: Floats
) -> Iterable[Any]:
    """`_log_probabilities` by the coefficients without each run, whose covariance reduces to that with it."""
    mean, left = _without(gram, moment, power, mean, covariance)
    forces = _times(gram, mean)
    rest = moment - forces
    explained = np.sum(rest * _times(covariance, rest) - mean * (forces - 2 * moment), axis=-1)
    return _parted(0.5 * (explained - power + np.linalg.slogdet(left)[1]), 0)


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
        self._priors: dict[tuple[float, float, float], Posterior] = {}

    @property
    def prior(self) -> Posterior:
        """Coefficients before any run, for one course over the current."""
        course = self.spread.saturation, self.spread.bend, self.spread.leak
        if course not in self._priors:
            nodes, weights = self._course
            root: Floats = np.asarray(np.kron(nodes, np.diag(weights[:_ELEMENTS])), dtype=float)
            self._priors[course] = Posterior(np.zeros(len(root)), root, self)
        return self._priors[course]

    @property
    def _course(self) -> tuple[Floats, Floats]:
        """(K, K) root of the covariance of a coefficient at the nodes, and (P,) weights of the elements there."""
        course, nodes = (self.spread.saturation, self.spread.bend, self.spread.leak), tuple(self.nodes.tolist())
        if isinstance(course[0], float):
            return _course_of(nodes, *course)
        roots, weights = zip(*(_course_of(nodes, *one) for one in zip(*course, strict=True)), strict=True)
        return np.array(roots), np.array(weights)

    def posterior(self, members: Sequence[Moments]) -> Posterior:
        """Coefficients determined by runs."""
        gram, moment = self._scaled(members)
        factor = np.linalg.cholesky(gram)
        inverse = inverse_of_triangle(factor)
        nodes, weights = self._course
        spread, half = weights[..., None] * _along_nodes(nodes, inverse.swapaxes(-1, -2)), _times(inverse, moment)
        log_determinant = np.sum(np.log(np.diagonal(factor, 0, -2, -1)), axis=-1)
        log_evidence = 0.5 * (np.sum(half * half, axis=-1) - sum(member.power for member in members)) - log_determinant
        return Posterior(_times(spread, half), spread, self, log_evidence)

    def log_evidence(self, members: Sequence[Moments]) -> Scale:
        """Logarithm of the evidence that runs follow one model."""
        gram, moment = self._scaled(members)
        # The last row of the factor is the solution for the others: no eigenvalue of the products is below one.
        size = moment.shape[-1]
        bordered = np.zeros((*moment.shape[:-1], size + 1, size + 1))
        bordered[..., :-1, :-1], bordered[..., -1, :-1] = gram, moment
        bordered[..., -1, -1] = 1 + np.sum(moment * moment, axis=-1)
        factor = np.linalg.cholesky(bordered)
        half, diagonal = factor[..., -1, :-1], np.diagonal(factor, 0, -2, -1)[..., :-1]
        power = sum(member.power for member in members)
        return 0.5 * (np.sum(half * half, axis=-1) - power) - np.sum(np.log(diagonal), axis=-1)

    def weigh(self, runs: Sequence[RowProducts], expected: Posterior) -> list[Moments]:
        """Weighted products of runs; the gain of a run multiplies the force that is expected of it."""
        return _of_each_kind(runs, _size, lambda alike: self._weigh_alike(alike, expected))

    def _weigh_alike(self, runs: Sequence[RowProducts], expected: Posterior) -> Iterable[Moments]:
        spread, one = self.spread, runs[0].constant
        gram, moment, power = _products(runs)
        mean = _joined([mean for mean, _ in expected.at_each([run.over for run in runs])], 1)
        own = [(r.rows, r.size, model_error(r), np.nan if r.gain is None else r.gain) for r in runs]
        rows, size, errors, gains = np.array(own).T
        misfit, gain, offset = (np.asarray(own)[..., None] for own in (spread.misfit, spread.gain, spread.offset))
        level, gain = (misfit * errors) ** 2, np.where(np.isnan(gains), gain, gains)
        varied = gain[..., None] * (mean - (np.sum((one @ gram) * mean, axis=-1) / rows)[..., None] * one)
        constant = (offset * np.sqrt(np.maximum(size, 0.1)))[..., None] * one
        shared = varied[..., None, :] * _FIRST + constant[..., None, :] * _SECOND
        weight = _INDEPENDENT_SAMPLES / (rows * level)
        gram, moment = weight[..., None, None] * gram, weight[..., None] * moment
        along = shared @ np.concatenate([gram, moment[..., None]], axis=-1)
        inside = along[..., :-1] @ shared.swapaxes(-1, -2)
        a, b, d = 1 + inside[..., 0, 0], inside[..., 0, 1], 1 + inside[..., 1, 1]
        determinant = a * d - b * b
        inverse = np.stack([d, -b, -b, a], axis=-1) / determinant[..., None]
        weighted = inverse.reshape(inside.shape) @ along
        explained = along[..., :-1].swapaxes(-1, -2) @ weighted
        power = weight * power - np.sum(along[..., -1] * weighted[..., -1], axis=-1)
        power = power + _INDEPENDENT_SAMPLES * np.log(level / size**2) + np.log(determinant)
        grams, moments = gram - explained[..., :-1], moment - explained[..., -1]
        return map(Moments, _parted(grams, 2), _parted(moments, 1), _parted(power, 0), (run.over for run in runs))

    def products(self, tracks: Sequence[Track]) -> list[RowProducts]:
        """Products of the rows of runs."""
        return _of_each_kind(tracks, lambda t: (t.time.size, t.rows.size, t.current_changes), self._of_alike)

    def _of_alike(self, tracks: Sequence[Track]) -> Iterable[RowProducts]:
        parts = blocks(len(tracks), _TRACKS_PER_BLOCK)
        return chain.from_iterable(self._of_rows(tracks[part]) for part in parts)

    def _of_rows(self, tracks: Sequence[Track]) -> Iterable[RowProducts]:
        """Products of runs of one number of samples, whose rows are the same."""
        yields = np.array([*_YIELDS, *(length for length, _ in _LEAKY)]) * self.amplitude
        velocities = np.array([*(0.0 for _ in _YIELDS), *(velocity for _, velocity in _LEAKY)]) * self._velocity
        rows = tracks[0].rows
        stops = stop_operators(tracks, yields, velocities / yields)[rows].swapaxes(0, 1) / yields
        channels = np.array(
            [(t.displacement[rows], t.velocity[rows], t.acceleration[rows], t.force[rows]) for t in tracks]
        )
        scales = np.array([self.amplitude, self._velocity, self._acceleration, self.force])
        x, v, a, y = channels.swapaxes(0, 1) / scales[:, None, None]
        friction = [np.tanh(v / scale) for scale in _VELOCITIES]
        led = [np.tanh((v + lead * x) / _VELOCITIES[1]) for lead in _LEADS]
        columns = [np.ones_like(x), x, x * x, v, a, *friction, *led, np.abs(v), np.abs(friction[1])]
        table = np.concatenate([np.stack(columns, axis=-1), stops], axis=-1)
        np.clip(table, -_MAX_ELEMENT, _MAX_ELEMENT, out=table)
        overs = [None if t.current_changes else self.share(float(t.current[0])) for t in tracks]
        if overs[0] is None:
            shares = np.array([self.shares(t.current[rows]) for t in tracks])
            table = (shares[..., :, None] * table[..., None, :]).reshape(*x.shape, -1)
        across = table.swapaxes(1, 2)
        sums = across @ table, _times(across, y), np.sum(y * y, axis=1).tolist()
        sizes = [t.half_range / self.force for t in tracks]
        return map(RowProducts, *sums, [x.shape[1]] * len(tracks), sizes, overs)

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
        root, weights = self._course
        count, constant = self.nodes.size, [member for member in members if member.over is not None]
        gram, moment = np.zeros((count * _ELEMENTS, count * _ELEMENTS)), np.zeros(count * _ELEMENTS)
        if len(constant) < len(members):
            grams, moments, _ = _products([member for member in members if member.over is None])
            along = root.swapaxes(-1, -2)
            gram = _along_nodes(along, _along_nodes(along, np.sum(grams, axis=-3)).swapaxes(-1, -2))
            moment = _along_nodes(along, np.sum(moments, axis=-2)[..., None])[..., 0]
        if constant:
            grams, moments, _ = _products(constant)
            over = np.array([member.over for member in constant]) @ root
            pairs = (over[..., :, None] * over[..., None, :]).reshape(*over.shape[:-1], -1)
            summed = pairs.swapaxes(-1, -2) @ grams.reshape(*grams.shape[:-2], -1)
            summed = summed.reshape(*summed.shape[:-2], count, count, _ELEMENTS, _ELEMENTS).swapaxes(-3, -2)
            gram = gram + summed.reshape(*summed.shape[:-4], *gram.shape[-2:])
            summed = over.swapaxes(-1, -2) @ moments
            moment = moment + summed.reshape(*summed.shape[:-2], -1)
        gram = weights[..., :, None] * gram * weights[..., None, :] + _identity(moment.shape[-1])
        return gram, weights * moment


def model_error(run: RowProducts) -> float:
    """Return standard deviation of the model error of a run, before the factor of all runs."""
    return run.misfit * math.sqrt((_MISFIT * run.size) ** 2 + _MIN_MISFIT**2 * min(1.0, run.size))


def _along_nodes(matrix: Floats, array: Floats) -> Floats:
    """Multiply the coefficients at the nodes, the rows of an array (P, ...), by a matrix (K, K)."""
    product = matrix @ array.reshape(*array.shape[:-2], matrix.shape[-1], -1)
    return product.reshape(*product.shape[:-2], *array.shape[-2:])


def stop_operators(tracks: Sequence[Track], yields: Floats, rates: Floats) -> Floats:
    """(L, M, Y) outputs [m] of elastic-plastic elements along runs of L samples.

    `yields`, `rates`: (Y,) yield displacements [m], and rates at which they leak [1/s].
    """
    times = {id(track.time): track.time for track in tracks}  # which several versions of a run have
    place = {key: k for k, key in enumerate(times)}
    time, x = np.array(list(times.values())).T.copy(), np.array([track.displacement for track in tracks]).T.copy()
    leak = np.diff(time, axis=0, prepend=time[:1])[:, :, None] * -rates
    kept, each = np.expm1(leak), [place[id(track.time)] for track in tracks]
    share = np.divide(kept, leak, out=np.ones_like(leak), where=leak < 0)
    kept += 1
    kept, outputs = np.take(kept, each, axis=1), np.take(share, each, axis=1)
    outputs *= np.diff(x, axis=0, prepend=x[:1])[:, :, None]
    state, before = np.zeros((2, len(tracks), yields.size))
    most = np.tile(yields, (len(tracks), 1))
    least = -most
    for row, held in zip(outputs, kept, strict=True):  # a row is the step before it is the output
        np.multiply(state, held, out=before)
        np.add(row, before, out=row)
        np.minimum(row, most, out=row)
        state = np.maximum(row, least, out=row)
    return outputs


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


@lru_cache
def _course_of(nodes: tuple[float, ...], saturation: float, bend: float, leak: float) -> tuple[Floats, Floats]:
    """(K, K) root of the covariance of a coefficient at nodes, and (P,) weights of the elements there."""
    share = np.array(nodes) / (max(nodes) or 1.0)
    near = np.exp(-0.5 * ((share[:, None] - share) / _CORRELATION_LENGTH) ** 2)
    rise = np.tanh(share / saturation) / np.tanh(1 / saturation)
    covariance = _COMMON_DEVIATION**2 + _SLOPE_DEVIATION**2 * rise[:, None] * rise + bend**2 * near
    root = np.asarray(np.linalg.cholesky(covariance + 1e-6 * np.eye(len(nodes))), dtype=float)
    return root, np.tile(np.repeat([1.0, leak], [_ELEMENTS - len(_LEAKY), len(_LEAKY)]), len(nodes))
