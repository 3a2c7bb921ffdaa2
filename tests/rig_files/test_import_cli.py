"""`mrdamper import`: everything or nothing, twice the same, and every refusal listed."""

import json
import re
import zipfile

import numpy as np
import pytest
from support.rig_files import channels, columns, lines_of, npz_bytes, rows, text, write
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.errors import InputError
from mrdamper.rig_files.dataset_folder import load_dataset
from mrdamper.rig_files.rig_import import import_files, read_run, to_dataset


def run(*arguments):
    return CliRunner().invoke(application(), ["import", *map(str, arguments)])


@pytest.fixture
def folder(tmp_path):
    raw = tmp_path / "raw"
    (raw / "b").mkdir(parents=True)
    write(raw, "one_0.5A.csv", text())
    german = text(rows(seed=2), header=("Zeit [s];Weg [mm];Kraft [N]",), separator=";", decimal=",")
    write(raw, "two_-0.3A-.csv", german, "utf-16")
    write(raw / "b", "one_0.5A.npz", npz_bytes(**columns(seed=3)))
    write(raw, "notes.md", "not a rig's file")
    return raw


def test_a_folder_becomes_a_dataset_with_its_provenance(folder, tmp_path):
    done = run(folder, "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    dataset = load_dataset(tmp_path / "out")
    assert [item.id for item in dataset] == ["one_0.5A", "one_0.5A_2", "two_-0.3A-"]
    assert [item.current_A for item in dataset] == [0.5, 0.5, 0.3]
    for item in dataset:
        # Six decimals in the text files.
        measured = channels(seed={"one_0.5A": 3, "one_0.5A_2": 1}.get(item.id, 2))["force"]
        np.testing.assert_allclose(item.force, measured, rtol=0, atol=1e-6)
        assert len(item.notes["sha256"]) == 64
        assert item.notes["current_from"] == "file name"
    assert dataset["two_-0.3A-"].notes["file"] == "two_-0.3A-.csv"


def test_importing_twice_gives_the_same_bytes(folder, tmp_path):
    profile = write(tmp_path, "rig.toml", 'rig = "seven"\n')
    for name in ("a", "b"):
        assert run(folder, "--out", tmp_path / name, "--profile", profile).exit_code == 0
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == ["rig.toml", "runs.csv", "samples.parquet"]
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_one_refused_file_stops_all_unless_told_otherwise(folder, tmp_path):
    write(folder, "bad_1A.csv", lines_of({100: "0.49,1_000.5,3.0"}))
    write(folder, "no_current.csv", text())
    done = run(folder, "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert "E_NUMBER" in done.output
    assert "E_CURRENT_MISSING" in done.output
    assert not (tmp_path / "out").exists()
    done = run(folder, "--out", tmp_path / "out", "--skip-refused", "--json")
    assert done.exit_code == 0
    summary = json.loads(done.output)
    assert [entry["code"] for entry in summary["refused"]] == ["E_NUMBER", "E_CURRENT_MISSING"]
    assert [entry["run_id"] for entry in summary["runs"]] == [item.id for item in load_dataset(tmp_path / "out")]


def test_the_refusal_for_want_of_a_current_says_what_the_file_has_instead(tmp_path):
    table = np.column_stack([rows(), np.full(600, 0.5)])
    write(tmp_path, "a.csv", text(table, ("time_s,displacement_mm,force_N,current [V]",)))
    done = run(tmp_path / "a.csv", "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert "'current [V]' is in V, which is no unit of current" in done.output
    assert "E_CURRENT_MISSING" in done.output
    assert "--write-profile rig.toml" in done.output


def test_nothing_good_writes_nothing(tmp_path):
    path = write(tmp_path, "a.csv", b"")
    assert run(path, "--out", tmp_path / "out", "--skip-refused").exit_code == 2
    assert not (tmp_path / "out").exists()


def test_a_killed_import_leaves_nothing(folder, tmp_path, monkeypatch):
    import polars as pl

    monkeypatch.setattr(pl.DataFrame, "write_parquet", lambda *a, **k: (_ for _ in ()).throw(KeyboardInterrupt))
    run(folder, "--out", tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["raw"]


def test_an_existing_dataset_is_refused_before_the_work(folder, tmp_path):
    write(tmp_path, "taken", "x")
    done = run(folder, "--out", tmp_path / "taken")
    assert isinstance(done.exception, InputError)
    assert done.exception.code == "E_OUTPUT"


def test_the_guess_is_a_profile_for_the_folder(folder, tmp_path):
    shown = run(folder / "one_0.5A.csv", "--write-profile", "-")
    assert shown.exit_code == 0
    assert 'column = "force_N"' in shown.output
    saved = run(folder / "one_0.5A.csv", "--write-profile", tmp_path / "rig.toml")
    assert saved.exit_code == 0
    assert (tmp_path / "rig.toml").read_text() == shown.output
    done = run(folder / "one_0.5A.csv", "--profile", tmp_path / "rig.toml", "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output


def test_the_guess_for_a_folder_is_that_of_its_first_test_not_of_its_readme(folder, tmp_path):
    (folder / "README.txt").write_text("MR damper tests. One file per test.\n")
    done = run(folder, "--write-profile", tmp_path / "rig.toml")
    assert done.exit_code == 0, done.output
    assert "[channels.force]" in (tmp_path / "rig.toml").read_text()


def test_a_wrong_sign_is_mended_by_the_profile(tmp_path):
    table = rows() * [1, 1, -1]
    path = write(tmp_path, "a_1A.csv", text(table))
    done = run(path, "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert "E_DISSIPATION_SIGN" in done.output
    profile = write(tmp_path, "rig.toml", "[channels.force]\nsign = -1\n")
    assert run(path, "--out", tmp_path / "out", "--profile", profile).exit_code == 0
    np.testing.assert_allclose(load_dataset(tmp_path / "out")["a_1A"].force, channels()["force"], rtol=0, atol=1e-6)


def test_names_that_look_like_formulas_or_control_the_screen_are_data(tmp_path):
    header = "time_s,displacement_mm,force_N,=HYPERLINK(0)\x1b[2J\u202eevil"
    table = np.column_stack([rows(), np.zeros(600)])
    path = write(tmp_path, "=cmd_1A.csv", text(table, (header.replace("\x1b", ""),)))
    done = run(path, "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    written = (tmp_path / "out" / "runs.csv").read_text()
    assert not any(cell.startswith(("=", "+", "@")) for line in written.splitlines() for cell in line.split(","))
    assert "\u202e" not in written + done.output


def test_a_raw_folder_given_as_a_dataset_points_to_import(folder):
    with pytest.raises(InputError, match="mrdamper import"):
        load_dataset(folder)


def test_python_does_what_the_command_does(folder):
    result = import_files([folder])
    assert not result.refusals
    assert [item.id for item in to_dataset(result.records)] == ["one_0.5A", "one_0.5A_2", "two_-0.3A-"]
    assert read_run(folder / "one_0.5A.csv").id == "one_0.5A"


def test_a_profile_that_cannot_be_read_stops_at_once(folder, tmp_path):
    profile = write(tmp_path, "rig.toml", "rigg = 1")
    done = run(folder, "--out", tmp_path / "out", "--profile", profile)
    assert isinstance(done.exception, InputError)
    assert done.exception.code == "E_PROFILE"


def test_one_path_is_read_as_several_are(tmp_path):
    write(tmp_path, "0A.csv", text())
    ways = (tmp_path, str(tmp_path), [tmp_path / "0A.csv"], tmp_path.glob("*.csv"))
    assert [[record.id for record in import_files(way).records] for way in ways] == [["0A"]] * 4


def test_one_record_under_several_currents_is_refused(tmp_path):
    for name in ("0A.csv", "0.5A.csv"):
        write(tmp_path, name, text())
    result = import_files([tmp_path])
    assert [refusal.error.code for refusal in result.refusals] == ["E_CONDITIONS"] * 2
    write(tmp_path, "0.5A.csv", text(rows(seed=2)))
    assert len(import_files([tmp_path]).records) == 2


def test_files_of_one_name_in_several_folders_are_told_apart(tmp_path):
    for number, folder in enumerate(("1Hz", "2Hz")):
        (tmp_path / "raw" / folder).mkdir(parents=True)
        write(tmp_path / "raw" / folder, "0.5A.csv", text(rows(seed=number)))
    done = run(tmp_path / "raw", "--out", tmp_path / "out")
    assert "2 runs from 2 files" in done.output
    assert [item.notes["file"] for item in load_dataset(tmp_path / "out")] == ["1Hz/0.5A.csv", "2Hz/0.5A.csv"]
    assert [item.id for item in load_dataset(tmp_path / "out")] == ["1Hz_0.5A", "2Hz_0.5A"]
    run(tmp_path / "raw", "--write-tests", tmp_path / "raw" / "tests.csv")
    assert run(tmp_path / "raw", "--out", tmp_path / "again").exit_code == 0


def test_tests_without_a_current_are_named_within_their_archive_and_a_table_takes_their_currents(tmp_path):
    table = np.vstack([np.column_stack([rows(seed=i), np.full(600, i)]) for i in (1, 2)])
    with zipfile.ZipFile(tmp_path / "rig.zip", "w") as archive:
        archive.writestr("data/both.csv", text(table, ("time_s,displacement_mm,force_N,run",)))
        archive.writestr("data/photo.txt", "a photo of the rig")
    done = run(tmp_path / "rig.zip", "--out", tmp_path / "out")
    assert "refused 2 tests in rig.zip/data (both.csv: both_1, both.csv: both_2): no coil current" in done.output
    assert "--write-tests tests.csv" in done.output
    assert "not imported as tests: photo.txt" in done.output
    assert run(tmp_path / "rig.zip", "--write-tests", tmp_path / "tests.csv").exit_code == 0
    table = (tmp_path / "tests.csv").read_text().replace("both_1,", "both_1,0.5").replace("both_2,", "both_2,1.0")
    (tmp_path / "tests.csv").write_text(table)
    assert run(tmp_path / "rig.zip", "--out", tmp_path / "out", "--tests", tmp_path / "tests.csv").exit_code == 0


def test_the_profile_of_a_folder_is_that_of_its_first_test_where_a_table_beside_it_is_damaged(tmp_path):
    write(tmp_path, "a1.csv", text(rows(), ("Time,Stroke,Load",)))
    write(tmp_path, "a0.csv", "Time,Stroke,Load\n")
    done = run(tmp_path, "--write-profile", "-")
    assert done.exit_code == 0
    assert '[channels.force]\ncolumn = "Load"' in done.output


def test_columns_that_are_not_taken_are_named_once_and_the_profile_of_a_folder_is_that_of_a_test(tmp_path):
    write(tmp_path, "a_plan.csv", "test,current_A\nb0,0.5\nb1,1\n")
    for i in range(2):
        table = np.column_stack([rows(seed=i), *np.full((3, 600), 70.0)])
        write(tmp_path, f"b{i}.csv", text(table, ("time_s,displacement_mm,force_N,Temp (F),TC1,Coil current cmd",)))
    done = run(tmp_path, "--out", tmp_path / "out")
    assert done.output.count("columns not used: TC1, Coil current cmd\n") == 1
    assert load_dataset(tmp_path / "out")["b0"].further["temperature_C"][0] == pytest.approx(21.11, abs=0.01)
    assert 'column = "force_N"' in run(tmp_path, "--write-profile", "-").output


def test_a_profile_is_written_also_where_two_rates_are_stated(tmp_path):
    write(tmp_path, "a_0.5A.csv", "# scan rate 1000 Hz\n" + text(rows()[:, 1:], ("displacement_mm,force_N",)))
    write(tmp_path, "README.txt", "All channels were sampled at 500 Hz.\n")
    profile = run(tmp_path, "--write-profile", "-").stdout
    assert "two sampling rates: 500 Hz and 1000 Hz" in run(tmp_path, "--out", tmp_path / "out").output
    profile = re.sub("#sample_rate_Hz = .*", "sample_rate_Hz = 500", profile)
    path = write(tmp_path, "rig.toml", profile)
    assert run(tmp_path, "--profile", path, "--out", tmp_path / "out").exit_code == 0


def test_a_key_that_stands_twice_in_a_profile_is_named(tmp_path):
    profile = write(tmp_path, "rig.toml", '[file]\nnames = ["a"]\nnames = ["time [s]"]\n')
    done = run(write(tmp_path, "a.csv", text()), "--profile", profile)
    assert "every key once" in str(done.output) + str(done.exception)


def test_units_and_currents_that_lack_are_asked_for_at_once(tmp_path):
    for name in ("a", "b"):
        write(tmp_path, f"{name}.csv", text(rows(seed=ord(name)), ("time_s,displacement,force_N",)))
    done = run(tmp_path, "--out", tmp_path / "out")
    assert "column 'displacement' has no unit" in done.output
    assert "and give the current of each test" in done.output
    column = 'column = "displacement"\n'
    profile = run(tmp_path, "--write-profile", "-").output.replace(column, f'{column}unit = "mm"\n')
    profile = re.sub(r'#("[ab]") =', r"\1 = 0.5", profile.replace("#[current.values]", "[current.values]"))
    path = write(tmp_path, "rig.toml", profile[profile.index("rig =") :])
    assert run(tmp_path, "--profile", path, "--out", tmp_path / "out").exit_code == 0


def test_the_guess_for_a_folder_is_that_of_its_refused_file_not_of_a_table_before_it(tmp_path):
    write(tmp_path, "damper.csv", "id,serial,stroke_mm\n3,RD-4417,55\n")
    write(tmp_path, "sample_0.5A.csv", text(header=("time_s,displacement_mm,force_x",)))
    assert "refused: sample_0.5A.csv" in run(tmp_path, "--out", tmp_path / "out").output
    profile = run(tmp_path, "--write-profile", "-").stdout
    path = write(tmp_path, "rig.toml", profile.replace('column = "force_x"', 'column = "force_x"\nunit = "N"'))
    assert run(tmp_path, "--profile", path, "--out", tmp_path / "out").exit_code == 0


def test_refused_tests_of_one_file_are_told_with_the_line_and_the_text_of_the_first(tmp_path):
    lines = text(header=("displacement_mm,force_N",), table=rows()[:, 1:]).splitlines()
    blocks = [[f"# I = {amperes} A", lines[0], *lines[1:50], "retry", *lines[50:]] for amperes in (0.0, 0.5)]
    write(tmp_path, "a.csv", "\n".join([*blocks[0], *blocks[1], ""]))
    profile = write(tmp_path, "rig.toml", "[file]\nsample_rate_Hz = 500.0\n")
    assert (
        "the first of them, line 52: 1 fields where the other rows have 2: 'retry'"
        in run(tmp_path, "--profile", profile).output
    )


def test_the_profile_of_refused_files_lists_what_to_fill_in_where_it_stands(tmp_path):
    for level in (0, 1):
        for n in (1, 2):
            table = [*rows(seed=10 * level + n)[:, 1:].T, rows(seed=3)[:, 2] / 1000]
            heads = ("stroke [mm],cell 1 [N],cell 2",)
            write(tmp_path, f"knob{level}_test{n}.csv", text(np.column_stack(table), heads))
    profile = run(tmp_path, "--write-profile", "-").stdout
    assert "sign = 1\n" not in profile
    assert re.search(r"\[file\]\n(?:.+\n)*#sample_rate_Hz = ", profile)
    profile = re.sub("#sample_rate_Hz = .*", "sample_rate_Hz = 500", profile)
    levels = profile.replace("#[current.values]", "[current.values]")
    levels = levels.replace('#"knob0_*" =', '"knob0_*" = 0.0').replace('#"knob1_*" =', '"knob1_*" = 0.5')
    path = write(tmp_path, "rig.toml", levels)
    assert run(tmp_path, "--profile", path, "--out", tmp_path / "out").exit_code == 0


@pytest.mark.parametrize(
    ("heads", "line", "answer"),
    [
        ("time_s,displacement,force_N", '#unit =   # "mm" or "m" or "in" or "cm"', 'unit = "mm"'),
        ("time_s,displacement_mm,cell 1", '#column =   # "cell 1"\n#unit =   # "N"', 'column = "cell 1"\nunit = "N" #'),
        ("time_s,displacement_mm,compression load (N)", "#sign = -1  # if it counts compression positive", "sign = 1"),
    ],
)
def test_what_a_refusal_asks_for_stands_with_its_values_in_the_section_of_its_channel(tmp_path, heads, line, answer):
    write(tmp_path, "a_0.5A.csv", text(header=(heads,)))
    profile = run(tmp_path, "--write-profile", "-").stdout
    assert line in profile
    before, section, after = profile.partition(
        "[channels.displacement]" if "displacement," in heads else "[channels.force]"
    )
    path = write(tmp_path, "rig.toml", before + section + after.replace(line, answer, 1))
    assert run(tmp_path / "a_0.5A.csv", "--profile", path, "--out", tmp_path / "out").exit_code == 0


def test_a_test_that_a_plan_discards_stands_in_the_profile_to_be_left_out(tmp_path):
    for n in (1, 2):
        write(tmp_path, f"run_{n}.csv", text(rows(seed=n)))
    write(tmp_path, "plan.csv", "Run,Current [A],Remark\nrun_1,0.5,\nrun_2,0.5,do not use\n")
    profile = run(tmp_path, "--write-profile", "-").stdout
    path = write(tmp_path, "rig.toml", profile.replace('#leave_out = ["run_2.csv"]', 'leave_out = ["run_2.csv"]'))
    assert run(tmp_path, "--profile", path, "--out", tmp_path / "out").exit_code == 0
