"""The paper's genetic algorithm: generations in boxes that narrow step by step.

[Qian et al. 2024, section 4.3] states population, crossover fraction, mutation probability,
selection, generations and bounds. What it leaves open follows the program whose default
selection it names: rank scaling, five per cent elite, scattered crossover. The operators stand
in `generation`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.errors import ParameterError
from mrdamper.paper.generation import GeneticSettings, next_generation
from mrdamper.statistics.ending import Ending
from mrdamper.statistics.linear import Floats

Cost = Callable[[Floats], Floats]
Report = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class GeneticMinimum:
    """Where the search ended.

    Attributes
    ----------
    point : (D,) array
    cost : float
    evaluations : int
    history : (G,) array
        Lowest cost after every generation, over all boxes.
    boxes : tuple of (lower, upper)
        Searched one after the other, (D,) arrays.
    ending : Ending
    """

    point: Floats
    cost: float
    evaluations: int
    history: Floats
    boxes: tuple[tuple[Floats, Floats], ...]
    ending: Ending

    @property
    def to_settle(self) -> int:
        """Evaluations after which no better cost by over a hundredth was found."""
        generations = int(np.argmax(self.history <= 1.01 * self.cost)) + 1
        return generations * self.evaluations // self.history.size


def genetic(
    cost: Cost,
    lower: ArrayLike,
    upper: ArrayLike,
    settings: GeneticSettings | None = None,
    progress: Report = lambda what, share: None,
) -> GeneticMinimum:
    """Minimise a cost inside a box, then inside ever narrower ones about the best point.

    Parameters
    ----------
    cost : callable
        (P, D) points -> (P,) costs: a whole generation at once.
    lower, upper : (D,) arrays
        Linear scale, as the paper searches.
    settings : GeneticSettings, optional
    progress : callable
        Told what is being done and the share done, 0...1.

    Raises
    ------
    ParameterError
        If a lower bound is not below its upper bound.
    """
    chosen = settings or GeneticSettings()
    low, high = np.array(lower, dtype=float), np.array(upper, dtype=float)
    reversed_at = np.flatnonzero(~(low < high))
    if reversed_at.size:
        i = int(reversed_at[0])
        raise ParameterError(
            f"bounds of coordinate {i} run from {low[i]:g} to {high[i]:g}", mend="give the lower bound first"
        )
    outer, boxes, history = (low, high), [], []
    best, best_cost = (low + high) / 2, np.inf
    rng = np.random.default_rng(chosen.seed)
    for round_number in range(chosen.narrowings + 1):
        boxes.append((low, high))
        progress(
            f"genetic search, box {round_number + 1} of {chosen.narrowings + 1}", round_number / (chosen.narrowings + 1)
        )
        point, found, costs = _generations(cost, low, high, chosen, int(rng.integers(2**31)))
        history.append(np.minimum(costs, best_cost))
        if found < best_cost:
            best, best_cost = point, found
        half = chosen.narrow_to * (high - low) / 2
        # The box moves with the best point but stays inside the first one, at full width.
        centre = np.clip(best, outer[0] + half, outer[1] - half)
        low, high = centre - half, centre + half
    total = chosen.population * chosen.generations * len(boxes)
    return GeneticMinimum(
        best, float(best_cost), total, np.concatenate(history), tuple(boxes), Ending.GENERATIONS_SPENT
    )


def _generations(
    cost: Cost, lower: Floats, upper: Floats, settings: GeneticSettings, seed: int
) -> tuple[Floats, float, Floats]:
    """Search one box; the best point, its cost, and the lowest cost after every generation."""
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
