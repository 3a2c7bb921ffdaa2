"""The view of a record that the checks use: its channels without holes, the motion in them, and its reversals.

Physics is checked on at most `MOST_SAMPLES` samples of a record, so that a long record takes
no longer than a short one; counts (missing, repeated, frozen) are of all samples.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from mrdamper.data import Floats, Run
from mrdamper.data.arrays import take
from mrdamper.errors import ExcitationError, QualityError
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.measured import measured_motion
from mrdamper.physics.motion.sines import MotionAnalysis, analyse_motion
from mrdamper.rig_files.record import Finding, Record
from mrdamper.statistics.peaks import sample_noise

MOST_SAMPLES = 40_000
SHORTEST = 5  # samples of a segment; a slope needs as many
_UNEXPLAINED = 0.3  # of the motion's standard deviation: more is no periodic motion
_HOLE = 0.03  # of a period without samples: more of a loop may be missing than a line can bridge
_FITTED, _FITTED_A_PERIOD = 600, 40  # samples, and per period, that determine the sine of the motion
_FINE = 200  # samples per period that are enough for every figure here
_PROMINENCE = 0.1  # of the peak-to-peak motion: smaller turns are noise or a ramp
_ALIKE = 0.2  # strokes of a steady motion agree in length and duration to this share
_RAMP = 0.03  # a stroke at the end that is off by more belongs to a ramp
_REST = 0.01  # of a stroke: a motion within so much of its last value rests
_WITHIN = 0.9  # of a stroke: beyond, a sine turns as slowly as it rests
_LONGEST_REST = 0.03  # of a stroke's duration: three times that of a sine there
_SHARE = 0.5  # of the strokes must be steady for a motion to be called periodic


@dataclass(eq=False)
class View:
    """A record under judgement."""

    record: Record
    segments: tuple[tuple[int, int], ...] = ()  # half-open sample ranges without a gap; one until `clock` has looked
    found: list[Finding] = field(default_factory=list)  # what the checks so far have noticed

    def __post_init__(self) -> None:
        self.segments = self.record.segments or ((0, self.record.time.size),)

    @property
    def where(self) -> str:
        """Name of the record in messages."""
        return self.record.provenance.get("file", "") or f"run {self.record.id}"

    def refused(self, code: str, problem: str, remedy: str) -> QualityError:
        """Return the refusal of the record."""
        return QualityError(problem, where=self.where, remedy=remedy, code=code)

    def place(self, sample: int) -> str:
        """Place of a sample in its file: its line, or its number."""
        lines = self.record.lines
        return f"at sample {sample}" if lines is None else f"in line {int(lines[sample])}"

    @cached_property
    def channels(self) -> dict[str, Floats]:
        """The channels there are, by name."""
        return self.record.channels

    def noticed(self, *codes: str) -> bool:
        """Check that one of these findings was made."""
        return any(finding.code in codes for finding in self.found)

    def has_changed_sign(self, channel: str) -> bool:
        """Check that the sign of a channel was changed, by the profile or by a line of the file."""
        return channel in self.record.provenance.get("sign_changed", "").split(", ")

    @cached_property
    def step(self) -> float:
        """Usual step of time [s]."""
        time = self.record.time
        at = np.arange(0, time.size - 1, max(1, time.size // MOST_SAMPLES))
        steps = take(time, at + 1) - take(time, at)
        steps = steps[np.isfinite(steps)]
        return float(np.median(steps)) if steps.size else 0.0

    @cached_property
    def run(self) -> Run:
        """The samples that are there, thinned to what the physics needs, without a window."""
        index = self.index
        current = self.record.current
        bounds = np.searchsorted(index, [a for a, _ in self.segments] + [self.segments[-1][1]])
        return Run(
            id=self.record.id,
            time=take(self.record.time, index),
            displacement=take(self.record.displacement, index),
            force=take(self.record.force, index),
            current=np.zeros(index.size) if current is None else take(current, index),
            segments=tuple((int(a), int(b)) for a, b in pairwise(bounds) if b > a),
        )

    @cached_property
    def strokes(self) -> Strokes:
        """Reversals of the motion, and the part in which they are regular: of segments, in the longest."""
        time, x, segments = self.run.time, self.run.displacement, self.run.segments or ()
        result = find_strokes(time, x)
        if result.steady is not None or len(segments) < 2:
            return result
        start, stop = max(segments, key=lambda ends: ends[1] - ends[0])
        inside = find_strokes(time[start:stop], x[start:stop]).steady
        if inside is None and result.period is not None and time[stop - 1] - time[start] >= result.period:
            inside = 0, stop - start
        return result if inside is None else replace(result, steady=(start + inside[0], start + inside[1]))

    @cached_property
    def steady_samples(self) -> slice:
        """Samples of `run` in the part of steady motion; all of them where there is none."""
        return slice(*(self.strokes.steady or (0, self.run.time.size)))

    @cached_property
    def steady(self) -> Run:
        """The part of steady motion; the whole run where there is none."""
        return self.run.part(self.steady_samples.start, self.steady_samples.stop)

    @cached_property
    def motion(self) -> MotionAnalysis | None:
        """The sine of the steady part; None under a cycle, or where no sine with harmonics and drift explains it."""
        try:
            analysis = analyse_motion(self._thinned(self.steady))
        except ExcitationError:
            return None
        return analysis if analysis.residual < _UNEXPLAINED * float(np.std(self.steady.displacement)) else None

    @cached_property
    def whole_cycles(self) -> int:
        """Whole cycles of the steady part, one that a cut at a sample shortens among them; 0 without a period."""
        return 0 if self.motion is None else int(self.motion.cycles + 0.02)

    def _thinned(self, run: Run) -> Run:
        """Leave out samples that a sine of this period does not need, but not the last."""
        if len(run.segments) > 1 or self.strokes.period is None:
            return run
        periods = float(run.time[-1] - run.time[0]) / self.strokes.period
        size = max(_FITTED, int(_FITTED_A_PERIOD * periods))
        if run.time.size < 2 * size:
            return run
        kept = np.linspace(0, run.time.size - 1, size).astype(int)
        return Run(run.id, run.time[kept], run.displacement[kept], run.force[kept], np.zeros(size))

    @cached_property
    def force_noise(self) -> float:
        """Standard deviation of the white noise on the force of the steady part [N]."""
        return sample_noise(self.steady.force)

    @cached_property
    def moving(self) -> Excitation:
        """Smooth motion over all of `run`."""
        return measured_motion(self.run)

    @cached_property
    def index(self) -> np.ndarray:
        """Samples of the record that `run` is made of.

        All that are there; of a long record, the middle at about 200 samples a period.
        """
        record = self.record
        if record.time.size <= MOST_SAMPLES:
            return self._in_segments(np.flatnonzero(record.present))
        most = record.time.size // MOST_SAMPLES
        coarse = self._there(np.arange(0, record.time.size, most))
        period = find_strokes(take(record.time, coarse), take(record.displacement, coarse)).period
        stride = 1 if period is None or self.step <= 0 else int(np.clip(period / self.step / _FINE, 1, most))
        thinned = np.arange(0, record.time.size, stride)
        middle = max(0, thinned.size - MOST_SAMPLES) // 2
        return self._in_segments(self._there(thinned[middle : middle + MOST_SAMPLES]))

    def without_leap(self, starts: Floats, stops: Floats) -> np.ndarray:
        """(K,) mask of the stretches of time in which, ends included, no hole of the motion lies."""
        time, period = self.run.time, self.strokes.period
        if len(self.segments) < 2 or period is None:
            return np.ones(starts.size, dtype=bool)
        before = np.flatnonzero(np.diff(time) > _HOLE * period)
        inside = (time[before] <= stops[:, None]) & (time[before + 1] >= starts[:, None])
        return np.asarray(~inside.any(axis=1))

    def _in_segments(self, index: np.ndarray) -> np.ndarray:
        """Leave out segments of so few samples that they have no slope."""
        parts = np.split(index, np.searchsorted(index, [a for a, _ in self.segments[1:]]))
        return np.concatenate([part for part in parts if part.size >= SHORTEST] or [index[:0]])

    def _there(self, index: np.ndarray) -> np.ndarray:
        channels = (self.record.time, self.record.displacement, self.record.force, self.record.current)
        return index[np.all([np.isfinite(take(c, index)) for c in channels if c is not None], axis=0)]


def shown(name: str, value: float, form: str = ".4g") -> str:
    """Write a displacement [m], in millimetres, or a force [N] for a message."""
    return f"{1e3 * value:{form}} mm" if name == "displacement" else f"{value:{form}} N"


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


def strokes_of(record: Record) -> Strokes:
    """Cut the motion of a record at its reversals, thinned where it is long."""
    thinned = slice(None, None, max(1, record.time.size // MOST_SAMPLES))
    return find_strokes(record.time[thinned], record.displacement[thinned])


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
