"""Commands print at most 20 lines in the ordinary case; `--verbose` prints the rest."""

from dataclasses import replace

import pytest
from typer.testing import CliRunner
from web.rig_files import csv_of

from mrdamper.cli import application
from mrdamper.cli.output import shortened
from mrdamper.rig_files.dataset_folder import save_dataset

MAX_LINES = 20
DAMPER = "src/mrdamper/data/bundled/models/labcontrol.json"


def lines_of(*arguments):
    """Lines on standard output and standard error together."""
    done = CliRunner().invoke(application(), [str(argument) for argument in arguments])
    assert done.exit_code == 0, done.output
    return done.output.splitlines()


def every_eighth(run):
    channels = {name: getattr(run, name)[::8] for name in ("time", "displacement", "force", "current")}
    return replace(run, velocity=None, segments=(), **channels)


@pytest.fixture(scope="module")
def records(bundled, tmp_path_factory):
    """More tests than lines are printed, as rig files of every eighth sample, the current in their names."""
    folder = tmp_path_factory.mktemp("records")
    for number, run in enumerate(bundled.rig("utfsm").runs[: MAX_LINES + 6]):
        if not run.current_changes:
            (folder / f"{number:02d} {run.current_A:g}A.csv").write_bytes(csv_of(every_eighth(run)))
    return folder


@pytest.fixture(scope="module")
def few_runs(bundled):
    """Five sine runs of one damper."""
    runs = [run for run in bundled.rig("utfsm") if run.excitation == "sine"]
    return bundled.only(runs[:5], name="few runs")


def test_what_is_shortened_says_how_much_more_there_is():
    lines = [f"line {i}" for i in range(9)]
    assert shortened(lines, 9) == shortened(lines, 4, verbose=True) == lines
    assert shortened(lines, 4) == ["line 0", "line 1", "line 2", "  6 more with --verbose"]


def test_import(records, tmp_path):
    files = [*sorted(records.iterdir()), "--skip-refused", "--no-ask"]
    short = lines_of("import", *files, "--out", tmp_path / "short")
    full = lines_of("import", *files, "--out", tmp_path / "full", "--verbose")
    assert len(short) <= MAX_LINES < len(full)
    assert len(list(records.iterdir())) <= sum(" samples, " in line or "refused" in line for line in full) + 1
    assert len(lines_of("import", *files)) <= MAX_LINES


def test_compare(few_runs, tmp_path):
    save_dataset(few_runs, tmp_path / "rig")
    models = [f"--models={name}" for name in ("bingham", "biviscous", "smooth-bingham", "herschel-bulkley", "dahl")]
    assert len(lines_of("compare", tmp_path / "rig", "--out", tmp_path / "c", "--jobs", 1, *models)) <= MAX_LINES


@pytest.mark.parametrize(
    "system", ["quarter-car", *(pytest.param(name, marks=pytest.mark.slow) for name in ("half-car", "dyke1996"))]
)
def test_simulate(system, tmp_path, pytestconfig):
    source = "elcentro" if system == "dyke1996" else "bump"
    damper = ["--damper", pytestconfig.rootpath / DAMPER, "--current", 1]
    asked = ["simulate", system, "--input", source, *damper, "--out", tmp_path / "out"]
    short = lines_of(*asked)
    assert len(short) <= MAX_LINES
    assert len(lines_of(*asked, "--verbose")) > len(short)


def test_plan(tmp_path, pytestconfig):
    asked = ["plan", pytestconfig.rootpath / DAMPER, "--hours", 1, "--out", tmp_path / "plan"]
    assert len(lines_of(*asked)) <= MAX_LINES


@pytest.mark.slow
def test_fleet(few_runs, tmp_path):
    for number in range(3):
        save_dataset(few_runs, tmp_path / "source" / f"damper {number}")
    for number in range(12):
        (tmp_path / "source" / f"broken {number}").mkdir()
        (tmp_path / "source" / f"broken {number}" / "runs.csv").write_text("run_id\n")
    asked = ["fleet", tmp_path / "source", "--out", tmp_path / "out", "--workers", 1]
    assert len(lines_of(*asked)) <= MAX_LINES < len(lines_of(*asked, "--verbose")) + 8


@pytest.mark.slow
def test_compare_of_every_model_of_two_rigs(bundled, tmp_path):
    sines = [[run for run in bundled.rig(rig) if run.excitation == "sine"] for rig in bundled.rigs]
    save_dataset(bundled.only([run for runs in sines for run in runs[::4]], name="two rigs"), tmp_path / "rigs")
    assert len(lines_of("compare", tmp_path / "rigs", "--out", tmp_path / "c", "--jobs", 1)) <= MAX_LINES
