"""All parameters by the genetic algorithm: the method that the paper compares with its own.

[Qian et al. 2024, section 6] The box is derived from the run, in yield force and yield displacement: on [0, 1e8] for
alpha and beta, with c, k and f0 free, the result is arbitrary. A = 1 is no restriction, because alpha, beta and gamma
compensate for it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import IdentificationError
from mrdamper.identification.columns import linear_table
from mrdamper.identification.harmonic_balance import SineRecord
from mrdamper.identification.methods.balance import steady_state
from mrdamper.identification.problem import Method, Problem, Solution
from mrdamper.models import Scale
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper.genetic import GENERATIONS_OF_MANY, GeneticMinimum, GeneticSettings, genetic

_SAMPLES = 200  # samples of a run in the search
_LINEAR = ("c", "f0", "k1", "k2", "k3", "m")


@dataclass(frozen=True)
class DirectGenetic(Method):
    """RMSE of the force on the measured sine over all free parameters of the Bouc–Wen model."""

    name: ClassVar[str] = "direct-genetic"
    summary: ClassVar[str] = "all parameters of the Bouc–Wen model by the genetic algorithm"

    genetic: GeneticSettings = field(default_factory=lambda: GeneticSettings(narrowings=3))
    # replace the box of a coordinate: c, f0, k1, k3, m, yield_force, yield_displacement, n, asymmetry [SI]
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=lambda: MappingProxyType({}))

    def for_many_runs(self) -> Method:
        """Return the method with a short genetic search, where the paper takes 500 generations."""
        return replace(self, genetic=replace(self.genetic, generations=GENERATIONS_OF_MANY))

    def solve(self, problem: Problem) -> Solution:
        """Determine the free parameters; raises `IdentificationError`, or `ExcitationError` if there is no sine."""
        return self.solution(problem, self.genetic_search(problem))

    def genetic_search(self, problem: Problem) -> GeneticMinimum:
        """Run the search alone; errors as `solve`."""
        if not issubclass(problem.model_type, BoucWen) or problem.with_delay:
            raise IdentificationError(
                f"method {self.name} identifies the Bouc–Wen model, without a delay",
                remedy="use model bouc-wen, or another method",
            )
        record, box = _thinned(problem), self._box(problem)
        lower, upper = zip(*box.values(), strict=True)
        return genetic(_Errors(problem, record, box), lower, upper, self.genetic)

    def solution(self, problem: Problem, minimum: GeneticMinimum) -> Solution:
        """Complete the end of a search to a solution."""
        box = self._box(problem)
        end = dict(zip(box, minimum.point.tolist(), strict=True))
        at_bounds = tuple(
            name for name, u in end.items() if min(u - box[name][0], box[name][1] - u) < 1e-3 * np.ptp(box[name])
        )
        shape = {name: end[name] for name in ("yield_displacement", "asymmetry", "n") if name in end}
        model, seed = BoucWen.build({**problem.fixed, **end}), self.genetic.seed
        return Solution(model, 0.0, at_bounds, {}, shape, minimum.evaluations, minimum.ending, seed)

    def _box(self, problem: Problem) -> dict[str, tuple[float, float]]:
        """Allow every parameter up to twice the value for the largest force."""
        record = _thinned(problem)
        peak, X = 2 * float(np.max(np.abs(record.force))), record.condition.amplitude_m
        speed = X * record.omega
        sizes = (peak / speed, peak, peak / X, peak / X**2, peak / X**3, peak / (speed * record.omega))
        box = {
            name: (0.0 if name == "c" else -size, size)
            for name, size in zip(_LINEAR, sizes, strict=True)
            if name in problem.free
        }
        axes = problem.model_type.within(
            problem.model_type.search_axes(Scale.of(record.motion, record.force, X), problem.free), problem.fixed
        )
        box |= {a.name: (a.lower, a.upper) for a in axes}
        if "yield_displacement" in box:
            # The paper searches on a linear scale; a hundredth of an amplitude is a usual yield displacement.
            box["yield_displacement"] = (1e-4 * X, min(0.5 * X, box["yield_displacement"][1]))
        return box | ({"yield_force": (0.0, peak)} if "alpha" in problem.free else {}) | dict(self.bounds)


def _thinned(problem: Problem) -> SineRecord:
    record = SineRecord.of(problem.run)
    pick = np.unique(np.linspace(0, record.theta.size - 1, _SAMPLES).round().astype(int))
    return replace(record, theta=record.theta[pick], force=record.force[pick])


class _Errors:
    """RMSE of the force of many points at once.

    The error is quadratic in everything but the shape of the loop, so each shape is evaluated once and reduced to a few
    sums; children inherit most shapes unchanged.
    """

    def __init__(self, problem: Problem, record: SineRecord, box: Mapping[str, tuple[float, float]]):
        names = list(box)
        infos = [info for info in problem.model_type.parameters() if info.linear and info.name in names]
        self.problem, self.record = problem, record
        self.linear = [names.index(info.name) for info in infos]
        self.force = names.index("yield_force") if "yield_force" in names else None
        self.shape = [i for i in range(len(names)) if i not in (*self.linear, self.force)]
        self.shape_names = [names[i] for i in self.shape]
        # The columns do not depend on the shape; any will do to evaluate them.
        self.zero = {**dict.fromkeys((names[i] for i in self.linear), 0.0), "yield_force": 0.0}
        model = self._model({name: box[name][0] for name in self.shape_names})
        base, self.columns = linear_table(model, infos, record.motion, np.zeros(record.theta.size))
        self.right = record.force - base
        self.known: dict[tuple[float, ...], Floats] = {}

    def __call__(self, points: Floats) -> Floats:
        """Return the errors [N] of (P, D) points."""
        rows = [tuple(row) for row in points[:, self.shape].tolist()]
        for row in [row for row in dict.fromkeys(rows) if row not in self.known]:
            self.known[row] = self._sums(row)
        sums = np.array([self.known[row] for row in rows])
        coefficients = points[:, self.linear]
        size = np.ones(len(points)) if self.force is None else points[:, self.force]
        fitted = coefficients @ (self.columns.T @ self.columns) - 2 * (self.right @ self.columns)
        square = np.sum(coefficients * (fitted + 2 * size[:, None] * sums[:, :-2]), axis=1)
        square += size * (size * sums[:, -1] - 2 * sums[:, -2]) + self.right @ self.right
        return np.sqrt(np.maximum(square, 0.0) / self.right.size)

    def _sums(self, row: tuple[float, ...]) -> Floats:
        """Return products of the hysteretic force, or its unit, with the columns, the right side and itself."""
        model = self._model(dict(zip(self.shape_names, row, strict=True)))
        scale = 1 / model.yield_displacement if self.force is not None else self.problem.fixed["alpha"]
        state = scale * steady_state(model, self.record)
        return np.array([*(state @ self.columns), state @ self.right, state @ state])

    def _model(self, shape: Mapping[str, float]) -> BoucWen:
        values = {**self.problem.fixed, **self.zero, **shape}
        return BoucWen.build({name: value for name, value in values.items() if name != "alpha"})
