"""Residuals of the runs of a damper, with the weight of each sample in the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.base import Damper
from mrdamper.dampers.concatenated_runs import MIN_ERROR_PP
from mrdamper.dampers.prediction import Prediction
from mrdamper.dampers.run_rows import CYCLES, WARM_UP, RunRows
from mrdamper.data import Floats, Run, index_at, session_of

_MAX_SAMPLES = 400  # samples of a run that enter
_MIN_STRETCH = 10  # samples for the spectrum of a residual


@dataclass(frozen=True, eq=False)
class Stretch:
    """Evenly spaced samples of a run: their residuals have a spectrum."""

    # time, velocity, predicted and residual: (M,) [s], [m/s], [N], and predicted minus measured force [N]
    time: Floats
    velocity: Floats
    predicted: Floats
    residual: Floats
    weight: float  # of each residual in the fit [1/N]
    frequency: float | None  # of a steady sine [Hz]

    @classmethod
    def of(cls, whole: Prediction, run: Run, samples: slice, square: float, frequency: float | None = None) -> Stretch:
        """Of a prediction along a whole run, with the sum of its squared weights."""
        motion, predicted = whole.motion.part(samples), whole.force[samples]
        weight = float(np.sqrt(square / predicted.size))
        return cls(motion.time, motion.velocity, predicted, predicted - run.force[samples], weight, frequency)


@dataclass(frozen=True, eq=False)
class RunResiduals:
    """Samples of a run in the fit, their residuals, and their weights."""

    run: Run
    session: str | None  # None where it is not known
    prediction: Prediction  # along the samples that are simulated
    # (N,) samples of the prediction: those of the joint fit, ramps and rests among them, where one model describes the
    # damper, else evenly spaced ones of the steady window
    picked: NDArray[np.intp]
    residual: Floats  # (N,) predicted minus measured force [N]
    scale: float  # peak-to-peak measured force [N]
    error: float  # nrmse_pp, by the time that samples represent; at least that from which a run gains no more weight
    information: float  # weight of the run by its length, as in the joint fit
    weight: Floats  # (N,) of each residual in the fit [1/N]
    stretches: Sequence[Stretch]  # the steady window, then the samples before and after it

    @classmethod
    def of(cls, damper: Damper, run: Run) -> RunResiduals:
        """Residuals of a run against a damper; raises E_CLOCK as `session_of`."""
        whole = damper.predict(run)
        frequency = whole.condition.frequency_Hz if whole.is_sine else None
        window = np.flatnonzero(run.in_window)
        first, last = int(window[0]), int(window[-1])
        if whole.is_sine:
            first = max(first, index_at(run.time, run.time[last] - CYCLES / whole.condition.frequency_Hz))
        if damper.one_model is None:
            begin = index_at(run.time, run.time[first] - WARM_UP / frequency) if frequency else 0
            motion, information = whole.motion.part(slice(begin, last + 1)), 1.0
            picked = np.arange(first - begin, last + 1 - begin, max(1, (last + 1 - first) // _MAX_SAMPLES))
            target, share = run.force[picked + begin], np.full(picked.size, 1 / picked.size)
            scale = float(np.ptp(run.force[first : last + 1])) or 1.0
        else:
            rows = RunRows.of(run)
            motion, picked, target, share = rows.motion, rows.picked, rows.target, rows.share
            scale, information = rows.scale, rows.information
        prediction = replace(whole, motion=motion)
        prediction = replace(prediction, force=damper.force_for(prediction))
        residual = prediction.force[picked] - target
        error = max(float(np.sqrt(share @ residual**2)) / scale, MIN_ERROR_PP)
        weight = information * np.sqrt(share / error) / scale
        time, stretches = motion.time[picked], list[Stretch]()
        for inside in (
            (time >= run.time[first]) & (time <= run.time[last]), time < run.time[first], time > run.time[last]
        ):  # fmt: skip
            if np.count_nonzero(inside) < min(_MIN_STRETCH, picked.size):
                continue
            begin, end = (index_at(run.time, float(t)) for t in time[inside][[0, -1]])
            every = max(1, (end + 1 - begin) // _MAX_SAMPLES)
            square = float(np.sum(weight[inside] ** 2))
            of_window = frequency if not stretches else None
            stretches.append(Stretch.of(whole, run, slice(begin, end + 1, every), square, of_window))
        return cls(
            run, session_of(run), prediction, picked, residual, scale, error, information, weight, tuple(stretches)
        )

    @property
    def predicted(self) -> Floats:
        """Force at the picked samples [N]."""
        return self.prediction.force[self.picked]

    @property
    def measured(self) -> Floats:
        """Measured force at the picked samples [N]."""
        return self.predicted - self.residual

    def weighted(self, table: Floats) -> Floats:
        """Return a table of the picked samples (N, ·) by their weights."""
        return table * self.weight[:, None]

    def evenly(self, table: Floats, stretch: Stretch) -> Floats:
        """Return a table of the picked samples (N, ·) at those of a stretch."""
        time = self.prediction.motion.time[self.picked]
        even: Floats = np.zeros((stretch.time.size, table.shape[1]))
        for i, column in enumerate(table.T):
            even[:, i] = np.interp(stretch.time, time, column)
        return even


def normal_matrix(slopes: Sequence[Floats], runs: Sequence[RunResiduals]) -> Floats:
    """(P, P) weighted normal matrix of some runs."""
    weighted = [run.weighted(slope) for slope, run in zip(slopes, runs, strict=True)]
    return np.sum([table.T @ table for table in weighted], axis=0)
