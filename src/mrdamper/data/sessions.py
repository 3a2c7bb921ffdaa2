"""The session a run was recorded in: runs of one session share the effects of the rig that differ from day to day."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime

from mrdamper.data.runs import Run
from mrdamper.errors import InputError

SESSIONS_NEEDED = 3  # sessions from which the scatter between sessions is estimated


def session_of(run: Run) -> str | None:
    """Session of a run: as stated in its note `session`, else the day of `recorded_at`, else None.

    A run of unknown session (None) belongs to no session. Raises `InputError` (E_CLOCK) if the clock is needed and is
    no date.

    Examples
    --------
    >>> from mrdamper import load_dataset
    >>> from mrdamper.data import session_of
    >>> session_of(load_dataset()["lab_A.1"])
    '2020-06-10'
    """
    stated = str(run.notes.get("session", "")).strip()
    if stated:
        return stated
    clock = _clock_of(run)
    return None if clock is None else clock.date().isoformat()


def session_groups(sessions: Iterable[str | None]) -> list[list[int]]:
    """Group the indices of runs by session, in the order of names, unknown ones in none; empty under three sessions."""
    groups: dict[str, list[int]] = {}
    for i, session in enumerate(sessions):
        if session is not None:
            groups.setdefault(session, []).append(i)
    return [groups[name] for name in sorted(groups)] if len(groups) >= SESSIONS_NEEDED else []


def session_folds(runs: Sequence[Run]) -> list[list[int]]:
    """Return the indices of runs omitted together as a session; empty where each session holds one run.

    Also empty where the clock of a run is no date, which is refused where sessions are asked for.
    """
    try:
        groups = session_groups([session_of(run) for run in runs])
    except InputError:
        return []
    return groups if any(len(group) > 1 for group in groups) else []


def hour_of(run: Run) -> float | None:
    """Hours from 1970-01-01 to a run; None without a time of day; raises `InputError` (E_CLOCK) if it is no date."""
    clock = _clock_of(run)
    if clock is None or len(str(run.notes["recorded_at"]).strip()) <= len("2024-05-31"):
        return None
    return (clock - datetime(1970, 1, 1)).total_seconds() / 3600


def _clock_of(run: Run) -> datetime | None:
    text = str(run.notes.get("recorded_at", "")).strip()
    if not text:
        return None
    try:
        return datetime.fromisoformat(text).replace(tzinfo=None)
    except ValueError:
        raise InputError(
            f"recorded_at is {text!r}", where=f"run {run.id}", remedy="write 2024-05-31T14:05:00", code="E_CLOCK"
        ) from None
