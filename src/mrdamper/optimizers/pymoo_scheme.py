"""pymoo runs the generations of `genetic`: it keeps, evaluates and records the population.

Apart from `genetic` because it cannot be imported where pymoo is not installed.
"""

# pymoo may be absent, and where it is there its annotations allow None for what it has set.
# pyright: reportMissingImports=false, reportOptionalMemberAccess=false, reportOptionalSubscript=false
# pyright: reportArgumentType=false, reportCallIssue=false, reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pymoo.core.algorithm import Algorithm
from pymoo.core.population import Population
from pymoo.core.problem import Problem

from mrdamper.optimizers.generation import GeneticSettings, next_generation
from mrdamper.optimizers.linear import Floats


class _Batch(Problem):
    """A cost of a whole generation at once."""

    def __init__(self, cost: Callable[[Floats], Floats], lower: Floats, upper: Floats):
        super().__init__(n_var=lower.size, n_obj=1, xl=lower, xu=upper)
        self._cost = cost

    def _evaluate(self, x: Floats, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        out["F"] = self._cost(x)[:, None]


class _EliteScheme(Algorithm):
    """Elite, crossed and mutated children make the next generation; nobody else survives."""

    def __init__(self, settings: GeneticSettings, **kwargs: Any):
        super().__init__(**kwargs)
        self._settings = settings
        self._rng = np.random.default_rng(self.seed)  # pymoo's own is not in every version
        self.lowest: list[float] = []

    def _initialize_infill(self) -> Population:
        box = self.problem.xl, self.problem.xu
        return Population.new("X", self._rng.uniform(*box, (self._settings.population, box[0].size)))

    def _initialize_advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        self._replace_by(infills)

    def _infill(self) -> Population:
        points, costs = self.pop.get("X"), self.pop.get("F")[:, 0]
        _, children = next_generation(points, costs, self.problem.xl, self.problem.xu, self._settings, self._rng)
        return Population.new("X", children)

    def _advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        best_first = np.argsort(self.pop.get("F")[:, 0], kind="stable")
        self._replace_by(Population.merge(self.pop[best_first[: self._settings.children[0]]], infills))

    def _replace_by(self, population: Population) -> None:
        self.pop = population
        self.lowest.append(float(np.min(population.get("F"))))

    def _set_optimum(self) -> None:
        costs = self.pop.get("F")[:, 0]
        self.opt = self.pop[[int(np.argmin(costs))]]


def run_generations(
    cost: Callable[[Floats], Floats], lower: Floats, upper: Floats, settings: GeneticSettings, seed: int
) -> tuple[Floats, float, Floats]:
    """Run one box; returns the best point, its cost, and the lowest cost after every generation."""
    algorithm = _EliteScheme(settings, seed=seed)
    algorithm.setup(_Batch(cost, lower, upper), termination=("n_gen", settings.generations))
    while algorithm.has_next():
        algorithm.next()
    best = algorithm.opt[0]
    return np.array(best.X), float(best.F[0]), np.array(algorithm.lowest)
