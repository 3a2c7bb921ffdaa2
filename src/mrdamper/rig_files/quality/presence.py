"""The samples of a record and their times: infinite and repeated ones refused, missing ones counted, gaps cut."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.quality.view import View, runs_of
from mrdamper.rig_files.record import Finding

MOST_MISSING = 0.02  # share of the samples
MOST_IN_A_ROW = 5
_OVERFLOW = 1e100  # squares of larger numbers leave double precision
_FEWEST = 5  # samples
USED = ("time", "displacement", "force", "current", "velocity")  # what a run is made of
_IN_TURN = 0.3  # share of missing samples of a channel that is logged in turn with others
GAP = 5.5  # steps this many times the usual one are a gap: up to 4 samples lost are none
_DAY, _HOUR, _NEAR = 86_400.0, 3600.0, 60.0  # [s]
COARSE_CLOCK = 0.1  # share of the samples whose stamp is that of the one before
_CHUNK = 1_000_000  # samples looked at together, to keep memory small


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


def order_of_time(view: View) -> None:
    """Refuse time stamps that repeat or run backwards."""
    wrong = list(_steps(view, lambda steps: steps <= 0))
    if not wrong:
        return
    sample, before, after = wrong[0]
    where = view.place(sample)
    more = f" ({len(wrong)} such places)" if len(wrong) > 1 else ""
    if before == after:
        remedy = "drop the repeated rows"
        if len(wrong) > COARSE_CLOCK * view.record.time.size:
            remedy = "set [file] sample_rate_Hz = ... in a profile if the clock is too coarse"
        problem = f"time stamp {before:.9g} s is repeated {where}{more}"
        raise view.refused("E_TIME_DUPLICATE", problem, f"write time with more decimals, or {remedy}")
    problem = f"time runs backwards {where}, from {before:.9g} s to {after:.9g} s{more}"
    raise view.refused("E_TIME_ORDER", problem, _turning_back(before - after))


def _turning_back(seconds: float) -> str:
    """Remedy for a clock that goes back by a time."""
    if abs(seconds - _DAY) < _NEAR:
        return "export the time of day with its date: the test went on past midnight"
    if abs(seconds - _HOUR) < _NEAR:
        return "export the stamps with their offset from UTC: the clocks were put back an hour"
    return "sort the rows, or split the file where the logger started again"


def gaps_in_time(view: View) -> Iterator[Finding]:
    """Cut the record where time leaps: nothing is differentiated across a gap."""
    gaps = list(_steps(view, lambda steps: steps > GAP * view.step))
    if not gaps:
        return
    bounds = [0, *(sample for sample, _, _ in gaps), view.record.time.size]
    view.segments = tuple(pairwise(bounds))
    _, before, after = max(gaps, key=lambda gap: gap[2] - gap[1])
    yield Finding(
        "W_TIME_GAP",
        f"{len(gaps)} gap{'s' * (len(gaps) > 1)} in time, the widest {after - before:.4g} s after {before:.6g} s "
        f"(usual step {view.step:.4g} s): split into {len(gaps) + 1} segments",
    )


def _steps(view: View, odd: Callable[[Floats], np.ndarray]) -> Iterator[tuple[int, float, float]]:
    """Yield steps of time that a test finds odd: sample after the step, time before and after it."""
    time = view.record.time
    last = None  # sample of the last time stamp that was there
    for start in range(0, time.size, _CHUNK):
        index = start + np.flatnonzero(np.isfinite(time[start : start + _CHUNK]))
        if last is not None:
            index = np.concatenate([[last], index])
        if not index.size:
            continue
        stamps = time[index]
        for i in np.flatnonzero(odd(np.diff(stamps))):
            yield int(index[i + 1]), float(stamps[i]), float(stamps[i + 1])
        last = int(index[-1])
