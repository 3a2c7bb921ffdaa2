"""Evidence of one linear model for a set of runs, to compare explanations of runs that disagree.

The force of a run is linear in elements of a damper: offset, spring, mass, viscous damping, friction
over velocity, and stop operators, which are elastic-plastic elements [Prandtl and Ishlinskii]; every
coefficient is a smooth function of the current, a Gaussian process. Gain and offset of a run vary as
they do between sessions. The logarithm of the evidence (marginal likelihood) of a set of runs follows
from sums over its runs, so that leaving out a run or changing it costs one factorisation.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from mrdamper.data import Floats, current_levels
from mrdamper.study.contradictions.tracks import Track

_YIELDS = (0.015, 0.06, 0.2, 0.6)  # yield displacements of the stop operators, relative to the median amplitude
_VELOCITIES = (0.03, 0.25)  # velocities at which friction saturates, relative to the median peak velocity
_ELEMENTS = 5 + len(_VELOCITIES) + len(_YIELDS)
_MOST_NODES = 7  # currents at which coefficients are estimated
_COMMON, _SLOPE, _BEND = 1.5, 1.5, 0.5  # standard deviations of a coefficient, relative to the median force
_LENGTH = 0.5  # correlation length of a coefficient over the current, relative to the highest current
_MISFIT = 0.05  # standard deviation of the model error, relative to the run's force
_FLOOR = 0.03  # the same, relative to the median force
_SAMPLES = 12.0  # independent samples of a run's model error
_GAIN = 0.06  # standard deviation of a run's gain
_OFFSET = 0.04  # standard deviation of a run's offset, relative to the median force


@dataclass(frozen=True, eq=False)
class Moments:
    """Weighted products of the rows of a run, all that its probability needs.

    Attributes
    ----------
    gram : (E, E) array, or (P, P) where the current changes
    moment : (E,) or (P,) array
    power : float
    over : (K,) array or None
        Shares of the nodes at the run's constant current.
    """

    gram: Floats
    moment: Floats
    power: float
    over: Floats | None


@dataclass(frozen=True, eq=False)
class Posterior:
    """What a set of runs determines: mean and covariance of the coefficients.

    Attributes
    ----------
    mean : (P,) array
    root : (P, P) array
        The covariance is root root'.
    evidence : Evidence
    """

    mean: Floats
    root: Floats
    evidence: Evidence

    def log_probability(self, run: Moments) -> float:
        """Logarithm of the probability density of a run's force."""
        mean, root = self.mean, self.root
        if run.over is not None:
            mean = run.over @ mean.reshape(run.over.size, -1)
            root = np.tensordot(run.over, root.reshape(run.over.size, mean.size, -1), axes=1)
        left = run.gram @ mean
        power = run.power + float(mean @ left) - 2 * float(mean @ run.moment)
        covariance = root @ root.T
        system = np.eye(mean.size) + run.gram @ covariance
        rest = run.moment - left
        gained = float(rest @ covariance @ np.linalg.solve(system, rest))
        return 0.5 * (gained - power - float(np.linalg.slogdet(system)[1]))

    def force(self, track: Track, columns: Floats) -> Floats:
        """(R,) expected force [N] at the rows of a run, from the elements there."""
        return self.evidence.force * (_full(columns, self.evidence.over_current(track)) @ self.mean)


class Evidence:
    """A linear model whose scales suit a set of runs.

    Parameters
    ----------
    tracks : sequence of Track
    misfit : float
        Factor of the model error that is usual.
    """

    def __init__(self, tracks: Sequence[Track], misfit: float = 1.0) -> None:
        self.misfit = misfit
        self.force = float(np.median([track.half_range for track in tracks])) or 1.0
        self.amplitude = float(np.median([np.ptp(t.displacement) / 2 for t in tracks])) or 1.0
        self._velocity = float(np.median([np.max(np.abs(t.velocity)) for t in tracks])) or 1.0
        self._acceleration = float(np.median([np.max(np.abs(t.acceleration)) for t in tracks])) or 1.0
        self.nodes = _nodes(tracks)
        self._root = _outer(_root_covariance(self.nodes), np.eye(_ELEMENTS))

    def with_misfit(self, misfit: float) -> Evidence:
        """The same scales with another model error."""
        other = copy(self)
        other.misfit = misfit
        other.__dict__.pop("prior", None)
        return other

    def moments(self, tracks: Sequence[Track], elements: Sequence[Floats] | None = None) -> list[Moments]:
        """Weighted products of the rows of runs, from the elements there."""
        tables = self.elements(tracks) if elements is None else elements
        return [self.moments_of(t, columns) for t, columns in zip(tracks, tables, strict=True)]

    def posterior(self, members: Iterable[Moments], but: Moments | None = None) -> Posterior:
        """Coefficients determined by runs, or by all of them but one."""
        gram, moment = self.total(members)
        return self.posterior_of(gram, moment, but)

    def posterior_of(self, gram: Floats, moment: Floats, but: Moments | None = None) -> Posterior:
        """Coefficients determined by the total of runs, less one of them."""
        if but is not None:
            gram, moment = gram.copy(), moment.copy()
            self._add(gram, moment, but, -1.0)
        factor = np.linalg.cholesky(self._root.T @ gram @ self._root + np.eye(len(moment)))
        root = solve_triangular(factor, self._root.T, lower=True).T
        return Posterior(root @ (root.T @ moment), root, self)

    def log_evidence(self, members: Sequence[Moments]) -> float:
        """Logarithm of the evidence that runs follow one model."""
        gram, moment = self.total(members)
        factor = np.linalg.cholesky(self._root.T @ gram @ self._root + np.eye(len(moment)))
        half = solve_triangular(factor, self._root.T @ moment, lower=True)
        power = sum(member.power for member in members)
        return float(0.5 * (half @ half) - np.sum(np.log(np.diag(factor))) - 0.5 * power)

    @cached_property
    def prior(self) -> Posterior:
        """Coefficients before any run."""
        return Posterior(np.zeros(len(self._root)), self._root, self)

    def elements(self, tracks: Sequence[Track]) -> list[Floats]:
        """(R, E) elements of the damper at the rows of each run, before their dependence on the current."""
        yields = np.array(_YIELDS) * self.amplitude
        stops = stop_operators([t.displacement for t in tracks], yields)
        found = []
        for track, stop in zip(tracks, stops, strict=True):
            rows = track.rows
            x, v = track.displacement[rows] / self.amplitude, track.velocity[rows] / self._velocity
            friction = [np.tanh(v / scale) for scale in _VELOCITIES]
            linear = [np.ones(rows.size), x, x * x, v, track.acceleration[rows] / self._acceleration]
            found.append(np.column_stack([*linear, *friction, stop[rows] / yields]))
        return found

    def over_current(self, track: Track) -> Floats:
        """(R, K) shares of the nodes at the currents of the rows; (1, K) of a constant current."""
        return self.shares(track.current[track.rows] if track.current_changes else track.current[:1])

    def shares(self, current: Floats) -> Floats:
        """(N, K) shares of the nodes at currents [A]."""
        return np.column_stack([np.interp(current, self.nodes, hat) for hat in np.eye(self.nodes.size)])

    def moments_of(self, track: Track, columns: Floats) -> Moments:
        """Weighted products of the rows of a run, from the elements there."""
        force = track.force[track.rows] / self.force
        size = track.half_range / self.force
        noise = (
            self.misfit * np.sqrt((_MISFIT * size) ** 2 + _FLOOR**2 * min(1.0, size)) * np.sqrt(force.size / _SAMPLES)
        )
        swing = (force - np.mean(force)) * (_GAIN / noise)
        shared = np.column_stack([swing, np.full(force.size, _OFFSET * np.sqrt(max(size, 0.1)) / noise)])
        over = self.over_current(track)
        inner = np.linalg.inv(np.eye(2) + shared.T @ shared)
        y = force / noise
        constant = len(over) == 1
        table = (columns if constant else _full(columns, over)) / noise
        along = shared.T @ table
        gram = table.T @ table - along.T @ inner @ along
        moment = table.T @ y - along.T @ inner @ (shared.T @ y)
        power = float(y @ y - (shared.T @ y) @ inner @ (shared.T @ y)) - float(np.linalg.slogdet(inner)[1])
        power += 2 * _SAMPLES * float(np.log(noise / size))
        return Moments(gram, moment, power, over[0] if constant else None)

    def total(self, members: Iterable[Moments]) -> tuple[Floats, Floats]:
        """(P, P) and (P,) sums over runs."""
        size = len(self._root)
        gram, moment = np.zeros((size, size)), np.zeros(size)
        for member in members:
            self._add(gram, moment, member, 1.0)
        return gram, moment

    @staticmethod
    def _add(gram: Floats, moment: Floats, member: Moments, sign: float) -> None:
        if member.over is None:
            gram += sign * member.gram
            moment += sign * member.moment
            return
        size = member.moment.size
        at = np.flatnonzero(member.over)
        for i in at:
            moment[i * size : (i + 1) * size] += sign * member.over[i] * member.moment
            for j in at:
                share = sign * member.over[i] * member.over[j]
                gram[i * size : (i + 1) * size, j * size : (j + 1) * size] += share * member.gram


def _outer(a: Floats, b: Floats) -> Floats:
    """Kronecker product of two matrices."""
    return np.einsum("ij,kl->ikjl", a, b).reshape(len(a) * len(b), -1)


def stop_operators(displacements: Sequence[Floats], yields: Floats) -> list[Floats]:
    """(L, Y) outputs [m] of elastic-plastic elements of several yield displacements [m], run by run."""
    longest = max(x.size for x in displacements)
    steps = np.zeros((longest, len(displacements), 1))
    for i, x in enumerate(displacements):
        steps[: x.size, i, 0] = np.diff(x, prepend=x[:1])
    state = np.zeros((len(displacements), yields.size))
    found = np.empty((longest, *state.shape))
    for step, row in zip(steps, found, strict=True):
        np.add(state, step, out=state)
        np.minimum(state, yields, out=state)
        np.maximum(state, -yields, out=row)
        state[:] = row
    return [found[: x.size, i] for i, x in enumerate(displacements)]


def _full(columns: Floats, over: Floats) -> Floats:
    return (over[:, :, None] * columns[:, None, :]).reshape(len(columns), -1)


def _nodes(tracks: Sequence[Track]) -> Floats:
    """Currents at which coefficients are estimated [A]: the tested levels, or some of many."""
    constant = [float(t.current[0]) for t in tracks if not t.current_changes]
    levels = set(current_levels(constant)) if constant else set()
    for track in tracks:
        if track.current_changes:
            levels |= set(np.percentile(track.current, (0, 50, 100)).tolist())
    values = np.array(sorted(levels))
    if values.size > _MOST_NODES:
        values = np.unique(np.quantile(values, np.linspace(0, 1, _MOST_NODES)))
    return values


def _root_covariance(nodes: Floats) -> Floats:
    """(K, K) root of the covariance of a coefficient at the nodes."""
    share = nodes / (nodes.max() or 1.0)
    near = np.exp(-0.5 * ((share[:, None] - share) / _LENGTH) ** 2)
    covariance = _COMMON**2 + _SLOPE**2 * share[:, None] * share + _BEND**2 * near
    return np.asarray(np.linalg.cholesky(covariance + 1e-6 * np.eye(nodes.size)), dtype=float)
