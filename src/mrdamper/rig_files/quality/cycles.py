"""Steady cycles of a record side by side: their mean loop, and what each differs from it by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mrdamper.data import Floats, once_per_run
from mrdamper.rig_files.quality.view import View

POINTS = 200  # phases of a cycle at which cycles are compared
_EARLY = 0.02  # of the period: a cycle may begin before the window by so much


@dataclass(frozen=True, eq=False)
class CycleChannel:
    """One channel of K steady cycles: each is offset + (1 + gain) (loop − its mean), `late` of a period."""

    values: Floats  # (K, P), at P equal phases of every cycle
    loop: Floats  # (P,), mean over the cycles
    slope: Floats  # (P,), its derivative by the phase [per cycle]
    offset: Floats  # (K,), as gain and late by least squares
    gain: Floats  # (K,)
    late: Floats  # (K,)
    rest: Floats  # (K, P), what these three do not explain

    @property
    def span(self) -> float:
        """Peak-to-peak value of the mean loop."""
        return float(np.ptp(self.loop))


@dataclass(frozen=True, eq=False)
class Cycles:
    """Displacement and force of the K steady cycles, by phase."""

    starts: Floats  # (K,) [s]
    period: float  # [s]
    displacement: CycleChannel
    force: CycleChannel

    def read(self, loop: Floats, time: Floats) -> Floats:
        """(N,) values of a (P,) loop at times [s], by linear interpolation."""
        place = (time - self.starts[0]) / self.period % 1.0 * POINTS
        return np.interp(place, np.arange(POINTS + 1), np.append(loop, loop[0]))


class Folded(NamedTuple):
    """K cycles of a record, each at P equal phases."""

    starts: Floats  # (K,) [s]
    period: float  # [s]
    displacement: Floats  # (K, P) [m]
    force: Floats  # (K, P) [N]


@once_per_run
def every_cycle(view: View) -> Folded | None:
    """Fold the cycles of a record without a gap, up to its end; None under one cycle of a periodic motion."""
    motion = view.motion
    count = 0 if motion is None else int(motion.cycles + 0.02)
    if motion is None or count < 1:
        return None
    run, period = view.steady, 1 / motion.condition.frequency_Hz
    grid = float(run.time[-1]) - count * period + period * np.arange(count * POINTS) / POINTS
    starts = grid[::POINTS]
    kept = view.without_leap(starts, starts + period)
    if not kept.any():
        return None
    channels = (np.interp(grid, run.time, v).reshape(count, POINTS)[kept] for v in (run.displacement, run.force))
    return Folded(starts[kept], period, *channels)


@once_per_run
def steady_cycles(view: View) -> Cycles | None:
    """Return the steady cycles of a record beside each other; None under one cycle of a periodic motion.

    The first of three or more is omitted: it may contain the start from rest. A cycle with a gap is, too, and one
    before the window of a run that states one.
    """
    folded = every_cycle(view)
    if folded is None:
        return None
    count = round((float(view.steady.time[-1]) - folded.starts[0]) / folded.period)
    assert view.motion is not None
    first = int(count > 2 and count == int(view.motion.cycles + 0.02))
    if view.record.window is not None:
        before = folded.starts < view.record.window[0] - _EARLY * folded.period
        first = max(first, int(np.count_nonzero(before)))
    if first == folded.starts.size:
        return None
    channels = (_channel(values[first:]) for values in (folded.displacement, folded.force))
    return Cycles(folded.starts[first:], folded.period, *channels)


def _channel(values: Floats) -> CycleChannel:
    loop = values.mean(axis=0)
    slope = 0.5 * POINTS * (np.roll(loop, -1) - np.roll(loop, 1))
    table = np.column_stack([np.ones(POINTS), loop - loop.mean(), -slope])
    differences = (values - loop).T
    changes = np.linalg.lstsq(table, differences, rcond=1e-9)[0]
    offset, gain, late = changes
    return CycleChannel(values, loop, slope, offset, gain, late, (differences - table @ changes).T)
