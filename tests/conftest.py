"""What tests share: the bundled data and the vectors."""

import json
import os
from pathlib import Path

# Small matrices, few cores: threads of the linear algebra would wait for each other.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import pytest
from support.browser import launched

from mrdamper.data import Condition
from mrdamper.files.dataset import load_dataset


def pytest_collection_modifyitems(items):
    """The study is computed by one process of several, which runs all that look at it."""
    for item in items:
        if "bundled_study" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.xdist_group("study"))


@pytest.fixture(scope="session")
def bundled():
    return load_dataset()


@pytest.fixture(scope="session")
def vectors():
    return json.loads((Path(__file__).parent / "vectors.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def bundled_study(bundled):
    """The whole method on the bundled data, computed once: ten seconds."""
    from mrdamper.study.workflow import run_study

    return run_study(bundled)


@pytest.fixture
def condition():
    return Condition(1.0, 1.0, 0.02)


@pytest.fixture(scope="session")
def browser():
    """One browser for all tests: two drivers in one process wait for each other."""
    with launched() as browser:
        yield browser
