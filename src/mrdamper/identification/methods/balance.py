"""Harmonic balance that evaluates the hysteresis too: consistent, over several harmonics.

The same model as the paper's, without its double counting: in every trial the exact steady
loop gives the harmonics of the hysteretic force (alternating frequency and time, with a
closed form in place of time stepping), and all harmonics up to H are matched at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import IdentificationError
from mrdamper.harmonic_balance import HarmonicProjection, SineRecord
from mrdamper.hysteresis import steady_loop
from mrdamper.identification.methods.projection import bounded_linear
from mrdamper.identification.problem import Method, Problem, Solution
from mrdamper.models import Model, SearchAxis
from mrdamper.optimizers.levenberg_marquardt import least_squares

_FEWEST = 3  # one harmonic gives two equations, for at least four unknowns


@dataclass(frozen=True)
class Balance(Method):
    """Match the mean and the harmonics 1...H of the force on the measured sine.

    Attributes
    ----------
    harmonics : int
        H, three at least. Fifteen carry all but 4e-5 of the power of a saturated loop.

    Raises
    ------
    IdentificationError
        If H is under three.
    """

    name: ClassVar[str] = "balance"
    summary: ClassVar[str] = "harmonic balance over several harmonics on the exact steady loop"

    harmonics: int = 15

    def __post_init__(self) -> None:
        if self.harmonics < _FEWEST:
            raise IdentificationError(
                f"{self.harmonics} harmonics cannot determine viscosity, stiffness and two numbers of a loop",
                mend=f"use {_FEWEST} or more",
            )

    def solve(self, problem: Problem) -> Solution:
        """Determine the free parameters of a problem."""
        if problem.with_delay:
            raise IdentificationError(
                "method balance determines no delay", mend="leave out the delay, or use method projection"
            )
        record = SineRecord.of(problem.run)
        balanced = _Balanced(problem, record, HarmonicProjection(record.theta, self.harmonics))
        axes = problem.model_type.search_axes(record.condition.amplitude_m, problem.free)
        if not axes:
            model, _, held = balanced.at({})
            return Solution(model, 0.0, held, {}, {}, 1, "solved: every parameter is linear")
        to_search: Callable[[SearchAxis, float], float] = lambda axis, v: float(np.log(v)) if axis.log else v  # noqa: E731

        def point(u: Floats) -> dict[str, float]:
            return {axis.name: float(np.exp(c)) if axis.log else float(c) for axis, c in zip(axes, u, strict=True)}

        grid = [np.array(u) for u in product(*([to_search(axis, g) for g in axis.grid] for axis in axes))]
        costs = [float(np.sum(balanced.at(point(u))[1] ** 2)) for u in grid]
        lower = np.array([to_search(axis, axis.lower) for axis in axes])
        upper = np.array([to_search(axis, axis.upper) for axis in axes])
        starts = [grid[i] for i in np.argsort(costs)[: min(len(axes), 2)]]
        found = [least_squares(lambda u: balanced.at(point(u))[1], start, lower, upper) for start in starts]
        best = min(found, key=lambda minimum: minimum.cost)
        start = starts[found.index(best)]
        model, _, held = balanced.at(point(best.point))
        edge = np.minimum(best.point - lower, upper - best.point) < 1e-3 * (upper - lower)
        return Solution(
            model=model,
            delay=0.0,
            at_bounds=(*held, *(axis.name for axis, at in zip(axes, edge, strict=True) if at)),
            start=point(start),
            end=point(best.point),
            evaluations=len(grid) + sum(minimum.evaluations for minimum in found),
            message=best.message,
        )


class _Balanced:
    """Linear parameters of least squared harmonic residual, for given shape coordinates."""

    def __init__(self, problem: Problem, record: SineRecord, project: HarmonicProjection):
        self.problem, self.record, self.project = problem, record, project
        self.motion = record.motion
        self.linear = [i for i in problem.model_type.parameters() if i.linear and i.name in problem.free]
        self.measured = project(record.force)

    def at(self, point: Mapping[str, float]) -> tuple[Model, Floats, tuple[str, ...]]:
        """Model, residual harmonics (orthonormal) and parameters held at a bound."""
        zero = {i.name: 0.0 for i in self.linear}
        bare = self.problem.model_type.build({**self.problem.fixed, **point, **zero})
        state = steady_state(bare, self.record)
        base = bare.force(self.motion, state)
        forces = [replace(bare, **{i.name: 1.0}).force(self.motion, state) - base for i in self.linear]
        columns = self.project(np.column_stack(forces))
        right = self.measured - self.project(base)
        lower, upper = (np.array([i.bounds[side] for i in self.linear]) for side in (0, 1))
        solution, held = bounded_linear(columns, right, lower, upper)
        names = [i.name for i in self.linear]
        model = replace(bare, **dict(zip(names, solution.tolist(), strict=True)))
        return model, columns @ solution - right, tuple(n for n, h in zip(names, held, strict=True) if h)


def steady_state(model: Model, record: SineRecord) -> Floats:
    """Internal state on the closed loop, at the phases of a record.

    Raises
    ------
    IdentificationError
        If the model has a memory whose closed loop is not known exactly.
    """
    if type(model).state is Model.state:
        return np.zeros(record.theta.size)
    shape = getattr(model, "shape", None)
    if shape is None:
        raise IdentificationError(
            f"no closed loop of the {model.title} model is known", mend="use method projection, which follows any model"
        )
    return float(shape.yield_displacement) * steady_loop(shape, record.condition.amplitude_m, record.theta)
