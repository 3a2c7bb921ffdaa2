"""Runs reduced to Gram matrices on a grid of one shape coordinate, from which fits need no sample."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import IdentificationError
from mrdamper.identification.problem import Problem
from mrdamper.models import Model, Scale
from mrdamper.physics.hysteresis import Shape
from mrdamper.physics.hysteresis.response import follow_alike
from mrdamper.statistics.functions.selection import fold_groups
from mrdamper.statistics.linear import on_one_blas_thread

GRID_RATIO = 1500 ** (1 / 40)  # from one yield displacement to the next; between them Gram matrices are interpolated
_GRID_ORIGIN_M = 2e-6  # m, a grid point for any data
# yield displacement looked for, in the smallest amplitude; the longest is the largest amplitude
_MIN_LENGTH_RATIO = 5e-4
_MAX_STATES = 2**17  # states held at a time

# Six times the weights of the values at both ends of an interval and of the second derivatives there, for a cubic
# spline and its slope in the interval: a row for each power of the share of the interval
_SPLINE = np.array(
    [[6, 0, 0, 0, -6, 6, -2, -1], [-6, 6, -2, -1, 0, 0, 6, 0], [0, 0, 3, 0, 0, 0, -3, 3], [0, 0, -1, 1, 0, 0, 0, 0]]
)


@dataclass(frozen=True, eq=False)
class Condensed:
    """Runs of one rig, condensed for one model type."""

    model_type: type[Model]
    linear: tuple[str, ...]  # coordinates the force is linear in, in the order of the Gram matrices
    shape: str  # the one shape coordinate
    run_ids: tuple[str, ...]  # length R
    conditions: tuple[Condition, ...]  # length R
    scale: Floats  # (R,) peak-to-peak force [N]
    ladder: Floats  # (K,) values of the shape coordinate, evenly in the logarithm
    # (R, K, L+1, L+1) mean products of the columns and, last, the measured force over its peak-to-peak value, at each
    # value of the ladder
    gram: Floats
    # (R, K, L+1, L+1) their second derivatives along the ladder, counted in rungs, as a cubic spline has them
    bend: Floats
    # of the choice of forms, by these and where the shape starts
    trials: dict[tuple[Any, ...], Any] = field(default_factory=lambda: {}, init=False, repr=False)

    @cached_property
    def folds(self) -> dict[str, list[list[int]]]:
        """Runs that each fold omits in the choice of forms, by kind of fold."""
        return fold_groups(self.conditions)

    def only(self, rows: Sequence[int]) -> Condensed:
        """Return the same for some of the runs."""
        index = list(rows)
        return replace(
            self,
            run_ids=tuple(self.run_ids[i] for i in index),
            conditions=tuple(self.conditions[i] for i in index),
            scale=self.scale[index],
            gram=self.gram[index],
            bend=self.bend[index],
        )

    def at(self, shape_values: Floats) -> tuple[Floats, Floats]:
        """Gram matrices at one shape value a run, and their slopes by its logarithm, on the spline through the ladder.

        Both (R, L+1, L+1).
        """
        logs = np.log(self.ladder)
        u = np.minimum(np.maximum((np.log(shape_values) - logs[0]) / (logs[1] - logs[0]), 0), logs.size - 1)
        first = np.minimum(u.astype(int), logs.size - 2)
        weights = ((u - first)[:, None] ** np.arange(4) @ _SPLINE).reshape(-1, 2, 4) / 6
        both = (weights @ self._cells[np.arange(u.size), first]).reshape(u.size, 2, *self.gram.shape[2:])
        return both[:, 0], both[:, 1] / (logs[1] - logs[0])

    @cached_property
    def _cells(self) -> Floats:
        """(R, K-1, 4, (L+1)²) matrices and derivatives at both ends of every interval of the ladder."""
        both = (values.reshape(*values.shape[:2], -1) for values in (self.gram, self.bend))
        return np.stack([end for values in both for end in (values[:, :-1], values[:, 1:])], axis=2)


@on_one_blas_thread
def condense(runs: Sequence[Run], model_type: type[Model], more: Sequence[str] = ()) -> Condensed:
    """Condense runs for a model type whose search has one axis.

    `more` are preset linear parameters to determine as well: one run may not separate them, all together may. Raises
    `IdentificationError` if the model has no such single axis, or there are no runs.
    """
    if not runs:
        raise IdentificationError("no runs", remedy="give at least one")
    problems = [Problem.of(run, model_type) for run in runs]
    axes = model_type.search_axes(Scale(1.0, 1.0), problems[0].free)
    coordinates = tuple(model_type.map_forms())
    if len(axes) > 1 or not {axis.name for axis in axes} <= set(coordinates):
        raise IdentificationError(
            f"{model_type.title} is searched along {len(axes)} axes", remedy="fix all shape parameters but one"
        )
    shape = axes[0].name if axes else ""
    linear = (*(name for name in coordinates if name != shape), *more)
    conditions = tuple(problem.analysis.condition for problem in problems)
    ladder = _length_grid([c.amplitude_m for c in conditions]) if shape else np.geomspace(1.0, 8.0, 4)
    gram = np.stack([_gram(problem, linear, shape, ladder) for problem in problems])
    return Condensed(
        model_type,
        linear,
        shape,
        tuple(run.id for run in runs),
        conditions,
        np.array([np.ptp(problem.force) for problem in problems]),
        ladder,
        gram,
        _spline_curvature(gram),
    )


def _spline_curvature(gram: Floats) -> Floats:
    """Second derivatives of the cubic spline along the second axis that goes on unbroken over its outer knots."""
    size = gram.shape[1]
    second = np.eye(size, k=-1) - 2 * np.eye(size) + np.eye(size, k=1)
    system, right = second + 6 * np.eye(size), 6 * second
    system[0, :3] = system[-1, -3:] = (1, -2, 1)
    right[[0, -1]] = 0.0
    return np.einsum("jk,rk...->rj...", np.linalg.solve(system, right), gram)


def _length_grid(amplitudes: Sequence[float]) -> Floats:
    """Rungs [m] from far inside the smallest amplitude to the largest."""
    low, high = (
        float(np.log(v / _GRID_ORIGIN_M) / np.log(GRID_RATIO))
        for v in (_MIN_LENGTH_RATIO * min(amplitudes), max(amplitudes))
    )
    return _GRID_ORIGIN_M * GRID_RATIO ** np.arange(math.floor(low), math.ceil(high) + 1.0)


def _gram(problem: Problem, linear: tuple[str, ...], shape: str, ladder: Floats) -> Floats:
    target = problem.force / np.ptp(problem.force)
    if not shape:
        table, _ = _columns(problem, linear, {})
        table = np.column_stack([table, target])
        return np.stack([table.T @ table / target.size] * ladder.size)
    table, reduced = _columns(problem, linear, {shape: float(ladder[0])})
    if reduced.shape is not None and "yield_force" in linear:  # its column is zeta, the only one the ladder changes
        table = np.column_stack([table, target])
        return _gram_of_shapes(problem, table, linear.index("yield_force"), reduced.shape, ladder)
    tables = [np.column_stack([_columns(problem, linear, {shape: float(v)})[0], target]) for v in ladder]
    return np.stack([table.T @ table / target.size for table in tables])


def _columns(problem: Problem, linear: tuple[str, ...], shape: Mapping[str, float]) -> tuple[Floats, Model]:
    """(N, L) force per unit of every linear coordinate, and the model without them."""
    point = {**problem.fixed, **shape, **dict.fromkeys(linear, 0.0)}
    reduced = problem.model_type.build(point)
    state = reduced.state(problem.motion)[problem.scored]
    base = reduced.force(problem.seen, state)
    columns = [problem.model_type.build({**point, name: 1.0}).force(problem.seen, state) - base for name in linear]
    return np.column_stack(columns), reduced


def _gram_of_shapes(problem: Problem, table: Floats, moving: int, shape: Shape, ladder: Floats) -> Floats:
    """Return the same matrices, all shapes followed at once; only the rows of the moving column differ."""
    grams = np.stack([table.T @ table] * ladder.size)
    few = max(1, _MAX_STATES // len(problem.motion))
    for begin in range(0, ladder.size, few):
        part = slice(begin, begin + few)
        zeta = follow_alike(shape.n, float(shape.rho), 1 / ladder[part], problem.motion.path)[:, problem.scored]
        grams[part, moving, :] = grams[part, :, moving] = zeta @ table
        grams[part, moving, moving] = np.einsum("kn,kn->k", zeta, zeta)
    return grams / len(table)
