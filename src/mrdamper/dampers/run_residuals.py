"""Residuals of the runs a damper was identified from, with the weight each had in the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.prediction import Prediction
from mrdamper.data import Floats, Run, index_at, session_of

_MAX_SAMPLES = 400  # samples of a run that enter
_CYCLES = 4  # of a sine that enter, as in the joint fit
_WARM_UP = 1.5  # cycles before them in which the model forgets its start
_MIN_ERROR_PP = 1e-3  # nrmse_pp below which a run gains no more weight, as in the joint fit


@dataclass(frozen=True, eq=False)
class RunResiduals:
    """Samples of a run that enter, what the fit left of them, and their weight.

    Attributes
    ----------
    run : Run
    session : str or None
        None where it is not known.
    prediction : Prediction
    picked : (N,) array of int
        Samples of the prediction.
    residual : (N,) array
        Predicted minus measured force [N].
    scale : float
        Peak-to-peak measured force [N].
    weight : float
        Of each residual in the fit [1/N].
    frequency : float or None
        Of a sine [Hz].
    """

    run: Run
    session: str | None
    prediction: Prediction
    picked: np.ndarray
    residual: Floats
    scale: float
    weight: float
    frequency: float | None

    @classmethod
    def of(cls, damper: Damper, run: Run) -> RunResiduals:
        """Residuals of a run against a damper; raises E_CLOCK as `session_of`."""
        prediction = damper.predict_run(run)
        first, last = (int(i) for i in np.flatnonzero(run.in_window)[[0, -1]])
        begin = 0
        if prediction.is_sine:
            period = 1 / prediction.condition.frequency_Hz
            first = max(first, index_at(run.time, run.time[last] - _CYCLES * period))
            begin = index_at(run.time, run.time[first] - _WARM_UP * period)
            short = replace(prediction, motion=prediction.motion.part(slice(begin, last + 1)))
            prediction = replace(short, force=damper.force_for(short))
        measured = run.force[first : last + 1 : max(1, (last + 1 - first) // _MAX_SAMPLES)]
        picked = np.arange(first, last + 1, max(1, (last + 1 - first) // _MAX_SAMPLES)) - begin
        residual = prediction.force[picked] - measured
        scale = float(np.ptp(run.force[first : last + 1])) or 1.0
        error = float(np.sqrt(np.mean(residual**2))) / scale
        weight = 1 / (scale * np.sqrt(picked.size) * np.sqrt(max(error, _MIN_ERROR_PP)))
        frequency = prediction.condition.frequency_Hz if prediction.is_sine else None
        return cls(run, session_of(run), prediction, picked, residual, scale, weight, frequency)

    @property
    def predicted(self) -> Floats:
        """Force at the picked samples [N]."""
        return self.prediction.force[self.picked]

    @property
    def measured(self) -> Floats:
        """Measured force at the picked samples [N]."""
        return self.predicted - self.residual


def normal_matrix(slopes: Sequence[Floats], runs: Sequence[RunResiduals]) -> Floats:
    """(P, P) weighted normal matrix of some runs."""
    return np.sum([(s.T @ s) * run.weight**2 for s, run in zip(slopes, runs, strict=True)], axis=0)
