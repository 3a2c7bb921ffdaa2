"""Samples of a run that a global fit simulates, those of its least squares, and the ranges that runs test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.envelope import Envelope
from mrdamper.data import Condition, Floats, Run, index_at
from mrdamper.data.runs import once_per_run
from mrdamper.errors import RunError
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.sines import centred_motion, equivalent_sine, extreme_strokes

_ROWS = 400  # samples of a steady run that enter the least squares, about
# Samples of a cycle that are simulated: at a reversal, between reversals, at rest.
_SAMPLES_TURNING, _SAMPLES_RUNNING, _SAMPLES_RESTING = 400, 60, 15
_TURNING_VELOCITY_RATIO = 0.4  # of the peak velocity, below which a motion is near a reversal
_REST_CYCLES = 0.05  # cycles of rest around a sample without a reversal
_CURRENT_TOLERANCE = 1e-3  # of the largest current; where it changes by more, every sample is evaluated
_TRANSIENT_WEIGHT = 0.1  # weight of what lies outside a steady window, ramps and rests, against what lies inside
CYCLES = 4  # of a sine that enter: more repeat the same
WARM_UP = 1.5  # cycles before the scored samples in which the effect of the start decays
_REST_VELOCITY_RATIO = 0.01  # share of the peak velocity below which a damper rests


@dataclass(frozen=True, eq=False)
class RunRows:
    """Samples of a run that are simulated, those of the least squares, and their weights by the time they represent.

    The middle cycles of a steady sine are omitted, because they repeat the last ones. Samples before the first motion
    by the amplitude are omitted, because the state of the damper is unknown there.
    """

    motion: Excitation
    picked: NDArray[np.intp]
    target: Floats
    share: Floats
    condition: Condition
    scale: float
    information: float
    changes: bool
    is_sine: bool
    lowest: float
    highest: float
    steady: tuple[int, int]

    @staticmethod
    @once_per_run
    def of(run: Run) -> RunRows:
        sine = equivalent_sine(run)
        motion = centred_motion(run)
        window = np.flatnonzero(run.in_window)
        first, last = int(window[0]), int(window[-1])
        scale = float(np.ptp(run.force[first : last + 1]))
        if scale == 0:
            raise RunError("the force does not change", where=f"run {run.id}", remedy="leave the run out")
        period, time = 1 / sine.condition.frequency_Hz, run.time
        information = 1.0
        followed = _carrying(motion, sine.condition)
        steady = first
        if sine.is_sine:
            steady = max(first, index_at(time, time[last] - CYCLES * period))
            followed &= (time <= time[first] + period) | (time >= time[steady] - WARM_UP * period)
        else:
            information = max(1.0, np.sqrt((time[last] - time[first]) / period))
        at = np.flatnonzero(followed)
        x = motion.displacement
        moved = np.maximum.accumulate(x) - np.minimum.accumulate(x)  # not the travel, which increases at rest by noise
        unknown = min(index_at(moved, sine.condition.amplitude_m), max(first, len(motion) // 4))
        rows = at[(at >= unknown) & (at < len(motion) - 1)]  # the last sample has the velocity toward the next run
        before, inside, after = rows[rows < first], rows[(rows >= steady) & (rows <= last)], rows[rows > last]
        inside = inside[:: max(1, int(inside.size / (_ROWS * information)))]
        every = max(1, (before.size + after.size) // _ROWS)
        before, after = before[::every], after[::every]
        picked = np.concatenate([before, inside, after])
        transient = _TRANSIENT_WEIGHT if before.size + after.size else 0.0
        lasting = [_lasting(time[part]) for part in (before, inside, after)]
        outside = float(lasting[0].sum() + lasting[2].sum())
        sizes = (transient / max(outside, 1e-300), 1 / lasting[1].sum(), transient / max(outside, 1e-300))
        share = np.concatenate([size * part for size, part in zip(sizes, lasting, strict=True)]) / (1 + transient)
        return RunRows(
            motion.part(at),
            np.searchsorted(at, picked),
            run.force[picked],
            share,
            sine.condition,
            scale,
            information,
            run.current_changes,
            sine.is_sine,
            float(np.min(run.displacement)),
            float(np.max(run.displacement)),
            (index_at(at, inside[0]), index_at(at, inside[-1])),
        )

    @property
    def sine(self) -> Condition | None:
        """Condition of a sine at one current; None of any other record."""
        return self.condition if self.is_sine and not self.changes else None

    def steady_end(self) -> RunRows:
        """Return the last cycles of the steady part, of other records the last third: enough to compare starts."""
        kept = np.flatnonzero((self.picked >= self.steady[0]) & (self.picked <= self.steady[1]))
        kept = kept[-_ROWS if self.is_sine else -max(_ROWS, kept.size // 3) :]
        begin, end = int(self.picked[kept[0]]), int(self.picked[kept[-1]]) + 1
        begin = max(0, int(begin - 0.4 * (end - begin)))  # for the decay of the start
        return replace(
            self,
            motion=self.motion.part(slice(begin, end)),
            picked=self.picked[kept] - begin,
            target=self.target[kept],
            share=self.share[kept] / self.share[kept].sum(),
            steady=(int(self.picked[kept[0]]) - begin, end - 1 - begin),
        )


def envelope_of(parts: Sequence[RunRows]) -> Envelope:
    """Return the ranges of the sines at one current, and every sample and the extreme strokes of the others."""
    others = [part for part in parts if part.sine is None]
    strokes = [stroke for part in others if not part.is_sine for stroke in extreme_strokes(part.motion)]
    envelope = Envelope.of([*(part.condition for part in parts), *strokes])
    extent = np.array([[part.lowest, part.highest] for part in others])
    for part in others:
        envelope = envelope.with_motion(part.motion.current, extent, part.motion.velocity, sine=part.is_sine)
    return envelope


def _carrying(motion: Excitation, condition: Condition) -> NDArray[np.bool_]:
    """Return the samples that represent a motion: many near reversals, few elsewhere and at rest.

    The force of a damper changes within a short distance after a reversal and slowly between reversals.
    """
    size, duration = len(motion), float(motion.time[-1] - motion.time[0])
    cycle = (size - 1) / (duration * condition.frequency_Hz)  # samples
    dense = max(1, int(cycle / _SAMPLES_TURNING))
    sparse = dense * max(1, round(cycle / _SAMPLES_RUNNING / dense))
    speed = np.abs(motion.velocity) / condition.peak_velocity
    reach = max(1, int(_REST_CYCLES * cycle))
    moving = np.cumsum(np.concatenate([np.zeros(reach + 1), speed > _REST_VELOCITY_RATIO, np.zeros(reach)]))
    resting = moving[2 * reach + 1 :] == moving[: -2 * reach - 1]
    place = np.arange(size)
    every = np.where(
        resting,
        sparse * round(_SAMPLES_RUNNING / _SAMPLES_RESTING),
        np.where(speed < _TURNING_VELOCITY_RATIO, dense, sparse),
    )
    kept = place % every == 0
    current = np.abs(np.diff(motion.current)) > _CURRENT_TOLERANCE * float(np.max(np.abs(motion.current)))
    kept[:-1] |= current
    kept[1:] |= current
    return kept


def _lasting(time: Floats) -> Floats:
    """(N,) time that each sample represents: half the distance to its neighbours on both sides [s]."""
    if time.size < 2:
        return np.ones(time.size)
    steps = np.diff(time)
    return (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]])) / 2
