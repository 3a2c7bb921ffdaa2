"""The coil current: constant but for noise, or a channel of its own that only some methods can take."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.data import Floats, held_current
from mrdamper.data.arrays import take
from mrdamper.rig_files.quality.motion import steady_window
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding, Record

_MOST = 1_000_000  # samples looked at


def changes(view: View) -> Iterator[Finding]:
    """Report a current that changes within the steady motion."""
    yield from change_of(view.record, steady_window(view))


def change_of(record: Record, window: tuple[float, float] | None) -> Iterator[Finding]:
    """Yield the finding that a record's current changes within a window of time."""
    change = held_in(record, window)[1]
    if change:
        text = f"{change}: only methods that take a current channel use the run, nothing is identified from it alone"
        yield Finding("W_CURRENT_VARIES", text)


def held_in(record: Record, window: tuple[float, float] | None) -> tuple[float, str]:
    """Mean of a record's current within a window of time [A], NaN without three samples, and how it changes there."""
    current = np.empty(0) if record.current is None else current_in(record, window)
    return held_current(current) if current.size >= 3 else (np.nan, "")


def current_in(record: Record, window: tuple[float, float] | None) -> Floats:
    """Return the current's samples that are there within a window of time, thinned where they are many."""
    assert record.current is not None
    thinned = np.arange(0, record.time.size, max(1, record.time.size // _MOST))
    time, current = take(record.time, thinned), take(record.current, thinned)
    there = np.isfinite(current)
    if window is not None:
        there &= (time >= window[0]) & (time <= window[1])
    return current[there]
