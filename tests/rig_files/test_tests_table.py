"""`tests.csv`, adding to a dataset and holding runs out: by the command line, as users do."""

import shutil
import time
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from support import lab_exports
from support.lab_exports import Lab, campaign
from support.rig_files import rows, text, write
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.errors import InputError
from mrdamper.rig_files.dataset_folder import load_dataset
from mrdamper.rig_files.rig_import import import_files
from mrdamper.rig_files.tests_table import load_tests


def run(*arguments):
    return CliRunner().invoke(application(), list(map(str, arguments)))


@pytest.fixture(scope="module")
def lab():
    return Lab(campaign(2, currents=(0.0, 0.6, 1.2), points=60, cycles=3))


@pytest.fixture(scope="module")
def imported(lab, tmp_path_factory):
    """A folder of a laboratory and the dataset made of it."""
    folder = tmp_path_factory.mktemp("imported")
    (folder / "rig").mkdir()
    lab_exports.tests_table(lab, folder / "rig")
    done = run("import", folder / "rig", "--out", folder / "ds")
    assert done.exit_code == 0, done.output
    return folder


@pytest.fixture
def rig(imported, tmp_path):
    return shutil.copytree(imported / "rig", tmp_path / "rig")


@pytest.fixture
def dataset(imported, tmp_path):
    return shutil.copytree(imported / "ds", tmp_path / "ds")


def test_the_table_beside_the_files_is_used(dataset, lab):
    runs = load_dataset(dataset)
    assert [item.current_A for item in runs] == [test.current for test in lab.tests]
    assert runs["t01"].notes["temperature_C"] == "24"
    assert runs["t01"].notes["session"] == "monday"
    assert runs["t01"].notes["current_from"] == "tests.csv"


def test_a_template_is_written_completed_and_used(rig, tmp_path):
    (rig / "tests.csv").unlink()
    assert run("import", rig, "--out", tmp_path / "ds").exit_code == 2
    table = tmp_path / "table.csv"
    assert run("import", rig, "--write-tests", table).exit_code == 0
    lines = table.read_text().splitlines()
    assert lines[0] == "file,run,current_A,temperature_C,split,session,specimen,notes"
    completed = [lines[0]]
    for number, line in enumerate(lines[1:]):  # three motions at each of three currents
        completed.append(line.replace(",,,train", f",{0.5 * (number // 3)},,validate", 1))
    table.write_text("\n".join(completed) + "\n")
    done = run("import", rig, "--out", tmp_path / "ds", "--tests", table)
    assert done.exit_code == 0, done.output
    assert {(item.current_A, item.split) for item in load_dataset(tmp_path / "ds")} == {
        (0.0, "validate"),
        (0.5, "validate"),
        (1.0, "validate"),
    }


def test_a_table_of_tests_and_its_hints_go_with_a_profile(tmp_path):
    (tmp_path / "rig").mkdir()
    for number, frequency in enumerate((1.0, 2.5), 1):
        table = rows(seed=number)
        table[:, 0] /= frequency
        write(tmp_path / "rig", f"a{number}.csv", text(table, ("time_s,displacement_mm,Signal",)))
    profile = write(tmp_path, "my rig.toml", '[channels.force]\ncolumn = "Signal"\nunit = "N"\n')
    given = ("import", tmp_path / "rig", "--out", tmp_path / "ds", "--profile", profile)
    hint = " ".join(run(*given).output.split())
    assert f"FILES --profile '{profile}' --write-tests tests.csv, fill in" in hint
    assert f"import with --profile '{profile}' --tests tests.csv" in hint
    template = tmp_path / "table.csv"
    assert run("import", tmp_path / "rig", "--profile", profile, "--write-tests", template).exit_code == 0
    assert [note.split(",")[0] for note in pl.read_csv(template)["notes"]] == ["1 Hz", "2.5 Hz"]
    template.write_text(template.read_text().replace(",,,train", ",0.5,,train"))
    profile.write_text('[channels.force]\ncolumn = "Signl"\nunit = "N"\n')
    done = run(*given, "--tests", template)
    assert "no column 'Signl' for force" in done.output
    assert f"correct {profile}, which mrdamper import FILE --profile '{profile}'" in " ".join(done.output.split())
    profile.write_text('[channels.force]\ncolumn = "Signal"\nunit = "N"\n')
    template.write_text(template.read_text().replace("a2.csv,a2", "a2.csv,a3"))
    assert "no such test: 'a2.csv a3' (line 3)" in str(run(*given, "--tests", template).exception)


def test_a_template_has_the_currents_that_a_plan_states_and_a_number_may_begin_with_its_point(rig, lab, tmp_path):
    (rig / "tests.csv").unlink()
    rows = [f"{n},{test.current}" for n, test in enumerate(lab.tests, 1)]
    (rig / "plan.csv").write_text("\n".join(["Test,Current (A)", *rows]) + "\n")
    table = tmp_path / "table.csv"
    done = run("import", rig, "--write-tests", table)
    assert "plan.csv" not in done.output
    assert pl.read_csv(table)["current_A"].to_list() == [test.current for test in lab.tests]
    table.write_text(table.read_text().replace(",0.6,", ",.6,"))
    done = run("import", rig, "--tests", table, "--out", tmp_path / "ds")
    assert done.exit_code == 0, done.output
    assert {item.current_A for item in load_dataset(tmp_path / "ds")} == {0.0, 0.6, 1.2}


def test_a_template_leaves_a_current_open_that_a_plan_contradicts(rig, lab, tmp_path):
    (rig / "tests.csv").unlink()
    for n, test in enumerate(lab.tests, 1):
        (rig / f"t{n:02}.csv").rename(rig / f"t{n:02}_{test.current}A.csv")
    rows = [f"t{n:02}_{test.current}A,{1.2 if n == 1 else test.current}" for n, test in enumerate(lab.tests, 1)]
    (rig / "plan.csv").write_text("\n".join(["Test,Current (A)", *rows]) + "\n")
    table = tmp_path / "table.csv"
    run("import", rig, "--write-tests", table)
    assert pl.read_csv(table)["current_A"].to_list() == [None, *(test.current for test in lab.tests[1:])]


@pytest.mark.parametrize(
    ("table", "found"),
    {
        "absent file": ("file,current_A\nt01.csv,0\nt99.csv,1\n", "no such test: 't99.csv' (line 3)"),
        "one run twice": ("file,current_A\nt01.csv,0\nt01.csv,1\n", "stands in line 2 already"),
        "current without unit": ("file,current\nt01.csv,0.5\n", "has no unit of current"),
        "an amplitude for a current": ("file,current_A\nt01.csv,20\n", "no damper's coil takes that"),
        "unknown split": ("file,current_A,split\nt01.csv,0.5,test\n", "write train or validate"),
        "no number": ("file,current_A\nt01.csv,half\n", "write a number"),
        "neither file nor run": ("current_A\n0.5\n", "neither a column file nor a column run"),
        "no rows": ("file,current_A\n", "no rows"),
    }.values(),
)
def test_a_wrong_table_is_one_line_and_nothing_is_written(rig, tmp_path, table, found):
    (rig / "tests.csv").write_text(table)
    with pytest.raises(InputError) as caught:
        run_raising("import", rig, "--out", tmp_path / "ds", "--quiet")
    assert found in str(caught.value)
    assert not (tmp_path / "ds").exists()


def run_raising(*arguments):
    result = run(*arguments)
    raise result.exception


def test_everything_wrong_with_a_table_is_said_at_once(tmp_path):
    path = write(tmp_path, "tests.csv", "file,current,split\na.csv,0.5,\nb.csv,x,best\n")
    with pytest.raises(InputError) as caught:
        load_tests(path)
    assert len(caught.value.errors) == 3
    assert caught.value.code == "E_TESTS"


def test_a_table_that_contradicts_the_channel_is_refused(tmp_path):
    table = "file,current_A\na.csv,1\n"
    rows = [f"{line},{'current_A' if i == 0 else '0.500'}" for i, line in enumerate(text().splitlines())]
    (tmp_path / "rig").mkdir()
    write(tmp_path / "rig", "a.csv", "\n".join(rows) + "\n")
    write(tmp_path / "rig", "tests.csv", table)
    done = run("import", tmp_path / "rig", "--out", tmp_path / "ds")
    assert done.exit_code == 2
    assert "E_CURRENT_CONTRADICTS" in done.output


def test_a_table_against_the_files_name_is_refused_and_its_remedies_work(tmp_path):
    (tmp_path / "rig").mkdir()
    file = write(tmp_path / "rig", "a_0.5A.csv", text())
    table = write(tmp_path / "rig", "tests.csv", "file,current_A\na_0.5A.csv,1\n")
    (refusal,) = import_files([tmp_path / "rig"]).refusals
    assert refusal.error.code == "E_CURRENT_CONTRADICTS"
    assert "gives 1 A, a_0.5A has 0.5 A (file name)" in str(refusal.error)
    for cell in ("", "0.5"):
        table.write_text(f"file,current_A,split\na_0.5A.csv,{cell},train\n")
        assert len(import_files([tmp_path / "rig"]).records) == 1
    file.rename(tmp_path / "rig" / "a.csv")
    table.write_text("file,current_A\na.csv,1\n")
    assert import_files([tmp_path / "rig"]).records[0].current.mean() == 1


def test_a_row_that_names_tests_of_two_files_is_refused_and_folders_tell_them_apart(tmp_path):
    for folder, factor in (("one", 1.0), ("two", 1.001)):
        (tmp_path / folder).mkdir()
        write(tmp_path / folder, "a.csv", text(factor * rows()))
    table = write(tmp_path, "tests.csv", "file,current_A\na.csv,0.5\n")
    with pytest.raises(InputError, match="tests of 2 files"):
        import_files([tmp_path])
    table.write_text("file,current_A\none/a.csv,0.5\ntwo/a.csv,0.5\n")
    assert len(import_files([tmp_path]).records) == 2


def test_files_are_added_to_a_dataset_and_never_twice(dataset, rig, tmp_path):
    assert run("import", rig, "--out", dataset, "--add").exit_code != 0
    write(tmp_path, "new_0.3A.csv", text())
    (dataset / "LICENCE.txt").write_text("ours")
    done = run("import", tmp_path / "new_0.3A.csv", "--out", dataset, "--add")
    assert done.exit_code == 0, done.output
    assert "(10 runs, 1 of them new)" in done.output
    assert len(load_dataset(dataset)) == 10
    assert (dataset / "LICENCE.txt").read_text() == "ours"


def test_a_file_read_otherwise_replaces_its_test_with_what_the_table_beside_it_states(tmp_path):
    """The remedy of E_FORCE_SCALE and of a wrong sign: the file on its own with a profile, and --add."""
    (tmp_path / "rig").mkdir()
    names = [f"t0{number}.csv" for number in range(3)]
    for number, name in enumerate(names):
        write(tmp_path / "rig", name, text(rows(seed=number)))
    write(tmp_path / "rig", "tests.csv", "file,current_A,split\n" + "".join(f"{name},0.5,train\n" for name in names))
    assert run("import", tmp_path / "rig", "--out", tmp_path / "data").exit_code == 0
    listed = tmp_path / "data" / "runs.csv"
    pl.read_csv(listed).with_columns(rig=pl.lit("bench 4")).write_csv(listed)
    before = load_dataset(tmp_path / "data")
    assert repr(import_files([tmp_path / "rig"])) == "<import: tests accepted: 3, refused: 0>"
    profile = write(tmp_path, "lbf.toml", '[channels.force]\nunit = "lbf"\n')
    again = ("import", tmp_path / "rig" / "t01.csv", "--out", tmp_path / "data", "--add")
    assert "read in the same way" in str(run(*again).exception)
    done = run(*again, "--profile", profile)
    assert done.exit_code == 0, done.output
    assert "replaced: t01" in done.output
    assert "(3 runs, 0 of them new)" in done.output
    after = load_dataset(tmp_path / "data")
    assert [one.id for one in after] == [one.id for one in before]
    assert np.allclose(after["t01"].force, 4.4482216 * before["t01"].force)
    assert np.array_equal(after["t02"].force, before["t02"].force)
    assert after["t01"].mean_current == 0.5
    assert {one.rig for one in after} == {"bench 4"}


def test_other_columns_of_a_file_and_another_rig_are_other_tests_and_a_corrected_reading_replaces_its_own(tmp_path):
    plain = rows()
    table = np.column_stack([plain, 0.8 * plain[:, 1], 0.7 * plain[:, 2]])
    path = write(tmp_path, "a_0.5A.csv", text(table, ("time [s],Position [mm],Force [N],Position [mm],Force [N]",)))

    def add(displacement, force, rig="", unit="N"):
        channels = f"[channels.displacement]\ncolumn = {displacement}\n[channels.force]\ncolumn = {force}\n"
        profile = write(tmp_path, "p.toml", f'rig = "{rig}"\n{channels}unit = "{unit}"\n')
        more = ["--add"] if (tmp_path / "data").exists() else []
        done = run("import", path, "--out", tmp_path / "data", "--profile", profile, *more)
        assert done.exit_code == 0, done.output
        return done.output

    add(2, 3, "one")
    assert "added as further tests: a_0.5A_2" in add(4, 5, "two")
    assert "added as further tests: a_0.5A_3" in add(2, 5, "three")
    assert "replaced: a_0.5A_2" in add(4, 5, "two", "lbf")
    assert "added as further tests: a_0.5A_4" in add(4, 5, "four", "kgf")
    forces = {
        one.id: (one.rig, round(float(one.force.max() / plain[:, 2].max()), 2))
        for one in load_dataset(tmp_path / "data")
    }
    assert list(forces.values()) == [("one", 1.0), ("two", 3.11), ("three", 0.7), ("four", 6.86)]


@pytest.mark.parametrize(
    ("options", "held"),
    [
        (("--current", "0.6"), {"t04", "t05", "t06"}),
        (("--run", "t01", "--run", "t09"), {"t01", "t09"}),
        (("--condition", "1.2,1,20"), {"t08"}),
        (("--every", "4"), {"t04", "t08"}),
        (("--none",), set()),
    ],
)
def test_runs_are_held_out_as_told(dataset, options, held):
    assert run("split", dataset, *options).exit_code == 0
    assert {item.id for item in load_dataset(dataset) if item.split == "validate"} == held


def test_by_default_every_current_and_every_motion_stays_in(dataset):
    done = run("split", dataset)
    assert done.exit_code == 0, done.output
    runs = load_dataset(dataset)
    held = [item for item in runs if item.split == "validate"]
    left = [item for item in runs if item.split == "train"]
    assert len(held) == 2
    assert {item.current_A for item in left} == {item.current_A for item in runs}
    assert "stratified" in done.output
    assert run("split", dataset, "--none").exit_code != 0  # a split is not given up unasked
    assert run("split", dataset, "--none", "--replace").exit_code == 0


def test_a_split_that_leaves_nothing_is_refused_and_changes_nothing(dataset):
    before = (dataset / "runs.csv").read_bytes()
    everything = [option for item in load_dataset(dataset) for option in ("--run", item.id)]
    for options in (everything, ["--current", "7"], ["--condition", "1,2"], ["--run", "nix"]):
        assert run("split", dataset, *options).exit_code != 0
    assert (dataset / "runs.csv").read_bytes() == before


def test_the_same_refusal_of_many_files_is_one_line(tmp_path):
    for i in range(5):
        write(tmp_path, f"a{i}.csv", text(header=("time,disp,force",)))
    done = run("import", tmp_path, "--out", tmp_path / "ds", "--quiet")
    refused = [line for line in done.output.splitlines() if line.startswith("refused")]
    assert len(refused) == 3  # a line a channel: all that is wrong is said at once
    said = f"refused 5 tests in {tmp_path} (a0.csv, a1.csv, a2.csv and 2 more): "
    assert refused[0].startswith(said)
    assert all(line.startswith("refused the same tests: ") for line in refused[1:])


def test_refusals_that_differ_in_a_figure_are_one_line_with_names_below_a_common_folder(tmp_path):
    noise = np.random.default_rng(2).standard_normal(len(rows()))
    for i in range(4):
        (tmp_path / f"day{i}").mkdir()
        table = rows() * [1, 1, -1] + np.outer(50 * i * noise, [0, 0, 1])
        write(tmp_path / f"day{i}", "1A.csv", text(table))
    done = run("import", tmp_path, "--out", tmp_path / "ds", "--quiet")
    (line,) = [line for line in done.output.splitlines() if line.startswith("refused")]
    names = ", ".join(str(Path(f"day{i}") / "1A.csv") for i in range(3))
    assert line.startswith(f"refused 4 tests in {tmp_path} ({names} and 1 more): the first of them: ")


def test_a_table_of_far_too_many_rows_is_refused_at_once(tmp_path):
    path = write(tmp_path, "tests.csv", "file,current_A\n" + "".join(f"t{i}.csv,0.5\n" for i in range(100_000)))
    begin = time.process_time()
    with pytest.raises(InputError, match="100000 rows") as caught:
        load_tests(path)
    assert caught.value.code == "E_TESTS"
    assert time.process_time() - begin < 5.0


@pytest.mark.parametrize(
    ("name", "head", "plan", "accepted"),
    [
        ("a_0.5A.csv", "# coil current: 1 A\n", "", (0.5, 1.0)),
        ("a.csv", "# coil current: 1 A\n", "", (0.5,)),
        ("a_0.5A.csv", "", "Run,Current [A]\na_0.5A,1.5\nb,0\n", (0.5, 1.5)),
        ("a.csv", "# coil current: 1 A\n", "Ch4 [A],Ch5 [A]", (0.5, 1.0)),
    ],
    ids=["line and name", "line and channel", "name and plan", "line and columns"],
)
def test_the_table_decides_between_statements_that_contradict_each_other_but_not_against_a_channel(
    tmp_path, name, head, plan, accepted
):
    more = (plan or "current_A") if name == "a.csv" else ""
    values = ",0.501,0.7" if plan else ",0.501"
    lines = text().splitlines()
    lines = [f"{line}{(',' + more if i == 0 else values) if more else ''}" for i, line in enumerate(lines)]
    write(tmp_path, name, head + "\n".join(lines) + "\n")
    if plan.startswith("Run"):
        write(tmp_path, "b.csv", text(1.01 * rows(seed=3)))
        write(tmp_path, "plan.csv", plan)
    stem = name.removesuffix(".csv")
    (refusal,) = [refusal for refusal in import_files([tmp_path]).refusals if refusal.run == stem]
    assert refusal.error.code in ("E_CURRENT_CONTRADICTS", "E_AMBIGUOUS")
    assert "tests.csv (--write-tests)" in refusal.error.remedy
    for value in (*accepted, 2.5):
        write(tmp_path, "tests.csv", f"file,current_A\n{name},{value}\n")
        found = import_files([tmp_path])
        records = [record for record in found.records if record.id == stem]
        decided = value in accepted or (head and "_" in name) or plan.startswith("Ch4")
        assert [round(float(record.current.mean()), 1) for record in records] == [value] * bool(decided)
        if not decided and more:
            assert "correct tests.csv; if the channel is wrong, set [channels.current]" in str(found.refusals[0].error)
