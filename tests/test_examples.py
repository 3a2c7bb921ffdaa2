"""Examples run as they stand; a study that they ask for is that of the bundled data, made once for all tests."""

import runpy
from pathlib import Path

import pytest

SLOW = ("07_fleet",)  # ten dampers; what it calls is tested in tests/fleet
EXAMPLES = [
    pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * (path.stem in SLOW))
    for path in sorted((Path(__file__).parent.parent / "examples").glob("*.py"))
]


@pytest.mark.parametrize("path", EXAMPLES)
@pytest.mark.usefixtures("studied_once")
def test_example_runs(path, capsys):
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out.strip()
