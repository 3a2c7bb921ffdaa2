"""Motions faster than the tested ones: their distance, the curvature that the tests show, and what intervals hold."""

from dataclasses import replace

import numpy as np
import pytest

from mrdamper.dampers.curvature import growth_by_curvature
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.joint import JointDamper
from mrdamper.dampers.run_residuals import RunResiduals
from mrdamper.dampers.slopes import force_slopes
from mrdamper.data import Condition, Dataset, Run
from mrdamper.errors import ExcitationError
from mrdamper.models.bingham import Bingham
from mrdamper.physics.motion import sine
from mrdamper.study.workflow import study_rig

CONDITIONS = [Condition(current, f, a) for current in (0.0, 1.0) for f in (1.0, 2.0) for a in (0.005, 0.01)]
C, FY, FASTEST = 2000.0, 150.0, 2 * np.pi * 2.0 * 0.01
DAMPER = JointDamper(Bingham(c=C, fy=FY, f0=20.0), ("c", "fy", "f0"), envelope=Envelope.of(CONDITIONS))
FREE = ("c", "fy", "f0")


def growth(square, damper=DAMPER):
    """Growth by the curvature of runs whose force has so much [N s²/m²] over v²."""
    runs = []
    for number, condition in enumerate(CONDITIONS):
        motion = sine(condition, 6, 200)
        force = DAMPER.force_along(motion, condition) + square * motion.velocity * np.abs(motion.velocity)
        runs.append(Run(f"r{number}", motion.time, motion.displacement, force, condition.current_A))
    parts = [RunResiduals.of(DAMPER, run) for run in runs]
    slopes = [force_slopes(DAMPER, part.prediction, FREE)[part.picked] for part in parts]
    return growth_by_curvature(damper, parts, slopes, FREE)


def test_a_faster_motion_is_away_by_its_velocity_and_the_force_that_the_law_adds():
    def away(*motion):
        return DAMPER.predict(Condition(0.5, *motion)).distance(DAMPER).motion

    rise = 1 - (C * FASTEST + FY) / (C * 2 * FASTEST + FY)
    assert away(4.0, 0.01) == pytest.approx(
        np.sqrt((0.1 * np.log(2)) ** 2 + (0.3 * np.log(2)) ** 2 + rise**2), rel=1e-3
    )
    assert away(0.5, 0.005) == pytest.approx(0.1 * np.log(2))  # slower than the nearest: no force is added
    assert away(1.5, 0.008) == pytest.approx(0.0, abs=1e-9)


def test_a_motion_whose_steady_loop_does_not_close_has_a_distance(monkeypatch):
    def loop(damper, condition):
        raise ExcitationError("the loop does not close")

    faster = DAMPER.predict(Condition(0.5, 4.0, 0.01))
    distance = faster.distance(DAMPER)
    monkeypatch.setattr(JointDamper, "loop", loop)
    assert faster.distance(DAMPER) == distance
    assert growth(0.0)[1] < 0.002


def test_the_curvature_is_that_of_the_force_at_twice_the_fastest_motion():
    square, speed = 3000.0, 2 * FASTEST
    peak = C * speed + FY
    distance = DAMPER.predict(Condition(0.5, 4.0, 0.01)).distance(DAMPER).motion
    loss = square * 4 / (3 * np.pi) * speed**3 / (C * speed**2 / 2 + FY * 2 / np.pi * speed)  # means over a cycle
    force = square * speed**2 * np.sqrt(3 / 8) / peak
    expected = np.array([force, square * speed**2 / peak, loss]) / distance
    assert growth(square) == pytest.approx(expected, rel=0.02)
    assert np.all(growth(0.0) < [0.03, 0.002, 0.002])  # the sign of samples at rest
    assert growth(3 * square)[1] == 1.0  # more than the velocity adds is no law of the velocity
    ranges = replace(DAMPER, envelope=replace(DAMPER.envelope, conditions=()))
    assert growth(square, ranges) is None


def force_of(law, condition, cycles=5):
    """Motion and force [N] of a damper whose friction rises with the current, beside a law over the velocity."""
    motion = sine(condition, cycles, 200)
    friction = np.zeros(motion.time.size)
    for k, step in enumerate(np.diff(motion.displacement)):  # exact over a monotone step
        way = np.sign(step)
        friction[k + 1] = way * (1 - (1 - way * friction[k]) * np.exp(-abs(step) / 4e-4))
    yielding = 150 + 900 * (1 - np.exp(-condition.current_A))
    return motion, yielding * friction + law(motion.velocity) + 1000 * motion.displacement


LAWS = {
    "laminar": lambda v: 2000 * v,
    "orifice": lambda v: 400 * v + 2500 * v * np.abs(v),
    "thinning": lambda v: 500 * np.sign(v) * np.abs(v / 0.3) ** 0.6,
}


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_peaks_of_faster_motions_lie_in_their_intervals(law):
    rng = np.random.default_rng(5)
    tested = [Condition(i, f, a) for i in (0.0, 0.5, 1.0, 1.5) for f in (0.5, 1.0, 2.0) for a in (0.01, 0.025)]
    runs = []
    for number, condition in enumerate(tested):
        motion, force = force_of(LAWS[law], condition)
        force = force * (1 + 0.008 * rng.standard_normal()) + 3 * rng.standard_normal(force.size)
        runs.append(Run(f"r{number:02d}", motion.time, motion.displacement, force, condition.current_A))
    damper = study_rig(Dataset(tuple(runs), law)).damper
    inside, halves = [], []
    for faster in (1.3, 1.6, 2.0):
        for current in (0.0, 1.0, 1.5):
            condition = Condition(current, 2.0 * faster, 0.025)
            truth = np.ptp(force_of(LAWS[law], condition)[1][-200:]) / 2
            low, high = damper.prediction_interval(damper.predict(condition), 0.9).peak
            inside.append(low <= truth <= high)
            halves.append((high - low) / (high + low))
    assert np.mean(inside) >= 0.85
    assert halves[1] < halves[4] < halves[7]
    if law == "laminar":
        assert np.median(halves[6:]) < 0.18
