"""Worker processes end with the one that started them, however that ends."""

import gc
import os
import signal
import subprocess
import sys
import time

import pytest
from web.processes import alive

from mrdamper.errors import ResourceError
from mrdamper.study.processes import processes

# A script as people write it, without a guard: the processes must not run it again.
PARENT = """
import os, time
from mrdamper.study.processes import processes
with processes(2) as pool:
    tasks = [pool.submit(os.getpid), pool.submit(os.getpid), *(pool.submit(time.sleep, 60) for _ in range(6))]
    tasks[1].result()
    print(*pool._processes, flush=True)
    if {fault}:
        raise KeyError("a fault")
    tasks[-1].result()
"""


@pytest.mark.skipif(os.name != "posix", reason="kills as POSIX knows them")
@pytest.mark.parametrize("fault", [False, True], ids=["killed", "an error"])
def test_workers_are_gone_when_their_parent_is(tmp_path, fault):
    (tmp_path / "parent.py").write_text(PARENT.format(fault=fault))
    command = [sys.executable, tmp_path / "parent.py"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        workers = [int(word) for word in process.stdout.readline().split()]
        assert len(workers) == 2
        if not fault:
            process.send_signal(signal.SIGKILL)
        assert process.wait(timeout=20) == (1 if fault else -signal.SIGKILL)
    deadline = time.monotonic() + 10
    while any(map(alive, workers)) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not any(map(alive, workers))


def test_a_worker_collects_garbage_as_rarely_as_the_command_line():
    with processes(1) as pool:
        assert pool.submit(gc.get_threshold).result()[0] == 50_000


def test_a_worker_that_dies_is_said_with_a_code():
    with pytest.raises(ResourceError, match="E_WORKER"), processes(1) as pool:
        pool.submit(os._exit, 3).result()
