"""`mrdamper check` and its figure."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.rig_records import clean_record
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.data import Dataset
from mrdamper.report.plots.quality import quality_figure
from mrdamper.rig_files.dataset_folder import save_dataset
from mrdamper.rig_files.quality.table import to_run
from mrdamper.rig_files.rig_import import import_files


@pytest.fixture
def folder(tmp_path):
    good, clipped = clean_record(3, cycles=4), clean_record(4, cycles=4)
    clipped = replace(clipped, force=np.minimum(clipped.force, 0.8 * clipped.force.max()))
    save_dataset(Dataset((to_run(good), to_run(clipped))), tmp_path / "rig")
    return tmp_path / "rig"


def check(*arguments):
    return CliRunner().invoke(application(), ["check", *map(str, arguments)])


def test_a_usable_dataset_exits_with_zero(folder):
    result = check(folder)
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert lines[0].split()[:4] == ["run", "A", "Hz", "mm"]
    assert "good" in lines[1]
    assert "W_CLIPPED" in lines[2]


def test_a_refused_run_exits_with_two_and_says_why(tmp_path):
    run = to_run(clean_record(5, cycles=3))
    save_dataset(Dataset((replace(run, force=-run.force),)), tmp_path / "rig")
    result = check(tmp_path / "rig")
    assert result.exit_code == 2
    assert "refused" in result.stdout
    assert "E_DISSIPATION_SIGN" in result.output


def test_a_finding_of_several_runs_is_printed_once_with_their_number(tmp_path):
    runs = [to_run(replace(clean_record(n, cycles=4), id=f"5Hz_{n}")) for n in (3, 4)]
    save_dataset(Dataset(tuple(runs)), tmp_path / "rig")
    assert check(tmp_path / "rig").stderr.count("[W_NAME], in 2 tests") == 1
    assert check(tmp_path / "rig", "--verbose").stderr.count("[W_NAME]\n") == 2


def test_a_run_in_another_unit_of_force_is_named_with_its_factor(tmp_path):
    run, levels = to_run(clean_record(3, cycles=4)), {0.0: 1.0, 0.5: 1.6 / 4.4482216, 1.0: 2.2}
    runs = [replace(run, id=f"run{i}", force=k * run.force, current=0 * run.time + i) for i, k in levels.items()]
    save_dataset(Dataset(tuple(runs)), tmp_path / "rig")
    assert "times 4.448 only, as of lbf" in check(tmp_path / "rig").stderr
    (tmp_path / "files").mkdir()
    for i, one in zip(levels, runs, strict=True):
        table = np.column_stack([one.time, one.displacement, one.force + np.random.default_rng(1).normal(0, 1, 1)])
        np.savetxt(tmp_path / f"files/{i}A.csv", table, delimiter=",", header="time_s,stroke_m,force_N", comments="")
    records = import_files([tmp_path / "files"]).records
    notes = [[finding.text for finding in record.findings if finding.code == "W_UNITS"] for record in records]
    assert [len(texts) for texts in notes] == [0, 1, 0]
    assert "state its unit in a profile" in notes[1][0]


def test_json_holds_numbers(folder):
    rows = json.loads(check(folder, "--json").stdout)
    assert [row["verdict"] for row in rows] == ["good", "not identified"]
    assert isinstance(rows[0]["offset_force_N"], float)


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_the_figure_is_written(folder, tmp_path, suffix):
    path = tmp_path / f"loops{suffix}"
    assert check(folder, "--figure", path).exit_code == 0
    assert not re.search(rb"CreationDate|dc:date", path.read_bytes())  # the same checks, the same bytes
    assert path.stat().st_size > 5_000


def test_a_figure_of_unknown_form_is_refused_at_once(folder, tmp_path):
    result = check(folder, "--figure", tmp_path / "loops.docx")
    assert result.exit_code != 0
    assert not (tmp_path / "loops.docx").exists()


def test_flagged_samples_are_marked_and_names_are_text():
    x = np.linspace(-0.01, 0.01, 50)
    records = [SimpleNamespace(id=name, displacement=x, force=100 * x) for name in ("$x^2$ <b>", "b")]
    verdicts = [SimpleNamespace(record=one, codes=("W_CLIPPED",), refusal=None) for one in records]
    figure = quality_figure(list(zip(verdicts, (np.arange(50) > 44, np.zeros(50, dtype=bool)), strict=True)))
    first, second = figure.axes[:2]
    assert [one.x.size for one in first.series] == [50, 5]
    assert len(second.series) == 1
    # Drawn in millimetres.
    assert first.series[0].x.max() == pytest.approx(10.0)
    assert ">(a) $x^2$ &lt;b&gt;</text>" in figure.drawn().file("svg").decode()
