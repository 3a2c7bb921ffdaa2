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
from mrdamper.physics.motion.strokes import Strokes, find_strokes
from mrdamper.rig_files.record import Finding, Record
from mrdamper.statistics.peaks import sample_noise

MOST_SAMPLES = 40_000
SHORTEST = 5  # samples of a segment; a slope needs as many
_UNEXPLAINED = 0.3  # of the motion's standard deviation: more is no periodic motion
_HOLE = 0.03  # of a period without samples: more of a loop may be missing than a line can bridge
_FITTED, _FITTED_A_PERIOD = 600, 40  # samples, and per period, that determine the sine of the motion
_FINE = 200  # samples per period that are enough for every figure here


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


def strokes_of(record: Record) -> Strokes:
    """Cut the motion of a record at its reversals, thinned where it is long."""
    thinned = slice(None, None, max(1, record.time.size // MOST_SAMPLES))
    return find_strokes(record.time[thinned], record.displacement[thinned])
