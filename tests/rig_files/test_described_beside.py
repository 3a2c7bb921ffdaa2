"""Names, units, scales and currents that a laboratory keeps in texts beside its files."""

from __future__ import annotations

import json
import re
from itertools import pairwise
from pathlib import Path
from time import process_time

import numpy as np
import openpyxl
import pytest

from mrdamper import import_files
from mrdamper.rig_files import tests_table
from mrdamper.rig_files.mapping import plans
from mrdamper.rig_files.mapping.description import short_lines
from mrdamper.rig_files.profile import Profile, parse_profile
from mrdamper.rig_files.readers import raw_tables

T = np.arange(401) / 200.0
X = 12.0 * np.sin(2 * np.pi * T)
V = np.gradient(X, T)
CURRENTS = {"m07": 0.2, "m08": 0.9, "m09": 0.0}


def force(amperes: float) -> np.ndarray:
    return (200 + 500 * amperes) * np.tanh(V / 5) + 2 * V + np.random.default_rng(3).normal(0, 1, T.size)


def write(folder, header: str, scale: tuple[float, float] = (1.0, 1.0)) -> None:
    for name, amperes in CURRENTS.items():
        rows = zip(T, X / scale[0], force(amperes) / scale[1], strict=True)
        (folder / f"{name}.csv").write_text(header + "".join(f"{t:.3f},{x:.7f},{f:.6f}\n" for t, x, f in rows))


def require_the_tests(folder) -> None:
    result = import_files([folder])
    assert not [str(refusal.error) for refusal in result.refusals]
    assert [float(np.mean(record.current)) for record in result.records] == pytest.approx(list(CURRENTS.values()))
    for record, amperes in zip(result.records, CURRENTS.values(), strict=True):
        np.testing.assert_allclose(record.displacement, 1e-3 * X, rtol=0, atol=1e-8)
        np.testing.assert_allclose(record.force, force(amperes), rtol=0, atol=1e-2)


UNITS = "time [s],displacement [mm],force [N]\n"


@pytest.mark.parametrize(
    ("tables", "names"),
    [
        ({"level.csv": "level_id,coil_current_a,by\n1,0.2,TTi\n2,0.9,TTi\n3,0,TTi\n4,1.5,TTi\n",
          "test.csv": "test,damper_id,level_id\nm07,5,1\nm08,5,2\nm09,5,3\n"}, {}),
        ({"design.csv": "StdOrder,Mount,Current (A)\n9,7,0.2\n7,8,0.9\n8,9,0\n"}, {}),
        ({"plan.csv": "Oil,Piston,Current (A)\n1,1,0.2\n1,2,0.9\n2,1,0\n2,2,1.2\n"},
         {"m07": "O1_P1", "m08": "O1_P2", "m09": "O2_P1"}),
        ({"plan.csv": "Versuch;Sollstrom (A);Iststrom (A)\nm07;0,2;0,2\nm08;2,0;0,9\nm09;0;0\n"}, {}),
        ({"log.csv": "Uhrzeit;Art;Strom (A)\n14:05;Sinus;0,2\n14:11;Sinus;0,9\n14:12;Sinus;0\n14:18;Ende;\n"},
         {"m07": "R_20230603_140512", "m08": "R_20230603_141130", "m09": "R_20230603_141259"}),
        ({"plan.csv": "test,I (A)\nm07,.2\nm08,.9\nm09,0\n"}, {}),
        ({"listing.txt": "Step name   Program   PSU set point (current mode)\n-------------------------\n"
          "m07   Sine 1 Hz, 12 mm   0.2 A\nm08   Sine 1 Hz, 12 mm   0.9 A\nm09   Sine 1 Hz, 12 mm   0.0 A\n"}, {}),
        ({"plan.csv": "id,frequency,current\nm07,1,0.2\nm08,1,0.9\nm09,1,0\n",
          "codebook.csv": "table,variable,unit\nsignals,force,N\nplan,frequency,Hz\nplan,current,A\n"},
         {}),
        ({"matrix.csv": "Corner,0.2 A,0.9 A,0 A\nFL,m07,m08,m09\n,,,\n"}, {}),
        ({"log.csv": "Beginn;Strom (A)\n14:05:00;0,2\n14:11:00;0,9\n14:12:00;0\n"},
         {"m07": "2023-06-03 14-05-12", "m08": "2023-06-03 14-11-30", "m09": "2023-06-03 14-12-59"}),
        ({"list.txt": "1. test: coil at 0.2 A, 1 Hz\n2. test: coil at 0.9 A\n3. test: coil at 0 A\n"},
         {"m07": "test1", "m08": "test2", "m09": "test3"}),
        ({"note.txt": "T7 se T9 tak : frequency 1 Hz, current 0.2, 0.9, 0 A (isi order mein)\n"},
         {"m07": "T7", "m08": "T8", "m09": "T9"}),
        ({"README.md": "| Code | Current (A) |\n|---|---|\n| C1 | 0.2 |\n| C2 | 0.9 |\n| C3 | 0 |\n"},
         {"m07": "MRD-C1-H1", "m08": "MRD-C2-H1", "m09": "MRD-C3-H1"}),
        ({"log.csv": "Date;Run no.;Coil current (A);Remarks\n14 Feb;7;0.2;\n;8;0.9;warm-up 10 cycles before\n"
          ";9 – 11, 14;0;\n"}, {}),
        ({"annex.tex": "\\caption{Tests}\n\\begin{tabular}{ccc}\n\\hline\nFile & $I$ [A] & $f$ [Hz] \\\\\n\\hline\n"
          "m07 & 0{,}2 & 1 \\\\\nm08 & 0{,}9 & 1 \\\\\nm09 & 0{,}0 & 1 \\\\\n\\hline\n\\end{tabular}\n"}, {}),
        ({"campaign.toml": 'title = "x"\n' + "".join(
            f'[[run]]\nfile = "{name}.csv"\namps = {amperes}\nhz = 1\n' for name, amperes in CURRENTS.items())}, {}),
        ({"load.m": "% akim: A, genlik: mm\nclear; clc;\n" + "".join(
            f"d({n}).dosya = '{name}.csv'; d({n}).akim = {amperes}; d({n}).genlik = 12;\n"
            for n, (name, amperes) in enumerate(CURRENTS.items(), 1))}, {}),
        ({"log.txt": "Tuesday\n14:00 warm-up\n14:04 coil at 0.2 A\n14:14 0.9 A\n14:24 0 A\n14:40 end\n"},
         {"m07": "R_20230603_140512", "m08": "R_20230603_141330", "m09": "R_20230603_142459"}),
        ({"supply.csv": "Time,Current(A)\n" + "".join(
            f"2023-06-03 14:05:{s:02d},{(0.2, 0.9, 0.0)[s // 20]}\n" for s in range(60))},
         {"m07": "R_20230603_140512", "m08": "R_20230603_140530", "m09": "R_20230603_140550"}),
        ({"crate.json": json.dumps({"@graph": [{"@id": "./", "@type": "Dataset"}, *(
            {"@id": f"{name}.csv", "@type": "File", "additionalProperty": [
                {"@type": "PropertyValue", "name": "coil current", "value": amperes, "unitText": "A"}]}
            for name, amperes in CURRENTS.items())]})}, {}),
        ({"README.txt": "File names follow the rule\n  D<damper>_I<current>.csv\n"
          "where  current    is in hundredths of an ampere  (I050 = 0.50 A)\n"},
         {"m07": "D7_I020", "m08": "D8_I090", "m09": "D9_I000"}),
        ({"readme.txt": "suffix I0p5_f2p5 means current 0.5 A and 2.5 Hz (p = decimal point)\n"},
         {"m07": "t7_I0p2_f1", "m08": "t8_I0p9_f1", "m09": "t9_I0_f1"}),
    ],
    ids=[
        "by an id of another table", "by the word before the number", "by two numbers", "measured beside set",
        "time of day", ".2", "set point of the supply", "unit in a code book", "names in columns of currents",
        "time of day of a sheet", "number before the word", "a range in order", "codes in a table of a README",
        "several runs a row", "LaTeX", "TOML", "structs of a script", "a log by the clock", "a log of the supply",
        "properties of files", "hundredths of an ampere", "an example of names",
    ],
)  # fmt: skip
def test_currents_of_a_table_that_names_the_tests_by_keys(tmp_path, tables, names):
    write(tmp_path, UNITS)
    for name, called in names.items():
        (tmp_path / f"{name}.csv").rename(tmp_path / f"{called}.csv")
    for name, content in tables.items():
        (tmp_path / name).write_text(content)
    require_the_tests(tmp_path)


@pytest.mark.parametrize(
    "tables",
    [
        {"level.csv": "level,Current (A)\n1,0.2\n1,0.9\n", "test.csv": "test,level\nm07,1\nm08,1\nm09,1\n"},
        {"design.csv": "Mount,Mass,Current (A)\n9,7,0.2\n7,8,0.9\n8,9,0\n"},
        {"plan.csv": "test;Sollstrom (A);Sollstrom 2 (A)\nm07;0,2;0,2\nm08;2,0;0,9\nm09;0;0\n"},
        {"note.txt": "m07 to m09: coil current 0.2, 0.9 A\n"},
        {"matrix.csv": "Corner,0.2 A,0.9 A,0 A\nFL,m07,m08,m09\nFR,m08,m07,\n"},
        {"rig.toml": '[current.values]\n"m07" = 0.2\n"m08" = 0.9\n"m09" = 0.0\n'},
        {"log.txt": "09:20 supply off (0 A)\n09:50 set 0.2 A\n10:40 set 0.9 A\n"},
        {"readme.txt": "for example I0p5_f2p5\nsuffix I0p5_f2p5 means current 0.5 A and 2.5 Hz\n"},
    ],
    ids=[
        "a key of two rows",
        "two headings of one letter",
        "two set currents",
        "fewer than tests",
        "a name twice",
        "a profile",
        "a log, and tests without times",
        "an example of other names",
    ],
)
def test_currents_of_a_table_whose_keys_are_not_unique_are_asked(tmp_path, tables):
    write(tmp_path, UNITS)
    for name, content in tables.items():
        (tmp_path / name).write_text(content)
    result = import_files([tmp_path])
    assert {refusal.error.code for refusal in result.refusals} == {"E_CURRENT_MISSING"}
    assert all(reason for reason in result.reasons.values())


@pytest.mark.parametrize("more", ["", "plan.csv : intensite en mA\n"])
def test_notes_give_the_units_of_the_columns_and_of_a_plan_unless_they_differ(tmp_path, more):
    write(tmp_path, "t,x,F\n")
    tests = "".join(f'"{name}";{amperes};1\n' for name, amperes in CURRENTS.items())
    (tmp_path / "plan.csv").write_text(f'"";"intensite";"frequence"\n{tests}')
    notes = "mesures : t en s, x en mm (course), F en N (effort)\nplan.csv : intensite en A, rien de plus\n"
    (tmp_path / "LISEZMOI.txt").write_text(notes + more)
    if more:
        assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}
    else:
        require_the_tests(tmp_path)


@pytest.mark.parametrize("unit", ["A", "V"])
def test_levels_of_a_structure_give_the_currents_of_the_tests_that_a_column_calls_so(tmp_path, unit):
    rows = ["run,time [s],displacement [mm],force [N]"]
    for code, amperes in (("L1", 0.2), ("L2", 0.9)):
        rows += [f"{code},{t:.3f},{x:.5f},{f:.4f}" for t, x, f in zip(T, X, force(amperes), strict=True)]
    (tmp_path / "all.csv").write_text("\n".join(rows) + "\n")
    levels = {"L1": {"current": 0.2, "unit": unit}, "L2": {"current": 0.9, "unit": unit}}
    (tmp_path / "metadata.json").write_text(json.dumps({"levels": levels}))
    result = import_files([tmp_path])
    currents = [float(np.mean(record.current)) for record in result.records]
    assert currents == ([] if unit == "V" else pytest.approx([0.2, 0.9]))


@pytest.mark.parametrize("pause", ["hold;;", "hold;ramp;", "hold;;0.2"])
def test_steps_of_a_record_that_rest_are_no_tests_whatever_the_plan_gives_them(tmp_path, pause):
    rows, start = ["t (s);x (mm);F (N);Step"], 0.0
    for step, amperes in enumerate((None, 0.2, None, 0.9), 1):
        still = T[:60] if amperes is None else T
        x, f = (0 * still, 0 * still) if amperes is None else (X, force(amperes))
        rows += [f"{start + t:.3f};{a:.5f};{b:.4f};{step}" for t, a, b in zip(still, x, f, strict=True)]
        start += still[-1] + 0.005
    (tmp_path / "record.csv").write_text("\n".join(rows) + "\n")
    plan = f"1;{pause}\n2;sine;1;0.2\n3;{pause}\n4;sine;1;0.9\n"
    (tmp_path / "plan.csv").write_text(f"Step;kind;f (Hz);coil current (A)\n{plan}")
    result = import_files([tmp_path])
    assert not [str(refusal.error) for refusal in result.refusals]
    assert [float(np.mean(record.current)) for record in result.records] == pytest.approx([0.2, 0.9])
    assert [record.time.size for record in result.records] == [T.size, T.size]


def test_a_plan_names_blocks_by_a_line_above_each(tmp_path):
    for file, steps in (("a", ((1, 0.9), (2, 0.0))), ("b", ((3, 0.2), (4, 0.5)))):
        text = ""
        for step, amperes in steps:
            rows = zip(T + 60 * step, X, force(amperes), strict=True)
            text += (
                f"\nAcquisition: DAQ_0{step}\t\tTime: {60 * step}.0\tSec\nStation: big frame\n\nTime\tStroke\tLoad\n"
            )
            text += "Sec\tmm\tN\n" + "".join(f"{t:.3f}\t{x:.5f}\t{f:.4f}\n" for t, x, f in rows)
        (tmp_path / f"{file}.dat").write_text(text)
    (tmp_path / "plan.csv").write_text(
        "Step,f (Hz),Current (A)\nDAQ_01,1,0.9\nDAQ_02,1,0\nDAQ_03,1,0.2\nDAQ_04,1,0.5\n"
    )
    result = import_files([tmp_path])
    assert not [str(refusal.error) for refusal in result.refusals]
    assert [float(np.mean(record.current)) for record in result.records] == pytest.approx([0.9, 0.0, 0.2, 0.5])
    assert ",DAQ_02, 1 Hz, 12 mm" in tests_table.tests_text(result.records).replace('"', "")


@pytest.mark.parametrize(
    ("heads", "plan"),
    [
        (("Test: 2", "Test: 3", "Test: 5"), "Test,Current (A)\n1,0.5\n2,0\n3,0.2\n4,0.7\n5,0.9\n"),
        (("Test no. 3", "Test no. 2", "Test no. 1"), "Test,Current (A)\n1,0.9\n2,0.2\n3,0\n"),
        (("Operator: Tim\nTest: T3", "Operator: Ann\nTest: T1", "Operator: Bo\nTest: T2"),
         "Test,Current (A)\nT1,0.2\nT2,0.9\nT3,0\n"),
        (("Operator: Tim\nBlock: C", "Operator: Ann\nBlock: A", "Operator: Bo\nBlock: B"),
         "Block,Current (A)\nA,0.2\nB,0.9\nC,0\n"),
        (("File: m03.dat", "File: m01.dat", "File: m02.dat"), "File,Current (A)\nm01,0.2\nm02,0.9\nm03,0\n"),
    ],
)  # fmt: skip
def test_names_and_numbers_above_blocks_are_surer_than_their_place(tmp_path, heads, plan):
    blocks = zip(heads, (0.0, 0.2, 0.9), strict=True)
    rows = [(head, zip(T, X, force(amperes), strict=True)) for head, amperes in blocks]
    texts = (f"{head}\n{UNITS}" + "".join(f"{t:.3f},{x:.5f},{f:.4f}\n" for t, x, f in of) for head, of in rows)
    (tmp_path / "all.csv").write_text("\n".join(texts))
    (tmp_path / "plan.csv").write_text(plan)
    result = import_files([tmp_path])
    assert not [str(refusal.error) for refusal in result.refusals]
    assert [float(np.mean(record.current)) for record in result.records] == pytest.approx([0.0, 0.2, 0.9])


@pytest.mark.parametrize(
    ("folders", "plan"),
    [
        (("day1", "day2"), "Day,Test,Current (A)\n1,1,0\n1,2,0.2\n2,1,0.9\n2,2,0.5\n"),
        (("2023-03-14", "2023-03-16"),
         "Datum;Číslo měření;Proud [A]\n16.3.2023;1;0,9\n16.3.2023;2;0,5\n14.3.2023;1;0\n14.3.2023;2;0,2\n"),
        (("a", "b"), "File,Current (A)\nb/test_02.csv,0.5\nb/test_01.csv,0.9\na/test_02.csv,0.2\na/test_01.csv,0\n"),
        (("a", "b"), "No,Where,Current (A)\n1,b\\test_01,0.9\n2,b\\test_02,0.5\n3,a\\test_01,0\n4,a\\test_02,0.2\n"),
    ],
)  # fmt: skip
def test_a_plan_numbered_per_day_or_with_paths_gives_the_currents_of_files_in_folders(tmp_path, folders, plan):
    currents = iter((0.0, 0.2, 0.9, 0.5))
    for folder in folders:
        (tmp_path / folder).mkdir()
        for number in (1, 2):
            rows = zip(T, X, force(next(currents)), strict=True)
            text = UNITS + "".join(f"{t:.3f},{x:.5f},{f:.4f}\n" for t, x, f in rows)
            (tmp_path / folder / f"test_0{number}.csv").write_text(text)
    (tmp_path / "plan.csv").write_text(plan)
    result = import_files([tmp_path])
    assert not [str(refusal.error) for refusal in result.refusals]
    assert [float(np.mean(record.current)) for record in result.records] == pytest.approx([0.0, 0.2, 0.9, 0.5])


@pytest.mark.parametrize("names", ["m0{}_{}A", "m0{}"])
def test_a_list_of_the_laboratory_with_numbers_only_is_a_plan_also_as_tests_csv(tmp_path, names):
    for number, amperes in enumerate((0.0, 0.5, 1.0), 1):
        rows = zip(T, X, force(amperes), strict=True)
        text = UNITS + "".join(f"{t:.3f},{x:.5f},{f:.4f}\n" for t, x, f in rows)
        (tmp_path / f"{names.format(number, amperes)}.csv").write_text(text)
    (tmp_path / "tests.csv").write_text("Test,Current (A),Valid\n1,0,yes\n2,0.5,no\n3,1,yes\n")
    result = import_files([tmp_path])
    assert [float(record.current[0]) for record in result.records] == [0.0, 1.0]
    assert [refusal.error.code for refusal in result.refusals] == ["E_DISCARDED"]


@pytest.mark.parametrize(
    ("files", "beside", "text", "specimens"),
    [
        ("档位{level}_{f}Hz", "驱动器设定表.csv", "档位,占空比(%),电流(A)\n0,0,0\n1,12,0.2\n2,25,0.9\n", None),
        ("Stufe {level}/{f}Hz", "stufen.csv", "Stufe;Strom [A]\n0;0\n1;0,2\n2;0,9\n", None),
        ("{f}Hz_duty{level}0", "driver.csv", "Duty (%),Current (A)\n0,0\n10,0.2\n20,0.9\n", None),
        ("SN{f}_I{amperes}_F1", "README.txt", "파일 이름: SN(시리얼 번호)_I(전류, A)_F(주파수, Hz)\n", ["1", "2"]),
        ("t{f}{level}", "plan.csv",
         "Test,Damper,Current (A)\n10,D1,0\n11,D1,0.2\n12,D1,0.9\n20,D2,0\n21,D2,0.2\n22,D2,0.9\n", ["D1", "D2"]),
        ("{f}_{amperes}A", "list.csv", "File,Serial no.,Day\n1_0.0A,D1,x\n1_0.2A,D1,x\n1_0.9A,D1,x\n"
         "2_0.0A,D2,x\n2_0.2A,D2,x\n2_0.9A,D2,x\n", ["D1", "D2"]),
    ],
)  # fmt: skip
def test_levels_schemes_and_plans_state_the_currents_and_specimens_of_names(tmp_path, files, beside, text, specimens):
    for f in (1, 2):
        for level, amperes in enumerate((0.0, 0.2, 0.9)):
            path = tmp_path / f"{files.format(f=f, level=level, amperes=amperes)}.csv"
            path.parent.mkdir(exist_ok=True)
            rows = zip(T, X, force(amperes) * (1 + 0.1 * f), strict=True)
            path.write_text(UNITS + "".join(f"{t:.3f},{x:.5f},{f:.4f}\n" for t, x, f in rows))
    (tmp_path / beside).write_text(text)
    result = import_files([tmp_path])
    assert not [str(refusal.error) for refusal in result.refusals]
    by_force = sorted(result.records, key=lambda record: np.ptp(record.force))
    assert [float(record.current[0]) for record in by_force] == pytest.approx([0.0, 0.0, 0.2, 0.2, 0.9, 0.9])
    assert [record.provenance.get("specimen") for record in by_force] == [*(specimens or [None] * 2)] * 3


@pytest.mark.parametrize(
    ("head", "starts", "ends"),
    [
        ("Record,Start (s),End (s)", (0.5, 4.0), (2.5, 6.0)),
        ("Record,First row,Last row", (102, 802), (502, 1202)),
    ],
)
def test_starts_and_ends_that_a_plan_states_for_each_file_cut_its_record_into_tests(tmp_path, head, starts, ends):
    plan = f"{head},Current (A)\n"
    for name, levels in (("am", (0.0, 0.2)), ("pm", (0.9, 0.5))):
        time, rows = np.arange(0.0, 7.0, 0.005), ""
        for t in time:
            level = levels[int(t > 3.2)]
            speed = 0.0 if 2.8 < t < 3.6 else np.cos(2 * np.pi * t)
            x = 0.0 if 2.8 < t < 3.6 else 12 * np.sin(2 * np.pi * t)
            rows += f"{t:.3f},{x:.5f},{200 * speed + (90 + 800 * level) * np.tanh(20 * speed):.4f}\n"
        (tmp_path / f"{name}.csv").write_text(UNITS + rows)
        plan += "".join(f"{name}.csv,{a},{b},{i}\n" for a, b, i in zip(starts, ends, levels, strict=True))
    (tmp_path / "plan.csv").write_text(plan)
    result = import_files([tmp_path])
    assert not [str(refusal.error) for refusal in result.refusals]
    assert [r.id for r in result.records] == ["am_1", "am_2", "pm_1", "pm_2"]
    assert [float(r.current[0]) for r in result.records] == [0.0, 0.2, 0.9, 0.5]
    assert [round(r.time[0], 2) for r in result.records] == [0.5, 4.0] * 2
    assert not result.left_out


@pytest.mark.parametrize(
    ("names", "text"),
    [
        ("m07 m08 m09", "Codes: m07 = 0.2 A, m08 = 0.9 A, m09 = 0 A (coil current, held constant)"),
        ("I1F2 I2F1 I3F1", "I1 = 0.2 A\nI2 = 0.9 A\nI3 = 0 A\nF1 = 1 Hz\nF2 = 2 Hz"),  # codes without a mark between
        ("a_1V_2Hz b_4.5V_1Hz c_5V", "Coil current by the driver's input: 1 V = 0,2 A; 4,5 V = 0.9 A; 5 V = 0 A"),
    ],
)
def test_a_legend_gives_the_currents_of_codes_and_of_voltages_in_names(tmp_path, names, text):
    write(tmp_path, UNITS)
    for old, new in zip(CURRENTS, names.split(), strict=True):
        (tmp_path / f"{old}.csv").rename(tmp_path / f"{new}.csv")
    (tmp_path / "README.txt").write_text(f"{text}\n")
    require_the_tests(tmp_path)


@pytest.mark.parametrize(
    ("text", "profile", "expected"),
    [
        ("`F1` is the force at 0.5 A, `F2` that at 1 A, `F3` that at 2 A.", "", [0.5, 1.0, 2.0]),
        ("- `F1`: force at 0.5 A\n- `F2`: force at 1 A\n- `F3`: force at 2 A", "", [0.5, 1.0, 2.0]),
        ("- `F1`: force at 0.5 A\n- `F2`: force at 1 A", "", ["E_AMBIGUOUS"]),
        ("0.5 A: F1, 1 A: F2, 2 A: F3, 3 A: not recorded", "", ["E_AMBIGUOUS"]),
        ("", '[file]\nblocks = "split"\n[current.values]\n"*F1" = 0.5\n"*F2" = 1\n"*F3" = 2', [0.5, 1.0, 2.0]),
        ("", '[channels.force]\ncolumn = "F1"\n[current]\nvalue = 0.5', [0.5]),
    ],
)
def test_several_forces_beside_one_motion_are_tests_by_a_text_or_by_the_profile(tmp_path, text, profile, expected):
    table = np.column_stack([T, X, *map(force, (0.5, 1.0, 2.0))])
    np.savetxt(tmp_path / "sine.csv", table, delimiter=",", header="t [s],x [mm],F1 [N],F2 [N],F3 [N]", comments="")
    (tmp_path / "README.md").write_text(f"# Columns\n\n{text}\n")
    found = import_files([tmp_path], parse_profile(profile))
    told = [float(np.mean(record.current)) for record in found.records] or [r.error.code for r in found.refusals]
    assert told == expected
    if "column" in profile:
        assert any(f.text.startswith("F2 [N], F3 [N] not taken") for f in found.records[0].findings)
    for refusal in found.refusals:
        assert "'F1 [N]' and 'F2 [N]' and 'F3 [N]' may each be the force" in refusal.error.found
        assert 'blocks = "split" if each force is a test' in refusal.error.remedy


@pytest.mark.parametrize(
    ("rows", "misfit"),
    [
        ("7;0.2\n8;0.9\n8;0.5\n9;0\n", "plan.csv has '8' twice under 'Versuch' (rows 2 and 3)"),
        ("7;0.2\n9;0\n", "plan.csv names 2 of 3 tests and may lack m08"),
        ("m07;0.2\nm08;0.9\nm08;0.5\n", "plan.csv has 'm08' twice under 'Versuch' (rows 2 and 3)"),
    ],
)
def test_a_plan_that_does_not_fit_its_tests_is_told_where(tmp_path, rows, misfit):
    write(tmp_path, UNITS)
    (tmp_path / "plan.csv").write_text(f"Versuch;Strom (A)\n{rows}")
    assert all(misfit in refusal.error.found for refusal in import_files([tmp_path]).refusals)


def test_a_run_twice_among_five_columns_does_not_begin_the_rows(tmp_path):
    rows = [("R01", 0, 1), ("R02", 0.6, 1), ("R03", 0.9, 1), ("R05", 0, 2), ("R05", 0.6, 2), ("R06", 0.9, 2)]
    (tmp_path / "log.csv").write_text("Run,Current (A),Freq (Hz)\n" + "".join(f"{a},{b},{c}\n" for a, b, c in rows))
    results = plans.results_of(tmp_path / "log.csv")
    assert results is not None
    assert results.current == (0, 0.6, 0.9, 0, 0.6, 0.9)
    with raw_tables(tmp_path / "log.csv") as (table,):
        assert table.read([1]).values[1].size == len(rows)


def test_a_log_with_two_rows_as_near_as_each_other_is_no_answer(tmp_path):
    write(tmp_path, UNITS)
    for name, clock in zip(CURRENTS, ("140500", "141400", "142400"), strict=True):
        (tmp_path / f"{name}.csv").rename(tmp_path / f"R_20230603_{clock}.csv")
    (tmp_path / "log.csv").write_text("Clock;Current (A)\n14:05:10;0.2\n14:14:10;0.9\n14:18:50;0\n")
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}


def test_a_log_may_state_its_times_in_twelve_hours(tmp_path):
    write(tmp_path, UNITS)
    rows = ["Clock;Current (A)"]
    starts, clocks = ("140500", "141400", "142400"), ("2:05 PM", "2:14 pm", "02:24PM")
    for (name, current), start, clock in zip(CURRENTS.items(), starts, clocks, strict=True):
        (tmp_path / f"{name}.csv").rename(tmp_path / f"R_20230603_{start}.csv")
        rows.append(f"{clock};{current}")
    (tmp_path / "log.csv").write_text("\n".join(rows) + "\n")
    assert [float(record.current[0]) for record in import_files([tmp_path]).records] == [*CURRENTS.values()]


def test_the_rig_of_a_plan_is_that_of_its_tests(tmp_path):
    write(tmp_path, UNITS)
    (tmp_path / "plan.csv").write_text("Test;Rig;Current (A)\nm07;north;0.2\nm08;south;0.9\nm09;north;0\n")
    assert [record.rig for record in import_files([tmp_path]).records] == ["north", "south", "north"]
    profile = Profile(rig="east")
    assert {record.rig for record in import_files([tmp_path], profile).records} == {"east"}


def test_a_date_among_keys_above_the_rows_is_no_row_of_a_log(tmp_path):
    head = '"HeaderSize","9"\n"Model Name","DL850E"\n"BlockNumber",1\n"TraceName","Stroke","Load","Coil"\n'
    head += '"VUnit","mm","N","A"\n"SampleRate",200,200,200\n"HResolution",5E-3,5E-3,5E-3\n"HUnit","s","s","s"\n'
    rows = "".join(f",{x:.7f},{f:.4f},0.5\n" for x, f in zip(X, force(0.5), strict=True))
    (tmp_path / "D0.csv").write_text(head + '"Date","2022/07/05","2022/07/05","2022/07/05"\n' + rows)
    (record,) = import_files([tmp_path]).records
    np.testing.assert_allclose(record.displacement, 1e-3 * X, rtol=0, atol=1e-8)


@pytest.mark.parametrize("more", ["", "recorder Node -file out/disp.out -time -node 2 -dof 1 disp\n"])
def test_a_script_beside_files_of_another_suffix_is_no_test_and_notes_are_named_once(tmp_path, more):
    write(tmp_path, UNITS)
    for path in [*tmp_path.iterdir()]:
        path.rename(path.with_suffix(".out"))
    script = "node 1 0.0\nfix 1 1\nuniaxialMaterial Maxwell 1 20.0 3.5 0.4\nelement twoNodeLink 1 1 2 -mat 1 -dir 1\n"
    (tmp_path / "fit.tcl").write_text(script + more)
    (tmp_path / "README.md").write_text(
        "| Test | f (Hz) | Current (A) |\n|---|---|---|\n| T1 | 1 | 0 |\n| T2 | 1 | 1 |\n"
    )
    result = import_files([tmp_path])
    assert {refusal.error.code for refusal in result.refusals} == {"E_CURRENT_MISSING"}
    assert sorted(result.left_out) == ["README.md", "fit.tcl"]


def test_a_list_of_the_laboratory_called_tests_csv_does_not_keep_the_user_from_an_answer(tmp_path):
    write(tmp_path, UNITS)
    (tmp_path / "tests.csv").write_text("test_no,frequency_Hz,remark\n7,1,\n8,1,\n9,1,\n")
    result = import_files([tmp_path])
    assert {refusal.error.code for refusal in result.refusals} == {"E_CURRENT_MISSING"}
    assert "tests.csv" in result.left_out


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
def test_the_first_row_of_a_log_may_be_a_reading_of_zero_without_numbers(tmp_path, suffix):
    write(tmp_path, UNITS)
    still = "".join(
        f"{t:.3f},{x:.6f},0\n" for t, x in zip(T, np.random.default_rng(0).normal(0, 0.002, T.size), strict=True)
    )
    (tmp_path / "m06.csv").write_text(UNITS + still)
    rows = [["Date", "File", "f [Hz]", "Coil current [A]", "Notes"], ["12-05-2021", "m06.csv", "", "", "zero, clamped"]]
    rows += [
        ["12-05-2021", f"{name}.csv", 1, amperes, "" if amperes else "oil warm"] for name, amperes in CURRENTS.items()
    ]
    if suffix == ".xlsx":
        book = openpyxl.Workbook()
        for row in (["Test log"], [], *rows):
            book.active.append(row)
        book.save(tmp_path / "log.xlsx")
    else:
        (tmp_path / "log.csv").write_text("".join(";".join(map(str, row)) + "\n" for row in rows))
    require_the_tests(tmp_path)
    assert "m06" in import_files([tmp_path]).left_out


@pytest.mark.parametrize("folder", ["", "data"])
def test_a_list_of_variables_names_columns_called_by_number_also_from_the_folder_above(tmp_path, folder):
    (tmp_path / folder).mkdir(exist_ok=True)
    write(tmp_path / folder, "v01,v02,v03\n")
    (tmp_path / "list.csv").write_text(
        "degisken;aciklama;birim\nv01;zaman (time);s\nv02;yer degistirme (displacement);mm\nv03;kuvvet (force);N\n"
        "v04;unused;-\n"
    )
    tests = "".join(f"{name};{amperes}\n" for name, amperes in CURRENTS.items())
    (tmp_path / "deneyler.csv").write_text(f"deney;akim_A\n{tests}")
    require_the_tests(tmp_path)
    alone = {refusal.error.code for refusal in import_files([tmp_path / folder]).refusals}
    assert alone == ({"E_COLUMN"} if folder else set())  # a text above what is read may be of another rig


@pytest.mark.parametrize(
    ("item", "last"),
    [
        ("- `{name}` - {what} in {word}\n", ""),
        ("`{name}`: {what} ({unit})\n", ""),
        ("{number}. {name}: {what}, in {unit}\n", ""),
        ("{name} = {what}, {unit}\n", ""),
        ("{name} ({unit}): {what}\n", ""),
        ("Column {number}: {what} ({unit})\n", ""),
        ("Column {number}: {what}, {word}, positive when the rod extends\n", ""),
        ("{what} {name} in {word}, ", "."),
        ("| {name} | {what} in {unit} |\n", ""),
        ("{name}: {what} in {word} (as recorded)\n", ""),
    ],
)
def test_units_that_the_items_of_a_readme_give_its_columns(tmp_path, item, last):
    write(tmp_path, "t,x,F\n")
    whats, words = ("time", "displacement", "force"), ("seconds", "millimetres", "newtons")
    columns = zip("txF", whats, ("s", "mm", "N"), words, strict=True)
    items = [item.format(number=i, name=n, what=t, unit=u, word=w) for i, (n, t, u, w) in enumerate(columns, 1)]
    tests = "".join(f"| {name}.csv | {amperes} |\n" for name, amperes in CURRENTS.items())
    text = "# Tests\n\n" + "".join(items).removesuffix(", ") + last + "\n\n| file | current [A] |\n|---|---|\n" + tests
    (tmp_path / "README.md").write_text(text)
    require_the_tests(tmp_path)


@pytest.mark.parametrize(
    "item",
    [
        "F: range of the load cell (N)",
        "F: oil temperature [degC]",
        "F: force (N)\nF: kN",
        "Full scale: F [kN]",
        "F: load cell no. 4711, N\nF: kN",
        "F: kN (until 2020), N (since 2021)",
        "Figure 3, labels: F: kN",
    ],
)
def test_an_item_of_a_readme_about_something_else_gives_no_unit(tmp_path, item):
    rows = "".join(f"{t:.3f},{x:.7f},{f:.6f}\n" for t, x, f in zip(T, X, force(0.5), strict=True))
    (tmp_path / "m07.csv").write_text(f"t,x,F\n{rows}")
    (tmp_path / "README.md").write_text(f"t: time (s)\nx: displacement (mm)\n{item}\n")
    assert "E_UNITS_MISSING" in {refusal.error.code for refusal in import_files([tmp_path]).refusals}


def test_columns_without_names_that_a_sentence_lists_and_currents_of_the_names_of_files(tmp_path):
    write(tmp_path, "")
    currents = "".join(f"- {name}.csv: {amperes} A\n" for name, amperes in CURRENTS.items())
    text = f"Each file has: time (s), displacement (mm) and force (N).\n{currents}"
    (tmp_path / "README.md").write_text(text)
    require_the_tests(tmp_path)
    (tmp_path / "README.md").write_text(f"{text}m09.csv: 1 A\n")
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}


def test_a_readme_of_the_folder_that_is_read_states_units_and_keys_of_names_of_files_deep_in_it(tmp_path):
    folder = tmp_path / "campaign" / "data" / "raw"
    folder.mkdir(parents=True)
    write(folder, "t,x,F\n")
    for name, amperes in CURRENTS.items():
        (folder / f"{name}.csv").rename(folder / f"{name}_I={amperes}_amp=12.0.csv")
    columns = "Columns: `t` time in s, `x` piston displacement in mm, `F` damper force in N.\n"
    (tmp_path / "campaign" / "README.md").write_text(f"Names: `I` coil current in A, `amp` amplitude in mm.\n{columns}")
    require_the_tests(tmp_path / "campaign")
    assert {refusal.error.code for refusal in import_files([folder]).refusals} == {"E_UNITS_MISSING"}


@pytest.mark.parametrize(
    ("header", "text"),
    [
        ("", "  coluna 1: tempo (s)\n  coluna 2: deslocamento (mm)\n  coluna 3: força (N)\n"),
        ("Active channels: Time,ACT_Disp,ACT_Load\nChannel units: sec,mm,N\n", ""),
    ],
)
def test_columns_without_names_that_lines_name_each_or_by_lists_of_names_and_of_units(tmp_path, header, text):
    write(tmp_path, header)
    for path in tmp_path.iterdir():
        rows = path.read_text().removeprefix(header).replace(",", "\t")
        path.write_text(header + rows)
    (tmp_path / "LEIA-ME.txt").write_text(f"{text}m07 = 0.2 A, m08 = 0.9 A, m09 = 0 A\n", encoding="cp1252")
    require_the_tests(tmp_path)


@pytest.mark.parametrize("column", ["run", "file"])
def test_a_plan_in_each_folder_is_that_of_the_tests_there(tmp_path, column):
    days = {"day1": (0.2, 0.9), "day2": (0.0, 1.5)}
    for day, currents in days.items():
        (tmp_path / day).mkdir()
        rows = [f"run{n}{'.csv' * (column == 'file')},{amperes}\n" for n, amperes in enumerate(currents, 1)]
        (tmp_path / day / "plan.csv").write_text(f"{column},current (A)\n" + "".join(rows))
        for n, amperes in enumerate(currents, 1):
            table = "".join(f"{t:.3f},{x:.7f},{f:.6f}\n" for t, x, f in zip(T, X, force(amperes), strict=True))
            (tmp_path / day / f"run{n}.csv").write_text(UNITS + table)
    result = import_files([tmp_path])
    assert [float(record.current[0]) for record in result.records] == [0.2, 0.9, 0.0, 1.5]
    (tmp_path / "day2" / "plan.csv").unlink()  # that of the other day may be of other tests
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}


@pytest.mark.parametrize(
    ("line", "chosen"),
    [
        ("two LVDTs", None),
        ("use bracket LVDT for damper stroke.", "bracket"),
        ("Bracket bends: use rod LVDT for the damper stroke", "rod"),
        ("do not use bracket LVDT for damper stroke", None),
        ("use rod LVDT for strokes below 5 mm", None),
        ("use rod LVDT for stroke; use bracket LVDT for stroke", None),
    ],
)
def test_a_line_of_a_sheet_of_tests_chooses_one_of_two_displacements(tmp_path, line, chosen):
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append([line])
    for row in ([], ["Test", "I [A]"], *([name.upper(), of] for name, of in CURRENTS.items())):
        sheet.append(row)
    for name, amperes in CURRENTS.items():
        sheet = book.create_sheet(name.upper())
        sheet.append(["time [s]", "bracket LVDT [mm]", "rod LVDT [mm]", "load [N]"])
        for row in zip(T, 1.1 * X, X, force(amperes), strict=True):
            sheet.append(list(map(float, row)))
    book.save(tmp_path / "tests.xlsx")
    result = import_files([tmp_path])
    assert {refusal.error.code for refusal in result.refusals} == (set() if chosen else {"E_AMBIGUOUS"})
    if chosen:
        assert [np.ptp(r.displacement) for r in result.records] == pytest.approx(
            [{"bracket": 0.0264, "rod": 0.024}[chosen]] * 3, rel=1e-3
        )


def test_ranges_of_sensors_do_not_name_columns_without_names(tmp_path):
    write(tmp_path, "")
    (tmp_path / "README.md").write_text("Sensor ranges: time (s), displacement (mm), force (kN)\n")
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_UNITS_MISSING"}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("описание.txt", "Перемещение в см, сила в Н. Ток указан в имени файла.\n"),
        ("README.txt", "All displacements are in cm and all forces in N.\n"),
        ("opis.txt", "Przemieszczenie w cm, siła w N\n"), ("popis.txt", "Dráha: cm\n"),
    ],
)  # fmt: skip
def test_a_unit_of_a_heading_that_notes_contradict_is_asked_about_in_any_language(tmp_path, name, text):
    (tmp_path / name).write_text(text, encoding="utf-8")
    rows = "".join(f"{t:.3f},{x:.7f},{f:.6f}\n" for t, x, f in zip(T, X, force(0.5), strict=True))
    (tmp_path / "a_0.5A.csv").write_text("time [s],displacement [mm],force [N]\n" + rows)
    (refusal,) = import_files([tmp_path]).refusals
    assert refusal.error.code == "E_AMBIGUOUS"
    assert "is in mm by its heading and in c" in str(refusal.error).replace("см", "cm")
    (record,) = import_files([tmp_path], parse_profile('[channels.displacement]\nunit = "cm"\n')).records
    assert np.ptp(record.displacement) == pytest.approx(0.24, rel=1e-3)
    assert [f.code for f in record.findings if "read in cm, as the profile states, not in its own mm" in f.text]


def test_a_structure_beside_a_record_contradicts_the_unit_of_its_column(tmp_path):
    for name, unit in (("a", "mm"), ("b", "cm")):
        (tmp_path / name).mkdir()
        rows = "".join(f"{t:.3f},{x:.7f},{f:.6f}\n" for t, x, f in zip(T, X, force(0.5), strict=True))
        (tmp_path / name / "data_0.5A.csv").write_text("t_s,x_mm,F_N\n" + rows)
        text = f"channels:\n  x: {{quantity: displacement, unit: {unit}, sensor: LVDT}}\n"
        (tmp_path / name / "meta.yaml").write_text(text)
    result = import_files([tmp_path])
    assert [refusal.error.code for refusal in result.refusals] == ["E_AMBIGUOUS"]
    assert len(result.records) == 1


@pytest.mark.parametrize(
    ("head", "notes", "refused"),
    [
        (
            "# Sign convention: extension positive, tension positive\n",
            "compression is positive for displacement and force",
            1,
        ),
        ("# Sign: compression positive\n", "Extension and tension are positive for displacement and force", 1),
        ("# Sign: compression positive\n", "Compression is positive for displacement and force", 0),
    ],
)
def test_signs_that_a_file_and_its_notes_state_in_opposite_senses_are_asked_about(tmp_path, head, notes, refused):
    rows = "".join(f"{t:.3f},{x:.7f},{f:.6f}\n" for t, x, f in zip(T, -X, -force(0.5), strict=True))
    (tmp_path / "a_0.5A.csv").write_text(head + "time [s],displacement [mm],force [N]\n" + rows)
    (tmp_path / "README.md").write_text(f"Sign convention: {notes}.\n")
    result = import_files([tmp_path])
    assert {refusal.error.code for refusal in result.refusals} == ({"E_SIGN_CONVENTION"} if refused else set())
    for record in result.records:
        np.testing.assert_allclose(record.force, force(0.5), atol=1e-2)


@pytest.mark.parametrize("names", [("{}_raw", "{}_processed"), ("{} Roh", "{} korrigiert")])
def test_raw_and_processed_samples_of_a_test_are_no_two_tests(tmp_path, names):
    for name, factor in zip(names, (1.0, 1.2), strict=True):
        rows = "".join(f"{t:.3f},{x:.7f},{f:.6f}\n" for t, x, f in zip(T, X, factor * force(0.5), strict=True))
        (tmp_path / f"{name.format('x1_0.5A')}.csv").write_text("time [s],displacement [mm],force [N]\n" + rows)
    first, second = import_files([tmp_path]).refusals
    assert {first.error.code, second.error.code} == {"E_CONDITIONS"}
    profile = re.search(r"\[file\] leave_out = \S+", str(first.error))[0].replace("] ", "]\n")
    (record,) = import_files([tmp_path], parse_profile(profile)).records
    assert record.id == first.run or Path(first.file).stem.replace(" ", "_") == record.id


def test_fields_and_a_description_of_a_data_package(tmp_path):
    (tmp_path / "data").mkdir()
    write(tmp_path / "data", "t,u,f\n")
    titles = {"t": ("Time", "s"), "u": ("Piston displacement", "mm"), "f": ("Damper force", "N")}
    fields = [{"name": name, "title": title, "unit": unit} for name, (title, unit) in titles.items()]
    files = [
        {"path": f"data/{n}.csv", "description": f"Coil current {a} A", "schema": {"fields": fields}}
        for n, a in CURRENTS.items()
    ]
    (tmp_path / "datapackage.json").write_text(json.dumps({"name": "rig-7", "resources": files}))
    require_the_tests(tmp_path)
    for of, amperes in zip(files, CURRENTS.values(), strict=True):
        of |= {"description": "", "experiment": {"coil_current": {"value": amperes, "unit": "A"}}}
    (tmp_path / "datapackage.json").write_text(json.dumps({"name": "rig-7", "resources": files}))
    require_the_tests(tmp_path)


def test_units_and_current_of_a_json_file_of_the_same_name(tmp_path):
    write(tmp_path, "zeit,hub,kraft\n")
    for name, amperes in CURRENTS.items():
        units = [{"name": n, "unit": u} for n, u in (("zeit", "s"), ("hub", "mm"), ("kraft", "N"))]
        says = {"operator": "lab 3", "coil current": {"value": 1000 * amperes, "unit": "mA"}}
        says["channels"] = {entry["name"]: entry for entry in units}
        (tmp_path / f"{name}.json").write_text(json.dumps(says))
    require_the_tests(tmp_path)


def test_a_list_of_channels_names_columns_in_their_order(tmp_path):
    write(tmp_path, "")
    for name, amperes in CURRENTS.items():
        (tmp_path / f"{name}.csv").rename(tmp_path / f"{name}_{amperes}A.csv")
    channels = [{"name": name, "unit": unit} for name, unit in (("time", "s"), ("stroke", "mm"), ("load", "N"))]
    (tmp_path / "meta.json").write_text(json.dumps({"channels": channels}))
    require_the_tests(tmp_path)


def test_the_frequency_in_a_description_of_a_folder_is_not_that_of_every_record(tmp_path):
    write(tmp_path, "time_s,hub,force_N\n")
    says = {"frequency": {"value": 5, "unit": "Hz"}, "hub": {"unit": "mm"}, "force_N": {"unit": "N"}}
    for name, amperes in CURRENTS.items():
        (tmp_path / f"{name}.csv").rename(tmp_path / f"{name}_{amperes}A.csv")
    (tmp_path / "meta.json").write_text(json.dumps(says))
    require_the_tests(tmp_path)
    assert not any("motion_stated" in record.provenance for record in import_files([tmp_path]).records)


@pytest.mark.parametrize(
    "text",
    [
        "2020/03/04, 25, 60\n2020/03/05, 26, 61\n備註\n",
        "1. Прогрев 10 мин\n2. Запись 30 с\n3. Пауза\n",
        '試 "A, 3, 4\n3, 4\n',
    ],
    ids=["days", "numbered steps", "an open quote"],
)
def test_a_note_in_any_script_is_no_refused_test(tmp_path, text):
    write(tmp_path, UNITS)
    for name, amperes in CURRENTS.items():
        (tmp_path / f"{name}.csv").rename(tmp_path / f"{name}_{amperes}A.csv")
    (tmp_path / "說明.txt").write_text(text)
    require_the_tests(tmp_path)
    assert import_files([tmp_path]).left_out == ("說明.txt",)


def test_units_and_currents_of_a_yaml_file_for_all_files(tmp_path):
    write(tmp_path, "time,stroke,load\n")
    runs = "".join(f"  - file: {name}.csv\n    current: {amperes}\n" for name, amperes in CURRENTS.items())
    text = "bench: 4\nunits: {time: s, stroke: mm, load: N, current: A}\nruns:\n" + runs
    (tmp_path / "campaign.yaml").write_text(text)
    require_the_tests(tmp_path)
    (tmp_path / "campaign.yaml").write_text(text.replace(", current: A", ""))  # 0.2 of what?
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}


def test_a_yaml_file_with_nodes_within_nodes_and_one_that_repeats_itself_without_end(tmp_path):
    write(tmp_path, "time [s],stroke [mm],load [N]\n")
    coil = "rig:\n  coil:\n    current: {value: 0.4, unit: A}\n"
    for name in CURRENTS:
        (tmp_path / f"{name}.yaml").write_text(coil)
    assert {record.current[0] for record in import_files([tmp_path]).records} == {0.4}
    repeated = "a: &a []\n" + "".join(
        f"{key}: &{key} [{', '.join([f'*{before}'] * 10)}]\n" for before, key in pairwise("abcdefghi")
    )
    assert short_lines(tmp_path / "m07.yaml") == ["current: 0.4 A"]
    (tmp_path / "m07.yaml").write_text(coil + repeated)
    assert short_lines(tmp_path / "m07.yaml") == (coil + repeated).splitlines()


@pytest.mark.parametrize(("key", "taken"), [("current_a: 0.4", [0.4]), ("current_a: 0.4\ncurrent_b: 0.4", [])])
def test_a_job_has_its_settings_in_the_folder_of_the_program_that_starts_jobs(tmp_path, key, taken):
    (tmp_path / ".hydra").mkdir()
    write(tmp_path, "t,x,f\n")
    (tmp_path / ".hydra" / "config.yaml").write_text(f"{key}\nunits:\n  t: s\n  x: mm\n  f: N\n")
    assert [record.current[0] for record in import_files([tmp_path]).records] == taken


@pytest.mark.parametrize(
    ("text", "amperes"),
    [
        ("a: !!int ''\nb: !!bool abc\nc: !!timestamp abc\ncoil_current: 0.5 A\n", 0.5),
        ("[" * 2**17 + "\ncoil_current: 0.5 A\n", 0.5),
        ("coil_current: {value: 010, unit: mA}\n", 0.01),
        ("coil_current_A: on\n", None),
        ("coil_current_A: 0_5\n", None),
        ("note: test: first\ncoil_current: 0.5 A\n", 0.5),
        ("operator: A\n---\ncoil_current: 0.5 A\n", 0.5),
        ("rig: &rig {name: B}\nother: *rig\ncoil_current: 0.5 A\n", 0.5),
        ("date: 2024-13-45\ncoil_current: 0.5 A\n", 0.5),
    ],
)
def test_yaml_of_any_form_states_what_its_lines_do_at_once(tmp_path, text, amperes):
    write(tmp_path, "time [s],stroke [mm],load [N]\n")
    (tmp_path / "m07.yaml").write_text(text)
    began = process_time()
    short_lines(tmp_path / "m07.yaml")
    assert process_time() - began < 0.5
    found = import_files([tmp_path / "m07.csv"])
    assert [record.current[0] for record in found.records] == ([] if amperes is None else [amperes])
    assert {refusal.error.code for refusal in found.refusals} == ({"E_CURRENT_MISSING"} if amperes is None else set())


@pytest.mark.parametrize(
    ("text", "amperes"),
    [
        ("Quantity;Description;Value;Unit\nCurrent;maximum of the supply;5;A", None),
        ("Name;Value;Unit;Remark\nCoil current;5;A;limit of the supply", None),
        ("Group;Name;Value;Unit\nCoil;rated current;2;A\nCoil;inductance current;0.1;A", None),
        ("Quantity,Max value,Unit\nCurrent,2,A", None),
        ("Value,Unit,Name\n0.5,A,Coil current", 0.5),
    ],
)
def test_all_cells_of_a_list_of_values_tell_whose_they_are(tmp_path, text, amperes):
    write(tmp_path, "time [s],stroke [mm],load [N]\n")
    (tmp_path / "m07.txt").write_text(text)
    found = import_files([tmp_path / "m07.csv"])
    assert [record.current[0] for record in found.records] == ([] if amperes is None else [amperes])
    assert {refusal.error.code for refusal in found.refusals} == ({"E_CURRENT_MISSING"} if amperes is None else set())


def test_currents_of_a_table_in_a_readme_are_taken_and_those_of_names_compared_with_it(tmp_path):
    write(tmp_path, "time [s],stroke [mm],load [N]\n")
    table = "".join(f"| {name}.csv | {1000 * amperes:g} |\n" for name, amperes in CURRENTS.items())
    (tmp_path / "README.md").write_text("# Tests\n\n| file | coil current [mA] |\n|:---|---:|\n" + table)
    require_the_tests(tmp_path)
    for name in CURRENTS:
        (tmp_path / f"{name}.csv").rename(tmp_path / f"{name}_0.5A.csv")
    (tmp_path / "README.md").write_text((tmp_path / "README.md").read_text().replace(".csv", "_0.5A.csv"))
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_CONTRADICTS"}


def test_a_table_of_symbols_in_a_readme_gives_their_units_to_columns_that_differ_in_capitals(tmp_path):
    for name, amperes in CURRENTS.items():
        rows = zip(T, X, force(amperes), strict=True)
        body = "".join(f"{t:.3f},{x:.7f},{f:.6f},24.5\n" for t, x, f in rows)
        (tmp_path / f"{name}_{amperes}A.csv").write_text("t,x,F,T\n" + body)
    units = {"t": "time | s", "x": "stroke | mm", "F": "force | N", "T": "oil | °C"}
    table = "".join(f"| `{symbol}` | {text} |\n" for symbol, text in units.items())
    (tmp_path / "README.md").write_text("| column | quantity | unit |\n|---|---|---|\n" + table)
    require_the_tests(tmp_path)


def test_scales_of_numbered_channels_in_a_list_of_channels(tmp_path):
    write(tmp_path, "x-axis,1,2\nsecond,Volt,Volt\n", scale=(5.0, 400.0))
    (tmp_path / "channels.csv").write_text("ch,what,factor,unit\n1,stroke,5,mm/V\n2,load,400,N/V\n")
    (tmp_path / "tests.csv").write_text(
        "Measurement no.;I set point / mA;Remark\n" + "".join(f"{n[1:]};{1000 * i:g};\n" for n, i in CURRENTS.items())
    )
    require_the_tests(tmp_path)


@pytest.mark.parametrize(
    ("header", "head", "offset", "codes"),
    [
        ("time [s],ch1 [V],ch2 [V]", "Unit,Sensitivity [unit/V],Offset", 0, set()),
        ("time [s],ch1 [V],ch2 [V]", "Unit,Sensitivity [unit/V],Offset", 3, {"E_UNITS_DIMENSION"}),
        ("time [s],ch1,ch2", "Unit,Scale (EU per V),Offset", 0, {"E_UNITS_MISSING"}),
        ("time [s],ch1,ch2", "Unit,Factor,Offset", 0, {"E_COLUMN"}),
    ],
)
def test_a_list_of_channels_gives_scales_of_volts_and_no_unit_of_bare_numbers(tmp_path, header, head, offset, codes):
    write(tmp_path, f"{header}\n", scale=(5.0, 400.0))
    rows = f"ch1,Stroke,LVDT,mm,5,{offset}\nch2,Load,U9C,N,400,{offset}\n"
    (tmp_path / "channels.csv").write_text(f"Channel,Measurand,Sensor,{head}\n{rows}")
    (tmp_path / "tests.csv").write_text("file,current_A\n" + "".join(f"{n}.csv,{i:g}\n" for n, i in CURRENTS.items()))
    if not codes:
        require_the_tests(tmp_path)
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == codes


@pytest.mark.parametrize("variable", ["Coil Current\tCoilCurrent\t{}\tA\t", "Coil Current\tCoilCurrent\tA\t{}\t"])
def test_a_list_of_variables_beside_the_only_record_of_a_folder_states_its_current(tmp_path, variable):
    write(tmp_path, "time [s],stroke [mm],load [N]\n")
    order = "Value\tUnit" if variable.endswith("A\t") else "Unit\tValue"
    for name, amperes in CURRENTS.items():
        (tmp_path / name).mkdir()
        (tmp_path / f"{name}.csv").rename(tmp_path / name / "timed.csv")
        text = f"Display Name\tInternal Name\t{order}\tComment\n{variable.format(amperes)}\nMass\tMass\t3.4\tkg\t\n"
        (tmp_path / name / "variables.txt").write_text(text)
    require_the_tests(tmp_path)


@pytest.mark.parametrize(
    ("name", "described"),
    [("meta.json", 1), ("m07_info.yaml", 1), ("m08.json", 0), ("m08.yaml", 0), ("m08.xml", 0), ("m08.txt", 0)],
)
def test_the_description_of_another_record_states_no_current_of_the_only_record_of_a_folder(tmp_path, name, described):
    write(tmp_path, "time [s],stroke [mm],load [N]\n")
    for other in ("m08.csv", "m09.csv"):
        (tmp_path / other).unlink()
    texts = {".json": '{"coil_current": "1.5 A"}', ".xml": '<test><coilCurrent unit="A">1.5</coilCurrent></test>'}
    (tmp_path / name).write_text(texts.get((tmp_path / name).suffix, "coil_current: 1.5 A\n"))
    assert [record.current[0] for record in import_files([tmp_path]).records] == [1.5] * described


def test_the_scale_of_an_amplifier_of_the_load_cell_is_not_that_of_the_current(tmp_path):
    for name, amperes in CURRENTS.items():
        rows = zip(T, X / 10, force(amperes) / 400, np.full(T.size, 100 * amperes), strict=True)
        head = "Time,Channel A,Channel B,Channel C\n(s),(V),(V),(mV)\n"
        lines = ["{:.3f},{:.7f},{:.7f},{:.3f}\n".format(*row) for row in rows]
        (tmp_path / f"{name}.csv").write_text(head + "".join(lines))
    notes = "A: LVDT, 1 V = 10 mm\nChannel B: load cell amplifier, 1 V = 400 N\nChannel C: clamp, 100 mV per A\n"
    (tmp_path / "notes.txt").write_text(f"Channel {notes}")
    require_the_tests(tmp_path)


def test_cells_of_a_list_may_hold_the_unit_that_its_heading_lacks(tmp_path):
    write(tmp_path, "time [s],stroke [mm],load [N]\n")
    rows = [f"{i};{name};2 Hz / 12 mm;{amperes:g} A\n" for i, (name, amperes) in enumerate(CURRENTS.items(), 1)]
    (tmp_path / "programme.csv").write_text("No.;Record;Excitation;Coil\n" + "".join(rows))
    require_the_tests(tmp_path)


def test_a_list_of_tests_without_anything_that_names_them_is_not_applied(tmp_path):
    write(tmp_path, "time [s],stroke [mm],load [N]\n")
    (tmp_path / "tests.csv").write_text("Remark;Current / A\nfirst;0.2\nsecond;0.9\nthird;0.0\n")
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("README.md", "# Rig\nExtension counts negative: sign of the rig.\n"),
        ("setup.yaml", "rig: B\nsign convention: compression positive\n"),
    ],
)
def test_a_text_beside_the_files_states_the_signs_of_all(tmp_path, name, text):
    header = "time [s],disp [mm],load [N]\n"
    write(tmp_path, header, (-1.0, -1.0))
    (tmp_path / name).write_text(text)
    for own, amperes in CURRENTS.items():
        (tmp_path / f"{own}.csv").rename(tmp_path / f"{own}_{amperes}A.csv")
    require_the_tests(tmp_path)


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        ("Alle Größen in SI-Einheiten.\n", []),
        ("Units: SI\n", []),
        ("SI units, except the stroke in mm\n", ["E_UNITS_MISSING"]),
        ("Si las unidades faltan, preguntar\n", ["E_UNITS_MISSING"]),
        ("All in SI units: mm and N\n", ["E_UNITS_MISSING"]),
    ],
)
def test_a_text_may_state_that_all_units_are_those_of_the_si(tmp_path, text, codes):
    (tmp_path / "README.txt").write_text(text, encoding="utf-8")
    rows = zip(T, 1e-3 * X, force(0.5), strict=True)
    (tmp_path / "a_0.5A.csv").write_text(
        "time,stroke,load\n" + "".join(f"{t:.3f},{x:.7f},{f:.4f}\n" for t, x, f in rows)
    )
    found = import_files([tmp_path])
    assert {refusal.error.code for refusal in found.refusals} == {*codes}
    assert [round(1e3 * np.ptp(record.displacement)) for record in found.records] == ([] if codes else [24])


def test_the_text_of_one_test_states_the_sign_of_no_other(tmp_path):
    write(tmp_path, "time [s],disp [mm],load [N]\n", (1.0, 1.0))
    for own, amperes in CURRENTS.items():
        (tmp_path / f"{own}.csv").rename(tmp_path / f"{own}_{amperes}A.csv")
    first, *others = sorted(tmp_path.glob("*.csv"))
    first.with_suffix(".json").write_text('{"sign convention": "compression positive"}')
    found = import_files([tmp_path])
    changed = {r.id: r.provenance.get("sign_changed", "") for r in found.records}
    assert changed[first.stem]
    assert not any(changed[other.stem] for other in others)


@pytest.mark.parametrize(
    "text",
    [
        "Start direction: compression, positive ramp\n",
        "The damper is pushed to the positive end stop before each test.\n",
    ],
)
def test_sentences_about_the_test_state_no_sign(tmp_path, text):
    write(tmp_path, "time [s],disp [mm],load [N]\n", (1.0, 1.0))
    (tmp_path / "README.txt").write_text(text)
    for own, amperes in CURRENTS.items():
        (tmp_path / f"{own}.csv").rename(tmp_path / f"{own}_{amperes}A.csv")
    require_the_tests(tmp_path)


def test_steps_of_a_procedure_are_no_tests(tmp_path):
    write(tmp_path, "time [s],disp [mm],load [N]\n", (1.0, 1.0))
    for number, path in enumerate(sorted(tmp_path.glob("*.csv")), 1):
        path.rename(tmp_path / f"rec_{number}.csv")
    (tmp_path / "procedure.txt").write_text("Step 1: warm up at 0.2 A\nStep 2: heat the coil at 0.8 A\n")
    found = import_files([tmp_path])
    assert not found.records
    assert {refusal.error.code for refusal in found.refusals} == {"E_CURRENT_MISSING"}


def test_a_rate_in_a_sentence_of_a_readme_times_counted_samples_and_two_rates_are_asked_about(tmp_path):
    for name, amperes in CURRENTS.items():
        rows = "".join(f"{i};{x:.7f};{f:.6f}\n" for i, (x, f) in enumerate(zip(X, force(amperes), strict=True)))
        (tmp_path / f"{name}_{amperes}A.csv").write_text("Index;Weg [mm];Kraft [N]\n" + rows)
    says = "Alle Kanäle wurden mit einer Abtastrate von 200 Hz aufgezeichnet, Filter 50 Hz.\n"
    (tmp_path / "LIESMICH.txt").write_text(says, encoding="utf-8")
    require_the_tests(tmp_path)
    (record, *_) = import_files([tmp_path]).records
    assert record.time[-1] == pytest.approx(T[-1])
    assert "W_CHOSEN" in {finding.code for finding in record.findings}
    (tmp_path / "LIESMICH.txt").write_text(says + "The force was sampled at 1 kHz.\n", encoding="utf-8")
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_AMBIGUOUS"}


@pytest.mark.parametrize(
    "text",
    [
        "Sampling with a 50 Hz low-pass filter.",
        "recorded with a filter of 100 Hz",
        "Sampled at 25 kHz, decimated to 250 Hz",
        "Sampling rate: 25 kHz\nEvery 100th sample is kept: decimated",
        "The sample oscillates at 1 Hz",
        "échantillon testé à 1 Hz",
        "Two samples (A and B) were driven with 1 Hz sines",
        "sampling of temperature at 1 Hz",
        "Tests were recorded at 1 Hz and 10 mm",
        "Thermometer: 2 readings per second",
        "Camera 300 Hz scan",
        "Camera, scan rate 300 Hz",
        "Controller data rate 1 kHz",
        "filter: 100 samples per second moving average",
        "Laser: scan rate 300 Hz",
        "Laser vibrometer scanned at 200 kHz",
        "Oil temperature at a scan rate of 200 kHz",
        "Camera: sampling rate 300 Hz",
        "Gyro: 300 samples per second",
        "## Camera\n- scan rate: 300 Hz",
    ],
)
def test_a_frequency_of_something_else_than_the_rows_is_no_sampling_rate(text, tmp_path):
    rows = "".join(f"{x:.7f},{f:.6f}\n" for x, f in zip(X, force(0.5), strict=True))
    (tmp_path / "a_0.5A.csv").write_text("stroke [mm],load [N]\n" + rows)
    (tmp_path / "README.txt").write_text(text, encoding="utf-8")
    found = import_files([tmp_path])
    assert not found.records
    assert found.refusals


def test_a_sampling_rate_stands_beside_other_frequencies(tmp_path):
    rows = "".join(f"{x:.7f},{f:.6f}\n" for x, f in zip(X, force(0.5), strict=True))
    (tmp_path / "a_0.5A.csv").write_text("stroke [mm],load [N]\n" + rows)
    (tmp_path / "README.txt").write_text(
        "Camera. Temperature 23 C, sampling rate (all channels): 200 Hz (laser 9 kHz), filter 50 Hz"
    )
    assert import_files([tmp_path]).records[0].time[-1] == pytest.approx(T[-1])


@pytest.mark.parametrize("word", ["Signal", "Row", "column", "Столбец"])
def test_columns_without_names_are_those_that_a_text_numbers(word, tmp_path):
    for name, amperes in CURRENTS.items():
        np.savetxt(tmp_path / f"{name}.dat", np.column_stack([X, force(amperes), np.full_like(T, amperes), T]))
    listed = ["displacement [mm]", "force [N], load cell 3", "coil current [A]", "time [s]"]
    text = "Recorded with a target computer\n" + "".join(f"{word} {i}: {what}\n" for i, what in enumerate(listed, 1))
    (tmp_path / "signals.txt").write_text(text)
    require_the_tests(tmp_path)


@pytest.mark.parametrize("between", ["\n", "; ", ", "], ids=["lines", "semicolons", "commas"])
def test_codes_of_names_are_listed_on_lines_or_on_one(between, tmp_path):
    write(tmp_path, "time [s],stroke [mm],load [N]\n")
    for i, name in enumerate(CURRENTS):
        (tmp_path / f"{name}.csv").rename(tmp_path / f"M1_C{i}.csv")
    codes = between.join(f"C{i} = {amperes} A" for i, amperes in enumerate(CURRENTS.values()))
    (tmp_path / "README.txt").write_text(f"M: motion, C: current\n{codes}\n")
    require_the_tests(tmp_path)


@pytest.mark.parametrize("line", ["Pliki p0{} - p0{}: prąd {} A", "Tests {} to {}: coil at {} A"])
def test_tests_from_one_number_to_another_have_the_current_of_their_line(tmp_path, line):
    for i, amperes in enumerate((0.0, 0.0, 0.9, 0.9), 1):
        lines = zip(T, (1 + i) / 5 * X, force(amperes), strict=True)
        text = "time [s],stroke [mm],load [N]\n" + "".join(f"{t:.3f},{x:.7f},{f:.6f}\n" for t, x, f in lines)
        (tmp_path / f"p0{i}.csv").write_text(text)
    (tmp_path / "CZYTAJ.txt").write_text(f"Rig 4\n{line.format(1, 2, 0)}\n{line.format(3, 4, '0,9')}\n", "cp1250")
    result = import_files([tmp_path])
    assert [float(np.mean(record.current)) for record in result.records] == pytest.approx([0.0, 0.0, 0.9, 0.9])


@pytest.mark.parametrize(
    "heading", ["Fuses: ", "Fuses:\n", "Fuses\n\n", "Leakage before each test\n", "Supply limits. ", "Messbereich: "]
)
def test_codes_below_a_heading_of_ratings_are_no_currents(heading, tmp_path):
    write(tmp_path, "time [s],stroke [mm],load [N]\n")
    codes = [f"{name} = {amperes} A" for name, amperes in CURRENTS.items()]
    (tmp_path / "README.txt").write_text(heading + ", ".join(codes))
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}
    (tmp_path / "README.txt").write_text(f"{heading}{codes[0]}\nTests:\n" + "\n".join(codes))
    require_the_tests(tmp_path)


@pytest.mark.parametrize("over", ["\tI = {} A\tI = {} A", "\tI = {} A", "\t{}"])
def test_currents_in_a_line_below_the_units_belong_to_the_columns_beside_one_time(over, tmp_path):
    names, units, first = "\tDisplacement\tForce" * 3, "\tmm\tN" * 3, ""
    columns = [column for amperes in CURRENTS.values() for column in (X, force(amperes))]
    if over.count("{}") == 1:  # of one motion
        names, units, first = "\tDisplacement" + "\tForce" * 3, "\tmm" + "\tN" * 3, "\tsine, 1 Hz"
        columns = columns[:1] + columns[1::2]
    first = "Current (A)\t" if over == "\t{}" else first
    line = first + "".join(over.format(amperes, amperes) for amperes in CURRENTS.values())
    head = f"Time{names}\ns{units}\n{line}"
    np.savetxt(tmp_path / "book.txt", np.column_stack([T, *columns]), delimiter="\t", header=head, comments="")
    require_the_tests(tmp_path)


def test_a_text_that_changes_where_the_time_starts_again_names_the_tests(tmp_path):
    lines = ["condition,time_s,stroke_mm,load_N,phase"]
    for name, amperes in CURRENTS.items():
        rows = enumerate(zip(T, X, force(amperes), strict=True))
        lines += [f"{name},{t:.3f},{x:.7f},{f:.6f},{'start' if i < 99 else 'run'}" for i, (t, x, f) in rows]
    (tmp_path / "tidy.csv").write_text("\n".join(lines) + "\n")
    values = {f"*_{name}": amperes for name, amperes in CURRENTS.items()}
    result = import_files([tmp_path], Profile.model_validate({"current": {"values": values}}))
    assert [record.id for record in result.records] == [f"tidy_{name}" for name in CURRENTS]
    assert [record.current[0] for record in result.records] == list(CURRENTS.values())


@pytest.mark.parametrize("at", ["at {} A", "bei {} A", "@ {} A"])
def test_columns_of_forces_state_their_current_behind_the_unit(at, tmp_path):
    names = ["time (s)", "stroke (mm)", *(f"force (N) {at.format(amperes)}" for amperes in CURRENTS.values())]
    columns = np.column_stack([T, X, *map(force, CURRENTS.values())])
    np.savetxt(tmp_path / "wide.csv", columns, delimiter=",", header=",".join(names), comments="")
    require_the_tests(tmp_path)


@pytest.mark.parametrize(
    ("text", "factor", "others"),
    [
        ("scan rate 200 Hz", 1.0, ["scan rate 700 Hz"]),
        ("scan rate 200 Hz", 1000.0, ["scan rate 700 Hz", "filter 200 Hz"]),
        ("DAQ: 200 scans per second", 1.0, ["DAQ: 700 scans per second"]),
        ("0.2 kS/s, 8 mm", 1000.0, ["0.7 kS/s, 8 mm"]),
        ("Messrate: 200 Hz", 1000.0, ["Messrate: 700 Hz"]),
    ],
)
def test_a_rate_in_a_text_beside_gives_the_unit_of_time_and_another_rate_does_not(tmp_path, text, factor, others):
    rows = "".join(f"{t:.6g},{x},{f}\n" for t, x, f in zip(factor * T, X, force(0.5), strict=True))
    (tmp_path / "a_0.5A.csv").write_text(f"Time,disp [mm],force [N]\n{rows}")
    (tmp_path / "README.txt").write_text(f"Damper bench\n{text}\n")
    (record,) = import_files([tmp_path]).records
    assert np.median(np.diff(record.time)) == pytest.approx(0.005, rel=1e-6)
    for other in others:
        (tmp_path / "README.txt").write_text(f"Damper bench\n{other}\n")
        assert [refusal.error.code for refusal in import_files([tmp_path]).refusals] == ["E_UNITS_MISSING"]


_CUBE = (
    "array (test, sample, channel)\n\n- channels: time (s), displacement (mm), force (N)\n- currents of the tests: {}\n"
)


@pytest.mark.parametrize("axes", [(0, 1, 2), (0, 2, 1), (2, 0, 1), (1, 2, 0)])
@pytest.mark.parametrize("listed", ["0, 0.5, 1.0 and 1.5 A", "0; 500; 1000; 1500 mA", "0 A, 0,5 A, 1,0 A und 1,5 A"])
def test_tests_of_an_array_are_told_by_their_time_and_have_the_currents_that_a_text_lists(tmp_path, axes, listed):
    cube = np.array([np.column_stack([T, X, force(amperes)]) for amperes in (0.0, 0.5, 1.0, 1.5)])
    np.save(tmp_path / "cube.npy", cube.transpose(axes))
    (tmp_path / "README.md").write_text(_CUBE.format(listed))
    records = import_files([tmp_path]).records
    assert [record.current[0] for record in records] == [0.0, 0.5, 1.0, 1.5]
    assert [np.ptp(record.force) for record in records] == pytest.approx([np.ptp(test[:, 2]) for test in cube])
    assert all("README.md, a list of as many currents" in f.text for r in records for f in r.findings[-1:])


@pytest.mark.parametrize(
    ("order", "stretched", "listed"),
    [
        ((0, 1, 2, 3), 1, "0, 0.5 and 1.0 A"),  # fewer than tests
        ((0, 1, 2, 3), 1, "0, 0.5, 1.0 and 1.5 A; then 0, 0.2, 0.4, 0.6 A"),  # two lists
        ((0, 1, 2, 3), 1, "maximum of the supply 0, 0.5, 1.0, 1.5 A"),
        ((1, 0, 2, 3), 1, "0, 0.5, 1.0 and 1.5 A"),  # forces that do not grow so
        ((0, 1, 2, 3), 2, "0, 0.5, 1.0 and 1.5 A"),  # another motion
    ],
)
def test_a_list_of_currents_that_may_not_be_that_of_the_tests_is_asked_about(tmp_path, order, stretched, listed):
    cube = np.array([np.column_stack([T, X, force(amperes)]) for amperes in (0.0, 0.5, 1.0, 1.5)])[[*order]]
    cube[3, :, 1] *= stretched
    np.save(tmp_path / "cube.npy", cube)
    (tmp_path / "README.md").write_text(_CUBE.format(listed))
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}
    np.save(tmp_path / "cube.npy", cube[:, :, 1:])
    (refusal,) = import_files([tmp_path]).refusals
    assert "save each test as an array of its own, its current in its name" in str(refusal.error)


def write_two(folder) -> None:
    for number, amperes in enumerate((0.2, 0.9), 1):
        rows = "".join(f"{t},{x},{f}\n" for t, x, f in zip(T, X, force(amperes), strict=True))
        (folder / f"t{number}.csv").write_text(f"time [s],disp [mm],force [N]\n{rows}")


@pytest.mark.parametrize(
    "text",
    [
        "Coil current up to 1/2 A",
        "Coil current 1/2 A",
        "Earlier campaign in 2019: 0, 1 A",
        "Currents of an earlier campaign: 0, 1 A",
        "Tests of damper B were run at 0 and 1 A",
        "Currents of damper B: 0 and 1 A",
        "Currents that were not measured: 1 and 2 A",
        "Sicherungen 6 und 10 A",
        "Heizstrom 1 und 2 A",
        "Solenoid valve currents 1 and 2 A",
        "See chapters 2 and 3 A",
        "Load cell 1/2 A",
        "Currents of test 2: 0 and 1 A",
        "Currents 0.2 and 0.9 A (test 2 and 1)",
        "Zero current was not tested; 0 and 1 A are planned",
    ],
)
def test_a_list_of_currents_of_something_else_than_the_tests_is_no_list_of_theirs(tmp_path, text):
    write_two(tmp_path)
    (tmp_path / "README.md").write_text(f"Damper bench\n{text}\n")
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}


def test_a_list_of_as_many_currents_is_that_of_the_tests_if_no_other_text_lists_more(tmp_path):
    write_two(tmp_path)
    for line in (
        "Currents: 0.2 and 0.9 A",
        "- coil currents of the 2 tests: 0.2, 0.9 A.",
        "Spulenströme 0,2 und 0,9 A",
    ):
        (tmp_path / "README.md").write_text(f"Damper bench\n{line}\n")
        assert [record.current[0] for record in import_files([tmp_path]).records] == [0.2, 0.9]
    (tmp_path / "notes.txt").write_text("Coil currents: 0 and 1 A\n")
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}


@pytest.mark.parametrize(
    ("heading", "cells", "codes"),
    [
        ("Supply current (A)", ("0", "0.5", "1.5"), set()),
        ("Coil current Nominal (A)", ("0", "0.5", "1.5"), set()),
        ("Supply current (A),Coil current (A)", ("2.0,0", "2.5,0.5", "3.5,1.5"), set()),
        ("Supply current (A)", ("2", "2", "2"), {"E_CURRENT_MISSING"}),
        ("Supply current limit (A)", ("1", "2", "3"), {"E_CURRENT_MISSING"}),
        ("Supply current (A)", ("5.1", "5.0", "4.8"), {"E_CURRENT_MISSING"}),
        ("24 V supply current (A)", ("0.5", "0.6", "0.7"), {"E_CURRENT_MISSING"}),
        ("Supply current of the rig (A)", ("5.1", "5.3", "5.8"), {"E_CURRENT_MISSING"}),
    ],
)
def test_a_supplys_current_that_differs_between_tests_is_the_coils_where_no_other_is_listed(
    tmp_path, heading, cells, codes
):
    lines = [f"{number},{cell}\n" for number, cell in enumerate(cells, 1)]
    (tmp_path / "results.csv").write_text("".join([f"Test,{heading}\n", *lines]))
    for number, amperes in enumerate((0.0, 0.5, 1.5), 1):
        rows = zip(T, X, force(amperes), strict=True)
        text = "".join(f"{t},{x},{f}\n" for t, x, f in rows)
        (tmp_path / f"test_{number}.csv").write_text(f"time [s],disp [mm],force [N]\n{text}")
    found = import_files([tmp_path])
    assert {refusal.error.code for refusal in found.refusals} == codes
    assert [record.current[0] for record in found.records] == ([] if codes else [0.0, 0.5, 1.5])
    assert all("its current is the" in record.findings[-1].text for record in found.records)


def test_a_workspace_whose_names_end_in_those_of_tests_holds_a_test_each(tmp_path):
    tests = {f"{amperes}A": {"t": T, "x": X, "F": force(amperes)} for amperes in (0, 1)}
    arrays = {f"{name}_{test}": values for test, channels in tests.items() for name, values in channels.items()}
    np.savez(tmp_path / "all.npz", **arrays)
    (tmp_path / "readme.txt").write_text(
        "workspace of load_all.m\nt_* time (s), x_* stroke (mm), F_* damper force (N)\n0A means current 0 A\n"
    )
    assert [(record.id, record.current[0]) for record in import_files([tmp_path]).records] == [
        ("all_0A", 0),
        ("all_1A", 1),
    ]
    np.savez(tmp_path / "all.npz", **{key.replace("A", ""): values for key, values in arrays.items()})
    refusals = import_files([tmp_path]).refusals  # that 0A means 0 A is no statement on all tests
    assert [refusal.error.code for refusal in refusals] == ["E_CURRENT_MISSING"] * 2
