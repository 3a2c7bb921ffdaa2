"""Jobs: long work in a process of its own, with progress, that ends when it is cancelled.

A job calls `task(progress=progress)`, a module-level function or `partial` of one; `progress(step, share)` reports.
"""

from __future__ import annotations

import os
import signal
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any

from mrdamper.data.child import end_with_parent
from mrdamper.errors import InputError
from mrdamper.study.processes import SPAWNED

_MAX_PROCESSES = max(1, os.cpu_count() or 1)  # of all sessions together
_NICENESS = 5  # of workers: the page has priority, and other work on the machine leaves them a share
_REPORT_INTERVAL_S = 0.05
_FREE = threading.BoundedSemaphore(_MAX_PROCESSES)


@dataclass(eq=False)
class Job:
    """A task in a worker process."""

    key: str
    kind: str
    task: Callable[..., Any]
    conclude: Callable[[Any], dict[str, Any]]  # stores the result of the task, and returns that for the page
    stored: Callable[[], Any] = lambda: None  # an earlier result of the same task, looked up when it is this job's turn
    state: str = "waiting"  # or "running", "done", "refused" (invalid input), "failed" (internal error), "cancelled"
    step: str = "waiting for a free processor"
    share: float = 0.0  # completed, 0...1
    error: dict[str, str] | None = None
    result: dict[str, Any] | None = None  # for the page
    began: float = field(default_factory=time.monotonic)
    seconds: float = 0.0
    _process: Any = None
    _thread: threading.Thread | None = None
    _stop: threading.Event = field(default_factory=threading.Event)
    _starting: threading.Lock = field(default_factory=threading.Lock)

    def start(self) -> Job:
        """Begin; returns at once."""
        self._thread = threading.Thread(target=self._follow, name=f"job-{self.kind}", daemon=True)
        self._thread.start()
        return self

    def wait(self, seconds: float) -> None:
        """Wait for the end, no longer than some time."""
        if self._thread is not None:
            self._thread.join(seconds)

    @property
    def ended(self) -> bool:
        """True once the job has ended."""
        return self.state not in ("waiting", "running")

    def cancel(self) -> None:
        """Stop the process; harmless after its end."""
        self._stop.set()
        with self._starting:  # a process can be ended only after its start is complete
            if self._process is not None and self._process.is_alive():
                _end_group(self._process)

    def report(self) -> dict[str, Any]:
        """Return the state of the job for the page."""
        seconds = self.seconds if self.ended else time.monotonic() - self.began
        shown = {name: getattr(self, name) for name in ("key", "kind", "state", "step", "error", "result")}
        return {**shown, "share": round(self.share, 4), "seconds": round(seconds, 1)}

    def _follow(self) -> None:
        while not _FREE.acquire(timeout=0.1):
            if self._stop.is_set():
                return self._end("cancelled")
        try:
            if self._stop.is_set():
                self._end("cancelled")
            elif (result := self.stored()) is not None:
                self._conclude(result)
            else:
                self._run()
        except Exception:
            self._fail(traceback.format_exc())  # the page waits for an end
        finally:
            _FREE.release()

    def _run(self) -> None:
        self.state, self.step = "running", "starting"
        reports, sender = SPAWNED.Pipe(duplex=False)
        with self._starting:
            self._process = SPAWNED.Process(target=_work, args=(sender, self.task))
            self._process.start()
        sender.close()
        if self._stop.is_set():  # cancelled during the start
            _end_group(self._process)
        try:
            self._receive(reports)
        finally:
            reports.close()
            self._process.join()
            with self._starting:  # its descriptors would stay open as long as the report is kept
                self._process.close()
                self._process = None

    def _receive(self, reports: Connection) -> None:
        while True:
            try:
                kind, *content = reports.recv()
            except EOFError:
                return self._end("cancelled") if self._stop.is_set() else self._report_lost_worker()
            if kind == "progress":
                self.step, self.share = content
            elif kind == "done":
                return self._conclude(content[0])
            elif kind == "refused":
                return self._end("refused", content[0])
            else:
                return self._fail(content[0])

    def _conclude(self, result: Any) -> None:
        if self._stop.is_set():
            return self._end("cancelled")
        try:
            self.result = self.conclude(result)
        except Exception:
            return self._fail(traceback.format_exc())
        self.share = 1.0
        return self._end("done")

    def _report_lost_worker(self) -> None:
        self._process.join()
        code = self._process.exitcode
        how = f"by signal {-code}" if code and code < 0 else f"with code {code}"
        remedy = "start it again; where memory ran short, close other programs or take fewer runs"
        error = InputError(f"the worker process was ended from outside, {how}", remedy=remedy, code="E_WORKER")
        self._end("failed", error_parts(error))

    def _fail(self, trace: str) -> None:
        print(trace, flush=True)
        text = "The job stopped on an internal error (please report); the details are in the terminal."
        self._end("failed", {"text": text, "code": "E_INTERNAL"})

    def _end(self, state: str, error: dict[str, str] | None = None) -> None:
        self.error, self.seconds = error, time.monotonic() - self.began
        self.state = state  # last: whoever sees it finds the rest in place


def error_parts(error: InputError) -> dict[str, str]:
    """Return an error of the input in the parts that the page shows."""
    return {"text": str(error), "found": error.found, "where": error.where, "remedy": error.remedy, "code": error.code}


def _end_group(process: Any) -> None:
    """End a worker and the processes it started, as a task may run a pool of its own."""
    try:
        os.killpg(process.pid, signal.SIGTERM)
    except (AttributeError, ProcessLookupError, PermissionError):
        process.terminate()  # no process groups on this system, or the worker has none yet


def _work(pipe: Connection, task: Callable[..., Any]) -> None:
    if hasattr(os, "setsid"):
        os.setsid()  # a group of its own, so that cancelling ends the processes of the task too
        os.nice(_NICENESS)
    end_with_parent(group=True)
    last = 0.0

    def progress(step: str, share: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last > _REPORT_INTERVAL_S:
            last = now
            pipe.send(("progress", step, float(share)))

    try:
        pipe.send(("done", task(progress=progress)))
    except InputError as error:
        pipe.send(("refused", error_parts(error)))
    except (BrokenPipeError, KeyboardInterrupt):
        return  # the app has ended
    except Exception:
        pipe.send(("failed", traceback.format_exc()))
