"""Least squares whose coefficients are not negative: the conditions of its minimum, and SciPy's answers."""

import numpy as np
import pytest
from scipy.optimize import nnls

from mrdamper.statistics.linear import nonnegative_least_squares


@pytest.mark.parametrize("seed", range(30))
def test_no_feasible_direction_leads_down(seed):
    draw = np.random.default_rng(seed)
    rows, columns = int(draw.integers(2, 30)), int(draw.integers(1, 12))
    table = draw.standard_normal((rows, columns)) * 10 ** draw.uniform(-2, 2, columns)
    right = draw.standard_normal(rows) if seed % 3 else table @ np.maximum(draw.standard_normal(columns), 0)
    solution, rest = nonnegative_least_squares(table, right)
    slope = (table.T @ (right - table @ solution)) / np.linalg.norm(table, axis=0) / np.linalg.norm(right)
    assert (solution >= 0).all()
    assert slope.max() < 1e-10
    assert np.abs(slope[solution > 0]).max(initial=0.0) < 1e-10
    assert rest == pytest.approx(nnls(table, right)[1], abs=1e-10 * np.linalg.norm(right))


def test_nothing_is_gained_from_columns_that_point_away():
    solution, rest = nonnegative_least_squares(-np.eye(3), np.ones(3))
    assert solution.tolist() == [0.0, 0.0, 0.0]
    assert rest == pytest.approx(np.sqrt(3))
