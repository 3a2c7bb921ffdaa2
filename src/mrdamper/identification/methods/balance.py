"""Consistent harmonic balance, which evaluates the hysteresis over several harmonics.

The same model as the paper's, without its double counting: the exact steady loop of each trial gives the harmonics of
the hysteretic force (alternating frequency and time, with a closed form in place of time stepping), and all harmonics
up to H are matched at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from mrdamper.data import Floats
from mrdamper.errors import IdentificationError
from mrdamper.identification.columns import bounds_of, linear_table
from mrdamper.identification.harmonic_balance import HarmonicProjection, SineRecord
from mrdamper.identification.problem import Method, Problem, Solution
from mrdamper.models import Model, Scale
from mrdamper.models.base import box_of, grid_of, names_at_bounds, values_at
from mrdamper.physics.hysteresis import steady_loop
from mrdamper.statistics.levenberg_marquardt import least_squares
from mrdamper.statistics.linear import solve_bounded
from mrdamper.statistics.stop_reason import StopReason

_MIN_HARMONICS = 3  # one harmonic gives two equations, for at least four unknowns


@dataclass(frozen=True)
class Balance(Method):
    """Match the mean and the harmonics 1...H of the force on the measured sine.

    Raises `IdentificationError` if H is under three.
    """

    name: ClassVar[str] = "balance"
    summary: ClassVar[str] = "harmonic balance over several harmonics on the exact steady loop"

    harmonics: int = 15  # H, three at least. Fifteen contain all but 4e-5 of the power of a saturated loop.

    def __post_init__(self) -> None:
        if self.harmonics < _MIN_HARMONICS:
            raise IdentificationError(
                f"{self.harmonics} harmonics cannot determine viscosity, stiffness and two numbers of a loop",
                remedy=f"use {_MIN_HARMONICS} or more",
            )

    def solve(self, problem: Problem) -> Solution:
        """Determine the free parameters of a problem."""
        if problem.with_delay:
            raise IdentificationError(
                "method balance determines no delay", remedy="leave out the delay, or use method projection"
            )
        record = SineRecord.of(problem.run)
        balanced = _Balanced(problem, record, HarmonicProjection(record.theta, self.harmonics))
        X = record.condition.amplitude_m
        kind = problem.model_type
        axes = kind.within(kind.search_axes(Scale.of(record.motion, record.force, X), problem.free), problem.fixed)
        if not axes:
            model, held = balanced.model({})
            return Solution(model, 0.0, held, {}, {}, 1, StopReason.SOLVED)

        def residual(u: Floats) -> Floats:
            _, columns, right, solution, _ = balanced.at(values_at(axes, u))
            return columns @ solution - right

        grid = grid_of(axes)
        costs = [float(np.sum(residual(u) ** 2)) for u in grid]
        starts: list[Floats] = [grid[i] for i in np.argsort(costs)[: min(len(axes), 2)]]
        minima = [(start, least_squares(residual, start, *box_of(axes))) for start in starts]
        start, best = min(minima, key=lambda pair: pair[1].cost)
        end = values_at(axes, best.point)
        model, held = balanced.model(end)
        return Solution(
            model=model,
            delay=0.0,
            at_bounds=(*held, *names_at_bounds(axes, best.point)),
            start=values_at(axes, start),
            end=end,
            evaluations=len(grid) + sum(minimum.evaluations for _, minimum in minima),
            ending=best.ending,
        )


class _Balanced:
    """Linear parameters of least squared harmonic residual, for given shape coordinates."""

    def __init__(self, problem: Problem, record: SineRecord, project: HarmonicProjection):
        self.problem, self.record, self.project = problem, record, project
        self.motion = record.motion
        self.linear = [i for i in problem.model_type.parameters() if i.linear and i.name in problem.free]
        self.bounds = bounds_of(self.linear)
        self.zero = {i.name: 0.0 for i in self.linear}
        self.measured = project(record.force)
        self._once: tuple[Floats, Floats, Floats] | None = None  # force without linear parameters, and the table

    def model(self, point: Mapping[str, float]) -> tuple[Model, tuple[str, ...]]:
        """Model with the linear parameters solved for, and those held at a bound."""
        bare, _, _, solution, held = self.at(point)
        model = replace(bare, **dict(zip(self.zero, solution.tolist(), strict=True)))
        return model, tuple(n for n, h in zip(self.zero, held, strict=True) if h)

    def at(self, point: Mapping[str, float]) -> tuple[Model, Floats, Floats, Floats, NDArray[np.bool_]]:
        """Model without linear parameters, their columns and the right side (harmonics), the solution, its bounds."""
        bare = self.problem.model_type.build({**self.problem.fixed, **point, **self.zero})
        columns, right = self._table(bare, steady_state(bare, self.record))
        return bare, columns, right, *solve_bounded(columns, right, *self.bounds)

    def _table(self, bare: Model, state: Floats) -> tuple[Floats, Floats]:
        """Harmonics of the linear columns and of the rest; only the column of the state is computed again, if any."""
        infos = [i for i in self.linear if i.name == bare.state_column]
        if self._once is None or not infos:
            base, forces = linear_table(bare, self.linear, self.motion, state)
            self._once = base, self.project(forces), self.measured - self.project(base)
        else:
            column = linear_table(bare, infos, self.motion, state, self._once[0])[1][:, 0]
            twice = np.stack([column, column]).T  # a product of matrices, which has the bits of that of all columns
            self._once[1][:, self.linear.index(infos[0])] = self.project(twice)[:, 0]
        return self._once[1:]


def steady_state(model: Model, record: SineRecord) -> Floats:
    """Calculate the internal state on the closed loop, at the phases of a record.

    Raises `IdentificationError` if the model has a memory whose closed loop is not known exactly.
    """
    if type(model).state is Model.state:
        return np.zeros(record.theta.size)
    shape = model.shape
    if shape is None:
        raise IdentificationError(
            f"no closed loop of the {model.title} model is known",
            remedy="use method projection, which follows any model",
        )
    return float(shape.yield_displacement) * steady_loop(shape, record.condition.amplitude_m, record.theta)
