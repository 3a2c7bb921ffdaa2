"""Where the next thing goes, by doing: one file dropped into a copy of the house, found and working.

What ARCHITECTURE.md says of a model, a reader, a quality check, an export format, a method and a
command is tried as a user would, in a copy of the package that holds the files beside this one.
"""

import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.command import EACH
from support.dampers import joint_damper

from mrdamper.dampers.model_file import save_model

HERE, ROOT = Path(__file__).parent, Path(__file__).parents[2]
DROPPED = [path.relative_to(HERE) for path in HERE.rglob("*.py") if path != Path(__file__)]


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    """A copy of the project with a new file in every room that takes one."""
    copy = tmp_path_factory.mktemp("house")
    for part in ("src", "tests"):
        shutil.copytree(ROOT / part, copy / part, ignore=shutil.ignore_patterns("drop_in"))
    shutil.copy(ROOT / "pyproject.toml", copy)
    for path in DROPPED:
        assert not (ROOT / "src/mrdamper" / path).exists(), f"{path} would replace a file of the house"
        shutil.copy(HERE / path, copy / "src/mrdamper" / path)
    return copy


def run(house, *arguments, given=None):
    environment = {**os.environ, "PYTHONPATH": f"{house / 'src'}{os.pathsep}{house / 'tests'}"}
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=house, env=environment, input=given, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


@pytest.fixture(scope="module")
def said(house, tmp_path_factory):
    """What the commands of that house say, by name: one process, as starting one costs more than most of them."""
    place = tmp_path_factory.mktemp("place")
    save_model(joint_damper(), place / "model.json")
    t = np.arange(3001) / 500
    x, v = 0.01 * np.sin(2 * np.pi * t), 0.02 * np.pi * np.cos(2 * np.pi * t)
    (place / "1A.rigx").write_bytes(b"RIGX" + np.column_stack([t, x, 900 * v + 300 * np.tanh(v / 0.01)]).tobytes())
    identify = ("identify", "--run", "utf_5mm4Hz_1A", "--json", "--model")
    simulate = ("simulate", "quarter-car", "--input", "kerb:height_m=0.02", "--damper", place / "model.json", "--json")
    commands = {
        "help": ("--help",),
        "rigs": ("rigs",),
        "models": ("models",),
        "model": (*identify, "rounded-coulomb"),
        "whole": (*identify, "bingham", "--method", "projection"),
        "half": (*identify, "bingham", "--method", "scaled", "--set", "share=0.5"),
        "import": ("import", place / "1A.rigx", "--out", place / "rig"),
        "check": ("check", place / "rig", "--json"),
        "export": ("export", place / "model.json", "--to", "peaks", "--out", place / "peaks.csv"),
        "firm": (*simulate, "--control", "firm-inwards", "--step", "0.00025"),  # one step: no search compiles it
    }
    words = json.dumps([[str(word) for word in command] for command in commands.values()])
    found = dict(zip(commands, json.loads(run(house, "-c", EACH, given=words)), strict=True))
    for name, done in found.items():
        assert done["returncode"] == 0, f"{name}: {done}"
    return {name: done["stdout"] + (done["stderr"] if name == "import" else "") for name, done in found.items()}, place


def test_a_model_is_listed_identified_and_kept_by_the_laws(house, said):
    told, _ = said
    assert "rounded-coulomb" in told["models"]
    (row,) = json.loads(told["model"])
    assert row["fy [N]"] > 100
    assert row["nrmse_pp"] < 0.1
    laws = run(
        house, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/models", "tests/test_streaming.py",
        "-k", "rounded-coulomb",
    )  # fmt: skip
    assert " passed" in laws or "." in laws.split()[0]


def test_a_method_is_found_with_its_settings(said):
    (whole,), (half,) = (json.loads(said[0][name]) for name in ("whole", "half"))
    assert half["c [N s/m]"] == pytest.approx(0.5 * whole["c [N s/m]"])


def test_a_reader_and_a_quality_check_take_part_in_the_import(said):
    told, place = said
    assert "W_ODD_COUNT" in told["import"]
    with (place / "rig/runs.csv").open(encoding="utf-8") as file:
        (row,) = csv.DictReader(file)
    assert float(row["current_A"]) == 1.0
    assert "W_ODD_COUNT" in told["check"]


def test_an_export_format_is_offered_and_writes(said):
    assert (said[1] / "peaks.csv").read_text().startswith("current_A,force_N\n")


def test_a_command_has_its_help_and_runs(said):
    assert "List the rigs of a dataset" in said[0]["help"]
    assert said[0]["rigs"].split() == ["labcontrol", "utfsm"]


def test_a_control_law_and_an_input_take_part_in_a_simulation(said):
    firm = json.loads(said[0]["firm"])
    assert firm["controller"] == "firm-inwards"
    assert firm["peak_force_N"] > 100
