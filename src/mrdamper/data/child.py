"""A child process that answers requests and may be killed, which isolates crashes, hangs and memory.

Parent and child exchange lines of JSON, with the bytes of numbers behind them; nothing is pickled.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from multiprocessing import parent_process
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

Answer = dict[str, Any]
# It ends with its parent even while it still loads libraries, before it listens.
_START = """
import importlib, json, os, sys, threading, time

def watch(parent):
    while os.getppid() == parent:
        time.sleep(0.2)
    os._exit(0)

if os.name == "posix" and sys.argv[3]:
    threading.Thread(target=watch, args=(int(sys.argv[3]),), daemon=True).start()
sys.path[:] = json.loads(sys.argv[2])
importlib.import_module(sys.argv[1]).serve()
"""


class Child:
    """The process of a module whose `serve()` answers requests; linear algebra has one thread there.

    In a separate session Ctrl-C at the terminal does not reach it, and `serve` ends it with its parent. Otherwise it
    ends with its parent from the start.
    """

    died = 0  # signal that ended it, or minus its exit status

    def __init__(self, module: str, polars_threads: int, *, session: bool = False):
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        places = json.dumps([str(Path(place).absolute()) for place in sys.path])
        self._session = session and os.name == "posix"
        self._process = subprocess.Popen(
            [sys.executable, "-c", _START, module, places, "" if session else str(os.getpid())],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=session,
            env={**os.environ, **threads, "POLARS_MAX_THREADS": str(polars_threads)},
        )  # fmt: skip
        assert self._process.stdin is not None
        self._requests = self._process.stdin
        self._answers: Any = self._process.stdout  # typeshed does not know that it is buffered
        self.pid = self._process.pid

    @property
    def alive(self) -> bool:
        """True while the process runs."""
        return self._process.poll() is None

    def say(self, request: Answer) -> None:
        """Send a request; raises `OSError` or `ValueError` if the process has ended."""
        self._requests.write(json.dumps(request).encode() + b"\n")
        self._requests.flush()

    def is_silent(self, seconds: float) -> bool:
        """Wait for an answer; tell if there is none after some time."""
        return os.name == "posix" and not select.select([self._answers], [], [], seconds)[0]

    def ask(self, request: Answer, watch: Callable[[], Answer | None], grace: float) -> Answer | None:
        """Return the answer to a request; None if the process ended instead, within `grace` [s] after its last output.

        `watch` returns when there is an answer; another value that it returns ends the process.
        """
        line = b""
        try:
            self.say(request)
            instead = watch()
            if instead is not None:
                self.close()
                return instead
            line = self._answers.readline()
        except (OSError, ValueError):
            pass  # the pipe is broken, or was closed: the exit status shows why
        if line.endswith(b"\n"):
            return json.loads(line)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(grace)
        self.died = -(self._process.poll() or 0)
        self.close()
        return None

    def receive(self, size: int) -> np.ndarray:
        """Read the numbers that follow an answer; raises `EOFError` if they end early."""
        values = np.empty(size)
        view = values.data.cast("B")
        at = 0
        while at < len(view):
            count = self._answers.readinto(view[at:])
            if not count:
                raise EOFError
            at += count
        return values

    def kill(self) -> None:
        """Kill the process, and what it started."""
        for pid in descendants(self.pid):
            with contextlib.suppress(OSError):
                os.kill(pid, signal.SIGKILL)
        if self._session:
            with contextlib.suppress(OSError):
                os.killpg(self.pid, signal.SIGKILL)
        self._process.kill()

    def close(self) -> None:
        """Kill the process, and wait for its end."""
        self.kill()
        for pipe in (self._requests, self._answers):
            with contextlib.suppress(OSError):
                pipe.close()
        self._process.wait()


def descendants(pid: int) -> list[int]:
    """List the processes that a process started, and those that they started; empty where the system has no list."""
    processes: list[int] = []
    with contextlib.suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            for child in map(int, (task / "children").read_text().split()):
                processes += [child, *descendants(child)]
    return processes


def end_with_parent(*, group: bool = False) -> None:
    """Make a process of `multiprocessing` end with its parent, and its descendants with its group."""
    parent = parent_process()

    def watch() -> None:
        assert parent is not None
        parent.join()
        if group and hasattr(os, "killpg"):
            os.killpg(0, signal.SIGKILL)
        os._exit(1)

    if parent is not None:
        threading.Thread(target=watch, daemon=True).start()


def standard_output() -> BinaryIO:
    """Use the standard output of a child for its answers, without output of libraries."""
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    return replies


def send(replies: BinaryIO, answer: Answer, arrays: Sequence[np.ndarray] = ()) -> None:
    """Write an answer of a child, and the numbers that follow it."""
    replies.write(json.dumps(answer).encode() + b"\n")
    for array in arrays:
        replies.write(np.ascontiguousarray(array).data)
    replies.flush()


def writable_memory() -> int:
    """Memory this process may write to [bytes]; 0 where the system does not tell."""
    status = Path("/proc/self/status")
    if not status.exists():
        return 0
    return next((int(line.split()[1]) * 1024 for line in status.read_text().splitlines() if "VmData" in line), 0)
