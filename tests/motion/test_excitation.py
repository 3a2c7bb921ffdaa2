import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrdamper.data import Condition, Run
from mrdamper.errors import ExcitationError
from mrdamper.physics.motion import (
    analyse_motion,
    equivalent_sine,
    measured,
    measured_motion,
    random_motion,
    sine,
    smooth,
    sweep,
    triangle,
)
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.harmonics import fit_harmonics
from mrdamper.physics.motion.sines import extreme_strokes


def record(frequency, amplitude, cycles, per_cycle, phase=0.3, offset=0.0, drift=0.0, noise=0.0):
    t = np.arange(int(cycles * per_cycle)) / (per_cycle * frequency)
    x = offset + drift * t + amplitude * np.sin(2 * np.pi * frequency * t + phase)
    return Run("r", t, x + noise * np.random.default_rng(0).standard_normal(t.size), np.ones(t.size), 0.0)


@settings(max_examples=40, deadline=None)
@given(
    frequency=st.floats(0.1, 20),
    amplitude=st.floats(1e-3, 0.1),
    cycles=st.floats(1.3, 12),
    per_cycle=st.integers(60, 400),
    phase=st.floats(-3, 3),
)
def test_sine_is_measured_whatever_the_record_length(frequency, amplitude, cycles, per_cycle, phase):
    found = analyse_motion(record(frequency, amplitude, cycles, per_cycle, phase, offset=-0.03, drift=1e-4))
    assert found.condition.frequency_Hz == pytest.approx(frequency, rel=1e-6)
    assert found.condition.amplitude_m == pytest.approx(amplitude, rel=1e-5)
    assert found.distortion < 1e-4
    assert found.is_sine


def test_series_differentiates_itself():
    run = record(1.3, 0.02, 5, 100)
    series = fit_harmonics(run.time, run.displacement, 3, frequency=1.3)
    step = 1e-5
    slope = (series(run.time + step) - series(run.time - step)) / (2 * step)
    np.testing.assert_allclose(series(run.time, 1), slope, atol=1e-8)


def test_velocity_and_acceleration_keep_phase_and_size():
    run = record(2.0, 0.01, 4, 500)
    motion, omega = measured_motion(run), 4 * np.pi
    inner = slice(20, -20)
    velocity = 0.01 * omega * np.cos(omega * run.time + 0.3)
    # A quadratic over a fortieth of the period loses 1/1600 of a sine's slope at most.
    np.testing.assert_allclose(motion.velocity[inner], velocity[inner], atol=1e-3 * 0.01 * omega)
    np.testing.assert_allclose(
        motion.acceleration[inner], -(omega**2) * (run.displacement)[inner], atol=3e-3 * 0.01 * omega**2
    )


def test_smoothing_returns_quadratics_exactly_even_on_uneven_samples():
    t = np.sort(np.random.default_rng(2).uniform(0, 1, 80))
    value, slope, curvature = smooth(t, 3 + 2 * t - 5 * t**2, span=0.2)
    np.testing.assert_allclose(value, 3 + 2 * t - 5 * t**2, atol=1e-9)
    np.testing.assert_allclose(slope, 2 - 10 * t, atol=1e-7)
    np.testing.assert_allclose(curvature, -10, atol=1e-5)


def test_a_slope_made_of_rounding_is_zero():
    """Its sign would be the machine's, and friction takes the sign of the velocity."""
    t, half = np.arange(2400), 5
    noise = np.random.default_rng(1).standard_normal(t.size)
    counts = np.round(40 * np.sin(2 * np.pi * t / 201.3) + noise)  # a channel of 0.1 mm
    exact = np.convolve(counts, np.arange(half, -half - 1, -1), "valid")  # in whole numbers
    assert np.count_nonzero(exact == 0) >= 3
    _, slope, _ = smooth(1e-3 * t, 1e-4 * counts, span=2 * half * 1e-3)
    np.testing.assert_array_equal(np.sign(slope[half:-half]), np.sign(exact))


def test_no_derivative_reaches_across_a_gap():
    t = np.concatenate([np.linspace(0, 1, 50), np.linspace(5, 6, 50)])
    x = np.concatenate([np.zeros(50), np.full(50, 0.01)])
    x[0] = 1e-6
    motion = measured_motion(Run("gap", t, x, np.zeros(100), 0.0, segments=((0, 50), (50, 100))))
    assert np.abs(motion.velocity[40:60]).max() < 1e-6


def test_distorted_motion_is_no_sine():
    t = np.linspace(0, 4, 2000)
    x = np.sin(2 * np.pi * t) + 0.1 * np.sin(6 * np.pi * t)
    found = analyse_motion(Run("flat", t, 0.01 * x, np.zeros(t.size), 0.0))
    assert found.distortion == pytest.approx(0.1, rel=1e-3)
    assert not found.is_sine


def test_half_a_cycle_and_no_motion_are_refused():
    with pytest.raises(ExcitationError, match="one full cycle"):
        analyse_motion(record(1.0, 0.01, 0.6, 200))
    still = Run("still", np.linspace(0, 1, 50), np.zeros(50), np.zeros(50), 0.0)
    with pytest.raises(ExcitationError, match="does not move"):
        analyse_motion(still)


def test_a_sweep_amounts_to_a_sine_of_the_same_speed():
    made = sweep(1.0, 5.0, 10.0, 0.002)
    run = Run("sweep", made.time, made.displacement, np.zeros(len(made)), 0.0, excitation="chirp")
    found = equivalent_sine(run)
    assert not found.is_sine
    speed = 2 * np.pi * found.condition.frequency_Hz * found.condition.amplitude_m
    assert speed == pytest.approx(np.sqrt(2) * np.std(made.velocity), rel=0.02)


@pytest.mark.parametrize(("share", "is_sine"), [(0.05, True), (0.25, False)])
def test_a_second_tone_at_a_multiple_of_the_frequency_makes_no_sine(share, is_sine):
    slow, fast = sine(Condition(0.0, 0.5, 0.012), 4, 2000), sine(Condition(0.0, 2.5, 0.012 * share), 20, 400)
    found = equivalent_sine(Run("two", slow.time, slow.displacement + fast.displacement, np.zeros(len(slow)), 0.0))
    assert found.is_sine == is_sine
    made = triangle(Condition(0.0, 0.5, 0.012), 4)
    assert equivalent_sine(Run("tri", made.time, made.displacement, np.zeros(len(made)), 0.0)).is_sine


@pytest.mark.parametrize("made", [sine, triangle])
def test_made_motions_stay_within_their_amplitude_and_close(made):
    motion = made(Condition(0.5, 2.0, 0.01), 2)
    assert np.abs(motion.displacement).max() == pytest.approx(0.01, rel=1e-5)
    assert motion.displacement[-1] == pytest.approx(motion.displacement[0], abs=1e-12)
    assert motion.time[-1] == pytest.approx(1.0)


def test_random_motion_is_reproducible_and_has_its_rms():
    a = random_motion(np.random.default_rng(3), 10, 0.005)
    b = random_motion(np.random.default_rng(3), 10, 0.005)
    np.testing.assert_array_equal(a.displacement, b.displacement)
    assert np.std(a.displacement) == pytest.approx(0.005)
    with pytest.raises(ExcitationError, match="widen the band"):
        random_motion(np.random.default_rng(3), 1, 0.005, band_Hz=(0.1, 0.2))


def test_impossible_motion_is_refused():
    with pytest.raises(ExcitationError, match="amplitude_m is 0"):
        sine(Condition(0.0, 1.0, 0.0))


def test_a_ramp_is_no_sine():
    time = np.linspace(0, 1, 200)
    assert not equivalent_sine(Run("ramp", time, 0.01 * time, time, 0.0)).is_sine


def test_bundled_sines_are_measured_as_their_authors_measured_them(bundled):
    for run in bundled:
        if "measured_frequency_Hz" not in run.notes:
            continue
        found = analyse_motion(run).condition
        # The authors' figures: 0.1 % in frequency; amplitude to 3 %, because position drifts.
        assert found.frequency_Hz == pytest.approx(float(run.notes["measured_frequency_Hz"]), rel=2e-3)
        assert found.amplitude_m == pytest.approx(float(run.notes["measured_amplitude_m"]), rel=0.03)


@pytest.mark.parametrize("cycles", [20, 2000])
@pytest.mark.parametrize("noise", [0.0, 5e-5])
def test_the_velocity_of_a_record_of_any_length_is_that_of_the_motion(cycles, noise):
    time = np.arange(cycles * 100) / 200
    rng = np.random.default_rng(3)
    slope = smooth(time, 0.01 * np.sin(4 * np.pi * time) + rng.normal(0, noise, time.size))[1]
    error = slope - 0.04 * np.pi * np.cos(4 * np.pi * time)
    assert np.sqrt(np.mean(error**2)) < (0.06 if noise else 3e-3) * 0.04 * np.pi


@pytest.mark.parametrize("uneven", [0.0, 1e-4])
def test_windows_taken_in_blocks_are_the_windows_of_all(monkeypatch, uneven):
    time = np.linspace(0, 2, 900) + uneven * np.sin(np.arange(900))
    signal = np.sin(7 * time) + 0.01 * np.cos(300 * time)
    whole = smooth(time, signal)
    monkeypatch.setattr(measured, "_CELLS", 1000)
    for one, other in zip(smooth(time, signal), whole, strict=True):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9)


def test_the_extreme_strokes_of_a_record_are_half_cycles_of_its_motions_and_its_noise_is_none():
    pieces = [sine(Condition(0.5, f, A), 3, int(400 / f)) for f, A in ((1.0, 0.02), (2.0, 0.005), (8.0, 0.001))]
    x = np.concatenate([piece.displacement for piece in pieces])
    t = np.arange(x.size) / 400
    x += 1e-6 * np.random.default_rng(1).standard_normal(x.size)
    v = np.gradient(x, t)
    strokes = extreme_strokes(Excitation(t, x, v, np.gradient(v, t), np.full(t.size, 0.5)))
    assert min(s.frequency_Hz for s in strokes) == pytest.approx(1.0, rel=0.05)
    assert max(s.frequency_Hz for s in strokes) == pytest.approx(8.0, rel=0.05)
    assert max(s.amplitude_m for s in strokes) == pytest.approx(0.02, rel=0.01)
    assert min(s.amplitude_m for s in strokes) == pytest.approx(0.001, rel=0.05)
    assert [s.current_A for s in strokes] == pytest.approx([0.5] * len(strokes))
    assert extreme_strokes(Excitation(t[:9], t[:9], t[:9], t[:9], t[:9])) == []
