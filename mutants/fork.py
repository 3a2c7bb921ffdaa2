"""Work in forks of this process, of which only the results return."""

from __future__ import annotations

import os
import pickle
import select
import signal
from collections.abc import Callable
from typing import Any


def in_fork(work: Callable[[], Any], limit: int = 0) -> Any:
    """Result of the work; None if it did not end. A limit in seconds ends it; 0 is no limit."""
    return _result(*_start(work, limit))


def in_forks(works: list[Callable[[], Any]], jobs: int) -> list[Any]:
    """Results of the works in their order; `jobs` of them run at a time."""
    results: list[Any] = [None] * len(works)
    running: dict[int, tuple[int, int]] = {}  # reader → number and process
    waiting = list(enumerate(works))
    while waiting or running:
        while waiting and len(running) < jobs:
            number, work = waiting.pop(0)
            child, reader = _start(work)
            running[reader] = number, child
        for reader in select.select(list(running), [], [])[0]:
            number, child = running.pop(reader)
            results[number] = _result(child, reader)
    return results


def _start(work: Callable[[], Any], limit: int = 0) -> tuple[int, int]:
    """Process of the work, and the end of a pipe from which its result is read."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        signal.alarm(limit)
        answer = None
        try:
            answer = work()
        finally:
            with os.fdopen(writer, "wb") as pipe:
                pickle.dump(answer, pipe)
            os._exit(0)
    os.close(writer)
    return child, reader


def _result(child: int, reader: int) -> Any:
    with os.fdopen(reader, "rb") as pipe:
        content = pipe.read()
    os.waitpid(child, 0)
    return pickle.loads(content) if content else None
