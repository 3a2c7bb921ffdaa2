"""A study of a third damper: random motion, a switched current, not one sine; from the folder to the scores."""

import csv
import io
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.command import mrdamper

sys.path.insert(0, str(Path(__file__).parents[2]))

from benchmarks.virtual_dampers import DAMPERS
from mrdamper.dampers.model_file import load_model
from mrdamper.data import Condition, Dataset, Run
from mrdamper.errors import IdentificationError
from mrdamper.report.plots.model import residual_map
from mrdamper.report.study import _parameter_rows
from mrdamper.rig_files.dataset_folder import save_dataset
from mrdamper.study.workflow import run_study

VIRTUAL = next(virtual for virtual in DAMPERS if virtual.name == "switched current")


@pytest.mark.slow
def test_a_third_damper_from_the_command_line(tmp_path):
    runs = [*VIRTUAL.runs(), replace(VIRTUAL.unseen(), split="validate")]
    save_dataset(Dataset(tuple(replace(run, rig="third") for run in runs)), tmp_path / "tests")
    assert mrdamper("study", tmp_path / "tests", "--lag", "--out", tmp_path / "result").returncode == 0
    model = tmp_path / "result" / "model.json"
    done = mrdamper("validate", model, tmp_path / "tests", "--split", "validate")
    (row,) = csv.DictReader(io.StringIO(done.stdout))
    assert float(row["nrmse_std"]) < 0.02
    assert (row["session"], row["extrapolation"]) == ("unknown", "")
    damper = load_model(model)
    assert (damper.coil.rise_s, damper.coil.fall_s) == pytest.approx((6e-3, 12e-3), rel=0.05)
    low, high = damper.uncertainty.interval(damper, "fy1", level=0.999)
    assert low < VIRTUAL.truth.fy1 < high


def test_random_records_alone_are_fitted_by_laws_of_the_current_and_by_no_model_of_sines(tmp_path):
    rng, t = np.random.default_rng(5), np.arange(800) / 200
    runs = []
    for current in (0.0, 0.0, 1.0, 1.0, 1.0):
        phases = rng.uniform(0, 2 * np.pi, 9)
        x = 3e-3 * sum(np.sin(2 * np.pi * f * t + phase) for f, phase in enumerate(phases, start=1)) / 3
        v = np.gradient(x, t)
        force = (800 + 400 * current) * v + (50 + 300 * current) * np.sign(v) + 10
        force += rng.normal(0, 2, t.size)
        runs.append(Run(f"r{len(runs)}", t, x, force, current, split="train" if len(runs) < 4 else "validate"))
    study = run_study(Dataset(tuple(runs), "roads"), model="bingham")
    assert {"bingham:current", "bouc-wen:current", "play-bypass"} <= {c.recipe.name for c in study.rigs[0].candidates}
    assert study.table["rig"][0] == "roads"
    assert list(_parameter_rows(study)[0].values())[:2] == ["roads", "c.0"]
    for damper in (candidate.damper for candidate in study.rigs[0].candidates):
        assert {flag for run in runs[:4] for flag in damper.predict(run).extrapolation} <= {"sampling"}, damper.title
    page = study.write_report(tmp_path / "report")[0].read_text(encoding="utf-8")
    assert "No run is a steady sine" in page
    assert "Validation runs, last cycle of the steady window" in page
    over_velocity, over_phase = residual_map(study.model, runs[:1]).axes
    assert np.isfinite(over_velocity.series[0].y).any()
    assert np.isfinite(over_phase.series[0].y).any()
    model = study.model.model_at(Condition(1.0, 2.0, 0.005))
    assert (model.c, model.fy) == (pytest.approx(1200, rel=0.05), pytest.approx(350, rel=0.05))
    with pytest.raises(IdentificationError, match=r"kwok: identified from steady sines .* of which there are 0"):
        run_study(Dataset(tuple(runs), "roads"), model="kwok")
    kernel = run_study(Dataset(tuple(runs), "roads"), model="kernel").rigs[0].chosen  # takes any record, as in compare
    assert kernel.recipe.name == "kernel"
    assert kernel.validation.median() < 0.2
