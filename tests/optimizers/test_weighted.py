"""Least squares under several sets of weights beside one after the other."""

import numpy as np
import pytest

from mrdamper.statistics import linear
from mrdamper.statistics.linear import (
    gram_of,
    products_of,
    products_of_rest,
    project_out_columns,
    solve_bounded,
    solve_linear,
    solve_weighted,
)


@pytest.mark.parametrize("angle", [1.0, 1e-6])  # of the last column from the first: well apart, and nearly alike
def test_several_sets_of_weights_are_solved_as_one_after_the_other(angle):
    rng = np.random.default_rng(4)
    columns, right = rng.standard_normal((30, 4)) * [1.0, 1e5, 1e-4, 0.0], rng.standard_normal(30)
    columns[:, 3] = columns[:, 0] + angle * rng.standard_normal(30)
    weights = rng.uniform(0.5, 2.0, (6, 30)) * (np.arange(30) // 5 != np.arange(6)[:, None])
    solved = solve_weighted(columns, right, weights)
    for own, solution in zip(weights, solved, strict=True):
        alone = solve_linear(columns * own[:, None], right * own)
        expected = np.linalg.lstsq(columns * own[:, None], right * own)[0]
        np.testing.assert_allclose(solution, alone, rtol=1e-10)
        np.testing.assert_allclose(columns @ solution, columns @ expected, atol=1e-8)


def test_coefficients_beyond_a_bound_are_held_there_and_the_others_are_solved_again():
    rng = np.random.default_rng(5)
    columns = rng.standard_normal((40, 4)) * [1.0, 1e5, 1e-4, 1.0]
    right = columns @ [2.0, -3e-5, 5e3, 0.5] + 0.1 * rng.standard_normal(40)
    solution, held = solve_bounded(columns, right, np.zeros(4), np.array([np.inf, np.inf, 4e3, np.inf]))
    assert held.tolist() == [False, True, True, False]
    assert solution[1:3].tolist() == [0.0, 4e3]
    expected = np.linalg.lstsq(columns[:, ::3], right - 4e3 * columns[:, 2])[0]
    np.testing.assert_allclose(columns[:, ::3] @ solution[::3], columns[:, ::3] @ expected, atol=1e-8)


@pytest.mark.parametrize("angle", [1.0, 1e-6, 0.0])
def test_products_of_a_rest_are_those_of_the_projected_columns(angle):
    rng = np.random.default_rng(6)
    columns, right = rng.standard_normal((50, 4)) * [1.0, 1e5, 1e-4, 1.0], rng.standard_normal((50, 3))
    columns[:, 3] = columns[:, 0] + angle * rng.standard_normal(50)
    rest = project_out_columns(columns, right)
    np.testing.assert_allclose(products_of_rest(columns, right), rest.T @ rest, rtol=1e-8)
    few = products_of_rest(columns[:3], right[:3])  # fewer rows than columns
    np.testing.assert_allclose(few, np.zeros((3, 3)), atol=1e-8)


@pytest.mark.parametrize("most", [1, 100, 10**6])  # multiplications of a block: many blocks of one column, or one block
def test_products_of_rows_in_blocks_are_those_of_all_columns(most, monkeypatch):
    monkeypatch.setattr(linear, "_SMALL_PRODUCT", most)
    table = np.random.default_rng(7).standard_normal((5, 43))
    np.testing.assert_allclose(products_of(table[:4], table), (table @ table.T)[:4], atol=1e-12)
    for count in (1, 5):
        np.testing.assert_allclose(gram_of(table[:count]), (table @ table.T)[:count, :count], atol=1e-12)
