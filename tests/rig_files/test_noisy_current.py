"""A measured coil current: constant whatever its noise, and the same to everybody who asks."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from support.noise import CHANGES, KINDS, changing_current, constant_current
from support.rig_records import clean_record, codes_of

from mrdamper import identify
from mrdamper.data import Run, held_current
from mrdamper.errors import RunError
from mrdamper.physics.motion import measured_motion
from mrdamper.rig_files.quality.sentinel import COARSEST, code_in
from mrdamper.rig_files.quality.table import to_run

COUNT = 300  # `benchmarks/import_detection.py` takes more


def channel(seed, make, **known):
    rng = np.random.default_rng([21, seed])
    rate = rng.choice([100, 200, 1000])
    time = np.arange(int(rng.uniform(1, 8) * rate)) / rate
    return Run("a", time, np.zeros(time.size), np.zeros(time.size), make(rng, time, **known))


@pytest.mark.parametrize("kind", KINDS)
def test_noise_of_any_kind_leaves_a_current_constant(kind):
    """At most one in a hundred is taken for a change: slow wandering of 20 mA is on the border."""
    runs = [channel(seed, constant_current, kind=kind) for seed in range(COUNT // 3)]
    assert sum(run.current_changes for run in runs) <= len(runs) // 100


@pytest.mark.parametrize("kind", CHANGES)
def test_a_current_that_changes_by_a_tenth_of_an_ampere_is_no_constant(kind):
    runs = [channel(seed, changing_current, kind=kind) for seed in range(COUNT // 3)]
    assert sum(not run.current_changes for run in runs) <= len(runs) // 100


@pytest.mark.parametrize(("level", "constant"), [(0.3, True), (0.8, True), (0.1, False)])
def test_a_ripple_from_sample_to_sample_is_averaged_where_the_current_keeps_its_sign(level, constant):
    time = np.arange(7000) / 1000
    ripple = 0.15 * np.sign(np.sin(2 * np.pi * 187.3 * time))
    mean, change = held_current(level + ripple)
    assert (not change) == constant
    assert mean == pytest.approx(level, abs=2e-3)


@pytest.mark.parametrize("level", [-0.3, 0.0, 0.4])
def test_the_current_is_the_mean_over_the_steady_window(level):
    run = channel(3, constant_current, level=level, noise=0.02, kind="white")
    on = run.time >= 0.5
    ramped = replace(run, current=np.where(on, run.current, 0.0), window=(0.5, float(run.time[-1])))
    assert not ramped.current_changes
    assert ramped.current_A == pytest.approx(np.mean(run.current[on]), abs=1e-4)
    assert np.ptp(measured_motion(ramped).current) == 0


def test_a_changing_current_is_refused_with_that_reason_and_handed_on_as_it_is():
    run = channel(4, changing_current, kind="step")
    with pytest.raises(RunError, match="changes within the run") as caught:
        _ = run.current_A
    assert caught.value.code == "E_CURRENT_VARIES"
    np.testing.assert_array_equal(run.coil_current, run.current)


def test_noise_is_no_missing_value_code():
    """No alarm in hundreds of clean channels of every kind; the goal is one in a thousand."""
    record = clean_record(3, cycles=4, points=200)
    noticed = Counter()
    for seed in range(COUNT):
        rng = np.random.default_rng([22, seed])
        current = (constant_current if seed % 2 else changing_current)(rng, record.time)
        assert code_in(current, COARSEST["current"]) is None
        if seed % 15 == 0:  # the other checks take a hundred times as long
            noticed.update(codes_of(replace(record, current=current)))
    assert set(noticed) <= {"W_CURRENT_VARIES"}


@pytest.mark.parametrize("code", [-9999.0, -999.25, -0.999, 9.91e37, 65535.0])
def test_codes_in_a_noisy_current_are_found(code):
    record = clean_record(3, cycles=4, points=200)
    for seed in range(20):
        current = constant_current(np.random.default_rng([23, seed]), record.time).copy()
        current[[30, 411]] = code
        assert codes_of(replace(record, current=current)) == ["E_SENTINEL"]


def test_a_noisy_current_identifies_as_a_clean_one():
    clean = to_run(clean_record(5, cycles=4, points=200, damper="smooth-bingham"))
    noise = 0.01 * np.random.default_rng(1).standard_normal(clean.time.size)
    noisy = replace(clean, current=clean.current + noise - np.mean(noise))
    found = [identify(run, "smooth-bingham").model for run in (clean, noisy)]
    assert found[0] == found[1]


@pytest.mark.parametrize("code", [0.0, -999.0])
def test_a_code_among_samples_of_its_own_size_is_found_by_how_often_it_comes(code):
    record = clean_record(3, cycles=4, points=200)
    rng = np.random.default_rng(24)
    force = np.round(record.force * 1500 / np.max(np.abs(record.force)) + rng.normal(0, 20, record.time.size), 3)
    force[rng.choice(np.arange(5, force.size - 5), 9, replace=False)] = code
    assert "E_SENTINEL" in codes_of(replace(record, force=force))


@pytest.mark.parametrize("level", [0.0, -9999.0])
def test_a_dropout_among_a_channels_own_levels_is_a_code(level):
    """Also of a coarse channel, whose every level comes often; its own flicker and its tips at zero are none."""
    x = np.round(17 + 20 * np.sin(2 * np.pi * np.arange(400) / 100))
    dropped = x.copy()
    dropped[[30, 222, 223]] = level
    assert code_in(dropped, 0.0) == level
    flickering = x - (np.arange(400) % 7 == 0)
    assert code_in(flickering, 0.0) is None
    assert code_in(np.abs(np.arange(-200.0, 200.0)), 0.0) is None
    assert code_in(np.sign(np.sin(np.arange(400) / 16 + 0.01)) * 800 + np.arange(400) % 3, 0.0) is None


def test_a_level_that_a_channel_passes_is_a_code_where_it_drops_to_it():
    x = np.round(17 + 20 * np.sin(2 * np.pi * np.arange(400) / 97.3), 1)
    dropped = x.copy()
    dropped[[24, 125, 226]] = x[62]  # 1.8, no code of a logger
    assert code_in(dropped, 0.0) == x[62]
    assert code_in(x, 0.0) is None
