"""Identification of a fleet: find the dampers, make the plan, measure dampers that the journal does not contain."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mrdamper.data.atomic import require_writable
from mrdamper.data.progress import Progress, silent
from mrdamper.data.wording import counted
from mrdamper.errors import InputError, validate_arguments
from mrdamper.fleet.engine import Submit, cluster_engine, local_engine, outcome
from mrdamper.fleet.guard import JobLimits
from mrdamper.fleet.item import Item, digest_of, hash_of
from mrdamper.fleet.items import find_items
from mrdamper.fleet.job import VERSION, Settings, as_job, refused
from mrdamper.fleet.journal import FORMAT, Journal
from mrdamper.fleet.plan import Plan, drafts, holding, settled
from mrdamper.fleet.profile import FleetProfile
from mrdamper.fleet.table import write_table
from mrdamper.models import model_type
from mrdamper.rig_files.profile import load_profile

REFERENCES = 11  # dampers that make the plan
_QUEUED_PER_WORKER = 2  # queued jobs per running job


@dataclass(frozen=True)
class Fleet:
    """Summary of a population run."""

    table: Path  # `dampers.parquet`
    dampers: int  # in the source
    done: int  # identified
    already: int  # of those, found in the journal
    troubled: tuple[tuple[str, str, str], ...]  # dampers that were refused or whose job failed
    plan: Plan | None  # None if no damper could be identified


@validate_arguments()
def run_fleet(
    source: str | Path,
    out: str | Path,
    *,
    profile: FleetProfile | None = None,
    model: str = "play-bypass",
    cold: bool = False,
    workers: int = 1,
    scheduler: str | None = None,
    tls: str | Path | None = None,
    patience: float = 10.0,
    limits: JobLimits | None = None,
    progress: Progress = silent,
) -> Fleet:
    """Identify every damper of a source that is not yet in the journal of `out`, and write the table.

    The table has the same bits for any number of workers, on one machine or on a cluster, with or without
    interruptions, except for the columns with times and hosts.

    Parameters
    ----------
    source : path
        As `find_items`.
    out : path
        Folder of the journal and the table.
    profile : FleetProfile, optional
    model : str
        Identified jointly from all runs of a damper.
    cold : bool
        Start every search from the model's start values instead of the plan's.
    workers : int
        Processes on this machine.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers have `source` under the same path.
    tls : path, optional
        Folder with ca.pem, cert.pem and key.pem, for a tls:// scheduler.
    patience : float
        Time limit for an answer of the scheduler [s].
    limits : JobLimits, optional
        Of one damper's job.
    progress : callable

    Raises
    ------
    FleetError, ProfileError, UnknownNameError
        If the source holds no damper, or the profile or the model cannot be used.
    JournalError
        If another process writes to `out`, or its journal cannot be used.
    OutputError
        If `out` cannot be written to, or the disk is full; what was finished is safe.
    ClusterError, MissingExtraError
        If the cluster cannot be reached.

    Examples
    --------
    >>> from mrdamper import run_fleet
    >>> fleet = run_fleet("dampers/", "fleet/", workers=2)  # doctest: +SKIP
    >>> fleet.table  # doctest: +SKIP
    PosixPath('fleet/dampers.parquet')
    """
    out = Path(out).absolute()
    parameters = [info.name for info in model_type(model).parameters()]
    require_writable(out)
    profile = profile or FleetProfile()
    sources = find_items(source, profile)
    items = [replace(item, paths=tuple(str(Path(path).absolute()) for path in item.paths)) for item in sources]
    settings = Settings(model, _rig_profile(profile), cold)
    journal = Journal(out)
    try:
        line = _Line(items, settings, journal, progress)
        bounds = limits or JobLimits()
        cluster = cluster_engine(scheduler, bounds, tls, patience) if scheduler else None
        with cluster or local_engine(workers, bounds) as (submit, slots):
            line.run(submit, slots)
        return line.written(out / "dampers.parquet", parameters)
    finally:
        journal.close()


class _Line:
    """The dampers of one run, their keys, and the remaining jobs."""

    def __init__(self, items: Sequence[Item], settings: Settings, journal: Journal, progress: Progress):
        self._items, self._settings, self._journal, self._progress = items, settings, journal, progress
        self.plan: Plan | None = None
        self._digests: dict[int, str] = {}
        self._failed: dict[int, dict[str, Any]] = {}  # failed in this run: repeated by the next
        self._already = 0

    def run(self, submit: Submit, slots: int) -> None:
        """Make the plan and measure all dampers; `slots` jobs run at once."""
        self._submit, self._slots = submit, slots
        for number, item in enumerate(self._items):
            if item.error is None:
                try:
                    self._digests[number] = digest_of(item)
                except OSError as error:
                    reason, remedy = error.strerror or str(error), "correct the file or its permissions"
                    self._failed[number] = refused(InputError(reason, where=item.paths[0], remedy=remedy))
            if number % 100 == 0:
                self._progress(f"reading {counted(len(self._items), 'damper')}", 0.0)
        self._make_plan()
        if self.plan is not None:
            self._measure(list(self._digests), self.plan, count=True)

    def written(self, table: Path, parameters: Sequence[str]) -> Fleet:
        """Write the table: one row per damper, in the order of serial numbers and sessions."""
        troubled: list[tuple[str, str, str]] = []

        def rows() -> Iterator[dict[str, Any]]:
            for number, item in enumerate(self._items):
                row = self._row(number)
                if row["status"] != "done":
                    troubled.append((item.name, row["status"], row["reason"]))
                yield {**item.facts, **row}

        write_table(rows(), parameters, self.plan, table)
        done = len(self._items) - len(troubled)
        return Fleet(table, len(self._items), done, self._already, tuple(troubled), self.plan)

    def _row(self, number: int) -> dict[str, Any]:
        error = self._items[number].error
        if error is not None:
            return refused(error)
        if number in self._failed:
            return self._failed[number]
        rows = (self._journal.result(self._key(number, plan)) for plan in (self.plan, None))
        return next(row for row in rows if row is not None)

    def _make_plan(self) -> None:
        """Make the plan from the first dampers that can be identified, in an order by the hash of their names."""
        key = hash_of("plan", vars(self._for(None)), VERSION, FORMAT)
        kept = self._journal.plan(key)
        if kept is not None:
            self.plan = Plan(**{k: _deep_tuple(v) for k, v in kept.items()})
            return
        order = sorted(self._digests, key=lambda n: hash_of(self._items[n].serial, self._items[n].session))
        references: dict[str, dict[str, Any]] = {}
        for begin in range(0, len(order), REFERENCES):
            some = order[begin : begin + REFERENCES]
            self._measure(some, None)
            for number in some:
                row = self._row(number)
                if row["status"] == "done" and len(references) < REFERENCES:
                    references[self._items[number].name] = row
            if len(references) >= REFERENCES:
                break
        if references:
            tried = [(plan, self._under(plan, order)) for plan in drafts(references)]
            draft = holding(*min(tried, key=lambda t: sum(row["cost"] for row in t[1])))
            self.plan = settled(draft, self._under(draft, order))
            self._journal.keep_plan(key, self.plan.document)

    def _under(self, plan: Plan, order: Sequence[int]) -> list[dict[str, Any]]:
        numbers = [n for n in order if self._items[n].name in plan.references]
        self._measure(numbers, plan)
        rows = [self._journal.result(self._key(n, plan)) for n in numbers]
        return [row for row in rows if row is not None and row["status"] == "done"]

    def _measure(self, numbers: Sequence[int], plan: Plan | None, count: bool = False) -> None:
        """Run the jobs whose rows are not in the journal; rows that finish together are stored together."""
        waiting = [n for n in numbers if n not in self._failed and not self._is_kept(n, plan)]
        if count:
            self._already = sum(self._journal.status(self._key(n, plan)) == "done" for n in numbers)
        running: dict[Future[dict[str, Any]], int] = {}
        todo, done, begin = iter(waiting), 0, time.monotonic()
        while True:
            while len(running) < _QUEUED_PER_WORKER * self._slots and (number := next(todo, None)) is not None:
                job = as_job(self._items[number], self._digests[number], self._for(plan), plan)
                running[self._submit(job)] = number
            if not running:
                return
            finished = wait(running, return_when=FIRST_COMPLETED).done
            self._keep([(running.pop(future), outcome(future)) for future in finished], plan)
            done += len(finished)
            what = "reference dampers" if plan is None else "dampers"
            rate = done / max(time.monotonic() - begin, 1e-9)
            self._progress(f"{done} of {len(waiting)} {what}, {rate:.3g} a second", done / len(waiting))

    def _is_kept(self, number: int, plan: Plan | None) -> bool:
        if self._journal.status(self._key(number, plan)) is not None:
            return True
        # Records that were refused without a plan stay refused.
        return plan is not None and self._journal.status(self._key(number, None)) == "refused"

    def _keep(self, rows: Iterable[tuple[int, dict[str, Any]]], plan: Plan | None) -> None:
        good, stamp = [], datetime.now(UTC).isoformat(timespec="seconds")
        for number, result in rows:
            row = {**result, "finished_time_utc": stamp}
            if row["status"] == "failed":
                self._failed[number] = row
            else:
                good.append((self._key(number, plan), row))
        self._journal.keep(good)

    def _for(self, plan: Plan | None) -> Settings:
        """Return the settings; a plan is made in the same way for fast and for cold searches."""
        plain = plan is None or plan.draft
        return replace(self._settings, cold=False) if plain else self._settings

    def _key(self, number: int, plan: Plan | None) -> str:
        about = None if plan is None else plan.digest
        return hash_of(self._digests[number], vars(self._for(plan)), VERSION, FORMAT, about)


def _rig_profile(profile: FleetProfile) -> str:
    if profile.rig is None:
        return ""
    load_profile(profile.rig)
    return Path(profile.rig).read_text(encoding="utf-8-sig")


def _deep_tuple(value: Any) -> Any:
    return tuple(map(_deep_tuple, value)) if isinstance(value, list) else value
