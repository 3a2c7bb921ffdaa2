"""Names, signs and clocks of the channels: what contradicts is refused, a current counts by its magnitude."""

import re
from pathlib import Path

import numpy as np
import pytest

from mrdamper.rig_files.conditions import motions_in
from mrdamper.rig_files.profile import parse_profile
from mrdamper.rig_files.rig_import import import_files

TIME = np.arange(1001) / 200
PHASE = 2 * np.pi * TIME


def imported(folder, name, heads, columns):
    rows = "\n".join(",".join(f"{value:.7g}" for value in row) for row in zip(*columns, strict=True))
    path = folder / name
    path.write_text(f"{','.join(heads)}\n{rows}\n")
    return import_files([path])


def force(phase):
    noise = 2 * np.random.default_rng(1).standard_normal(TIME.size)
    return 800 * np.cos(phase) + 300 * np.tanh(np.cos(phase) / 0.02) + noise


@pytest.mark.parametrize(
    ("name", "current", "accepted"),
    [("t_0.5A", -0.5, True), ("t_-0.5A", 0.5, True), ("t_-0.5A", -0.5, True), ("t_0.5A", 0.9, False)],
)
def test_a_current_in_a_name_is_compared_by_magnitude(tmp_path, name, current, accepted):
    heads = ("time [s]", "displacement [mm]", "force [N]", "current [A]")
    columns = (TIME, 20 * np.sin(PHASE), force(PHASE), np.full(TIME.size, current))
    assert bool(imported(tmp_path, f"{name}.csv", heads, columns).records) is accepted


def test_a_current_of_either_sign_is_reported_by_magnitude_and_validates_at_either(tmp_path):
    from mrdamper.data import Dataset
    from mrdamper.rig_files.quality.table import quality_table, row, to_run
    from mrdamper.study.split import hold_out

    heads = ("time [s]", "displacement [mm]", "force [N]", "current [A]")
    records = []
    for name, current in (("a", -0.5), ("b", 0.5), ("c", -1.0), ("d", 0.0), ("e", 2.0)):
        columns = (TIME, 20 * np.sin(PHASE), force(PHASE), np.full(TIME.size, current))
        records += imported(tmp_path, f"{name}.csv", heads, columns).records
    assert [row(quality)["current_A"] for quality in quality_table(records)] == [0.5, 0.5, 1.0, 0.0, 2.0]
    dataset = Dataset(tuple(to_run(record) for record in records))
    for asked in (0.5, -0.5):
        assert set(hold_out(dataset, currents=[asked]).held_out) == {run.id for run in dataset.runs[:2]}


@pytest.mark.parametrize(("heading", "value"), [("CURRENT [MA]", 500.0), ("CURRENT [A]", 0.5), ("CURRENT [mA]", 500.0)])
def test_units_in_capitals_are_read(tmp_path, heading, value):
    heads = ("TIME [S]", "DISPLACEMENT [MM]", "FORCE [N]", heading)
    columns = (TIME, 20 * np.sin(PHASE), force(PHASE), np.full(TIME.size, value))
    (record,) = imported(tmp_path, "test.csv", heads, columns).records
    assert np.mean(record.current) == pytest.approx(0.5)


def test_columns_whose_names_end_in_a_numbered_run_are_its_tests(tmp_path):
    runs, channels = ("Run #1 0.5 A", "Run #2 1 A"), ("Time (s)", "Position (mm)", "Force (N)")
    heads = tuple(f"{channel} {run}" for run in runs for channel in channels)
    first = (TIME, 20 * np.sin(PHASE), force(PHASE))
    found = imported(tmp_path, "test.csv", heads, (*first, *(2 * of for of in first)))
    assert found.refusals == ()
    assert [float(np.mean(record.current)) for record in found.records] == [0.5, 1.0]


def test_a_unit_in_capitals_against_the_size_of_the_current_is_refused(tmp_path):
    heads = ("TIME [S]", "DISPLACEMENT [MM]", "FORCE [N]", "CURRENT [MA]")
    columns = (TIME, 20 * np.sin(PHASE), force(PHASE), np.full(TIME.size, 0.5))
    result = imported(tmp_path, "test.csv", heads, columns)
    assert [refusal.error.code for refusal in result.refusals] == ["E_AMBIGUOUS"]


@pytest.mark.parametrize("late", [0.02, -0.04, 0.04])
def test_two_clocks_are_never_paired_by_row(tmp_path, late):
    """The force's own stamps are off: its samples are taken at its times, and the difference is stated."""
    heads = ("time [s]", "displacement [mm]", "time 2 [s]", "force [N]", "current [A]")
    columns = (TIME, 20 * np.sin(PHASE), TIME + late, force(PHASE + 2 * np.pi * late), np.full(TIME.size, 0.5))
    (record,) = imported(tmp_path, "test.csv", heads, columns).records
    assert np.corrcoef(record.force, np.cos(2 * np.pi * record.time))[0, 1] > 0.97
    assert abs(np.corrcoef(record.force, np.sin(2 * np.pi * record.time))[0, 1]) < 0.02
    assert TIME.size - record.time.size <= abs(late) * 200
    (text,) = [finding.text for finding in record.findings if finding.code == "W_RASTER"]
    assert f"up to {1e3 * abs(late):g} ms apart" in text


@pytest.mark.parametrize(("late", "stated"), [(0.04, "40 ms"), (-0.04, "40 ms"), (0.0, None), (3600.0, None)])
def test_a_second_clock_that_no_channel_follows_is_stated_with_its_distance(tmp_path, late, stated):
    """An hour later is the time of day, 40 ms may be the clock of one of the channels."""
    heads = ("time [s]", "time 2 [s]", "displacement [mm]", "force [N]", "current [A]")
    columns = (TIME, TIME + late, 20 * np.sin(PHASE), force(PHASE), np.full(TIME.size, 0.5))
    (record,) = imported(tmp_path, "test.csv", heads, columns).records
    found = [finding.text for finding in record.findings if finding.code == "W_RASTER"]
    assert len(found) == (stated is not None)
    assert all(stated in text for text in found)


@pytest.mark.parametrize(("pause", "accepted"), [(0.0, True), (0.5, False)])
def test_a_time_of_day_goes_on_past_midnight_where_it_falls_back_by_a_day(tmp_path, pause, accepted):
    """A clock that falls back by another time than a day less one step was set, or the recording was off."""
    clock = 86_400 - 4.002 + TIME + pause * (TIME > 4)
    stamps = [f"{int(t // 3600):02}:{int(t % 3600 // 60):02}:{t % 60:06.3f}" for t in (clock % 86_400).tolist()]
    rows = zip(stamps, 20 * np.sin(PHASE), force(PHASE), strict=True)
    body = "\n".join(f"{t},{x:.7g},{f:.7g}" for t, x, f in rows)
    (tmp_path / "test_0.5A.csv").write_text(f"clock,displacement [mm],force [N]\n{body}\n")
    result = import_files([tmp_path])
    assert bool(result.records) is accepted
    if accepted:
        np.testing.assert_allclose(np.diff(result.records[0].time), 0.005, rtol=1e-6)
    else:
        assert [refusal.error.code for refusal in result.refusals] == ["E_TIME_ORDER"]


def test_nanoseconds_since_1970_need_no_unit_and_smaller_counts_do(tmp_path):
    columns = (20 * np.sin(PHASE), force(PHASE))
    body = "\n".join(f"{t:.3f},{x:.7g},{f:.7g}" for t, x, f in zip(1_714_644_732 + TIME, *columns, strict=True))
    (tmp_path / "c_0.5A.csv").write_text(f"%time,displacement [mm],force [N]\n{body}\n")
    (seconds,) = import_files([tmp_path / "c_0.5A.csv"]).records
    np.testing.assert_allclose(seconds.time - seconds.time[0], TIME, atol=1e-6)
    (tmp_path / "c_0.5A.csv").unlink()
    for name, begin, step in (("a_0.5A", 1_714_644_732_000_700_000, 5_000_000), ("b_0.5A", 1_714_644_732_001, 5)):
        rows = zip((begin + step * np.arange(TIME.size)).tolist(), *columns, strict=True)
        body = "\n".join(f"{t},{x:.7g},{f:.7g}" for t, x, f in rows)
        (tmp_path / f"{name}.csv").write_text(f"%time,displacement [mm],force [N]\n{body}\n")
    result = import_files([tmp_path])
    (record,) = result.records
    np.testing.assert_allclose(record.time - record.time[0], TIME, atol=1e-6)
    assert [(refusal.file[-10:], refusal.error.code) for refusal in result.refusals] == [
        ("b_0.5A.csv", "E_UNITS_MISSING")
    ]


@pytest.mark.parametrize(
    ("names", "currents"),
    [
        (["MRD-7_0A", "MRD-7_0.75A", "MRD-7_1A"], [0.0, 0.75, 1.0]),  # no decimal has two points
        (["run9_2A", "run10_1A"], [2.0, 1.0]),
        (["run1_1A", "run2_1A", "run3_0A", "run4_2A"], [1.0, 1.0, 0.0, 2.0]),  # counts the tests
        (["MRD-7_0A/a", "MRD-7_1A/a", "MRD-7_500mA/a"], [0.0, 1.0, 0.5]),
        (["MRD_0A0_2Hz", "MRD_0A5_2Hz", "MRD_1A0_2Hz"], [0.0, 0.5, 1.0]),  # the letter stands for the mark
        (["t2_5A", "t0_5A", "t1_0A", "t2_0A"], None),
        (["I1_0A", "I1_1A", "I1_2A"], None),
        (["t_1_0A", "t_1_1A", "t_1_2A"], None),
        (["S2_1A_2Hz", "S2_0A_2Hz", "S2_2A_2Hz"], None),
        (["sine_at1_0A/a", "sine_at1_1A/a", "sine_at1_2A/a"], None),
        (["level1_0A", "level2_1A", "level3_2A"], None),
        (["cur1_5A", "cur10_5A"], None),
        (["at1_5A", "at10_5A"], None),
        (["run1_0A", "run1_5A"], None),
    ],
)
def test_a_digit_before_the_current_is_part_of_a_label_where_the_other_names_show_it(tmp_path, names, currents):
    for i, name in enumerate(names):
        path = tmp_path / f"{name}.csv"
        path.parent.mkdir(exist_ok=True)
        table = np.column_stack([TIME, (15 + i) * np.sin(PHASE), (1 + 0.1 * i) * force(PHASE)])
        np.savetxt(path, table, "%.6g", ",", header="time [s],displacement [mm],force [N]", comments="")
    result = import_files([tmp_path])
    if currents is not None:
        found = {
            str(record.provenance["file"]).removesuffix(".csv"): np.mean(record.current) for record in result.records
        }
        assert [found[name] for name in names] == currents
        return
    assert not result.records
    error = result.refusals[0].error
    written = re.search(r"values = (\{.*?\})", error.remedy)
    assert re.search(r"can be read as \d A or as \d+\.\d A", error.found)
    assert written
    answered = import_files([tmp_path], parse_profile(f"[current]\nvalues = {written[1]}"))
    number = float(written[1].partition("=")[2].strip(" }"))
    assert answered.records
    assert {float(np.mean(record.current)) for record in answered.records} == {number}


@pytest.mark.parametrize("names", [["D_1A1", "D_2A1", "D_3A1"], ["D_0A0", "D_0A5"], ["D_0A0", "E_0A5", "F_1A0"]])
def test_a_letter_between_digits_is_no_decimal_mark_without_zero_and_a_third_number_beside_it(tmp_path, names):
    for i, name in enumerate(names):
        table = np.column_stack([TIME, (15 + i) * np.sin(PHASE), (1 + 0.1 * i) * force(PHASE)])
        header = "time [s],displacement [mm],force [N]"
        np.savetxt(tmp_path / f"{name}.csv", table, "%.6g", ",", header=header, comments="")
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}


def test_folders_of_a_profile_may_be_all_that_a_path_has(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files = []
    for folder in ("a", "b"):
        path = Path(folder, "test1.csv")
        path.parent.mkdir()
        table = np.column_stack([TIME, 15 * np.sin(PHASE), (1 + 0.1 * len(files)) * force(PHASE)])
        np.savetxt(path, table, "%.6g", ",", header="time [s],displacement [mm],force [N]", comments="")
        files.append(path)
    values = parse_profile('[current]\nvalues = {"*/a/test1.csv" = 0.5, "*/b/test1.csv/test1" = 1.0}')
    assert [np.mean(record.current) for record in import_files(files, values).records] == [0.5, 1.0]
    for folder, level in (("a", "lvl0.5"), ("b", "lvl1.0")):
        Path(folder).rename(level)
    pattern = parse_profile('[current]\npattern = "*/lvl{current}/*"\nunit = "A"')
    records = import_files(sorted(Path().glob("lvl*/*")), pattern).records
    assert [np.mean(record.current) for record in records] == [0.5, 1.0]


def test_a_clock_of_megahertz_is_no_frequency_of_the_motion():
    assert motions_in("base clock: 2 MHz, 500 mHz, 3HZ", "Hz") == {0.5, 3.0}
    assert motions_in("f_=_0_5_Hz", "Hz") == set()  # of an id: 0.5 Hz, or 5 Hz
