"""Variable projection: solve the linear parameters, search the few that shape the loop.

Given the internal state, the force is linear in most parameters. They are eliminated by
least squares inside the search, so what is left is one to three well-scaled coordinates:
a coarse grid, then Levenberg–Marquardt. Golub and Pereyra (1973), SIAM J. Numer. Anal. 10.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import IdentificationError
from mrdamper.identification.linear import bounded_linear, bounds_of, linear_table
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
        lower = np.array([axis.coordinate(axis.lower) for axis in axes])
        upper = np.array([axis.coordinate(axis.upper) for axis in axes])

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
    base, columns = linear_table(bare, linear, seen, state)
    measured = problem.force[::thin]
    solution, held = bounded_linear(columns, measured - base, *bounds_of(linear))
    names = [i.name for i in linear]
    model = replace(bare, **{name: float(s) for name, s in zip(names, solution, strict=True)})
    return Projected(
        model, base + columns @ solution - measured, tuple(n for n, h in zip(names, held, strict=True) if h)
    )


def _axes(problem: Problem) -> tuple[SearchAxis, ...]:
    amplitude = problem.analysis.condition.amplitude_m
    axes = problem.model_type.guess(problem.motion.part(problem.scored), problem.force, amplitude, problem.free)
    if problem.with_delay:
        axes = (*axes, SearchAxis(DELAY, -DELAY_LIMIT, DELAY_LIMIT, (0.0,)))
    return axes


def _best_of_grid(problem: Problem, axes: tuple[SearchAxis, ...], keep: int) -> tuple[list[Floats], int]:
    grid = [np.array(u) for u in product(*([axis.coordinate(g) for g in axis.grid] for axis in axes))]
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


def _point(axes: tuple[SearchAxis, ...], u: Floats) -> dict[str, float]:
    return {axis.name: axis.value(float(c)) for axis, c in zip(axes, u, strict=True)}


def _axes_at_bounds(axes: tuple[SearchAxis, ...], minimum: Minimum) -> tuple[str, ...]:
    return tuple(axis.name for axis, u in zip(axes, minimum.point, strict=True) if axis.at_bound(float(u)))
