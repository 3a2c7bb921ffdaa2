"""Numbers, units and currents in the lines and columns beside a record, as loggers and scripts write them."""

import json

import h5py
import numpy as np
import pytest
from openpyxl import Workbook

from mrdamper.rig_files.column_names import role_of
from mrdamper.rig_files.conditions import currents_in, stated_by_lines, stated_quantities, stated_rate, without_currents
from mrdamper.rig_files.profile import parse_profile
from mrdamper.rig_files.rig_import import import_files

T = np.arange(0.0, 3.0, 0.005)
X = 10 * np.sin(2 * np.pi * T + 0.3)  # [mm]


def force(current):
    speed = np.cos(2 * np.pi * T + 0.3)
    return (200 + 400 * current) * speed + (80 + 300 * current) * np.tanh(speed / 0.02)


def currents_of(path):
    found = import_files([path])
    assert not found.refusals, str(found.refusals[0].error)
    return sorted(round(float(np.median(record.current)), 3) for record in found.records)


def rows(*columns, mark="."):
    return "\n".join(";".join(f"{v:.6g}".replace(".", mark) for v in row) for row in zip(*columns, strict=True)) + "\n"


def test_no_record_of_json_lines_is_cut(tmp_path):
    lines = [{"t_s": t, "pos_mm": x, "load_N": f, "I_A": 0.5} for t, x, f in zip(T, X, force(0.5), strict=True)]
    time = np.arange(4 * T.size) * 0.005
    lines = [{**lines[i % T.size], "t_s": round(float(t), 6)} for i, t in enumerate(time)]
    (tmp_path / "a.jsonl").write_text("\n".join(map(json.dumps, lines)))
    (record,) = import_files([tmp_path / "a.jsonl"]).records
    assert record.time.size == len(lines) > 2000


def test_json_lines_of_events_are_notes_about_the_records(tmp_path):
    lines = [{"ts": 1.7e9 + t, "pos_mm": x, "load_N": f} for t, x, f in zip(T, X, force(0.5), strict=True)]
    events = [{"event": "start", "run": 3, "current_A": 0.5}, {"event": "stop", "run": 3}]
    (tmp_path / "a.jsonl").write_text("\n".join(map(json.dumps, [events[0], *lines, events[1]])))
    assert currents_of(tmp_path / "a.jsonl") == [0.5]
    (tmp_path / "a.jsonl").write_text("\n".join(map(json.dumps, [*events, *lines, {"current_A": 1.5}])))
    (refusal,) = import_files([tmp_path / "a.jsonl"]).refusals
    assert refusal.error.code == "E_CURRENT_MISSING"
    for at, amperes in ((500, 1.0), (len(lines), 0.0), (500, "1 A"), (500, "off")):
        event = {"event": "coil off after test", "coil": {"current_A": amperes}, "current_A": amperes}
        (tmp_path / "a.jsonl").write_text("\n".join(map(json.dumps, [*lines[:at], event, *lines[at:]])))
        (refusal,) = import_files([tmp_path / "a.jsonl"]).refusals
        assert refusal.error.code == "E_CURRENT_MISSING"


@pytest.mark.parametrize(
    "title",
    ["corrente 0,5 A", "Courant 0,5 A", "Versuch 3, Strom 0,5 A", "Versuch 3, Strom 0,5 A, Frequenz 1 Hz",
     "Essai n°3, courant de 0,5 A", "Ensaio 3 - corrente 0,5 A, frequência 1 Hz", "Corrente: 0,5 A",
     "Strom 0,5 A; 1 Hz", "Prova 2 - I = 0,5 A, f = 1 Hz"],
)  # fmt: skip
def test_a_decimal_comma_separates_no_name_from_its_number(tmp_path, title):
    assert {s.amperes for s in stated_by_lines([title])} <= {0.5}
    text = title + "\nZeit (s);Weg (mm);Kraft (N)\n" + rows(T, X, force(0.5), mark=",")
    (tmp_path / "test.csv").write_text(text)
    assert currents_of(tmp_path) == [0.5]


def test_lines_of_cells_keep_their_separating_commas():
    assert [s.amperes for s in stated_by_lines(["Coil current,0.5,A", "Coil current, 0,5 A"])] == [0.5, 0.5]
    assert stated_rate(stated_quantities(["Abtastrate 200 Hz, Spulenstrom 0,00 A"])) == 200


def test_a_column_of_texts_that_state_a_current_tells_tests_apart(tmp_path):
    levels = (0.0, 0.5, 1.0)
    lines = [f'"I={q:.1f} A";{line}'.replace(".", ",") for q in levels for line in rows(T, X, force(q)).splitlines()]
    (tmp_path / "all.csv").write_text('"stufe";"zeit_s";"weg_mm";"kraft_N"\n' + "\n".join(lines) + "\n")
    assert currents_of(tmp_path) == [0.0, 0.5, 1.0]


def test_a_name_without_its_condition_is_a_channel_and_a_condition_is_none():
    assert currents_in("F(I=0.5A)[N]") == (0.5,)
    assert role_of(without_currents("F(I=0.5A)").strip()) == "force"
    assert role_of("corsa") == "displacement"
    assert role_of("corsa = 40") is None


@pytest.mark.parametrize(
    "head",
    [
        "# Abtastrate 200 Hz, Strom 0.5 A\n# Weg in mm, Kraft in N\n# Nr;Weg;Kraft\n",
        "Strom: 0.5 A\nData rate;200 Hz\nNr;Weg;Kraft\n#;mm;N\n",
        "Strom: 0.5 A\ndx [s];0.005;0.005\nNr;Weg [mm];Kraft [N]\n",
    ],
)
def test_units_and_rates_that_lines_state_are_taken(tmp_path, head):
    (tmp_path / "a.csv").write_text(head + rows(np.arange(T.size), X, force(0.5)))
    assert currents_of(tmp_path) == [0.5]


def test_ranges_below_the_units_are_no_row(tmp_path):
    head = "Sample rate;200;Hz\nCoil current;0.5;A\nName;Weg;Kraft\nUnits;mm;N\nFull scale;50;25000\n"
    (tmp_path / "a.csv").write_text(head + rows(np.arange(1, T.size + 1), X, force(0.5)))
    (record,) = import_files([tmp_path]).records
    np.testing.assert_allclose(record.force, force(0.5), atol=1e-3)


def test_one_value_for_all_columns_above_rows_that_begin_empty_is_no_row(tmp_path):
    head = '"TraceName";"LOAD";"LVDT"\n"VUnit";"N";"mm"\n"HResolution";0.005;0.005\n"HUnit";"s";"s"\n'
    head += '"Time";"10:31:22.123456";"10:31:22.123456"\n\n'
    (tmp_path / "a_0.5A.csv").write_text(
        head + "\n".join(";" + line for line in rows(force(0.5), X).splitlines()) + "\n"
    )
    (record,) = import_files([tmp_path]).records
    np.testing.assert_allclose(record.force, force(0.5), atol=1e-3)


def test_signs_apart_and_days_are_numbers(tmp_path):
    signed = [f"{t / 86400 + 45363:.11f};{x:+9.4f};{f:+9.2f}" for t, x, f in zip(T, X, force(0.5), strict=True)]
    signed = [line.replace("+", "+ ").replace("-", "- ") for line in signed]
    (tmp_path / "a_0.5A.csv").write_text("Timestamp;Weg;Kraft\nOLE;mm;N\n" + "\n".join(signed) + "\n")
    (record,) = import_files([tmp_path]).records
    np.testing.assert_allclose(record.time - record.time[0], T, atol=2e-6)


def test_rows_that_begin_with_their_meaning_give_the_names_above_the_paths(tmp_path):
    head = (
        "descriptor;time;s_Kolben;F_Kraft\npath;;Root/s_Kolben;Root/F_Kraft\nunit;s;mm;N\ntype;double;double;double\n"
    )
    body = "\n".join(";" + line for line in rows(T, X, force(0.5)).splitlines())
    (tmp_path / "a_0.5A.csv").write_text(head + body + "\n")
    assert currents_of(tmp_path) == [0.5]


def test_scales_in_a_line_of_labels_are_those_of_the_columns(tmp_path):
    head = "Vertical Units;V;V\nLabel;Displacement 10 mm/V;Force 1 kN/V\n\nTIME;CH1;CH2\n"
    (tmp_path / "a_0.5A.csv").write_text("Horizontal Units;s\n" + head + rows(T, X / 10, force(0.5) / 1000))
    (record,) = import_files([tmp_path]).records
    assert np.ptp(record.displacement) == pytest.approx(0.02, rel=1e-3)
    assert np.ptp(record.force) == pytest.approx(np.ptp(force(0.5)), rel=1e-3)


def test_a_short_text_beside_a_record_states_its_current(tmp_path):
    for i, current in enumerate((0.0, 1.5)):
        folder = tmp_path / f"Run {i}"
        folder.mkdir()
        (folder / "Daq.csv").write_text("Time;Position;Force\n(s);(mm);(N)\n" + rows(T, X, force(current)))
        (folder / "Variables.csv").write_text(f"Name,Value,Unit\nCoil_Current,{current:.3f},A\nFrequency,1.000,Hz\n")
    assert currents_of(tmp_path) == [0.0, 1.5]


def test_a_channel_a_file_with_its_axes_in_lines_is_joined_by_its_number(tmp_path):
    for run, current in ((1, 0.0), (2, 1.0)):
        channels = {"Displacement": (X, "mm"), "Force": (force(current), "N"), "Current": (0 * T + current, "A")}
        for name, (values, unit) in channels.items():
            head = f"X-Axis unit:\ts\nZ-Axis unit:\t{unit}\nIndex;X;Real\n"
            (tmp_path / f"Run{run}_{name}.txt").write_text(head + rows(np.arange(T.size), T, values))
    assert currents_of(tmp_path) == [0.0, 1.0]


def test_counts_with_scale_offset_and_unit_are_converted_and_their_units_may_stand_in_a_group(tmp_path):
    with h5py.File(tmp_path / "a_0.5A.h5", "w") as file:
        for name, values in (("t", T), ("x", X)):
            file.create_dataset(f"runs/1/{name}", data=values)
            file[f"units/{name}"] = {"t": "s", "x": "mm"}[name]
        counts = file.create_dataset("runs/1/F", data=np.round((force(0.5) - 20) / 0.5).astype("<i2"))
        counts.attrs.update({"scale": 0.5, "offset": 20.0, "unit": "N"})
    (record,) = import_files([tmp_path]).records
    np.testing.assert_allclose(record.force, force(0.5), atol=0.26)
    assert np.ptp(record.displacement) == pytest.approx(0.02, rel=1e-3)


@pytest.mark.parametrize(
    ("line", "currents"),
    [
        ("# 0.5 A;0.5 A;0.5 A;1 A;1 A;1 A", [0.5, 1.0]),
        ("# 0.5 A;0.5 A;1 A;1 A;1 A;1 A", []),
        ("# Ranges;2 A;5 A", []),
        ("# maximum currents today;2 A;5 A", []),
    ],
)
def test_titles_over_every_column_agree_within_a_test_and_are_no_ranges(tmp_path, line, currents):
    names = ";".join(f"time{i} [s];stroke{i} [mm];load{i} [N]" for i in (1, 2))
    (tmp_path / "a.csv").write_text(f"{line}\n{names}\n" + rows(T, X, force(0.5), T, 1.1 * X, force(1.0)))
    result = import_files([tmp_path / "a.csv"])
    assert [float(np.mean(record.current)) for record in result.records] == currents
    assert [record.id for record in result.records] == [f"a_{current:g}_A" for current in currents]
    assert {refusal.error.code for refusal in result.refusals} <= {"E_CURRENT_MISSING"}


@pytest.mark.parametrize("clock", ["x_Run{}", "x{}", "q_Run{}"])
def test_columns_in_a_unit_of_time_are_the_times_of_tests_beside_each_other(tmp_path, clock):
    names = ";".join(f"{clock.format(i)} [s];stroke_Run{i} [mm];load_Run{i} [N]" for i in (1, 2))
    text = f"# 0.5 A;0.5 A;0.5 A;1 A;1 A;1 A\n{names.replace('_Run', '') if clock == 'x{}' else names}\n"
    (tmp_path / "a.csv").write_text(text + rows(T, X, force(0.5), T, 1.1 * X, force(1.0)))
    records = import_files([tmp_path / "a.csv"]).records
    assert [float(np.mean(record.current)) for record in records] == [0.5, 1.0]
    assert all(np.allclose(record.time, T) for record in records)


def test_whole_numbers_of_a_sheet_beside_texts_with_decimal_commas_have_no_point(tmp_path):
    book = Workbook()
    book.active.append(["No", "Time [s]", "Travel [mm]", "Force [N]"])
    for row in zip(T, X, force(0.5), strict=True):
        book.active.append([1, *(f"{value:.4f}".replace(".", ",") for value in row)])
    book.save(tmp_path / "a_0.5A.xlsx")
    (record,) = import_files([tmp_path / "a_0.5A.xlsx"]).records
    assert np.allclose(record.force, force(0.5), atol=1e-3)


def test_the_name_of_a_sheet_states_the_current_of_each_of_its_tables(tmp_path):
    book = Workbook()
    for name, current in (("0 A", 0.0), ("0.5 A", 0.5)):
        sheet = book.create_sheet(name)
        for factor in (1.0, 1.5):
            sheet.append(["Time [s]", "Travel [mm]", "Force [N]"])
            for row in zip(T, factor * X, factor * force(current), strict=True):
                sheet.append([round(float(value), 4) for value in row])
            sheet.append([])
    del book["Sheet"]
    book.save(tmp_path / "a.xlsx")
    result = import_files([tmp_path / "a.xlsx"])
    assert [float(np.mean(record.current)) for record in result.records] == [0.0, 0.0, 0.5, 0.5]


@pytest.mark.parametrize(
    ("top", "heads", "conditions", "labels"),
    [
        ("", ["Disp_{} (mm)", "Force_{} (N)"], ["1Hz", "2Hz", "3Hz"], ["1hz", "2hz", "3hz"]),
        ("", ["Disp_{} (mm)", "Force_{} (N)"], ["0.5A_1Hz", "0.5A_2Hz", "0.5A_3Hz"], None),
        ("", ["Disp Run{} (mm)", "Force Run{} (N)"], "123", ["run1", "run2", "run3"]),
        ("", ["x{} (mm)", "F{} (N)"], "123", ["1", "2", "3"]),
        (",FL,FL,FR,FR,RL,RL\n", ["Disp (mm)", "Force (N)"], ["", "", ""], ["FL", "FR", "RL"]),
        (",FL,,FR,,RL\n", ["Disp (mm)", "Force (N)"], ["", "", ""], ["FL", "FR", "RL"]),
        (",Damper A,,Damper B,,Damper C,\n", ["x (mm)", "F (N)"], "   ", ["Damper_A", "Damper_B", "Damper_C"]),
        ("Coil,0.5 A\n", ["{} Disp (mm)", "{} Force (N)"], ["FL", "FR", "RL"], ["FL", "FR", "RL"]),
        (
            ",Test 4,Test 4,Test 5,Test 5,Test 6,Test 6\n",
            ["Disp (mm)", "Force (N)"],
            "   ",
            ["Test_4", "Test_5", "Test_6"],
        ),
    ],
)
def test_pairs_of_columns_whose_names_state_motion_number_or_corner_are_tests(tmp_path, top, heads, conditions, labels):
    rates = (0.7, 1.0, 1.4)
    motions = [2 * np.pi * rate * T for rate in rates]
    pairs = [of for p in motions for of in (10 * np.sin(p), 300 * np.cos(p) + 90 * np.tanh(50 * np.cos(p)))]
    names = ["Time (s)", *(head.format(c) for c in conditions for head in heads)]
    body = rows(T, *pairs).replace(";", ",")
    (tmp_path / "run_0.5A.csv").write_text(top + ",".join(names) + "\n" + body)
    result = import_files([tmp_path])
    assert not result.refusals, result.refusals[0].error
    assert labels is None or [r.id for r in result.records] == [f"run_0.5A_{label}" for label in labels]
    assert [r.current[0] for r in result.records] == [0.5] * 3
    for record, rate in zip(result.records, rates, strict=True):
        np.testing.assert_allclose(record.displacement, 0.01 * np.sin(2 * np.pi * rate * T), atol=1e-6)
        specimen = (
            record.id.removeprefix("run_0.5A_").replace("_", " ") if labels and labels[0] in ("FL", "Damper_A") else ""
        )
        assert (record.provenance.get("specimen", ""), record.rig) == (specimen, specimen)


def test_groups_of_columns_under_merged_headings_are_taken_by_the_columns_a_profile_states(tmp_path):
    """One that has no group's columns both is read as it says; a second group is not dropped in silence."""
    book = Workbook()
    book.active.append(["", "Front left", None, "Front right", None])
    book.active.append(["Time (s)", "Disp (mm)", "Force (N)", "Disp (mm)", "Force (N)"])
    for row in zip(T, X, force(0.5), 0.9 * X, 1.1 * force(0.5), strict=True):
        book.active.append([round(float(value), 5) for value in row])
    book.active.merge_cells("B1:C1")
    book.active.merge_cells("D1:E1")
    book.save(tmp_path / "run_0.5A.xlsx")
    every = import_files([tmp_path], parse_profile('rig = "axle 3"')).records
    assert [(r.id, r.rig) for r in every] == [
        ("run_0.5A_Front_left", "axle 3 Front left"), ("run_0.5A_Front_right", "axle 3 Front right")
    ]  # fmt: skip
    for moved, load, name, factors in ((4, 5, "run_0.5A_Front_right", (0.9, 1.1)), (2, 5, "run_0.5A", (1.0, 1.1))):
        profile = parse_profile(f"[channels.displacement]\ncolumn = {moved}\n[channels.force]\ncolumn = {load}\n")
        (record,) = import_files([tmp_path], profile).records
        assert record.id == name
        np.testing.assert_allclose(record.displacement, 1e-3 * factors[0] * X, atol=1e-7)
        np.testing.assert_allclose(record.force, factors[1] * force(0.5), atol=1e-4)
        (note,) = [finding.text for finding in record.findings if finding.code == "W_COLUMN"]
        assert ("not taken: Front left" if moved == 4 else "Disp (mm) (column 4) and Force (N) (column 3) not") in note


def test_a_line_on_all_columns_is_no_title_of_two_tests(tmp_path):
    names = ["Time (s)", *(f"{name}_{mark}" for mark in ("upper", "lower") for name in ("Disp (mm)", "Force (N)"))]
    body = rows(T, X, force(0.5), X + 0.02 * np.sin(99 * T), force(0.5) * 1.01)
    (tmp_path / "run.csv").write_text("Coil current;0.5 A\n" + ";".join(names) + "\n" + body)
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_AMBIGUOUS"}


@pytest.mark.parametrize("marks", [("1", "2"), ("upper", "lower"), ("1Hz", "2Hz")])
def test_two_sensors_of_a_motion_are_two_tests_only_where_a_profile_splits_them(tmp_path, marks):
    names = ["Time (s)", *(name.format(mark) for mark in marks for name in ("Disp_{} (mm)", "Force_{} (N)"))]
    pairs = (X, force(0.5), X + 0.02 * np.sin(99 * T), force(0.5) * 1.01)
    (tmp_path / "run_0.5A.csv").write_text(";".join(names) + "\n" + rows(T, *pairs))
    result = import_files([tmp_path])
    assert {refusal.error.code for refusal in result.refusals} == {"E_AMBIGUOUS"}
    assert all('[file] blocks = "split"' in refusal.error.remedy for refusal in result.refusals)
    (tmp_path / "rig.toml").write_text('[file]\nblocks = "split"\n')
    assert len(import_files([tmp_path / "run_0.5A.csv"], tmp_path / "rig.toml").records) == 2


def test_a_first_refusal_of_several_sheets_asks_for_their_currents_too(tmp_path):
    book = Workbook()
    for name in ("a", "b"):
        sheet = book.create_sheet(name)
        for row in (("p1", "p2", "p3"), *zip(T.tolist(), X.tolist(), force(0.5).tolist(), strict=True)):
            sheet.append(row)
    del book["Sheet"]
    book.save(tmp_path / "a.xlsx")
    refusals = import_files([tmp_path]).refusals
    assert "and give the current of each test" in refusals[-1].error.remedy


def test_numbered_pairs_are_tests_where_one_has_no_second_sensor(tmp_path):
    names = ["Time (s)", *(name.format(n) for n in (1, 2, 3) for name in ("Disp_{} (mm)", "Force_{} (N)"))]
    pairs = (column for amperes in (0.0, 1.0, 1.1) for column in (X, force(amperes)))  # the force saturates
    (tmp_path / "run.csv").write_text(";".join(names) + "\n" + rows(T, *pairs))
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}
