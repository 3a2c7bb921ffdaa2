"""Genetic algorithm of the paper: generations in boxes that narrow step by step.

[Qian et al. 2024, section 4.3] states population, crossover fraction, mutation probability, selection, generations and
bounds. The rest follows the program whose default selection it names: rank scaling, five per cent elite, scattered
crossover.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.errors import ParameterError
from mrdamper.statistics.linear import Floats
from mrdamper.statistics.stop_reason import StopReason

GENERATIONS_OF_MANY = 60  # generations of a search in a study of many runs


@dataclass(frozen=True)
class GeneticSettings:
    """Settings of the search, by default the paper's; raises `ParameterError` for a share or count out of range."""

    population: int = 100
    generations: int = 500
    crossover_fraction: float = 0.8  # share of the children, elite apart, that are crossed; the others are mutated
    mutation: float = 0.2  # probability with which each number of a mutated child is drawn anew from the box
    elite: float = 0.05  # share of the population that survives unchanged
    narrowings: int = 6  # further searches, each in a box about the best point ("progressively narrower")
    narrow_to: float = 0.2  # width of each box over that of the one before
    seed: int = 0

    def __post_init__(self) -> None:
        if self.population < 4 or self.generations < 1 or self.narrowings < 0:
            raise ParameterError(
                f"population {self.population}, generations {self.generations}, narrowings {self.narrowings}",
                remedy="use a population of 4 or more, at least one generation, and no negative count",
            )
        for name in ("crossover_fraction", "mutation", "elite", "narrow_to"):
            if not 0 <= getattr(self, name) <= 1:
                raise ParameterError(f"{name} is {getattr(self, name)}", remedy="give a share between 0 and 1")

    @property
    def children(self) -> tuple[int, int, int]:
        """Numbers of elite, crossed and mutated points in a generation."""
        elite = max(1, round(self.elite * self.population))
        crossed = round(self.crossover_fraction * (self.population - elite))
        return elite, crossed, self.population - elite - crossed


@dataclass(frozen=True, eq=False)
class GeneticMinimum:
    """End of a search."""

    point: Floats  # (D,)
    cost: float
    evaluations: int
    history: Floats  # (G,) lowest cost after every generation, over all boxes
    boxes: tuple[tuple[Floats, Floats], ...]  # searched one after the other, (D,) arrays
    ending: StopReason = StopReason.GENERATIONS_SPENT

    @property
    def to_settle(self) -> int:
        """Evaluations until the cost is within 1 % of the final one."""
        generations = int(np.argmax(self.history <= 1.01 * self.cost)) + 1
        return generations * self.evaluations // self.history.size


def genetic(
    cost: Callable[[Floats], Floats], lower: ArrayLike, upper: ArrayLike, settings: GeneticSettings | None = None
) -> GeneticMinimum:
    """Minimise a cost inside a box, then inside successively narrower ones about the best point.

    The cost takes a whole generation of (P, D) points and gives (P,) values; the bounds (D,) are searched on a linear
    scale, as in the paper. Raises `ParameterError` if a lower bound is not below its upper bound.
    """
    chosen = settings or GeneticSettings()
    low, high = np.array(lower, dtype=float), np.array(upper, dtype=float)
    for i in np.flatnonzero(~(low < high)).tolist():
        raise ParameterError(
            f"bounds of coordinate {i} run from {low[i]:g} to {high[i]:g}", remedy="give the lower bound first"
        )
    outer, boxes, history = (low, high), [], []
    best, best_cost = (low + high) / 2, np.inf
    rng = np.random.default_rng(chosen.seed)
    for _ in range(chosen.narrowings + 1):
        boxes.append((low, high))
        point, lowest, costs = _search_box(cost, low, high, chosen, int(rng.integers(2**31)))
        history.append(np.minimum(costs, best_cost))
        if lowest < best_cost:
            best, best_cost = point, lowest
        half = chosen.narrow_to * (high - low) / 2
        # The box moves with the best point but stays inside the first one, at full width.
        centre = np.clip(best, outer[0] + half, outer[1] - half)
        low, high = centre - half, centre + half
    total = chosen.population * chosen.generations * len(boxes)
    return GeneticMinimum(best, float(best_cost), total, np.concatenate(history), tuple(boxes))


def _search_box(
    cost: Callable[[Floats], Floats], lower: Floats, upper: Floats, settings: GeneticSettings, seed: int
) -> tuple[Floats, float, Floats]:
    """Search one box; return the best point, its cost, and the lowest cost after every generation."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(lower, upper, (settings.population, lower.size))
    costs = cost(points)
    lowest = [np.min(costs)]
    for _ in range(settings.generations - 1):
        elite, children = next_generation(points, costs, lower, upper, settings, rng)
        kept = np.sort(costs, kind="stable")[: len(elite)]
        points, costs = np.concatenate([elite, children]), np.concatenate([kept, cost(children)])
        lowest.append(np.min(costs))
    best = int(np.argmin(costs))
    return points[best], float(costs[best]), np.array(lowest)


def next_generation(
    points: Floats, costs: Floats, lower: Floats, upper: Floats, settings: GeneticSettings, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Return the elite and the children that follow a generation, together as many as `points`."""
    elite, crossed, mutated = settings.children
    needed = 2 * crossed + mutated
    parents = rng.permutation(stochastic_uniform(rank_scaling(costs, needed), needed, float(rng.random())))
    pairs = points[parents[: 2 * crossed]]
    children = scattered_crossover(pairs[::2], pairs[1::2], rng)
    mutants = uniform_mutation(points[parents[2 * crossed :]], lower, upper, settings.mutation, rng)
    return points[np.argsort(costs, kind="stable")[:elite]], np.concatenate([children, mutants])


def rank_scaling(costs: ArrayLike, parents: int) -> Floats:
    """Return how often each point is expected to be chosen, ∝ 1/√rank, summing to the number of parents."""
    values = np.asarray(costs, dtype=float)
    expectation = np.empty(values.size)
    expectation[np.argsort(values, kind="stable")] = 1 / np.sqrt(np.arange(1, values.size + 1))
    return parents * expectation / expectation.sum()


def stochastic_uniform(expectation: Floats, parents: int, draw: float) -> np.ndarray:
    """Choose parents by equal steps along a line on which each point takes its expectation.

    The expectations (P,) sum to the number of parents; `draw`, within 0...1, is the start in the first step. Gives the
    indices, ascending.
    """
    wheel = np.cumsum(expectation) / parents
    pointers = (draw + np.arange(parents)) / parents
    return np.minimum(np.searchsorted(wheel, pointers, side="right"), expectation.size - 1)


def scattered_crossover(mothers: Floats, fathers: Floats, rng: np.random.Generator) -> Floats:
    """Take every number of a child from either parent, at even odds."""
    return np.where(rng.random(mothers.shape) < 0.5, mothers, fathers)


def uniform_mutation(
    points: Floats, lower: Floats, upper: Floats, probability: float, rng: np.random.Generator
) -> Floats:
    """Draw every number anew from the box with a probability."""
    chosen = rng.random(points.shape) < probability
    return np.where(chosen, lower + (upper - lower) * rng.random(points.shape), points)
