"""Jobs in a process that can be killed: the child limits its own processor time and memory, the parent its wall time.

The parent also limits the memory of everything the child started. A child with memory or processes left by a job is
replaced.
"""

from __future__ import annotations

import os
import signal
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mrdamper.data.child import Answer, Child, descendants
from mrdamper.errors import InputError

_MEMORY_CHECK_S = 0.25  # seconds between looks at the memory of a job that takes long
_KILLED_TRIES, _CRASHED_TRIES = 8, 2  # of a job whose process was killed or died
_GRACE_S = 5  # in which a process has to end after its last answer


class JobError(InputError):
    """A job that crashed or exceeded its limits; the code states which."""

    code = "E_JOB_CRASH"


@dataclass(frozen=True)
class JobLimits:
    """Limits of one job."""

    cpu_s: float = 120.0
    wall_s: float = 600.0
    memory_bytes: int = 2 * 2**30  # of its process and everything that process starts


class KillableWorker:
    """Runs jobs in sequence in a child process."""

    def __init__(self, limits: JobLimits | None = None):
        self._limits = limits or JobLimits()
        self._child: Child | None = None
        self._closed = False

    def call(self, function: str, argument: Any) -> Any:
        """Return the result of `module:function` of a JSON argument; raises `JobError`, or what the function raised."""
        killed = crashed = 0
        while True:
            answer, died = self._ask({"call": function, "argument": argument, "limits": asdict(self._limits)})
            if answer is not None:
                if "result" in answer:
                    return answer["result"]
                kind = JobError if answer["code"].startswith("E_JOB") else InputError
                where, remedy = answer.get("where", ""), answer.get("remedy", "")
                raise kind(answer["found"], where=where, remedy=remedy, code=answer["code"])
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

    def _ask(self, request: Answer) -> tuple[Answer | None, int]:
        """Return the child's answer; or None, and its signal or exit status."""
        if self._child is None or not self._child.alive:
            self._kill()
            self._child = Child("mrdamper.fleet.guarded", polars_threads=1, session=True)
        child = self._child
        answer = child.ask(request, lambda: self._over(child), _GRACE_S)
        if answer is None or answer.pop("spent", False):
            self._kill()
        return answer, child.died

    def _over(self, child: Child) -> Answer | None:
        """Wait for an answer; return the limit that is exceeded, if any, and how."""
        begin = time.monotonic()
        while child.is_silent(_MEMORY_CHECK_S):
            if time.monotonic() - begin > self._limits.wall_s:
                return {"code": "E_JOB_TIME", "found": f"not done after {self._limits.wall_s:g} s"}
            if sum(map(_resident, [child.pid, *descendants(child.pid)])) > self._limits.memory_bytes:
                return {"code": "E_JOB_MEMORY", "found": f"over {self._limits.memory_bytes / 2**30:.3g} GiB of memory"}
        return None

    def _kill(self) -> None:
        child, self._child = self._child, None
        if child is not None:
            child.close()


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
