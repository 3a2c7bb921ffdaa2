"""What a script may import: one list, and the names of version 0.1 under where they stand now."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import mrdamper
from mrdamper.discovery import MOVED


def test_the_list_the_types_and_the_homes_agree():
    tree = ast.parse(Path(mrdamper.__file__).read_text(encoding="utf-8"))
    block = next(n for n in tree.body if isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING")
    typed = {a.name: n.module for n in block.body for a in n.names}
    assert typed == {name: f"mrdamper.{home}" for name, home in mrdamper._HOME.items()}
    assert mrdamper.__all__ == sorted(typed)
    for name in mrdamper.__all__:
        assert getattr(mrdamper, name) is not None


@pytest.mark.parametrize("old", sorted(MOVED))
def test_a_module_of_version_0_1_is_found_and_is_the_new_one(old):
    new = importlib.import_module(f"mrdamper.{MOVED[old]}")
    sys.modules.pop(f"mrdamper.{old}", None)
    with pytest.warns(FutureWarning, match=f"mrdamper.{old} is now mrdamper.{MOVED[old]}"):
        assert importlib.import_module(f"mrdamper.{old}") is new
    assert new.__spec__.name == f"mrdamper.{MOVED[old]}"


def test_a_script_of_version_0_1_runs_and_is_told_once():
    script = (
        "import mrdamper\n"
        "from mrdamper.workflow import run_study\n"
        "for _ in range(3): from mrdamper.workflow import run_study as again; mrdamper.workflow\n"
        "from mrdamper.io.dataset import load_dataset\n"
        "assert run_study is mrdamper.run_study and load_dataset is mrdamper.load_dataset\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stderr.count("mrdamper.workflow is now mrdamper.study.workflow") == 1
    assert done.stderr.count("mrdamper.io.dataset is now mrdamper.files.dataset") == 1


def test_a_name_that_never_was_is_still_missing():
    with pytest.raises(AttributeError, match="no attribute 'workflows'"):
        _ = mrdamper.workflows
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("mrdamper.workflows")
