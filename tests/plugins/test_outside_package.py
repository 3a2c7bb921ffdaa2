"""An installed package extends every part of mrdamper; a broken one is named and skipped."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.command import EACH, mrdamper

from mrdamper.rig_files.dataset_folder import save_dataset

PARTS = Path(__file__).parents[1] / "drop_in"
GROUPS = {
    "models": "models",
    "methods": "identification/methods",
    "readers": "rig_files/readers",
    "checks": "rig_files/quality",
    "exporters": "exporters",
    "controllers": "systems/controllers",
    "inputs": "systems/inputs",
    "commands": "cli/commands",
}
PROJECT = """
[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"
[project]
name = "{name}"
version = "1.0"
[tool.hatch.build.targets.wheel]
packages = ["{module}"]
"""


NO_MARK = """
from mrdamper.rig_files.readers.laboratories import ColumnList
class OurRig(ColumnList):
    name = "our-rig"
    title = "our rig"
"""
NO_LAW = """
from mrdamper.systems.controllers.base import Controller
class Brake(Controller):
    name = 'brake'
    title = "brake"
    source = "tests"
"""
FAILS = """
from mrdamper.exporters.base import Exporter
class Gas(Exporter):
    name, title = "gas", "gas force"
    def export(self, damper, name):
        return {}["gas"]
"""


def describe(source, name, entry_points):
    """Make a package of a source folder."""
    module = name.replace("-", "_")
    (source / module / "__init__.py").touch()
    text = PROJECT.format(name=name, module=module)
    for group, target in entry_points:
        text += f'[project.entry-points."mrdamper.{group}"]\n{module} = "{target}"\n'
    (source / "pyproject.toml").write_text(text)


def install(site, source):
    """Build a package and install it into a folder."""
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps", "--no-build-isolation"]
    command += ["--disable-pip-version-check", "--target", str(site), str(source)]
    subprocess.run(command, check=True, capture_output=True, env={**os.environ, "PIP_NO_CACHE_DIR": "1"})


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder of installed packages: one that extends every group, and three that cannot be used."""
    place, site = tmp_path_factory.mktemp("sources"), tmp_path_factory.mktemp("site")
    whole = place / "whole" / "rig_parts"
    for group, folder in GROUPS.items():
        shutil.copytree(
            PARTS / folder, whole / group, ignore=shutil.ignore_patterns("__pycache__", "methods", "readers")
        )
        (whole / group / "__init__.py").touch()
    describe(place / "whole", "rig-parts", [(group, f"rig_parts.{group}") for group in GROUPS])
    broken = {
        "raises": ("models", "raise RuntimeError('no licence')"),
        "takes": (
            "models",
            "from mrdamper.models.bingham import Bingham\nclass Again(Bingham):\n    name = 'bingham'\n",
        ),
        "newer": ("models", ""),
        "lacks": ("models", "Lacking = 3\n"),
        "no_mark": ("readers", NO_MARK),
        "no_check": ("checks", "def chek(view):\n    return []\n"),
        "no_law": ("controllers", NO_LAW),
        "no_name": ("controllers", NO_LAW.replace("    name = 'brake'\n", "")),
        "divides": ("checks", "def check(view):\n    return [1 / 0]\n"),
        "fails": ("exporters", FAILS),
    }
    install(site, place / "whole")
    for name, (group, code) in broken.items():  # as a package manager leaves them
        (site / name).mkdir()
        (site / name / "part.py").write_text(code)
        target = "lacks.part:Lacking" if name == "lacks" else f"{name}.part"
        facts = site / f"{name}-1.0.dist-info"
        facts.mkdir()
        requires = "Requires-Dist: mrdamper>=99\n" if name == "newer" else ""
        (facts / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n{requires}")
        (facts / "entry_points.txt").write_text(f"[mrdamper.{group}]\n{name} = {target}\n")
    return site


@pytest.fixture(scope="module")
def environment(site):
    """Variables of a process that finds the installed packages and the support of the tests."""
    places = (str(site), str(PARTS.parent), os.environ.get("PYTHONPATH", ""))
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, places))}


def run(environment, *commands, first=""):
    """Results of commands that one process runs after a program; starting one takes longer than most of them."""
    words = json.dumps([[str(word) for word in command] for command in commands])
    done = subprocess.run(
        [sys.executable, "-c", first + EACH], input=words, capture_output=True, text=True, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    return [SimpleNamespace(**one) for one in json.loads(done.stdout)]


@pytest.fixture(scope="module")
def said(environment, tmp_path_factory):
    """Results of commands with the packages installed."""
    place = tmp_path_factory.mktemp("place")
    t = np.arange(3001) / 500
    x, v = 0.01 * np.sin(2 * np.pi * t), 0.02 * np.pi * np.cos(2 * np.pi * t)
    table = np.column_stack([t, x, 900 * v + 300 * np.tanh(v / 0.01)])
    (place / "1A.rigx").write_bytes(b"RIGX" + table.tobytes())
    commands = {
        "model": ("models", "bingham"), "plugins": ("plugins", "--json"), "rigs": ("rigs",),
        "import": ("import", place / "1A.rigx", "--out", place / "rig"),
    }  # fmt: skip
    done = dict(zip(commands, run(environment, *commands.values()), strict=True))
    assert not any(one.returncode for one in done.values()), done
    return done


@pytest.fixture(scope="module")
def parts(said):
    return json.loads(said["plugins"].stdout)


def test_every_part_is_listed_with_its_package(parts):
    ours = {(part["group"], part["name"]) for part in parts if part["package"] == "rig-parts 1.0"}
    assert {group.removeprefix("mrdamper.") for group, _ in ours} == set(GROUPS)
    assert ("mrdamper.models", "rounded-coulomb") in ours


def test_a_broken_package_is_named_with_its_reason_and_skipped(said, parts):
    problems = {part["package"]: part["problem"] for part in parts if part["problem"]}
    assert "no licence" in problems["raises 1.0"]
    assert "'bingham' exists already in mrdamper" in problems["takes 1.0"]
    assert "it needs mrdamper >=99" in problems["newer 1.0"]
    assert "neither a module nor a class" in problems["lacks 1.0"]
    assert "no_mark.part.OurRig lacks mark" in problems["no_mark 1.0"]
    assert "no_check.part defines no check" in problems["no_check 1.0"]
    assert "no_law.part.Brake lacks law" in problems["no_law 1.0"]
    assert "no_name.part.Brake lacks name" in problems["no_name 1.0"]
    assert said["model"].stderr.count("is skipped") == 4
    assert "Traceback" not in said["model"].stderr


FIT = """
from mrdamper import identify, load_dataset, save_model
from mrdamper.dampers.modified import fit_modified
runs = load_dataset().rig("utfsm").split("train")[:8]
save_model(fit_modified([identify(run, "rounded-coulomb") for run in runs]).damper, {model!r})
"""


def test_an_outside_model_is_identified_saved_loaded_and_exported(environment, tmp_path):
    model = tmp_path / "model.json"
    predict = ("predict", model, "--current", 0.5, "--frequency", 2, "--amplitude", 10, "--out", tmp_path / "force.csv")
    exports = [
        ("export", model, "--to", to, "--out", tmp_path / out) for to, out in (("c", "c"), ("peaks", "peaks.csv"))
    ]
    done = run(environment, predict, *exports, first=FIT.format(model=str(model)))
    assert [one.returncode for one in done] == [0, 0, 0], done
    assert json.loads(model.read_text())["provenance"]["package of the model"] == "rig-parts 1.0"
    assert (tmp_path / "peaks.csv").read_text().startswith("current_A,force_N\n")
    refused = mrdamper(*predict)  # here the package is not installed
    assert refused.returncode == 2
    assert "rounded-coulomb" in refused.stderr
    assert "rig-parts 1.0" in refused.stderr


@pytest.mark.slow
def test_an_outside_model_is_studied(environment, tmp_path, bundled):
    runs = [run for run in bundled.rig("utfsm") if run.excitation == "sine"]
    save_dataset(bundled.only(runs[:8], name="few runs"), tmp_path / "rig")
    run(environment, ("study", tmp_path / "rig", "--model", "rounded-coulomb", "--out", tmp_path / "result"))
    saved = json.loads((tmp_path / "result" / "model.json").read_text())
    assert saved["damper"]["model"] == "rounded-coulomb"


def test_a_check_that_raises_is_named_once_and_left_aside(said):
    lines = [line for line in said["import"].stderr.splitlines() if "divides 1.0" in line]
    assert lines == ["mrdamper: part of divides 1.0 (mrdamper.checks) is skipped: ZeroDivisionError: division by zero"]


def test_an_error_in_the_code_of_a_package_names_it(environment, tmp_path):
    model = next((Path(__file__).parents[1] / "files" / "stored" / "1.6").glob("study.json"))
    command = [sys.executable, "-m", "mrdamper", "export", model, "--to", "gas", "--out", tmp_path / "gas"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 1
    assert "fails 1.0 (mrdamper.exporters) raised KeyError: 'gas', in export of fails.part, line 6" in done.stderr
    assert "Traceback" not in done.stderr


def test_an_outside_reader_check_and_command_are_used(said):
    assert "W_ODD_COUNT" in said["import"].stdout + said["import"].stderr
    assert said["rigs"].stdout.split() == ["labcontrol", "utfsm"]
