"""A small line on disk, identified once."""

import pytest

from mrdamper.fleet.generator import Line, write_fleet
from mrdamper.fleet.line import run_fleet


@pytest.fixture(scope="session")
def line(tmp_path_factory):
    folder = tmp_path_factory.mktemp("line") / "records"
    write_fleet(Line(dampers=6, sessions=2, golden=1, faults={"wrong coil": 1}, seed=3), folder)
    return folder


@pytest.fixture(scope="session")
def identified(line):
    out = line.parent / "out"
    return run_fleet(line, out, workers=1)
