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

HERE, ROOT = Path(__file__).parent, Path(__file__).parents[2]
DROPPED = [path.relative_to(HERE) for path in HERE.rglob("*.py") if path != Path(__file__)]


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    """A copy of the project with a new file in every room that takes one."""
    copy = tmp_path_factory.mktemp("house")
    for part in ("src", "tests"):
        shutil.copytree(ROOT / part, copy / part, ignore=shutil.ignore_patterns("__pycache__", "drop_in"))
    shutil.copy(ROOT / "pyproject.toml", copy)
    for path in DROPPED:
        assert not (ROOT / "src/mrdamper" / path).exists(), f"{path} would replace a file of the house"
        shutil.copy(HERE / path, copy / "src/mrdamper" / path)
    return copy


def run(house, *arguments):
    environment = {**os.environ, "PYTHONPATH": str(house / "src")}
    done = subprocess.run(
        [sys.executable, "-m", *map(str, arguments)],
        cwd=house, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done


def mrdamper(house, *arguments):
    return run(house, "mrdamper.cli", *arguments)


def test_a_model_is_listed_identified_and_kept_by_the_laws(house):
    assert "rounded-coulomb" in mrdamper(house, "models").stdout
    (row,) = json.loads(
        mrdamper(house, "identify", "--run", "utf_5mm4Hz_1A", "--model", "rounded-coulomb", "--json").stdout
    )
    assert row["fy [N]"] > 100
    assert row["nrmse_pp"] < 0.1
    laws = run(
        house,
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "tests/models",
        "tests/test_streaming.py",
        "-k",
        "rounded-coulomb",
    )
    assert " passed" in laws.stdout or "." in laws.stdout.split()[0]


def test_a_method_is_found_with_its_settings(house):
    chosen = ("identify", "--run", "utf_5mm4Hz_1A", "--model", "bingham", "--json", "--method")
    (whole,) = json.loads(mrdamper(house, *chosen, "projection").stdout)
    (half,) = json.loads(mrdamper(house, *chosen, "scaled", "--set", "share=0.5").stdout)
    assert half["c [N s/m]"] == pytest.approx(0.5 * whole["c [N s/m]"])


def test_a_reader_and_a_quality_check_take_part_in_the_import(house, tmp_path):
    t = np.arange(3001) / 500
    x = 0.01 * np.sin(2 * np.pi * t)
    v = 0.02 * np.pi * np.cos(2 * np.pi * t)
    (tmp_path / "1A.rigx").write_bytes(b"RIGX" + np.column_stack([t, x, 900 * v + 300 * np.tanh(v / 0.01)]).tobytes())
    done = mrdamper(house, "import", tmp_path / "1A.rigx", "--out", tmp_path / "rig")
    assert "W_ODD_COUNT" in done.stdout + done.stderr
    with (tmp_path / "rig/runs.csv").open(encoding="utf-8") as file:
        (run_,) = csv.DictReader(file)
    assert float(run_["current_A"]) == 1.0
    assert "W_ODD_COUNT" in mrdamper(house, "check", tmp_path / "rig", "--json").stdout


def test_an_export_format_is_offered_and_writes(house, tmp_path):
    script = (
        "from support.dampers import joint_damper\nfrom mrdamper.files.model_file import save_model\n"
        f"save_model(joint_damper(), {str(tmp_path / 'model.json')!r})"
    )
    environment = {**os.environ, "PYTHONPATH": f"{house / 'src'}{os.pathsep}{house / 'tests'}"}
    subprocess.run([sys.executable, "-c", script], env=environment, check=True, cwd=house / "tests")
    mrdamper(house, "export", tmp_path / "model.json", "--to", "peaks", "--out", tmp_path / "peaks.csv")
    assert (tmp_path / "peaks.csv").read_text().startswith("current_A,force_N\n")


def test_a_command_has_its_help_and_runs(house):
    assert "List the rigs of a dataset" in mrdamper(house, "--help").stdout
    assert mrdamper(house, "rigs").stdout.split() == ["labcontrol", "utfsm"]


def test_a_control_law_and_an_input_take_part_in_a_simulation(house, tmp_path):
    script = (
        "from support.dampers import joint_damper\nfrom mrdamper.files.model_file import save_model\n"
        f"save_model(joint_damper(), {str(tmp_path / 'model.json')!r})"
    )
    environment = {**os.environ, "PYTHONPATH": f"{house / 'src'}{os.pathsep}{house / 'tests'}"}
    subprocess.run([sys.executable, "-c", script], env=environment, check=True, cwd=house / "tests")
    chosen = ("simulate", "quarter-car", "--input", "kerb:height_m=0.02", "--damper", tmp_path / "model.json", "--json")
    soft = json.loads(mrdamper(house, *chosen).stdout)
    found = json.loads(mrdamper(house, *chosen, "--control", "firm-inwards").stdout)
    assert found["controller"] == "firm-inwards"
    assert found["peak_force_N"] > soft["peak_force_N"]
