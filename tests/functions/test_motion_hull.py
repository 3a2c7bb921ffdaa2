"""The hull of the tested motions: laws of a projection on a convex set, and degenerate hulls."""

import numpy as np
import pytest

from mrdamper.data import Condition
from mrdamper.statistics.functions.motion_hull import MotionHull

TRIANGLE = [Condition(0.0, f, A) for f, A in ((0.5, 0.025), (1.0, 0.025), (2.0, 0.010))]


def anywhere(count, seed=3):
    rng = np.random.default_rng(seed)
    return np.exp(rng.uniform(-2, 2, count)), 0.015 * np.exp(rng.uniform(-2, 2, count))


def test_tested_motions_and_those_between_them_stay():
    hull = MotionHull.of(TRIANGLE * 4)
    for c in TRIANGLE:
        assert hull.nearest(c.frequency_Hz, c.amplitude_m) == pytest.approx((c.frequency_Hz, c.amplitude_m))
    shares = np.random.default_rng(1).dirichlet(np.ones(3), 200)
    f, A = np.exp(shares @ np.log([(c.frequency_Hz, c.amplitude_m) for c in TRIANGLE])).T
    assert np.allclose(hull.nearest(f, A), (f, A), rtol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_the_projection_is_idempotent_continuous_and_no_tested_motion_is_nearer(seed):
    rng = np.random.default_rng(seed)
    motions = [Condition(0.0, *np.exp(rng.normal(0, 1, 2)) * [1.0, 0.01]) for _ in range(12)]
    hull, (f, A) = MotionHull.of(motions), anywhere(500, seed)
    near = np.array(hull.nearest(f, A))
    assert np.allclose(hull.nearest(*near), near, rtol=1e-9)
    moved = np.array(hull.nearest(f * 1.001, A / 1.001))
    assert np.all(np.linalg.norm(np.log(moved / near), axis=0) <= np.hypot(1e-3, 1e-3) * 1.01)  # no step is longer
    far = np.linalg.norm(np.log(near / (f, A)), axis=0)
    for share in rng.dirichlet(np.ones(12), 50):
        other = np.exp(share @ np.log([(c.frequency_Hz, c.amplitude_m) for c in motions]))
        assert np.all(np.linalg.norm(np.log(other[:, None] / (f, A)), axis=0) >= far - 1e-9)


def test_the_peak_velocity_stays_within_that_of_the_tests():
    hull, (f, A) = MotionHull.of(TRIANGLE), anywhere(500)
    speed = np.prod(hull.nearest(f, A), axis=0)
    assert speed.max() <= 0.025 * (1 + 1e-9)
    assert speed.min() >= 0.0125 * (1 - 1e-9)


def test_one_motion_is_a_point_and_one_amplitude_a_segment():
    f, A = anywhere(50)
    one = MotionHull.of([Condition(i, 1.0, 0.01 * (1 + 1e-3 * i)) for i in (0.0, 0.5, 1.0)])
    assert len(one.corners) == 1
    assert one.nearest(f, A) == one.corners[0]
    line = MotionHull.of([Condition(0.0, f, 0.01 * (1 + 0.01 * k)) for k, f in enumerate((1.0, 2.0, 4.0))])
    assert len(line.corners) == 2
    near = line.nearest(f, A)
    assert np.allclose(near[1], 0.0101, rtol=0.02)
    assert near[0].min() == pytest.approx(1.0, rel=0.02)
    assert near[0].max() == pytest.approx(4.0, rel=0.02)
