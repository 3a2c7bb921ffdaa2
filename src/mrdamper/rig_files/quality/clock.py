"""The time channel: it must run forward; where it leaps, the record is cut into segments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding

GAP = 5.5  # steps this many times the usual one are a gap: up to 4 samples lost are none
_DAY, _HOUR, _NEAR = 86_400.0, 3600.0, 60.0  # [s]
COARSE_CLOCK = 0.1  # share of the samples whose stamp is that of the one before
_CHUNK = 1_000_000  # samples looked at together, to keep memory small


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
