"""Work in several processes, which end with their parent, however it ends."""

from __future__ import annotations

import gc
import signal
import sys
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import active_children
from multiprocessing.context import SpawnContext, SpawnProcess
from types import ModuleType
from typing import Any, TypeVar

from mrdamper.data.child import end_with_parent
from mrdamper.data.progress import Progress, silent
from mrdamper.discovery import in_main_script
from mrdamper.errors import ResourceError

T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True)
class Processes:
    """The current process and its pool of worker processes, if any. `several` starts the pool."""

    pool: Executor | None = None
    count: int = 1

    def map(
        self,
        function: Callable[[T, Progress], R],
        items: Sequence[T],
        progress: Progress = silent,
        weights: Sequence[float] = (),
    ) -> list[R]:
        """Return the results of a function of a module for every item, in order.

        While worker processes import, this process computes items, too, from the last to the first, as long as no other
        has begun them: the longest should be first. Weights are relative durations.
        """
        weight, last = list(weights or [1.0] * len(items)), len(items) - 1
        pending = [self.pool.submit(_quietly, function, item) for item in items[:-1]] if self.pool else []
        here: dict[int, R] = {}

        def tell(what: str, within: float) -> None:
            ended = (n in here or (n < len(pending) and _done(pending[n])) for n in range(len(items)))
            done = sum(w for w, end in zip(weight, ended, strict=True) if end)
            progress(what, (done + within) / sum(weight))

        for n in reversed(range(len(items))) if pending else range(len(items)):
            if not pending or n == last or pending[n].cancel():
                here[n] = function(items[n], lambda what, share, n=n: tell(what, weight[n] * share))
        for future in as_completed([future for future in pending if not future.cancelled()]):
            future.result()
            tell(f"{sum(map(_done, pending)) + len(here)} of {len(items)} done", 0.0)
        return [here[n] if n in here else pending[n].result() for n in range(len(items))]


IN_PROCESS = Processes()


@contextmanager
def several(count: int) -> Generator[Processes]:
    """Start `count` processes, this one included, for the length of a block; raises as `processes`.

    None are started if they would lack a class of the main script.
    """
    if count < 2 or in_main_script():
        yield IN_PROCESS
        return
    with processes(count - 1) as pool:
        yield Processes(pool, count)


def _done(future: Future[Any]) -> bool:
    return future.done() and not future.cancelled()


def _quietly(function: Callable[[T, Progress], R], item: T) -> R:
    return function(item, silent)


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
    gc.set_threshold(50_000)  # as in the parent
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the terminal sends it to all; the parent decides
    end_with_parent()
