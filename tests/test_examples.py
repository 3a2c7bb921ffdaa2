"""Examples run as they stand; a study that they ask for is that of the bundled data, made once for all tests."""

import runpy
from pathlib import Path

import pytest

from mrdamper.study import workflow

SLOW = ("07_fleet",)  # ten dampers; what it calls is tested in tests/fleet
EXAMPLES = [
    pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * (path.stem in SLOW))
    for path in sorted((Path(__file__).parent.parent / "examples").glob("*.py"))
]


@pytest.fixture
def studied_once(bundled, bundled_study, monkeypatch):
    def run_study(dataset):  # tests/rig_files/test_how_to.py studies the files of an example by the command
        known = [name for name in dataset.rigs if name in bundled.rigs]
        return workflow.Study(dataset, tuple(bundled_study.rig(name) for name in known or bundled.rigs[:1]), 0.0)

    monkeypatch.setattr(workflow, "run_study", run_study)


@pytest.mark.parametrize("path", EXAMPLES)
@pytest.mark.usefixtures("studied_once")
def test_example_runs(path, capsys):
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out.strip()
