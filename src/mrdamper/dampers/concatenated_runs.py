"""Runs concatenated into one motion: their residuals in a global fit, and the linearisation of these.

The effect of one run on the state decays during the next, and one long array is evaluated faster than many short ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.coil import Coil
from mrdamper.dampers.run_rows import RunRows
from mrdamper.dampers.search_space import FALL, RISE, SearchSpace
from mrdamper.data import Floats
from mrdamper.identification.columns import bounds_of, linear_table
from mrdamper.models.base import Model
from mrdamper.models.recorded import force_tangents
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.statistics.levenberg_marquardt import forward_differences, least_squares
from mrdamper.statistics.linear import products_of, products_without, project_out, robust_weights, solve_bounded

MIN_ERROR_PP = 1e-3  # nrmse_pp below which a run gains no more weight
_REFIT_ROUNDS = 3  # rounds of weights on derivatives that are known
_DIFFERENCE_RATIO = 1e-3  # of the box, over which the last slopes are taken


@dataclass(frozen=True, eq=False)
class LinearSolution:
    """Linear parameters solved for at a point."""

    model: Model
    residual: Floats  # (N,) weighted
    nrmse_pp: Floats  # (R,) of each run
    held: tuple[str, ...]  # linear parameters at a bound
    columns: Floats  # (N, K) weighted, of the others
    gram: Floats  # (K, K) products of these


class JointResiduals:
    """Residuals of concatenated runs, with the weight of each run."""

    def __init__(self, space: SearchSpace, parts: Sequence[RunRows]):
        self.space, self.parts = space, parts
        begins = np.cumsum([0, *(len(part.motion) for part in parts)])[:-1]
        measured = concatenate(part.motion for part in parts)
        measured.path  # noqa: B018  cut into strokes once, for every current that is laid along
        self._lagged: tuple[Coil | None, Excitation] = None, measured.with_current(np.abs(measured.current))
        self.picked = np.concatenate([part.picked + at for part, at in zip(parts, begins, strict=True)])
        self.target = np.concatenate([part.target for part in parts])
        self.owner = np.repeat(np.arange(len(parts)), [part.target.size for part in parts])
        # Multiplies residuals so that their squares sum to each run's nrmse_pp².
        self.share = np.concatenate([part.share for part in parts])
        self.unit = np.sqrt(self.share) / np.repeat([part.scale for part in parts], [p.target.size for p in parts])
        self.information = np.sqrt([part.information for part in parts])
        self.bounds = bounds_of(space.linear)
        self._set_weights(self.information)
        self._seen: tuple[Excitation, Excitation] | None = None
        self._columns_at: tuple[Floats, Model, Floats, Sequence[int]] | None = None

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
            point, reduced, forces, places = self._columns_at
            table._columns_at = point, reduced, forces[:, kept], places
        return table

    def _motion(self, point: Floats) -> Excitation:
        """Return all runs as one motion with the current of the field at a point; cached for the last coil."""
        coil = self.space.coil_at(point)
        if self._lagged[0] != coil:
            current = np.concatenate(
                [
                    coil.along(part.motion.time, part.motion.current)
                    if coil is not None and part.changes
                    else np.abs(part.motion.current)
                    for part in self.parts
                ]
            )
            self._lagged = coil, self._lagged[1].with_current(current)
        return self._lagged[1]

    def weigh(self, errors: Floats) -> None:
        """Robust weights: the sum of the errors counts, not of their squares; long records by their information."""
        self._set_weights(self.information * robust_weights(errors, MIN_ERROR_PP))

    def _set_weights(self, weights: Floats) -> None:
        self.weights, self.begins = weights, np.searchsorted(self.owner, np.arange(weights.size))
        self.factor = weights[self.owner] * self.unit  # (N,) what residuals [N] are multiplied by
        self._solved: tuple[Floats, LinearSolution] | None = None

    def _followed(self, model: Model, point: Floats) -> tuple[Excitation, Floats]:
        """Motion and state of a model at the samples."""
        motion = self._motion(point)
        if self._seen is None or self._seen[0] is not motion:
            self._seen = motion, motion.part(self.picked)
        return self._seen[1], model.state(motion)[self.picked]

    def linear_forces(self, point: Floats) -> tuple[Model, Floats, Sequence[int]]:
        """Model at a point without its linear parameters, and forces [N]: its own, and that per unit of parameters.

        Returns the places of the linear parameters among these forces, too. Cached for the last point, independent of
        weights.
        """
        if self._columns_at is None or not np.array_equal(self._columns_at[0], point):
            reduced = self.space.without_linear(point)
            self._columns_at = point, reduced, *self._linear_table(reduced, point)
        return self._columns_at[1:]

    def _linear_table(self, reduced: Model, point: Floats) -> tuple[Floats, Sequence[int]]:
        """Return forces of `linear_forces`, in one pass if possible, and the places."""
        motion, linear = self._motion(point), self.space.linear
        names = [info.name for info in type(reduced).parameters() if info.linear]  # one program for all problems
        rows = force_tangents(reduced, motion, names, self.picked)
        if rows is None:
            base, columns = linear_table(reduced, linear, *self._followed(reduced, point))
            return np.vstack([base, columns.T]), range(1, 1 + len(linear))
        return rows, [1 + names.index(info.name) for info in linear]

    def solve(self, point: Floats) -> LinearSolution:
        """Linear parameters of least weighted squares at a point of the search axes; cached for the last point."""
        if self._solved is not None and np.array_equal(self._solved[0], point):
            return self._solved[1]
        linear, factor = self.space.linear, self.factor
        reduced, forces, places = self.linear_forces(point)
        rows = np.empty((len(places) + 1, factor.size))
        for row, place in zip(rows, places, strict=False):
            np.multiply(forces[place], factor, out=row)
        right = np.multiply(self.target - forces[0], factor, out=rows[-1])
        columns, products = rows[:-1].T, products_of(rows[:-1], rows)
        solution, held = solve_bounded(columns, right, *self.bounds, products)
        residual = columns @ solution - right
        errors = np.sqrt(np.add.reduceat(residual**2, self.begins)) / self.weights
        model = replace(reduced, **{i.name: float(s) for i, s in zip(linear, solution, strict=True)})
        stopped = tuple(i.name for i, h in zip(linear, held, strict=True) if h)
        gram = products[:, :-1]
        if stopped:
            columns, gram = columns[:, ~held], gram[~held][:, ~held]
        self._solved = point, LinearSolution(model, residual, errors, stopped, columns, gram)
        return self._solved[1]

    def solved_residual(self, point: Floats) -> Floats:
        """(N,) weighted residual at a point of the search axes, the linear parameters solved for."""
        return self.solve(point).residual

    def products(self, point: Floats) -> tuple[Floats, Floats]:
        """Jᵀr and JᵀJ of the residual r and its derivatives J at a point, with the linear parameters refitted.

        These follow to first order: the gradient is exact, and an axis costs one force instead of a least-squares
        problem [Kaufman 1975, BIT 15, 49].
        """
        solved = self.solve(point)
        moved, slopes = self._moved(point, solved.model, solved.residual)
        products = products_without(solved.columns, slopes, solved.gram)
        return moved @ (slopes @ solved.residual), moved @ products @ moved.T

    def gradient(self, point: Floats, count: int | None = None) -> Floats:
        """(D,) half the slope of the cost along all axes or the first, with the linear parameters refitted.

        Each derivative is a difference across a thousandth of the box, because the residual has a kink where a sample
        reaches the end of the play, at which a derivative would jump.
        """
        solved, weights = self.solve(point), self.weights[self.owner]
        lower, upper = self.space.box()
        reach = np.minimum(_DIFFERENCE_RATIO * (upper - lower), np.minimum(point - lower, upper - point))
        slope = np.zeros(point.size)[:count]
        for i in np.flatnonzero(reach[:count]):
            step = np.where(np.arange(point.size) == i, reach, 0.0)
            rise = self.residual(point + step, solved.model) - self.residual(point - step, solved.model)
            slope[i] = (rise * weights) @ solved.residual / (2 * reach[i])
        return slope

    def _moved(self, point: Floats, model: Model, residual: Floats) -> tuple[Floats, Floats]:
        """(D, K) and (K, N): derivatives of parameters by search axes, of the weighted residual by these parameters.

        The linear parameters are held. Exact in one pass where the model gives tangents, else by forward differences
        along the axes.
        """
        motion = self._motion(point)
        if (exact := force_slopes(self.space, point, model, motion, self.picked)) is not None:
            return exact[0], np.multiply(exact[1], self.factor, out=exact[1])
        weights, box = self.weights[self.owner], self.space.box()
        slopes = forward_differences(lambda u: self.residual(u, model) * weights, point, residual, *box)
        return np.eye(point.size), slopes.T

    def residual(self, point: Floats, model: Model) -> Floats:
        """(N,) of the linear parameters of a model at a point; its squares sum to each run's nrmse_pp²."""
        moved = self.space.with_linear_of(model, point)
        motion = self._motion(point)
        values = force_tangents(moved, motion, (), self.picked)
        force = moved.force(*self._followed(moved, point)) if values is None else values[0]
        return (force - self.target) * self.unit

    def linearise(self, point: Floats, model: Model) -> tuple[Floats, Floats]:
        """Weighted residual of a model, and its derivatives by search axes and linear parameters."""
        residual = self.residual(point, model) * self.weights[self.owner]
        _, forces, places = self.linear_forces(point)
        columns = forces[places].T * self.factor[:, None]
        moved, slopes = self._moved(point, model, residual)
        return residual, np.column_stack([(moved @ slopes).T, columns])


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
            left = project_out(weighted[:, own.stop :], weighted[:, : own.stop])
            start, slopes = left[:, 0], left[:, own]
            solution = least_squares(
                lambda u, r=start, J=slopes: r + J @ (u - self.point), point, *box, slopes=lambda _, J=slopes: J
            )
            point = solution.point
            errors = np.sqrt(np.bincount(owner, solution.residual**2)) / weights
            weights = self.table.information[list(runs)] * robust_weights(errors, MIN_ERROR_PP)
        return errors, point


def force_slopes(
    space: SearchSpace, point: Floats, model: Model, motion: Excitation, picked: NDArray[np.intp]
) -> tuple[Floats, Floats] | None:
    """Calculate derivatives of the force at some samples of a motion, the linear parameters held.

    (D, K) of K parameters by the search axes, and (K, N) of the force by these. At a bound they are one-sided, because
    the force of a model may have a kink there. None where the coil's lags are searched, or where the model has no
    tangents.
    """
    if any(axis.name in (RISE, FALL) for axis in space.axes):
        return None
    # One program for all problems of a model: the tangents of held parameters are not used.
    names = [info.name for info in space.model_type.parameters() if not info.linear]
    inside = space.inside(point)
    moved = replace(model, **{name: getattr(inside, name) for name in names})
    tangents = force_tangents(moved, motion, names, picked)
    if tangents is None:
        return None
    by_axes = space.along_axes(point, names)
    used = by_axes.any(axis=0)
    return by_axes[:, used], tangents[1:][used]


def concatenate(motions: Iterable[Excitation]) -> Excitation:
    """Concatenate motions, a second apart."""
    parts = list(motions)
    time, clock = list[Floats](), 0.0
    for part in parts:
        time.append(part.time - part.time[0] + clock)
        clock = float(time[-1][-1]) + 1.0
    names = ("displacement", "velocity", "acceleration", "current")
    return Excitation(np.concatenate(time), *(np.concatenate([getattr(p, n) for p in parts]) for n in names))
