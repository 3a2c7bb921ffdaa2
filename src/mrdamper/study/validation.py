"""Scores of a damper on runs not used for its identification."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Any

import numpy as np

from mrdamper.dampers.bands import band, session_band
from mrdamper.dampers.base import Damper
from mrdamper.dampers.calibration import PredictedRun, measured_peak, steady_samples
from mrdamper.dampers.prediction import Prediction, distance_from_tests
from mrdamper.dampers.sessions import KNOWN, UNKNOWN, GainOffset, RecordingTime, SessionCorrection, Sessions
from mrdamper.data import Condition, Displayable, Run
from mrdamper.data.wording import counted, number
from mrdamper.errors import InputError, RunError, UnknownNameError, require, validate_arguments
from mrdamper.statistics.metrics import Scores, dissipated_power, score

SCORES = ("nrmse_pp", "nrmse_std", "wape", "energy_error", "peak_error")  # columns of a run in tables
_MIN_SWING_N = 1e-100  # smallest force, and its inverse the largest [N], whose squares are finite


@dataclass(frozen=True, eq=False)
class RunScore:
    """Scores of the prediction of one run, inside its steady window."""

    run_id: str
    rig: str
    condition: Condition  # of the sine that is equivalent to the measured motion
    scores: Scores
    floor: float | None  # cycle-to-cycle scatter of the run as nrmse_pp
    extrapolation: tuple[str, ...]  # quantities outside the tests the damper was identified from
    rest: float | None = None  # RMS error at rest, anywhere in the record, over the peak-to-peak force
    session: str = UNKNOWN  # predicted as it is, or corrected by other runs of its session
    reading: GainOffset | None = None  # of the best fit to the run; no score is corrected by them
    predicted: PredictedRun | None = None  # samples of the uncorrected prediction and the measured ones


@dataclass(frozen=True, eq=False, repr=False)
class Validation(Displayable):
    """Scores of several runs."""

    title: str  # what was validated
    runs: tuple[RunScore, ...]
    refused: Mapping[str, str] = field(default_factory=dict[str, str])  # runs that could not be scored, and why

    @property
    def headline(self) -> str:
        """Title, runs, and the median error."""
        refused = f", {len(self.refused)} refused" if self.refused else ""
        return f"{self.title}: {counted(len(self.runs), 'run')}{refused}, median nrmse_pp {100 * self.median():.2f} %"

    @property
    def table(self) -> Mapping[str, Sequence[Any]]:
        """One row per run."""
        return {
            "run_id": [run.run_id for run in self.runs],
            **{name: [float(getattr(run.scores, name)) for run in self.runs] for name in SCORES},
            "session": [run.session for run in self.runs],
            "extrapolation": [" ".join(run.extrapolation) for run in self.runs],
        }

    @validate_arguments()
    def median(self, name: str = "nrmse_pp") -> float:
        """Median of a score over the runs; signed errors count by magnitude."""
        return float(np.median(self._magnitudes(name))) if self.runs else float("nan")

    @validate_arguments()
    def worst(self, name: str = "nrmse_pp") -> RunScore:
        """Return the run with the largest magnitude of a score."""
        magnitudes = self._magnitudes(name)
        if not magnitudes:
            raise RunError("no run was scored", where=self.title, remedy="see `refused`")
        return self.runs[int(np.argmax(magnitudes))]

    @validate_arguments()
    def worst_error(self, name: str = "nrmse_pp") -> float:
        """Largest magnitude of a score; NaN without runs."""
        return max(self._magnitudes(name), default=float("nan"))

    def _magnitudes(self, name: str) -> list[float]:
        names = [one.name for one in fields(Scores)]
        if name not in names:
            raise UnknownNameError.of("score", name, names)
        return [abs(float(getattr(run.scores, name))) for run in self.runs]

    @validate_arguments()
    def only(self, run_ids: Collection[str]) -> Validation:
        """Return the scores of some runs."""
        return replace(self, runs=tuple(run for run in self.runs if run.run_id in run_ids))


@validate_arguments("damper")
def validate(
    damper: Damper, runs: Iterable[Run], title: str | None = None, *, sessions: Sessions | None = None
) -> Validation:
    """Predict runs from their measured motion and score them inside their steady windows.

    A run that cannot be predicted, for example without motion, is listed among the `refused` with the reason.

    Parameters
    ----------
    damper : Damper
    runs : iterable of Run
    title : str, optional
        Default: the damper's.
    sessions : Sessions, optional
        Known sessions of the runs (`sessions_known`); by default none, and no correction.

    Raises
    ------
    RunError
        If none of the runs can be predicted.

    Examples
    --------
    >>> from mrdamper import identify, load_dataset, validate
    >>> from mrdamper.dampers.modified import fit_modified
    >>> runs = load_dataset().rig("utfsm").split("train")[:8]
    >>> damper = fit_modified([identify(run, "bingham") for run in runs]).damper
    >>> scores = validate(damper, load_dataset().rig("utfsm").split("validate"))
    >>> bool(scores.median("nrmse_pp") < 0.2)  # RMS error over the peak-to-peak force
    True
    """
    if not hasattr(damper, "predict"):
        require(damper, Damper, "a damper", "load_model(file) gives one")
    scored, refused = list[RunScore](), dict[str, str]()
    for run in runs:
        require(run, Run, "a run")
        try:
            scored.append(score_run(damper, run, sessions))
        except InputError as error:
            refused[run.id] = str(error)
    return Validation(title or damper.title, tuple(scored), refused)


def score_run(damper: Damper, run: Run, sessions: Sessions | None = None) -> RunScore:
    """Predict and score one run, corrected where its session is known.

    Raises `InputError` if the run does not move, or its force is constant or not that of a damper.
    """
    inside = steady_samples(run)
    swing = float(np.ptp(run.force[inside]))
    if not _MIN_SWING_N < swing < 1 / _MIN_SWING_N:
        text = f"the force changes by {number(swing, 3)} N" if swing else "the force does not change"
        raise RunError(text, where=f"run {run.id}", remedy="check the channel")
    prediction = damper.predict(run)
    reading = GainOffset.of(run.force[inside], prediction.force[inside])
    away = partial(distance_from_tests, damper, prediction.condition, prediction.motion.current)
    beside = PredictedRun.of(run, prediction.force, prediction.motion.velocity, away)
    expected = sessions.expected(RecordingTime.of(run), without=run.id) if sessions else None
    if expected is not None:
        prediction = prediction.corrected(expected.gain, expected.offset)
    scores = score(run.force[inside], prediction.force[inside], prediction.motion.velocity[inside], run.time[inside])
    if beside.peak.size == 1:  # of the cycles of a sine, without the noise of the measured force
        gain = expected.gain if expected else 1.0
        scores = replace(scores, peak_error=gain / float(beside.peak[0]) - 1)
    return RunScore(
        run.id,
        run.rig,
        prediction.condition,
        scores,
        run.repeatability,
        prediction.extrapolation,
        _at_rest(run, prediction),
        UNKNOWN if expected is None else KNOWN,
        reading,
        beside,
    )


def _at_rest(run: Run, prediction: Prediction) -> float | None:
    still = prediction.motion.resting
    if not still.any():
        return None
    return float(np.sqrt(np.mean((prediction.force - run.force)[still] ** 2)) / np.ptp(run.force))


def peak_band(
    damper: Damper, run: Run, level: float = 0.9, expected: SessionCorrection | None = None
) -> dict[str, float]:
    """Half the peak-to-peak force [N] and the energy of a cycle [J] in a run's steady window, and their bands.

    The ends are missing for dampers without uncertainty.
    """
    prediction, inside = damper.predict(run), run.in_window
    if expected is None:
        interval = band(damper, prediction, level, inside)
    else:
        interval = session_band(expected, damper, prediction, level, inside)
    prediction = prediction.corrected(expected.gain, expected.offset) if expected else prediction
    velocity, time = prediction.motion.velocity[inside], run.time[inside]
    cycles = max(prediction.condition.frequency_Hz, 1e-9)
    energy = dissipated_power(run.force[inside], velocity, time) / cycles
    row = {"peak_force_measured_N": measured_peak(run), "energy_measured_J": energy}
    if interval is None:
        return row
    predicted = dissipated_power(prediction.force[inside], velocity, time) / cycles
    low, high = (predicted * (1 + share) for share in interval.energy)
    row |= {"peak_force_low_N": interval.peak[0], "peak_force_high_N": interval.peak[1]}
    return {**row, "energy_low_J": low, "energy_high_J": high}


def leave_out(
    runs: Sequence[Run], folds: Iterable[Sequence[int]], fit: Callable[[Sequence[int]], Damper], title: str
) -> Validation:
    """Score every run with a damper that `fit` identifies without the runs of its fold, from the other indices."""
    scored: dict[int, RunScore] = {}
    for fold in folds:
        rest = [i for i in range(len(runs)) if i not in set(fold)]
        if rest:
            damper = fit(rest)
            scored |= {i: score_run(damper, runs[i]) for i in fold}
    return Validation(title, tuple(scored[i] for i in sorted(scored)))
