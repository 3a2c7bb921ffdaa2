"""Worker processes that end with the one that started them, however that ends."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from typing import Any

from mrdamper.errors import ResourceError


@contextmanager
def processes(
    count: int, begin: Callable[..., None] | None = None, arguments: tuple[Any, ...] = ()
) -> Iterator[ProcessPoolExecutor]:
    """A pool of processes; an exception in the block ends them at once, the death of this process too.

    Parameters
    ----------
    count : int
    begin : callable, optional
        Called first in each process, with `arguments`.

    Raises
    ------
    ResourceError
        E_WORKER if a process was ended from outside, as systems do that run short of memory.
    """
    # Spawned, not forked: a fork of a process whose libraries run threads can hang.
    pool = ProcessPoolExecutor(count, get_context("spawn"), initializer=_begin, initargs=(begin, arguments))
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
                mend="close other programs, raise the memory limit, or take fewer runs or processes",
                code="E_WORKER",
            ) from error
        raise


def _begin(begin: Callable[..., None] | None, arguments: tuple[Any, ...]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the terminal sends it to all; the parent decides
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if begin is not None:
        begin(*arguments)


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
