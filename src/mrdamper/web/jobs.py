"""Long work in a process of its own: told apart, watched, and stopped when nobody wants it.

The page stays answered while a study runs, and a cancelled one costs nothing more. A task is
a module-level function `task(tell, *arguments)` of `tasks.py`; `tell(what, share)` reports.
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

_AT_ONCE = max(1, os.cpu_count() or 1)  # processes of all sessions together
_NICENESS = 15  # of workers, so that the page is answered first
_BETWEEN = 0.05  # seconds between two reports: a page shows no more
_FREE = threading.BoundedSemaphore(_AT_ONCE)


@dataclass(eq=False)
class Job:
    """One piece of long work."""

    key: str  # made by the session
    kind: str  # what it is about
    task: Callable[..., Any]
    arguments: tuple[Any, ...]
    conclude: Callable[[Any], dict[str, Any]]
    recall: Callable[[], Any] = lambda: None  # a result that is known already, asked for when it is this work's turn
    # "waiting", "running", "done", "refused" (by the input), "failed" (our fault) or "cancelled"
    state: str = "waiting"
    what: str = "waiting for a free processor"  # is being done
    share: float = 0.0  # of it that is done, 0...1
    error: dict[str, str] | None = None  # as the page shows it
    answer: dict[str, Any] | None = None  # what the page is told at the end
    began: float = field(default_factory=time.monotonic)
    seconds: float = 0.0
    _process: Any = None
    _thread: threading.Thread | None = None
    _stop: threading.Event = field(default_factory=threading.Event)
    _starting: threading.Lock = field(default_factory=threading.Lock)

    def start(self) -> Job:
        """Begin; returns at once."""
        self._thread = threading.Thread(target=self._watch, name=f"bench-{self.kind}", daemon=True)
        self._thread.start()
        return self

    def wait(self, seconds: float) -> None:
        """Until it has ended, but no longer than so."""
        if self._thread is not None:
            self._thread.join(seconds)

    @property
    def ended(self) -> bool:
        """True once the work has ended."""
        return self.state not in ("waiting", "running")

    def cancel(self) -> None:
        """Stop the process; harmless where it has ended."""
        self._stop.set()
        with self._starting:  # one that is half started cannot be ended, and would complain when left alone
            if self._process is not None and self._process.is_alive():
                _end_group(self._process)

    def report(self) -> dict[str, Any]:
        """Return the state of the work as the page shows it."""
        seconds = self.seconds if self.ended else time.monotonic() - self.began
        return {
            "key": self.key,
            "kind": self.kind,
            "state": self.state,
            "what": self.what,
            "share": round(self.share, 4),
            "seconds": round(seconds, 1),
            "error": self.error,
            "answer": self.answer,
        }

    def _watch(self) -> None:
        while not _FREE.acquire(timeout=0.1):
            if self._stop.is_set():
                self._end("cancelled")
                return
        try:
            if self._stop.is_set():
                self._end("cancelled")
            elif (result := self.recall()) is not None:
                self._conclude(result)
            else:
                self._run()
        except Exception:
            self._fail(traceback.format_exc())  # a page waits for this: say how it ended
        finally:
            _FREE.release()

    def _run(self) -> None:
        self.state, self.what = "running", "starting"
        here, there = SPAWNED.Pipe(duplex=False)
        with self._starting:
            self._process = SPAWNED.Process(target=_work, args=(there, self.task, self.arguments))
            self._process.start()
        there.close()
        if self._stop.is_set():  # cancelled while it was being started
            _end_group(self._process)
        try:
            self._listen(here)
        finally:
            here.close()
            self._process.join()
            with self._starting:  # its descriptors would stay for as long as the report is kept
                self._process.close()
                self._process = None

    def _listen(self, here: Connection) -> None:
        while True:
            try:
                kind, *content = here.recv()
            except EOFError:
                if self._stop.is_set():
                    return self._end("cancelled")
                return self._lose()
            if kind == "tell":
                self.what, self.share = content
            elif kind == "done":
                return self._conclude(content[0])
            elif kind == "refused":
                self.error = content[0]
                return self._end("refused")
            else:
                return self._fail(content[0])

    def _conclude(self, result: Any) -> None:
        if self._stop.is_set():
            return self._end("cancelled")
        try:
            self.answer = self.conclude(result)
        except Exception:
            return self._fail(traceback.format_exc())
        self.share = 1.0
        return self._end("done")

    def _lose(self) -> None:
        """Report a worker that ended without a result: the system or a user ended it."""
        self._process.join()
        code = self._process.exitcode
        how = f"by signal {-code}" if code and code < 0 else f"with code {code}"
        lost = InputError(
            f"the worker process was ended from outside, {how}",
            remedy="start it again; where memory ran short, close other programs or take fewer runs",
            code="E_WORKER",
        )
        self.error = refusal(lost)
        self._end("failed")

    def _fail(self, trace: str) -> None:
        print(trace, flush=True)
        self.error = {
            "text": "The work stopped on an error of ours, not yours. The terminal shows the details.",
            "code": "E_OURS",
        }
        self._end("failed")

    def _end(self, state: str) -> None:
        self.seconds = time.monotonic() - self.began
        self.state = state  # last: whoever sees it finds the rest in place


def refusal(error: InputError) -> dict[str, str]:
    """Return an error of the input in the parts the page shows."""
    return {"text": str(error), "found": error.found, "where": error.where, "remedy": error.remedy, "code": error.code}


def _end_group(process: Any) -> None:
    """End a worker and the processes it started; a task may run a pool of its own."""
    try:
        os.killpg(process.pid, signal.SIGTERM)
    except (AttributeError, ProcessLookupError, PermissionError):
        process.terminate()  # no process groups here, or not yet one of its own


def _work(pipe: Connection, task: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    """Run a task and send what comes of it: the body of the worker process."""
    if hasattr(os, "setsid"):
        os.setsid()  # a group of its own, so that cancelling reaches the processes a task starts
        os.nice(_NICENESS)
    end_with_parent(group=True)
    last = 0.0

    def tell(what: str, share: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last > _BETWEEN:
            last = now
            pipe.send(("tell", what, float(share)))

    try:
        pipe.send(("done", task(tell, *arguments)))
    except InputError as error:
        pipe.send(("refused", refusal(error)))
    except (BrokenPipeError, KeyboardInterrupt):
        return  # the bench has gone
    except Exception:
        pipe.send(("failed", traceback.format_exc()))
