"""Delimited text: every row of the contract that is the reader's, and the many writings of one test."""

import gzip
from datetime import datetime, timedelta

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.rig_files import NAMES, channels, lines_of, rows, text, write

from mrdamper.errors import CombinedError, InputError
from mrdamper.rig_files.profile import parse_profile
from mrdamper.rig_files.rig_import import read_run, read_runs
from mrdamper.rig_files.text.cells import read_bulk
from mrdamper.rig_files.text.tokens import stamp

CLEAN = text()
LAST = CLEAN.rindex(",")
BYTES = CLEAN.encode()
MIDDLE = BYTES.index(b"\n", 3000) + 4  # inside a number
TWICE = np.column_stack([rows(), rows()[:, 2]])
DIFFERENT = TWICE + np.array([0, 0, 0, 1.0])
WIDE = "\n".join(",".join(cell.format(i) for i in range(1200)) for cell in ("c{}", "{}", "{}.5")) + "\n"


def quoted(decimal="."):
    lines = [",".join(f'"{cell.replace(".", decimal)}"' for cell in line.split(",")) for line in CLEAN.splitlines()]
    return "\n".join(lines) + "\n"


REFUSED = {
    "no bytes": (b"", "E_EMPTY", None),
    "remarks only": ("# a\n# b\n", "E_NO_DATA", None),
    "a machine's head without data": (
        "MTS793|MPT|ENU|1|0|.|/|:|1|0|0|A\n\nTime\tAxial Displacement\tAxial Force\nSec\tmm\tN\n", "E_NO_DATA", None,
    ),
    "decimal commas from line 301 on": (
        "\n".join([*CLEAN.split("\n")[:300], *text(decimal=",").split("\n")[300:]]), "E_AMBIGUOUS", 301,
    ),
    "blank": ("\n \n", "E_EMPTY", None),
    "header only": ("time_s,displacement_mm,force_N\n", "E_NO_DATA", None),
    "header without line end": ("time_s,displacement_mm,force_N", "E_NO_DATA", None),
    "ends inside the last row": (CLEAN[:LAST], "E_TRUNCATED", 601),
    "ends at a separator": (CLEAN[: LAST + 1], "E_TRUNCATED", 601),
    "ends inside the first row": ("time_s,displacement_mm,force_N\n0.0,1.0", "E_TRUNCATED", 2),
    "short last row": (CLEAN[:LAST] + "\n", "E_TRUNCATED", 601),
    "no text inside a number": (BYTES[:MIDDLE] + b"\xff" + BYTES[MIDDLE + 1 :], "E_ENCODING", 101),
    "half a character inside a number": (BYTES[:MIDDLE] + b"\xc3" + BYTES[MIDDLE + 1 :], "E_ENCODING", 101),
    "control byte": (BYTES[:MIDDLE] + b"\x07" + BYTES[MIDDLE + 1 :], "E_ENCODING", 101),
    "block of zeros": (BYTES[:MIDDLE] + bytes(4096) + BYTES[MIDDLE:], "E_NUL", 101),
    "nothing but zeros": (bytes(4096), "E_NUL", 1),
    "decimal comma, comma separator": (text(decimal=","), "E_AMBIGUOUS", 2),
    "one field more": (lines_of({100: "0.49,1,2.0,3.0"}), "E_FIELD_COUNT", 100),
    "one field less": (lines_of({100: "0.49,1"}), "E_FIELD_COUNT", 100),
    "more names than fields": (text(header=("time_s,displacement_mm,force_N,x",)), "E_FIELD_COUNT", 2),
    "point beside comma": (lines_of({100: "0.49;1,5;2.0"}, header=(";".join(NAMES),), separator=";"), "E_NUMBER", 100),
    "points and commas from the start": (
        "time_s;displacement_mm;force_N\n0.1;1,5;2\n0.2;1,6;2\n0.3;1,7;3\n", "E_AMBIGUOUS", 2,
    ),
    "thousands or decimals": (
        "time_s;displacement_mm;force_N\n1;1,500;2\n2;1,600;2\n3;1,700;3\n", "E_AMBIGUOUS", 2,
    ),
    "underscore": (lines_of({100: "0.49,1_000.5,3.0"}), "E_NUMBER", 100),
    "underscore in the first row": (lines_of({2: "0.0,1_000.5,3.0"}), "E_NUMBER", 2),
    "Arabic digits": (lines_of({100: "0.49,١٢.٥,3.0"}), "E_NUMBER", 100),
    "full-width digits": (lines_of({100: "0.49,１.５,3.0"}), "E_NUMBER", 100),
    "hexadecimal": (lines_of({100: "0.49,0x1F,3.0"}), "E_NUMBER", 100),
    "typographic minus": (lines_of({100: "0.49,−1.5,3.0"}), "E_NUMBER", 100),
    "a decimal comma among points": (lines_of({100: '0.49,"1,5",3.0'}), "E_NUMBER", 100),
    "no date": ("time,displacement_mm,force_N\n2024-13-01T00:00:00,1,2\n2024-13-01T00:00:01,1,3\n", "E_NUMBER", None),
    "two points": (lines_of({100: "0.49,1.5.2,3.0"}), "E_NUMBER", 100),
    "a word": (lines_of({100: "0.49,overload,3.0"}), "E_NUMBER", 100),
    "infinity": (lines_of({100: "0.49,inf,3.0"}), "E_NONFINITE", 100),
    "overflow": (lines_of({100: "0.49,1e999,3.0"}), "E_NONFINITE", 100),
    "no units": (text(header=("time,displacement,force",)), "E_UNITS_MISSING", None),
    "one unit missing": (text(header=("time_s,displacement_mm,force",)), "E_UNITS_MISSING", None),
    "symbols that differ in capitals only": (text(DIFFERENT, ("t,x,F,T",)), "E_UNITS_MISSING", None),
    "unknown unit": (text(header=("time_s,displacement_mm,force [blub]",)), "E_UNITS_MISSING", None),
    "no header": (text(header=()), "E_UNITS_MISSING", None),
    "wrong dimension": (text(header=("time_s,displacement_mm,force_mm",)), "E_UNITS_DIMENSION", None),
    "name and row of units disagree": (text(header=("time,displacement,Force [kN]", "s,mm,N")), "E_AMBIGUOUS", 1),
    "mass for force": (text(header=("time_s,displacement_mm,Force [kg]",)), "E_UNITS_DIMENSION", None),
    "no force": (text(header=("time_s,displacement_mm,temperature_C",)), "E_COLUMN", None),
    "two forces": (text(TWICE, ("time_s,displacement_mm,force left_N,force right_N",)), "E_AMBIGUOUS", 1),
    "one name, two values": (text(DIFFERENT, ("time_s,displacement_mm,force_N,force_N",)), "E_DUPLICATE_COLUMN", 1),
    "names that differ in capitals only": (text(DIFFERENT, ("time_s,displacement_mm,force_N,Force_N",)),
                                            "E_DUPLICATE_COLUMN", 1),
    "open quote": (lines_of({100: '0.49,"1.0,3.0'}), "E_QUOTE", 100),
    "open quote in the header": (lines_of({1: 'time_s,"displacement_mm,force_N'}), "E_QUOTE", 1),
    "open quote at the end": (CLEAN + '"3.0,1.0,2.0', "E_QUOTE", 602),
    "long line": (lines_of({100: "1" * 70_000}), "E_LINE_TOO_LONG", 100),
    "endless line": (b"1" * 3_000_000, "E_LINE_TOO_LONG", 1),
    "too many columns": (WIDE, "E_TOO_MANY_COLUMNS", 2),
    "time repeated": (lines_of({100: CLEAN.splitlines()[98]}), "E_TIME_DUPLICATE", None),
    "time backwards": (lines_of({100: "0.1,1.0,3.0"}), "E_TIME_ORDER", None),
    "stamps with and without zone": (
        "time,displacement_mm,force_N\n2024-01-01T00:00:00Z,1,2\n2024-01-01T00:00:01,1,3\n2024-01-01T00:00:02Z,1,4\n",
        "E_AMBIGUOUS", 3,
    ),
}  # fmt: skip

ACCEPTED = {
    "plain": (CLEAN, "utf-8", ""),
    "no line end": (CLEAN[:-1], "utf-8", "W_NO_EOL"),
    "cut inside the last number": (CLEAN[:-4], "utf-8", "W_NO_EOL"),
    "byte order mark": (CLEAN, "utf-8-sig", ""),
    "UTF-16": (CLEAN, "utf-16", ""),
    "UTF-16 without mark": (CLEAN, "utf-16-le", ""),
    "UTF-16, big end first": (CLEAN, "utf-16-be", ""),
    "UTF-32": (CLEAN, "utf-32", ""),
    "old line ends": (text(end="\r"), "utf-8", ""),
    "Windows line ends": (text(end="\r\n"), "utf-8", ""),
    "semicolons": (text(header=(";".join(NAMES),), separator=";", decimal=","), "utf-8", ""),
    "tabs": (text(header=("\t".join(NAMES),), separator="\t", decimal=","), "utf-8", ""),
    "spaces": (text(header=("# " + " ".join(NAMES),), separator=" "), "utf-8", ""),
    "aligned columns": (text(header=("  Time [s]   Displacement [mm]   Force [N]",), separator="   "), "utf-8", ""),
    "quoted": (quoted(), "utf-8", ""),
    "quoted decimal commas": (quoted(","), "utf-8", ""),
    "separator at the end": (CLEAN.replace("\n", ",\n"), "utf-8", ""),
    "separator at the end of rows only": (CLEAN.replace("\n", ",\n").replace("force_N,", "force_N"), "utf-8", ""),
    "blank lines": (CLEAN + "\n\n", "utf-8", ""),
    "end-of-file mark": (CLEAN + "\x1a", "utf-8", ""),
    "remark inside": (CLEAN.replace("\n0.5", "\n# half a second\n0.5", 1), "utf-8", ""),
    "capitals": (text(header=("TIME [S],DISPLACEMENT [MM],FORCE [N]",)), "utf-8", ""),
    "units row": (text(header=("t;x;F", "s;mm;N"), separator=";"), "utf-8", ""),
    "bracketed units row": (text(header=("Time;Position;Load", "[s];[mm];[N]"), separator=";"), "utf-8", ""),
    "brackets": (text(header=("Time (s) , Position (mm) , Axial Load (N)",)), "utf-8", ""),
    "German": (text(header=("Zeit in s;Weg in mm;Kraft in N",), separator=";", decimal=","), "cp1252", ""),
    "French": (text(header=("Temps [s];Déplacement [mm];Force [N]",), separator=";", decimal=","), "cp1252", ""),
    "metadata": (
        text(header=("Messung vom 01.02.2024", "Rate;200 Hz", "Kunde;Müller", "", "Zeit;Weg;Kraft", "s;mm;N"),
             separator=";", decimal=","), "cp1252", "",
    ),
    "one name, one value": (text(TWICE, ("time_s,displacement_mm,force_N,force_N",)), "utf-8", ""),
    "a force in two units": (text(TWICE * [1, 1, 1, 0.001], ("time_s,displacement_mm,force_N,load_kN",)), "utf-8", ""),
    "further columns": (text(TWICE, ("time_s,displacement_mm,force_N,=cmd()<b>",)), "utf-8", ""),
    "a missing cell": (CLEAN.replace(CLEAN.splitlines()[300], CLEAN.splitlines()[300].rsplit(",", 1)[0] + ","),
                       "utf-8", "W_MISSING"),
    "nan": (CLEAN.replace(CLEAN.splitlines()[300], CLEAN.splitlines()[300].rsplit(",", 1)[0] + ",NaN"),
            "utf-8", "W_MISSING"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_refused_with_code_line_and_remedy(tmp_path, case):
    content, code, line = REFUSED[case]
    with pytest.raises(InputError) as caught:
        read_run(write(tmp_path, "a.csv", content))
    assert caught.value.code == code, str(caught.value)
    assert "a.csv" in str(caught.value)
    assert caught.value.remedy
    if line is not None:
        assert getattr(caught.value, "line", None) == line, str(caught.value)


@pytest.mark.parametrize("case", ACCEPTED)
def test_accepted_and_said_so(tmp_path, case):
    content, encoding, codes = ACCEPTED[case]
    record = read_run(write(tmp_path, "a.csv", content, encoding))
    assert " ".join(finding.code for finding in record.findings) == codes
    truth = channels()
    for name in ("time", "displacement", "force"):
        values = getattr(record, name)
        there = np.isfinite(values)
        assert values.size >= 599
        # Six decimals in s, mm and N.
        np.testing.assert_allclose(values[there], truth[name][: values.size][there], rtol=0, atol=1e-6)


def test_odd_bytes_in_a_column_nobody_needs_are_said(tmp_path):
    lines = text(TWICE, ("time_s,displacement_mm,force_N,remark",)).encode().split(b"\n")
    lines[50] = lines[50][:-3] + b"\xff\xfe"
    record = read_run(write(tmp_path, "a.csv", b"\n".join(lines)))
    assert [finding.code for finding in record.findings] == ["W_ENCODING"]
    assert record.time.size == 600


def test_a_damaged_temperature_costs_the_channel_only(tmp_path):
    lines = text(TWICE, ("time_s,displacement_mm,force_N,Temperature [C]",)).split("\n")
    lines[50] = lines[50].rsplit(",", 1)[0] + ",broken"
    record = read_run(write(tmp_path, "a.csv", "\n".join(lines)))
    assert record.temperature is None
    assert [finding.code for finding in record.findings] == ["W_COLUMN"]


@pytest.mark.parametrize("zone", ["", "Z", "change"])
def test_time_stamps_do_not_bend_at_the_change_to_summer_time(tmp_path, zone):
    truth = channels()
    lines = ["timestamp,displacement_mm,force_N"]
    for i, (x, force) in enumerate(zip(truth["displacement"], truth["force"], strict=True)):
        milliseconds = 5 * i + (2 * 3600 - 1) * 1000  # the clocks change one second after the start
        late = zone == "change" and milliseconds >= 2 * 3600_000
        clock = milliseconds + (3600_000 if late else 0)
        hour, rest = divmod(clock, 3600_000)
        stamp = f"2024-03-31T{hour:02d}:{rest // 60_000:02d}:{rest % 60_000 / 1000:06.3f}"
        offset = ("+02:00" if late else "+01:00") if zone == "change" else zone
        lines.append(f"{stamp}{offset},{1e3 * x:.6f},{force:.6f}")
    record = read_run(write(tmp_path, "a.csv", "\n".join(lines) + "\n"))
    # Integers inside: the seconds are exact to the last bit of their own size.
    np.testing.assert_allclose(record.time, truth["time"], rtol=0, atol=1e-12)
    assert not record.findings


def test_lines_are_known_behind_blank_lines_and_remarks(tmp_path):
    lines = CLEAN.split("\n")
    lines[300:300] = ["", "# pause", ""]
    record = read_run(write(tmp_path, "a.csv", "\n".join(lines)))
    assert record.lines is not None
    assert [record.lines[0], record.lines[298], record.lines[299], record.lines[599]] == [2, 300, 304, 604]
    assert record.lines[299:301].tolist() == [304, 305]


def test_acquisition_blocks_are_one_test_if_time_goes_on_and_several_if_not(tmp_path):
    head = ["Data Acquisition: Timed\tTime:\t13.2\tSec\t3/12/2019 10:33:22 AM", "Station Name: A",
            "Time\tAxial Displacement\tAxial Force", "Sec\tmm\tN"]  # fmt: skip
    table = ["\t".join(f"{cell:.6f}" for cell in row) for row in rows()]
    mts = "MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A"
    on = read_run(write(tmp_path, "on.dat", "\r\n".join([mts, "", *head, *table[:300], "", *head, *table[300:], ""])))
    np.testing.assert_allclose(on.time, channels()["time"], rtol=0, atol=1e-6)
    assert on.lines is not None
    assert (on.lines[299], on.lines[300]) == (306, 312)
    again = write(tmp_path, "again.dat", "\r\n".join([mts, "", *head, *table, "", *head, *table, ""]))
    records = read_runs(again)
    assert [record.id for record in records] == ["again_1", "again_2"]
    np.testing.assert_array_equal(records[0].force, records[1].force)
    with pytest.raises(InputError) as caught:
        read_run(again)
    assert caught.value.code == "E_BLOCKS"


MTS_HEAD = ["Time\tAxial Displacement\tAxial Force", "Sec\tmm\tN"]


def test_a_later_block_in_other_units_is_refused(tmp_path):
    table = ["\t".join(f"{cell:.6f}" for cell in row) for row in rows()]
    other = [MTS_HEAD[0], "Sec\tcm\tN"]
    path = write(tmp_path, "a.dat", "\n".join([*MTS_HEAD, *table[:300], "", *other, *table[300:], ""]))
    with pytest.raises(InputError, match=r"cm.*mm") as caught:
        read_run(path)
    assert (caught.value.code, caught.value.line) == ("E_AMBIGUOUS", 304)  # type: ignore[attr-defined]


def test_no_row_is_lost_where_a_repeated_header_has_no_units(tmp_path):
    table = ["\t".join(f"{cell:.6f}" for cell in row) for row in rows()]
    path = write(tmp_path, "a.dat", "\n".join([*MTS_HEAD, *table[:300], MTS_HEAD[0], *table[300:], ""]))
    assert read_run(path).time.size == 600


@pytest.mark.parametrize("write_date", ["%d.%m.%Y", "%Y/%m/%d"])
def test_dates_that_mean_one_thing_are_read(tmp_path, write_date):
    start = datetime(2024, 3, 31, 23, 59, 59)
    stamps = [start + timedelta(milliseconds=5 * i) for i in range(600)]
    lines = [f"{s.strftime(write_date)} {s.strftime('%H:%M:%S.%f')},{x},{f}"
             for s, (_, x, f) in zip(stamps, rows(), strict=True)]  # fmt: skip
    record = read_run(write(tmp_path, "a.csv", "\n".join(["time,displacement_mm,force_N", *lines, ""])))
    assert not record.findings
    # Microseconds are written, integers of nanoseconds inside.
    np.testing.assert_allclose(record.time, channels()["time"], rtol=0, atol=1e-9)


def test_an_optional_channel_in_a_wrong_unit_is_left_out_and_said(tmp_path):
    path = write(tmp_path, "a_0.5A.csv", text(TWICE, ("time_s,displacement_mm,force_N,velocity [mm]",)))
    record = read_run(path)
    assert record.velocity is None
    assert [finding.code for finding in record.findings] == ["W_COLUMN"]
    assert "no unit of velocity" in record.findings[0].text


@pytest.mark.parametrize(("name", "codes"), [("a.csv", ["W_COLUMN"]), ("a_0.5A.csv", [])])
def test_a_current_without_unit_is_said_where_nothing_else_states_the_current(tmp_path, name, codes):
    record = read_run(write(tmp_path, name, text(TWICE, ("time_s,displacement_mm,force_N,current",))))
    assert [finding.code for finding in record.findings] == codes
    assert (record.current is None) == bool(codes)


@pytest.mark.parametrize(("say", "codes"), [("join", ["E_TIME_ORDER"]), ("split", ["read", "read"])])
def test_the_profile_says_what_blocks_are(tmp_path, say, codes):
    head = "Time;Position;Load\ns;mm;N"
    table = [";".join(f"{cell:.6f}" for cell in row) for row in rows()]
    path = write(tmp_path, "a.csv", "\n".join([head, *table, head, *table, ""]))
    try:
        found = ["read" for _ in read_runs(path, parse_profile(f'[file]\nblocks = "{say}"\n'))]
    except InputError as error:
        found = [error.code]
    assert found == codes


def test_a_long_record_is_judged_in_parts_as_it_is_in_one(monkeypatch, tmp_path):
    from mrdamper.rig_files import quality

    lines = text(rows(4000)).split("\n")
    lines[1500] = lines[1500].rsplit(",", 1)[0] + ","
    path = write(tmp_path, "a.csv", "\n".join([*lines[:2500], *lines[2700:]]))
    whole = read_run(path)
    monkeypatch.setattr(quality, "PART", 1000)
    parts = read_run(path)
    assert {f.code for f in whole.findings} == {"W_MISSING", "W_TIME_GAP"} <= {f.code for f in parts.findings}
    assert parts.segments == whole.segments == ((0, 2499), (2499, 3800))
    write(tmp_path, "b.csv", "\n".join([*lines[:3000], lines[2998], *lines[3000:]]))
    with pytest.raises(InputError, match=r"line 3001.*E_TIME_DUPLICATE|line 3001.*E_TIME_ORDER"):
        read_run(tmp_path / "b.csv")


WRITINGS = st.fixed_dictionaries(
    {
        "separator_decimal": st.sampled_from([(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ",")]),
        "encoding": st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-be", "cp1252"]),
        "end": st.sampled_from(["\n", "\r\n"]),
        "time": st.sampled_from([("Zeit", "s", 1), ("Time", "ms", 1e3), ("t", "s", 1), ("Temps", "µs", 1e6)]),
        "displacement": st.sampled_from([("Weg", "mm", 1e3), ("x", "m", 1), ("Déplacement", "cm", 1e2),
                                         ("Axial Displacement", "in", 1 / 0.0254)]),
        "force": st.sampled_from([("Kraft", "kN", 1e-3), ("Axial Load", "N", 1), ("F", "lbf", 1 / 4.4482216152605),
                                  ("Fuerza", "daN", 0.1)]),
        "header": st.sampled_from(["{} [{}]", "{} ({})", "{}_{}", "{} in {}", "row"]),
        "order": st.permutations(["time", "displacement", "force", "other"]),
        "preamble": st.lists(st.sampled_from(["# remark", "Rig 7", "", "Operator: Å. Ström"]), max_size=4),
        "digits": st.integers(6, 13),
        "packed": st.booleans(),
    }
)  # fmt: skip


@settings(max_examples=60, deadline=None)
@given(writing=WRITINGS)
def test_any_writing_reads_back_equal(tmp_path_factory, writing):
    truth = channels(400)
    separator, decimal = writing["separator_decimal"]
    table, names, units = [], [], []
    for role in writing["order"]:
        name, unit, factor = ("Zähler", "", 1) if role == "other" else writing[role]
        table.append(factor * truth["velocity" if role == "other" else role])
        names.append(name if writing["header"] == "row" or not unit else writing["header"].format(name, unit))
        units.append(unit)
    head = [separator.join(names)] + ([separator.join(units)] if writing["header"] == "row" else [])
    body = [
        separator.join(f"{v:.{writing['digits']}e}".replace(".", decimal) for v in row)
        for row in zip(*table, strict=True)
    ]
    content = writing["end"].join([*writing["preamble"], *head, *body, ""]).encode(writing["encoding"])
    folder = tmp_path_factory.mktemp("w")
    packed = writing["packed"]
    record = read_run(write(folder, "a.csv.gz" if packed else "a.csv", gzip.compress(content) if packed else content))
    assert not record.findings
    for role in ("time", "displacement", "force"):
        # Half a unit of the last digit written, and the rounding of two products.
        rounding = 0.5 * 10.0 ** -writing["digits"] + 1e-15
        np.testing.assert_allclose(getattr(record, role), truth[role], rtol=rounding, atol=1e-300)


@pytest.mark.parametrize("decimal", [".", ","])
def test_the_fast_reader_agrees_with_the_strict_one_to_the_bit(tmp_path, decimal, monkeypatch):
    import mrdamper.rig_files.readers.delimited as delimited

    lines = text(header=(";".join(NAMES),), separator=";", decimal=decimal).split("\n")
    lines[100] = lines[100].rsplit(";", 1)[0] + ";"
    lines[200] = " " + lines[200].replace(";", " ; ")
    path = write(tmp_path, "a.csv", "\r\n".join(lines))
    slow = read_run(path)
    calls = []

    def fast(*args):
        calls.append(read_bulk(*args))
        return calls[-1]

    monkeypatch.setattr(delimited, "BULK_FROM", 0)
    monkeypatch.setattr(delimited, "read_bulk", fast)
    quick = read_run(path)
    assert calls
    assert calls[0] is not None
    for name in ("time", "displacement", "force"):
        np.testing.assert_array_equal(getattr(quick, name), getattr(slow, name))
    np.testing.assert_array_equal(quick.lines, slow.lines)


@pytest.mark.parametrize(
    "cell", ["1_000.5", "١", "0x1F", "1.5.2", "1e", "--1", "1-2", "+-1", "1,5", "1 5", "1f", "1d5", "true", ".", "e5"]
)
def test_the_fast_reader_takes_no_cell_the_strict_one_refuses(tmp_path, cell, monkeypatch):
    monkeypatch.setattr("mrdamper.rig_files.readers.delimited.BULK_FROM", 0)
    content = lines_of({100: f"0.49;{cell};3.0"}, header=(";".join(NAMES),), separator=";")
    with pytest.raises(InputError) as caught:
        read_run(write(tmp_path, "a.csv", content))
    assert caught.value.code == "E_NUMBER"
    assert caught.value.line == 100  # type: ignore[attr-defined]


def test_columns_too_large_for_memory_lie_in_files_and_hold_the_same(tmp_path, monkeypatch):
    path = write(tmp_path, "a.csv", CLEAN)
    small = read_run(path)
    monkeypatch.setattr("mrdamper.rig_files.text.cells.LARGE", 0)
    monkeypatch.setattr("mrdamper.rig_files.text.stream.CHUNK", 1000)
    large = read_run(path)
    assert isinstance(large.force, np.memmap)
    for name in ("time", "displacement", "force"):
        np.testing.assert_array_equal(getattr(large, name), getattr(small, name))
    np.testing.assert_array_equal(large.lines, small.lines)


@pytest.mark.parametrize(
    ("cell", "seconds"),
    [("03/01/2024 09:59:58:005", 35998.005), ("59:58.005", 3598.005), ("12:30", None), ("2024-03-01 59:58.0", None)],
)
def test_a_clock_is_read_with_its_date_left_out_where_that_may_mean_two_days(cell, seconds):
    read = stamp(cell)
    assert (read and read[0] / 1e9) == seconds


def test_every_bad_cell_and_row_is_told_at_once(tmp_path):
    lines = lines_of({5: "0.01,1x,3", 9: "0.02,1,2,3,4", 40: "0.2,1,abc"}).split("\n")
    path = write(tmp_path, "a_0.5A.csv", "\n".join(lines))
    with pytest.raises(CombinedError) as caught:
        read_run(path)
    assert [error.line for error in caught.value.errors] == [5, 9, 40]
    assert [error.code for error in caught.value.errors] == ["E_NUMBER", "E_FIELD_COUNT", "E_NUMBER"]
    path.write_text("\n".join(lines[:1] + [line.replace(".", "?") for line in lines[1:]]))
    with pytest.raises(InputError):
        read_run(path)


def test_many_bad_cells_are_counted(tmp_path):
    lines = [line if i % 20 else f"{line}?" for i, line in enumerate(lines_of().split("\n"), 1)]
    with pytest.raises(CombinedError, match="20 more like these") as caught:
        read_run(write(tmp_path, "a.csv", "\n".join(lines)))
    assert len(caught.value.errors) == 11


def test_a_date_of_two_readings_that_changes_at_midnight_is_the_next_day(tmp_path):
    days = ("03/04/2024 23:59:5{:.3f}", "04/04/2024 00:00:0{:.3f}")
    stamps = [days[i >= 400].format(i % 400 / 200 + 8 * (i < 400)) for i in range(600)]
    lines = [f"{stamp},{x},{force}" for stamp, (_, x, force) in zip(stamps, rows(), strict=True)]
    record = read_run(write(tmp_path, "a.csv", "\n".join(["time,displacement_mm,force_N", *lines, ""])))
    np.testing.assert_allclose(np.diff(record.time), 0.005, rtol=1e-6)
