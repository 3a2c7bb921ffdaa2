"""The rig profile: checked, written and read back, and what it changes in a record."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.rig_files import NAMES, channels, rows, text, write
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.errors import InputError
from mrdamper.rig_files.preview import guess_profile
from mrdamper.rig_files.profile import (
    Channel,
    CurrentSource,
    FileForm,
    Profile,
    ProfileError,
    current_in_name,
    load_profile,
    parse_profile,
    profile_hash,
    profile_text,
)
from mrdamper.rig_files.profile_template import profile_template
from mrdamper.rig_files.rig_import import import_files, read_run

NAME = st.text(min_size=1, max_size=20)
FINITE = st.floats(allow_nan=False, allow_infinity=False)
PROFILES = st.builds(
    Profile,
    rig=st.text(max_size=20),
    excitation=NAME,
    split=st.sampled_from(["train", "validate"]),
    file=st.builds(
        FileForm,
        separator=st.sampled_from([";", "\t", None]),
        decimal=st.sampled_from([",", "."]),
        header_line=st.none() | st.integers(0, 99),
        names=st.lists(st.text(max_size=5), max_size=4).map(tuple),
        sample_rate_Hz=st.none() | st.floats(0.1, 1e5),
    ),
    channels=st.dictionaries(
        st.sampled_from(["force"]),
        st.builds(
            Channel,
            column=st.none() | NAME | st.integers(1, 99),
            unit=st.just("kN"),
            sign=st.sampled_from([1, -1]),
            scale=st.floats(1e-9, 1e9),
            offset=FINITE,
            delay_ms=st.floats(-1e3, 1e3),
        ),
    ),
    current=st.none()
    | st.builds(CurrentSource, value=st.floats(-10, 10))
    | st.builds(CurrentSource, values=st.dictionaries(NAME, st.floats(-10, 10), min_size=1, max_size=3)),
)

WRONG = {
    "no TOML": ("rig = ", "profile"),
    "unknown key": ("rigg = 1", "unknown key rigg"),
    "unknown channel": ('[channels.forze]\nunit = "N"', "no channel is called 'forze'"),
    "unit of another thing": ('[channels.force]\nunit = "mm"', "'mm' is no unit of force (force); known are N, "),
    "no unit": ('[channels.force]\nunit = "blub"', "'blub' is no unit of force"),
    "sign of two": ("[channels.force]\nsign = 2", "channels.force.sign"),
    "scale of zero": ('[channels.force]\nunit = "N"\nscale = 0', "scale of zero"),
    "scale without unit": ("[channels.force]\nscale = 2.0", "scale needs the unit"),
    "offset without scale": ('[channels.force]\nunit = "N"\noffset = 2.0', "offset belongs to a calibration"),
    "current twice": ('[current]\nvalue = 1.0\npattern = "*{current}A"', "either value or pattern or values"),
    "no current": ("[current]", "either value or pattern or values"),
    "pattern without place": ('[current]\npattern = "*A"', "{current} once"),
    "infinite": ("[current]\nvalue = inf", "current.value"),
    "comma twice": ('[file]\nseparator = ","\ndecimal = ","', "both a comma"),
    "text for number": ('[current]\nvalue = "1"', "current.value"),
}


@settings(max_examples=50, suppress_health_check=[HealthCheck.too_slow])
@given(profile=PROFILES)
def test_a_written_profile_reads_back_equal(profile):
    assert parse_profile(profile_text(profile)) == profile
    assert profile_hash(parse_profile(profile_text(profile))) == profile_hash(profile)


@pytest.mark.parametrize("case", WRONG)
def test_wrong_profiles_are_refused_with_the_key(case):
    content, found = WRONG[case]
    with pytest.raises(ProfileError) as caught:
        parse_profile(content)
    assert found in str(caught.value)
    assert caught.value.code == "E_PROFILE"


def test_profiles_that_are_no_files_of_text(tmp_path):
    for name, content in (("a.toml", b"\xff\xfe\xfa"), ("b.toml", b"#" * 100_000)):
        with pytest.raises(ProfileError):
            load_profile(write(tmp_path, name, content))
    with pytest.raises(ProfileError, match="TOML"):
        load_profile(tmp_path / "nowhere.toml")


@pytest.mark.parametrize(
    ("name", "current"),
    [
        ("A5_-0.3A-_1.csv", 0.3),
        ("utf_10mm2Hz_0x25A.txt", 0.25),
        ("run_1.5A.csv", 1.5),
        ("run 500mA.csv", 0.5),
        ("damper_2A_sine.csv", 2.0),
        ("0A.csv", 0.0),
        ("test_01_2A.csv", 2.0),
        ("x_0,75A.csv", 0.75),
        ("1A_after_1A.csv", 1.0),
        ("1A_to_2A.csv", None),
        ("run_0_5A.csv", None),
        ("run_0_5_A_2Hz.csv", None),
        ("rec_1_500_mA.csv", 0.5),
        ("run3A.csv", None),
        ("A1.csv", None),
        ("2AB.csv", None),
        ("v1.2.3A.csv", None),
        ("plain.csv", None),
    ],
)
def test_current_in_a_file_name_only_where_it_is_plain(name, current):
    assert current_in_name(name, Profile()) == current


@pytest.mark.parametrize(
    ("pattern", "unit", "name", "current"),
    [
        ("*_I{current}_*", "A", "b_I0.5_x.csv", 0.5),
        ("*_{current}A", "A", "run_0_5A.csv", 5.0),
        ("run_0_{current}A*", "mA", "run_0_5A.csv", 0.005),
        ("{current}", "mA", "250.csv", 0.25),
        ("*_I{current}", "A", "b_1A.csv", None),
    ],
)
def test_current_by_pattern(pattern, unit, name, current):
    assert current_in_name(name, Profile(current=CurrentSource(pattern=pattern, unit=unit))) == current


def test_a_profile_says_what_a_file_without_header_does_not(tmp_path):
    table = np.column_stack([rows()[:, 0], 0.1 * rows()[:, 1], -1e-3 * rows()[:, 2], np.zeros(600)])
    path = write(tmp_path, "a.dat", text(table, (), "\t"))
    profile = parse_profile(
        '[file]\nnames = ["Time", "Stroke", "Load", "Count"]\n[channels.time]\nunit = "s"\n'
        '[channels.displacement]\nunit = "cm"\n[channels.force]\nunit = "kN"\nsign = -1\n[current]\nvalue = 0.4\n'
    )
    record = read_run(path, profile)
    truth = channels()
    # Six decimals of cm and of kN.
    np.testing.assert_allclose(record.displacement, truth["displacement"], rtol=0, atol=1e-8)
    np.testing.assert_allclose(record.force, truth["force"], rtol=0, atol=1e-3)
    assert record.current is not None
    assert set(record.current) == {0.4}
    assert record.provenance["current_from"] == "profile"
    assert record.provenance["profile_sha256"] == profile_hash(profile)


def test_a_unit_of_the_profile_wins_over_an_unknown_one_but_not_over_another_dimension(tmp_path):
    path = write(tmp_path, "a.csv", text(header=("t;x;F", "s;mm;blub"), separator=";"))
    profile = parse_profile('[channels.force]\nunit = "N"\n')
    np.testing.assert_allclose(read_run(path, profile).force, channels()["force"], rtol=0, atol=1e-6)
    for unit in ("V", "mV/V", "um/m", "mm", "bar"):
        path = write(tmp_path, "b.csv", text(header=("t;x;F", f"s;mm;{unit}"), separator=";"))
        with pytest.raises(InputError, match=r"scale.*E_UNITS_DIMENSION"):
            read_run(path, profile)
        scaled = read_run(path, parse_profile('[channels.force]\nunit = "N"\nscale = 2.0\n'))
        np.testing.assert_allclose(scaled.force, 2 * channels()["force"], rtol=0, atol=1e-5)


def test_columns_by_number_and_by_name(tmp_path):
    table = np.column_stack([rows(), rows()[:, 2] + 1])
    path = write(tmp_path, "a.csv", text(table, (",".join([*NAMES, "force_N"]),)))
    np.testing.assert_array_equal(
        read_run(path, parse_profile("[channels.force]\ncolumn = 4\n")).force, rows_of(path, 3)
    )
    for wrong in ("column = 9", 'column = "Kraft"'):
        with pytest.raises(InputError, match="E_COLUMN"):
            read_run(path, parse_profile(f"[channels.force]\n{wrong}\n"))


def rows_of(path, column):
    return np.array([float(line.split(",")[column]) for line in path.read_text().splitlines()[1:]])


@pytest.mark.parametrize("delay_ms", [5.0, 20.0, -20.0])
def test_a_known_delay_is_taken_off(tmp_path, delay_ms):
    truth = channels(600)
    late = np.interp(truth["time"] - 1e-3 * delay_ms, truth["time"], truth["displacement"])
    table = np.column_stack([truth["time"], 1e3 * late, truth["force"]])
    record = read_run(
        write(tmp_path, "a.csv", text(table)), parse_profile(f"[channels.displacement]\ndelay_ms = {delay_ms}\n")
    )
    expected = np.interp(record.time, truth["time"], truth["displacement"])
    # Six decimals of a millimetre; the delays are whole samples, so nothing is interpolated.
    np.testing.assert_allclose(record.displacement, expected, rtol=0, atol=1e-8)
    assert record.time.size == 600 - abs(round(delay_ms / 5))
    assert record.lines is not None
    assert len(record.lines) == record.time.size


@pytest.mark.parametrize("heads", [("t,disp [mm],F\ns,,N",), ("t,disp_mm,F\ns,,N",), ("t,disp,F\ns,mm,N",)])
def test_a_name_with_its_unit_is_that_column_however_the_file_writes_the_unit(tmp_path, heads):
    path = write(tmp_path, "a.csv", text(rows(), heads))
    plain = read_run(path)
    for name in ("disp [mm]", "disp (mm)", "Disp_mm"):
        record = read_run(path, parse_profile(f'[channels.displacement]\ncolumn = "{name}"\n'))
        np.testing.assert_array_equal(record.displacement, plain.displacement)
    with pytest.raises(InputError, match=r"no column 'disp \[m\]'"):  # another unit is another column
        read_run(path, parse_profile('[channels.displacement]\ncolumn = "disp [m]"\n'))


def test_a_rate_stands_in_for_time_stamps(tmp_path):
    path = write(tmp_path, "a.csv", text(rows()[:, 1:], ("displacement_mm,force_N",)))
    record = read_run(path, parse_profile("[file]\nsample_rate_Hz = 200\n"))
    np.testing.assert_allclose(record.time, channels()["time"], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "header", "separator", "decimal", "encoding"),
    [
        ("a_0.5A.csv", ",".join(NAMES), ",", ".", "utf-8"),
        ("a_500mA_x.csv", "Zeit [s];Weg [mm];Kraft [N]", ";", ",", "cp1252"),
        ("a.txt", "t\tx\tF\ns\tmm\tN", "\t", ",", "utf-16"),
    ],
)
def test_a_guessed_profile_reads_the_same_record(tmp_path, name, header, separator, decimal, encoding):
    path = write(tmp_path, name, text(rows(), tuple(header.split("\n")), separator, decimal), encoding)
    guess = guess_profile(path)
    saved = write(tmp_path, "rig.toml", profile_text(guess))
    assert profile_text(load_profile(saved)) == saved.read_text()
    plain, again = read_run(path), read_run(path, saved)
    for channel in ("time", "displacement", "force"):
        np.testing.assert_array_equal(getattr(plain, channel), getattr(again, channel))
    assert (plain.current is None) == (again.current is None)
    if plain.current is not None:
        np.testing.assert_array_equal(plain.current, again.current)
    assert guess_profile(path, saved) == guess


def test_all_units_that_lack_are_asked_for_at_once_and_those_of_a_column_that_is_asked_for(tmp_path):
    table = np.column_stack([rows(), np.full(600, 0.5)])
    path = write(tmp_path, "a.csv", text(table, ("time [s],disp,force,current",)))
    with pytest.raises(InputError) as caught:
        read_run(path)
    remedies = [error.remedy for error in caught.value.errors]
    channels_asked = [remedy.partition("[channels.")[2].partition("]")[0] for remedy in remedies]
    assert channels_asked == ["displacement", "force", "current"]
    path = write(tmp_path, "a.csv", text(table, ("clk,disp [mm],force [N],current [A]",)))
    with pytest.raises(InputError, match=r'set \[channels.time\] column = "..." and unit = "..."'):
        read_run(path)
    record = read_run(path, parse_profile('[channels.time]\ncolumn = "clk"\nunit = "s"'))
    np.testing.assert_allclose(record.time, rows()[:, 0])


def test_the_profile_that_is_written_leaves_a_unit_open_of_which_two_are_stated(tmp_path):
    path = write(tmp_path, "a_0.5A.csv", text(rows(), ("time [s],disp [mm],Force [kN]", "s,mm,N")))
    with pytest.raises(InputError, match="E_AMBIGUOUS"):
        read_run(path)
    guess = profile_text(guess_profile(path))
    with pytest.raises(InputError, match="E_AMBIGUOUS"):
        read_run(path, parse_profile(guess))
    record = read_run(path, parse_profile(guess.replace("[channels.force]", '[channels.force]\nunit = "N"')))
    np.testing.assert_allclose(record.force, rows()[:, 2], atol=1e-5)


def test_what_a_profile_states_against_a_heading_or_a_time_column_is_said_or_refused(tmp_path):
    path = write(tmp_path, "a_0.5A.csv", text(rows(), ("time [s],disp [mm],force [N]",)))
    record = read_run(path, parse_profile('[channels.force]\nunit = "N"\nscale = 2.0'))
    assert any("'force [N]' has the unit N, and is multiplied by 2" in finding.text for finding in record.findings)
    rate = 1 / (rows()[1, 0] - rows()[0, 0])
    profile = '[file]\nsample_rate_Hz = {}\n[channels.time]\ncolumn = "time [s]"\n'
    with pytest.raises(InputError, match=r"leave sample_rate_Hz or \[channels.time\] out of the profile"):
        read_run(path, parse_profile(profile.format(2 * rate)))
    assert read_run(path, parse_profile(profile.format(rate))).time.size == record.time.size


def test_the_profile_of_columns_that_the_samples_decide_on_names_those_of_the_file(tmp_path):
    samples = np.random.default_rng(1).normal(0, 0.02, 600)  # of an actuator at rest
    header = ("time [s],Axial displacement [mm],force [N],Vertical displacement [mm]",)
    path = write(tmp_path, "a_0.5A.csv", text(np.column_stack([rows(), samples]), header))
    saved = write(tmp_path, "rig.toml", profile_text(guess_profile(path)))
    assert load_profile(saved).channel("displacement").column == "Axial displacement [mm]"
    np.testing.assert_array_equal(read_run(path, saved).displacement, read_run(path).displacement)


@pytest.mark.parametrize(("tests", "unit"), [(3, " [N]"), (3, ""), (2, " [N]")])
def test_a_profile_of_columns_that_differ_between_the_tests_of_a_file_leaves_them_open(tests, unit, tmp_path):
    names = ["t [s]", *(name for n in range(1, tests + 1) for name in (f"x{n} [mm]", f"F{n}{unit}"))]
    columns = [rows()[:, :1], *(rows(seed=n)[:, 1:] for n in range(1, tests + 1))]
    path = write(tmp_path, "in.csv", text(np.hstack(columns), (",".join(names),)))
    written, _ = profile_template([path], Profile())
    answered = re.sub(r"#unit = .*", 'unit = "N"', written.replace('#blocks = "split"', 'blocks = "split"'))
    answered = re.sub(r'#"in_([0-9])" =', r'"in_\1" = 0.\1', answered.replace("#[current", "[current"))
    records = import_files([path], parse_profile(answered)).records
    assert [float(record.current[0]) for record in records] == [0.1, 0.2, 0.3][:tests]
    for seed, record in enumerate(records, 1):
        np.testing.assert_allclose(record.force, rows(seed=seed)[:, 2], rtol=0, atol=1e-5)


@pytest.mark.parametrize("header", [(), ("time\tdisp\tforce\tcount",)])
def test_the_guess_of_a_file_that_says_too_little_is_there_to_be_completed(tmp_path, header):
    path = write(tmp_path, "a_1A.dat", text(np.column_stack([rows(), np.arange(600)]), header, "\t"))
    with pytest.raises(InputError, match="E_UNITS_MISSING"):
        read_run(path)
    guess = profile_text(guess_profile(path))
    for channel, column, unit in (("time", 1, "s"), ("displacement", 2, "mm"), ("force", 3, "N")):
        place = "" if header else f"column = {column}\n"
        assert f"[channels.{channel}]\n" in guess
        guess = guess.replace(f"[channels.{channel}]\n", f'[channels.{channel}]\nunit = "{unit}"\n{place}')
    record = read_run(path, parse_profile(guess))
    np.testing.assert_allclose(record.force, channels()["force"], rtol=0, atol=1e-6)


def test_files_with_the_same_signals_in_folders_are_a_test_each(tmp_path):
    for folder, amperes in (("0 A", 0), ("0.5 A", 1)):
        (tmp_path / folder).mkdir()
        for name in ("1 Hz.csv", "2 Hz.csv"):
            write(tmp_path / folder, name, text(rows(seed=amperes), ("Time (s),Channel A (V),Channel B (V)",)))
    written, problems = profile_template([tmp_path], Profile())
    assert len(problems) == 2
    assert "{run}" not in written.partition("# pattern")[0]


@pytest.mark.parametrize(("name", "pattern"), [("run_{}/{}.csv", "{{run}}/{}.csv"), ("{1}_{0}.csv", "{}_{{run}}.csv")])
def test_a_profile_is_written_for_tests_of_several_files(name, pattern, tmp_path):
    for number in (1, 2):
        time, moved, load = rows(seed=number).T
        for kind, heading, columns in (
            ("axis", "time_s,position", (time, moved)),
            ("wrench", "time_s,force.x,force.y,force.z", (time, 0 * load, load, 0.5 * load)),
            ("coil_current", "time_s,data", (time, np.full(time.size, 0.5))),
        ):
            path = tmp_path / "in" / name.format(number, kind)
            path.parent.mkdir(parents=True, exist_ok=True)
            write(path.parent, path.name, text(np.column_stack(columns), (heading,)))
    files = [pattern.format(kind) for kind in ("axis", "coil_current", "wrench")]
    refused = CliRunner().invoke(application(), ["import", str(tmp_path / "in")])
    assert f"every test has 3 files, {', '.join(files)}; " in " ".join(refused.output.split())
    written, problems = profile_template([tmp_path / "in"], Profile())
    assert 1 <= len(problems) <= 3
    of_channels = {role: channel.file for role, channel in parse_profile(written).channels.items()}
    assert of_channels == {"time": None, "displacement": files[0], "current": files[1], "force": files[2]}
    for role, more in (("displacement", 'unit = "mm"'), ("current", 'unit = "A"'), ("force", 'column = 3\nunit = "N"')):
        written = written.replace(f"[channels.{role}]", f"[channels.{role}]\n{more}")
    records = import_files([tmp_path / "in"], parse_profile(written)).records
    assert len(records) == 2
    for number, record in enumerate(records, 1):
        np.testing.assert_allclose(record.force, rows(seed=number)[:, 2], atol=1e-4)


@pytest.mark.parametrize(
    ("pattern", "path", "matches"),
    [
        ("F0*", "/in/ALL0000/F0000CH1.CSV", True), ("all0000", "/in/ALL0000/F0000CH1.CSV", True),
        ("ALL*", "/in/ALL0000/F0000CH1.CSV", False), ("in", "/in/ALL0000/F0000CH1.CSV", False),
        ("ALL0000/F0000CH1.CSV", "/in/ALL0000/F0000CH1.CSV", True), ("*/ALL0000/*", "/in/ALL0000/F0000CH1.CSV", True),
        ("L0000/*", "/in/ALL0000/F0000CH1.CSV", False), ("a/b.csv", "a/b.csv", True),
    ],
)  # fmt: skip
def test_a_pattern_of_currents_names_a_file_with_folders_or_a_folder_as_a_whole(pattern, path, matches):
    source = CurrentSource(values={pattern: 0.5})
    assert source.fitting(Path(path), Path(path).stem) == [pattern] * matches


def test_a_folder_called_as_one_of_its_files_has_no_current_of_those_with_their_own():
    source = CurrentSource(values={"test1": 0.5, "test2": 1.0})
    assert [source.fitting(Path(f"/in/test1/test{n}.csv"), f"test{n}") for n in (1, 2)] == [["test1"], ["test2"]]
