"""Variable projection: solve the linear parameters, search the few that shape the loop.

Given the internal state, the force is linear in most parameters. They are eliminated by
least squares inside the search, so what is left is one to three well-scaled coordinates:
a coarse grid, then Levenberg–Marquardt. Golub and Pereyra (1973), SIAM J. Numer. Anal. 10.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import IdentificationError
from mrdamper.identification.problem import DELAY, DELAY_LIMIT, Method, Problem, Solution
from mrdamper.models import Model, SearchAxis
from mrdamper.optimizers.levenberg_marquardt import Minimum, least_squares

_GRID_SAMPLES = 1500  # the grid only has to find the valley


@dataclass(frozen=True)
class Projection(Method):
    """Least squares on the force in time, all parameters at once.

    Attributes
    ----------
    refine_best : int
        Number of grid points from which the refinement starts.
    """

    name: ClassVar[str] = "projection"
    summary: ClassVar[str] = "least squares on the force in time, linear parameters eliminated"

    refine_best: int = 2  # where more than one coordinate is searched; one alone has one valley

    def solve(self, problem: Problem) -> Solution:
        """Determine the free parameters of a problem."""
        axes = _axes(problem)
        if not axes:
            projected = _project(problem, {})
            return Solution(projected.model, 0.0, projected.at_bounds, {}, {}, 1, "solved: every parameter is linear")
        starts, evaluated = _best_of_grid(problem, axes, self.refine_best if len(axes) > 1 else 1)
        lower = np.array([_to_search(axis, axis.lower) for axis in axes])
        upper = np.array([_to_search(axis, axis.upper) for axis in axes])

        def residual(u: Floats) -> Floats:
            return _project(problem, _point(axes, u)).residual

        found = [(start, least_squares(residual, start, lower, upper)) for start in starts]
        start, best = min(found, key=lambda pair: pair[1].cost)
        end = _point(axes, best.point)
        projected = _project(problem, end)
        return Solution(
            model=projected.model,
            delay=end.get(DELAY, 0.0),
            at_bounds=(*projected.at_bounds, *_axes_at_bounds(axes, best)),
            start=_point(axes, start),
            end=end,
            evaluations=evaluated + sum(minimum.evaluations for _, minimum in found),
            message=best.message,
        )


@dataclass(frozen=True)
class Projected:
    """Best model at a point of the search, its residual [N], and linear parameters at a bound."""

    model: Model
    residual: Floats
    at_bounds: tuple[str, ...]


def _project(problem: Problem, point: Mapping[str, float], thin: int = 1) -> Projected:
    shape = {name: value for name, value in point.items() if name != DELAY}
    motion = problem.motion
    if delay := point.get(DELAY, 0.0):
        motion = motion.delayed(delay)
    linear = [i for i in problem.model_type.parameters() if i.linear and i.name in problem.free]
    bare = problem.model_type.build({**problem.fixed, **shape, **{i.name: 0.0 for i in linear}})
    state = bare.state(motion)[problem.scored][::thin]
    seen = motion.part(problem.scored).part(slice(None, None, thin))
    measured = problem.force[::thin]
    base = bare.force(seen, state)
    columns = np.column_stack(
        [replace(bare, **{i.name: _probe(i.bounds)}).force(seen, state) - base for i in linear]
    ) / np.array([_probe(i.bounds) for i in linear])
    solution, held = bounded_linear(
        columns, measured - base, np.array([i.bounds[0] for i in linear]), np.array([i.bounds[1] for i in linear])
    )
    names = [i.name for i in linear]
    model = replace(bare, **{name: float(s) for name, s in zip(names, solution, strict=True)})
    return Projected(
        model, base + columns @ solution - measured, tuple(n for n, h in zip(names, held, strict=True) if h)
    )


def _probe(bounds: tuple[float, float]) -> float:
    """Give a value inside the bounds that shows the parameter's column."""
    return 1.0 if bounds[0] <= 1.0 <= bounds[1] else bounds[1]


def bounded_linear(columns: Floats, right: Floats, lower: Floats, upper: Floats) -> tuple[Floats, Floats]:
    """Least squares with bounds on the coefficients, by holding violated ones at their bound.

    Parameters
    ----------
    columns : (N, L) array
    right : (N,) array
    lower, upper : (L,) arrays

    Returns
    -------
    solution : (L,) array
    held : (L,) boolean array
        Coefficients that ended at a bound.
    """
    scale = np.sqrt(np.mean(columns**2, axis=0))
    scale[scale == 0] = 1.0
    held = np.zeros(scale.size, dtype=bool)
    solution = np.zeros(scale.size)
    for _ in range(scale.size + 1):
        free = ~held
        scaled = columns[:, free] / scale[free]
        rest = right - columns[:, held] @ solution[held]
        solution[free] = _least_norm(scaled, rest) / scale[free]
        outside = free & ((solution < lower) | (solution > upper))
        if not outside.any():
            break
        solution = np.clip(solution, lower, upper)
        held |= outside
    return solution, held


def _least_norm(columns: Floats, right: Floats) -> Floats:
    # Normal equations of equilibrated columns: the few columns are far from dependent, and
    # this is several times faster than an orthogonal factorisation of N rows.
    normal = columns.T @ columns
    if normal.size and np.linalg.cond(normal) < 1e10:
        return np.asarray(np.linalg.solve(normal, columns.T @ right), dtype=float)
    return np.asarray(np.linalg.lstsq(columns, right, rcond=None)[0], dtype=float)


def _axes(problem: Problem) -> tuple[SearchAxis, ...]:
    amplitude = problem.analysis.condition.amplitude_m
    axes = problem.model_type.search_axes(amplitude, problem.free)
    if problem.with_delay:
        axes = (*axes, SearchAxis(DELAY, -DELAY_LIMIT, DELAY_LIMIT, (0.0,)))
    return axes


def _best_of_grid(problem: Problem, axes: tuple[SearchAxis, ...], keep: int) -> tuple[list[Floats], int]:
    grid = [np.array(u) for u in product(*([_to_search(axis, g) for g in axis.grid] for axis in axes))]
    thin = max(1, problem.force.size // _GRID_SAMPLES)

    def cost(u: Floats) -> float:
        residual = _project(problem, _point(axes, u), thin).residual
        return float(residual @ residual)

    costs = np.array([cost(u) for u in grid])
    if not np.isfinite(costs).any():
        raise IdentificationError(
            "no start point gives a finite force", where=f"run {problem.run.id}", mend="check the units of the run"
        )
    return [grid[i] for i in np.argsort(costs)[:keep]], len(grid)


def _to_search(axis: SearchAxis, value: float) -> float:
    return float(np.log(value)) if axis.log else value


def _point(axes: tuple[SearchAxis, ...], u: Floats) -> dict[str, float]:
    return {axis.name: float(np.exp(c)) if axis.log else float(c) for axis, c in zip(axes, u, strict=True)}


def _axes_at_bounds(axes: tuple[SearchAxis, ...], minimum: Minimum) -> tuple[str, ...]:
    near: Callable[[float, float, float], bool] = lambda u, low, high: min(u - low, high - u) < 1e-3 * (high - low)  # noqa: E731
    return tuple(
        axis.name
        for axis, u in zip(axes, minimum.point, strict=True)
        if near(u, _to_search(axis, axis.lower), _to_search(axis, axis.upper))
    )
