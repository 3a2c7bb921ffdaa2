"""Names, clocks, units and tests that a file states in another place than its row of names."""

import re

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from mrdamper.cli.output import finding_lines
from mrdamper.rig_files import tests_table
from mrdamper.rig_files.mapping.proposals import displacement_of
from mrdamper.rig_files.preview import question_of
from mrdamper.rig_files.profile import parse_profile
from mrdamper.rig_files.profile_template import profile_template
from mrdamper.rig_files.rig_import import found_tests, import_files
from mrdamper.rig_files.rig_record import recording_time

T = np.arange(0.0, 3.0, 0.01)
X = 10 * np.sin(2 * np.pi * T + 0.3)  # [mm]


def force(current):
    return (150 + 400 * current) * np.tanh(8 * np.cos(2 * np.pi * T + 0.3))


def table(path, head, *columns):
    lines = [",".join(f"{value:.6g}" for value in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([*head, *lines, ""]))


def imported(path):
    found = import_files([path])
    assert not found.refusals, str(found.refusals[0].error)
    return [
        (record.current[0], np.ptp(record.displacement) / 2, np.max(np.abs(record.force))) for record in found.records
    ]


def expect(path, *currents):
    assert imported(path) == [pytest.approx((i, 0.01, np.max(np.abs(force(i)))), rel=2e-3, abs=1e-9) for i in currents]


def test_names_listed_in_a_remark_with_other_separators_and_the_sense_of_a_load_cell_count(tmp_path):
    head = [
        "% coil current: 0.50 A",
        "% load cell: compression positive",
        "% columns: time [s]; displacement [mm]; load [N]",
    ]
    table(tmp_path / "a.txt", head, T, X, -force(0.5))
    expect(tmp_path, 0.5)


@pytest.mark.parametrize("between", ["\t", "   "])
def test_a_list_of_channels_has_cells_between_tabs_or_columns_of_spaces(tmp_path, between):
    """Only a list without tabs has its cells between spaces: a name may hold two."""
    clock = "Zeit  1 - Standardmessrate" if between == "\t" else "Time"
    channels = [("1", clock, "s", "500"), ("2", "Stroke", "mm", "500"), ("3", "Load", "N", "500")]
    head = [between.join(cells) for cells in [("No", "Name", "Unit", "Rate"), *channels]]
    head += ["", "\t".join(cells[1] for cells in channels)]
    lines = ["\t".join(f"{value:.6g}" for value in row) for row in zip(T, X, force(0.5), strict=True)]
    (tmp_path / "a_0.5A.asc").write_text("\n".join([*head, *lines, ""]))
    expect(tmp_path, 0.5)


@pytest.mark.parametrize("line", ["Units: force=N, time=s, displacement=mm", "time = s; displacement = mm; force = N"])
def test_a_line_gives_every_channel_its_unit_behind_an_equals_sign(tmp_path, line):
    table(tmp_path / "a_0.5A.txt", [line, "time,displacement,force"], T, X, force(0.5))
    expect(tmp_path, 0.5)


@pytest.mark.parametrize(
    ("line", "scale"),
    [
        ("Note: multiply force by 2 (lever 2:1)", 2),
        ("Kraft mit 2,5 multiplizieren", 2.5),
        ("Displacement multiplied by 1", 1),
        ("Temperature: multiply by 10", 1),
        ("Multiple sines of force and stroke at 2 Hz", 1),
        ("Multiplexed: force, 10 channels", 1),
    ],
)
def test_a_factor_that_a_line_states_is_asked_about_and_its_remedy_works(tmp_path, line, scale):
    table(tmp_path / "a_0.5A.txt", [f"# {line}", "time [s],displacement [mm],force [N]"], T, X, force(0.5) / scale)
    if scale != 1:
        (refusal,) = import_files([tmp_path]).refusals
        assert refusal.error.code == "E_AMBIGUOUS"
        assert f'[channels.force] unit = "N" and scale = {scale}' in refusal.error.remedy
        assert question_of(refusal.error) is None  # two keys
    profile = parse_profile(f'[channels.force]\nunit = "N"\nscale = {scale}' if scale != 1 else "")
    (record,) = import_files([tmp_path], profile).records
    assert record.force == pytest.approx(force(0.5), abs=1e-2)


def test_a_column_with_one_session_states_the_session_of_the_test(tmp_path):
    names = "time [s],displacement [mm],force [N],current [A],Session"
    table(tmp_path / "a.csv", [names], T, X, force(0.5), np.full(T.shape, 0.5), np.full(T.shape, 3))
    table(tmp_path / "b.csv", [names], T, X, force(1.0), np.full(T.shape, 1.0), (T > 1) + 3)
    notes = [record.provenance for record in import_files([tmp_path]).records]
    assert [note.get("session") for note in notes] == ["3", None]
    assert [note.get("ignored_columns") for note in notes] == [None, "Session"]


def test_channels_called_by_numbers_have_the_names_and_scales_that_a_line_gives_them(tmp_path):
    head = ["# channel 1: load cell 250 N/V; channel 2: LVDT 5 mm/V", "x-axis,1,2", "second,Volt,Volt"]
    table(tmp_path / "test_0.5A.csv", head, T, force(0.5) / 250, X / 5)
    expect(tmp_path, 0.5)


@pytest.mark.parametrize("aside", ["", " (a pull gives a negative voltage; the factor turns the sign)"])
def test_a_negative_scale_turns_the_sign_once(tmp_path, aside):
    table(tmp_path / "a_0.5A.csv", [f"# Load: -200 N/V{aside}", "time_s,stroke_mm,Load [V]"], T, X, -force(0.5) / 200)
    expect(tmp_path, 0.5)
    assert "sign_changed" not in import_files([tmp_path]).records[0].provenance


def test_counts_have_the_scale_that_a_line_gives_one_of_them(tmp_path):
    head = ["# encoder: 1 count = 5 um", "# load cell: 200 N/V", "time_s,encoder_counts,loadcell_V"]
    table(tmp_path / "test_0.5A.csv", head, T, 200 * X, force(0.5) / 200)
    expect(tmp_path, 0.5)


@pytest.mark.parametrize(
    "line", ["+/-10 V = +/-50 mm (stroke), +/-10 V = +/-2 kN (load)", "±5 V = ±25 mm; ±5 V = ±1 kN"]
)
def test_full_scales_on_both_sides_of_zero_scale_the_channels_and_each_is_told(tmp_path, line):
    table(tmp_path / "run_0.5A.csv", ["time [s],stroke [V],load [V]"], T, X / 5, force(0.5) / 200)
    (tmp_path / "README.txt").write_text(f"Outputs of the controller.\nFull scale: {line}\n")
    expect(tmp_path, 0.5)
    (record,) = import_files([tmp_path]).records
    lines = finding_lines(((record.id, finding) for finding in record.findings), verbose=False)
    assert sum("is scaled" in text for text in lines) == 2
    (tmp_path / "README.txt").write_text("Full scale: +/-10 V = 0 to 50 mm (stroke), +/-10 V = +/-2 kN (load)\n")
    assert import_files([tmp_path]).refusals


def test_counts_without_a_scale_are_refused_until_a_profile_states_it(tmp_path):
    table(tmp_path / "test_0.5A.csv", ["time_s,disp_counts,force_N"], T, 200 * X, force(0.5))
    for profile in (None, '[channels.displacement]\nunit = "mm"\n'):
        found = import_files([tmp_path], profile and parse_profile(profile))
        assert [(r.error.code, "scale" in r.error.remedy) for r in found.refusals] == [("E_UNITS_DIMENSION", True)]
    stated = parse_profile('[channels.displacement]\nunit = "mm"\nscale = 0.005\n')
    assert np.ptp(import_files([tmp_path], stated).records[0].displacement) == pytest.approx(0.02, rel=1e-3)


def test_channels_of_whole_numbers_beside_scales_are_asked_in_one_round(tmp_path):
    with h5py.File(tmp_path / "a_0.5A.h5", "w") as file:
        for name, values, unit in (
            ("time", T, "s"),
            ("stroke", np.round(100 * X), "mm"),
            ("load", force(0.5) // 1, "N"),
        ):
            file[name] = values if name == "time" else values.astype("<i2")
            file[name].attrs.update({"units": unit} | ({} if name == "time" else {f"{name}_scale": 0.5}))
    asked = {refusal.error.remedy.partition("]")[0] for refusal in import_files([tmp_path]).refusals}
    assert asked == {"set [channels.displacement", "set [channels.force"}


def test_letters_over_the_columns_of_a_sheet_are_no_units_and_names_with_units_answer(tmp_path):
    table(tmp_path / "test_0.5A.csv", ["A,B,C"], T, X, force(0.5))
    assert {r.error.code for r in import_files([tmp_path]).refusals} == {"E_COLUMN"}
    named = parse_profile('[file]\nnames = ["time [s]", "displacement [mm]", "force [N]"]\n')
    assert np.ptp(import_files([tmp_path], named).records[0].displacement) == pytest.approx(0.02, rel=1e-3)


@pytest.mark.parametrize(
    "line",
    ["Tekercsáram;0,5;A", "Natężenie prądu: 0,5 A", "Bobin akımı: 0,5 A", "Сила тока: 0,5 А", "Kelavirta: 0,5 A"],
)
def test_the_current_of_the_coil_is_known_in_many_languages(line, tmp_path):
    table(tmp_path / "a.csv", [line, "Time [s],Displacement [mm],Force [N],T [℃]"], T, X, force(0.5), 20 + T)
    expect(tmp_path, 0.5)


@pytest.mark.parametrize("encoding", ["koi8-r", "cp1251", "cp866"])
def test_names_in_an_older_encoding_are_read(encoding, tmp_path):
    path = tmp_path / "a.csv"
    table(path, ["Ток в обмотке: 0.5 А", "Время [с],Перемещение [мм],Усилие [Н]"], T, X, force(0.5))
    path.write_bytes(path.read_text("utf-8").encode(encoding))
    expect(tmp_path, 0.5)


@pytest.mark.parametrize(
    "head",
    [
        ["# coil driver: 100 % duty = 2.0 A", "# duty = 25 %"],
        ["[Header]", "CoilCurrent=0.50", "CoilCurrentUnit=A"],
        ["Bestromung [%];31,25", "Endstufe;100 % = 1,6 A"],
    ],
    ids=["a share", "the unit on a line of its own", "a share in the unit of its name"],
)
def test_a_current_that_two_lines_state_counts(head, tmp_path):
    table(tmp_path / "a.csv", [*head, "Time [s],Displacement [mm],Force [N]"], T, X, force(0.5))
    expect(tmp_path, 0.5)


@pytest.mark.parametrize(
    ("name", "clock"), [("Clock", "10:15:{:02.0f}"), ("Time [s]", "{:.1f}")], ids=["whole seconds", "tenths"]
)
def test_samples_are_counted_where_the_clock_repeats_itself_and_the_rate_is_stated(name, clock, tmp_path):
    coarse = [clock.format(np.floor(10 * t) / 10 if "1f" in clock else np.floor(t)) for t in T]
    rows = [f"{t},{x:.4f},{f:.3f}" for t, x, f in zip(coarse, X, force(0.5), strict=True)]
    head = f"{name},Displacement [mm],Force [N]\n"
    path = tmp_path / "a_0.5A.csv"
    path.write_text("Sample rate: 100 Hz\n" + head + "\n".join(rows))
    expect(tmp_path, 0.5)
    path.write_text(head + "\n".join(rows))
    (refusal,) = import_files([tmp_path]).refusals
    assert (refusal.error.code, "sample_rate_Hz" in refusal.error.remedy) == ("E_TIME_DUPLICATE", True)
    assert len(import_files([tmp_path], parse_profile("[file]\nsample_rate_Hz = 100\n")).records) == 1


def test_a_text_of_the_same_name_states_the_current_of_its_record(tmp_path):
    for n, current in enumerate((0.0, 0.5), 1):
        table(tmp_path / f"run{n}.csv", ["Time [s],Displacement [mm],Force [N]"], T, X, force(current))
        (tmp_path / f"run{n}.txt").write_text(f"Coil current: {current} A\n")
    expect(tmp_path, 0.0, 0.5)


@pytest.mark.parametrize(
    "plan",
    [
        "No;Current [A];Remark\n1;0;\n2;0.5;aborted\n2;0.5;\n",
        "Date;Current [A]\n12 March;2\n12 March;0\n12 March;0.5\n",
        "Step;Current [A]\n2;0\n3;0.5\n",
        "No;Coil A current [A];Coil B current [A]\n1;0;2\n2;0.5;2\n",
    ],
    ids=["a number twice", "a row more", "other numbers", "two coils"],
)
def test_rows_of_a_plan_are_not_counted_where_they_may_be_other_tests(plan, tmp_path):
    for n, current in enumerate((0.0, 0.5), 1):
        table(tmp_path / f"run{n}.csv", ["Time [s],Displacement [mm],Force [N]"], T, X, force(current))
    (tmp_path / "plan.csv").write_text(plan)
    found = import_files([tmp_path])
    assert {refusal.error.code for refusal in found.refusals} == {"E_CURRENT_MISSING"}
    assert found.left_out == ("plan.csv",)


@pytest.mark.parametrize(
    ("key", "head", "cells"),
    [
        ("Corner", "Corner,{}", ("RR", "LF", "RF", "LR")),
        ("S/N", "Serial number,{}", ("1204", "1187", "1188", "1203")),
        ("Test name", "Test name: {}", ("RR rebound", "LF rebound", "RF rebound", "LR rebound")),
        ("Start time", "Start,{}", [f"2024-05-14 {hour}:15:00" for hour in (13, 10, 11, 12)]),
    ],
)
def test_rows_of_a_plan_are_those_of_the_tests_whose_head_lines_state_the_same_in_whatever_order(
    key, head, cells, tmp_path
):
    currents = (1.1, 0.3, 0.5, 0.9)  # of the rows; the files are numbered in another order
    of = dict(zip(cells, currents, strict=True))
    for number, cell in enumerate(sorted(cells), 1):
        lines = ["Dyno,Roehrig", head.format(cell), "Time (s),Displacement (mm),Force (N)"]
        table(tmp_path / f"shock_{number}.csv", lines, T, X, force(of[cell]))
    rows = [f"{cell},{current}" for cell, current in of.items()]
    (tmp_path / "summary.csv").write_text("\n".join([f"{key},Current (A)", *rows, ""]))
    expect(tmp_path, *(of[cell] for cell in sorted(cells)))
    (found,) = {tuple(record.provenance["current_from"] for record in import_files([tmp_path]).records)}
    assert set(found) == {"summary.csv, Current (A)"}


@pytest.mark.parametrize("order", [(0.3, 0.5, 0.9, 1.1), (1.1, 0.5, 0.3, 0.9)])
def test_rows_in_another_order_than_the_tests_are_refused_where_their_peak_forces_show_it(order, tmp_path):
    for number, current in enumerate((0.3, 0.5, 0.9, 1.1), 1):
        table(tmp_path / f"run_{number}.csv", ["Time (s),Displacement (mm),Force (N)"], T, X, force(current))
    rows = [f"{current},{np.max(force(current)) + 60:.0f}" for current in order]
    (tmp_path / "summary.csv").write_text("\n".join(["Current (A),Peak force (N)", *rows, ""]))
    found = import_files([tmp_path])
    if order[0] == 0.3:
        assert [record.current[0] for record in found.records] == list(order)
    else:
        assert {refusal.error.code for refusal in found.refusals} == {"E_MOTION_CONTRADICTS"}
        assert "another order" in str(found.refusals[0].error)


@pytest.mark.parametrize(
    ("line", "unit", "code"),
    [
        ("Force: 1 mV/V = 10 kN", "mV/V", None), ("Load cell: 20 kN per 2 mV/V", "mV/V", None),
        ("Load cell: 2 mV/V = 20 kN", "V", "E_UNITS_DIMENSION"), ("", "mV/V", "E_UNITS_DIMENSION"),
    ],
)  # fmt: skip
def test_a_load_cells_sensitivity_scales_what_is_in_mv_per_v_and_no_volts(line, unit, code, tmp_path):
    names = f"Time [s],Displacement [mm],Force [{unit}]"
    table(tmp_path / "a_0.5A.csv", [line, names], T, X, force(0.5) / 1e4)
    result = import_files([tmp_path])
    assert [refusal.error.code for refusal in result.refusals] == [code] * bool(code)
    assert all(record.force == pytest.approx(force(0.5), abs=0.1) for record in result.records)


@pytest.mark.parametrize(
    ("head", "shown"),
    [
        ("Fuse: 10 A", "'Fuse: 10 A' (of a limit, a supply or another device)"),
        ("monitor: 1 A per V", "'monitor: 1 A per V' (a scale)"),
        ("Tests at 0.5 A and 1 A", "'Tests at 0.5 A and 1 A' (one of several: 0.5 A and 1 A)"),
        ("", "column 'I_set [A]' (a command, or one of several)"),
    ],
)
def test_currents_that_are_not_taken_are_named_where_one_is_missing(tmp_path, head, shown):
    columns = (T, X, force(0.5)) if head else (T, X, force(0.5), T)
    names = "Time [s],Displacement [mm],Force [N]" + ",I_set [A]" * (not head)
    table(tmp_path / "a.csv", [head, names], *columns)
    (refusal,) = import_files([tmp_path]).refusals
    assert refusal.error.found.endswith(f"; not taken for it: {shown}")
    assert refusal.error.remedy.startswith("if it is the coil's, set [channels.current]") == (not head)


@pytest.mark.parametrize("ends", ["force_low_N,force_high_N", "force_lower_N,force_upper_N"])
def test_a_predicted_force_is_not_taken_for_a_measured_one(tmp_path, ends):
    names = f"time_s,displacement_mm,force_N,{ends},current_A"
    table(tmp_path / "a.csv", [names], T, X, force(0.5), force(0.5) - 9, force(0.5) + 9, 0.5 + 0 * T)
    (refusal,) = import_files([tmp_path]).refusals
    assert refusal.error.code == "E_COLUMN"
    (record,) = import_files([tmp_path], parse_profile('[channels.force]\ncolumn = "force_N"\n')).records
    assert record.force == pytest.approx(force(0.5), abs=0.01)


def test_a_number_that_is_not_taken_for_the_current_is_one_answer_away(tmp_path):
    """The refusal names it and its line of the profile, and the written profile holds that line as a comment."""
    for name, current in (("a", 0.5), ("b", 1.0)):
        channels = {"Time [s]": T, "Displacement [mm]": X, "Force [N]": force(current)}
        np.savez(tmp_path / f"{name}.npz", **channels, **{"Supply current [A]": current})
    refusals = import_files([tmp_path]).refusals
    line = '[channels.current] column = "Supply current [A]"'
    assert {refusal.error.remedy.partition(" in a profile")[0] for refusal in refusals} == {
        f"if it is the coil's, set {line}"
    }
    written, _ = profile_template([tmp_path], parse_profile(""))
    for answered in (
        line.replace("] column", "]\ncolumn"),
        re.sub("(?m)^#(?=.channels.current|column = .Sup)", "", written),
    ):
        records = import_files([tmp_path], parse_profile(answered)).records
        assert [float(record.current[0]) for record in records] == [0.5, 1.0]


def test_two_currents_are_named_where_either_may_be_that_of_the_coil(tmp_path):
    names = "Time [s],Displacement [mm],Force [N],Coil 1 current [A],Coil 2 current [A]"
    table(tmp_path / "a.csv", [names], T, X, force(0.5), 0.5 + 0 * T, 0.3 + 0 * T)
    (refusal,) = import_files([tmp_path]).refusals
    assert "Coil 1 current [A]' and 'Coil 2 current [A]' may both" in refusal.error.found
    stated = parse_profile('[channels.current]\ncolumn = "Coil 1 current [A]"\n')
    assert import_files([tmp_path], stated).records[0].current[0] == 0.5


@pytest.mark.parametrize(
    "line",
    [
        "Comment: current raised by 0.4 A every 8 cycles", "coil current checked at 1 A, then switched off",
        "coil current step 0.5 A", "Spulenstrom um 0,4 A erhöht", "Coil current (zero-check): 0.00 A",
        "Courant augmenté de 0,5 A", "steps of 0.5 A", "LMS Test.Lab Rev 14A", "cCC: tenths of an ampere (c05 = 0.5 A)",
    ],
)  # fmt: skip
def test_a_line_about_a_change_or_a_check_of_the_current_states_none(line, tmp_path):
    table(tmp_path / "a.csv", [line, "Time [s],Displacement [mm],Force [N]"], T, X, force(0.5))
    (refusal,) = import_files([tmp_path]).refusals
    assert refusal.error.code == "E_CURRENT_MISSING"


@pytest.mark.parametrize("key", ["verified", "(verified)", "reduced to", "geprüft"])
def test_a_current_that_was_checked_or_changed_to_is_that_of_the_test(key, tmp_path):
    head = [f"Coil current {key}: 0.5 A", "Time [s],Displacement [mm],Force [N]"]
    table(tmp_path / "a.csv", head, T, X, force(0.5))
    assert [r.current[0] for r in import_files([tmp_path]).records] == [0.5]
    table(tmp_path / "a_1.0A.csv", head, T, X, force(0.5))
    assert [r.error.code for r in import_files([tmp_path / "a_1.0A.csv"]).refusals] == ["E_AMBIGUOUS"]


@pytest.mark.parametrize("line", ["Essai 3, courant de 0,5 A", "Test 3: corriente de 0,5 A", "current stage: 0.5 A"])
def test_a_line_about_the_current_of_the_test_is_no_change(line, tmp_path):
    table(tmp_path / "a.csv", [line, "Time [s],Displacement [mm],Force [N]"], T, X, force(0.5))
    expect(tmp_path, 0.5)


def test_a_line_counts_only_where_a_column_in_amperes_that_is_not_taken_has_its_current(tmp_path):
    names = "Time [s],Displacement [mm],Force [N],q1 [A],q2 [A]"
    for at, codes in ((0.5, []), (1.0, ["E_CURRENT_CONTRADICTS"])):
        table(tmp_path / "a.csv", ["Current: 0.5 A", names], T, X, force(0.5), at + 0 * T, np.sin(T))
        result = import_files([tmp_path])
        assert [refusal.error.code for refusal in result.refusals] == codes
    assert 'column = "q1 [A]"' in result.refusals[0].error.remedy
    (record,) = import_files([tmp_path], parse_profile('[current.values]\n"a" = 0.5')).records
    assert record.current[0] == 0.5


@pytest.mark.parametrize("name", ["iCoil_FL", "i_coil_rear", "iDmprCoil_2", "I_Spule_VL"])
def test_a_name_with_the_letter_of_a_current_and_the_coil_is_its_current(name, tmp_path):
    names = f"Time [s],Displacement [mm],Force [N],{name} [A],I_drive [A]"
    table(tmp_path / "a.csv", [names], T, X, force(0.5), 0.5 + 0 * T, 5 + 0 * T)
    expect(tmp_path, 0.5)


def test_channels_that_are_logged_in_turn_are_asked_for_with_one_clock(tmp_path):
    rows = [f"{t:.5f},{x:.4f},\n{t + 1e-3:.5f},,{f:.4f}" for t, x, f in zip(T, X, force(0.5), strict=True)]
    (tmp_path / "a_0.5A.csv").write_text("Time [s],Displacement [mm],Force [N]\n" + "\n".join(rows))
    (refusal,) = import_files([tmp_path]).refusals
    assert (refusal.error.code, "one clock" in refusal.error.remedy) == ("E_MISSING", True)


def test_a_page_heading_with_numbers_is_no_row(tmp_path):
    pages = [slice(n, n + 60) for n in range(0, T.size, 60)]
    rows = [f"{t:.4f} {x:.4f} {f:.3f}\n" for t, x, f in zip(T, X, force(0.5), strict=True)]
    heading = "\nMR DAMPER TEST 1      PAGE {}\nCOIL CURRENT 0.50 A\n TIME DISP FORCE\n S MM N\n"
    text = "".join(heading.format(n) + "".join(rows[page]) for n, page in enumerate(pages, 1))
    (tmp_path / "a.prn").write_text(text)
    expect(tmp_path, 0.5)


def test_minutes_of_one_digit_are_a_clock(tmp_path):
    rows = [
        f"{int(t + 59) // 60}:{(t + 59) % 60:06.3f},{x:.4f},{f:.3f}" for t, x, f in zip(T, X, force(0.5), strict=True)
    ]
    (tmp_path / "a_0.5A.csv").write_text("Time (min:s),Displacement [mm],Force [N]\n" + "\n".join(rows))
    expect(tmp_path, 0.5)


def test_a_clock_named_after_each_channel_is_the_time_of_that_channel(tmp_path):
    channels = {"Force_N": force(0.5), "Stroke_mm": X, "Current_A": np.full(T.shape, 0.5)}
    clocks = {f"time_{name}": T for name in channels}
    savemat(tmp_path / "a.mat", {**channels, **clocks, "Sample_rate": 100.0, "Start_time": "2023-04-12 09:11:00"})
    expect(tmp_path, 0.5)


def test_rows_of_tables_beside_a_vector_of_currents_are_tests(tmp_path):
    currents = np.array([0.0, 0.5, 1.0])
    forces = np.array([force(current) for current in currents])
    np.savez(tmp_path / "a.npz", time_s=T, displacement_mm=np.tile(X, (3, 1)), force_N=forces, current_A=currents)
    expect(tmp_path, *currents)
    np.savez(tmp_path / "a.npz", time_s=T, displacement_mm=np.tile(X, (3, 1)), force_N=forces)
    assert [refusal.error.code for refusal in import_files([tmp_path]).refusals] == ["E_CURRENT_MISSING"] * 3


@pytest.mark.parametrize("text", ["columns: time [s], displacement [mm], force [N]", ""])
def test_matrices_whose_names_tell_no_channel_are_tests(tmp_path, text):
    tests = {
        f"I{i}A".replace(".", "p"): np.column_stack([T, X, force(i)])[: 250 + 25 * n] for n, i in enumerate((0.0, 0.5))
    }
    savemat(tmp_path / "all.mat", {**tests, "info": text})
    stated = "".join(
        f'[channels.{role}]\ncolumn = {i}\nunit = "{unit}"\n'
        for i, (role, unit) in enumerate({"time": "s", "displacement": "mm", "force": "N"}.items(), 1)
    )
    found = import_files([tmp_path], None if text else parse_profile(stated))
    assert [(record.current[0], record.time.size) for record in found.records] == [(0.0, 250), (0.5, 275)]


def test_a_current_in_the_first_row_of_each_test_is_that_of_its_other_rows(tmp_path):
    lines = ["Test,Current [A],Time [s],Displacement [mm],Force [N]"]
    for n, i in enumerate((0.0, 0.5), 1):
        rows = zip(T, X, force(i), strict=True)
        lines += [
            f"{n if k == 0 else ''},{i if k == 0 else ''},{t:.3f},{x:.5f},{f:.4f}" for k, (t, x, f) in enumerate(rows)
        ]
    (tmp_path / "all.csv").write_text("\n".join([*lines, ""]))
    expect(tmp_path, 0.0, 0.5)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_arrays_over_two_conditions_have_their_samples_along_any_dimension(tmp_path, axis):
    forces = np.array([[force(current) * share for share in (1.0, 0.9)] for current in (0.0, 0.5, 1.0)])
    arrays = {"displacement_mm": np.broadcast_to(X, forces.shape), "force_N": forces}
    arrays = {name: np.moveaxis(array, -1, axis) for name, array in arrays.items()}
    np.savez(tmp_path / "a.npz", time_s=T, **arrays, current_A=[0.0, 0.5, 1.0], temperature_degC=[20.0, 40.0])
    tests = import_files([tmp_path]).records
    assert [float(np.mean(test.current)) for test in tests] == pytest.approx([0.0, 0.0, 0.5, 0.5, 1.0, 1.0])
    for test, expected in zip(tests, forces.reshape(6, -1), strict=True):
        np.testing.assert_array_equal(test.force, expected)


@pytest.mark.parametrize("cube", [False, True], ids=["a clock a test", "a cube"])
def test_tests_of_different_lengths_in_one_array_are_cut_where_they_end(tmp_path, cube):
    tests = np.full((3, 3, T.size), np.nan)
    for n, current in enumerate((0.0, 0.5, 1.0)):
        stop = T.size - 100 * n
        tests[n, :, :stop] = np.array([T, X, force(current)])[:, :stop]
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["current_A"] = [0.0, 0.5, 1.0]
        if cube:
            file["data"] = tests
            file["data"].attrs.update({"channels": ["time [s]", "displacement [mm]", "force [N]"]})
        else:
            for name, values in zip(("time_s", "disp_mm", "force_N"), np.swapaxes(tests, 0, 1), strict=True):
                file[name] = values
    expect(tmp_path, 0.0, 0.5, 1.0)
    assert [r.time.size for r in import_files([tmp_path]).records] == [T.size, T.size - 100, T.size - 200]


def cells_with_headings(path, rows):
    """Store a cell array as MATLAB 7.3 does: references, its dimensions the other way round."""
    with h5py.File(path, "w", userblock_size=512) as file:
        store = file.create_group("#refs#")
        cells = np.empty((len(rows[0]), len(rows)), dtype=h5py.ref_dtype)
        for (r, c), cell in ((at, rows[at[0]][at[1]]) for at in np.ndindex(len(rows), len(rows[0]))):
            text = isinstance(cell, str)
            value = [[ord(letter)] for letter in cell] if text else np.reshape(cell, (1, -1))
            item = store.create_dataset(f"{r}_{c}", data=value)
            item.attrs["MATLAB_class"] = np.bytes_("char" if text else "double")
            cells[c, r] = item.ref
        file.create_dataset("results", data=cells).attrs["MATLAB_class"] = np.bytes_("cell")
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path.write_bytes(head.ljust(512, b"\0") + path.read_bytes()[512:])


@pytest.mark.parametrize("version", ["5", "7.3"])
@pytest.mark.parametrize("form", ["a test a row", "a sample a row"])
def test_a_cell_array_below_a_row_of_headings_is_a_table(tmp_path, version, form):
    if form == "a test a row":
        heads = ["Test", "Coil current (A)", "Time (s)", "Stroke (mm)", "Load (N)"]
        rows = [heads, *([float(n), i, T, X, force(i)] for n, i in enumerate((0.0, 0.5, 1.0), 1))]
    else:
        samples = zip(T[::3], X[::3], force(0.5)[::3], strict=True)
        rows = [["Time (s)", "Stroke (mm)", "Load (N)"], *(list(map(float, row)) for row in samples)]
    if version == "5":
        cells = np.empty((len(rows), len(rows[0])), dtype=object)
        for at in np.ndindex(cells.shape):
            cells[at] = rows[at[0]][at[1]]
        savemat(tmp_path / "mr_0.5A.mat" if form == "a sample a row" else tmp_path / "mr.mat", {"results": cells})
    else:
        cells_with_headings(tmp_path / ("mr_0.5A.mat" if form == "a sample a row" else "mr.mat"), rows)
    expect(tmp_path, *((0.0, 0.5, 1.0) if form == "a test a row" else (0.5,)))


README = """{0}1{1}time (s)
{0}2{1}rod position (mm), encoder
{0}3{1}load cell amplifier output (V), sensitivity 200 N/V, tension positive
{0}4{1}coil current (A)
"""


@pytest.mark.parametrize(
    ("before", "behind"),
    [("  row ", "  "), ("data[", "] "), ("- data(:,", "): "), ("data(", ",:) = "), ("ligne ", " - ")],
)
def test_channels_of_a_matrix_that_a_readme_describes_by_their_numbers(tmp_path, before, behind):
    for n, i in enumerate((0.0, 0.5)):
        savemat(tmp_path / f"r{n}.mat", {"data": np.array([T, X, force(i) / 200, np.full(T.size, i)])})
    (tmp_path / "README.txt").write_text(README.format(before, behind))
    expect(tmp_path, 0.0, 0.5)


@pytest.mark.parametrize("list_of_two", [False, True])
def test_files_of_one_channel_each_are_told_apart_by_a_text_that_describes_their_names(tmp_path, list_of_two):
    for n, i in enumerate((0.0, 0.5)):
        for part, values in (("A", X / 4), ("B", force(i) / 200), ("C", np.full(T.size, i))):
            table(tmp_path / f"{part}_rec{n:03}.csv", ["Time,Ampl"], T, values)
    lines = [
        "time in s, Ampl in V",
        "A = laser sensor, 4 mm/V",
        "B = load cell, 200 N/V",
        "C = Hall probe, coil, 1 A/V",
    ]
    lines += ["A = wire sensor, 5 mm/V"] if list_of_two else []
    (tmp_path / "wiring.txt").write_text("\n".join([*lines, ""]))
    if list_of_two:
        assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} >= {"E_COLUMN"}
    else:
        expect(tmp_path, 0.0, 0.5)


@pytest.mark.parametrize("cut", [0, 7])
def test_channels_of_values_in_rows_are_joined_and_must_have_the_number_of_values_they_state(tmp_path, cut):
    for n, i in enumerate((0.0, 0.5)):
        for kind, what, values in (("DT2", "DISPLACEMENT", X / 25.4), ("FT2", "FORCE", force(i) / 1e3)):
            numbers = [f"{value:15.7E}" for value in values][: T.size - cut if kind == "FT2" and n else None]
            rows = ["".join(numbers[k : k + 5]) for k in range(0, len(numbers), 5)]
            unit = "IN" if kind == "DT2" else "KN"
            head = [f"TEST {n}, COIL CURRENT {i:.2f} A", f"{what} TIME SERIES IN UNITS OF {unit}"]
            text = "\n".join([*head, f"NPTS= {T.size}, DT=   .0020 SEC", *rows, ""])
            (tmp_path / f"RUN{n}.{kind}").write_text(text)
    if cut:
        assert "E_TRUNCATED" in {refusal.error.code for refusal in import_files([tmp_path]).refusals}
    else:
        expect(tmp_path, 0.0, 0.5)


def test_columns_are_called_by_the_names_that_the_message_lists(tmp_path):
    savemat(tmp_path / "r.mat", {"data": np.array([T, X, force(0.5), 0.1 * X, 0.3 * X])})
    refusals = import_files([tmp_path]).refusals
    assert "data[1], data[2]" in str(refusals[0].error)
    assert "give the current of each test" in str(refusals[-1].error)
    named = zip(("time", "displacement", "force"), ("s", "mm", "N"), (1, 2, 3), strict=True)
    text = "".join(f'[channels.{role}]\ncolumn = "data[{n}]"\nunit = "{unit}"\n' for role, unit, n in named)
    (record,) = import_files([tmp_path], parse_profile(f"{text}[current]\nvalue = 0.5\n")).records
    np.testing.assert_allclose(record.force, force(0.5))
    assert not [finding.text for finding in record.findings if "further tests" in finding.text]


@pytest.mark.parametrize("key", ["units", "Unidade", "birim", "単位", "единица", "Einheit"])
def test_an_attribute_has_the_unit_that_another_attribute_states(tmp_path, key):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for i, (current, unit) in enumerate([(500, "mA"), (1.0, "A")]):
            group = file.create_group(f"tests/T{i}")
            group.attrs.update({"current": current, "current_unit": unit})
            for name, unit_of, values in (
                ("time", "s", T),
                ("displacement", "mm", X),
                ("force", "N", force(0.5 + 0.5 * i)),
            ):
                group.create_dataset(name, data=values).attrs[key] = unit_of
    expect(tmp_path, 0.5, 1.0)


def test_a_column_with_two_units_in_attributes_is_refused_with_both(tmp_path):
    with h5py.File(tmp_path / "a_0.5A.h5", "w") as file:
        for name, unit, values in (("time", "s", T), ("displacement", "mm", X), ("force", "N", force(0.5))):
            file.create_dataset(name, data=values).attrs.update({"unit": unit, "units": unit.replace("N", "kN")})
    assert "column 'force' has the unit 'N or kN'" in str(import_files([tmp_path]).refusals[0].error)


@pytest.mark.parametrize(
    ("names", "unit", "codes"),
    [
        ("time [s], displacement [mm], force [N]", "V", []), ("time_s, displacement_mm, force_N", "mm", []),
        ("time [s], displacement [mm], force", "N", []),
        ("time [s], displacement [mm], force", "V", ["E_UNITS_DIMENSION"]),
        ("time, displacement [mm], force [N]", "V", ["E_UNITS_MISSING"]),
    ],
)  # fmt: skip
def test_the_unit_of_a_whole_array_is_that_of_a_column_that_states_none(names, unit, codes, tmp_path):
    with h5py.File(tmp_path / "a_0.5A.h5", "w") as file:
        file.create_dataset("data", data=np.column_stack([T, X, force(0.5)])).attrs["units"] = unit
        file.attrs["columns"] = names
    assert [refusal.error.code for refusal in import_files([tmp_path]).refusals] == codes
    if not codes:
        expect(tmp_path, 0.5)


def test_a_recorded_velocity_is_integrated_and_said(tmp_path):
    velocity = 2 * np.pi * np.cos(2 * np.pi * T + 0.3) / 100  # [m/s]
    table(tmp_path / "test_0.5A.csv", ["time (s),velocity (m/s),force (N)"], T, velocity, force(0.5))
    expect(tmp_path, 0.5)
    assert any("integral" in finding.text for finding in import_files([tmp_path]).records[0].findings)


@pytest.mark.parametrize("zero", [0.0, 0.02, -0.1])
def test_the_zero_of_a_transducer_of_velocity_is_no_drift(zero):
    slope = 2 * np.pi * 0.01 * np.cos(2 * np.pi * T + 0.3) + zero
    np.testing.assert_allclose(displacement_of(T, slope), X / 1000, atol=1.2e-4)  # two fifths of a step at 0.06 m/s


def test_a_velocity_under_one_cycle_has_no_stated_position():
    assert displacement_of(T, T) is None


def test_a_displacement_measured_in_another_file_is_surer_than_the_integral_of_a_velocity(tmp_path):
    t = np.arange(0.0, 6.0, 0.002)
    x, v = 10 * np.sin(2 * np.pi * t), 0.02 * np.pi * np.cos(2 * np.pi * t)
    rows = np.column_stack([t, v, 300 * np.sign(v) + 4000 * v])
    np.savetxt(
        tmp_path / "rig_01_0.5A.csv", rows, delimiter=",", header="Time [s],Velocity [m/s],Force [N]", comments=""
    )
    alone = import_files([tmp_path])
    assert [f.code for f in alone.records[0].findings if "integral" in f.text] == ["W_CHOSEN"]
    moved = np.column_stack([t, x + 3.0])  # a mean position that no velocity states
    np.savetxt(tmp_path / "lvdt_01_0.5A.csv", moved, delimiter=",", header="Time [s],Position [mm]", comments="")
    found = import_files([tmp_path])
    assert [refusal.error.code for refusal in found.refusals] == []
    assert len(found.records) == 1
    np.testing.assert_allclose(found.records[0].displacement, 1e-3 * (x + 3.0), atol=1e-9)
    assert not any("integral" in finding.text for finding in found.records[0].findings)


@pytest.mark.parametrize(
    ("currents", "value", "codes"),
    [((0.5, 0.5), 0.5, []), ((0.5, 0.5), 1.2, ["E_CURRENT_CONTRADICTS"]), ((0.2, 1.0), 0.6, ["E_CURRENT_CONTRADICTS"])],
)
def test_a_current_of_the_profile_is_compared_with_a_channel_that_the_profile_does_not_name(
    tmp_path, currents, value, codes
):
    t = np.arange(0.0, 6.0, 0.002)
    x, v = 10 * np.sin(2 * np.pi * t), 0.02 * np.pi * np.cos(2 * np.pi * t)
    current = np.where(t < 3, *currents)
    table = np.column_stack([t, x, 300 * np.sign(v) + 4000 * v, current])
    names = "Time [s],Position [mm],Force [N],Current [A]"
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header=names, comments="")
    found = import_files([tmp_path], parse_profile(f"[file]\nblocks = 'join'\n[current]\nvalue = {value}"))
    assert [refusal.error.code for refusal in found.refusals] == codes
    assert [float(np.mean(record.current)) for record in found.records] == ([] if codes else [value])


@pytest.mark.parametrize("in_one_file", [False, True])
def test_a_current_of_two_digits_beside_one_with_a_zero_first_is_asked_and_answered_by_the_table(tmp_path, in_one_file):
    t = np.arange(0.0, 6.0, 0.002)
    x, v = 0.01 * np.sin(2 * np.pi * t), 0.02 * np.pi * np.cos(2 * np.pi * t)
    tests = {"00A": 0.0, "05A": 0.5, "15A": 1.5}
    forces = {tag: (300 + 500 * current) * np.sign(v) + 4000 * v for tag, current in tests.items()}
    if in_one_file:
        columns = {f"{name}_{tag}": values for tag, f in forces.items() for name, values in (("x", x), ("F", f))}
        units = "time t in s, displacement x in m, force F in N"
        savemat(tmp_path / "a.mat", {"t": t, "info": units, **columns})
    for tag, force in {} if in_one_file else forces.items():
        header = "Time [s],Position [m],Force [N]"
        np.savetxt(tmp_path / f"a_{tag}.csv", np.column_stack([t, x, force]), delimiter=",", header=header, comments="")
    refused = import_files([tmp_path])
    assert {refusal.error.code for refusal in refused.refusals} == {"E_CURRENT_MISSING", "E_AMBIGUOUS"}
    records = found_tests([tmp_path])[0]
    lines = tests_table.tests_text(records).splitlines()
    assert [line.split(",")[2] for line in lines] == ["current_A", "0", "", ""]
    filled = [
        line.replace(",,,train", f",{current},,train") for line, current in zip(lines[2:], (0.5, 1.5), strict=True)
    ]
    (tmp_path / "tests.csv").write_text("\n".join([*lines[:2], *filled]), encoding="utf-8")
    values = parse_profile("[current.values]\n" + "\n".join(f"'*{tag}*' = {value}" for tag, value in tests.items()))
    for profile in (None, values):
        found = import_files([tmp_path], profile)
        assert found.refusals == ()
        assert [float(np.mean(record.current)) for record in found.records] == [*tests.values()]
        (tmp_path / "tests.csv").unlink(missing_ok=True)


@pytest.mark.parametrize(("stated", "contradicts"), [(1.0, False), (0.7, False), (3.0, True)])
@pytest.mark.parametrize("place", ["name", "heading", "tests.csv"])
def test_a_current_that_a_varying_channel_never_reaches_contradicts_it(tmp_path, place, stated, contradicts):
    t = np.arange(0.0, 6.0, 0.002)
    x, v = 10 * np.sin(2 * np.pi * t), 0.02 * np.pi * np.cos(2 * np.pi * t)
    table = np.column_stack([t, x, 300 * np.sign(v) + 4000 * v, 0.6 + 0.4 * np.sin(2 * np.pi * 0.5 * t)])
    names = "Time [s],Position [mm],Force [N],Current [A]"
    heading = f"Coil current: {stated} A\n{names}" if place == "heading" else names
    name = f"run_{stated}A" if place == "name" else "run"
    np.savetxt(tmp_path / f"{name}.csv", table, delimiter=",", header=heading, comments="")
    if place == "tests.csv":
        (tmp_path / "tests.csv").write_text(f"run_id,current_A\nrun,{stated}\n", encoding="utf-8")
    found = import_files([tmp_path])
    assert [refusal.error.code for refusal in found.refusals] == ["E_CURRENT_CONTRADICTS"] * contradicts


@pytest.mark.parametrize(
    "line",
    [
        "displacement and force positive in compression",
        "Weg und Kraft positiv bei Druck",
        "displacement positive in compression, force positive in compression",
        "Signs: compressive load positive and bump stroke positive",
        "Convention of the rig: extension negative",
        "Druckkraft positiv, Einfederweg positiv bei Druck",
        "Усилие и перемещение положительны при сжатии",
        "符号约定：压缩为正",
        "変位・荷重とも圧縮方向を正とする",
        "부호 규약: 압축이 양(+)",
        "Znaménko: tlak kladný, tah záporný",
        "Tekenafspraak: druk is positief",
    ],
)
def test_a_line_that_counts_both_channels_positive_in_compression_changes_both_signs(tmp_path, line):
    table(tmp_path / "a_0.5A.csv", [f"# {line}", "time [s],displacement [mm],force [N]"], T, -X, -force(0.5))
    (record,) = import_files([tmp_path / "a_0.5A.csv"]).records
    assert record.displacement == pytest.approx(1e-3 * X, abs=1e-8)
    assert record.force == pytest.approx(force(0.5), abs=1e-2)


@pytest.mark.parametrize(
    ("line", "motion", "load"),
    [
        ("Kraft: Zug positiv; Weg: Einfahren positiv", -1, 1),
        ("Vorzeichen: Kraft Druck positiv, Weg Ausfahren positiv", 1, -1),
        ("Positive force = compression. Positive displacement = extension.", 1, -1),
        ("Force sign: tension +, compression -; stroke sign: compression +", -1, 1),
        ("Effort positif en compression, déplacement positif en détente", 1, -1),
        ("Force positive in tension, displacement positive when retracting", -1, 1),
        ("Znamenko: dráha kladná při vysunutí, síla kladná v tlaku", 1, -1),
        ("Force positive in tension, displacement positive inwards", 0, 1),
        ("Load cell ±5 kN, tension/compression +/-; displacement +/-50 mm", 1, 1),
    ],
)
def test_each_clause_of_a_line_gives_the_sense_of_its_channel_or_asks_for_it(tmp_path, line, motion, load):
    head = [f"# {line}", "time [s],displacement [mm],force [N]"]
    table(tmp_path / "a_0.5A.csv", head, T, (motion or -1) * X, load * force(0.5))
    found = import_files([tmp_path])
    assert [(r.error.code, "displacement" in r.error.found) for r in found.refusals] == (
        [] if motion else [("E_SIGN_CONVENTION", True)]
    )
    for record in found.records:
        assert record.displacement == pytest.approx(1e-3 * X, abs=1e-8)
        assert record.force == pytest.approx(force(0.5), abs=1e-2)


@pytest.mark.parametrize(
    ("line", "codes"),
    [
        ("Pressure of the compression chamber: positive, 3 bar", []),
        ("Kompressionsventil positiv geprüft", ["E_SIGN_CONVENTION"] * 2),
        ("extension valve with positive stop", []),
        ("Sign: tension positive, compression negative", []),
        ("new compression valve with positive stop fitted", ["E_SIGN_CONVENTION"] * 2),
        ("Sign convention: positive upwards", ["E_SIGN_CONVENTION"] * 2),
        ("Pressure sign: positive", []),
        ("Trigger direction: positive", []),
        ("Polarity: positive", []),
    ],
)
def test_a_line_about_something_else_than_the_sign_changes_none(tmp_path, line, codes):
    table(tmp_path / "a_0.5A.csv", [f"# {line}", "time [s],displacement [mm],force [N]"], T, X, force(0.5))
    found = import_files([tmp_path])
    assert [error.code for r in found.refusals for error in getattr(r.error, "errors", [r.error])] == codes
    assert all(np.allclose(record.force, force(0.5), atol=1e-2) for record in found.records)


def test_a_velocity_counts_as_the_displacement_does(tmp_path):
    head = ["# compression positive", "time [s],displacement [mm],force [N],velocity [mm/s]"]
    table(tmp_path / "a_0.5A.csv", head, T, -X, -force(0.5), -np.gradient(X, T))
    (record,) = import_files([tmp_path]).records
    assert record.velocity is not None
    assert record.velocity == pytest.approx(1e-3 * np.gradient(X, T), abs=1e-6)


def test_a_sign_of_the_profile_is_that_of_the_column_whatever_a_line_states(tmp_path):
    lines = ["# ram extended = positive = specimen compressed", "# load cell: compression positive"]
    table(tmp_path / "a_0.5A.csv", [*lines, "time [s],displacement [mm],force [N]"], T, -X, -force(0.5))
    (refused,) = import_files([tmp_path]).refusals
    assert (refused.error.code, "[channels.displacement] sign = -1" in refused.error.remedy) == (
        "E_SIGN_CONVENTION",
        True,
    )
    for also in ("", "[channels.force]\nsign = -1"):
        profile = parse_profile(f"[channels.displacement]\nsign = -1\n{also}")
        (record,) = import_files([tmp_path], profile).records
        assert record.displacement == pytest.approx(1e-3 * X, abs=1e-8)
        assert record.force == pytest.approx(force(0.5), abs=1e-2)


def test_where_a_line_gives_the_sense_of_one_channel_the_sign_of_the_other_is_asked_for(tmp_path):
    table(
        tmp_path / "a_0.5A.csv", ["# force: compression positive", "time [s],stroke [mm],force [N]"], T, -X, -force(0.5)
    )
    (refused,) = import_files([tmp_path]).refusals
    assert (refused.error.code, "set [channels.displacement] sign = -1" in refused.error.remedy) == (
        "E_DISSIPATION_SIGN", True,
    )  # fmt: skip
    (record,) = import_files([tmp_path], parse_profile("[channels.displacement]\nsign = -1")).records
    assert record.force == pytest.approx(force(0.5), abs=1e-2)


@pytest.mark.parametrize(
    ("lines", "note"),
    [
        (["Datum;12.03.2024 09:15:00"], {"recorded_at": "2024-03-12T09:15:00"}),
        (['"Test date","2023-05-10"'], {"recorded_at": "2023-05-10"}),
        (["Date,2024/03/12", "Time,2:05:10.25 PM"], {"recorded_at": "2024-03-12T14:05:10"}),
        (["# Recorded: 5 Mar 2024"], {"recorded_at": "2024-03-05"}),
        (["# Damper rig; specimen warm; test date: 2024-03-10 09:23"], {"recorded_at": "2024-03-10T09:23:00"}),
        (["Date: 31/12/2024 7:00"], {"recorded_at": "2024-12-31T07:00:00"}),
        (["Date: 03/04/2024 7:00"], {"session": "03/04/2024"}),  # of March or of April
        (["Calibration date: 2020-01-01"], {}),
        (["Date: 2024-05-31", "Test date: 2024-06-01"], {}),
        (["Date: 99.99.2024"], {}),
        (["Date: 2024-05-31", "Time: 99:10"], {"recorded_at": "2024-05-31"}),
    ],
)
def test_the_day_of_a_test_is_that_of_its_own_lines(tmp_path, lines, note):
    assert recording_time(lines) == note
    table(tmp_path / "a_0.5A.csv", [*lines, "time [s],displacement [mm],force [N]"], T, X, force(0.5))
    (record,) = import_files([tmp_path / "a_0.5A.csv"]).records
    assert note.items() <= record.provenance.items()
    assert bool(note) == bool({"recorded_at", "session"} & set(record.provenance))


@pytest.mark.parametrize(
    ("head", "scale"),
    [
        (['"Sample Rate","100.000","Hz","","Duration","3.000","s"', "Time [s],Displacement [mm],Force [N]"], 1),
        (["Sampling frequency: 100 Hz", "Time,Displacement [mm],Force [N]"], 1e3),
        (["Time [s],Stroke (in.),Force [N]"], 1),
        (["Logger 0.7, 100 SPS", "format: millis,displacement_mm,force_N"], 1e3),
        (["Var1,Var2,Var3"], 1),
    ],
    ids=[
        "another number of the line is no step", "only ms agree with the rate", "in.", "behind a word for names",
        "a README of the folder above",
    ],
)  # fmt: skip
def test_names_and_units_are_read_as_a_careful_reader_does(head, scale, tmp_path):
    if "Var1" in head[0]:
        (tmp_path / "README.txt").write_text("Var1: time (s)\nVar2: displacement (mm)\nVar3: force (N)\n")
    folder = tmp_path / "0.5 A"
    folder.mkdir()
    table(folder / "a.csv", head, scale * T, X / (25.4 if "in." in head[0] else 1), force(0.5))
    expect(folder, 0.5)
    told = "".join(finding.text for finding in import_files([folder]).records[0].findings)
    assert ("README.txt in the folder above is read" in told) == ("Var1" in head[0])


def test_the_sense_in_a_table_of_columns_is_no_channel(tmp_path):
    text = "| no. | name | description | unit |\n|---|---|---|---|\n| 1 | t | time | s |\n| 2 | d | stroke | mm |\n"
    (tmp_path / "README.md").write_text(f"{text}| 3 | f | force on the rod, positive in compression | N |\n")
    table(tmp_path / "a_0.5A.csv", ["t,d,f"], T, X, -force(0.5))
    expect(tmp_path, 0.5)
    assert import_files([tmp_path]).records[0].provenance["sign_changed"] == "force"


def test_the_nearest_readme_states_the_scale(tmp_path):
    (tmp_path / "README.txt").write_text("LVDT: 10 mm/V\n")
    folder = tmp_path / "0.5 A"
    folder.mkdir()
    table(folder / "a.csv", ["Time [s],LVDT [V],Force [N]"], T, X / 10, force(0.5))
    expect(folder, 0.5)
    table(folder / "a.csv", ["Time [s],LVDT [V],Force [N]"], T, X / 5, force(0.5))
    (folder / "README.txt").write_text("LVDT: 5 mm/V\n")
    expect(folder, 0.5)


def test_cycles_that_a_column_counts_are_one_test(tmp_path):
    names = "Cycle,Time in cycle [s],Displacement [mm],Force [N]"
    table(tmp_path / "a_0.5A.csv", [names], np.floor(T + 1e-6), np.round(T % 1, 6) % 1, X, force(0.5))
    expect(tmp_path, 0.5)


@pytest.mark.parametrize(
    ("name", "text", "encoding"),
    [
        ("README.txt", "t01-t02: 0 A\nt03 - t03: 0.5 A\n", "utf-8"),
        ("plan.csv", "試験番号,電流(A)\nt01,0\nt02,0\nt03,0.5\n", "cp932"),
        ("levels.csv", "Level,Current (A)\nL1,0\nL2,0.5\n", "utf-8"),
    ],
    ids=["ranges", "another encoding", "codes in a table"],
)
def test_currents_of_a_list_beside_the_files(name, text, encoding, tmp_path):
    for n, current in enumerate((0.0, 0.0, 0.5), 1):
        stem = f"L{1 if n < 3 else 2}_{'abc'[n - 1]}" if name == "levels.csv" else f"t{n:02d}"
        table(tmp_path / f"{stem}.csv", ["Time [s],Displacement [mm],Force [N]"], T, X, force(current) + 2.0 * n)
    (tmp_path / name).write_text(text, encoding)
    assert [record.current[0] for record in import_files([tmp_path]).records] == [0.0, 0.0, 0.5]


def test_settings_within_a_list_of_files_state_their_currents(tmp_path):
    for n, current in enumerate((0.0, 0.5), 1):
        table(tmp_path / f"{'ab'[n - 1]}.csv", ["Time [s],Displacement [mm],Force [N]"], T, X, force(current))
    says = '{"file": "b.csv", "set": {"current_A": 0.5}, "limits": {"current_A": 3}},'
    says += '{"file": "a.csv", "set": {"current_A": 0}, "limits": {"current_A": 3}}'
    (tmp_path / "manifest.json").write_text(f'{{"files": [{says}]}}')
    expect(tmp_path, 0.0, 0.5)


def test_rows_of_arrays_with_units_of_their_own_are_tests(tmp_path):
    currents = np.array([0.0, 0.25, 0.5])
    with h5py.File(tmp_path / "a.h5", "w") as file:
        stacked = {"displacement": (np.stack([X] * 3), "mm"), "force": (np.stack([force(i) for i in currents]), "N")}
        for name, (values, unit) in {"time": (T, "s"), "coil_current": (1e3 * currents, "mA"), **stacked}.items():
            file.create_dataset(name, data=values).attrs["units"] = unit
    expect(tmp_path, *currents)


@pytest.mark.parametrize("name", ["Time of day", "Uhrzeit"])
def test_a_time_of_day_and_a_current_in_wide_letters_are_read(name, tmp_path):
    rows = [f"11:59:{58 + t:06.3f} AM,{x:.4f},{f:.3f}" for t, x, f in zip(T[:180], X, force(0.5), strict=False)]
    (tmp_path / "\uff10\uff0e\uff15\uff21.csv").write_text("\n".join([f"{name},Displacement [mm],Force [N]", *rows]))
    expect(tmp_path, 0.5)


def test_lists_in_a_json_file_name_columns_that_a_row_of_numbers_heads(tmp_path):
    table(tmp_path / "a.csv", ["0,1,2"], T, X, force(0.5))
    says = '{"columns": ["time", "displacement", "force"], "units": ["s", "mm", "N"], "coil": {"current_A": 0.5}}'
    (tmp_path / "a.json").write_text(says)
    expect(tmp_path, 0.5)


def test_numbered_keys_may_begin_with_the_channel(tmp_path):
    head = ["Ch1Name=Displacement", "Ch1Unit=mm", "Ch2Name=Load", "Ch2Unit=N", "SampleRate=100 Hz"]
    table(tmp_path / "a_0.5A.dat", head, X, force(0.5))
    expect(tmp_path, 0.5)


def test_variables_have_the_units_that_others_named_after_them_hold(tmp_path):
    stated = {"time_unit": "s", "position_unit": "mm", "load_unit": "N", "current_unit": "A"}
    savemat(tmp_path / "a.mat", {"time": T, "position": X, "load": force(0.5), "current": 0.5, **stated})
    expect(tmp_path, 0.5)


def test_dimensions_of_an_array_beside_vectors_are_conditions(tmp_path):
    currents, phases = np.array([0.0, 0.5]), np.array([1.0, 1.0, 1.0])
    motion = np.broadcast_to(X, (2, 3, T.size)) + np.arange(3)[:, None]
    loads = np.stack([[force(i) + 0.01 * n for n in range(3)] for i in currents])
    stated = "time [s], x [mm], F [N], I [A], phase [1]"
    np.savez(tmp_path / "a.npz", time=T, x=motion, F=loads, I=currents, phase=phases, columns=stated)
    assert [record.current[0] for record in import_files([tmp_path]).records] == [0, 0, 0, 0.5, 0.5, 0.5]


@pytest.mark.parametrize("profile", ['column = "level"\nunit = "A"\n', 'unit = "mA"\n'])
def test_a_profile_gives_a_number_beside_the_columns_its_unit(profile, tmp_path):
    name, value = ("level", 0.5) if "level" in profile else ("current", 500)
    savemat(tmp_path / "a.mat", {"time_s": T, "position_mm": X, "load_N": force(0.5), name: value})
    assert [r.error.code for r in import_files([tmp_path]).refusals] == ["E_CURRENT_MISSING"]
    records = import_files([tmp_path], parse_profile(f"[channels.current]\n{profile}")).records
    assert [record.current[0] for record in records] == [0.5]


def test_arrays_of_a_folder_have_the_current_of_its_description_once_the_unit_of_time_is_stated(tmp_path):
    for name, values in (("time", T), ("displacement_mm", X), ("force_N", force(0.5))):
        np.save(tmp_path / f"{name}.npy", values)
    (tmp_path / "meta.yaml").write_text("current_A: 0.5\n")
    assert "E_UNITS_MISSING" in {r.error.code for r in import_files([tmp_path]).refusals}
    records = import_files([tmp_path], parse_profile('[channels.time]\nunit = "s"\n')).records
    assert [record.current[0] for record in records] == [0.5]


def test_the_remedy_for_a_channel_a_file_names_its_files(tmp_path):
    table(tmp_path / "C1--t--0.txt", ["Time,Ampl"], T, X)
    assert "file = " in import_files([tmp_path]).refusals[0].error.remedy


@pytest.mark.parametrize(
    ("head", "volts"),
    [("Resistenza bobina;4,2;ohm\nTensione bobina;2,1;V\n", None), ("# coil resistance 5.0 ohm\n", 2.5)],
)
def test_voltage_and_resistance_of_the_coil_are_offered_as_its_current_and_not_taken(tmp_path, head, volts):
    channels = [T, X, 100 * force(0.5)] + ([] if volts is None else [np.full(T.size, volts)])
    names = "time [s];stroke [mm];force [cN]" + ("" if volts is None else ";coil voltage [V]")
    rows = "".join(";".join(f"{v:.5f}" for v in row).replace(".", ",") + "\n" for row in zip(*channels, strict=True))
    (tmp_path / "a.csv").write_text(f"{head}{names}\n{rows}")
    (refusal,) = import_files([tmp_path]).refusals
    assert refusal.error.code == "E_CURRENT_MISSING"
    line = re.search(r"set (\[.*?\] )(.*?) in a profile; else", refusal.error.remedy)
    assert line
    profile = parse_profile(f"{line[1]}\n{line[2]}".replace(", unit", "\nunit").replace(" and scale", "\nscale"))
    (record,) = import_files([tmp_path], profile).records
    assert np.mean(record.current) == pytest.approx(0.5)


@pytest.mark.parametrize(
    "head",
    ["# bridge: 350 ohm\n# coil voltage: 5 V\n", "# shunt: 0.1 ohm\n# coil voltage: 5 V\n",
     "# coil resistance: 5 ohm\n# shunt voltage: 0.05 V\n", "# coil resistance: 0.1 ohm\n# coil voltage: 5 V\n"],
)  # fmt: skip
def test_no_current_is_offered_by_another_resistance_or_voltage_or_above_those_of_dampers(tmp_path, head):
    rows = "".join(f"{t:.5f},{x:.5f},{f:.5f}\n" for t, x, f in zip(T, X, force(0.5), strict=True))
    (tmp_path / "a.csv").write_text(f"{head}time [s],stroke [mm],force [N]\n{rows}")
    (refusal,) = import_files([tmp_path]).refusals
    assert refusal.error.code == "E_CURRENT_MISSING"
    assert "ohm" not in str(refusal.error)


def test_a_label_alone_on_its_line_states_what_the_next_holds(tmp_path):
    """As SignalExpress exports: a step for each column, in seconds, and names of terminals that a text explains."""
    head = ["channel names: ", "0_Voltage - Dev1_ai0\t0_Voltage - Dev1_ai1\t", "start times: "]
    head += ["01/09/2016 15:01:22.331\t01/09/2016 15:01:22.331\t", "dt: ", "0.01\t0.01\t", "data: "]
    body = [f"{x / 5:.6f}\t{f / 500:.6f}\t" for x, f in zip(X, force(0.5), strict=True)]
    (tmp_path / "run1.txt").write_text("\n".join([*head, *body, ""]))
    note = tmp_path / "README.txt"
    note.write_text("Dev1_ai0 - stroke (LVDT), 5 mm/V\nDev1_ai1 - load cell, 500 N/V\ncoil current: 0.5 A\n")
    (record,) = import_files([tmp_path], parse_profile("[current]\nvalue = 0.5\n")).records
    np.testing.assert_allclose(record.time, T, atol=1e-9)
    np.testing.assert_allclose(record.displacement, 1e-3 * X, atol=1e-6)
    np.testing.assert_allclose(record.force, force(0.5), atol=1e-2)
    note.write_text("Dev1 - stroke (LVDT), 5 mm/V\nDev1_ai1 - load cell, 500 N/V\n")  # not the whole name of a terminal
    assert not import_files([tmp_path], parse_profile("[current]\nvalue = 0.5\n")).records


@pytest.mark.parametrize(
    ("said", "sign"),
    [("compression gives plus (so change the sign)", -1), ("tension plus", 1), ("tension gives minus", -1),
     ("compression plus friction", 1)],
)  # fmt: skip
def test_plus_and_minus_at_the_end_of_a_clause_are_signs(tmp_path, said, sign):
    table(tmp_path / "a.csv", ["time [s],displacement [mm],force [N]"], T, X, sign * force(0.5))
    (tmp_path / "notes.txt").write_text(f"load cell, {said}\n")
    (record,) = import_files([tmp_path], parse_profile("[current]\nvalue = 0.5\n")).records
    np.testing.assert_allclose(record.force, force(0.5), atol=1e-2)


@pytest.mark.parametrize("mark", ["", "_", "-"])
def test_a_line_for_each_test_may_name_it_with_a_mark_before_its_number(tmp_path, mark):
    for number, amperes in enumerate((0.0, 0.5, 1.0), 1):
        table(tmp_path / f"scope{mark}{number}.csv", ["time [s],LVDT [mm],load cell [V]"], T, X, force(amperes) / 250)
    lines = [f"scope{mark}{number}: {amperes} A, 1 Hz\n" for number, amperes in enumerate((1.0, 0.5, 0.0), 1)]
    (tmp_path / "notes.txt").write_text("".join(lines[::-1]))  # in another order than the files
    result = import_files([tmp_path])
    assert {refusal.error.code for refusal in result.refusals} == {"E_UNITS_DIMENSION"}
    assert not any("current" in refusal.error.remedy for refusal in result.refusals)
    assert result.reasons["notes.txt"] == "currents under 'a line for each test', used once the columns are known"
    calibration = parse_profile('[channels.force]\nunit = "N"\nscale = 250\n')
    assert [record.current[0] for record in import_files([tmp_path], calibration).records] == [1.0, 0.5, 0.0]


@pytest.mark.parametrize(
    ("arrays", "expected"),
    [("I = [0.0 0.5 1.0 0.0];  % coil current, A\nf = [1 1 1 2]; % Hz\n", [0.0, 0.5, 1.0, 0.0]),
     ("I = [1.0 0.5 0.0 0.0];  % coil current, A\nf = [1 1 1 2]; % Hz\n", []),  # forces fall
     ("I = [0.0 0.5 1.0 0.0];  % coil current, A\nf = [1 1 2 1]; % Hz\n", []),  # of other tests
     ("I = [0.0 0.5 1.0];  % coil current, A\n", [])],
    ids=["of the tests", "falling forces", "other frequencies", "of other tests"],
)  # fmt: skip
def test_arrays_and_comments_of_a_script_state_currents_in_order_and_units(tmp_path, arrays, expected):
    for number, (amperes, frequency) in enumerate([(0.0, 1), (0.5, 1), (1.0, 1), (0.0, 2)], 1):
        time, shift = T / frequency, 30 * number
        savemat(tmp_path / f"run{number}.mat", {"time": time, "stroke": X, "load_cell": force(amperes) + shift})
    comments = "% signals(1): stroke in mm (wire pot, gain in the model)\n% signals(2): load_cell in N, tension +\n"
    (tmp_path / "plot_all.m").write_text(f"{comments}% time in s\n{arrays}for k = 1:4\n  x = signals(1);\nend\n")
    result = import_files([tmp_path])
    stated = [record.current[0] for record in result.records]
    assert stated == expected, [str(refusal.error) for refusal in result.refusals]


def test_a_plan_in_another_code_page_is_named_as_it_is_written_and_its_rows_are_counted(tmp_path):
    for number in range(7):
        table(tmp_path / f"2019-10-02 1{number}-00-00.csv", ["t [s],x [mm],F [N]"], T, X, force(0.3 * number))
    rows = [f"{number};{0.3 * number:.1f};1,0" for number in range(1, 9)]
    text = "\n".join(["Poř.;Proud [A];Frekvence [Hz]", *rows, ""])
    (tmp_path / "plan.csv").write_bytes(text.encode("cp1250"))
    why = import_files([tmp_path]).reasons["plan.csv"]
    assert "8 rows for 7 tests, no column beside it names every test (Poř., Frekvence [Hz])" in why
