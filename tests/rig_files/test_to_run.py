"""From records to runs: what is left out, where segments go, which window is steady."""

from dataclasses import replace

import numpy as np
import pytest
from support.rig_records import clean_record, random_record

from mrdamper.data import Dataset
from mrdamper.errors import ColumnError, ExcitationError, QualityError
from mrdamper.identification import identify
from mrdamper.physics.motion import analyse_motion
from mrdamper.rig_files.dataset_folder import load_dataset, save_dataset
from mrdamper.rig_files.quality import check_record, view
from mrdamper.rig_files.quality.table import quality_table, record_of, row, to_run


@pytest.fixture
def record():
    return clean_record(3, cycles=4.3, points=200, velocity=True)


def test_a_clean_record_becomes_a_run_unchanged(record):
    run = to_run(record)
    for name in ("time", "displacement", "force", "velocity", "current"):
        np.testing.assert_array_equal(getattr(run, name), getattr(record, name))
    assert "findings" not in run.notes
    assert run.segments == ((0, record.time.size),)


def test_missing_samples_are_left_out_and_segments_follow(record):
    force, time = record.force.copy(), record.time.copy()
    force[[10, 11, 500]] = np.nan
    time[300:] += 0.5
    run = to_run(replace(record, force=force, time=time, velocity=None))
    assert run.time.size == record.time.size - 3
    assert run.segments == ((0, 298), (298, record.time.size - 3))
    assert run.time[298] - run.time[297] > 0.5
    assert run.notes["findings"].split()[:2] == ["W_MISSING", "W_TIME_GAP"]


def test_a_scrap_between_two_gaps_is_left_out(record):
    """Three samples have no slope."""
    time = record.time.copy()
    time[300:] += 0.5
    time[303:] += 0.5
    run = to_run(replace(record, time=time, velocity=None))
    assert run.time.size == record.time.size - 3
    assert run.segments == ((0, 300), (300, record.time.size - 3))


def test_the_window_holds_whole_cycles_to_the_end(record):
    run = to_run(record)
    motion = analyse_motion(run)
    step = record.time[1] - record.time[0]
    # Whole to a sample; the frequency is known far better.
    assert abs(motion.cycles - 4) * 200 <= 1.0
    assert abs(run.window[1] - record.time[-1]) < step


def test_the_window_leaves_ramps_out(bundled):
    """Beside the windows that came with the data, to a cycle: whether one belongs is a matter of per cents."""
    for name in ("utf_5mm4Hz_1A", "utf_10mm2Hz_0.5A", "utf_25mm0x5Hz_0A"):
        given, found = bundled[name], to_run(record_of(bundled[name]))
        period = 1 / analyse_motion(given).condition.frequency_Hz
        assert found.window[0] > given.window[0] - 1.3 * period
        assert found.window[1] < given.window[1] + 1.3 * period
        a, b = analyse_motion(given).condition, analyse_motion(found).condition
        assert abs(a.amplitude_m / b.amplitude_m - 1) < 0.01
        assert abs(a.frequency_Hz / b.frequency_Hz - 1) < 0.003


def test_repeatability_is_measured_as_the_data_sheet_does(bundled):
    """The stored figures were found with another window: within a factor of two, at the median within a third."""
    ratios = []
    for run in bundled:
        if run.excitation == "sine":
            ratios.append(to_run(record_of(run)).repeatability / run.repeatability)
    assert min(ratios) > 0.5
    assert max(ratios) < 2.5
    assert 0.75 < np.median(ratios) < 1.33


def test_noise_alone_gives_its_own_repeatability():
    """White noise of standard deviation s scatters by s over the peak-to-peak force, to 10 %."""
    record = clean_record(8, cycles=5, points=300, noise=20.0)
    clean = clean_record(8, cycles=5, points=300, noise=0.0)
    expected = 20.0 / np.ptp(clean.force)
    # Interpolation between samples averages noise: 0.82 of it at random places.
    assert 0.75 * expected < to_run(record).repeatability < 1.1 * expected


def test_motion_without_period_has_no_window():
    run = to_run(random_record(1))
    assert run.window is None
    assert run.repeatability is None
    assert run.notes["findings"] == "W_NOT_SINE"


def test_a_short_record_becomes_a_run_that_identification_refuses():
    run = to_run(clean_record(2, cycles=0.6))
    assert run.notes["findings"] == "W_SHORT"
    with pytest.raises(ExcitationError):
        identify(run, "bingham")


def test_a_record_that_cannot_be_used_becomes_no_run(record):
    with pytest.raises(QualityError):
        to_run(replace(record, force=-record.force))


def test_a_record_without_current_says_where_to_give_it(record):
    with pytest.raises(ColumnError, match="no current"):
        to_run(replace(record, current=None))


def test_findings_and_provenance_survive_on_disk(record, tmp_path):
    clipped = replace(record, force=np.minimum(record.force, 0.8 * record.force.max()), provenance={"file": "a;b.csv"})
    save_dataset(Dataset((to_run(clipped),)), tmp_path / "rig")
    (run,) = load_dataset(tmp_path / "rig")
    assert "W_CLIPPED" in run.notes["findings"].split()
    assert run.notes["file"] == "a;b.csv"
    (again,) = quality_table([record_of(run)])
    assert again.verdict == "not identified"


def test_a_run_gets_the_same_verdict_again(record):
    first = check_record(record)
    again = check_record(record_of(to_run(first)))
    assert [f.code for f in again.findings] == [f.code for f in first.findings]


def test_the_table_measures_and_does_not_stop_at_a_refusal(record):
    moved = replace(record, force=record.force + 37.0, displacement=record.displacement + 0.011)
    good, shifted, bad = quality_table([record, moved, replace(record, force=-record.force)])
    assert good.verdict == "good"
    # Reported, not taken off; to rounding.
    assert shifted.figures["offset_force_N"] - good.figures["offset_force_N"] == pytest.approx(37.0, abs=1e-6)
    assert shifted.figures["centre_mm"] - good.figures["centre_mm"] == pytest.approx(11.0, abs=1e-6)
    assert bad.verdict == "refused"
    assert bad.codes == ("E_DISSIPATION_SIGN",)
    assert row(bad)["frequency_Hz"] is None
    step = record.time[1] - record.time[0]
    assert row(good)["sample_rate_Hz"] == pytest.approx(1 / step, rel=1e-4)
    assert row(good)["frequency_Hz"] == pytest.approx(1 / (200 * step), rel=1e-3)


def test_the_table_measures_what_the_checks_have_analysed(record, monkeypatch):
    analysed = []
    monkeypatch.setattr(view, "analyse_motion", lambda run: analysed.append(run) or analyse_motion(run))
    (verdict,) = quality_table([record])
    assert verdict.verdict == "good"
    assert len(analysed) == 1
    (again,) = quality_table([verdict.record])
    assert row(again) == row(verdict)
