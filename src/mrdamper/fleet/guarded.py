"""Child process of `guard`, which runs jobs that may crash it."""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import os
import queue
import signal
import sys
import threading
import traceback
from pathlib import Path
from typing import Any

from mrdamper.data.child import descendants, send, standard_output, writable_memory
from mrdamper.data.wording import number
from mrdamper.errors import InputError

_MAX_LEFTOVER_BYTES = 256 * 2**20  # bytes that jobs may leave allocated before the process is replaced
_TRACEBACK_LINES = 12  # of a traceback in an answer


def serve() -> None:
    """Answer requests until the parent closes the pipe or ends."""
    replies = standard_output()
    _adopt_orphans()
    requests: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests,), daemon=True).start()
    own, first = os.getpid(), None
    while True:
        request = json.loads(requests.get())
        answer = _answer(request)
        if os.getpid() != own:
            os._exit(0)  # a forked process of a job that returned: it must not answer
        held = writable_memory()
        first = held if first is None else first
        answer["spent"] = held - first > _MAX_LEFTOVER_BYTES or bool(_strangers())
        send(replies, answer)


def _listen(requests: queue.SimpleQueue[bytes]) -> None:
    for line in sys.stdin.buffer:
        requests.put(line)
    for pid in descendants(os.getpid()):
        with contextlib.suppress(OSError):
            os.kill(pid, signal.SIGKILL)
    os._exit(0)


def _answer(request: dict[str, Any]) -> dict[str, Any]:
    module, _, name = request["call"].partition(":")
    limits = request["limits"]
    try:
        function = getattr(importlib.import_module(module), name)
        _limit(limits["cpu_s"], limits["memory_bytes"])
        try:
            return {"result": function(request["argument"])}
        finally:
            _limit(None, None)
    except InputError as error:
        return {"code": error.code, "found": error.found, "where": error.where, "remedy": error.remedy}
    except MemoryError:
        gc.collect()
        return {"code": "E_JOB_MEMORY", "found": f"over {number(limits['memory_bytes'] / 2**30, 3)} GiB of memory"}
    except Exception:
        text = "".join(traceback.format_exc().splitlines(keepends=True)[-_TRACEBACK_LINES:])
        return {"code": "E_JOB_FAULT", "found": text.strip(), "remedy": "internal error; please report it"}


def _limit(seconds: float | None, size: int | None) -> None:
    """Limit further processor time, beyond which the system ends the process, and written memory; None lifts both."""
    if sys.platform == "win32":
        return
    import resource

    used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    until = None if seconds is None else int(used + seconds) + 1
    for what, most in ((resource.RLIMIT_CPU, until), (resource.RLIMIT_DATA, size)):
        hard = resource.getrlimit(what)[1]
        resource.setrlimit(what, (hard if most is None else most, hard))


def _strangers() -> list[int]:
    """List the processes a job left behind, without the one that reads rig files."""
    processes = []
    for pid in descendants(os.getpid()):
        with contextlib.suppress(OSError):
            if b"sandbox_worker" not in Path(f"/proc/{pid}/cmdline").read_bytes():
                processes.append(pid)
    return processes


def _adopt_orphans() -> None:
    """Make processes whose parent ended children of this process, on Linux."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(36, 1, 0, 0, 0)  # PR_SET_CHILD_SUBREAPER
