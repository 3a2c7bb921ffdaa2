"""Dampers from any record: random motion, a switched current, rests, other sizes."""

import sys
from dataclasses import replace
from pathlib import Path as Folder

import numpy as np
import pytest

sys.path.insert(0, str(Folder(__file__).parents[2]))

from benchmarks.virtual_dampers import DAMPERS, identified
from mrdamper.dampers.run_residuals import RunResiduals
from mrdamper.dampers.run_rows import RunRows, envelope_of
from mrdamper.data import Run
from mrdamper.physics.motion import Path
from mrdamper.physics.motion.lag import leaking_load
from mrdamper.physics.motion.measured import smooth, whole_clock
from mrdamper.study.cross_validation import stretches
from mrdamper.study.validation import score_run

BY_NAME = {virtual.name: virtual for virtual in DAMPERS}


@pytest.fixture(scope="module")
def switched():
    virtual = BY_NAME["switched current"]
    return virtual, identified(virtual)


def test_a_switched_current_shows_the_lags_of_the_coil(switched):
    virtual, made = switched
    coil = made.choice.fit.damper.coil
    assert (coil.rise_s, coil.fall_s) == pytest.approx((virtual.coil.rise_s, virtual.coil.fall_s), rel=0.05)
    assert not made.choice.fit.at_bounds


def test_an_unseen_record_is_predicted_to_the_noise_and_its_own_are_no_extrapolation(switched):
    virtual, made = switched
    damper = made.choice.fit.damper
    assert made.unseen < 1.3 * virtual.noise
    assert all(score_run(damper, run).extrapolation == () for run in virtual.runs())
    far = replace(virtual, current=2 * virtual.current).unseen()
    assert "current" in score_run(damper, far).extrapolation


def test_a_record_that_is_no_sine_has_no_frequency_though_its_damper_was_identified_from_such(switched):
    virtual, made = switched
    damper, run = made.choice.fit.damper, virtual.runs()[0]
    assert damper.envelope.any_motion
    residuals = RunResiduals.of(damper, run)
    assert not damper.predict(run).is_sine
    assert residuals.stretches[0].frequency is None
    assert np.ptp(residuals.stretches[0].time) > 0.9 * np.ptp(run.time)


def test_parameters_of_another_kind_of_damper_are_found_without_tuning():
    """200 kN, 4 mm of lost motion, rebound half as much again as compression; random motion only."""
    virtual = BY_NAME["200 kN, random, rebound 1.5"]
    made = identified(virtual)
    found, truth = made.choice.fit.damper.model.values(), virtual.truth.values()
    for name in ("fy1", "d", "e", "cb", "asymmetry", "cq", "Ic", "si"):
        assert found[name] == pytest.approx(truth[name], rel=0.12), name
    assert not made.astray


@pytest.mark.slow
@pytest.mark.parametrize("virtual", DAMPERS, ids=[virtual.name for virtual in DAMPERS])
def test_every_made_damper_is_predicted_to_thrice_its_noise(virtual):
    made = identified(virtual)
    assert not made.astray
    assert made.left_out < 3 * virtual.noise
    if virtual.tests in ("random", "switched"):
        assert made.unseen < 2 * virtual.noise
    if not virtual.lost:
        assert made.choice.fit.damper.model.seat_share >= 1


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
    run = BY_NAME["switched current"].runs()[0]
    parts = stretches(run)
    assert len(parts) > 1
    assert sum(int(part.in_window.sum()) for part in parts) == pytest.approx(run.time.size, abs=2 * len(parts))
    assert {part.notes["stretch of"] for part in parts} == {run.id}


@pytest.mark.parametrize("motion", ["sine", "chirp"])
def test_a_switched_current_makes_no_sine_another_motion(motion):
    time = np.arange(4000) / 500
    x = 0.01 * np.sin(2 * np.pi * time * (1 if motion == "sine" else 1 + time / 8))
    current = np.where(time % 1.0 < 0.5, 0.2, 1.0)
    run = Run("r", time, x, (100 + 400 * current) * np.tanh(np.gradient(x, time) / 0.01), current)
    envelope = envelope_of([RunRows.of(run)])
    assert (envelope.any_motion, envelope.any_record) == (motion == "chirp", True)
    assert envelope.current_A == pytest.approx((0.2, 1.0))
