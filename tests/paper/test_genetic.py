"""The paper's genetic algorithm: its operators one by one, then the whole."""

import json
from pathlib import Path

import numpy as np
import pytest

from mrdamper.errors import ParameterError
from mrdamper.paper.genetic import (
    GeneticSettings,
    genetic,
    next_generation,
    rank_scaling,
    scattered_crossover,
    stochastic_uniform,
    uniform_mutation,
)

VECTOR = json.loads((Path(__file__).parents[1] / "vectors.json").read_text())["V22_sus"]


def bowl(points: np.ndarray) -> np.ndarray:
    return np.sum((points / [2e6, 3e5] - 1) ** 2, axis=1)


def test_selection_is_that_of_the_vector():
    expectation = rank_scaling(VECTOR["scores_min_is_best"], VECTOR["n_parents"])
    assert expectation == pytest.approx(VECTOR["expectation"], rel=1e-12)
    parents = stochastic_uniform(expectation, VECTOR["n_parents"], VECTOR["rand"])
    assert parents.tolist() == VECTOR["parents0based"]


def test_every_point_is_chosen_as_often_as_expected_give_or_take_one():
    rng = np.random.default_rng(1)
    expectation = rank_scaling(rng.random(50), 171)
    counts = np.bincount(stochastic_uniform(expectation, 171, rng.random()), minlength=50)
    assert np.all(np.abs(counts - expectation) < 1)


def test_a_generation_is_five_elite_seventy_six_crossed_nineteen_mutated():
    assert GeneticSettings().children == (5, 76, 19)
    rng = np.random.default_rng(2)
    points = rng.random((100, 2))
    elite, children = next_generation(points, bowl(points), np.zeros(2), np.ones(2), GeneticSettings(), rng)
    assert elite.shape == (5, 2)
    assert children.shape == (95, 2)
    assert bowl(elite).max() <= np.sort(bowl(points))[4]


def test_crossover_takes_numbers_from_the_parents_and_mutation_stays_in_the_box():
    rng = np.random.default_rng(3)
    mothers, fathers = np.zeros((500, 2)), np.ones((500, 2))
    children = scattered_crossover(mothers, fathers, rng)
    assert set(children.ravel()) == {0.0, 1.0}
    mutants = uniform_mutation(mothers, np.array([5.0, 5.0]), np.array([6.0, 7.0]), 0.2, rng)
    changed = mutants != 0
    assert np.all((mutants[changed] >= 5) & (mutants[changed] <= 7))
    assert changed.mean() == pytest.approx(0.2, abs=0.04)  # three standard deviations of 1000 draws


def test_the_search_is_seeded_narrows_and_records_its_history():
    settings = GeneticSettings(generations=40, narrowings=4)
    first, again = (genetic(bowl, [0, 0], [1e8, 1e8], settings) for _ in range(2))
    other = genetic(bowl, [0, 0], [1e8, 1e8], GeneticSettings(generations=40, narrowings=4, seed=1))
    assert first.point.tolist() == again.point.tolist() != other.point.tolist()
    assert first.history.size == 5 * 40
    assert np.all(np.diff(first.history) <= 0)
    assert first.history[-1] == first.cost < 1e-3 < first.history[0]
    widths = [float(high[0] - low[0]) for low, high in first.boxes]
    assert widths == pytest.approx([1e8 * 0.2**k for k in range(5)])
    assert all(np.all(low >= 0) and np.all(high <= 1e8) for low, high in first.boxes)


def test_reversed_bounds_and_impossible_settings_are_refused():
    with pytest.raises(ParameterError, match="give the lower bound first"):
        genetic(bowl, [0, 1e8], [1e8, 0])
    with pytest.raises(ParameterError, match=r"mutation is 1\.5"):
        GeneticSettings(mutation=1.5)
    with pytest.raises(ParameterError, match="population of 4"):
        GeneticSettings(population=2)
