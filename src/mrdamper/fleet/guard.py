"""A process that can be killed: jobs run in it, so that one that crashes, hangs or fills the memory fails alone.

Parent and child speak in lines of JSON; nothing is pickled. The child limits its own processor
time and memory, the parent its wall time and the memory of everything it started. A child that
is left with memory or processes of a job makes way for a fresh one.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mrdamper.errors import InputError

_MEMORY_CHECK_S = 0.25  # seconds between looks at the memory of a job that takes long
_KILLED_TRIES, _CRASHED_TRIES = 8, 2  # of a job whose process somebody killed, or that died by itself
_START = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from mrdamper.fleet.guarded import serve; serve()"


class JobError(InputError):
    """A job crashed, or went over its limits; the code says which."""

    code = "E_JOB_CRASH"


@dataclass(frozen=True)
class JobLimits:
    """Limits of one job."""

    cpu_s: float = 120.0
    wall_s: float = 600.0
    memory_bytes: int = 2 * 2**30  # of its process and everything that process starts


class KillableWorker:
    """Runs jobs one after the other in a process of its own."""

    def __init__(self, limits: JobLimits | None = None):
        self._limits = limits or JobLimits()
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = False

    def call(self, function: str, argument: Any) -> Any:
        """Return the result of `module:function` of an argument, both as JSON.

        A process that somebody killed is no fault of the job: it is done again.

        Raises
        ------
        JobError
            E_JOB_CRASH, E_JOB_TIME or E_JOB_MEMORY.
        InputError
            What the function raised.
        """
        killed = crashed = 0
        while True:
            answer, died = self._ask({"call": function, "argument": argument, "limits": asdict(self._limits)})
            if answer is not None:
                return _result(answer)
            if died == getattr(signal, "SIGXCPU", None):
                raise JobError(f"over {self._limits.cpu_s:g} s of processor time", code="E_JOB_TIME")
            killed += died == signal.SIGKILL
            crashed += died != signal.SIGKILL
            if self._closed or killed >= _KILLED_TRIES or crashed >= _CRASHED_TRIES:
                raise JobError(_how(died), remedy="look at its files; run it alone to see more")

    def close(self) -> None:
        """Kill the process and all it started."""
        self._closed = True
        self._kill()

    def _ask(self, request: dict[str, Any]) -> tuple[dict[str, Any] | None, int]:
        """Return the child's answer; or None, and the signal or exit status it died by."""
        if self._process is None or self._process.poll() is not None:
            self._kill()
            self._process = _start()
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        line = b""
        try:
            process.stdin.write(json.dumps(request).encode() + b"\n")
            process.stdin.flush()
            over = self._watch(process)
            if over is not None:
                self._kill()
                return {"code": over[0], "found": over[1]}, 0
            line = process.stdout.readline()
        except (OSError, ValueError):
            pass  # it died while it was written to: its exit status tells
        if not line.endswith(b"\n"):
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(5)
            died = -(process.poll() or 0)
            self._kill()
            return None, died
        answer = json.loads(line)
        if answer.pop("spent", False):
            self._kill()
        return answer, 0

    def _watch(self, process: subprocess.Popen[bytes]) -> tuple[str, str] | None:
        """Wait for an answer; which limit is broken, and how, if one is."""
        begin, answers = time.monotonic(), process.stdout.fileno()  # type: ignore[union-attr]
        while not select.select([answers], [], [], _MEMORY_CHECK_S)[0]:
            if time.monotonic() - begin > self._limits.wall_s:
                return "E_JOB_TIME", f"not done after {self._limits.wall_s:g} s"
            if sum(map(_resident, [process.pid, *descendants(process.pid)])) > self._limits.memory_bytes:
                return "E_JOB_MEMORY", f"over {self._limits.memory_bytes / 2**30:.3g} GiB of memory"
        return None

    def _kill(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        for pid in [*descendants(process.pid), process.pid]:
            with contextlib.suppress(OSError):
                os.kill(pid, signal.SIGKILL)
        with contextlib.suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
        for pipe in (process.stdin, process.stdout):
            with contextlib.suppress(OSError):
                pipe.close()  # type: ignore[union-attr]
        process.wait()


def descendants(pid: int) -> list[int]:
    """List the processes that a process started, and those that they started; empty where the system has no list."""
    processes = []
    with contextlib.suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            for child in map(int, (task / "children").read_text().split()):
                processes += [child, *descendants(child)]
    return processes


def _start() -> subprocess.Popen[bytes]:
    environment = {
        **os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1",
        "POLARS_MAX_THREADS": "1",
    }  # fmt: skip
    return subprocess.Popen(
        [sys.executable, "-c", _START, json.dumps(sys.path)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment,
        start_new_session=True,  # Ctrl-C at the terminal is for the supervisor alone
    )  # fmt: skip


def _result(answer: dict[str, Any]) -> Any:
    if "result" in answer:
        return answer["result"]
    error = JobError if answer["code"].startswith("E_JOB") else InputError
    raise error(answer["found"], where=answer.get("where", ""), remedy=answer.get("remedy", ""), code=answer["code"])


def _how(died: int) -> str:
    try:
        return f"its process ended by {signal.Signals(died).name}"
    except ValueError:
        return f"its process ended with status {-died}"


def _resident(pid: int) -> int:
    """Memory a process holds [bytes]."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, IndexError):
        return 0
