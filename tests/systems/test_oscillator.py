"""A force-driven oscillator: its limits, the benchmark of the field, and what is refused."""

import numpy as np
import pytest
from scipy.signal import TransferFunction, lsim

from mrdamper.errors import ParameterError, RecordError, StepError
from mrdamper.systems.oscillator import BoundWarning, Oscillator, identify_oscillator, multisine

RATE = 750.0
BENCHMARK = Oscillator(m=2.0, c=10.0, k=5e4, alpha=5e4, beta=1e3, gamma=0.8, delta=-1.1)


def force(seed, size=1024, rms=50.0):
    return multisine(np.random.default_rng(seed), size, RATE, (5.0, 150.0), rms)


def test_without_hysteresis_it_is_the_linear_oscillator():
    time = np.arange(3000) / RATE
    push = 20 * np.sin(2 * np.pi * 7 * time) ** 3
    y = Oscillator(2.0, 40.0, 4e4, 2e4, 1.0, 0.0, 0.0).response(push, RATE)
    fine = np.linspace(0, time[-1], 20 * (time.size - 1) + 1)
    exact = lsim(TransferFunction([1], [2.0, 40.0, 6e4]), 20 * np.sin(2 * np.pi * 7 * fine) ** 3, fine)[1][::20]
    np.testing.assert_allclose(y, exact, atol=1e-4 * np.abs(exact).max())


def test_a_periodic_response_is_periodic_and_takes_energy():
    push = force(3)
    twice = BENCHMARK.response(np.tile(push, 2), RATE, periodic=True)
    np.testing.assert_allclose(twice[: push.size], twice[push.size :], atol=1e-5 * np.ptp(twice))
    velocity = np.gradient(twice, 1 / RATE)
    assert np.mean(np.tile(push, 2) * velocity) > 1.05 * 10 * np.mean(velocity**2)  # more than the dashpot's


def test_a_periodic_response_of_a_linear_oscillator_has_the_phase_of_its_transfer_function():
    push = force(4)
    omega = 2 * np.pi * np.fft.rfftfreq(push.size, 1 / RATE)
    exact = np.fft.irfft(np.fft.rfft(push) / (6e4 - 2.0 * omega**2 + 200j * omega), push.size)
    y = Oscillator(2.0, 200.0, 4e4, 2e4, 1.0, 0.0, 0.0).response(push, RATE, periodic=True)
    np.testing.assert_allclose(y, exact, atol=1e-4 * np.abs(exact).max())


@pytest.mark.parametrize("delay", [1.0, -0.4])
def test_a_delay_between_the_channels_is_identified_and_leaves_the_damping_alone(delay):
    push = force(1)
    clean = BENCHMARK.response(push, RATE, periodic=True)
    omega = 2 * np.pi * np.fft.rfftfreq(push.size)
    late = np.fft.irfft(np.fft.rfft(clean) * np.exp(-1j * omega * delay), push.size)
    fit = identify_oscillator(push, late, RATE)
    assert RATE * fit.delay_s == pytest.approx(delay, abs=1e-3)
    assert fit.oscillator.c == pytest.approx(10.0, rel=1e-2)
    assert fit.at_bounds == ()


def test_a_parameter_at_a_bound_is_named_and_warned_of():
    push = force(1, size=256)
    late = np.roll(BENCHMARK.response(push, RATE, periodic=True), 2)
    with pytest.warns(BoundWarning, match="delay"):
        fit = identify_oscillator(push, late, RATE, most_delay=1.0)
    assert "delay" in fit.at_bounds


def test_the_benchmark_is_identified_from_noisy_records_to_a_micrometre_and_better():
    rng = np.random.default_rng(0)
    push = force(1)
    clean = BENCHMARK.response(push, RATE, periodic=True)
    fit = identify_oscillator(push, clean + 1e-2 * np.std(clean) * rng.standard_normal(clean.size), RATE)
    unseen = force(2)
    missed = fit.oscillator.response(unseen, RATE, periodic=True) - BENCHMARK.response(unseen, RATE, periodic=True)
    assert np.sqrt(np.mean(missed**2)) < 1e-6
    found, truth = fit.oscillator, BENCHMARK
    assert (found.m, found.c) == pytest.approx((truth.m, truth.c), rel=0.02)
    products = found.beta * found.gamma, found.beta * found.delta
    assert products == pytest.approx((truth.beta * truth.gamma, truth.beta * truth.delta), rel=0.05)
    assert fit.rmse_m == pytest.approx(1e-2 * np.std(clean), rel=0.1)


def test_what_cannot_be_is_refused():
    with pytest.raises(ParameterError, match="a mass is positive"):
        Oscillator(0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    with pytest.raises(ParameterError, match="feeds energy in"):
        Oscillator(1.0, 1.0, 1.0, 1.0, 1.0, -1.0, 1.0)
    with pytest.raises(StepError, match="runs away") as caught:
        Oscillator(2.0, 0.0, 5e4, -9e4, 1e3, 0.0, 0.0).response(force(1), RATE)
    assert caught.value.code == "E_RUNAWAY"
    with pytest.raises(RecordError, match="nothing moves"):
        identify_oscillator(force(1), np.zeros(1024), RATE)
    with pytest.raises(RecordError, match="largest delay"):
        identify_oscillator(force(1), force(2), RATE, most_delay=-1.0)
    with pytest.raises(RecordError, match="not finite"):
        BENCHMARK.response(np.array([np.nan] * 20), RATE)
