"""Tables leave without the plotting library, and nothing is lost on the way to CSV."""

import csv
import math
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from support.dampers import joint_damper
from support.synthetic import synthetic_run

from mrdamper.dampers.model_file import save_model
from mrdamper.dampers.prediction import Prediction
from mrdamper.data import Condition
from mrdamper.data.encoding import csv_text
from mrdamper.identification.problem import RunUncertainty
from mrdamper.models.bingham import Bingham
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.report.tables import identification_rows, prediction_rows, score_row, score_rows
from mrdamper.rig_files.dataset_folder import save_dataset
from mrdamper.statistics.metrics import Scores
from mrdamper.study.validation import RunScore, Validation

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


def scores_of(start):
    """Six scores that are all different."""
    return Scores(*(start + k / 100 for k in range(6)))


def test_an_identification_stands_in_the_columns_that_name_it():
    found = SimpleNamespace(
        run_id="a", rig="bench", method="balance", model=Bingham(fy=300.0, c=1500.0, f0=20.0),
        condition=Condition(1.5, 2.5, 0.0125), scores=scores_of(0.1), floor=0.004, free=("fy", "c"),
        standard_errors={"c": 3.0, "fy": 4.0}, interval={"fy": (290.0, 310.0)}.get, delay=0.002, at_bounds=("fy", "c"),
        evaluations=77, ending="converged", notes=("one", "two"), doubts=("three",),
        uncertainty=RunUncertainty(effective={"c": 31.0}),
    )  # fmt: skip
    (row,) = identification_rows([found])
    wanted = {
        "run_id": "a", "rig": "bench", "model": "bingham", "method": "balance", "current_A": 1.5, "frequency_Hz": 2.5,
        "amplitude_m": 0.0125, "nrmse_pp": 0.1, "repeatability_nrmse_pp": 0.004, "wape": found.scores.wape,
        **{f"{i.name} [{i.unit}]": getattr(found.model, i.name) for i in Bingham.parameters()},
        "standard error c": 3.0, "standard error fy": 4.0, "fy low 95 %": 290.0, "fy high 95 %": 310.0,
        "c low 95 %": None, "c high 95 %": None, "effective samples c": 31.0, "delay_s": 0.002, "at_bounds": "fy c",
        "evaluations": 77, "message": "converged", "notes": "one; two; three",
    }  # fmt: skip
    assert row == wanted
    assert (row["fy [N]"], row["c [N s/m]"], row["f0 [N]"]) == (300.0, 1500.0, 20.0)


def test_a_prediction_stands_in_the_columns_of_the_contract():
    motion = Excitation(*np.array([[0.0, 0.5], [1.0, 2.0], [3.0, 4.0], [0.0, 0.0], [5.0, 6.0]]))
    prediction = Prediction(motion, np.array([7.0, 8.0]), Condition(6.0, 1.0, 1.0), ("current", "amplitude"))
    plain = {"time_s": 0.5, "displacement_m": 2.0, "velocity_m_s": 4.0, "current_A": 6.0, "force_N": 8.0}
    flags = {"extrapolation": "current amplitude"}
    assert prediction_rows(prediction)[1] == {**plain, **flags}
    band = SimpleNamespace(low=np.array([6.5, 7.5]), high=np.array([9.0, 9.5]))
    assert prediction_rows(prediction, band)[1] == {**plain, "force_low_N": 7.5, "force_high_N": 9.5, **flags}


def test_scores_are_fractions_under_their_own_names():
    known = {"rest": 0.15, "session": "a day"}
    run = RunScore("one", "bench", Condition(0, 1, 0.01), scores_of(0.1), 0.01, ("current",), **known)
    assert score_row(run) == pytest.approx(
        {"nrmse_pp": 0.1, "nrmse_std": 0.11, "wape": 0.12, "peak_error": 0.13, "energy_error": 0.14}
        | {"run_id": "one", "rest_nrmse_pp": 0.15, "session": "a day", "extrapolation": "current"}
    )


def test_left_out_and_held_out_errors_stand_in_their_own_rows():
    def scored(name, start):
        return Validation("x", (RunScore(name, "bench", Condition(0, 1, 0.01), scores_of(start), None, ()),))

    candidate = SimpleNamespace(
        recipe=SimpleNamespace(name="dahl:joint"),
        train=scored("fitted", 0.3), cross_validated=scored("left", 0.1), validation=scored("held", 0.2),
    )  # fmt: skip
    rows = score_rows("bench", candidate, "cross-validation", "validation")
    told = [(r["rig"], r["model"], r["set"], r["run_id"], r["nrmse_pp"]) for r in rows]
    assert told == [
        ("bench", "dahl:joint", "cross-validation", "left", 0.1),
        ("bench", "dahl:joint", "validation", "held", 0.2),
    ]
