"""What tests share: the bundled data and the vectors."""

import base64
import gc
import json
import os
import shutil
import sys
import tempfile
from functools import cache
from pathlib import Path

# Small matrices, few cores: threads of the linear algebra would wait for each other.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# Two processes read the same test files and start many commands: what one has compiled the others load.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# Tests write, synchronise and delete many small files, a seventh of their time on a disk: where the memory has room
# for them they are written there.
_memory = Path("/dev/shm")
if "TMPDIR" not in os.environ and os.access(_memory, os.W_OK) and shutil.disk_usage(_memory).free > 4 << 30:
    os.environ["TMPDIR"] = tempfile.tempdir = str(_memory)

# What is imported and collected stays for good: looking through it again and again for what is rubbish is a fifth of
# the time of small tests.
gc.disable()

import pytest
import typer.main
from support.browser import LOGO, WIDE, launched

from mrdamper.data import Condition
from mrdamper.rig_files.dataset_folder import load_dataset

# A command line is built from the signatures of all its commands, which takes longer than many a command.
typer.main.get_command = cache(typer.main.get_command)

# One process of several runs the files of a group, as they share what is dear to make; every other file is a group
# of its own. The marks of pytest-xdist do not reach its scheduler under pytest 9.
GROUPS = {
    "study": (
        "report/test_pictures.py", "report/test_summary.py", "study/test_workflow.py",
        "study/test_contradictions.py::test_no_run_of_a_bundled", "test_docs.py::test_the_", "test_examples.py",
        "test_numbers.py", "test_public_names.py",
    ),
    "fleet": ("fleet/",),
    "fmu": ("export/test_fmu",),
}  # fmt: skip


def group_of(nodeid):
    inside = nodeid.removeprefix("tests/")
    return next((name for name, those in GROUPS.items() if inside.startswith(those)), inside.partition("::")[0])


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Whole groups go to a process, whatever --dist says."""
    from xdist.scheduler import LoadScopeScheduling

    class ByGroup(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            return group_of(nodeid)

    return ByGroup(config, log)


def pytest_collection_modifyitems(items):
    """The study of the bundled data is computed once: what looks at it is of that group."""
    looking = {item.nodeid for item in items if "bundled_study" in getattr(item, "fixturenames", ())}
    strange = sorted(nodeid for nodeid in looking if group_of(nodeid) != "study")
    if strange:
        raise pytest.UsageError(f"look at the study outside its group in tests/conftest.py: {strange}")


def pytest_collection_finish():
    gc.freeze()
    gc.set_threshold(50_000, 20, 100)  # young objects of numerical tests hold no circles: a twentieth of their time
    gc.enable()


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
def studied_once(bundled_study, monkeypatch):
    """A study that an example or a page asks for is that of the bundled data; test_how_to.py makes its own."""
    from mrdamper.study import workflow

    def run_study(dataset, *others, **options):
        ours = {rig.rig: rig for rig in bundled_study.rigs}
        rigs = tuple(ours[name] for name in dataset.rigs if name in ours)
        return workflow.Study(dataset, rigs or (ours["utfsm"],), 0.0)

    monkeypatch.setattr(workflow, "run_study", run_study)


@pytest.fixture(scope="session")
def written(bundled_study, tmp_path_factory):
    """Its report with everything in it, made once."""
    from mrdamper.report.about import About, logo_of
    from mrdamper.report.study import write_study

    folder = tmp_path_factory.mktemp("report") / "out"
    logo = logo_of(base64.b64encode(LOGO).decode())
    write_study(
        bundled_study, folder, about=About(title="A report", maker=WIDE, notes="Notes. " * 60, logo=logo), also=("pdf",)
    )
    return folder


@pytest.fixture
def one_platform(monkeypatch):
    """FMUs carry a binary for this machine alone: a cross compiler builds a C library for each of the others first."""
    from mrdamper.exporters import fmu
    from mrdamper.exporters.toolchain import here

    monkeypatch.setattr(fmu, "PLATFORMS", tuple(filter(None, [here()])))


@pytest.fixture
def condition():
    return Condition(1.0, 1.0, 0.02)


@pytest.fixture(scope="session")
def browser():
    """One browser for all tests: two drivers in one process wait for each other."""
    with launched() as browser:
        yield browser
