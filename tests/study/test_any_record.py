"""A study of a third damper: random motion, a switched current, not one sine; from the folder to the scores."""

import csv
import io
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from support.command import mrdamper

sys.path.insert(0, str(Path(__file__).parents[2]))

from benchmarks.virtual_dampers import DAMPERS
from mrdamper.dampers.model_file import load_model
from mrdamper.data import Dataset
from mrdamper.rig_files.dataset_folder import save_dataset

VIRTUAL = next(virtual for virtual in DAMPERS if virtual.name == "switched current")


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
