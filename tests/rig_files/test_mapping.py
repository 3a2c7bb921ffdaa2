"""From what is in files to tests: clocks, units, results, groups and two files a test, as the files state them."""

import json
import re

import numpy as np
import openpyxl
import pytest
from support.foreign_labs import KINDS, campaign, put, rows
from typer.testing import CliRunner

from benchmarks.foreign_labs import faults
from mrdamper.cli import application
from mrdamper.errors import InputError
from mrdamper.rig_files.conditions import currents_in
from mrdamper.rig_files.mapping.proposals import damping_share
from mrdamper.rig_files.mapping.result_tables import results_in
from mrdamper.rig_files.preview import question_of
from mrdamper.rig_files.profile import CurrentSource, Profile, ProfileError, parse_profile
from mrdamper.rig_files.quality import check_record
from mrdamper.rig_files.readers import raw_tables
from mrdamper.rig_files.record import Record
from mrdamper.rig_files.rig_import import import_files, to_dataset
from mrdamper.rig_files.sequences import stretches_of_session

FAST = ("mts_dat", "picoscope", "timeseries_structs", "matrix_beside_files", "merged_headings", "json_lines", "uff58",
        "controller_and_supply", "yokogawa", "graphtec", "tidy_long_table", "crank_dynamometer",
        "comparison_of_two_force_sensors", "parquet_partitions", "npy_structured", "data_beside_headers_of_channels",
        "oscilloscope_with_scales_in_labels", "pages_of_a_printer", "json_lines_below_a_header",
        "plan_that_agrees_with_the_names", "steps_with_rests_between")  # fmt: skip


@pytest.fixture(scope="module")
def tests():
    return campaign()


def right(kind, tests, folder):
    KINDS[kind](tests, folder)
    found = import_files([folder])
    assert not found.refusals, str(found.refusals[0].error)
    assert faults(tests, to_dataset(found.records)) == []


@pytest.mark.parametrize("kind", FAST)
def test_a_foreign_export_is_read_at_the_first_command(kind, tests, tmp_path):
    right(kind, tests, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in FAST])
def test_every_other_foreign_export_is_read_at_the_first_command(kind, tests, tmp_path):
    right(kind, tests, tmp_path)


def test_one_current_for_tests_of_several_is_refused(tests, tmp_path):
    """Obeyed literally, the remedy must not give four currents one name."""
    for k, test in enumerate(tests):
        put(tmp_path / f"t{k}.csv", ["time_s,displacement_mm,force_N", *rows(test.t, 1e3 * test.x, test.f)])
    found = import_files([tmp_path], parse_profile("[current]\nvalue = 0.4"))
    assert not found.records
    assert {refusal.error.code for refusal in found.refusals} == {"E_CONDITIONS"}


def test_repeated_tests_of_one_current_are_no_contradiction(tmp_path):
    for number, seed in enumerate((1, 2, 3)):
        (test,) = campaign(seed, currents=(0.6,), motions=((1.0, 0.02),))
        put(tmp_path / f"t{number}.csv", ["time_s,displacement_mm,force_N", *rows(test.t, 1e3 * test.x, test.f)])
    found = import_files([tmp_path], parse_profile("[current]\nvalue = 0.6"))
    assert (len(found.records), found.refusals) == (3, ())


def test_a_current_of_the_profile_against_the_files_name_is_refused(tests, tmp_path):
    test = tests[2]
    put(tmp_path / "run_0.6A.csv", ["time_s,displacement_mm,force_N", *rows(test.t, 1e3 * test.x, test.f)])
    found = import_files([tmp_path], parse_profile("[current]\nvalue = 1.2"))
    assert [refusal.error.code for refusal in found.refusals] == ["E_CURRENT_CONTRADICTS"]


def put_tests(tests, folder, names):
    for test, name in zip(tests, names, strict=False):
        put(folder / name, ["time_s,displacement_mm,force_N", *rows(test.t, 1e3 * test.x, test.f)])


def test_currents_by_names_are_those_of_the_tests(tests, tmp_path):
    chosen = [test for test in tests if test.current > 0][:2]
    put_tests(chosen, tmp_path, ["MRD_C05_A12.csv", "Second.csv"])
    values = f'[current]\nvalues = {{"mrd_c05*" = {chosen[0].current}, "second" = {chosen[1].current}}}'
    found = import_files([tmp_path], parse_profile(values))
    assert found.refusals == ()
    assert [float(record.current[0]) for record in found.records] == [test.current for test in chosen]


@pytest.mark.parametrize(
    ("name", "values", "code"),
    [
        ("a.csv", {"b*": 0.6}, "E_PROFILE"),
        ("a.csv", {"a*": 0.6, "*.csv": 1.2}, "E_AMBIGUOUS"),
        ("a_0.6A.csv", {"a*": 1.2}, "E_CURRENT_CONTRADICTS"),
        ("a_0.6A.csv", {"a*": 0.6}, None),
        ("a.csv", {"a*": 0.6, "*.csv": 0.6}, None),
    ],
)
def test_a_current_by_name_that_does_not_hold_is_refused(tests, tmp_path, name, values, code):
    put_tests(tests, tmp_path, [name])
    profile = Profile(current=CurrentSource(values=values))
    try:
        found = import_files([tmp_path], profile)
        codes = [refusal.error.code for refusal in found.refusals]
    except ProfileError as error:
        codes = [error.code]
    assert codes == ([] if code is None else [code])


def test_a_current_by_name_against_the_channel_is_refused(tests, tmp_path):
    test = tests[0]
    channel = rows(test.t, 1e3 * test.x, test.f, 0 * test.t + 0.6)
    put(tmp_path / "a.csv", ["time_s,displacement_mm,force_N,current_A", *channel])
    for value, codes in ((1.2, ["E_CURRENT_CONTRADICTS"]), (0.6, [])):
        found = import_files([tmp_path], Profile(current=CurrentSource(values={"a": value})))
        assert [refusal.error.code for refusal in found.refusals] == codes


def test_the_written_profile_lists_tests_without_a_current(tests, tmp_path):
    """Filled in as it stands, the profile imports every test."""
    folder, profile = tmp_path / "lab", tmp_path / "rig.toml"
    folder.mkdir()
    chosen = [test for test in tests if test.current > 0][:2]
    put_tests(chosen, folder, ["first [1].csv", "second.csv"])
    done = CliRunner().invoke(application(), ["import", str(folder), "--write-profile", str(profile)])
    assert done.exit_code == 0, done.output
    lines = profile.read_text(encoding="utf-8").splitlines()
    start = lines.index("#[current.values]")
    assert len(lines) == start + 3
    filled = [f"{line[1:]} {test.current}" for line, test in zip(lines[start + 1 :], chosen, strict=True)]
    profile.write_text("\n".join([*lines[:start], "[current.values]", *filled]), encoding="utf-8")
    found = import_files([folder], profile)
    assert [float(record.current[0]) for record in found.records] == [test.current for test in chosen]


def test_a_monitors_voltage_is_asked_for_its_scale(tests, tmp_path):
    folder, profile = tmp_path / "lab", tmp_path / "rig.toml"
    folder.mkdir()
    test = tests[0]
    channel = rows(test.t, 1e3 * test.x, test.f, 0 * test.t + 2.5)
    put(folder / "a.csv", ["time (s),stroke (mm),force (N),current monitor (V)", *channel])
    (refusal,) = import_files([folder]).refusals
    assert "[channels.current] unit" in refusal.error.remedy
    CliRunner().invoke(application(), ["import", str(folder), "--write-profile", str(profile)])
    lines = profile.read_text(encoding="utf-8").splitlines()
    start = lines.index("#[channels.current]")
    wanted = [line[1:] for line in lines[start : start + 4]]
    profile.write_text("\n".join([*lines[:start], *wanted[:-1], wanted[-1] + " 0.4"]), encoding="utf-8")
    (record,) = import_files([folder], profile).records
    np.testing.assert_allclose(record.current, 1.0)


def test_without_out_the_files_and_the_mapping_are_shown(tests, tmp_path):
    KINDS["french_headings"](tests, tmp_path)
    done = CliRunner().invoke(application(), ["import", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert "Temps [s]" in done.output
    assert "force = Effort (daN) in daN" in done.output
    assert "6 tests would be written, 0 refused" in done.output


def test_a_unit_that_is_missing_is_asked_for(tests, tmp_path):
    test = tests[2]
    put(tmp_path / "run_0.6A.csv", ["time,displacement_mm,force_N", *rows(test.t, 1e3 * test.x, test.f)])
    command = ["import", str(tmp_path), "--ask", "--out", str(tmp_path / "ds"), "--quiet"]
    done = CliRunner().invoke(application(), command, input="1\n")
    assert done.exit_code == 0, done.output
    assert "Unit of the time?" in done.output
    assert 'unit = "s"' in done.output


def test_an_answer_changes_the_profile():
    error = InputError("no unit", remedy='set [channels.force] unit = "..." in a profile', code="E_UNITS_MISSING")
    question = question_of(error)
    assert question is not None
    for answer in question.answers:
        assert answer.applied(Profile()).channel("force").unit == str(answer.value)


def test_physics_tells_a_dampers_force_in_any_units_and_with_the_right_sign_only(tests):
    test = tests[3]
    share = damping_share(test.t, test.x, test.f)
    assert share > 0.5
    assert damping_share(1e3 * test.t, 1e3 * test.x, test.f / 4.4) == pytest.approx(share, abs=1e-9)
    assert damping_share(test.t, test.x, -test.f) == 0.0
    assert damping_share(test.t, test.x, 5e4 * test.x) == 0.0
    assert damping_share(test.t, test.x, np.random.default_rng(0).normal(0, 1, test.t.size)) < 0.2


@pytest.mark.parametrize(
    ("heading", "scale"), [("Coil current (A)", 1), ("coil_mA", 1000), ("Bestromung [A]", 1), ("Coil (V)", 0)]
)
def test_a_table_of_results_names_its_currents(heading, scale):
    results = results_in([f"No;{heading}", f"1;{0.4 * scale:g}", f"2;{0.8 * scale:g}"])
    assert (results.current if results else ()) == (pytest.approx((0.4, 0.8)) if scale else ())


def test_a_table_of_results_that_two_columns_tell_differently_states_nothing():
    results = results_in(["No;Specimen;Coil current (A)", "1;S2;0.5", "2;S1;1.0"])
    assert results is not None
    assert results.by_test([["1"], ["2"]]) == {0: 0.5, 1: 1.0}
    assert results.by_test([["S1"], ["S2"]]) == {0: 1.0, 1: 0.5}
    assert results.by_test([["1", "S1"], ["2", "S2"]]) == {}
    assert results.by_test([["S1"], ["S9"]]) == {}


def test_a_session_is_cut_at_its_rests_and_a_pause_is_not(tests, tmp_path):
    for folder in ("session", "pause"):
        (tmp_path / folder).mkdir()
    right("session_cut_by_rests", tests, tmp_path / "session")
    KINDS["session_cut_by_rests"]((tests[2], tests[2], tests[2]), tmp_path / "pause")
    assert len(import_files([tmp_path / "pause"]).records) == 1


def test_a_session_is_cut_at_the_steps_of_its_current_and_a_response_to_a_step_is_not(tests, tmp_path):
    for folder in ("session", "response"):
        (tmp_path / folder).mkdir()
    right("session_cut_by_steps_of_the_current", tests, tmp_path / "session")
    test = tests[2]
    stepped = np.where(test.t < 0.3, 0.0, 0.6)
    put(
        tmp_path / "response" / "a.csv",
        ["time_s,displacement_mm,force_N,current_A", *rows(test.t, 1e3 * test.x, test.f, stepped)],
    )
    assert len(import_files([tmp_path / "response"]).records) == 1


@pytest.mark.parametrize(
    ("rise_s", "noise_A", "step_A"), [(0.02, 0.003, 0.3), (0.1, 0.003, 0.3), (0.01, 0.01, 0.3), (0.02, 0.003, 0.05)]
)
def test_a_session_is_cut_at_steps_of_a_measured_current_whatever_its_coil_and_noise(rise_s, noise_A, step_A):
    t = np.arange(0, 40, 0.004)
    x = 0.01 * np.sin(2 * np.pi * 1.5 * t)
    since = t % 8
    current = step_A * (np.floor(t / 8) - np.where(t < 8, 0, np.exp(-since / rise_s)))
    noisy = current + np.random.default_rng(0).normal(0, noise_A, t.size)
    stretches = stretches_of_session(t, x, noisy)
    assert [round(float(np.mean(noisy[s])) / step_A, 1) for s in stretches] == [0, 1, 2, 3, 4]
    assert all(7 < t[s.stop - 1] - t[s.start] < 8.05 for s in stretches)
    assert all(np.ptp(current[s]) < 0.1 * step_A + 5 * noise_A for s in stretches)


def _currents_that_vary(t, x):
    speed = np.gradient(x, t)
    random = np.random.default_rng(1)
    return {
        "ramp": 0.05 * t,
        "ramps between levels": np.interp(t, [0, 8, 12, 20, 24, 40], [0, 0, 0.5, 0.5, 1, 1]),
        "sine": 0.5 + 0.5 * np.sin(2 * np.pi * 0.1 * t),
        "skyhook": np.where(speed * np.sin(2 * np.pi * 0.37 * t) > 0, 1.0, 0.0),
        "proportional": 20 * np.abs(speed),
        "steps at random": np.repeat(random.uniform(0, 1, 40), t.size // 40),
        "short steps": np.floor(t % 10 / 2) / 5,
        "random walk": np.abs(np.cumsum(random.normal(0, 0.01, t.size))),
    }


def test_a_record_whose_current_varies_all_the_time_is_one():
    t = np.arange(0, 40, 0.004)
    x = 0.01 * np.sin(2 * np.pi * t)
    noise = np.random.default_rng(0).normal(0, 0.003, t.size)
    currents = _currents_that_vary(t, x)
    tests = {kind: len(stretches_of_session(t, x, current + noise)) for kind, current in currents.items()}
    assert tests == dict.fromkeys(currents, 1)


def test_what_a_changing_current_does_to_the_force_is_no_fault_of_the_rig():
    t = np.arange(0, 40, 0.004)
    x = 0.01 * np.sin(2 * np.pi * t)
    current = 0.5 + 0.5 * np.sin(2 * np.pi * 0.05 * t)
    force = (200 + 800 * current) * np.tanh(np.gradient(x, t) / 0.005) + np.random.default_rng(0).normal(0, 2, t.size)
    findings = check_record(Record("a", t, x, force, current=current)).findings
    assert [finding.code for finding in findings] == ["W_CURRENT_VARIES"]
    assert "export each level as a test" in findings[0].text
    for name, told in (("a_3A", True), ("a_1A", False)):
        (finding,) = check_record(Record(name, t, x, force, current=current)).findings
        assert ("its name states 3 A: check that the channel is the coil's current" in finding.text) == told


def test_rows_that_begin_with_a_word_are_all_read(tmp_path):
    lines = ["mode,time_s,displacement_mm,force_N,current_A", *[f"hold,{i / 100},{i},{2 * i},0.5" for i in range(50)]]
    put(tmp_path / "a.csv", lines)
    with raw_tables(tmp_path / "a.csv") as (table,):
        assert table.read([1]).values[1].size == 50


def test_a_cut_into_too_many_tests_is_refused(tests):
    t = np.arange(0, 3 * 510, 0.02)
    x = np.where(t % 3 < 2, 0.01 * np.sin(2 * np.pi * t), 0.0)
    current = 0.5 * (np.floor(t / 3) % 2)
    assert len(stretches_of_session(t[: t.size // 2], x[: t.size // 2], current[: t.size // 2])) == 255
    with pytest.raises(InputError, match="510 tests") as refused:
        stretches_of_session(t, x, current)
    assert refused.value.code == "E_BLOCKS"


@pytest.mark.parametrize(
    ("pattern", "folder", "name"),
    [("*/I_{current}/*", "I_0.6", "a.csv"), ("t{run}_{current}_{frequency}Hz.csv", ".", "t7_0.6_1Hz.csv")],
)
def test_a_pattern_with_placeholders_finds_the_current_in_a_path(tests, tmp_path, pattern, folder, name):
    test = tests[2]
    (tmp_path / folder).mkdir(exist_ok=True)
    put(tmp_path / folder / name, ["time_s,displacement_mm,force_N", *rows(test.t, 1e3 * test.x, test.f)])
    found = import_files([tmp_path], parse_profile(f'[current]\npattern = "{pattern}"\nunit = "A"'))
    assert [float(record.current[0]) for record in found.records] == [0.6]
    found = import_files([tmp_path], parse_profile('[current]\npattern = "nothing_{current}A"\nunit = "A"'))
    assert [refusal.error.code for refusal in found.refusals] == ["E_CURRENT_MISSING"]


@pytest.mark.parametrize(
    ("text", "near"),
    [("[files]\n", "file"), ("[channels.force]\nuint = 'N'", "unit"), ("[curent]\nvalue = 1.0", "current")],
)
def test_an_unknown_key_of_a_profile_is_answered_with_the_nearest(text, near):
    with pytest.raises(InputError, match=f"did you mean {near}"):
        parse_profile(text)


def test_what_the_profile_leaves_out_is_named(tests, tmp_path):
    KINDS["daqexpress"](tests, tmp_path)
    (tmp_path / "acq1.csv").rename(tmp_path / "warmup1.csv")
    found = import_files([tmp_path], parse_profile('[file]\nleave_out = ["warmup*"]'))
    assert (len(found.records), found.left_out) == (len(tests) - 1, ("warmup1.csv",))


def test_channels_whose_clocks_do_not_overlap_are_refused(tests, tmp_path):
    test = tests[2]
    lines = [
        "x [s];s [mm];x [s];F [N];x [s];I [A]",
        *rows(test.t, 1e3 * test.x, test.t + 900, test.f, test.t, test.i, sep=";"),
    ]
    put(tmp_path / "apart.csv", lines)
    found = import_files([tmp_path])
    assert [refusal.error.code for refusal in found.refusals] == ["E_RASTER"]


def test_a_force_that_is_held_between_slow_samples_ends_in_a_verdict(tests, tmp_path):
    """Logged at 20 Hz and held to 200 Hz: refused or noted, never an error of the program."""
    for k, test in enumerate(tests):
        held = np.repeat(test.f[::10], 10)[: test.t.size]
        put(
            tmp_path / f"t{k}.csv",
            ["time_s,displacement_mm,force_N,current_A", *rows(test.t, 1e3 * test.x, held, test.i)],
        )
    found = import_files([tmp_path])
    assert len(found.records) + len({refusal.file for refusal in found.refusals}) == len(tests)


def test_a_sheet_with_a_heading_of_its_own_is_refused_and_leaving_it_out_takes_the_others(tests, tmp_path):
    """A test beside others must not be missing without a message because one heading is misspelt."""
    book = openpyxl.Workbook()
    for k, test in enumerate(tests[:3]):
        sheet = book.create_sheet(f"{test.current:g} A")
        sheet.append(["Time [s]", "Displacement [mm]", "Channel 3" if k == 1 else "Force [N]"])
        for row in np.column_stack([test.t, 1e3 * test.x, test.f]).tolist():
            sheet.append(row)
    book.save(tmp_path / "tests.xlsx")
    found = import_files([tmp_path])
    assert len(found.records) == 2
    (refusal,) = found.refusals
    assert refusal.error.code == "E_COLUMN"
    assert f"table {tests[1].current:g} A" in refusal.error.where
    remedy = re.search(r"set \[file\] (.*) in a profile", refusal.error.remedy)[1]
    left = import_files([tmp_path], parse_profile(f"[file]\n{remedy}"))
    assert len(left.records) == 2
    assert not left.refusals


def test_a_plan_that_contradicts_the_names_is_refused(tests, tmp_path):
    KINDS["plan_that_agrees_with_the_names"](tests, tmp_path)
    plan = tmp_path / "test_matrix.csv"
    lines = plan.read_text().splitlines()
    shifted = [line.split(";")[1] for line in (*lines[-1:], *lines[1:-1])]
    wrong = [";".join([line.split(";")[0], current]) for line, current in zip(lines[1:], shifted, strict=True)]
    put(plan, ["file;current [A]", *wrong])
    found = import_files([tmp_path])
    assert {refusal.error.code for refusal in found.refusals} == {"E_CURRENT_CONTRADICTS"}
    assert len(found.records) < len(tests)


def test_conditions_beside_a_mapping_of_data_and_in_a_path_are_read(tests, tmp_path):
    for k, q in enumerate(tests):
        data = {"time_s": q.t.tolist(), "displacement_mm": (1e3 * q.x).tolist(), "force_N": q.f.tolist()}
        (tmp_path / f"test_{k}.json").write_text(json.dumps({"meta": {"current_A": q.current}, "data": data}))
    found = import_files([tmp_path])
    assert not found.refusals
    assert faults(tests, to_dataset(found.records)) == []
    assert currents_in("res/I_0p6A/f_0p5Hz") == (0.6,)
    assert currents_in("coil 2 A/V") == ()
    assert currents_in("test 3-0.6A") == currents_in("10mm-1.5Hz-0.6A") == currents_in("10-0.5-0.6A") == (0.6,)
