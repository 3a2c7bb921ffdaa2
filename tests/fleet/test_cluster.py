"""The same jobs on a cluster of this machine: the same bits, whatever dies."""

import json
import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from support.fleets import ROWS, planned, same_bits
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.fleet.engine import ClusterError
from mrdamper.fleet.run import run_fleet


class Cluster:
    """A scheduler and two workers on 127.0.0.1, started as `mrdamper cluster` says."""

    def __init__(self, folder, tls=None):
        self.file = folder / "scheduler.json"
        options = [] if tls is None else [
            "--tls-ca-file", f"{tls}/ca.pem", "--tls-cert", f"{tls}/cert.pem", "--tls-key", f"{tls}/key.pem",
        ]  # fmt: skip
        host = "127.0.0.1" if tls is None else "tls://127.0.0.1"
        self.scheduler = self._start("scheduler", "--host", host, "--port", "0", *options)
        # The file is created before it is filled, so workers start when it can be read.
        self.address = self._announced()
        nanny = ["--nworkers", "1", "--nthreads", "1", "--local-directory", str(folder)]
        self.workers = [self._start("worker", *nanny, *options) for _ in range(2)]

    def _announced(self):
        until = time.monotonic() + 60
        while not (self.file.exists() and self.file.read_text().rstrip().endswith("}")):
            if time.monotonic() > until:
                self.scheduler.kill()
                self.scheduler.wait()
                raise TimeoutError("the scheduler has not written its address within 60 s")
            time.sleep(0.05)
        return json.loads(self.file.read_text())["address"]

    def _start(self, what, *options):
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", "--no-dashboard"]
        return subprocess.Popen(
            [*command, "--scheduler-file", str(self.file), *options],
            stderr=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
        )

    def end(self):
        for process in (*self.workers, self.scheduler):
            process.terminate()
        for process in (*self.workers, self.scheduler):
            process.wait()


@pytest.fixture
def cluster(tmp_path):
    held = Cluster(tmp_path)
    yield held
    held.end()


def test_jobs_on_a_cluster_give_the_same_bits(line, identified, tmp_path):
    import distributed  # a second, for whoever collects it

    with distributed.LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None) as local:
        run_fleet(line, planned(identified, tmp_path / "out"), scheduler=local.scheduler_address)
    assert same_bits(tmp_path / "out") == same_bits(identified.table.parent)


def run_when_ready(source, out, cluster, **options):
    until = time.monotonic() + 60
    while True:
        try:
            return run_fleet(source, out, scheduler=cluster.address, **options)
        except ClusterError as error:
            if "no worker" not in str(error) or time.monotonic() > until:
                raise
            time.sleep(0.2)


@pytest.mark.slow
def test_a_cluster_whose_worker_is_killed_gives_the_same_bits(line, identified, tmp_path, cluster):
    killed = threading.Event()

    def progress(what, share):
        if what.startswith("3 of") and not killed.is_set():
            killed.set()
            children = subprocess.run(
                ["ps", "-o", "pid=", "--ppid", str(cluster.workers[0].pid)], capture_output=True, text=True, check=True
            )
            for pid in map(int, children.stdout.split()):
                os.kill(pid, signal.SIGKILL)

    found = run_when_ready(line, tmp_path / "out", cluster, progress=progress)
    assert killed.is_set()
    assert found.done == ROWS
    assert same_bits(tmp_path / "out") == same_bits(identified.table.parent)


@pytest.mark.slow
def test_a_lost_scheduler_is_said_and_the_rest_is_done_elsewhere(line, identified, tmp_path, cluster):
    def progress(what, share):
        if what.startswith("3 of"):
            cluster.scheduler.kill()

    with pytest.raises(ClusterError, match="what was finished is safe"):
        run_when_ready(line, tmp_path / "out", cluster, progress=progress)
    run_fleet(line, tmp_path / "out", workers=1)
    assert same_bits(tmp_path / "out") == same_bits(identified.table.parent)


def test_no_scheduler_there_is_said(line, tmp_path):
    with pytest.raises(ClusterError) as refused:
        run_fleet(line, tmp_path / "out", scheduler="tcp://127.0.0.1:9", patience=1)
    assert refused.value.code == "E_CLUSTER"


@pytest.mark.slow
def test_encrypted_as_the_command_says(line, identified, tmp_path):
    tls = tmp_path / "tls"
    tls.mkdir()
    said = CliRunner().invoke(application(), ["cluster"]).stdout
    begin = said.index("openssl")
    command = said[begin : said.index("cp tls/cert.pem")].replace("\\\n", " ")
    subprocess.run(command, shell=True, check=True, cwd=tmp_path, capture_output=True)
    (tls / "ca.pem").write_bytes((tls / "cert.pem").read_bytes())
    held = Cluster(tmp_path, tls)
    try:
        assert held.address.startswith("tls://")
        with pytest.raises(ClusterError):
            run_fleet(line, tmp_path / "open", scheduler=held.address, patience=2)
        run_when_ready(line, tmp_path / "out", held, tls=tls)
    finally:
        held.end()
    assert same_bits(tmp_path / "out") == same_bits(identified.table.parent)
