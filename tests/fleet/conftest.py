"""A small line on disk, identified once."""

import pytest
from support.fleets import LINE

from benchmarks.synthetic_fleet import write_fleet
from mrdamper.fleet.run import run_fleet


@pytest.fixture(scope="session")
def line(tmp_path_factory):
    folder = tmp_path_factory.mktemp("line") / "records"
    write_fleet(LINE, folder)
    return folder


@pytest.fixture(scope="session")
def identified(line):
    out = line.parent / "out"
    return run_fleet(line, out, workers=1)
