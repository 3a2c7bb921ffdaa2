"""The coil: two lags, exact along straight pieces, the same for arrays, streams, saved files and C."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from support.dampers import conditioned_damper, joint_damper, modified_damper

from mrdamper.dampers.coil import Coil, Driver, field_current
from mrdamper.dampers.model_file import dump_model, parse_model
from mrdamper.dampers.streaming import stepper
from mrdamper.data import Run
from mrdamper.errors import ModelFileError, ParameterError
from mrdamper.physics.motion import Path, random_motion
from mrdamper.physics.motion.lag import first_order_lag

KINDS = {"joint": joint_damper, "modified": modified_damper, "conditioned": conditioned_damper}
LAGS = st.floats(1e-4, 0.2)
CURRENTS = st.lists(st.floats(-2, 2), min_size=2, max_size=40)


def switched(seed=3, samples=1500):
    """Random motion under a current that is switched at random, both polarities."""
    rng = np.random.default_rng(seed)
    made = random_motion(rng, samples / 1000, 0.006, (0.3, 4.0), 0.0)
    levels = rng.uniform(-1, 1, samples // 50 + 1)
    motion = replace(made, current=levels[np.arange(made.time.size) // 50])
    motion.__dict__["path"] = Path.of(motion.displacement, peaks="samples")
    return motion


@given(CURRENTS, LAGS)
@settings(max_examples=60, deadline=None)
def test_equal_lags_are_the_linear_lag(current, lag):
    wanted, time = np.abs(current), 0.003 * np.arange(len(current))
    linear = wanted[0] + first_order_lag(time, wanted - wanted[0], lag)
    np.testing.assert_allclose(field_current(time, np.array(current), lag, lag), linear, atol=1e-12)


def test_the_field_solves_its_differential_equation():
    time = np.array([0.0, 0.01, 0.02, 0.05, 0.051, 0.08, 0.09])
    current = np.array([0.0, 1.0, 0.4, 0.45, 0.1, 0.9, 0.9])
    rise, fall = 0.006, 0.02

    def rate(t, i):
        gap = np.interp(t, time, current) - i
        return gap / np.where(gap > 0, rise, fall)

    pieces, held = [0.0], np.array([0.0])
    for a, b in itertools.pairwise(time):
        held = solve_ivp(rate, (a, b), held, rtol=1e-11, atol=1e-12, max_step=1e-4).y[:, -1]
        pieces.append(float(held[0]))
    np.testing.assert_allclose(field_current(time, current, rise, fall), pieces, atol=1e-8)


@given(CURRENTS, LAGS, LAGS, st.integers(2, 5))
@settings(max_examples=60, deadline=None)
def test_samples_between_change_nothing(current, rise, fall, parts):
    wanted, time = np.abs(current), 0.004 * np.arange(len(current))
    fine = np.linspace(0, time[-1], parts * (time.size - 1) + 1)
    finer = field_current(fine, np.interp(fine, time, wanted), rise, fall)[::parts]
    np.testing.assert_allclose(field_current(time, wanted, rise, fall), finer, atol=1e-9)


@given(CURRENTS, LAGS, LAGS)
@settings(max_examples=60, deadline=None)
def test_the_field_stays_between_the_currents_and_knows_no_sign(current, rise, fall):
    wanted, time = np.abs(current), 0.004 * np.arange(len(current))
    field = field_current(time, np.array(current), rise, fall)
    assert np.all(field >= wanted.min() - 1e-12)
    assert np.all(field <= wanted.max() + 1e-12)
    assert np.array_equal(field, field_current(time, -np.array(current), rise, fall))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("coil", [None, Coil(0.006, 0.012), Coil(0.0, 0.02), Coil(0.01, 0.0), Coil(0.0, 0.0)])
def test_streams_and_records_feel_the_same_field(kind, coil):
    motion, damper = switched(), replace(KINDS[kind](), coil=coil)
    stream = stepper(damper)
    steps = np.diff(motion.time, prepend=motion.time[0] - 1e-3)
    channels = (motion.displacement, motion.velocity, motion.acceleration, motion.current, steps)
    streamed = np.array([stream.step_motion(*row) for row in np.column_stack(channels).tolist()])
    assert np.array_equal(
        stream.stream.step.tape.memory.keys() >= {"current_gap"}, bool(coil and any((coil.rise_s, coil.fall_s)))
    )
    if kind == "joint":
        whole = damper.force_along(motion, damper.envelope.middle)
        assert np.max(np.abs(streamed - whole)) < 1e-9 * np.ptp(whole)
    mirrored = stepper(damper)
    turned = np.array([mirrored.step_motion(x, v, a, -i, dt) for x, v, a, i, dt in np.column_stack(channels).tolist()])
    assert np.array_equal(turned, streamed)


@pytest.mark.parametrize("kind", KINDS)
def test_a_damper_keeps_its_coil(kind):
    for coil in (None, Coil(0.006, 0.012), Coil(0.006, 0.012, Driver(0.4, 5.0, 0.12, 2.0)), Coil(0, 0, Driver(0.4))):
        damper = replace(KINDS[kind](), coil=coil)
        assert parse_model(dump_model(damper)).coil == coil


def test_a_saved_coil_that_is_none_is_refused():
    text = dump_model(replace(joint_damper(), coil=Coil(0.006, 0.012)))
    with pytest.raises(ModelFileError, match="rise_s"):
        parse_model(text.replace('"rise_s": 0.006', '"rise_s": -1.0'))


@pytest.mark.parametrize("bad", [(-1e-3, 0.0), (0.0, np.nan), (np.inf, 0.0), (0.0, 11.0)])
def test_a_lag_that_is_none_is_refused(bad):
    with pytest.raises(ParameterError):
        Coil(*bad)


@pytest.mark.parametrize("bad", [(0.0,), (np.nan,), (0.4, -1.0), (0.4, 0.0, 0.1), (0.4, 5.0, 0.1, 0.0)])
def test_a_driver_that_is_none_is_refused(bad):
    with pytest.raises(ParameterError):
        Driver(*bad)


def test_a_driver_lags_by_its_inductance_and_stops_at_its_limit():
    time = np.linspace(0, 1, 1001)
    volts = np.where(time < 0.2, 0.0, 10.0)
    current = Driver(0.4, 5.0, 0.12, 2.0).current(time, volts)
    np.testing.assert_allclose(current, 2.0 * (1 - np.exp(-np.maximum(time - 0.1995, 0) / 0.024)), atol=0.05)
    np.testing.assert_allclose(Driver(-0.4).current(time, volts), np.where(time < 0.2, 0.0, -4.0))


def test_a_lag_delays_the_force_of_a_run():
    motion = switched()
    run = Run("switched", motion.time, motion.displacement, motion.velocity, motion.current)
    damper = joint_damper()
    forces = [replace(damper, coil=Coil(lag, lag)).predict(run).force for lag in (0.0, 0.005, 0.05)]
    assert np.array_equal(forces[0], damper.predict(run).force)
    assert np.std(forces[1] - forces[0]) < np.std(forces[2] - forces[0])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("current", ["steady", "switched"])
def test_free_motion_is_predicted_as_it_is_streamed(kind, current):
    """One damper, one motion, one force: what follows the condition reads it off the motion so far, everywhere."""
    motion = switched()
    given = motion.current if current == "switched" else np.full(len(motion), -0.4)
    run = Run("road", motion.time, motion.displacement, motion.velocity, given)
    damper = replace(KINDS[kind](), coil=Coil(0.006, 0.012))
    prediction, stream = damper.predict(run), stepper(damper)
    seen = prediction.motion
    steps = np.diff(seen.time, prepend=2 * seen.time[0] - seen.time[1])
    rows = np.column_stack([seen.displacement, seen.velocity, seen.acceleration, seen.current, steps]).tolist()
    streamed = np.array([stream.step_motion(*row) for row in rows])
    # A record knows the peak between two samples at a reversal, a stream cannot; a joint damper follows the record.
    tolerance = 0.02 if kind == "joint" else 1e-12
    assert np.max(np.abs(streamed - prediction.force)) <= tolerance * np.ptp(streamed)
