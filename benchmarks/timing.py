"""Timing on a loaded machine.

The functions run in turns, the minimum counts, and the clock is the processor time of this process: all functions run
on one thread.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np

_LONG = 10.0  # a call that takes this long is not repeated [s]
_SHORTEST = 2e-3  # a call is repeated until one measurement takes this long [s]


def race(contestants: Mapping[str, Callable[[], object]], seconds: float = 1.0) -> dict[str, float]:
    """Least seconds per call of each function, in turns, so that the load affects all equally.

    Parameters
    ----------
    contestants : mapping of str to callable
    seconds : float
        Most to spend on each, one call and a warm-up apart.
    """
    repeats, spent = {}, {}
    times: dict[str, list[float]] = {name: [] for name in contestants}
    for name, call in contestants.items():
        first = _once(call)
        again = first if first > _LONG else _once(call)  # the first call may compile or fill caches
        repeats[name] = max(1, math.ceil(_SHORTEST / max(again, 1e-9)))
        spent[name] = 0.0
        if again >= seconds:
            times[name].append(again)
    while pending := [n for n in contestants if len(times[n]) < 3 and not _slow(times[n], seconds)] or [
        n for n in contestants if spent[n] < seconds and len(times[n]) < 100 and not _slow(times[n], seconds)
    ]:
        for name in pending:
            begin = time.process_time()
            for _ in range(repeats[name]):
                contestants[name]()
            took = time.process_time() - begin
            times[name].append(took / repeats[name])
            spent[name] += took
    return {name: min(t) for name, t in times.items()}


def growth(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """Exponent p of time ∝ size^p, by least squares on logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def _once(call: Callable[[], object]) -> float:
    begin = time.process_time()
    call()
    return time.process_time() - begin


def _slow(times: list[float], seconds: float) -> bool:
    return bool(times) and times[0] >= seconds
