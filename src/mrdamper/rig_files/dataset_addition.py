"""Tests added to a dataset, some of which it may contain already, from another reading of their file."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from mrdamper.data import Dataset, Run
from mrdamper.errors import OutputError, listed
from mrdamper.rig_files.record import unique_names

_COLUMN = re.compile(r"(?:displacement|force) = .*?(?= in \S+(?:, [a-z]+ = |$))")  # in the note of a run's columns


def with_tests(old: Dataset, new: Dataset) -> tuple[Dataset, list[str], list[str]]:
    """Return both datasets' runs, told apart by their names, and the names of two kinds of runs.

    First those of the old runs that new ones replace: of the same file and columns, read otherwise. Then those of the
    new runs that stay beside old ones of their file: of other columns, or of another rig.

    Raises `OutputError` if a test was read in the same way, or if its file gives another number of tests now.
    """
    files = {run.notes["sha256"] for run in old if run.notes.get("sha256")}
    again: dict[str, Run] = {}  # by the name of the run that it replaces
    fresh: list[Run] = []
    for now in _by_source(new):
        digest = now[0].notes.get("sha256")
        before = [run for run in old if digest in files and run.notes.get("sha256") == digest]
        same = [run.id for run in before if any(_reads_alike(run, other) for other in now)]
        if same:
            raise OutputError(
                f"there already, read in the same way: {listed(same, 5)}",
                where=f"dataset {old.name}", remedy="give new files only, or a profile that reads these otherwise",
            )  # fmt: skip
        before = [run for run in before if run.rig == now[0].rig or not (run.rig and now[0].rig)]
        before = [run for run in before if _columns(run) == _columns(now[0])]
        if before and len(before) != len(now):
            raise OutputError(
                f"{listed([run.id for run in before], 5)} are of the same file, which gives {len(now)} tests now",
                where=f"dataset {old.name}", remedy="import into a new folder",
            )  # fmt: skip
        fresh += () if before else now
        again |= {one.id: other for one, other in zip(before, now, strict=False)}
    kept = [_replaced(run, again[run.id]) if run.id in again else run for run in old]
    names = unique_names((run.id for run in fresh), (run.id for run in old))
    added = [run if name == run.id else replace(run, id=name) for run, name in zip(fresh, names, strict=True)]
    return Dataset((*kept, *added), old.name), [*again], [run.id for run in added if run.notes.get("sha256") in files]


def _by_source(runs: Dataset) -> list[list[Run]]:
    """Return runs apart by their file, its columns and the rig, in their order; those of no file each alone."""
    sources: dict[tuple[str, ...], list[Run]] = {}
    for run in runs:
        digest = run.notes.get("sha256")
        sources.setdefault((digest, _columns(run), run.rig) if digest else (run.id,), []).append(run)
    return [*sources.values()]


def _columns(run: Run) -> str:
    """Return the columns of the displacement and the force, whatever their units."""
    return " ".join(match[0] for match in _COLUMN.finditer(run.notes.get("columns", "")))


def _replaced(before: Run, now: Run) -> Run:
    """Return a run that was read again, with the name, split and further columns of runs.csv of the old one."""
    anew = ("columns", "sign_changed", "scaled", "time_from", "motion_stated", "findings")
    stated = {key: text for key, text in before.notes.items() if key not in anew}
    return replace(now, id=before.id, split=before.split, rig=now.rig or before.rig, notes={**now.notes, **stated})


def _reads_alike(one: Run, other: Run) -> bool:
    """Tell if two readings of a file gave the same samples."""
    channels = ("time", "displacement", "force", "current")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in channels)
