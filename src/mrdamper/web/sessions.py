"""Sessions: the data, dampers, jobs and files of each open page.

A session's name is made here and cannot be guessed; whoever knows it may use it. Its files
live in a folder of its own that goes with it.
"""

from __future__ import annotations

import secrets
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Protocol, TypeVar

from fastapi import Depends, Request

from mrdamper.dampers.base import Damper
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.data import Dataset
from mrdamper.data.temporary import temporary_folder
from mrdamper.errors import InputError, UnknownNameError
from mrdamper.study.recipe import RecipeResult
from mrdamper.web.bundled_studies import BundledStudies
from mrdamper.web.imported_data import bundled
from mrdamper.web.jobs import Job
from mrdamper.web.rig_table import RigTable, rig_table
from mrdamper.web.uploads import ImportedData, Upload

IDLE_SECONDS = 12 * 3600  # a page that is open says so every minute; a closed one is forgotten after this
MOST_SESSIONS = 64
MOST_DAMPERS = 200
_NAME_BYTES = 16
_LAST_WAIT = 10.0  # seconds for workers to end when the bench stops


class _Cached(Protocol):
    def cache_clear(self) -> None: ...


_SHARED: list[_Cached] = []
_C = TypeVar("_C", bound=_Cached)


def shared(cached: _C) -> _C:
    """Drop the results of a cached function, which all sessions share, when no session is left."""
    _SHARED.append(cached)
    return cached


@dataclass(frozen=True, eq=False)
class Bench:
    """A damper on the bench."""

    key: str  # made here
    damper: Damper
    origin: str  # how it came: "study", "identification", "comparison", "file"
    note: str = ""  # one line on its errors, or where it came from
    error: float | None = None  # median force error in cross-validation [-]; None where none was calculated
    selected: bool = False  # a study selected it for its rig
    # gives the damper with its covariance, where it has none yet and its runs are known
    learn: Callable[[], Damper] | None = None


@dataclass(eq=False)
class Session:
    """State of one page on this side: data, dampers, jobs, files."""

    name: str
    folder: Path
    seen: float = field(default_factory=time.monotonic)
    imported: ImportedData | None = None
    uploads: dict[str, Upload] = field(default_factory=dict)
    dampers: dict[str, Bench] = field(default_factory=dict)
    jobs: dict[str, Job] = field(default_factory=dict)
    newest: dict[str, Job] = field(default_factory=dict)  # of each kind, on the data of now
    results: dict[str, Any] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)
    _count: int = 0

    def key(self, kind: str) -> str:
        """Return a name for something new; never taken from outside."""
        with self.lock:
            self._count += 1
            return f"{kind}{self._count}"

    @property
    def dataset(self) -> Dataset:
        """The data on the bench; raises `InputError` if there is none yet."""
        if self.imported is None:
            raise InputError("no data on the bench", remedy="open the bundled tests, or drop files", code="E_NO_DATA")
        return self.imported.dataset

    @property
    def bundled(self) -> bool:
        """True where the data are the bundled tests as they are."""
        return self.imported is not None and self.imported.source == "bundled" and self.dataset is bundled().dataset

    def result(self, name: str, problem: str, remedy: str) -> Any:
        """Return the result of work under a name; raises `InputError` (E_NO_RESULT) where it left nothing."""
        if not self.results.get(name):
            raise InputError(problem, remedy=remedy, code="E_NO_RESULT")
        return self.results[name]

    def put(self, imported: ImportedData) -> None:
        """Change the data: results that came from other data go."""
        self.cancel()
        self.newest.clear()
        self.imported = imported
        self.results.clear()

    def table(self, number: int) -> RigTable:
        """Return the runs of the rig of that number, analysed once."""
        rigs = self.dataset.rigs
        if not 0 <= number < len(rigs):
            raise UnknownNameError("no such rig on the bench", remedy="choose one from the list")
        return rig_table(self.dataset, rigs[number])

    def table_of(self, rig: str) -> RigTable | None:
        """Return the runs of the rig of that name, where they are on the bench."""
        if self.imported is None or rig not in self.dataset.rigs:
            return None
        return rig_table(self.dataset, rig)

    def add(self, damper: Damper, origin: str, note: str = "", **facts: Any) -> Bench:
        """Add a damper, with further fields of `Bench`; the oldest are removed where there are too many."""
        bench = Bench(self.key("damper"), damper, origin, note, **facts)
        self.dampers[bench.key] = bench
        while len(self.dampers) > MOST_DAMPERS:
            del self.dampers[next(iter(self.dampers))]
        return bench

    def scored(self, result: RecipeResult, origin: str, note: str, selected: bool = False) -> Bench:
        """Add a damper whose covariance is estimated from its runs when it is first asked for."""
        error = result.cross_validated.median() if result.cross_validated.runs else None
        if result.damper.uncertainty is not None:
            return self.add(result.damper, origin, note, error=error, selected=selected)
        runs = [self.dataset[run.run_id] for run in result.train.runs]
        beside = [score.predicted for score in result.cross_validated.runs if score.predicted is not None]
        learn = partial(estimate_uncertainty, result.damper, runs, beside)
        return self.add(result.damper, origin, note, error=error, selected=selected, learn=learn)

    def damper(self, key: str, sure: bool = False) -> Bench:
        """Return a damper on the bench by its key, with its covariance where that is asked for and can be known."""
        if key not in self.dampers:
            raise UnknownNameError("that damper is no longer on the bench", remedy="choose another on the Model page")
        bench = self.dampers[key]
        if sure and bench.learn is not None:
            bench = self.dampers[key] = replace(bench, damper=bench.learn(), learn=None)
        return bench

    def start(
        self,
        kind: str,
        task: Callable[..., Any],
        arguments: tuple[Any, ...],
        conclude: Callable[[Any], dict[str, Any]],
        recall: Callable[[], Any] = lambda: None,
    ) -> dict[str, Any]:
        """Begin long work, or recall its result, in place of work of the same kind; gives its report."""
        if before := self.newest.get(kind):
            before.cancel()
        self.jobs = {key: job for key, job in self.jobs.items() if not job.ended}
        job = Job(self.key("job"), kind, task, arguments, conclude, recall)
        self.jobs[job.key] = self.newest[kind] = job.start()
        return job.report()

    def job(self, key: str) -> Job:
        """Work begun here, by its key.

        Raises `UnknownNameError` if there is none: it was on other data, or other work has taken its place.
        """
        for job in (*self.newest.values(), *self.jobs.values()):
            if job.key == key:
                return job
        raise UnknownNameError("that work is not known here", remedy="start it again")

    def cancel(self) -> None:
        """Stop whatever is being worked on."""
        for job in list(self.jobs.values()):
            job.cancel()

    def close(self) -> None:
        """Stop the work and remove the files."""
        self.cancel()
        shutil.rmtree(self.folder, ignore_errors=True)


class BrowserSessions:
    """All sessions of one bench."""

    def __init__(self) -> None:
        self._keep = ExitStack()
        self.folder = self._keep.enter_context(temporary_folder())
        self.studies = BundledStudies(self.folder)
        self._open: dict[str, Session] = {}
        self._lock = threading.Lock()

    def __iter__(self) -> Iterator[Session]:
        return iter(list(self._open.values()))

    def __len__(self) -> int:
        return len(self._open)

    def open(self) -> Session:
        """Begin a session; the longest unused one goes where there are too many."""
        self.sweep()
        name = secrets.token_urlsafe(_NAME_BYTES)
        with self._lock:
            while len(self._open) >= MOST_SESSIONS:
                oldest = min(self._open.values(), key=lambda session: session.seen)
                del self._open[oldest.name]
                oldest.close()
            folder = self.folder / secrets.token_hex(_NAME_BYTES)
            folder.mkdir(mode=0o700)
            session = self._open[name] = Session(name, folder)
        return session

    def find(self, name: str) -> Session:
        """Return the session of that name; raises `InputError` if it has ended."""
        session = self._open.get(name)
        if session is None:
            raise InputError("this session has ended", remedy="load the page again", code="E_SESSION_ENDED")
        session.seen = time.monotonic()
        return session

    def end(self, name: str) -> None:
        """End a session, if it is there."""
        with self._lock:
            session = self._open.pop(name, None)
        if session:
            session.close()

    def sweep(self, idle_seconds: float = IDLE_SECONDS) -> None:
        """End sessions nobody has used for so long."""
        now = time.monotonic()
        for session in self:
            if now - session.seen > idle_seconds:
                self.end(session.name)
        if not self._open:
            for cached in _SHARED:
                cached.cache_clear()

    def close(self) -> None:
        """End all and remove every file."""
        jobs = [job for session in self for job in session.jobs.values()]
        for session in self:
            self.end(session.name)
        deadline = time.monotonic() + _LAST_WAIT
        for job in jobs:  # a worker that is just being started can be ended only then
            job.wait(max(0.0, deadline - time.monotonic()))
        self._keep.close()


def _current(session: str, request: Request) -> Session:
    return request.app.state.sessions.find(session)


Current = Annotated[Session, Depends(_current)]
