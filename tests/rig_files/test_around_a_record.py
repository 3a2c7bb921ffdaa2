"""What stands around a record: archives of folders, files of other kinds, footers, free text, folders, rates."""

import io
import tarfile
import zipfile

import numpy as np
import pytest
from support import rig_files as rig

from mrdamper.errors import InputError
from mrdamper.rig_files.conditions import stated_by_lines, stated_in_titles, stated_quantities, stated_rate
from mrdamper.rig_files.rig_import import import_files, read_run

HEAD = "time_s,displacement_mm,force_N,current_A"


def rows(current=0.4, size=240):
    table = rig.rows(size)[:, :3]
    return "\n".join(",".join(f"{v:.5f}" for v in [*row, current]) for row in table)


def text(current=0.4):
    return f"{HEAD}\n{rows(current)}\n"


def zipped(path, members):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members:
            archive.writestr(name, content)
    return path


def tarred(path, *members):
    with tarfile.open(path, "w") as archive:
        for member, content in members:
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    return path


def member(name, kind=tarfile.REGTYPE, link=""):
    found = tarfile.TarInfo(name)
    found.type, found.linkname = kind, link
    return found


def test_a_refused_file_of_an_archive_does_not_cost_the_others(tmp_path):
    path = zipped(tmp_path / "a.zip", [("a/one.csv", text()), ("a/two.csv", text(0.8)), ("a/bad.csv", "1,2\n")])
    found = import_files([path])
    assert sorted(record.id for record in found.records) == ["one", "two"]
    assert len(found.refusals) == 1
    assert not list(tmp_path.glob("*/*"))


def test_a_table_of_tests_in_an_archive_is_used(tmp_path):
    bare = text().replace(",current_A", "").replace(",0.40000\n", "\n")
    path = zipped(
        tmp_path / "a.zip", [("a/1.csv", bare), ("a/2.csv", bare), ("a/tests.csv", "file,current_A\n1,0.3\n2,1.2\n")]
    )
    assert [float(record.current[0]) for record in import_files([path]).records] == [0.3, 1.2]


HOSTILE = {
    "leads out": ("E_ARCHIVE_PATH", lambda p: zipped(p / "a.zip", [("a.csv", text()), ("../b.csv", text())])),
    "absolute": ("E_ARCHIVE_PATH", lambda p: tarred(p / "a.tar", (member("/etc/a.csv"), b"1"))),
    "a link": ("E_ARCHIVE", lambda p: tarred(p / "a.tar", (member("a.csv", tarfile.SYMTYPE, "/etc/passwd"), b""))),
    "a device": ("E_ARCHIVE", lambda p: tarred(p / "a.tar", (member("a.csv", tarfile.FIFOTYPE), b""))),
    "twice": ("E_ARCHIVE", lambda p: tarred(p / "a.tar", (member("a.csv"), b"1"), (member("a.csv"), b"2"))),
    "nested": ("E_ARCHIVE", lambda p: tarred(p / "a.tar", (member("a.zip"), b"PK"), (member("b.csv"), b"2"))),
    "a bomb": ("E_ARCHIVE_RATIO", lambda p: zipped(p / "a.zip", [("a.csv", bytes(10**7)), ("b.csv", bytes(10**7))])),
    "no tar": ("E_ARCHIVE", lambda p: (p / "a.tar").write_bytes(b"no archive at all" * 100) and p / "a.tar"),
}  # fmt: skip


@pytest.mark.parametrize("case", HOSTILE)
def test_an_archive_is_read_within_bounds(tmp_path, case):
    code, make = HOSTILE[case]
    with pytest.raises(InputError) as caught:
        import_files([make(tmp_path)])
    assert caught.value.code == code, str(caught.value)


def test_files_of_other_kinds_and_notes_are_named_and_left_out(tmp_path):
    (tmp_path / "run.csv").write_text(text())
    (tmp_path / "README.txt").write_text("Damper 7, tested in March.\nThe pump was off.\n")
    (tmp_path / "photo.jpg").write_bytes(b"\xff\xd8\xff")
    found = import_files([tmp_path])
    assert (len(found.records), len(found.refusals)) == (1, 0)
    assert sorted(found.left_out) == ["README.txt", "photo.jpg"]
    assert found.reasons == {"README.txt": "read for what it states of the columns"}


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("codebook.csv", "variable;what;unit\nv01;time;s\nv02;stroke;mm\n"),
        ("specimen.csv", 'specimen,label,oil\n4,"A, long","X9"\n5,"B","X9"\n'),
        ("wiring.txt", "scope 7, channels as below\nC1 = clip gauge, blue\nC2 = load pin, red\n"),
        ("logbook.csv", "Time,Test,Current / A,Remark\n14:05,sine,0.4,\n14:09,sine,0.8,\n14:13,sine,0.8,\n"),
    ],
)
def test_helper_tables_beside_tests_do_not_block_them_and_their_reason_is_told(tmp_path, name, content):
    for number in (1, 2):
        (tmp_path / f"run{number}.csv").write_text(text(0.4 * number))
    (tmp_path / name).write_text(content)
    found = import_files([tmp_path])
    assert (len(found.records), [str(r.error) for r in found.refusals]) == (2, [])
    assert found.left_out == (name,)
    assert found.reasons[name]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("run3.csv", "one;two;three\nfour;five;six\n"),
        ("last.csv", f"{HEAD}\n"),
        ("last.csv", "Zeit;Weg;Kraft\ns;mm;N\n"),
        ("last.csv", "1,2\n"),
    ],
    ids=["called as a test", "its columns", "columns of channels", "numbers only"],
)
def test_a_damaged_test_beside_others_is_refused(tmp_path, name, content):
    for number in (1, 2):
        (tmp_path / f"run{number}.csv").write_text(text(0.4 * number))
    (tmp_path / name).write_text(content)
    refusals = import_files([tmp_path]).refusals
    assert [r.file.rpartition("/")[2] for r in refusals][:1] == [name]
    assert "set [file] leave_out" in refusals[0].error.remedy or content == "1,2\n"


def test_a_table_of_results_of_as_many_columns_stands_above_the_record(tmp_path):
    (tmp_path / "a.csv").write_text(text())
    (tmp_path / "b.csv").write_text("Specimen,Max force,Energy,Mean\n1,850,12,0\n2,900,13,0\n\n" + text())
    record, below = (read_run(tmp_path / name) for name in ("a.csv", "b.csv"))
    assert record.channels.keys() == below.channels.keys()
    np.testing.assert_array_equal(list(record.channels.values()), list(below.channels.values()))


def test_a_text_without_a_table_is_refused_if_it_is_all_there_is(tmp_path):
    (tmp_path / "README.txt").write_text("Damper 7, tested in March.\n")
    assert [refusal.error.code for refusal in import_files([tmp_path]).refusals] == ["E_NO_DATA"]


@pytest.mark.parametrize("foot", ["Maximum,20,1000,0.4", "\n\nEnd of test", "Mean;1;2\nStd,1,2,3"])
def test_words_below_the_rows_are_left_out_and_said(tmp_path, foot):
    (tmp_path / "a.csv").write_text(f"{text()}{foot}\n")
    record = read_run(tmp_path / "a.csv")
    assert record.time.size == 240
    assert "W_FOOTER" in {finding.code for finding in record.findings}


@pytest.mark.parametrize("row", ["1x2,1,2,0.4", "-,1,2,0.4,7", "0.5O,1,2,0.4", "x,1,2,0.4"])
def test_a_damaged_last_row_is_no_footer(tmp_path, row):
    (tmp_path / "a.csv").write_text(f"{text()}{row}\n")
    with pytest.raises(InputError):
        read_run(tmp_path / "a.csv")


RATINGS = [
    "Amplifier range 2 A", "max current 2 A", "Rated 1.5 A", "5 A supply, 0.4 A probe", "Messbereich Strom: 10 A",
    "coil driver: 100 % duty = 2 A", "shunt 60 mV = 10 A", "driver gain 1 A per V", "Current resolution: 0.01 A",
    "coil current tolerance 0.05 A", "PSU 30 V 5 A", "offset 0.02 A", "standby current 0.2 A", "I_ref = 2 A (100 %)",
    "current levels: 0, 0.5, 1.0 A", "Ströme 0; 0.5; 1 A", "driven at 0 and 1.5 A", "Strom von 0 bis 2 A",
    "pwm 255 = 1.5 A", "PWM 20 = 0 A", "U = 5 V -> 2 A", "2 A corresponds to 10 V", "20 mA = 5 kN", "load cell 4-20 mA",
    "coil 300 turns, 1 A nominal", "Damper type MR-2A", "Operating voltage 12 V (1 A)", "0 A at 0.4 V",
    "coil monitor = (U - 2.5) / 0.625 A", "Relay 5 A", "Coil heated with 1 A for 10 min",
    "Motor current: 3 A", "Pump motor: 12 A", "Preconditioning: 1 A, 20 cycles", "Inrush current: 2.3 A",
    "Current increment: 0.25 A", "Residual current: 0.0 A",
]  # fmt: skip


@pytest.mark.parametrize("line", RATINGS)
def test_a_rating_a_scale_or_a_list_states_no_current(line):
    assert stated_in_titles([line]) == stated_by_lines([line]) == []


@pytest.mark.parametrize(
    "line", ["Test 3, 0.4 A", "2023/05/11, 0.4 A, 2 Hz", "Run 12 - 0.4 A", "10 mm, 1 Hz, 0.4 A", "Test 3 = 0.4 A"]
)
def test_a_number_before_a_current_makes_no_list(line):
    device = "Recorder DCS-100A, SN 12"
    assert [statement.amperes for statement in stated_in_titles([line, device])] == [0.4]


def test_a_tolerance_is_no_current():
    assert [s.amperes for s in stated_by_lines(["Coil current: 1.0 +/- 0.02 A"])] == [1.0]
    assert [s.amperes for s in stated_by_lines(["جریان سیم\u200cپیچ: ۰٫۵ آمپر"])] == [0.5]


def test_free_text_that_says_two_currents_says_none(tmp_path):
    bare = text().replace(",current_A", "").replace(",0.40000\n", "\n")
    (tmp_path / "a.csv").write_text(f"Test 3 at 0.4 A\ncompare 0.8 A\n{bare}")
    assert [r.error.code for r in import_files([tmp_path]).refusals] == ["E_CURRENT_MISSING"]


def test_two_sampling_rates_are_refused(tmp_path):
    bare = "\n".join(line.split(",", 1)[1] for line in text().splitlines())
    (tmp_path / "a.csv").write_text(f"Sample rate: 100 Hz\nSampling interval: 2 ms\n{bare}\n")
    with pytest.raises(InputError) as caught:
        read_run(tmp_path / "a.csv")
    assert caught.value.code == "E_AMBIGUOUS"
    assert stated_rate(stated_quantities(["Abtastrate: 2 kHz"])) == 2000
    assert stated_rate(stated_quantities(["Excitation: 2 Hz"], {"dt_ms": 4.0})) == 250
    assert stated_rate(stated_quantities(["Frequency = 2 Hz"])) is None


def test_a_count_of_samples_with_a_hole_leaves_a_gap(tmp_path):
    table = rig.rows(300)[:, 1:3]
    counted = [f"{i + 20 * (i > 150)},{x:.5f},{f:.3f}" for i, (x, f) in enumerate(table)]
    (tmp_path / "0.4A.csv").write_text(
        "\n".join(["Sample rate: 100 Hz", "Sample,Position (mm),Force (N)", *counted, ""])
    )
    record = read_run(tmp_path / "0.4A.csv")
    np.testing.assert_allclose(np.diff(record.time).max(), 0.21)
    assert "W_TIME_GAP" in {finding.code for finding in record.findings}


def test_a_slow_current_that_changes_is_not_taken_for_its_mean(tmp_path):
    table = rig.rows(240)[:, :3]
    said = [
        f"{a:.5f},{b:.5f},{c:.3f}," + (f"{i / 240:.3f}" if i % 10 == 0 else "") for i, (a, b, c) in enumerate(table)
    ]
    (tmp_path / "a.csv").write_text("\n".join([HEAD, *said, ""]))
    with pytest.raises(InputError) as caught:
        read_run(tmp_path / "a.csv")
    assert caught.value.code == "E_MISSING"


@pytest.mark.parametrize(
    "name",
    [
        "Force_sim (N)",
        "Force LP 10Hz (N)",
        "Force x10 (N)",
        "Lateral force (N)",
        "Force uncertainty (N)",
        "Force p-p (N)",
    ],
)
def test_a_column_that_is_not_the_dampers_force_is_not_taken_for_it(tmp_path, name):
    (tmp_path / "a.csv").write_text(text().replace("force_N", name))
    with pytest.raises(InputError) as caught:
        read_run(tmp_path / "a.csv")
    assert caught.value.code in ("E_COLUMN", "E_UNITS_MISSING")


def test_the_coils_current_is_taken_before_the_supplys_and_never_a_motors(tmp_path):
    lines = [f"{line},2.5" for line in text().splitlines()]
    both = "\n".join([HEAD.replace("current_A", "coil current [A],supply current [A]"), *lines[1:], ""])
    (tmp_path / "a.csv").write_text(both)
    assert float(np.mean(read_run(tmp_path / "a.csv").current)) == pytest.approx(0.4)
    (tmp_path / "b.csv").write_text(text().replace("current_A", "motor current [A]"))
    assert read_run(tmp_path / "b.csv").current is None
    phases = "\n".join(["# Coil current: 0.7 A", HEAD.replace("current_A", "I_U [A],I_V [A]"), *lines[1:], ""])
    (tmp_path / "c.csv").write_text(phases)
    assert float(np.mean(read_run(tmp_path / "c.csv").current)) == pytest.approx(0.7)


@pytest.mark.parametrize(
    ("name", "amperes"), [("run_04A", []), ("run_0400mA", [0.4]), ("run_0A", [0.0]), ("0p4A", [0.4])]
)
def test_a_padded_number_of_amperes_states_none(name, amperes):
    from mrdamper.rig_files.conditions import currents_in

    assert list(currents_in(name)) == amperes


def test_an_absolute_force_is_refused(tmp_path):
    table = rig.rows(600)[:, :3]
    table[:, 2] = np.abs(table[:, 2] + 0.15 * np.max(table[:, 2]))
    said = "\n".join(",".join(f"{v:.5f}" for v in [*row, 0.4]) for row in table)
    (tmp_path / "a.csv").write_text(f"{HEAD}\n{said}\n")
    refused = import_files([tmp_path]).refusals
    assert {refusal.error.code for refusal in refused} <= {"E_RECTIFIED", "E_NO_ENERGY"}
    assert refused


def test_a_typographic_minus_throughout_is_a_minus(tmp_path):
    (tmp_path / "a.csv").write_text(text().replace("-", "−"), encoding="utf-8")
    (tmp_path / "b.csv").write_text(text(), encoding="utf-8")
    np.testing.assert_array_equal(read_run(tmp_path / "a.csv").force, read_run(tmp_path / "b.csv").force)
