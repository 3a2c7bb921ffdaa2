"""Clean records pass; what is accepted and said: a test a code, and how often it is found."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from support import rig_detection as rig
from support.rig_records import chirp_record, clean_record, codes_of, random_record, with_channel

from mrdamper.physics.motion import analyse_motion
from mrdamper.physics.motion.strokes import find_strokes
from mrdamper.rig_files.quality import check_record
from mrdamper.rig_files.quality.table import record_of
from mrdamper.rig_files.record import Record


@pytest.fixture
def good():
    return clean_record(3, cycles=4, points=200, velocity=True)


# Clean records


def test_clean_records_pass():
    """At most 1 % may be flagged; with and without a velocity channel. All 300 are in the slow test."""
    assert len(rig.clean_passed(60).missed) <= 1


@pytest.mark.slow
def test_three_hundred_clean_records_pass():
    passed = rig.clean_passed(300)
    assert len(passed.missed) <= 3, passed.missed


@pytest.mark.parametrize(
    "change",
    [
        pytest.param({"sensor": 1e-5}, id="displacement noise of 10 µm"),
        pytest.param({"noise": 0.0}, id="no noise at all"),
        pytest.param({"noise": 10.0, "points": 400, "cycles": 5.3}, id="fine"),
    ],
)
def test_other_clean_records_pass(change):
    for seed in range(12):
        assert codes_of(clean_record(seed, **change)) == [], seed


def test_coarse_channels_pass():
    """A 12-bit converter repeats itself at every turn of the motion: no clipping, no freezing."""
    for seed in range(20):
        record = clean_record(seed, noise=1.0)
        coarse = {name: np.round(getattr(record, name) / step) * step for name, step in STEPS.items()}
        assert codes_of(replace(record, **coarse)) == [], seed


STEPS = {"displacement": 1e-5, "force": 2.5}


@pytest.mark.parametrize("make", [chirp_record, random_record])
def test_motions_that_are_no_sine_are_taken(make):
    for seed in range(5):
        assert codes_of(make(seed)) == ["W_NOT_SINE"]


def test_bundled_runs_are_flagged_only_for_what_they_have(bundled):
    """A flattened sine at the shaking table, positions that drift there: both are true, and the sine is said."""
    said = {run.id: codes_of(record_of(run)) for run in bundled}
    assert not {run.id: wrong for run in bundled if (wrong := rig.unfounded_codes(run, said[run.id]))}
    # Well beyond the limit of 5 %: the checks find their own steady window.
    flattened = [run for run in bundled if run.excitation != "chirp" and analyse_motion(run).distortion > 0.055]
    assert len(flattened) >= 3
    assert all("W_NOT_SINE" in said[run.id] for run in flattened)


# Accepted, and said


def test_a_gap_in_time_splits_the_record(good):
    def leap(time):
        time[300:] += 0.3
        time[500:] += 0.1

    judged = check_record(replace(with_channel(good, "time", leap), velocity=None))
    assert judged.findings[0].code == "W_TIME_GAP"
    assert judged.segments == ((0, 300), (300, 500), (500, 801))


def test_a_gap_brings_no_other_finding():
    """Samples lost anywhere, and two blocks at any distance in time: 25 records each."""
    rng = np.random.default_rng(0)
    for seed in range(25):
        record = clean_record(seed, cycles=4.5)
        size, first = record.time.size, int(rng.integers(record.time.size // 5, record.time.size // 2))
        kept = np.r_[:first, first + int(rng.integers(8, size // 6)) : size]
        lost = {name: getattr(record, name)[kept] for name in ("time", "displacement", "force", "current")}
        assert codes_of(replace(record, **lost)) == ["W_TIME_GAP"], seed
        twice = {name: np.tile(getattr(record, name), 2) for name in ("displacement", "force", "current")}
        later = record.time + np.ptp(record.time) + rng.uniform(0.5, 20)
        assert codes_of(replace(record, time=np.concatenate([record.time, later]), **twice)) == ["W_TIME_GAP"], seed


def test_a_record_without_gap_is_one_segment(good):
    assert check_record(good).segments == ((0, good.time.size),)


def test_channels_are_not_changed(good):
    judged = check_record(good)
    for name in ("time", "displacement", "force", "velocity"):
        assert getattr(judged, name) is getattr(good, name)


def test_clipping_is_noticed():
    """At least 95 %; flat tops of five samples and more, of 3 to 30 % of the amplitude."""
    found = rig.clipping_found(70)
    assert found.tried > 50
    assert found.share >= 0.95, found.missed


def test_clipping_is_noticed_on_real_coarse_records(bundled):
    """A force that spends an eighth of the record above the limit; resolution 3 N, and the noise of the rig.

    Without current the force itself is a plateau of that height.
    """
    for run in bundled:
        if run.rig != "utfsm" or run.current_A == 0:
            continue
        top = np.quantile(run.force, 0.875)
        assert "W_CLIPPED" in codes_of(record_of(replace(run, force=np.minimum(run.force, top)))), run.id


def test_a_force_that_is_cut_off_for_most_of_the_record_is_clipped():
    """A friction damper with the noise and the resolution of a load cell: what is left of it is the reversals."""
    time = np.arange(1536) / 512
    own = 1000 * np.tanh(np.cos(4 * np.pi * time) / 0.2) + 2 * np.random.default_rng(0).standard_normal(time.size)
    for most, codes in ((np.inf, []), (400.0, ["W_CLIPPED"])):
        values = np.clip(np.round(own / 0.7) * 0.7, -most, most)
        record = Record("friction", time, 0.02 * np.sin(4 * np.pi * time), values)
        assert [code for code in codes_of(record) if code == "W_CLIPPED"] == codes


@pytest.mark.parametrize("noise", [0.0, 3.0])
@pytest.mark.parametrize(
    "force",
    [
        pytest.param(lambda v: 1000 * np.tanh(v / 0.02), id="hyperbolic tangent"),
        pytest.param(lambda v: 1000 * np.tanh(v / 0.002), id="steep hyperbolic tangent"),
        pytest.param(lambda v: 1000 * np.sign(v), id="Coulomb friction"),
        pytest.param(lambda v: 1000 * np.tanh(v / 0.02) + 200 * v, id="with little damping"),
    ],
)
def test_a_plateau_of_the_damper_is_not_clipping(force, noise):
    """Calculated forces repeat one value on it; clipped in full motion, they have corners."""
    time = np.arange(2000) / 500
    velocity = 0.02 * np.pi * np.cos(2 * np.pi * time)
    rng = np.random.default_rng(0)
    for limit, codes in ((np.inf, []), (1100.0, ["W_CLIPPED"])):
        own = force(velocity) if limit == np.inf else force(velocity) + 3000 * velocity
        values = np.clip(own + noise * rng.standard_normal(time.size), -limit, limit)
        record = Record("plateau", time, 0.01 * np.sin(2 * np.pi * time), values)
        assert [code for code in codes_of(record) if code == "W_CLIPPED"] == codes, limit


@pytest.mark.parametrize("step", [0.0, 150.0])
@pytest.mark.parametrize("share", [0.94, 0.97])
def test_a_knee_about_an_offset_force_or_coarse_steps_are_not_clipping(share, step):
    """A damper that leaks up to its yield force, with a gas force: both ends are flat, at other distances from zero."""
    time = np.arange(2000) / 500
    velocity, x = 0.1 * np.cos(2 * np.pi * time), 0.05 / np.pi * np.sin(2 * np.pi * time)
    force = 9000 * np.clip(velocity, -0.1 * share, 0.1 * share) + 800 * velocity - 150 - 500 * x
    force += 4 * np.random.default_rng(1).standard_normal(time.size)
    force = np.round(force / step) * step if step else force
    assert "W_CLIPPED" not in codes_of(Record("knee", time, x, force))


def test_freezing_is_noticed():
    """At least 99 %; stretches of 8 to 60 samples anywhere in displacement or force."""
    found = rig.freezing_found(60)
    assert found.share >= 0.99, found.missed


def test_a_channel_that_dies_is_noticed(good):
    """From the middle of the record to its end; hum, warming and scatter are no findings on a force that is none."""

    def die(force):
        force[450:] = force[450]

    assert codes_of(with_channel(good, "force", die)) == ["W_FROZEN"]


def test_a_triangle_is_no_sine(good):
    """Its distortion is 12 %, that of a sine with 4 % of third harmonic is 4 %."""
    phase = 2 * np.pi * np.arange(good.time.size) / 200
    triangle = 0.02 * 2 / np.pi * np.arcsin(np.sin(phase))
    nearly = 0.02 * (np.sin(phase) + 0.04 * np.sin(3 * phase))
    assert codes_of(replace(good, displacement=triangle, force=force_of(triangle, good), velocity=None)) == [
        "W_NOT_SINE"
    ]
    assert codes_of(replace(good, displacement=nearly, force=force_of(nearly, good), velocity=None)) == []


@pytest.mark.parametrize("frequency", [0.25, 1.5])
def test_the_harmonics_of_a_triangle_of_few_cycles_are_no_other_motion(frequency):
    time = np.arange(0, 3.2 / frequency, 0.002)
    odd = np.arange(1, 16, 2)
    triangle = 0.01 * np.sin(2 * np.pi * frequency * time[:, None] * odd) @ ((-1.0) ** (odd // 2) / odd**2)
    record = Record("t", time, triangle, 2000 * np.gradient(triangle, time))
    assert codes_of(record) == ["W_NOT_SINE"]
    hum = replace(record, displacement=triangle + 1e-4 * np.sin(2 * np.pi * 23.3 * frequency * time))
    assert "W_DISTURBED" in codes_of(hum)


def force_of(displacement, record):
    """A viscous damper with 10 N noise."""
    noise = 10 * np.random.default_rng(3).standard_normal(record.time.size)
    return 2000 * np.gradient(displacement, record.time) + noise


@pytest.mark.parametrize("cycles", [0.2, 0.4, 0.6, 0.8, 0.9])
def test_less_than_a_cycle_is_said(cycles):
    for seed in range(10):
        assert codes_of(clean_record(seed, cycles=cycles)) == ["W_SHORT"], seed


def test_a_late_force_is_noticed_on_a_hysteretic_damper():
    """At 5 % of the period at least nine in ten; hysteresis alone never (all clean records)."""
    found = rig.late_force_found(30, 0.05, damper="bouc-wen")
    assert found.share >= 0.9, found.missed


@pytest.mark.parametrize("what", ["mean", "amplitude"])
@pytest.mark.parametrize(("share", "said"), [(0.05, False), (0.2, True), (0.5, True)])
def test_drift_is_said(what, share, said):
    for seed in range(15):
        record = clean_record(seed, cycles=5)
        along = np.linspace(0, 1, record.time.size)
        centre = record.displacement.mean()
        half = np.ptp(record.displacement) / 2
        moved = share * along * (half if what == "mean" else record.displacement - centre)
        codes = codes_of(replace(record, displacement=record.displacement + moved))
        assert codes == (["W_DRIFT"] if said else []), seed


def test_a_ramp_is_no_part_of_a_steady_motion_of_few_strokes():
    turns = [0, 4.5, -17, 20, -20, 20, 4]  # [mm]: the cycles begin at the first 20
    x = np.concatenate(
        [(a + b) / 2 + (a - b) / 2 * np.cos(np.linspace(0, np.pi, 101))[:-1] for a, b in pairwise(turns)]
    )
    steady = find_strokes(0.005 * np.arange(x.size), x).steady
    assert steady is not None
    assert steady[0] == 300


def test_cycles_that_differ_are_said(good):
    """A force that fades by a fifth from cycle to cycle."""
    fading = good.force * 0.8 ** (np.arange(good.time.size) / 200)
    assert "W_REPEATABILITY" in codes_of(replace(good, force=fading))


def test_no_damper_is_refused_for_a_ramp_in_and_out(bundled):
    """The tests of the first rig begin and end at rest."""
    assert codes_of(record_of(bundled["utf_5mm4Hz_1A"])) == []


def test_a_long_record_is_judged_on_a_part_of_it():
    """The figures do not depend on how finely a test was sampled."""
    motion = clean_record(4, cycles=4, points=200)
    fine = np.linspace(motion.time[0], motion.time[-1], 400_001)
    rng = np.random.default_rng(1)
    long = replace(
        motion,
        time=fine,
        displacement=np.interp(fine, motion.time, motion.displacement) + 1e-6 * rng.standard_normal(fine.size),
        force=np.interp(fine, motion.time, motion.force) + 1.0 * rng.standard_normal(fine.size),
        current=np.full(fine.size, 0.5),
    )
    assert codes_of(long) == []
    assert codes_of(replace(long, force=-long.force)) == ["E_DISSIPATION_SIGN"]


@pytest.mark.parametrize("rest", [0.05, 0.2])
def test_a_rest_before_or_behind_the_motion_is_no_part_of_its_cycles(rest):
    rng, phase = np.random.default_rng(1), 2 * np.pi * np.clip(np.arange(-rest, 4 + rest, 0.002), 0, 4)
    moves = (phase > 0) & (phase < 8 * np.pi)
    x = 0.01 * np.sin(phase) + rng.normal(0, 1e-6, phase.size)
    moving = 400 * np.tanh(4 * np.cos(phase)) + 100 * np.cos(phase)
    force = np.where(moves, moving, 0.0) + rng.normal(0, 1.0, phase.size)
    record = check_record(Record("a", 0.002 * np.arange(phase.size), x, force))
    assert not record.findings
    assert record.steady is not None
    assert record.steady.window is not None
    assert record.steady.window == pytest.approx((rest, rest + 4), abs=0.01)
    assert record.steady.repeatability == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize("seed", range(12))
def test_reversals_are_the_peaks_that_stand_out_on_both_sides(seed):
    from scipy.signal import find_peaks

    rng = np.random.default_rng(seed)
    time = np.linspace(0, 1, int(rng.integers(200, 3000)))
    motions = {
        "sine": np.sin(2 * np.pi * rng.uniform(0.5, 20) * time + rng.uniform(0, 6)) + rng.normal(0, 0.01, time.size),
        "walk": np.cumsum(rng.standard_normal(time.size)),
        "dwells": np.round(6 * np.sin(2 * np.pi * rng.uniform(0.5, 9) * time)) / 6,
    }
    for name, x in motions.items():
        least = 0.1 * np.ptp(x)
        kinds = {int(at): sign for sign in (1, -1) for at in find_peaks(sign * x, prominence=least)[0]}
        turns = [at for before, at in pairwise([-1, *sorted(kinds)]) if kinds.get(before) != kinds[at]]
        np.testing.assert_array_equal(find_strokes(time, x).reversals, turns, err_msg=name)
