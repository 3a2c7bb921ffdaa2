"""Records that go on in time: blocks of one file, and files that a logger begins anew."""

from __future__ import annotations

import numpy as np
import pytest

from mrdamper import import_files
from mrdamper.rig_files.profile import parse_profile

RATE_HZ = 250.0


def loop(frequency: float, amplitude: float, yields: float, seconds: float) -> np.ndarray:
    """Time [s], displacement [mm] and force [N] of a sine between rests of a quarter second."""
    t = np.arange(0.0, seconds, 1 / RATE_HZ)
    moving = np.clip(t - 0.25, 0.0, np.floor((seconds - 0.5) * frequency) / frequency)
    x = amplitude * np.sin(2 * np.pi * frequency * moving)
    v = np.gradient(x, t)
    noise = np.random.default_rng(7).normal(0, 1, (2, t.size))
    return np.column_stack([t, x + 0.002 * noise[0], 2.0 * v + yields * np.tanh(v / 4) + 2 * noise[1]])


def write_parts(folder, stem: str, samples: np.ndarray, size: int, first: int = 8) -> None:
    for n, at in enumerate(range(0, len(samples), size), first):
        rows = "".join(f"{t:.4f};{x:.5f};{f:.3f}\n" for t, x, f in samples[at : at + size])
        (folder / f"{stem}-{n}.csv").write_text("Time [s];Stroke [mm];Load [N]\n" + rows)


def test_files_whose_time_and_motion_go_on_are_one_test(tmp_path):
    whole = loop(1.0, 10.0, 300.0, 8.5)
    write_parts(tmp_path, "0.5A_buffer", whole, 500)  # buffers 8 to 12: their order is that of their numbers
    (record,) = import_files([tmp_path]).records
    assert record.id == "0.5A"
    np.testing.assert_allclose(record.time, whole[:, 0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(record.force, whole[:, 2], rtol=0, atol=1e-3)
    assert "W_PARTS" in [finding.code for finding in record.findings]
    assert len(import_files([tmp_path], parse_profile('[file]\nblocks = "split"\n')).records) == 5


def test_files_that_hold_a_session_are_cut_at_its_rests_and_not_at_their_ends(tmp_path):
    one, two = loop(1.0, 10.0, 300.0, 6.5), loop(2.0, 5.0, 300.0, 4.5)
    two[:, 0] += one[-1, 0] + 1 / RATE_HZ
    write_parts(tmp_path, "0.5A", np.concatenate([one, two]), 1000)
    first, second = import_files([tmp_path]).records
    assert (first.displacement.max(), second.displacement.max()) == pytest.approx((0.010, 0.005), rel=0.02)


@pytest.mark.parametrize("change", ["gap", "leap", "number", "clock"])
def test_files_are_tests_of_their_own_where_time_motion_or_numbers_do_not_go_on(tmp_path, change):
    one, two = loop(1.0, 10.0, 300.0, 6.5), loop(1.0, 10.0, 300.0, 6.5)
    two[:, 0] += {"clock": 0.0, "gap": one[-1, 0] + 30.0}.get(change, one[-1, 0] + 1 / RATE_HZ)
    two[:, 1] += 3.0 * (change == "leap")
    two[:, 2] += 1.0  # no copy
    write_parts(tmp_path, "0.5A_run", one, 10_000, first=1)
    write_parts(tmp_path, "0.5A_run", two, 10_000, first=3 if change == "number" else 2)
    assert [record.id for record in import_files([tmp_path]).records] == [
        "0.5A_run-1",
        "0.5A_run-3" if change == "number" else "0.5A_run-2",
    ]


def test_blocks_minutes_apart_are_tests_of_their_own(tmp_path):
    text = "Station: rig 4\n"
    for n, amplitude in enumerate((10.0, 10.0, 5.0)):
        samples = loop(1.0, amplitude, 300.0 + 300 * n, 5.5)
        text += "Time\tStroke\tLoad\tCoil Current\ns\tmm\tN\tA\n"
        text += "".join(f"{t + 300 * n:.4f}\t{x:.5f}\t{f:.3f}\t{0.2 * n:.2f}\n" for t, x, f in samples) + "\n"
    (tmp_path / "rig.dat").write_text(text)
    records = import_files([tmp_path]).records
    assert [float(np.mean(record.current)) for record in records] == pytest.approx([0.0, 0.2, 0.4])


@pytest.mark.parametrize("titles", [("0.5 A", "1 A"), ("0.5 A, 1 Hz", "0.5 A, 2 Hz")])
def test_blocks_whose_titles_state_other_conditions_are_tests_though_their_clock_goes_on(tmp_path, titles):
    text = ""
    for n, title in enumerate(titles):
        samples = loop(2.0 if "2 Hz" in title else 1.0, 10.0, 300.0 + 200 * n, 5.0)
        text += f"# {title}\ntime [s],displacement [mm],force [N]\n"
        text += "".join(f"{t + 5 * n:.4f},{x:.5f},{f:.3f}\n" for t, x, f in samples)
    (tmp_path / "rig.csv").write_text(text)
    result = import_files([tmp_path])
    assert not result.refusals
    assert [record.current[0] for record in result.records] == [0.5, 1.0 if titles[1] == "1 A" else 0.5]


def test_a_sampling_rate_that_contradicts_the_frequency_of_the_name_is_refused(tmp_path):
    samples = loop(1.0, 10.0, 300.0, 6.5)
    rows = "".join(f"{n};{x:.5f};{f:.3f}\n" for n, (_, x, f) in enumerate(samples))
    (tmp_path / "1Hz_0.5A.csv").write_text("Sampling rate: 500 Hz\nSample;Stroke [mm];Load [N]\n" + rows)
    assert [refusal.error.code for refusal in import_files([tmp_path]).refusals] == ["E_MOTION_CONTRADICTS"]
    (tmp_path / "1Hz_0.5A.csv").write_text("Sampling rate: 250 Hz\nSample;Stroke [mm];Load [N]\n" + rows)
    assert not import_files([tmp_path]).refusals


def test_a_log_with_starts_and_ends_cuts_a_session_and_says_its_currents(tmp_path):
    parts = [loop(1.0, 10.0, 300.0, 6.5), loop(2.0, 5.0, 900.0, 5.5)]
    parts[1][:, 0] += parts[0][-1, 0] + 1 / RATE_HZ
    parts[0][-20:, 2] += 3000.0  # the current of the second test is switched on in the rest of the first
    samples = np.concatenate(parts)
    rows = "".join(f"{t:.4f},{x:.5f},{f:.3f}\n" for t, x, f in samples)
    (tmp_path / "record.csv").write_text("time_s,displacement_mm,force_N\n" + rows)
    log = "run,from [s],to [s],I [mA]\n{},6.7,11.8,900\n{},0.1,6.3,300\n"
    (tmp_path / "log.csv").write_text(log.format(2, 1))
    records = import_files([tmp_path]).records
    assert [float(np.mean(record.current)) for record in records] == pytest.approx([0.3, 0.9])
    assert [(record.time[0], record.time[-1]) for record in records] == [
        pytest.approx((0.1, 6.3), abs=0.005),
        pytest.approx((6.7, 11.8), abs=0.005),
    ]
    assert records[0].force.max() < 1000.0
