"""Tests added to a dataset, some of which it may contain already, from another reading of their file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrdamper.data import Dataset, Run
from mrdamper.errors import OutputError, listed
from mrdamper.rig_files.record import unique_names


def with_tests(old: Dataset, new: Dataset) -> tuple[Dataset, list[str]]:
    """Return both datasets' runs, told apart by their names, and the names of the old runs that new ones replace.

    A test of the same file replaces one that was read otherwise. Raises `OutputError` if it was read in the same way,
    or if its file gives another number of tests now.
    """
    stored, given = _by_file(old), _by_file(new)
    again: dict[str, Run] = {}  # by the name of the run that it replaces
    for before, now in ((stored[digest], runs) for digest, runs in given.items() if digest in stored):
        if len(before) != len(now):
            raise OutputError(
                f"{listed([run.id for run in before], 5)} are of the same file, which gives {len(now)} tests now",
                where=f"dataset {old.name}", remedy="delete them from runs.csv, or import into a new folder",
            )  # fmt: skip
        again |= {one.id: other for one, other in zip(before, now, strict=True)}
    same = [run.id for run in old if run.id in again and _reads_alike(run, again[run.id])]
    if same:
        raise OutputError(
            f"there already, read in the same way: {listed(same, 5)}",
            where=f"dataset {old.name}", remedy="give new files only, or a profile that reads these otherwise",
        )  # fmt: skip
    kept = [_replaced(run, again[run.id]) if run.id in again else run for run in old]
    fresh = [run for run in new if run.notes.get("sha256") not in stored]
    names = unique_names((run.id for run in fresh), (run.id for run in old))
    added = (run if name == run.id else replace(run, id=name) for run, name in zip(fresh, names, strict=True))
    return Dataset((*kept, *added), old.name), [*again]


def _by_file(runs: Dataset) -> dict[str, list[Run]]:
    """Return runs by the digest of their file, in their order."""
    files: dict[str, list[Run]] = {}
    for run in runs:
        if digest := run.notes.get("sha256"):
            files.setdefault(digest, []).append(run)
    return files


def _replaced(before: Run, now: Run) -> Run:
    """Return a run that was read again, with the name, split and further columns of runs.csv of the old one."""
    anew = ("columns", "sign_changed", "scaled", "time_from", "motion_stated", "findings")
    stated = {key: text for key, text in before.notes.items() if key not in anew}
    return replace(now, id=before.id, split=before.split, rig=now.rig or before.rig, notes={**now.notes, **stated})


def _reads_alike(one: Run, other: Run) -> bool:
    """Tell if two readings of a file gave the same samples."""
    channels = ("time", "displacement", "force", "current")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in channels)
