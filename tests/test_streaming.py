"""Streams: one sample after the other gives what the whole record gives."""

import math

import numpy as np
import pytest
from support.dampers import all_bare_models, all_dampers, joint_damper, modified_damper

from mrdamper.dampers.streaming import stepper
from mrdamper.data import Condition
from mrdamper.errors import ExcitationError, ParameterError, UnknownNameError
from mrdamper.models import model_type
from mrdamper.physics.motion import Excitation, Path, random_motion, sine
from mrdamper.physics.simulation import simulate

MODELS = all_bare_models()
DAMPERS = all_dampers()


def wander(current=0.4, samples=1200):
    """Random motion whose reversals are cut at the samples, as a stream must: it cannot see the peak between them."""
    made = random_motion(np.random.default_rng(7), samples / 1000, 0.006, (0.3, 4.0), current)
    varying = np.clip(current + 0.3 * np.sin(3 * made.time), 0, 1)
    motion = Excitation(made.time, made.displacement, made.velocity, made.acceleration, varying)
    motion.__dict__["path"] = Path.of(motion.displacement, peaks="samples")
    return motion


def channels(motion):
    return motion.time, motion.displacement, motion.velocity, motion.acceleration, motion.current


def stepped(stream, motion, part=slice(None)):
    steps = np.diff(motion.time, prepend=motion.time[0] - 1e-3)
    rows = np.column_stack([*channels(motion)[1:], steps])[part]
    return np.array([stream.step_motion(*row) for row in rows.tolist()])


@pytest.mark.parametrize("name", MODELS)
def test_a_stream_equals_the_record(name):
    motion = wander()
    whole = simulate(MODELS[name], motion).force
    streamed = stepped(stepper(MODELS[name]), motion)
    # Closed forms agree to rounding, gathered over a thousand samples; integrated states to the
    # share of their tolerance (1e-5 a step) that rounding can move; Taylor tables to 1e-11.
    tolerance = 1e-7 if MODELS[name].integrated else 1e-10
    assert np.max(np.abs(streamed - whole)) < tolerance * np.ptp(whole)


@pytest.mark.parametrize("name", DAMPERS)
def test_state_restores_the_future_and_reset_the_past(name):
    stream, motion = stepper(DAMPERS[name]), wander()
    first = stepped(stream, motion, slice(0, 60))
    kept = stream.state
    second = stepped(stream, motion, slice(60, 120))
    stream.state = kept
    assert np.array_equal(stepped(stream, motion, slice(60, 120)), second)
    stream.reset()
    assert np.array_equal(stepped(stream, motion, slice(0, 60)), first)


@pytest.mark.parametrize("name", ["bouc-wen", "bouc-wen, n = 1.6", "play-bypass", "spencer", "modified"])
def test_compiled_equals_interpreted_however_it_is_cut(name, monkeypatch):
    motion, interpreted, compiled = wander(), stepper(DAMPERS[name]), stepper(DAMPERS[name])
    monkeypatch.setattr("mrdamper.tracing.compiled.record._MIN_COMPILED_LINES", 0)
    force = stepped(interpreted, motion)
    assert np.array_equal(compiled.run(*channels(motion)), force)
    assert compiled.state.keys() == interpreted.state.keys()
    compiled.reset()
    # The first time step of the second part is taken from its own samples: the same, up to rounding.
    parts = [compiled.run(*(c[part] for c in channels(motion))) for part in (slice(500), slice(500, None))]
    assert np.max(np.abs(np.concatenate(parts) - force)) < 1e-9 * np.ptp(force)


def test_without_a_compiler_a_run_is_stepped_and_gives_the_same_forces(monkeypatch):
    motion, stream = wander(), stepper(joint_damper())
    monkeypatch.setenv("MRDAMPER_COMPILER", "none")
    monkeypatch.setattr("mrdamper.tracing.compiled.record._MIN_COMPILED_LINES", 0)
    assert np.array_equal(stream.run(*channels(motion)), stepped(stepper(joint_damper()), motion))
    assert stream.state["started"] == 1.0


def test_from_displacement_and_from_velocity_come_near_the_known_motion():
    motion = sine(Condition(0.5, 1.0, 0.01), 3, 2000)
    dt = float(motion.time[1])
    known = stepped(stepper(joint_damper()), motion)[2000:]
    by_x = stepper(joint_damper())
    from_x = np.array([by_x.step(x, 0.5, dt) for x in motion.displacement.tolist()])[2000:]
    by_v = stepper(joint_damper())
    from_v = np.array([by_v.step_velocity(v, 0.5, dt) for v in motion.velocity.tolist()])[2000:]
    # A backward difference lags by half a sample: 2π f dt/2 of the viscous force, and the steep
    # flanks shift by as much. Measured 0.6 %.
    assert np.max(np.abs(from_x - known)) < 0.01 * np.ptp(known)
    assert np.max(np.abs(from_v - known)) < 0.01 * np.ptp(known)


def test_parameters_may_change_between_samples():
    stream = stepper(MODELS["bouc-wen"])
    stream.step(0.0, 0.0, 1e-3)
    before = stream.step(1e-3, 0.0, 1e-3)
    kept = stream.state
    stream.set_parameters(c=2 * stream.parameters["c"])
    after = stream.step(2e-3, 0.0, 1e-3)
    stream.set_parameters(c=stream.parameters["c"] / 2)
    stream.state = kept
    assert after - stream.step(2e-3, 0.0, 1e-3) == pytest.approx(1440.0, rel=1e-9)  # c times 1 m/s
    assert math.isfinite(before)


def test_refused_parameters_leave_the_old_ones():
    stream = stepper(MODELS["bouc-wen"])
    kept = stream.parameters
    for bad in ({"c": -1.0}, {"c": math.nan}, {"n": 3.0}, {"beta": -1e9}):
        with pytest.raises(ParameterError):
            stream.set_parameters(**bad)
        assert stream.parameters == kept
    with pytest.raises(UnknownNameError, match="alpha"):
        stream.set_parameters(alfa=1.0)


@pytest.mark.parametrize("bad", [(math.nan, 0.0, 1e-3), (0.0, math.inf, 1e-3), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)])
@pytest.mark.parametrize("name", ["bouc-wen", "joint", "modified", "spencer"])
def test_a_bad_sample_is_refused_and_leaves_the_state(name, bad):
    stream = stepper(DAMPERS[name])
    stream.step(0.001, 0.5, 1e-3)
    kept = stream.state
    with pytest.raises(ExcitationError):
        stream.step(*bad)
    assert stream.state == kept


def test_a_state_of_other_names_is_refused():
    with pytest.raises(ParameterError):
        stepper(MODELS["bouc-wen"]).state = {"zeta": 0.0}


def test_extrapolation_is_flagged_while_it_lasts():
    stream = stepper(joint_damper())
    stream.step_motion(0.0, 0.0, 0.0, 0.5, 1e-3)
    assert stream.extrapolation == ()
    stream.step_motion(0.03, 0.4, 0.0, 1.5, 1e-3)
    assert stream.extrapolation == ("current", "amplitude", "velocity")
    stream.step_motion(0.0, 0.0, 0.0, 0.5, 1e-3)
    assert stream.extrapolation == ()


def test_the_modified_model_finds_frequency_and_amplitude_by_itself():
    damper, condition = modified_damper(), Condition(0.6, 1.5, 0.012)
    motion = sine(condition, 12, 500)
    force = stepper(damper).run(*channels(motion))[-501:]
    loop = damper.predict(condition).force
    at_loop = np.interp(motion.time[:501], np.linspace(0, motion.time[500], loop.size), loop)
    # The two lags leave a ripple of (1/2ωτ)² of the mean squares; measured 0.02 %.
    assert np.max(np.abs(force - at_loop)) < 1e-3 * np.ptp(loop)


def test_the_modified_model_says_when_the_frequency_was_not_tested():
    stream = stepper(modified_damper())
    motion = sine(Condition(0.6, 8.0, 0.004), 20, 200)
    stream.run(*channels(motion))
    assert "frequency" in stream.extrapolation


def test_a_damper_without_a_form_for_one_sample_says_so():
    from mrdamper.dampers.kernel import KernelDamper, KernelLaw

    law = KernelLaw(np.zeros((1, 4)), np.ones(1), np.ones(4), 0.0, 1.0)
    damper = KernelDamper(law, rig="bench", envelope=joint_damper().envelope)
    with pytest.raises(ParameterError, match="one sample"):
        stepper(damper)


def test_the_source_is_python_that_can_be_read():
    source = stepper(model_type("bingham")(c=1.0, fy=2.0)).source
    assert "c * velocity" in source
    assert "fy * sign(velocity)" in source


def test_a_record_names_the_time_without_a_force():
    motion = wander()
    velocity = motion.velocity.copy()
    velocity[700] = 1e306  # times the viscous damping of a thousand it is no number
    stream = stepper(model_type("bingham")(c=1000.0, fy=300.0))
    with pytest.raises(ExcitationError, match=f"no force at {motion.time[700]:g} s"):
        stream.run(motion.time, motion.displacement, velocity, motion.acceleration, motion.current)
