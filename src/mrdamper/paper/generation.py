"""One generation of the paper's genetic algorithm: its settings and its operators on arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.errors import ParameterError
from mrdamper.statistics.linear import Floats

GENERATIONS_OF_MANY = 60  # of a search that is one of dozens


@dataclass(frozen=True)
class GeneticSettings:
    """Settings of the search; the defaults are the paper's.

    Attributes
    ----------
    population, generations : int
    crossover_fraction : float
        Share of the children, elite apart, that are crossed; the others are mutated.
    mutation : float
        Probability with which each number of a mutated child is drawn anew from the box.
    elite : float
        Share of the population that survives unchanged.
    narrowings : int
        Further searches, each in a box about the best so far ("progressively narrower").
    narrow_to : float
        Width of each box over that of the one before.
    seed : int

    Raises
    ------
    ParameterError
        If a share lies outside 0...1 or a count is too small.
    """

    population: int = 100
    generations: int = 500
    crossover_fraction: float = 0.8
    mutation: float = 0.2
    elite: float = 0.05
    narrowings: int = 6
    narrow_to: float = 0.2
    seed: int = 0

    def __post_init__(self) -> None:
        if self.population < 4 or self.generations < 1 or self.narrowings < 0:
            raise ParameterError(
                f"population {self.population}, generations {self.generations}, narrowings {self.narrowings}",
                mend="use a population of 4 or more, at least one generation, and no negative count",
            )
        for name in ("crossover_fraction", "mutation", "elite", "narrow_to"):
            if not 0 <= getattr(self, name) <= 1:
                raise ParameterError(f"{name} is {getattr(self, name)}", mend="give a share between 0 and 1")

    @property
    def children(self) -> tuple[int, int, int]:
        """How many of a generation are elite, crossed and mutated."""
        elite = max(1, round(self.elite * self.population))
        crossed = round(self.crossover_fraction * (self.population - elite))
        return elite, crossed, self.population - elite - crossed


def rank_scaling(costs: ArrayLike, parents: int) -> Floats:
    """Expected number of times each point is chosen, ∝ 1/√rank, summing to the number of parents."""
    values = np.asarray(costs, dtype=float)
    rank = np.empty(values.size)
    rank[np.argsort(values, kind="stable")] = np.arange(1, values.size + 1)
    expectation = 1 / np.sqrt(rank)
    return parents * expectation / expectation.sum()


def stochastic_uniform(expectation: Floats, parents: int, draw: float) -> np.ndarray:
    """Choose parents by equal steps along a line on which each point takes its expectation.

    Parameters
    ----------
    expectation : (P,) array
        Summing to `parents`.
    parents : int
    draw : float
        One random number in 0...1: where in the first step to begin.

    Returns
    -------
    (parents,) int array
        Indices, ascending.
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
    return np.where(rng.random(points.shape) < probability, rng.uniform(lower, upper, points.shape), points)


def next_generation(
    points: Floats, costs: Floats, lower: Floats, upper: Floats, settings: GeneticSettings, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Elite points and children that follow a generation.

    Returns
    -------
    elite, children : arrays
        Together as many as `points`.
    """
    elite, crossed, mutated = settings.children
    needed = 2 * crossed + mutated
    parents = rng.permutation(stochastic_uniform(rank_scaling(costs, needed), needed, float(rng.random())))
    pairs = points[parents[: 2 * crossed]]
    children = scattered_crossover(pairs[::2], pairs[1::2], rng)
    mutants = uniform_mutation(points[parents[2 * crossed :]], lower, upper, settings.mutation, rng)
    return points[np.argsort(costs, kind="stable")[:elite]], np.concatenate([children, mutants])
