"""Clean records pass; what is accepted and said: a test a code, and how often it is found."""

from dataclasses import replace

import numpy as np
import pytest
from rig_records import chirp_record, clean_record, codes_of, random_record, with_channel

from mrdamper.excitation import analyse_motion
from mrdamper.io.quality import judge
from mrdamper.io.quality.table import record_of


@pytest.fixture
def good():
    return clean_record(3, cycles=4, points=200, velocity=True)


# Clean records


def test_clean_records_pass():
    """Fewer than 1 % of 300 may be flagged; with and without a velocity channel."""
    found = {seed: codes_of(clean_record(seed, velocity=seed % 2 == 0)) for seed in range(300)}
    flagged = {seed: codes for seed, codes in found.items() if codes}
    assert len(flagged) <= 3, flagged


@pytest.mark.parametrize(
    "change",
    [
        pytest.param({"sensor": 1e-5}, id="displacement noise of 10 µm"),
        pytest.param({"noise": 0.0}, id="no noise at all"),
        pytest.param({"noise": 10.0, "points": 400, "cycles": 5.3}, id="fine"),
    ],
)
def test_other_clean_records_pass(change):
    for seed in range(25):
        assert codes_of(clean_record(seed, **change)) == [], seed


def test_coarse_channels_pass():
    """A 12-bit converter repeats itself at every turn of the motion: no clipping, no freezing."""
    for seed in range(40):
        record = clean_record(seed, noise=1.0)
        coarse = {name: np.round(getattr(record, name) / step) * step for name, step in STEPS.items()}
        assert codes_of(replace(record, **coarse)) == [], seed


STEPS = {"displacement": 1e-5, "force": 2.5}


@pytest.mark.parametrize("make", [chirp_record, random_record])
def test_motions_that_are_no_sine_are_taken(make):
    for seed in range(5):
        assert codes_of(make(seed)) == ["W_NOT_SINE"]


def test_bundled_runs_are_flagged_only_for_what_they_have(bundled):
    """Both rigs' data sheet: a flattened sine at the shaking table, positions that drift there."""
    for run in bundled:
        codes = codes_of(record_of(run))
        assert set(codes) <= {"W_NOT_SINE", "W_DRIFT"}, (run.id, codes)
        if run.excitation == "chirp":
            continue
        motion = analyse_motion(run)
        if "W_NOT_SINE" in codes:
            # The checks find their own steady window: distortions near the limit may fall on either side.
            assert motion.distortion > 0.045, run.id
        elif motion.distortion > 0.055:
            raise AssertionError(f"{run.id}: distortion {motion.distortion} not noticed")
        if "W_DRIFT" in codes:
            start, stop = run.window
            assert abs(motion.drift) * (stop - start) > 0.2 * motion.condition.amplitude_m, run.id


# Accepted, and said


def test_a_gap_in_time_splits_the_record(good):
    def leap(time):
        time[300:] += 0.3
        time[500:] += 0.1

    judged = judge(replace(with_channel(good, "time", leap), velocity=None))
    assert judged.findings[0].code == "W_TIME_GAP"
    assert judged.segments == ((0, 300), (300, 500), (500, 801))


def test_a_record_without_gap_is_one_segment(good):
    assert judge(good).segments == ((0, good.time.size),)


def test_channels_are_not_changed(good):
    judged = judge(good)
    for name in ("time", "displacement", "force", "velocity"):
        assert getattr(judged, name) is getattr(good, name)


def clip(record, rng):
    """Cut a random channel off at one or both ends so that at least five samples are equal; None if it does not."""
    name = str(rng.choice(["displacement", "force"]))
    values = getattr(record, name)
    middle, half, level = (values.max() + values.min()) / 2, np.ptp(values) / 2, rng.uniform(0.7, 0.97)
    low, high = [(-np.inf, level), (-level, np.inf), (-level, level)][rng.integers(3)]
    cut = np.clip(values, middle + low * half, middle + high * half)
    flat = max(longest_equal(cut, edge) for edge in (cut.max(), cut.min()))
    return replace(record, **{name: cut}) if flat >= 5 else None


def longest_equal(values, level):
    longest = here = 0
    for same in values == level:
        here = here + 1 if same else 0
        longest = max(longest, here)
    return longest


def test_clipping_is_noticed():
    """At least 95 %; flat tops of five samples and more, of 3 to 30 % of the amplitude."""
    rng = np.random.default_rng(11)
    clipped = [
        c for seed in range(130) if (c := clip(clean_record(seed, sensor=rng.choice([0, 5e-6])), rng)) is not None
    ]
    assert len(clipped) > 100
    found = np.mean(["W_CLIPPED" in codes_of(record) for record in clipped])
    assert found >= 0.95


def test_clipping_is_noticed_on_real_coarse_records(bundled):
    """A force that spends an eighth of the record above the limit; resolution 3 N, and the noise of the rig.

    Without current the force itself is a plateau of that height.
    """
    for run in bundled:
        if run.rig != "utfsm" or run.current_A == 0:
            continue
        top = np.quantile(run.force, 0.875)
        assert "W_CLIPPED" in codes_of(record_of(replace(run, force=np.minimum(run.force, top)))), run.id


def test_freezing_is_noticed():
    """At least 99 %; stretches of 8 to 60 samples anywhere in displacement or force."""
    rng = np.random.default_rng(12)
    found = []
    for seed in range(120):
        record = clean_record(seed, sensor=rng.choice([0, 5e-6]))
        length = int(rng.integers(8, 61))
        start = int(rng.integers(5, record.time.size - length - 5))

        def freeze(values, start=start, length=length):
            values[start : start + length] = values[start]

        found.append("W_FROZEN" in codes_of(with_channel(record, str(rng.choice(["displacement", "force"])), freeze)))
    assert np.mean(found) >= 0.99


def test_a_channel_that_dies_is_noticed(good):
    """From the middle of the record to its end."""

    def die(force):
        force[450:] = force[450]

    assert "W_FROZEN" in codes_of(with_channel(good, "force", die))


def test_a_triangle_is_no_sine(good):
    """Its distortion is 12 %, that of a sine with 4 % of third harmonic is 4 %."""
    phase = 2 * np.pi * np.arange(good.time.size) / 200
    triangle = 0.02 * 2 / np.pi * np.arcsin(np.sin(phase))
    nearly = 0.02 * (np.sin(phase) + 0.04 * np.sin(3 * phase))
    assert codes_of(replace(good, displacement=triangle, force=force_of(triangle, good), velocity=None)) == [
        "W_NOT_SINE"
    ]
    assert codes_of(replace(good, displacement=nearly, force=force_of(nearly, good), velocity=None)) == []


def force_of(displacement, record):
    """A viscous damper with 10 N noise."""
    noise = 10 * np.random.default_rng(3).standard_normal(record.time.size)
    return 2000 * np.gradient(displacement, record.time) + noise


@pytest.mark.parametrize("cycles", [0.2, 0.4, 0.6, 0.8, 0.9])
def test_less_than_a_cycle_is_said(cycles):
    for seed in range(20):
        assert codes_of(clean_record(seed, cycles=cycles)) == ["W_SHORT"], seed


def test_a_late_force_is_noticed_on_a_hysteretic_damper():
    """At 5 % of the period at least nine in ten; hysteresis alone never."""
    found = []
    for seed in range(40):
        record = clean_record(seed, damper="bouc-wen", cycles=3.4)
        period = analyse_motion_of(record)
        late = np.interp(record.time - 0.05 * period, record.time, record.force)
        found.append("W_LAG" in codes_of(replace(record, force=late)))
    assert np.mean(found) >= 0.9


def analyse_motion_of(record):
    from mrdamper.io.to_run import to_run

    return 1 / analyse_motion(to_run(record)).condition.frequency_Hz


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
