"""Worker processes that end with their parent, however it ends."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Generator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children
from multiprocessing.context import SpawnContext, SpawnProcess
from types import ModuleType
from typing import Any

from mrdamper.data.child import end_with_parent
from mrdamper.errors import ResourceError


@contextmanager
def processes(count: int) -> Generator[ProcessPoolExecutor]:
    """Yield a pool of processes; an exception in the block, and the end of this process, end them at once.

    Raises `ResourceError` (E_WORKER) if a process was ended from outside, as by a system short of memory.
    """
    pool = ProcessPoolExecutor(count, SPAWNED, initializer=_begin)
    try:
        yield pool
        pool.shutdown()
    except BaseException as error:
        for child in active_children():
            child.kill()
        pool.shutdown(wait=False, cancel_futures=True)
        if isinstance(error, BrokenProcessPool):
            raise ResourceError(
                "a worker process was ended from outside",
                remedy="close other programs, raise the memory limit, or take fewer runs or processes",
                code="E_WORKER",
            ) from error
        raise


class _Process(SpawnProcess):
    """Spawned, not forked: a fork of a process whose libraries run threads can hang.

    A spawned process imports the main script, and a script without a guard would run again in each. Functions for the
    processes are in modules, so the main script is hidden from them.
    """

    _lock = threading.Lock()

    @staticmethod
    def _Popen(process_obj: Any) -> Any:
        with _Process._lock:
            script = sys.modules["__main__"]
            sys.modules["__main__"] = ModuleType("__main__")
            try:
                return SpawnProcess._Popen(process_obj)  # pyright: ignore[reportAttributeAccessIssue]
            finally:
                sys.modules["__main__"] = script


class _Context(SpawnContext):
    Process = _Process


SPAWNED = _Context()  # starts such processes


def _begin() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the terminal sends it to all; the parent decides
    end_with_parent()
