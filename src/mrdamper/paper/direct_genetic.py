"""Every parameter at once by the genetic algorithm: what the paper compares its method with.

[Qian et al. 2024, section 5] The box is laid from the run itself, in yield force and yield
displacement: on [0, 1e8] for alpha and beta, with c, k and f0 free beside them, the search
ends anywhere. A = 1: with alpha, beta and gamma free it changes no force.
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
from mrdamper.paper.generation import GENERATIONS_OF_MANY, GeneticSettings
from mrdamper.paper.genetic import GeneticMinimum, genetic

_SAMPLES = 200


@dataclass(frozen=True)
class DirectGenetic(Method):
    """RMSE of the force on the measured sine over all free parameters of the Bouc–Wen model.

    Attributes
    ----------
    genetic : GeneticSettings
    bounds : mapping of str to (float, float)
        Replace the box of a coordinate: c, f0, k1, k3, m, yield_force, yield_displacement, n,
        asymmetry [SI].
    """

    name: ClassVar[str] = "direct-genetic"
    summary: ClassVar[str] = "all parameters of the Bouc–Wen model by the genetic algorithm"

    genetic: GeneticSettings = field(default_factory=lambda: GeneticSettings(narrowings=3))
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=lambda: MappingProxyType({}))

    def for_many_runs(self) -> Method:
        """Return the method with a short genetic search, where the paper takes 500 generations."""
        return replace(self, genetic=replace(self.genetic, generations=GENERATIONS_OF_MANY))

    def solve(self, problem: Problem) -> Solution:
        """Determine the free parameters of a problem.

        Raises
        ------
        IdentificationError
            If the model is not Bouc–Wen.
        ExcitationError
            If the motion is no sine.
        """
        return self.solution(problem, self.genetic_search(problem))

    def genetic_search(self, problem: Problem) -> GeneticMinimum:
        """Run the search alone; arguments and errors as `solve`."""
        if not issubclass(problem.model_type, BoucWen) or problem.with_delay:
            raise IdentificationError(
                f"method {self.name} identifies the Bouc–Wen model, without a delay",
                mend="use model bouc-wen, or another method",
            )
        record = _thinned(SineRecord.of(problem.run))
        box = self._box(problem)
        lower, upper = zip(*box.values(), strict=True)
        return genetic(_Errors(problem, record, box), lower, upper, self.genetic)

    def solution(self, problem: Problem, found: GeneticMinimum) -> Solution:
        """What a search found of a problem."""
        box = self._box(problem)
        end = dict(zip(box, found.point.tolist(), strict=True))
        at_bounds = tuple(
            name
            for name, value in end.items()
            if min(value - box[name][0], box[name][1] - value) < 1e-3 * np.ptp(box[name])
        )
        model = BoucWen.build({**problem.fixed, **end})
        searched = {name: end[name] for name in ("yield_displacement", "asymmetry", "n") if name in end}
        return Solution(model, 0.0, at_bounds, {}, searched, found.evaluations, found.ending, self.genetic.seed)

    def _box(self, problem: Problem) -> dict[str, tuple[float, float]]:
        return {**_box(problem, _thinned(SineRecord.of(problem.run))), **self.bounds}


def _thinned(record: SineRecord) -> SineRecord:
    pick = np.unique(np.linspace(0, record.theta.size - 1, _SAMPLES).round().astype(int))
    return SineRecord(record.run_id, record.condition, record.theta[pick], record.force[pick])


def _box(problem: Problem, record: SineRecord) -> dict[str, tuple[float, float]]:
    """Twice what the largest force would take, parameter by parameter."""
    peak, X = 2 * float(np.max(np.abs(record.force))), record.condition.amplitude_m
    speed = X * record.omega
    sizes = {"f0": peak, "k1": peak / X, "k2": peak / X**2, "k3": peak / X**3, "m": peak / (speed * record.omega)}
    box = {"c": (0.0, peak / speed)} if "c" in problem.free else {}
    box |= {name: (-size, size) for name, size in sizes.items() if name in problem.free}
    axes = problem.model_type.within(
        problem.model_type.search_axes(Scale.of(record.motion, record.force, X), problem.free), problem.fixed
    )
    # The paper searches on a linear scale; a hundredth of an amplitude is a usual yield displacement.
    box |= {a.name: (a.lower, a.upper) for a in axes}
    if "yield_displacement" in box:
        box["yield_displacement"] = (1e-4 * X, min(0.5 * X, box["yield_displacement"][1]))
    return box | ({"yield_force": (0.0, peak)} if "alpha" in problem.free else {})


class _Errors:
    """RMSE of the force of many points at once.

    The error is quadratic in everything but the shape of the loop, so each shape is followed once
    and leaves a few sums; children inherit most shapes unchanged.
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
        bare = self._model({**self.zero, **{name: box[name][0] for name in self.shape_names}})
        base, self.columns = linear_table(bare, infos, record.motion, np.zeros(record.theta.size))
        self.right = record.force - base
        self.known: dict[tuple[float, ...], Floats] = {}

    def __call__(self, points: Floats) -> Floats:
        """(P, D) points -> (P,) errors [N]."""
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
        """Products of the hysteretic force, or its unit, with the columns, the right side and itself."""
        shape = dict(zip(self.shape_names, row, strict=True))
        model = self._model({**self.zero, **shape})
        scale = 1 / model.yield_displacement if self.force is not None else self.problem.fixed["alpha"]
        state = scale * steady_state(model, self.record)
        return np.array([*(state @ self.columns), state @ self.right, state @ state])

    def _model(self, values: Mapping[str, float]) -> BoucWen:
        given = {**self.problem.fixed, **values}
        return BoucWen.build({name: value for name, value in given.items() if name != "alpha"})
