"""Newton's steps at the end of a search."""

import numpy as np

from mrdamper.statistics.levenberg_marquardt import newton_refine

NEAR = np.array([1.01, 0.7])


def ended(gradient):
    return newton_refine(gradient, NEAR, np.zeros(2), np.full(2, 2.0))


def test_the_last_steps_find_the_minimum():
    found = ended(lambda u: np.array([np.sinh(u[0] - 1), u[1] - 0.7 + 0.1 * (u[0] - 1) ** 2]))
    np.testing.assert_allclose(found, [1.0, 0.7], atol=1e-12)


def test_a_plain_and_a_minimum_far_away_leave_the_point():
    np.testing.assert_array_equal(ended(lambda u: np.full(2, u.sum() - 1.7)), NEAR)
    np.testing.assert_array_equal(ended(lambda u: u - 1.5), NEAR)


def test_newton_stays_inside_the_box_at_its_upper_end():
    upper, centre = np.array([1.0, 2.0]), np.array([1.5, 0.3])

    def gradient(u):
        assert np.all(u <= upper)
        return np.array([2.0, 3.0]) * (u - centre)

    found = newton_refine(gradient, np.array([1.0, 0.31]), np.zeros(2), upper)
    np.testing.assert_allclose(found, [1.0, 0.3], atol=1e-12)


def test_half_of_a_symmetric_curvature_suffices():
    matrix, centre, asked = np.array([[2.0, 0.3], [0.3, 1.0]]), np.array([1.0, 0.7]), []

    def first(u, count):
        asked.append(count)
        return (matrix @ (u - centre))[:count]

    found = newton_refine(lambda u: matrix @ (u - centre), NEAR, np.zeros(2), np.full(2, 2.0), first)
    np.testing.assert_allclose(found, centre, atol=1e-12)
    assert asked == [1, 2]
