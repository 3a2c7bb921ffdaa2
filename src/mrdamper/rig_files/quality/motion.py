"""The motion of a record: that there is one, how many cycles, whether a sine, whether it wanders; the current in it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.data import Floats, held_current
from mrdamper.data.arrays import take
from mrdamper.physics.motion.sines import SINE_DISTORTION_LIMIT
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding, Record

LEAST_MOTION = 20e-6  # [m] peak to peak: below it a displacement sensor's noise
NOISE_MOTION = 500e-6  # [m]: up to here a motion without memory from sample to sample is noise
LEAST_CYCLES = 0.95  # one cycle, less what a cut at a sample takes away
_FEW = 1.5  # cycles under which drift and a slow harmonic cannot be told apart
DRIFT = 0.1  # of the amplitude over the record, for a short one
DRIFT_A_CYCLE = 0.015  # of the amplitude a cycle: less does not open a loop
DRIFT_AT_MOST = 0.3  # of the amplitude over the record, however long
_MOST = 1_000_000  # samples looked at


def moves(view: View) -> None:
    """Refuse a record without motion."""
    x = view.run.displacement
    if x.size < 3:
        raise view.refused("E_NO_EXCITATION", f"{x.size} samples without gaps", "record again: a cycle or more")
    span = float(np.ptp(x))
    # Von Neumann's ratio: one for white noise, near zero for any motion sampled finely enough.
    noise = span < NOISE_MOTION and np.mean(np.diff(x) ** 2) > np.var(x)
    if span < LEAST_MOTION or noise:
        problem = f"the displacement moves {1e3 * span:.3g} mm" + (", which is noise" if noise else "")
        raise view.refused("E_NO_EXCITATION", problem, "check the channel, its unit and the drive")


def cycles_of(view: View) -> float:
    """Length of the steady motion in cycles; for a motion without a period, half its strokes."""
    if view.motion is not None:
        return view.motion.cycles
    return 0.5 * view.strokes.lengths.size


def steady_window(view: View) -> tuple[float, float] | None:
    """Start and end [s] of the last whole steady cycles; None for a motion without a period."""
    if view.record.window is not None:
        return view.record.window
    if view.motion is None:
        return None
    cycles = max(1, int(view.motion.cycles + 0.02))
    first, last = float(view.steady.time[0]), float(view.steady.time[-1])
    return max(first, last - cycles / view.motion.condition.frequency_Hz), last


def enough_cycles(view: View) -> Iterator[Finding]:
    """Report a record shorter than a cycle: it has no frequency and no amplitude."""
    cycles = cycles_of(view)
    if cycles < LEAST_CYCLES:
        yield Finding(
            "W_SHORT",
            "the record holds less than one cycle: no frequency or amplitude is stated, nothing is identified from it",
        )


def is_a_sine(view: View) -> Iterator[Finding]:
    """Report a motion that is no sine: the harmonic balance needs one."""
    if cycles_of(view) < LEAST_CYCLES:
        return
    motion = view.motion
    if motion is None:
        yield Finding("W_NOT_SINE", "the motion has no period: only identification in time can use it")
    elif motion.distortion > SINE_DISTORTION_LIMIT:
        yield Finding(
            "W_NOT_SINE",
            f"distortion of the motion {100 * motion.distortion:.1f} % (limit {100 * SINE_DISTORTION_LIMIT:g} %): "
            "only identification in time can use it",
        )


def drifts(view: View) -> Iterator[Finding]:
    """Report a periodic motion whose amplitude or mean drift over the record."""
    if view.motion is None:
        return
    amplitude = view.motion.condition.amplitude_m
    limit = amplitude * float(np.clip(DRIFT_A_CYCLE * view.motion.cycles, DRIFT, DRIFT_AT_MOST))
    mean, size = drift_of(view)
    for what, drift in (("mean position", mean), ("amplitude", size)):
        if abs(drift) > limit:
            yield Finding(
                "W_DRIFT",
                f"the {what} drifts by {1e3 * drift:+.3g} mm over the record, "
                f"{100 * abs(drift) / amplitude:.0f} % of the amplitude",
            )


def drift_of(view: View) -> tuple[float, float]:
    """Change of mean and of amplitude over the steady motion [m].

    By robust lines through the strokes; of a record with few strokes only the mean, from the
    harmonic fit.
    """
    start, stop = view.strokes.steady or (0, view.run.time.size)
    reversals = view.strokes.reversals
    chosen = reversals[(reversals >= start) & (reversals < stop)]
    if chosen.size < 4:
        if view.motion is None or view.motion.cycles < _FEW:
            return 0.0, 0.0
        return view.motion.drift * float(np.ptp(view.steady.time)), 0.0
    t, x = view.run.time[chosen], view.run.displacement[chosen]
    length = float(view.run.time[stop - 1] - view.run.time[start])
    centre = (x[:-2] + 2 * x[1:-1] + x[2:]) / 4  # half way between a reversal and the mean of its neighbours
    size = np.abs(x[:-2] - 2 * x[1:-1] + x[2:]) / 4
    sound = view.without_leap(t[:-2], t[2:])  # a reversal may be lost in a gap
    if np.count_nonzero(sound) < 2:
        return 0.0, 0.0
    middle = t[1:-1][sound]
    return length * _slope(middle, centre[sound]), length * _slope(middle, size[sound])


def _slope(t: Floats, y: Floats) -> float:
    """Theil and Sen's slope, of at most 200 points."""
    step = max(1, t.size // 200)
    t, y = t[::step], y[::step]
    i, j = np.triu_indices(t.size, 1)
    return float(np.median((y[j] - y[i]) / (t[j] - t[i])))


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
