"""Short versions of runs for the comparison of all runs with each other: a few hundred samples of motion and force.

The last cycles of a sine and the whole steady window of other motions are used; the samples are dense enough for
hysteresis operators, and some of them are the rows of the regression.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Self

import numpy as np

from mrdamper.data import Floats, Run, index_at, session_of
from mrdamper.errors import InputError
from mrdamper.physics.motion.measured import measured_motion
from mrdamper.physics.motion.sines import equivalent_sine

_CYCLES = 3  # cycles of a sine that are compared
_SAMPLES_PER_CYCLE = 96  # samples of the motion
_MAX_SAMPLES = 1500  # samples of a motion that is no sine
_ROWS = 144  # rows of the regression per run
SAME_CURRENT = 0.01  # difference of two currents that are one [A]
_SAME_MOTION = 0.04  # relative difference of frequencies and amplitudes that are one


@dataclass(frozen=True, eq=False)
class Track:
    """The short version of a run."""

    run: Run
    # time, displacement, velocity and acceleration: (L,) [s], [m] about its mean, [m/s], [m/s²]
    time: Floats
    displacement: Floats
    velocity: Floats
    acceleration: Floats
    force: Floats  # (L,) [N]
    current: Floats  # (L,) magnitude [A]
    current_changes: bool
    rows: np.ndarray  # (R,) samples that are rows of the regression
    half_range: float  # half the peak-to-peak force, without its outermost samples [N]
    # frequency and amplitude: of a sine [Hz], [m]; zero for other motions
    frequency: float
    amplitude: float
    step: float  # time between two samples of the run [s]

    def scaled(self, motion: float = 1.0, time: float = 1.0) -> Self:
        """Return the same test with displacement and time multiplied by factors; a negative one inverts the motion."""
        return replace(
            self,
            time=self.time if time == 1.0 else self.time * time,
            displacement=self.displacement * motion,
            velocity=self.velocity * (motion / time),
            acceleration=self.acceleration * (motion / time**2),
            frequency=self.frequency / time,
            amplitude=self.amplitude * abs(motion),
            step=self.step * time,
        )

    @property
    def session(self) -> str:
        """Name of the session of the test, if it is stated."""
        try:
            return session_of(self.run) or ""
        except InputError:
            return ""

    def is_at_motion(self, other: Track) -> bool:
        """Tell whether two runs are sines of one frequency and amplitude."""
        return (
            self.frequency > 0
            and abs(self.frequency - other.frequency) <= _SAME_MOTION * other.frequency
            and abs(self.amplitude - other.amplitude) <= _SAME_MOTION * other.amplitude
        )

    def is_at_current(self, other: Track) -> bool:
        """Tell whether two runs have one constant current."""
        if self.current_changes or other.current_changes:
            return False
        return abs(float(self.current[0]) - float(other.current[0])) <= SAME_CURRENT


def tracks_of(runs: Sequence[Run]) -> list[Track]:
    """Make the short versions of the runs that move; others are omitted."""
    tracks: list[Track] = []
    for run in runs:
        try:
            tracks.append(_track(run))
        except InputError:
            continue
    return tracks


def irregularity(tracks: Sequence[Track], currents: Sequence[float]) -> int:
    """Repeated tests, and empty cells of the matrix of currents [A] and motions, of tests at constant current."""
    return _irregularity(tuple((t.frequency, t.amplitude) for t in tracks), tuple(currents))


@lru_cache
def _irregularity(motions: tuple[tuple[float, float], ...], currents: tuple[float, ...]) -> int:
    sizes = np.reshape(motions, (-1, 2))
    alike = np.all(np.abs(sizes[:, None] - sizes) <= _SAME_MOTION * sizes, axis=2) & (sizes[:, :1] > 0)
    runs = alike | np.eye(len(motions), dtype=bool)
    first: list[int] = np.argmax(runs, axis=0).tolist() if motions else []  # run at each motion
    cells = set(zip(currents, first, strict=True))
    return len(motions) - len(cells) + len(set(currents)) * len(set(first)) - len(cells)


def _track(run: Run) -> Track:
    sine = equivalent_sine(run)
    motion = measured_motion(run)
    inside = np.flatnonzero(run.in_window)
    if inside.size < 3:
        inside = np.arange(run.time.size)
    start, stop = int(inside[0]), int(inside[-1]) + 1
    duration = float(run.time[stop - 1] - run.time[start])
    wanted = _MAX_SAMPLES
    if sine.is_sine:
        cycles = min(_CYCLES, duration * sine.condition.frequency_Hz)
        wanted = int(_SAMPLES_PER_CYCLE * max(cycles, 0.5))
        start = index_at(run.time, run.time[stop - 1] - cycles / sine.condition.frequency_Hz)
    index = np.unique(np.linspace(start, stop - 1, min(wanted, stop - start)).astype(int))
    x = motion.displacement[index]
    rows = np.unique(np.linspace(0, index.size - 1, min(_ROWS, index.size)).astype(int))
    if sine.is_sine:
        rows = rows[rows >= index.size // 3]  # the first cycle is transient for the hysteresis operators
    force = _averaged(run.force, index)
    low, high = np.percentile(force, (1, 99))
    return Track(
        run,
        run.time[index],
        x - float(np.mean(x)),
        motion.velocity[index],
        motion.acceleration[index],
        force,
        np.abs(motion.current[index]),
        run.current_changes,
        rows,
        float(high - low) / 2,
        sine.condition.frequency_Hz if sine.is_sine else 0.0,
        sine.condition.amplitude_m if sine.is_sine else 0.0,
        float(run.time[-1] - run.time[0]) / (run.time.size - 1),
    )


def _averaged(signal: Floats, index: np.ndarray) -> Floats:
    half = int(np.median(np.diff(index))) // 4 if index.size > 1 else 0
    if half == 0:
        return signal[index]
    total = np.concatenate([[0.0], np.cumsum(signal)])
    low, high = np.maximum(index - half, 0), np.minimum(index + half + 1, signal.size)
    return (total[high] - total[low]) / (high - low)
