"""The integrator keeps its tolerance, converges, stays stable where explicit methods do not, and refuses."""

import numpy as np
import pytest

from mrdamper.data import Condition
from mrdamper.errors import ExcitationError, ParameterError
from mrdamper.models import Scale
from mrdamper.models.spencer import Spencer
from mrdamper.physics.hysteresis import Shape, follow
from mrdamper.physics.integrator import integrate
from mrdamper.physics.motion import sine

MOTION = sine(Condition(0.0, 1.0, 0.01), 2, 200)
CHANNELS = (MOTION.time, MOTION.displacement, MOTION.velocity, MOTION.current)


def decay(x, v, current, state, p, out):
    out[0] = -p[0] * (state[0] - x)


def bouc_wen(x, v, current, state, p, out):
    zeta = state[0]
    out[0] = p[0] * (v - 0.5 * abs(v) * abs(zeta) * zeta - 0.5 * v * zeta * zeta)


def explosion(x, v, current, state, p, out):
    out[0] = p[0] * state[0] * state[0]


def lagged_spencer(x, v, current, state, p, out):
    # state: y, z, u; the current channel carries the voltage
    y, z, u = state[0], state[1], state[2]
    c0, c1, alpha = p[0] + p[1] * u, p[2] + p[3] * u, p[4] + p[5] * u
    dy = (alpha * z + c0 * v + p[6] * (x - y)) / (c0 + c1)
    r = v - dy
    out[0] = dy
    out[1] = p[9] * r - p[7] * abs(r) * z * abs(z) - p[8] * r * z * z
    out[2] = -p[10] * (u - current)


def exact_lag(rate, time):
    w = 2 * np.pi
    return (
        0.01
        * (rate * (rate * np.sin(w * time) - w * np.cos(w * time)) + rate * w * np.exp(-rate * time))
        / (rate**2 + w**2)
    )


@pytest.mark.parametrize("rate", [0.1, 10.0, 1e3, 1e6])
def test_a_lag_is_followed_at_any_stiffness(rate):
    """One step of forward Euler or RK4 at 1e6 1/s and 200 samples a second would overflow."""
    found = integrate(decay, np.array([rate]), CHANNELS, np.zeros(1), np.array([0.01]))[:, 0]
    np.testing.assert_allclose(found, exact_lag(rate, MOTION.time), atol=2e-7)


def test_halving_the_tolerance_shrinks_the_error():
    errors = []
    for tolerance in (1e-3, 1e-5, 1e-7):
        found = integrate(decay, np.array([300.0]), CHANNELS, np.zeros(1), np.array([0.01]), tolerance=tolerance)
        errors.append(np.abs(found[:, 0] - exact_lag(300.0, MOTION.time)).max())
    assert errors[1] < 0.2 * errors[0]
    assert errors[2] < 0.2 * errors[1]


@pytest.mark.parametrize("kappa", [10.0, 1e3, 1e5])
def test_the_integrator_agrees_with_the_exact_hysteresis(kappa):
    """The knee is up to a hundred times shorter than a sample's displacement."""
    exact = follow(Shape(kappa, 0.0, 2.0), MOTION.path)
    found = integrate(bouc_wen, np.array([kappa]), CHANNELS, np.zeros(1), np.ones(1))[:, 0]
    away = np.abs(MOTION.velocity) > 2e-3
    np.testing.assert_allclose(found[away], exact[away], atol=3e-5)


def test_what_runs_away_is_refused():
    with pytest.raises(ParameterError, match=r"(runs away|more than 20 000 steps) between samples"):
        integrate(explosion, np.array([1e3]), CHANNELS, np.ones(1), np.ones(1))


def test_not_a_number_is_refused():
    with pytest.raises(ParameterError):
        integrate(decay, np.array([np.nan]), CHANNELS, np.zeros(1), np.ones(1))


def test_time_must_increase():
    with pytest.raises(ExcitationError, match="time does not increase"):
        integrate(decay, np.ones(1), (MOTION.time[::-1], *CHANNELS[1:]), np.zeros(1), np.ones(1))


def test_a_voltage_lag_as_a_third_state_matches_the_vectors(vectors):
    """Spencer's u' = −eta (u − V): three states, parameters that change on the way."""
    group = vectors["V10_spencer"]
    for case in (c for c in group["cases"] if c["u0"] != c["V"]):
        s = group["params"][case["set"]]
        names = ("c0a", "c0b", "c1a", "c1b", "aa", "ab", "k0", "gamma", "beta", "A", "eta")
        p = np.array([s[name] for name in names])
        motion = sine(Condition(0.0, case["f"], case["X"]), 2, 2000)
        channels = (motion.time, motion.displacement, motion.velocity, np.full(len(motion), case["V"]))
        states = integrate(lagged_spencer, p, channels, np.array([0.0, 0.0, case["u0"]]), np.array([1e-3, 1e-3, 1.0]))
        index = np.round(np.array(case["t"]) * case["f"] * 2000).astype(int)
        y, z, u = states[index].T
        np.testing.assert_allclose(u, case["u"], atol=1e-5)
        np.testing.assert_allclose(y, case["y"], atol=2e-6 * np.abs(case["y"]).max())
        away = np.abs(np.array(case["t"]) * case["f"] * 2 % 1 - 0.5) > 0.05
        np.testing.assert_allclose(z[away], np.array(case["z"])[away], atol=1e-5 * np.abs(case["z"]).max())


def test_step_halving_at_the_search_bounds():
    """At every corner of the box a search may reach: the same force from half the sampling interval."""
    axes = Spencer.search_axes(
        Scale.of(MOTION, np.zeros(len(MOTION)), 0.01), ("c0_ratio", "k0_rate", "creep", "yield_displacement")
    )
    fine = sine(Condition(0.0, 1.0, 0.01), 1, 400)
    coarse = fine.part(slice(None, None, 2))
    corners = np.array(np.meshgrid(*[(axis.lower, axis.upper) for axis in axes])).reshape(len(axes), -1).T
    for corner in corners:
        values = dict(zip([axis.name for axis in axes], corner.tolist(), strict=True))
        model = Spencer.build({**values, "c1": 1e4})
        a, b = (model.force(motion, model.state(motion)) for motion in (coarse, fine))
        assert np.abs(a - b[::2]).max() < 1e-3 * np.abs(b).max(), values


def test_the_interpreter_gives_the_same_states_as_compiled_code(monkeypatch):
    short = tuple(channel[:60] for channel in CHANNELS)
    p = np.array([300.0])
    monkeypatch.setattr("mrdamper.tracing.compiled.record._MIN_COMPILED_LINES", 0)
    compiled = integrate(bouc_wen, p, short, np.zeros(1), np.ones(1))
    monkeypatch.setenv("MRDAMPER_COMPILER", "none")
    interpreted = integrate(lambda *given: bouc_wen(*given), p, short, np.zeros(1), np.ones(1))
    np.testing.assert_array_equal(interpreted, compiled)
