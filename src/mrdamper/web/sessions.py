"""Sessions: the data, dampers, jobs and files of each open page.

The name of a session is random; whoever knows it may use the session. Its files are in a folder of
its own that is removed with it.
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
from typing import Annotated, Any, TypeVar

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

IDLE_S = 12 * 3600  # an open page sends a request every minute; sessions of closed pages end after this
MAX_SESSIONS = 64
MAX_DAMPERS = 200
_NAME_BYTES = 16
_STOP_TIMEOUT_S = 10.0  # for workers to end when the app stops


_SHARED: list[Any] = []
_Cached = TypeVar("_Cached")


def shared(cached: _Cached) -> _Cached:
    """Clear an `lru_cache`, whose results all sessions share, when no session is left."""
    _SHARED.append(cached)
    return cached


@dataclass(frozen=True, eq=False)
class SessionDamper:
    """A damper of a session."""

    key: str
    damper: Damper
    origin: str  # "study", "identification", "comparison", "bundled", "file"
    note: str = ""  # one line on its errors or origin
    error: float | None = None  # median force error in cross-validation [-]; None where none was calculated
    selected: bool = False  # by a study, for its rig
    # returns the damper with its covariance, where it has none yet and its runs are known
    estimate: Callable[[], Damper] | None = None


@dataclass(eq=False)
class Session:
    """State of one page on the server: data, dampers, jobs, files."""

    name: str
    folder: Path
    last_used: float = field(default_factory=time.monotonic)
    imported: ImportedData | None = None
    upload: Upload | None = None  # the last
    dampers: dict[str, SessionDamper] = field(default_factory=dict)
    jobs: dict[str, Job] = field(default_factory=dict)
    newest: dict[str, Job] = field(default_factory=dict)  # job of each kind, on the present data
    results: dict[str, Any] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)
    _count: int = 0

    def key(self, kind: str) -> str:
        """Return a name for a new object; never one from outside."""
        with self.lock:
            self._count += 1
            return f"{kind}{self._count}"

    @property
    def dataset(self) -> Dataset:
        """The loaded data; raises `InputError` if there are none."""
        if self.imported is None:
            raise InputError("no data are loaded", remedy="open the bundled tests, or drop files", code="E_NO_DATA")
        return self.imported.dataset

    @property
    def bundled(self) -> bool:
        """True where the data are the bundled tests without changes."""
        return self.imported is not None and self.imported.source == "bundled" and self.dataset is bundled().dataset

    def result(self, name: str, problem: str, remedy: str) -> Any:
        """Return a result by its name; raises `InputError` (E_NO_RESULT) where there is none."""
        if not self.results.get(name):
            raise InputError(problem, remedy=remedy, code="E_NO_RESULT")
        return self.results[name]

    def load(self, imported: ImportedData) -> None:
        """Replace the data, and remove the results of the earlier ones."""
        self.cancel()
        self.newest.clear()
        self.imported = imported
        self.results.clear()

    def table(self, number: int) -> RigTable:
        """Return the runs of a rig by its number, analysed once."""
        rigs = self.dataset.rigs
        if not 0 <= number < len(rigs):
            raise UnknownNameError("no such rig in the data", remedy="choose one from the list")
        return rig_table(self.dataset, rigs[number])

    def table_of(self, rig: str) -> RigTable | None:
        """Return the runs of a rig by its name, where they are loaded."""
        if self.imported is None or rig not in self.dataset.rigs:
            return None
        return rig_table(self.dataset, rig)

    def add(self, damper: Damper, origin: str, note: str = "", **fields: Any) -> SessionDamper:
        """Add a damper, with further fields of `SessionDamper`; the oldest are removed where there are too many."""
        added = SessionDamper(self.key("damper"), damper, origin, note, **fields)
        self.dampers[added.key] = added
        while len(self.dampers) > MAX_DAMPERS:
            del self.dampers[next(iter(self.dampers))]
        return added

    def add_scored(self, result: RecipeResult, origin: str, note: str, selected: bool = False) -> SessionDamper:
        """Add a damper whose covariance is estimated from its runs when it is first needed."""
        error = result.cross_validated.median() if result.cross_validated.runs else None
        estimate = None
        if result.damper.uncertainty is None:
            runs = [self.dataset[run.run_id] for run in result.train.runs]
            predicted = [score.predicted for score in result.cross_validated.runs if score.predicted is not None]
            estimate = partial(estimate_uncertainty, result.damper, runs, predicted)
        return self.add(result.damper, origin, note, error=error, selected=selected, estimate=estimate)

    def damper(self, key: str, with_uncertainty: bool = False) -> SessionDamper:
        """Return a damper by its key, on request with its covariance where that can be estimated."""
        if key not in self.dampers:
            raise UnknownNameError("the app no longer has this damper", remedy="choose another on the Model page")
        damper = self.dampers[key]
        if with_uncertainty and damper.estimate is not None:
            damper = self.dampers[key] = replace(damper, damper=damper.estimate(), estimate=None)
        return damper

    def start(
        self,
        kind: str,
        task: Callable[..., Any],
        conclude: Callable[[Any], dict[str, Any]],
        stored: Callable[[], Any] = lambda: None,
    ) -> dict[str, Any]:
        """Start a job in place of the last of its kind; returns its report."""
        if before := self.newest.get(kind):
            before.cancel()
        self.jobs = {key: job for key, job in self.jobs.items() if not job.ended}
        job = Job(self.key("job"), kind, task, conclude, stored)
        self.jobs[job.key] = self.newest[kind] = job.start()
        return job.report()

    def job(self, key: str) -> Job:
        """Return a job by its key; raises `UnknownNameError` if it was on earlier data, or was replaced by another."""
        for job in (*self.newest.values(), *self.jobs.values()):
            if job.key == key:
                return job
        raise UnknownNameError("no such job", remedy="start it again")

    def cancel(self) -> None:
        """Cancel all jobs."""
        for job in list(self.jobs.values()):
            job.cancel()

    def close(self) -> None:
        """Cancel all jobs and remove the files."""
        self.cancel()
        shutil.rmtree(self.folder, ignore_errors=True)


class BrowserSessions:
    """All sessions of an app."""

    def __init__(self) -> None:
        self._exit = ExitStack()
        self.folder = self._exit.enter_context(temporary_folder())
        self.studies = BundledStudies(self.folder)
        self._open: dict[str, Session] = {}
        self._lock = threading.Lock()

    def __iter__(self) -> Iterator[Session]:
        return iter(list(self._open.values()))

    def open(self) -> Session:
        """Open a session; the longest unused one ends where there are too many."""
        self.sweep()
        name = secrets.token_urlsafe(_NAME_BYTES)
        with self._lock:
            while len(self._open) >= MAX_SESSIONS:
                oldest = min(self._open.values(), key=lambda session: session.last_used)
                del self._open[oldest.name]
                oldest.close()
            folder = self.folder / secrets.token_hex(_NAME_BYTES)
            folder.mkdir(mode=0o700)
            session = self._open[name] = Session(name, folder)
        return session

    def find(self, name: str) -> Session:
        """Return a session by its name; raises `InputError` if it has ended."""
        session = self._open.get(name)
        if session is None:
            raise InputError("this session has ended", remedy="load the page again", code="E_SESSION_ENDED")
        session.last_used = time.monotonic()
        return session

    def end(self, name: str) -> None:
        """End a session, if it is open."""
        with self._lock:
            session = self._open.pop(name, None)
        if session:
            session.close()

    def sweep(self, idle_s: float = IDLE_S) -> None:
        """End sessions that were not used for some time."""
        now = time.monotonic()
        for session in self:
            if now - session.last_used > idle_s:
                self.end(session.name)
        if not self._open:
            for cached in _SHARED:
                cached.cache_clear()

    def close(self) -> None:
        """End all sessions and remove every file."""
        jobs = [job for session in self for job in session.jobs.values()]
        for session in self:
            self.end(session.name)
        deadline = time.monotonic() + _STOP_TIMEOUT_S
        for job in jobs:  # a worker that is being started can be ended only afterwards
            job.wait(max(0.0, deadline - time.monotonic()))
        self._exit.close()


def _find(session: str, request: Request) -> Session:
    return request.app.state.sessions.find(session)


OpenSession = Annotated[Session, Depends(_find)]
