"""Variable projection: solve the linear parameters, search the shape parameters.

Given the internal state, the force is linear in most parameters. They are eliminated by least squares inside the
search, which leaves one to three well-scaled coordinates: a coarse grid, then Levenberg–Marquardt. Golub and Pereyra
(1973), SIAM J. Numer. Anal. 10; Kaufman (1975), BIT 15, 49–57.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import IdentificationError, ParameterError
from mrdamper.identification.columns import bounds_of, linear_table
from mrdamper.identification.elimination import Elimination
from mrdamper.identification.problem import DELAY, DELAY_LIMIT, Method, Problem, Solution
from mrdamper.models import Model, Scale, SearchAxis
from mrdamper.models.base import box_of, grid_of, names_at_bounds, values_at
from mrdamper.models.recorded import force_tangents
from mrdamper.physics.hysteresis.response import follow_one
from mrdamper.statistics.levenberg_marquardt import Minimum, forward_differences, least_squares
from mrdamper.statistics.linear import FixedColumns, on_one_blas_thread, project_out_columns, solve_bounded
from mrdamper.statistics.scalar_least_squares import least_squares_in_one
from mrdamper.statistics.stop_reason import StopReason

_GRID_SAMPLES = 1500  # the grid only has to find the region of the minimum
_GRID_SAMPLES_A_CYCLE, _GRID_CYCLES = 100, 3  # of a shape
_LONG_RECORD_SAMPLES = 40_000  # samples from which an integrated model is first searched on the last cycles
_MAX_TANGENT_STEPS = 100  # steps of a refinement by exact derivatives, which decreases the cost to its end
_PIECE_CYCLES, _PIECE_SAMPLES_A_CYCLE = 5, 500


@dataclass(frozen=True)
class Projection(Method):
    """Least squares on the force in time, all parameters at once."""

    name: ClassVar[str] = "projection"
    summary: ClassVar[str] = "least squares on the force in time, linear parameters eliminated"

    # number of grid points from which the refinement starts
    refine_best: int = 2  # with more than one coordinate; one alone has one minimum

    @on_one_blas_thread
    def solve(self, problem: Problem) -> Solution:
        """Determine the free parameters of a problem."""
        axes = search_axes(problem)
        if not axes:
            projected = _project(problem, {})
            return Solution(projected.model, 0.0, projected.at_bounds, {}, {}, 1, StopReason.SOLVED)
        elimination = Elimination.of(problem, axes)
        if problem.model_type.integrated and problem.force.size > _LONG_RECORD_SAMPLES:
            piece = self.solve(_last_cycles(problem))
            starts = [np.array([axis.coordinate(piece.end[axis.name]) for axis in axes])]
            evaluated = piece.evaluations
        else:
            starts, evaluated = _best_of_grid(problem, axes, elimination, self.refine_best if len(axes) > 1 else 1)
        minima = [(start, _refined(problem, axes, elimination, start)) for start in starts]
        start, best = min(minima, key=lambda pair: pair[1].cost)
        end = values_at(axes, best.point)
        model, held = (elimination and elimination.solved(end)), ()
        if model is None:
            projected = _project(problem, end)
            model, held = projected.model, projected.at_bounds
        return Solution(
            model=model,
            delay=end.get(DELAY, 0.0),
            at_bounds=(*held, *names_at_bounds(axes, best.point)),
            start=values_at(axes, start),
            end=end,
            evaluations=evaluated + sum(minimum.evaluations for _, minimum in minima),
            ending=best.ending,
        )


@dataclass(frozen=True)
class Projected:
    """Best model at a point of the search, its residual [N], and linear parameters at a bound."""

    model: Model
    residual: Floats
    at_bounds: tuple[str, ...]
    columns: Floats  # (N, L) of the linear parameters that are not at a bound


def _project(problem: Problem, point: Mapping[str, float], thin: int = 1) -> Projected:
    shape = {name: value for name, value in point.items() if name != DELAY}
    motion = problem.motion
    if delay := point.get(DELAY, 0.0):
        motion = motion.delayed(delay)
    linear = [i for i in problem.model_type.parameters() if i.linear and i.name in problem.free]
    bare = problem.model_type.build({**problem.fixed, **shape, **{i.name: 0.0 for i in linear}})
    state = bare.state(motion)[problem.scored][::thin]
    scored = motion.part(problem.scored) if delay else problem.seen
    scored = scored.part(slice(None, None, thin)) if thin > 1 else scored
    base, columns = linear_table(bare, linear, scored, state)
    measured = problem.force[::thin]
    solution, held = solve_bounded(columns, measured - base, *bounds_of(linear))
    names = [i.name for i in linear]
    model = replace(bare, **{name: float(s) for name, s in zip(names, solution, strict=True)})
    at_bounds = tuple(n for n, h in zip(names, held, strict=True) if h)
    return Projected(model, base + columns @ solution - measured, at_bounds, columns[:, ~np.asarray(held, dtype=bool)])


def search_axes(problem: Problem) -> tuple[SearchAxis, ...]:
    """Search coordinates, with start values from the data."""
    scale = Scale.of(problem.seen, problem.force, problem.analysis.condition.amplitude_m)
    axes = problem.model_type.search_axes(scale, problem.free)
    searched = {axis.name for axis in axes}
    if linear := [info.name for info in problem.model_type.parameters() if info.linear and info.name in searched]:
        remedy = "let search_axes return those of nonlinear parameters"
        where = problem.model_type.title
        raise ParameterError(f"search axes of linear parameters: {', '.join(linear)}", where=where, remedy=remedy)
    axes = problem.model_type.within(axes, problem.fixed)
    if problem.with_delay:
        axes = (*axes, SearchAxis(DELAY, -DELAY_LIMIT, DELAY_LIMIT, (0.0,)))
    return axes


def _refined(problem: Problem, axes: tuple[SearchAxis, ...], elimination: Elimination | None, start: Floats) -> Minimum:
    """Minimum next to a start point, the linear parameters eliminated."""
    names = [axis.name for axis in axes]
    lower, upper = box_of(axes)
    shaped = elimination is not None and elimination.kind.has_shape
    if elimination and shaped and len(axes) == 1:
        (axis,), slope = axes, elimination.residual_and_slope
        quick = least_squares_in_one(lambda u: slope(axis.value(u)), float(start[0]), lower[0], upper[0])
        if quick is not None:
            return quick

    if problem.model_type.integrated and DELAY not in names:
        return _refined_by_tangents(problem, axes, start, lower, upper)

    def residual(u: Floats) -> Floats:
        point = values_at(axes, u)
        fit = elimination.residual(point) if elimination else None
        return _project(problem, point).residual if fit is None else fit

    return least_squares(residual, start, lower, upper, curved=shaped)


def _refined_by_tangents(
    problem: Problem, axes: tuple[SearchAxis, ...], start: Floats, lower: Floats, upper: Floats
) -> Minimum:
    """Minimum of an integrated model, by exact derivatives: differences would contain those of its steps."""
    names = tuple(axis.name for axis in axes)
    picked = np.arange(len(problem.motion))[problem.scored]
    latest: dict[bytes, Projected] = {}

    def residual(u: Floats) -> Floats:
        latest.clear()
        latest[u.tobytes()] = _project(problem, values_at(axes, u))
        return latest[u.tobytes()].residual

    def slopes(u: Floats) -> Floats:
        """Return derivatives of the projected residual without those along the columns [Kaufman 1975]."""
        at = latest.get(u.tobytes()) or _project(problem, values_at(axes, u))
        tangents = force_tangents(at.model, problem.motion, names, picked)
        if tangents is None:
            return forward_differences(residual, u, at.residual, lower, upper)
        factors = [getattr(at.model, axis.name) if axis.log else 1.0 for axis in axes]
        return project_out_columns(at.columns, tangents[1:].T * factors)

    return least_squares(residual, start, lower, upper, _MAX_TANGENT_STEPS, slopes=slopes)


def _best_of_grid(
    problem: Problem, axes: tuple[SearchAxis, ...], elimination: Elimination | None, keep: int
) -> tuple[list[Floats], int]:
    grid = grid_of(axes)
    if elimination and elimination.kind.has_shape:
        costs = _costs_of_shapes(elimination, [values_at(axes, u) for u in grid])
    else:
        thin = max(1, problem.force.size // _GRID_SAMPLES)
        costs = np.array([float(np.sum(_project(problem, values_at(axes, u), thin).residual ** 2)) for u in grid])
    if not np.isfinite(costs).any():
        raise IdentificationError(
            "no start point gives a finite force", where=f"run {problem.run.id}", remedy="check the units of the run"
        )
    return [grid[i] for i in np.argsort(costs)[:keep]], len(grid)


def _costs_of_shapes(elimination: Elimination, points: list[dict[str, float]]) -> Floats:
    """Costs of the grid on the last cycles, thinned, without the part that no shape changes."""
    problem, whole = elimination.problem, elimination.fixed_columns
    cycle = (len(problem.motion) - 1) / float(np.ptp(problem.motion.time)) / problem.analysis.condition.frequency_Hz
    thin, size = max(1, int(cycle / _GRID_SAMPLES_A_CYCLE)), min(problem.force.size, math.ceil(_GRID_CYCLES * cycle))
    first = 1 + (size - 1) // thin * thin  # of the samples up to the last
    rows, part = (slice(count - first, None, thin) for count in (problem.force.size, len(problem.motion)))
    fixed = FixedColumns.of(whole.basis[rows], whole.rest[rows])
    costs = np.empty(len(points))
    for i, point in enumerate(points):
        kappa, rho, n = elimination.kind.shape(point) or (math.nan,) * 3
        zeta = follow_one(kappa, rho, n, problem.motion.path, part)
        along, square = zeta @ fixed.basis, float(zeta @ zeta)
        left = max(square - float(along @ along), 1e-12 * square + np.finfo(float).tiny)  # that no column explains
        costs[i] = -(max(float(zeta @ fixed.rest), 0.0) ** 2) / left
    return costs


def _last_cycles(problem: Problem) -> Problem:
    """Reduce the problem to the thinned end of the record: a long one takes a second per force."""
    run, cycle = problem.run, 1.0 / problem.analysis.condition.frequency_Hz
    last = int(np.flatnonzero(run.in_window)[-1]) + 1
    size = max(8, math.ceil(cycle * (run.time.size - 1) / float(np.ptp(run.time))))
    piece = run.part(max(0, last - _PIECE_CYCLES * size), last)
    window = (float(piece.time[0]) + cycle, float(piece.time[-1]))
    return replace(problem, run=piece.thinned(max(1, size // _PIECE_SAMPLES_A_CYCLE), window))
