"""Strokes of a motion: monotone motions between prominent reversals, and the part of the motion in which they agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrdamper.data.arrays import Floats

_PROMINENCE = 0.1  # of the peak-to-peak motion: smaller turns are noise or a ramp
_ALIKE = 0.2  # strokes of a steady motion agree in length and duration to this share
_RAMP = 0.03  # a stroke at the end that is off by more belongs to a ramp
_REST = 0.01  # of a stroke: a motion within so much of its last value rests
_WITHIN = 0.9  # of a stroke: beyond, a sine turns as slowly as it rests
_LONGEST_REST = 0.03  # of a stroke's duration: three times that of a sine there
_SHARE = 0.5  # of the strokes must be steady for a motion to be called periodic
_APPROACH_STROKES = 4  # prominent reversals, at most, before the steady part of a motion and after it


@dataclass(frozen=True, eq=False)
class Strokes:
    """Monotone motions between reversals."""

    reversals: np.ndarray  # (K,) int, samples
    lengths: Floats  # (K−1,) of the strokes between them [m]
    durations: Floats  # (K−1,) [s]
    steady: tuple[int, int] | None  # half-open sample range of regular strokes, where most strokes are
    period: float | None  # twice the median duration of a stroke [s]; None without two reversals


def find_strokes(time: Floats, displacement: Floats) -> Strokes:
    """Cut a motion [m] over time [s] at its reversals."""
    reversals = _reversals(displacement)
    lengths = np.abs(np.diff(displacement[reversals]))
    durations = np.diff(time[reversals])
    period = float(2 * np.median(durations)) if durations.size else None
    steady = _steady(time, displacement, reversals, lengths, durations)
    return Strokes(reversals, lengths, durations, steady, period)


def steady_part(time: Floats, displacement: Floats) -> slice:
    """Return the samples of a motion [m] over time [s] without its approach and its return to rest.

    All of them, if the motion has no steady part, or more than a short motion beside it.
    """
    strokes, every = find_strokes(time, displacement), slice(0, time.size)
    inside = every if strokes.steady is None else slice(*strokes.steady)
    beside = strokes.reversals < inside.start, strokes.reversals >= inside.stop
    return inside if max(map(np.count_nonzero, beside)) <= _APPROACH_STROKES else every


def runs_of(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return starts and (excluded) stops of all runs of true values."""
    edges = np.flatnonzero(mask[1:] != mask[:-1]) + 1
    bounds = np.concatenate([[0], edges, [mask.size]])
    first = 0 if mask.size and mask[0] else 1
    return bounds[:-1][first::2], bounds[1:][first::2]


def longest_run(mask: np.ndarray) -> tuple[int, int]:
    """Length and start of the longest run of true values; 0 and 0 where there is none."""
    starts, stops = runs_of(mask)
    longest = int(np.argmax(stops - starts)) if starts.size else 0
    return (int(stops[longest] - starts[longest]), int(starts[longest])) if starts.size else (0, 0)


def _reversals(x: Floats) -> np.ndarray:
    """Find reversals prominent on both sides, as scipy.signal.find_peaks does, which takes half a second to import."""
    least = _PROMINENCE * float(np.ptp(x))
    if not least > 0:
        return np.empty(0, dtype=int)
    moves = np.diff(x)
    moving = np.flatnonzero(moves)
    rising = moves[moving] > 0
    turn = np.flatnonzero(rising[1:] != rising[:-1])
    turns = (moving[turn] + 1 + moving[turn + 1]) // 2  # the middle of a dwell
    reversals: list[int] = []
    top = bottom = (float(x[0]), -1)
    up: bool | None = None  # until the motion has gone far enough in one direction
    for value, at in (*zip(x[turns].tolist(), turns.tolist(), strict=True), (float(x[-1]), -1)):
        if up is not False and value > top[0]:
            top = value, at
        if up is not True and value < bottom[0]:
            bottom = value, at
        if up is not False and value <= top[0] - least:
            reversals += [top[1]] if up else []
            up, bottom = False, (value, at)
        elif up is not True and value >= bottom[0] + least:
            reversals += [bottom[1]] if up is False else []
            up, top = True, (value, at)
    return np.array(reversals, dtype=int)


def _steady(
    time: Floats, x: Floats, reversals: np.ndarray, lengths: Floats, durations: Floats
) -> tuple[int, int] | None:
    if lengths.size < 3:
        return None  # too few to tell a ramp from the motion
    length, duration = np.median(lengths), np.median(durations)
    alike = (np.abs(lengths / length - 1) < _ALIKE) & (np.abs(durations / duration - 1) < _ALIKE)
    count, first = longest_run(alike)
    if count < max(3, _SHARE * lengths.size):
        return None
    first, last = _without_ramps(lengths, first, first + count)
    start, stop = int(reversals[first]), int(reversals[last]) + 1
    if first == 0:
        start = _reach(time, x, start, -1, duration, length)
    if last == lengths.size:
        stop = _reach(time, x, stop - 1, 1, duration, length) + 1
    return start, stop


def _without_ramps(lengths: Floats, first: int, last: int) -> tuple[int, int]:
    """Leave out strokes at the ends that differ from the others by more than these among themselves.

    A motion that drifts differs as much in its middle; a ramp only at the ends.
    """
    middle = np.median(lengths[first:last])
    usual = max(_RAMP * middle, 4 * np.median(np.abs(lengths[first:last] - middle)))
    while last - first > 2 and abs(lengths[first] - middle) > usual:
        first += 1
    while last - first > 2 and abs(lengths[last - 1] - middle) > usual:
        last -= 1
    return first, last


def _reach(time: Floats, x: Floats, reversal: int, direction: int, duration: float, length: float) -> int:
    """Go on from an outermost reversal to the record's end, if that is about a stroke away, or to a rest within it.

    About: a reversal close to the record's end does not stand out and is not found.
    """
    end = 0 if direction < 0 else time.size - 1
    if abs(time[end] - time[reversal]) > 1.25 * duration:
        return reversal
    away = np.abs(x[reversal::direction] - x[end]) > _REST * length
    rest = reversal + direction * int(np.max(np.flatnonzero(away), initial=-1) + 1)
    stops = abs(x[end] - x[reversal]) < _WITHIN * length and abs(time[end] - time[rest]) > _LONGEST_REST * duration
    return rest if stops else end
