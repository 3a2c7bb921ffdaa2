"""Runs concatenated into one motion: samples that are simulated, samples of the least squares, residuals.

The effect of one run on the state decays during the next, and one long array is evaluated faster than many short ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.coil import Coil
from mrdamper.dampers.envelope import Envelope
from mrdamper.data import Condition, Floats, Run, index_at
from mrdamper.errors import RunError
from mrdamper.identification.columns import bounds_of, linear_table
from mrdamper.models.base import Model
from mrdamper.models.recorded import force_tangents
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.sines import centred_motion, equivalent_sine, extreme_strokes
from mrdamper.statistics.levenberg_marquardt import forward_differences, least_squares
from mrdamper.statistics.linear import robust_weights, solve_bounded

if TYPE_CHECKING:
    from mrdamper.dampers.protocols import SearchSpace

_ROWS = 400  # samples of a steady run that enter the least squares, about
# Samples of a cycle that are simulated: at a reversal, between reversals, at rest.
_SAMPLES_TURNING, _SAMPLES_RUNNING, _SAMPLES_RESTING = 400, 60, 15
_TURNING_VELOCITY_RATIO = 0.4  # of the peak velocity, below which a motion is near a reversal
_REST_CYCLES = 0.05  # cycles of rest around a sample without a reversal
_CURRENT_TOLERANCE = 1e-3  # of the largest current; where it changes by more, every sample is evaluated
_TRANSIENT_WEIGHT = 0.1  # weight of what lies outside a steady window, ramps and rests, against what lies inside
_CYCLES = 4  # of a sine that enter: more repeat the same
_WARM_UP = 1.5  # cycles before the scored samples in which the effect of the start decays
_MIN_ERROR_PP = 1e-3  # nrmse_pp below which a run gains no more weight
_REST_VELOCITY_RATIO = 0.01  # share of the peak velocity below which a damper rests
_REFIT_ROUNDS = 3  # rounds of weights on derivatives that are known
_DIFFERENCE_RATIO = 1e-3  # of the box, over which the last slopes are taken
_RIDGE = 1e-11  # regularises nearly equal columns


@dataclass(frozen=True, eq=False)
class RunRows:
    """Samples of a run that are simulated, those of the least squares, and their weights by the time they represent.

    The middle cycles of a steady sine are omitted, because they repeat the last ones. Samples before the first motion
    by the amplitude are omitted, because the state of the damper is unknown there.
    """

    motion: Excitation
    picked: NDArray[np.intp]
    target: Floats
    share: Floats
    condition: Condition
    scale: float
    information: float
    changes: bool
    is_sine: bool
    lowest: float
    highest: float
    steady: tuple[int, int]

    @classmethod
    def of(cls, run: Run) -> RunRows:
        sine = equivalent_sine(run)
        motion = centred_motion(run)
        window = np.flatnonzero(run.in_window)
        first, last = int(window[0]), int(window[-1])
        scale = float(np.ptp(run.force[first : last + 1]))
        if scale == 0:
            raise RunError("the force does not change", where=f"run {run.id}", remedy="leave the run out")
        period, time = 1 / sine.condition.frequency_Hz, run.time
        information = 1.0
        followed = _carrying(motion, sine.condition)
        steady = first
        if sine.is_sine:
            steady = max(first, index_at(time, time[last] - _CYCLES * period))
            followed &= (time <= time[first] + period) | (time >= time[steady] - _WARM_UP * period)
        else:
            information = max(1.0, np.sqrt((time[last] - time[first]) / period))
        at = np.flatnonzero(followed)
        x = motion.displacement
        moved = np.maximum.accumulate(x) - np.minimum.accumulate(x)  # not the travel, which increases at rest by noise
        unknown = min(index_at(moved, sine.condition.amplitude_m), max(first, len(motion) // 4))
        rows = at[(at >= unknown) & (at < len(motion) - 1)]  # the last sample has the velocity toward the next run
        before, inside, after = rows[rows < first], rows[(rows >= steady) & (rows <= last)], rows[rows > last]
        inside = inside[:: max(1, int(inside.size / (_ROWS * information)))]
        every = max(1, (before.size + after.size) // _ROWS)
        before, after = before[::every], after[::every]
        picked = np.concatenate([before, inside, after])
        transient = _TRANSIENT_WEIGHT if before.size + after.size else 0.0
        lasting = [_lasting(time[part]) for part in (before, inside, after)]
        outside = float(lasting[0].sum() + lasting[2].sum())
        sizes = (transient / max(outside, 1e-300), 1 / lasting[1].sum(), transient / max(outside, 1e-300))
        share = np.concatenate([size * part for size, part in zip(sizes, lasting, strict=True)]) / (1 + transient)
        return cls(
            motion.part(at),
            np.searchsorted(at, picked),
            run.force[picked],
            share,
            sine.condition,
            scale,
            information,
            run.current_changes,
            sine.is_sine,
            float(np.min(run.displacement)),
            float(np.max(run.displacement)),
            (index_at(at, inside[0]), index_at(at, inside[-1])),
        )

    @property
    def sine(self) -> Condition | None:
        """Condition of a sine at one current; None of any other record."""
        return self.condition if self.is_sine and not self.changes else None

    def steady_end(self) -> RunRows:
        """Return the last cycles of the steady part, of other records the last third: enough to compare starts."""
        kept = np.flatnonzero((self.picked >= self.steady[0]) & (self.picked <= self.steady[1]))
        kept = kept[-_ROWS if self.is_sine else -max(_ROWS, kept.size // 3) :]
        begin, end = int(self.picked[kept[0]]), int(self.picked[kept[-1]]) + 1
        begin = max(0, int(begin - 0.4 * (end - begin)))  # for the decay of the start
        return replace(
            self,
            motion=self.motion.part(slice(begin, end)),
            picked=self.picked[kept] - begin,
            target=self.target[kept],
            share=self.share[kept] / self.share[kept].sum(),
            steady=(int(self.picked[kept[0]]) - begin, end - 1 - begin),
        )


def envelope_of(parts: Sequence[RunRows]) -> Envelope:
    """Return the ranges of the sines at one current, and every sample and the extreme strokes of the others."""
    others = [part for part in parts if part.sine is None]
    strokes = [stroke for part in others if not part.is_sine for stroke in extreme_strokes(part.motion)]
    envelope = Envelope.of([*(part.condition for part in parts), *strokes])
    extent = np.array([[part.lowest, part.highest] for part in others])
    for part in others:
        envelope = envelope.with_motion(part.motion.current, extent, part.motion.velocity)
    return envelope


def _carrying(motion: Excitation, condition: Condition) -> NDArray[np.bool_]:
    """Return the samples that represent a motion: many near reversals, few elsewhere and at rest.

    The force of a damper changes within a short distance after a reversal and slowly between reversals.
    """
    size, duration = len(motion), float(motion.time[-1] - motion.time[0])
    cycle = (size - 1) / (duration * condition.frequency_Hz)  # samples
    dense = max(1, int(cycle / _SAMPLES_TURNING))
    sparse = dense * max(1, round(cycle / _SAMPLES_RUNNING / dense))
    speed = np.abs(motion.velocity) / condition.peak_velocity
    reach = max(1, int(_REST_CYCLES * cycle))
    moving = np.cumsum(np.concatenate([np.zeros(reach + 1), speed > _REST_VELOCITY_RATIO, np.zeros(reach)]))
    resting = moving[2 * reach + 1 :] == moving[: -2 * reach - 1]
    place = np.arange(size)
    every = np.where(
        resting,
        sparse * round(_SAMPLES_RUNNING / _SAMPLES_RESTING),
        np.where(speed < _TURNING_VELOCITY_RATIO, dense, sparse),
    )
    kept = place % every == 0
    current = np.abs(np.diff(motion.current)) > _CURRENT_TOLERANCE * float(np.max(np.abs(motion.current)))
    kept[:-1] |= current
    kept[1:] |= current
    return kept


def _lasting(time: Floats) -> Floats:
    """(N,) time that each sample represents: half the distance to its neighbours on both sides [s]."""
    if time.size < 2:
        return np.ones(time.size)
    steps = np.diff(time)
    return (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]])) / 2


@dataclass(frozen=True, eq=False)
class LinearSolution:
    """Linear parameters solved for at a point."""

    model: Model
    residual: Floats  # (N,) weighted
    nrmse_pp: Floats  # (R,) of each run
    held: tuple[str, ...]  # linear parameters at a bound
    columns: Floats  # (N, K) weighted, of the others


class ConcatenatedRuns:
    """Motions of some runs, concatenated into one motion."""

    def __init__(self, parts: Sequence[RunRows]):
        self.parts = parts
        self.begins = np.cumsum([0, *(len(part.motion) for part in parts)])[:-1]
        self.measured = concatenate(part.motion for part in parts)
        self.measured.path  # noqa: B018  cut into strokes once, for every current that is laid along
        self._lagged_motion: tuple[Coil | None, Excitation] = (
            None,
            self.measured.with_current(np.abs(self.measured.current)),
        )

    def with_field_current(self, coil: Coil | None) -> Excitation:
        """Return the motion with the current of the field; cached for one coil."""
        if self._lagged_motion[0] != coil:
            current = np.abs(self.measured.current)
            for part, begin in zip(self.parts, self.begins, strict=True):
                if coil is not None and part.changes:
                    current[begin : begin + len(part.motion)] = coil.along(part.motion.time, part.motion.current)
            self._lagged_motion = coil, self.measured.with_current(current)
        return self._lagged_motion[1]


class JointResiduals:
    """Residuals of concatenated runs, with the weight of each run."""

    def __init__(self, problem: SearchSpace, parts: Sequence[RunRows]):
        self.problem, self.concatenated = problem, ConcatenatedRuns(parts)
        begins = self.concatenated.begins
        self.picked = np.concatenate([part.picked + at for part, at in zip(parts, begins, strict=True)])
        self.target = np.concatenate([part.target for part in parts])
        self.owner = np.repeat(np.arange(len(parts)), [part.target.size for part in parts])
        # Multiplies residuals so that their squares sum to each run's nrmse_pp².
        self.share = np.concatenate([part.share for part in parts])
        self.unit = np.sqrt(self.share) / np.repeat([part.scale for part in parts], [p.target.size for p in parts])
        self.information = np.sqrt([part.information for part in parts])
        self.bounds = bounds_of(problem.linear)
        self._set_weights(self.information)
        self._seen: tuple[Excitation, Excitation] | None = None
        self._columns_at: tuple[Floats, Model, Floats, Floats] | None = None

    def only(self, runs: Sequence[int]) -> JointResiduals:
        """Return the samples of some of the runs, in order; the others are evaluated but not used."""
        kept, table = np.isin(self.owner, runs), copy(self)
        for name in ("picked", "target", "share", "unit"):
            setattr(table, name, getattr(self, name)[kept])
        table.owner = np.searchsorted(runs, self.owner[kept])
        table.information = self.information[list(runs)]
        table._seen = None
        table._set_weights(table.information)
        if self._columns_at is not None:
            point, reduced, base, columns = self._columns_at
            table._columns_at = point, reduced, base[kept], columns[kept]
        return table

    def weigh(self, errors: Floats) -> None:
        """Robust weights: the sum of the errors counts, not of their squares; long records by their information."""
        self._set_weights(self.information * robust_weights(errors, _MIN_ERROR_PP))

    def _set_weights(self, weights: Floats) -> None:
        self.weights = weights
        self.factor = weights[self.owner] * self.unit  # (N,) what residuals [N] are multiplied by
        self._solved: tuple[Floats, LinearSolution] | None = None

    def _followed(self, model: Model, point: Floats) -> tuple[Excitation, Floats]:
        """Motion and state of a model at the samples."""
        motion = self.concatenated.with_field_current(self.problem.coil_at(point))
        if self._seen is None or self._seen[0] is not motion:
            self._seen = motion, motion.part(self.picked)
        return self._seen[1], model.state(motion)[self.picked]

    def linear_columns(self, point: Floats) -> tuple[Model, Floats, Floats]:
        """Model at a point without its linear parameters, its force [N], and the force per unit of each.

        Cached for the last point, independent of weights.
        """
        if self._columns_at is None or not np.array_equal(self._columns_at[0], point):
            reduced = self.problem.without_linear(point)
            self._columns_at = point, reduced, *self._linear_table(reduced, point)
        return self._columns_at[1:]

    def _linear_table(self, reduced: Model, point: Floats) -> tuple[Floats, Floats]:
        """Force of a model without linear parameters, and the force per unit of each, in one pass if possible."""
        motion, linear = self.concatenated.with_field_current(self.problem.coil_at(point)), self.problem.linear
        names = [info.name for info in type(reduced).parameters() if info.linear]  # one program for all problems
        rows = force_tangents(reduced, motion, names, self.picked)
        if rows is None:
            return linear_table(reduced, linear, *self._followed(reduced, point))
        return rows[0], rows[[1 + names.index(info.name) for info in linear]].T

    def solve(self, point: Floats) -> LinearSolution:
        """Linear parameters of least weighted squares at a point of the search axes; cached for the last point."""
        if self._solved is not None and np.array_equal(self._solved[0], point):
            return self._solved[1]
        linear, factor = self.problem.linear, self.factor
        reduced, base, columns = self.linear_columns(point)
        columns, right = columns * factor[:, None], (self.target - base) * factor
        solution, held = solve_bounded(columns, right, *self.bounds)
        residual = columns @ solution - right
        begins = np.searchsorted(self.owner, np.arange(self.weights.size))
        errors = np.sqrt(np.add.reduceat(residual**2, begins)) / self.weights
        model = replace(reduced, **{i.name: float(s) for i, s in zip(linear, solution, strict=True)})
        stopped = tuple(i.name for i, h in zip(linear, held, strict=True) if h)
        free = columns[:, ~held] if stopped else columns
        self._solved = point, LinearSolution(model, residual, errors, stopped, free)
        return self._solved[1]

    def solved_residual(self, point: Floats) -> Floats:
        """(N,) weighted residual at a point of the search axes, the linear parameters solved for."""
        return self.solve(point).residual

    def slopes(self, point: Floats) -> Floats:
        """(N, D) derivatives of the residual at a point, with the linear parameters refitted.

        These follow to first order: the gradient is exact, and an axis costs one force instead of a least-squares
        problem [Kaufman 1975, BIT 15, 49].
        """
        solved = self.solve(point)
        return project_out(self._moved(point, solved.model, solved.residual), solved.columns)

    def gradient(self, point: Floats) -> Floats:
        """(D,) half the slope of the cost, with the linear parameters refitted.

        Each derivative is a difference across a thousandth of the box, because the residual has a kink where a sample
        reaches the end of the play, at which a derivative would jump.
        """
        solved, weights = self.solve(point), self.weights[self.owner]
        lower, upper = self.problem.box()
        reach = np.minimum(_DIFFERENCE_RATIO * (upper - lower), np.minimum(point - lower, upper - point))
        slope = np.zeros(point.size)
        for i in np.flatnonzero(reach):
            step = np.where(np.arange(point.size) == i, reach, 0.0)
            rise = self.residual(point + step, solved.model) - self.residual(point - step, solved.model)
            slope[i] = (rise * weights) @ solved.residual / (2 * reach[i])
        return slope

    def _moved(self, point: Floats, model: Model, residual: Floats) -> Floats:
        """(N, D) derivatives of the weighted residual by the search axes, the linear parameters held.

        Exact in one pass where the model gives tangents, else by forward differences.
        """
        motion = self.concatenated.with_field_current(self.problem.coil_at(point))
        if (slopes := self.problem.force_slopes(point, model, motion, self.picked)) is not None:
            return np.multiply(slopes, self.factor[:, None], out=slopes)
        weights = self.weights[self.owner]
        return forward_differences(lambda u: self.residual(u, model) * weights, point, residual, *self.problem.box())

    def residual(self, point: Floats, model: Model) -> Floats:
        """(N,) of the linear parameters of a model at a point; its squares sum to each run's nrmse_pp²."""
        moved = replace(
            self.problem.without_linear(point), **{i.name: getattr(model, i.name) for i in self.problem.linear}
        )
        motion = self.concatenated.with_field_current(self.problem.coil_at(point))
        values = force_tangents(moved, motion, (), self.picked)
        force = moved.force(*self._followed(moved, point)) if values is None else values[0]
        return (force - self.target) * self.unit

    def linearise(self, point: Floats, model: Model) -> tuple[Floats, Floats]:
        """Weighted residual of a model, and its derivatives by search axes and linear parameters."""
        residual = self.residual(point, model) * self.weights[self.owner]
        columns = self.linear_columns(point)[2] * self.factor[:, None]
        return residual, np.column_stack([self._moved(point, model, residual), columns])


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Linearisation of the residuals near a point of the search axes."""

    table: JointResiduals
    point: Floats  # (D,)
    residual: Floats  # (N,) weighted: its squares sum to the cost
    jacobian: Floats  # (N, D + L) by the search axes, then the linear parameters

    @cached_property
    def _triangles(self) -> list[Floats]:
        """Residual and derivatives of each run in as many rows as columns, with equal sums of squares."""
        whole, owner = np.column_stack([self.residual, self.jacobian]), self.table.owner
        return [np.linalg.qr(whole[owner == run], mode="r") / weight for run, weight in enumerate(self.table.weights)]

    def extrapolate_refit(self, runs: Sequence[int], box: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        """Errors of some runs, and the linearised end of a search on these alone, linear parameters refitted."""
        triangles, point, own = [self._triangles[i] for i in runs], self.point, slice(1, 1 + self.point.size)
        owner = np.repeat(np.arange(len(runs)), [len(triangle) for triangle in triangles])
        rows, weights = np.concatenate(triangles), self.table.weights[list(runs)]
        errors = np.zeros(0)
        for _ in range(_REFIT_ROUNDS):
            weighted = rows * weights[owner][:, None]
            left = project_out(weighted[:, : own.stop], weighted[:, own.stop :])
            start, slopes = left[:, 0], left[:, own]
            solution = least_squares(
                lambda u, r=start, J=slopes: r + J @ (u - self.point), point, *box, slopes=lambda _, J=slopes: J
            )
            point = solution.point
            errors = np.sqrt(np.bincount(owner, solution.residual**2)) / weights
            weights = self.table.information[list(runs)] * robust_weights(errors, _MIN_ERROR_PP)
        return errors, point


def project_out(slopes: Floats, columns: Floats) -> Floats:
    """Project slopes (N, D) onto the orthogonal complement of some columns."""
    gram = columns.T @ columns
    scale = np.sqrt(gram.diagonal())
    scale = np.where(scale > 0, scale, 1.0)
    normal = gram / scale / scale[:, None] + _RIDGE * np.eye(scale.size)
    taken = (np.linalg.solve(normal, columns.T @ slopes / scale[:, None]) / scale[:, None]).T @ columns.T
    return np.subtract(slopes, taken.T, out=taken.T)


def concatenate(motions: Iterable[Excitation]) -> Excitation:
    """Concatenate motions, a second apart."""
    parts = list(motions)
    time, clock = list[Floats](), 0.0
    for part in parts:
        time.append(part.time - part.time[0] + clock)
        clock = float(time[-1][-1]) + 1.0
    names = ("displacement", "velocity", "acceleration", "current")
    return Excitation(np.concatenate(time), *(np.concatenate([getattr(p, n) for p in parts]) for n in names))
