"""The same bits whatever number of threads the linear algebra is given."""

import io
import os
import subprocess
import sys
from contextlib import redirect_stdout

import numpy as np

from mrdamper.fleet import job
from mrdamper.fleet.item import FleetError, Item
from mrdamper.statistics.linear import on_one_blas_thread, one_blas_thread

FIT = """
import hashlib
import numpy as np
from mrdamper.identification import identify
from mrdamper.rig_files.dataset_folder import load_dataset
from mrdamper.dampers.joint import JointProblem
runs = [run for run in load_dataset().rig("utfsm").split("train") if run.excitation == "sine"]
fit = JointProblem(runs, "play-bypass").fit(rounds=1, most_steps=2)
bits = [fit.point, fit.nrmse_pp]
models = [identify(run, free=free).model for run in runs[:3] for free in ((), ("gamma",))]
bits += [np.array(list(model.values().values())) for model in models]
print(hashlib.sha256(b"".join(np.ascontiguousarray(b).tobytes() for b in bits)).hexdigest())
"""


def test_one_and_two_threads_give_the_same_bits():
    """This process has one: tests/conftest.py."""
    environment = {**os.environ, "OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2"}
    done = subprocess.run([sys.executable, "-c", FIT], capture_output=True, text=True, check=True, env=environment)
    with redirect_stdout(io.StringIO()) as printed:
        exec(FIT, {})
    assert printed.getvalue() == done.stdout


def test_the_number_of_threads_is_given_back():
    np.linalg.inv(np.eye(2))
    before = _threads()
    with one_blas_thread():
        assert set(_threads()) == {1}
    assert _threads() == before
    assert set(on_one_blas_thread(_threads)()) == {1}


def test_a_job_of_a_fleet_uses_one_thread(monkeypatch):
    """Also in a worker of a cluster, whose environment may allow more."""
    from threadpoolctl import threadpool_limits

    def without_records(item, settings):
        threads.extend(_threads())
        raise FleetError("no records", where=item.name, code="E_FLEET_EMPTY", remedy="none")

    threads = []
    monkeypatch.setattr(job, "read", without_records)
    with threadpool_limits(2, "blas"):
        job.attempt(job.as_job(Item("D1"), "", job.Settings(), None))
    assert set(threads) == {1}


def _threads():
    from threadpoolctl import threadpool_info

    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


def test_without_the_library_nothing_is_held_and_nothing_fails(monkeypatch):
    from mrdamper.statistics import linear

    monkeypatch.setitem(sys.modules, "threadpoolctl", None)
    linear._controller.cache_clear()
    with one_blas_thread():
        assert linear._controller(False) is None
    linear._controller.cache_clear()
