"""Missing samples of a record: infinite values refused, missing ones counted."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.rig_files.quality.view import View, runs_of
from mrdamper.rig_files.record import Finding

MOST_MISSING = 0.02  # share of the samples
MOST_IN_A_ROW = 5
_OVERFLOW = 1e100  # squares of larger numbers leave double precision
_FEWEST = 5  # samples
USED = ("time", "displacement", "force", "current", "velocity")  # what a run is made of
_IN_TURN = 0.3  # share of missing samples of a channel that is logged in turn with others


def long_enough(view: View) -> None:
    """Refuse a record of a few samples."""
    size = view.record.time.size
    if size < _FEWEST:
        raise view.refused("E_NO_DATA", f"{size} samples", "export the whole record: a cycle or more")


def finite(view: View) -> Iterator[Finding]:
    """Refuse infinite values, an overflow in the logger or the file; say so of a channel no run needs."""
    for name, values in view.channels.items():
        infinite = np.abs(values) > _OVERFLOW
        if infinite.any():
            at = int(np.argmax(infinite))
            count = int(np.count_nonzero(infinite))
            text = f"{name} is infinite in {count} sample{'s' * (count > 1)}, first {view.place(at)}"
            if name in USED:
                remedy = "export the channel again with a wider number format"
                raise view.refused("E_NONFINITE", text, remedy)
            yield Finding("W_MISSING", f"{text}; the channel is not used")


def missing(view: View) -> Iterator[Finding]:
    """Accept a few missing samples, refuse more than 2 % or more than 5 in a row."""
    for name, values in view.channels.items():
        absent = np.isnan(values)
        count = int(np.count_nonzero(absent))
        if not count:
            continue
        longest, start = longest_run(absent)
        share = count / absent.size
        text = f"{name}: {count} of {absent.size} samples missing ({100 * share:.3g} %), {longest} in a row at most"
        if name in USED and (share > MOST_MISSING or longest > MOST_IN_A_ROW):
            remedy = f"record again, or cut the record; up to 2 % and {MOST_IN_A_ROW} in a row are taken"
            if share > _IN_TURN and longest < absent.size / 10:
                remedy = "export the channels with one clock: each has rows of its own"
            raise view.refused("E_MISSING", f"{text}, {view.place(start)}", remedy)
        yield Finding("W_MISSING", f"{text}; they are left out, not filled")
    longest, start = longest_run(~view.record.present)
    if longest > MOST_IN_A_ROW:
        problem = f"{longest} samples in a row of which one channel or another is missing, {view.place(start)}"
        remedy = f"record again, or cut the record; up to {MOST_IN_A_ROW} in a row are taken"
        raise view.refused("E_MISSING", problem, remedy)


def longest_run(mask: np.ndarray) -> tuple[int, int]:
    """Length and start of the longest run of true values."""
    starts, stops = runs_of(mask)
    if not starts.size:
        return 0, 0
    longest = int(np.argmax(stops - starts))
    return int(stops[longest] - starts[longest]), int(starts[longest])
