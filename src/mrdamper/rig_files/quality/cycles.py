"""Steady cycles of a record side by side: their mean loop, and the damping that a fault in it changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrdamper.data import Floats, once_per_run
from mrdamper.rig_files.quality.view import View

POINTS = 200  # phases of a cycle at which cycles are compared
_EARLY = 0.02  # of the period: a cycle may begin before the window by so much
NOTED, WARNED, REFUSED = 0.02, 0.05, 0.30  # effect on damping or force: no finding below, and refused from there on
_YIELD = np.geomspace(0.004, 1.0, 14)  # yield displacements tried, of half the stroke


@dataclass(frozen=True, eq=False)
class CycleChannel:
    """One channel of K cycles: each is offset + (1 + gain) (loop − its mean), `late` of a period."""

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
    """Displacement and force of K cycles, by phase."""

    starts: Floats  # (K,) [s]
    period: float  # [s]
    displacement: CycleChannel
    force: CycleChannel

    def read(self, loop: Floats, time: Floats) -> Floats:
        """(N,) values of a (P,) loop at times [s], by linear interpolation."""
        place = (time - self.starts[0]) / self.period % 1.0 * POINTS
        return np.interp(place, np.arange(POINTS + 1), np.append(loop, loop[0]))


@once_per_run
def every_cycle(view: View) -> Cycles | None:
    """Fold the cycles of a record without a gap, up to its end; None under one cycle of a periodic motion."""
    motion, count = view.motion, view.whole_cycles
    if motion is None or not count:
        return None
    run, period = view.steady, 1 / motion.condition.frequency_Hz
    grid = float(run.time[-1]) - count * period + period * np.arange(count * POINTS) / POINTS
    starts = grid[::POINTS]
    kept = view.without_leap(starts, starts + period)
    if not kept.any():
        return None
    channels = (np.interp(grid, run.time, v).reshape(count, POINTS)[kept] for v in (run.displacement, run.force))
    return Cycles(starts[kept], period, *map(_channel, channels))


@once_per_run
def steady_cycles(view: View) -> Cycles | None:
    """Return the steady cycles of a record beside each other; None under one cycle of a periodic motion.

    The first of three or more is omitted: it may contain the start from rest. A cycle with a gap is, too, and one
    before the window of a run that states one.
    """
    every = every_cycle(view)
    if every is None:
        return None
    count = round((float(view.steady.time[-1]) - every.starts[0]) / every.period)
    first = int(count > 2 and count == view.whole_cycles)
    if view.record.window is not None:
        before = every.starts < view.record.window[0] - _EARLY * every.period
        first = max(first, int(np.count_nonzero(before)))
    if first == every.starts.size:
        return None
    channels = (_channel(channel.values[first:]) for channel in (every.displacement, every.force))
    return Cycles(every.starts[first:], every.period, *channels)


def _channel(values: Floats) -> CycleChannel:
    loop = values.mean(axis=0)
    slope = 0.5 * POINTS * (np.roll(loop, -1) - np.roll(loop, 1))
    table = np.column_stack([np.ones(POINTS), loop - loop.mean(), -slope])
    differences = (values - loop).T
    changes = np.linalg.lstsq(table, differences, rcond=1e-9)[0]
    offset, gain, late = changes
    return CycleChannel(values, loop, slope, offset, gain, late, (differences - table @ changes).T)


def elastic_plastic(x: Floats, rising: np.ndarray, yields: Floats) -> Floats:
    """(P, Y) steady states, in -1...1, of elastic–plastic elements over one cycle of two strokes.

    Of displacements x (P,) [m], rising where the velocity is positive, and yield displacements (Y,) [m], of which at
    most half the stroke acts.
    """
    low, high = float(np.min(x)), float(np.max(x))
    bend = np.minimum(yields, 0.5 * (high - low))
    state = np.where(rising[:, None], x[:, None] - low - bend, x[:, None] - high + bend)
    return np.clip(state, -bend, bend) / bend


def damping(x: Floats, v: Floats, force: Floats) -> float:
    """Fit F = f0 + k x + c v + an elastic–plastic force of free yield displacement to one cycle of equal phases (P,).

    Returns c, in the units given; NaN where the motion determines none.
    """
    half, fastest = 0.5 * float(np.ptp(x)), float(np.max(np.abs(v)))
    if half == 0 or fastest == 0:
        return np.nan
    base = np.column_stack([np.ones_like(x), (x - np.mean(x)) / half, v / fastest])
    elements = elastic_plastic(x, v > 0, _YIELD * half)
    tables = np.concatenate([np.broadcast_to(base, (_YIELD.size, *base.shape)), elements.T[:, :, None]], axis=2)
    normal = tables.transpose(0, 2, 1) @ tables
    normal[:, range(4), range(4)] *= 1 + 1e-9
    right = tables.transpose(0, 2, 1) @ force
    solution = np.linalg.solve(normal, right[..., None])[..., 0]
    explained = np.sum(right * solution, axis=1)
    return float(solution[int(np.argmax(explained)), 2]) / fastest


def effect_on(cycles: Cycles, clean: Floats) -> tuple[float, float]:
    """Relative change of damping and peak force by a fault, from the (P,) mean cycle of the force without it."""
    motion, force = cycles.displacement, cycles.force
    before, after = (damping(motion.loop, motion.slope, loop) for loop in (clean, force.loop))
    return change(before, after), change(float(np.ptp(clean)), force.span)


def percent_of(moved: float, peak: float) -> str:
    """Write an effect on damping and peak force for a message."""
    return f"the damping by {percent(moved)} and the peak force by {percent(peak)}"


def change(before: float, after: float) -> float:
    """Relative change of a figure; infinite where there is none to begin with."""
    return abs(after / before - 1) if before else np.inf


def percent(share: float) -> str:
    """Write an estimated share for a message."""
    return "over 100 %" if not share < 1 else f"about {100 * share:.2g} %"
