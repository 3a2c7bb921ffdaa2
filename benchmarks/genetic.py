"""A plain genetic algorithm with the paper's settings in NumPy.

Population 100, 500 generations, stochastic uniform selection, 0.8 crossed over (scattered), the
others mutated with probability 0.2 a number, elite 5, linear bounds [Qian et al. 2024, section 4.3].
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

POPULATION, GENERATIONS, ELITE, CROSSED, MUTATION = 100, 500, 5, 76, 0.2


def plain_genetic(
    cost: Callable[[np.ndarray], np.ndarray],
    lower: np.ndarray,
    upper: np.ndarray,
    seed: int,
    generations: int = GENERATIONS,
) -> float:
    """Lowest cost found; `cost` takes a whole generation, (P, D) -> (P,)."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(lower, upper, (POPULATION, lower.size))
    costs = cost(points)
    for _ in range(generations - 1):
        order = np.argsort(costs)
        rank = np.empty(POPULATION)
        rank[order] = np.arange(1, POPULATION + 1)
        wheel = np.cumsum(rank**-0.5)
        count = 2 * CROSSED + POPULATION - ELITE - CROSSED
        pointers = (rng.random() + np.arange(count)) / count * wheel[-1]
        parents = rng.permutation(np.minimum(np.searchsorted(wheel, pointers, side="right"), POPULATION - 1))
        mothers, fathers = points[parents[:CROSSED]], points[parents[CROSSED : 2 * CROSSED]]
        children = np.where(rng.random(mothers.shape) < 0.5, mothers, fathers)
        mutants = points[parents[2 * CROSSED :]]
        mutants = np.where(rng.random(mutants.shape) < MUTATION, rng.uniform(lower, upper, mutants.shape), mutants)
        kept = points[order[:ELITE]]
        points = np.concatenate([kept, children, mutants])
        costs = np.concatenate([costs[order[:ELITE]], cost(points[ELITE:])])
    return float(costs.min())
