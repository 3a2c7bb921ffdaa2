"""Distance from the tests: zero at them, symmetric, and written out for a current and a motion outside."""

import numpy as np
import pytest

from mrdamper.dampers.distance import Distance
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.modified import ModifiedModel
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.dampers.prediction import distance_from_tests
from mrdamper.data import Condition
from mrdamper.models.bingham import Bingham
from mrdamper.physics.motion import Excitation, sine
from mrdamper.statistics.functions.forms import ParameterFunction

LEVELS, MOTIONS = (0.0, 0.5, 2.0), ((0.5, 0.02), (1.0, 0.02), (2.0, 0.008))
TESTS = [Condition(current, *motion) for current in LEVELS for motion in MOTIONS]
TESTED = Envelope.of(TESTS)


def away(current, frequency, amplitude, tested=TESTED):
    return tested.distance(Condition(current, frequency, amplitude), np.array([current]))


@pytest.mark.parametrize("test", TESTS)
def test_a_test_is_nowhere_away(test):
    assert away(test.current_A, test.frequency_Hz, test.amplitude_m).squares == pytest.approx(np.zeros(3), abs=1e-20)


def test_a_current_between_two_levels_is_away_by_the_product_of_its_distances():
    assert away(1.0, 1.0, 0.02).between == pytest.approx(0.5 * 1.0 / 1.5**2)
    assert away(1.0, 1.0, 0.02).beyond == 0
    assert away(1.0, 1.0, 0.02) == away(-1.0, 1.0, 0.02)


def test_a_current_beyond_the_levels_is_away_by_the_product_of_its_distances_from_the_last_two():
    beyond = (0.3 - 0.02) * (0.3 - 0.02 + 1.5 / 2.0)
    assert away(2.6, 1.0, 0.02) == Distance(0.0, pytest.approx(beyond), pytest.approx(0.0, abs=1e-12))
    alone = Envelope.of([Condition(2.0, *motion) for motion in MOTIONS])
    assert away(3.0, 1.0, 0.02, alone).beyond == pytest.approx(0.48 * 1.48)  # no current is the other level
    assert away(1.0, 1.0, 0.02, alone) == Distance(0.0, pytest.approx(0.48 * 1.48), pytest.approx(0.0, abs=1e-12))
    assert away(2.02, 1.0, 0.02).beyond == 0  # sessions repeat a level to some per cent


def test_a_motion_is_away_by_the_distance_from_the_hull_in_logarithms():
    assert away(0.5, 0.25, 0.02).motion == pytest.approx(np.log(2))
    u, w = np.log(2.0), np.log(0.4)  # the edge from 1 Hz, 20 mm to 2 Hz, 8 mm, seen from 2 Hz, 20 mm
    assert away(0.5, 2.0, 0.02).motion == pytest.approx(abs(u * w) / np.hypot(u, w))
    assert away(0.5, 1.0, 0.015).motion == pytest.approx(0.0, abs=1e-12)


def test_records_with_a_current_that_changes_pass_through_all_currents():
    record = TESTED.with_motion(np.array([0.0, 2.5]), np.array([-0.02, 0.02]), np.array([0.3]))
    assert away(2.4, 1.0, 0.02, record).beyond == 0 < away(2.4, 1.0, 0.02).beyond
    assert away(3.0, 1.0, 0.02, record).beyond == pytest.approx((0.5 / 2.5 - 0.02) ** 2)
    assert away(1.0, 1.0, 0.02, record).between == 0
    assert away(1.0, 2.0, 0.02, record).motion < away(1.0, 2.0, 0.02).motion
    assert away(1.0, 4.0, 0.02, record).motion == pytest.approx(np.log(2 * np.pi * 4 * 0.02 / 0.3))


def test_where_only_ranges_are_known_no_distance_is():
    assert away(9.0, 9.0, 0.5, Envelope((0.0, 2.0), (0.5, 2.0), (0.01, 0.02), (0.0, 0.3))) == Distance()


@pytest.mark.parametrize(
    ("condition", "sentences"),
    [
        ((0.5, 1.0, 0.015), []),
        (
            (0.5, 2.0, 0.02),
            ["velocity 0.251 m/s lies above the tested range (0.0628 to 0.126 m/s), 2 times the largest"],
        ),
        ((0.5, 1.0, 0.009), ["velocity 0.0565 m/s lies below the tested range (0.0628 to 0.126 m/s) by 10 %"]),
        ((6.0, 1.0, 0.02), ["current 6 A lies above the tested range (0 to 2 A), 3 times the largest"]),
        (
            (600.0, 1.0, 0.02),
            ["current 600 A lies above the tested range (0 to 2 A), 300 times the largest; 600 mA are 0.6 A"],
        ),
    ],
)
def test_a_quantity_outside_is_stated_with_its_side_and_by_how_much(condition, sentences):
    outside = TESTED.outside(Condition(*condition))
    assert [str(beyond) for beyond in outside] == sentences
    time = np.arange(1000) / 1000  # the same motion as samples: it passes all lower velocities
    phase = 2 * np.pi * condition[1] * time
    v = 2 * np.pi * condition[1] * condition[2] * np.cos(phase)
    moved = Excitation(time, condition[2] * np.sin(phase), v, np.gradient(v, time), condition[0])
    above = [beyond.quantity for beyond in outside if beyond.value > beyond.tested[1]]
    assert [beyond.quantity for beyond in TESTED.outside(moved)] == above


def test_a_prediction_between_two_currents_is_away_by_a_share_of_the_force_that_the_current_adds():
    damper = ModifiedModel(
        ParameterMap(Bingham, {
            **{name: ParameterFunction("constant", (0.0,)) for name in Bingham.map_forms()},
            "fy": ParameterFunction("quadratic-current", (200.0, 0.0, 100.0)),
        }),
        envelope=TESTED,
    )  # fmt: skip
    force = {current: 100 + 200 * current**2 for current in (0.0, 0.25, 0.5, 1.0, 2.0)}
    for current, lower, upper in ((0.25, 0.0, 0.5), (1.0, 0.5, 2.0)):
        share = (current - lower) * (upper - current) / (upper - lower) ** 2
        asked = damper.predict(Condition(current, 1.0, 0.02)).distance(damper)
        assert asked.between == pytest.approx(share * (force[upper] - force[lower]) / force[current], rel=0.02)
    assert damper.predict(Condition(0.5, 1.0, 0.02)).distance(damper).between == 0
    motion = sine(Condition(0.0, 1.0, 0.02), 4, 400)
    switched = motion.with_current(np.where(motion.time % 1 < 0.5, 0.25, 1.0))
    parts = [0.25 * (force[0.5] - force[0.0]), 2 / 9 * (force[2.0] - force[0.5])]
    away = distance_from_tests(damper, Condition(0.6, 1.0, 0.02), switched.current)
    assert away.between == pytest.approx(np.sqrt(np.mean(np.square(parts))) / force[1.0], rel=0.02)
