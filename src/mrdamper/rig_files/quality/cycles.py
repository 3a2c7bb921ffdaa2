"""Steady cycles of a record side by side: their mean loop, and what each differs from it by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrdamper.data import Floats, once_per_run
from mrdamper.rig_files.quality.view import View

POINTS = 200  # phases of a cycle at which cycles are compared


@dataclass(frozen=True, eq=False)
class CycleChannel:
    """One channel of K steady cycles.

    Attributes
    ----------
    values : (K, P) array
        At P equal phases of every cycle.
    loop, slope : (P,) arrays
        Mean over the cycles, and its derivative by the phase [per cycle].
    offset, gain, late : (K,) arrays
        Cycle = offset + (1 + gain) (loop − its mean), `late` of a period; by least squares.
    rest : (K, P) array
        What these three do not explain.
    """

    values: Floats
    loop: Floats
    slope: Floats
    offset: Floats
    gain: Floats
    late: Floats
    rest: Floats

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


@once_per_run
def steady_cycles(view: View) -> Cycles | None:
    """Fold the steady cycles of a record; None under one cycle of a periodic motion.

    The first of three or more is left out: it may hold the way in from rest. A cycle with a gap is, too.
    """
    motion = view.motion
    if motion is None:
        return None
    count = int(motion.cycles + 0.02)
    if count < 1:
        return None
    count -= count > 2
    run, period = view.steady, 1 / motion.condition.frequency_Hz
    grid = float(run.time[-1]) - count * period + period * np.arange(count * POINTS) / POINTS
    starts = grid[::POINTS]
    kept = view.without_leap(starts, starts + period)
    if not kept.any():
        return None
    channels = [
        _channel(np.interp(grid, run.time, values).reshape(count, POINTS)[kept])
        for values in (run.displacement, run.force)
    ]
    return Cycles(starts[kept], period, *channels)


def _channel(values: Floats) -> CycleChannel:
    loop = values.mean(axis=0)
    slope = 0.5 * POINTS * (np.roll(loop, -1) - np.roll(loop, 1))
    table = np.column_stack([np.ones(POINTS), loop - loop.mean(), -slope])
    differences = (values - loop).T
    changes = np.linalg.lstsq(table, differences, rcond=1e-9)[0]
    offset, gain, late = changes
    return CycleChannel(values, loop, slope, offset, gain, late, (differences - table @ changes).T)
