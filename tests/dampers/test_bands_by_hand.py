"""Bands, intervals and what sessions tell, each beside the sums written out."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import stdtrit

from mrdamper.dampers import bands
from mrdamper.dampers.bands import band, no_band, portable_band, scope, session_band
from mrdamper.dampers.calibration import LEVELS, Calibration, Growth
from mrdamper.dampers.distance import Distance
from mrdamper.dampers.joint import JointDamper
from mrdamper.dampers.prediction import Prediction
from mrdamper.dampers.sessions import RecordingTime, RunScatter, SessionCorrection, Sessions
from mrdamper.dampers.uncertainty import FittedParameter, Uncertainty, _limit, table, uncertainty_warnings
from mrdamper.data import Condition
from mrdamper.errors import InputError
from mrdamper.identification.intervals import NOT_IDENTIFIABLE, written
from mrdamper.models.bingham import Bingham
from mrdamper.physics.motion import sine

CONDITION = Condition(1.0, 2.0, 0.01)
MOTION = sine(CONDITION, 1, 80)
FORCE = 300 * np.cos(2 * np.pi * 2.0 * MOTION.time) + 60 * np.sin(2 * np.pi * 2.0 * MOTION.time) + 25
SLOPES = np.column_stack([MOTION.velocity, np.sign(MOTION.velocity + 1e-9)])
COVARIANCE = np.array([[90.0, -4.0], [-4.0, 30.0]])
AWAY = Distance(between=0.02, beyond=0.1, motion=0.5)
GROWN = {  # by each way away from the tests
    "force": np.square([0.008, 0.005, 0.03]),
    "peak": np.square([0.01, 0.002, 0.015]),
    "energy": np.square([0.012, 0.007, 0.04]),
}
GROWN_DOF = (2.0, 1.0, 6.0)
KNOWN = Uncertainty(
    ("c", "fy"), (False, False), COVARIANCE, np.array([12.0, 5.0]), gain=0.03, offset=4.0, session_dof=3.0,
    run_gain=0.012, run_offset=2.5, run_dof=8.0, force=0.02, peak=0.015, energy=0.05, left_out=9,
    growth=Growth((0.4, 0.05, 0.06), (0.5, 0.02, 0.03), (0.6, 0.07, 0.08), GROWN_DOF),
)  # fmt: skip


def damper(known=KNOWN):
    model = Bingham(c=2000.0, fy=100.0, f0=25.0)
    envelope = SimpleNamespace(nearest=lambda condition: condition, flags=lambda condition: ())
    return JointDamper(model, ("c", "fy"), rig="rig", envelope=envelope, uncertainty=known)  # type: ignore[arg-type]


PREDICTION = Prediction(MOTION, FORCE, CONDITION, ())
BY_PARAMETERS = bands._by_parameters


def always(variances):
    def by_parameters(damper, loop):
        assert isinstance(loop, Prediction)
        return variances

    return by_parameters


@pytest.fixture(autouse=True)
def _slopes(monkeypatch):
    def slopes(damper, prediction, names):
        assert isinstance(prediction, Prediction)
        return SLOPES

    monkeypatch.setattr(bands, "force_slopes", slopes)
    monkeypatch.setattr(bands, "_by_parameters", always(np.full(3, np.inf)))
    monkeypatch.setattr(Prediction, "distance", lambda prediction, damper: AWAY)


def reach(level, *parts, known=True, at=slice(None)):
    """Half a band: Student's t after Satterthwaite; parameters and sessions, known by the same sessions, as one."""
    whole, shares = sum(parts), np.mean(SLOPES[at] ** 2, axis=0) * np.diag(COVARIANCE)
    by_sessions = 3.0 if known else shares.sum() / (shares[0] / 12.0 + shares[1] / 5.0)
    dof = whole**2 / ((parts[0] + parts[1]) ** 2 / by_sessions + parts[2] ** 2 / 8.0)
    return stdtrit(dof, (1 + level) / 2) * np.sqrt(whole)


def test_of_unknown_sessions_parameters_have_degrees_of_freedom_of_their_own():
    own = np.einsum("np,pq,nq->n", SLOPES, COVARIANCE, SLOPES)
    form = (0.012 * FORCE) ** 2 + 2.5**2 + (0.02 * np.ptp(FORCE) / 2) ** 2
    unknown = replace(KNOWN, gain=0.0, offset=0.0, session_dof=0.0, growth=Growth())
    t = reach(0.9, own.mean(), 0.0, form.mean(), known=False) / np.sqrt(np.mean(own + form))
    assert band(damper(unknown), PREDICTION).high - FORCE == pytest.approx(t * np.sqrt(own + form))


def test_a_band_does_not_depend_on_the_unit_of_force():
    def width(unit):
        known = replace(KNOWN, covariance=unit**2 * COVARIANCE, gain=0.0, offset=0.0, session_dof=0.0,
                        run_offset=2.5 * unit, growth=Growth())  # fmt: skip
        return (band(damper(known), replace(PREDICTION, force=unit * FORCE)).high / unit) - FORCE

    assert width(1e-3) == pytest.approx(width(1.0))


def test_the_error_of_a_loop_by_its_parameters_is_relative_to_peak_and_energy():
    half, velocity = np.ptp(FORCE) / 2, MOTION.velocity
    swing = (SLOPES[FORCE.argmax()] - SLOPES[FORCE.argmin()]) / 2 / half
    share = np.array([np.trapezoid(column * velocity, MOTION.time) for column in SLOPES.T])
    share /= np.trapezoid(FORCE * velocity, MOTION.time)
    own = np.mean([slope @ COVARIANCE @ slope for slope in SLOPES]) / half**2
    expected = own, swing @ COVARIANCE @ swing, share @ COVARIANCE @ share
    assert BY_PARAMETERS(damper(), PREDICTION) == pytest.approx(expected)


@pytest.mark.parametrize("level", [0.5, 0.9, 0.99])
@pytest.mark.parametrize("shown", [None, MOTION.time > 0.1])
def test_a_band_adds_numbers_sessions_and_form(level, shown):
    at = slice(None) if shown is None else shown
    found, force, slopes = band(damper(), PREDICTION, level, shown), FORCE[at], SLOPES[at]
    half = (force.max() - force.min()) / 2
    own = np.array([s @ COVARIANCE @ s for s in slopes])
    session, form = (0.03 * force) ** 2 + 16.0, (0.012 * force) ** 2 + 2.5**2 + 0.02**2 * half**2
    assert found.parameter == pytest.approx(np.sqrt(own))
    assert found.session == pytest.approx(np.sqrt(session))
    assert found.model == pytest.approx(np.sqrt(form + GROWN["force"].sum() * half**2))
    quantiles = stdtrit(GROWN_DOF, (1 + level) / 2)
    away = {quantity: np.sqrt(quantiles**2 @ grown) for quantity, grown in GROWN.items()}
    whole = own + session + form
    t = reach(level, own.mean(), session.mean(), form.mean(), at=at) / np.sqrt(whole.mean())
    assert found.high - force == pytest.approx(np.hypot(t * np.sqrt(whole), away["force"] * half))
    assert force - found.low == pytest.approx(found.high - force)
    swing = (slopes[force.argmax()] - slopes[force.argmin()]) / 2
    parts = swing @ COVARIANCE @ swing, (0.03 * half) ** 2, (0.012**2 + 0.015**2) * half**2
    at_tests = reach(level, *parts, at=at) * np.sqrt([1.0, 1 - parts[1] / sum(parts)])  # the session is known
    unseen, seen = (np.hypot(each, away["peak"] * half) for each in at_tests)
    assert found.peak == pytest.approx((half - unseen, half + unseen))
    assert found.known_session == pytest.approx((half - seen, half + seen))
    time, v = MOTION.time[at], MOTION.velocity[at]
    power, *turned = (np.trapezoid(f * v, time) for f in (force, slopes[:, 0], slopes[:, 1]))
    share = np.array(turned) / power
    loss = reach(level, share @ COVARIANCE @ share, 0.03**2, 0.012**2 + 0.05**2, at=at)
    loss = np.hypot(loss, away["energy"])
    assert found.energy == pytest.approx((-loss, loss))


def test_beyond_the_tested_motions_parameters_count_as_at_the_nearest(monkeypatch):
    """Growth holds the error of folds, that of their parameters with it; without growth nothing is limited."""
    plain, still = band(damper(), PREDICTION), band(damper(replace(KNOWN, growth=Growth())), PREDICTION)
    monkeypatch.setattr(bands, "_by_parameters", always(np.zeros(3)))
    limited = band(damper(), PREDICTION)
    assert not limited.parameter.any()
    for name in ("peak", "energy"):
        assert getattr(limited, name)[1] < getattr(plain, name)[1]
    assert np.all(limited.high < plain.high)
    unlimited = band(damper(replace(KNOWN, growth=Growth())), PREDICTION)
    assert unlimited.high == pytest.approx(still.high)
    monkeypatch.setattr(bands, "_by_parameters", always(np.full(3, 1e-4)))
    half = np.ptp(FORCE) / 2
    assert np.mean(band(damper(), PREDICTION).parameter ** 2) == pytest.approx(1e-4 * half**2)


def test_a_calibrated_band_is_its_factor_times_the_band_at_the_tests():
    """Runs count by themselves in the calibration: the error between them has no degrees of freedom more."""
    at_tests = replace(KNOWN, growth=Growth())
    factors = {"force": 1.7, "peak": 0.6, "energy": 2.5}
    calibrated = Calibration("run", 30, *((f,) * len(LEVELS) for f in factors.values()), (0.9, 0.9, 0.9))
    plain = band(damper(replace(at_tests, run_dof=1e12)), PREDICTION, 0.8)
    found = band(damper(replace(at_tests, calibration=calibrated)), PREDICTION, 0.8)
    assert found.high - FORCE == pytest.approx(1.7 * (plain.high - FORCE))
    assert np.diff(found.peak) == pytest.approx(0.6 * np.diff(plain.peak))
    assert found.energy[1] == pytest.approx(2.5 * plain.energy[1])
    # The growth away from the tests is outside the calibration: it stays as it is.
    away = band(damper(replace(KNOWN, calibration=calibrated)), PREDICTION, 0.8)
    grown = stdtrit(GROWN_DOF, 0.9) ** 2 @ GROWN["energy"]
    assert away.energy[1] == pytest.approx(np.sqrt(found.energy[1] ** 2 + grown))


def test_a_band_says_for_which_sessions_it_holds_and_how_far_it_is_calibrated():
    few = Calibration("session", 4, (1.0,), (1.0,), (1.0,), (0.9, 0.9, 0.9))
    future, like = "in a future test session", "for sessions like the tested ones (fewer than 3 known)"
    beyond = ", calibrated up to 80 %, as 4 sessions allow, and extrapolated beyond by Student's distribution"
    for dof, said in ((2.0, future), (0.0, like)):
        known = replace(KNOWN, session_dof=dof)
        assert scope(damper(known), 0.9) == said + ", not calibrated: no cross-validated runs"
        assert scope(damper(replace(known, calibration=few)), 0.8) == said
        assert scope(damper(replace(known, calibration=few)), 0.81) == said + beyond
    assert scope(damper(None), 0.9) == ""


def test_a_table_of_parameters_holds_their_intervals_and_states():
    known = replace(KNOWN, effective={"c": 40.0, "fy": 7.0})
    first, second = table(damper(known), 0.8)
    assert (first["low"], first["high"]) == known.interval(damper(), "c", 0.8)
    assert (first["name"], first["value"], first["unit"], first["state"]) == ("c", 2000.0, "N s/m", "determined")
    assert (first["effective_samples"], second["effective_samples"]) == (40.0, 7.0)
    assert first["written"] == written(2000.0, (first["low"], first["high"]), "N s/m")
    first, second = table(damper(replace(known, unknown=("c",), one_sided=("fy",))))
    assert (first["state"], first["written"]) == (NOT_IDENTIFIABLE, NOT_IDENTIFIABLE)
    assert np.isnan([first["low"], first["high"], first["effective_samples"]]).all()
    assert second["state"] == "one-sided: at a limit of what was searched"
    assert [row["state"] for row in table(damper(None))] == ["no covariance"] * 2
    # At a limit, that one is named.
    for value, said in ((0.0, "its lower limit 0"), (5.0, "its upper limit 5"), (2.0, "a limit of what was searched")):
        assert _limit(FittedParameter(value, (0.0, 5.0))) == said


def test_where_nothing_is_known_there_is_no_band_and_its_reason():
    assert band(damper(None), PREDICTION) is None
    assert band(damper(replace(KNOWN, session_dof=0.0, run_dof=0.0)), PREDICTION) is None
    assert band(damper(replace(KNOWN, session_dof=0.0, run_dof=1.0)), PREDICTION) is not None
    assert band(damper(replace(KNOWN, run_dof=0.0)), PREDICTION) is not None
    assert "without its covariance" in no_band(damper(None))
    assert "too few" in no_band(damper())
    for level in (0.0, 1.0):
        with pytest.raises(InputError, match="level"):
            band(damper(None), PREDICTION, level)
    # Not below nothing, however unsure; one run of each kind has one degree of freedom.
    wild = replace(KNOWN, gain=9.0, session_dof=1.0, run_dof=1.0, dof=np.array([1.0, 1.0]))
    assert band(damper(wild), PREDICTION).peak[0] == 0.0
    assert band(damper(wild), PREDICTION).energy[0] == -1.0


def test_beyond_the_reach_of_its_units_a_factor_has_their_degrees_of_freedom():
    ones = (1.0,) * len(LEVELS)

    def calibrated(units):
        known = Calibration("run", units, ones, ones, ones, coverage=(0.9, 0.9, 0.9))
        return band(damper(replace(KNOWN, calibration=known)), PREDICTION, 0.9)

    plain = band(damper(), PREDICTION, 0.9)
    assert calibrated(4).peak == plain.peak
    assert calibrated(4).energy == plain.energy
    assert calibrated(9).peak[1] < plain.peak[1]


def test_a_portable_band_is_that_of_loops_at_three_currents(monkeypatch):
    asked, widths = [], {0.0: 30.0, 1.0: 60.0, 2.0: 130.0}
    made = damper()

    def predict(self, condition):
        asked.append(condition)
        return Prediction(MOTION, (100 + 50 * condition.current_A) * np.array([1.5, -0.5, 0.0]), condition, ())

    def found(damper, prediction, level):
        ones, width = np.array([0.2, 0.4, 2.4]), widths[prediction.condition.current_A] * np.array([0.1, 0.9, 2.0])
        assert level == 0.8
        return SimpleNamespace(parameter=3 * ones, session=4 * ones, model=12 * ones, high=prediction.force + width)

    monkeypatch.setattr(JointDamper, "predict", predict)
    monkeypatch.setattr(bands, "band", found)
    away = {1.5: AWAY}
    monkeypatch.setattr(Prediction, "distance", lambda asked, damper: away.get(asked.condition.current_A, Distance()))
    tested = SimpleNamespace(tested=True, middle=CONDITION, current_A=(0.0, 2.0), peak_velocity_m_s=(0.0, 0.9),
        farthest=[CONDITION, replace(CONDITION, current_A=1.5)])  # fmt: skip
    portable = portable_band(replace(made, envelope=tested), 0.8)
    t = np.mean([30.0, 60.0, 130.0]) / 13
    own = np.mean([9 * np.mean([0.04, 0.16, 5.76]) / (100 + 50 * I) ** 2 for I in widths])
    assert (portable.level, portable.gain, portable.offset_N) == (
        0.8, pytest.approx(np.hypot(0.03, 0.012) * t), pytest.approx(np.hypot(4, 2.5) * t),
    )  # fmt: skip
    assert portable.of_peak == pytest.approx(t * np.sqrt(0.02**2 + own))
    grown = np.sqrt(stdtrit(GROWN_DOF, 0.9) ** 2 @ GROWN["force"])
    assert portable.of_peak_untested == pytest.approx(np.hypot(portable.of_peak, grown))
    assert asked == [replace(CONDITION, current_A=I) for I in (*widths, 1.0, 1.5)]
    slow = SimpleNamespace(**(vars(tested) | {"peak_velocity_m_s": (0.0, 0.05)}))  # slower than the middle of all
    portable_band(replace(made, envelope=slow), 0.8)
    assert asked[-3].peak_velocity == pytest.approx(0.05)
    monkeypatch.setattr(bands, "band", lambda *_: None)
    assert portable_band(replace(made, envelope=slow), 0.8) is None
    assert portable_band(replace(made, envelope=SimpleNamespace(tested=False))) is None


def test_an_interval_is_as_wide_as_its_level_says():
    for level in (0.5, 0.95):
        low, high = KNOWN.interval(damper(), "c", level)
        assert (low + high) / 2 == pytest.approx(2000)
        assert (high - low) / 2 == pytest.approx(stdtrit(12.0, (1 + level) / 2) * np.sqrt(90.0))
    low, high = replace(KNOWN, logs=(False, True), covariance=np.diag([90.0, 0.04])).interval(damper(), "fy")
    assert (low * high, high / low) == pytest.approx((1e4, np.exp(2 * 0.2 * stdtrit(5.0, 0.975))))
    with pytest.raises(InputError, match="fy is held by a bound"):
        replace(KNOWN, names=("c",), one_sided=("fy",)).interval(damper(), "fy")
    assert replace(KNOWN, unknown=("c",)).ends(damper(), "c") is None


def test_what_is_known_badly_is_told_number_by_number():
    def said(**more):
        return " ".join(uncertainty_warnings(damper(replace(KNOWN, **more))))

    assert "sessions" not in said()
    assert "fewer than two degrees of freedom" in said(session_dof=1.9)
    assert "degrees of freedom" not in said(session_dof=2.1)
    assert replace(KNOWN, session_dof=1.0).of_sessions
    assert "c, fy not identifiable from these runs." in said(unknown=("c", "fy"))
    assert said(unknown=("c", "fy"), words=("c and fy not identifiable",)).count("identifiable") == 1
    weak = said(covariance=np.diag([1001.0**2, 51.0**2]), dof=np.full(2, 1e9))
    assert "Not significant: c (2000 ± 2000 N s/m), fy (100 ± 100 N)." in weak
    turned = replace(damper(), model=replace(damper().model, f0=-25.0), free=("c", "f0"))
    sure = replace(KNOWN, names=("c", "f0"), covariance=np.diag([90.0, 12.0**2]))
    assert "f0" not in " ".join(uncertainty_warnings(replace(turned, uncertainty=sure)))
    assert "Fewer than three known sessions" in said(session_dof=0.0)
    errors = np.diag([1001.0**2, 49.0**2])
    assert "c is not significant (2000 ± 2200 N s/m)" in said(covariance=errors)
    assert "fy is not" not in said(covariance=errors)
    logs = np.diag([0.49**2, 0.7**2])
    factor = np.exp(2 * 0.7 * stdtrit(5.0, 0.975))
    assert f"95 % interval of fy spans a factor of {factor:.2g}" in said(covariance=logs, logs=(True, True))
    assert "interval of c spans" not in said(covariance=logs, logs=(True, True))
    assert "fy" not in said(covariance=np.diag([0.1, 3.1**2]), logs=(True, True)).replace("fy0", "")
    one = {"logs": (False,), "covariance": np.eye(1), "dof": np.ones(1)}
    assert "c ended at a limit of what was searched; its" in said(names=("fy",), one_sided=("c",), **one)
    assert "c, fy ended at a limit of what was searched; their" in said(names=("fy",), one_sided=("c", "fy"), **one)


SPREAD = RunScatter(0.03, 0.02, 0.01, 2.0)
DAY = [RecordingTime("a", 10.0), RecordingTime("a", 11.0), RecordingTime("b", 34.0), RecordingTime("a")]


def test_what_runs_share_falls_with_the_hours_between_them_within_a_session():
    assert SPREAD.total == pytest.approx(np.sqrt(9e-4 + 4e-4 + 1e-4))
    found = SPREAD.covariance(DAY, DAY[:3])
    near = 4e-4 * np.exp(-0.5)
    expected = [[13e-4, 9e-4 + near, 0], [9e-4 + near, 13e-4, 0], [0, 0, 13e-4], [9e-4, 9e-4, 0]]
    assert found == pytest.approx(np.array(expected))


def test_hours_are_counted_from_1970_where_a_clock_is_stated():
    def when(**notes):
        return RecordingTime.of(SimpleNamespace(id="r7", notes=notes))

    assert when(recorded_at="1970-01-02T02:30:00") == RecordingTime("1970-01-02", 26.5)
    assert when(recorded_at="1970-01-02", session="morning") == RecordingTime("morning", None)
    assert (when(), when(session="b")) == (RecordingTime(None), RecordingTime("b"))
    assert not SPREAD.covariance(
        [RecordingTime(None)], [RecordingTime(None), RecordingTime("a")]
    ).any()  # unknown is no session


def test_the_mean_given_others_is_that_of_the_joint_normal():
    values = np.array([0.05, 0.01, -0.2])
    mean, left = SPREAD.given(RecordingTime("a", 12.0), DAY[:3], values)
    both = [*DAY[:3], RecordingTime("a", 12.0)]
    K = SPREAD.covariance(both, both) + 1e-4 * np.eye(4)
    # A run has at least a fifth of the spread of its own: here a quarter of it, so 1e-4 it is.
    solved = np.linalg.solve(K[:3, :3], np.column_stack([values, K[:3, 3]]))
    assert mean == pytest.approx(K[3, :3] @ solved[:, 0])
    assert left == pytest.approx(np.sqrt(K[3, 3] - K[3, :3] @ solved[:, 1]))
    assert SPREAD.given(RecordingTime("a", 12.0), [], np.zeros(0)) == (0.0, SPREAD.total)
    assert RunScatter(0.0, 0.0, 0.0, 1.0).given(DAY[0], DAY, np.ones(4)) == (0.0, 0.0)
    firm = RunScatter(0.1, 0.0, 0.0, 1.0)  # no run of its own: a fifth of the spread is left all the same
    assert firm.given(RecordingTime("b"), [RecordingTime("b")] * 50, np.full(50, 0.1))[1] == pytest.approx(
        0.02, rel=0.02
    )


def test_gains_are_expected_of_other_runs_of_the_session_and_bands_follow():
    sessions = Sessions(SPREAD, RunScatter(4.0, 0.0, 3.0, 1.0), ("x", "y", "z"), tuple(DAY[:3]), (1.1, 1.2, 0.5),
                        (6.0, 8.0, 90.0))  # fmt: skip
    at = RecordingTime("a", 12.0)
    found = sessions.expected(at, without="y")
    gain = SPREAD.given(at, [DAY[0], DAY[2]], np.array([0.1, -0.5]))
    offset = sessions.offset.given(at, [DAY[0], DAY[2]], np.array([6.0, 90.0]))
    assert (found.gain, found.gain_spread) == pytest.approx((1 + gain[0], gain[1]))
    assert (found.offset, found.offset_spread) == pytest.approx(offset)
    assert sessions.expected(RecordingTime("c", 60.0)) is None
    assert sessions.expected(RecordingTime("b", 35.0), without="z") is None
    with pytest.raises(InputError, match="lists differ in length"):
        replace(sessions, gains=(1.0,))
    known = SessionCorrection(1.2, 0.01, 5.0, 2.0)
    assert PREDICTION.corrected(known.gain, known.offset).force == pytest.approx(1.2 * FORCE + 5)
    plain = band(damper(replace(KNOWN, gain=0.01, offset=2.0, run_gain=0.0, run_offset=0.0)), PREDICTION, 0.8)
    moved = session_band(known, damper(), PREDICTION, 0.8)
    assert moved.low == pytest.approx(1.2 * plain.low + 5)
    assert moved.high == pytest.approx(1.2 * plain.high + 5)
    assert moved.peak == pytest.approx(tuple(1.2 * end for end in plain.peak))
    assert moved.known_session == pytest.approx(tuple(1.2 * end for end in plain.known_session))
    assert moved.energy == plain.energy
    assert session_band(known, damper(None), PREDICTION, 0.8) is None


def test_a_damper_gives_the_prediction_interval_of_its_prediction():
    of_damper, by_function = damper().prediction_interval(PREDICTION, level=0.8), band(damper(), PREDICTION, 0.8)
    assert by_function is not None
    np.testing.assert_array_equal(of_damper.low, by_function.low)
    assert of_damper.peak == by_function.peak
