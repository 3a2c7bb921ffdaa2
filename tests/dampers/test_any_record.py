"""Dampers from any record: random motion, a switched current, rests, other sizes."""

from dataclasses import replace

import numpy as np
import pytest

from mrdamper.dampers.choice import identify_jointly
from mrdamper.dampers.coil import Coil
from mrdamper.data import Run
from mrdamper.models.play_bypass import PlayBypass
from mrdamper.motion import Path, random_motion
from mrdamper.motion.lag import leaking_load
from mrdamper.motion.measured import smooth, whole_clock
from mrdamper.simulation import simulate
from mrdamper.study.recipe import stretches
from mrdamper.validation import score_run

NOISE = 0.003  # of the peak-to-peak force


def damper(force=1.0, length=1.0, current=1.0, **changed):
    """A plausible damper of another size; 1 is about a kilonewton, 0.4 mm of lost motion, 1 A."""
    plain = PlayBypass(
        f0=50 * force, k=900 * force / length, c0=700 * force / length, c1=1500 * force / length / current,
        fy0=100 * force, fy1=1000 * force / current, d=2e-4 * length, e=2.5e-5 * length, cb=3.5e4 * force / length,
        h0=0.4, h1=0.3 / current, vh=3e-3 * length, T=5e-3, asymmetry=0.03, m=5.0 * force / length, Ic=0.12 * current,
    )  # fmt: skip
    return replace(plain, **changed)


def record(truth, name, seed, *, length=1.0, current=1.0, coil=None, split="train", switched=True):
    rng = np.random.default_rng(seed)
    motion = random_motion(rng, 24.0, 6e-3 * length, (0.3, 4.0), current, 250.0)
    amperes = np.full(len(motion), current)
    if switched:
        changes = np.cumsum(rng.uniform(0.2, 1.0, 200))
        amperes = (rng.uniform(0, 1, 200) * current)[np.searchsorted(changes, motion.time)]
    felt = motion.with_current(amperes if coil is None else coil.along(motion.time, amperes))
    force = simulate(truth, felt).force
    force = force + NOISE * np.ptp(force) * rng.standard_normal(force.size)
    return Run(name, motion.time, motion.displacement, force, amperes, excitation="random", split=split)


@pytest.fixture(scope="module")
def switched():
    coil = Coil(6e-3, 12e-3)
    runs = [record(damper(), f"r{seed}", seed, coil=coil) for seed in (1, 2)]
    return runs, identify_jointly([piece for run in runs for piece in stretches(run)])


def test_a_switched_current_shows_the_lags_of_the_coil(switched):
    _, choice = switched
    assert choice.fit.damper.coil.rise_s == pytest.approx(6e-3, rel=0.1)
    assert choice.fit.damper.coil.fall_s == pytest.approx(12e-3, rel=0.1)
    assert not choice.fit.at_bounds


def test_an_unseen_record_is_predicted_and_its_own_are_no_extrapolation(switched):
    runs, choice = switched
    unseen = record(damper(), "unseen", 3, coil=Coil(6e-3, 12e-3))
    assert score_run(choice.fit.damper, unseen).scores.nrmse_std < 0.04
    assert all(score_run(choice.fit.damper, run).extrapolation == () for run in runs)
    far = record(damper(), "far", 4, current=2.0)
    assert "current" in score_run(choice.fit.damper, far).extrapolation


@pytest.mark.slow
@pytest.mark.parametrize(("force", "length", "current"), [(0.02, 0.5, 0.3), (1.0, 4.0, 1.0), (100.0, 10.0, 5.0)])
def test_a_damper_of_another_size_needs_no_tuning(force, length, current):
    """20 N to 150 kN, 0.2 to 4 mm of lost motion: no parameter ends at a bound, and the error is near the noise."""
    truth = damper(force, length, current)
    runs = [record(truth, f"r{seed}", seed, length=length, current=current) for seed in (1, 2)]
    choice = identify_jointly([piece for run in runs for piece in stretches(run)])
    assert not choice.fit.at_bounds
    assert choice.left_out["condition"] < 2 * NOISE
    assert choice.fit.damper.model.fy1 == pytest.approx(truth.fy1, rel=0.1)


@pytest.mark.slow
def test_without_lost_motion_none_is_kept():
    truth = damper(e=1e-3, d=1e-3)
    choice = identify_jointly([p for seed in (1, 2) for p in stretches(record(truth, f"r{seed}", seed))])
    said = next(t for t in choice.tried if t.term.startswith("lost motion"))
    assert not said.kept
    assert choice.fit.damper.model.seat_share >= 1


def test_a_load_leaks_at_rest_and_comes_back_with_motion():
    time = np.arange(2001) / 1000.0
    x = np.interp(time, [0.0, 0.5, 1.5, 2.0], [0.0, 0.01, 0.01, 0.02])
    load = leaking_load(time, Path.of(x), 2e-5, 18.0)
    assert load[450] == pytest.approx(0.02 / 2e-5 / (0.02 / 2e-5 + 18), rel=1e-3)
    np.testing.assert_allclose(load[1500] / load[500], np.exp(-18.0), rtol=1e-6)
    assert load[1600] > 0.9
    np.testing.assert_array_equal(leaking_load(time, Path.of(x), 2e-5, 0.0), 1.0)


def test_a_clock_is_read_from_first_to_last():
    even = np.arange(6000) / 3004.8
    rounded = np.round(even, 4)
    assert 1 / np.median(np.diff(rounded)) > 3300  # what one stamp to the next would say
    assert (even.size - 1) / np.ptp(whole_clock(rounded)) == pytest.approx(3004.8, rel=1e-4)
    _, slope, _ = smooth(rounded, np.sin(2 * np.pi * even))
    np.testing.assert_allclose(slope[50:-50], 2 * np.pi * np.cos(2 * np.pi * even[50:-50]), atol=0.01)
    uneven = np.sort(np.random.default_rng(0).uniform(0, 1, 500))
    assert whole_clock(uneven) is uneven


def test_a_long_record_comes_in_stretches_and_a_sine_whole():
    run = record(damper(), "long", 1)
    parts = stretches(run)
    assert len(parts) > 1
    assert sum(int(part.in_window.sum()) for part in parts) == pytest.approx(run.time.size, abs=2 * len(parts))
    assert {part.notes["stretch of"] for part in parts} == {"long"}
