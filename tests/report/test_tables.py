"""Tables leave without the plotting library, and nothing is lost on the way to CSV."""

import csv
import math
import subprocess
import sys

import numpy as np
from support.dampers import joint_damper
from support.synthetic import synthetic_run

from mrdamper.files.dataset import save_dataset
from mrdamper.files.encoding import csv_text
from mrdamper.files.model_file import save_model

PLAIN = """
import sys
from mrdamper.cli import application
from typer.testing import CliRunner
for command in (
    ["predict", "model.json", "--current", "0.5", "--frequency", "2", "--amplitude", "10", "--out", "force.csv"],
    ["validate", "model.json", "data", "--out", "scores.csv"],
    ["identify", "data", "--model", "bingham", "--out", "identified.csv"],
    ["import", "record.csv", "--out", "again"],
):
    done = CliRunner().invoke(application(), command)
    heavy = [name for name in ("matplotlib", "jinja2") if name in sys.modules]
    print(command[0], done.exit_code, heavy)
"""


def test_commands_that_write_tables_load_no_plotting_library(tmp_path, condition):
    from mrdamper.data import Dataset

    run = synthetic_run(condition, noise=1.0, cycles=6, samples_per_cycle=200, id="one", rig="bench")
    save_dataset(Dataset((run,), "made"), tmp_path / "data")
    table = np.column_stack([run.time, 1e3 * run.displacement, run.force, run.current])
    header = "time_s,displacement_mm,force_N,current_A"
    np.savetxt(tmp_path / "record.csv", table, fmt="%.9g", delimiter=",", header=header, comments="")
    save_model(joint_damper(), tmp_path / "model.json")
    done = subprocess.run([sys.executable, "-c", PLAIN], cwd=tmp_path, capture_output=True, text=True, check=True)
    lines = [line for line in done.stdout.splitlines() if line.endswith("]")]
    assert lines == [f"{name} 0 []" for name in ("predict", "validate", "identify", "import")], done.stdout
    for name in ("force.csv", "scores.csv", "identified.csv"):
        assert len((tmp_path / name).read_text().splitlines()) > 1, name


def test_a_table_keeps_every_digit_and_leaves_gaps_empty():
    value = math.pi * 1e-7
    rows = list(csv.DictReader(csv_text([{"a": value, "b": None}, {"a": 1, "c": "x, y"}]).splitlines()))
    assert float(rows[0]["a"]) == value
    assert rows[0]["b"] == rows[0]["c"] == ""
    assert rows[1] == {"a": "1", "b": "", "c": "x, y"}
