"""Equivalent sine of a measured motion."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mrdamper.data.conditions import Condition
from mrdamper.data.runs import Run, once_per_run
from mrdamper.errors import ExcitationError
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.harmonics import HarmonicSeries, fit_harmonics, fundamental_frequency
from mrdamper.physics.motion.measured import measured_motion

SINE_DISTORTION_LIMIT = 0.05  # limit of the distortion of a sine for harmonic balance
MIN_CYCLES = 1.95  # cycles of a record below which the start of the motion is a part of it
STRAY_LIMIT = 0.3  # of the RMS displacement: remainder above which another motion is added to the sine
_VELOCITY_DISTORTION_LIMIT = 0.6  # above that of a triangle (0.48): a second tone at a multiple of the frequency
_MEASURED_HARMONICS = 7  # number of harmonics of a measured motion
_MIN_STROKES = 4  # of a record, below which they show no range
_MIN_STROKE_SAMPLES = 8  # of a stroke whose duration is counted
_MIN_STROKE_RATIO = 0.02  # of a stroke that is no noise over the longest [-]
_MIN_DISPLACEMENT_M = 1e-9  # smallest motion [m]


@dataclass(frozen=True, eq=False)
class MotionAnalysis:
    """Result of fitting a sine to a measured motion."""

    condition: Condition  # magnitude of the measured current, frequency and amplitude (half the peak-to-peak stroke)
    series: HarmonicSeries  # mean, drift and harmonics of the displacement
    cycles: float  # length of the record in cycles
    distortion: float  # RMS of harmonics 2 and up over the RMS of the first (THD)
    velocity_distortion: float  # the same of the velocity
    drift: float  # slow movement of the mean position [m/s]
    residual: float  # RMS of the remainder of the series [m]
    stray: float  # that RMS over the RMS displacement: a second tone, a random part, a sweep

    @property
    def is_sine(self) -> bool:
        """True if harmonic balance may treat the motion as a sine."""
        return self.distortion <= SINE_DISTORTION_LIMIT and self.stray < STRAY_LIMIT


@once_per_run
def analyse_motion(run: Run) -> MotionAnalysis:
    """Frequency, amplitude, distortion and drift of the run's steady motion.

    Harmonic regression on the samples of the steady window, so the record need not hold a whole number of cycles.
    Raises `ExcitationError` if the steady window holds under one cycle, or no motion.
    """
    run = run.steady()
    where = f"run {run.id}"
    if np.ptp(run.displacement) < _MIN_DISPLACEMENT_M:
        raise ExcitationError("the displacement does not move", where=where, remedy="check the channel")
    try:
        frequency = fundamental_frequency(run.time, run.displacement)
    except np.linalg.LinAlgError as error:
        raise ExcitationError("too few samples for a sine", where=where, remedy="record a full cycle") from error
    # Harmonics of a short record overlap its drift.
    orders = _MEASURED_HARMONICS if np.ptp(run.time) * frequency > 2 else 3
    series = fit_harmonics(run.time, run.displacement, orders, frequency=frequency)
    cycles = float(np.ptp(run.time) * series.frequency)
    if cycles < 0.95:
        problem = f"the steady window holds {cycles:.2f} cycles"
        raise ExcitationError(problem, where=where, remedy="record at least one full cycle")
    power = series.sine**2 + series.cosine**2
    residual = float(np.std(run.displacement - series(run.time)))
    return MotionAnalysis(
        condition=Condition(abs(run.mean_current), series.frequency, series.half_peak_to_peak()),
        series=series,
        cycles=cycles,
        distortion=float(np.sqrt(power[1:].sum() / power[0])),
        velocity_distortion=float(np.sqrt((np.arange(2, power.size + 1) ** 2 @ power[1:]) / power[0])),
        drift=series.drift,
        residual=residual,
        stray=residual / float(np.std(run.displacement)),
    )


def pure_sines(runs: Iterable[Run]) -> list[Run]:
    """Return the runs whose motion harmonic balance may treat as a sine; published methods take no other."""
    return [run for run in runs if analyse_motion(run).is_sine]


@dataclass(frozen=True)
class EquivalentSine:
    """The equivalent sine of a motion."""

    condition: Condition
    centre: float  # mean position [m]
    is_sine: bool  # whether the motion is that sine, or only has its RMS displacement and velocity


@once_per_run
def equivalent_sine(run: Run) -> EquivalentSine:
    """Measure the sine, or for any other motion the sine of the same RMS displacement and velocity.

    Raises `ExcitationError` if nothing moves.
    """
    steady = run.steady()
    centred = steady.displacement - np.mean(steady.displacement)
    try:
        analysis = analyse_motion(run)
    except ExcitationError:
        if np.ptp(centred) < _MIN_DISPLACEMENT_M:
            raise
        analysis = None
    # A ramp has no residual either: it is a drift without a sine.
    spread = float(np.std(centred))
    if (
        analysis is not None
        and analysis.stray < STRAY_LIMIT
        and analysis.velocity_distortion < _VELOCITY_DISTORTION_LIMIT
        and analysis.condition.amplitude_m > 0.5 * spread
    ):
        return EquivalentSine(analysis.condition, analysis.series.mean, True)
    motion = measured_motion(steady)
    rms_x, rms_v = float(np.std(motion.displacement)), float(np.std(motion.velocity))
    condition = Condition(abs(run.mean_current), rms_v / (2 * np.pi * rms_x), float(np.sqrt(2) * rms_x))
    return EquivalentSine(condition, float(np.mean(motion.displacement)), False)


def sine_condition(run: Run) -> Condition | None:
    """Return the condition of a run that is a sine at one current; None of any other record."""
    sine = equivalent_sine(run)
    return sine.condition if sine.is_sine and not run.current_changes else None


def extreme_strokes(motion: Excitation) -> list[Condition]:
    """Return the slowest, fastest, shortest and longest strokes of a record as half cycles of sines.

    Strokes that are short of samples or far shorter than the longest are noise; of the frequencies the middle 90 %
    count. The current is the mean of the stroke.
    """
    path = motion.path
    samples = np.bincount(path.stroke)
    currents = np.bincount(path.stroke, np.abs(motion.current)) / np.maximum(samples, 1)
    begins = motion.time[np.searchsorted(path.stroke, np.arange(1, samples.size))]
    frequencies = 0.5 / np.maximum(np.diff(begins), np.finfo(float).tiny)
    points = np.column_stack([currents[1:-1], frequencies, np.array(path.lengths[1:]) / 2])
    shortest = 0.5 * _MIN_STROKE_RATIO * max(path.lengths, default=0)
    points = points[(samples[1:-1] >= _MIN_STROKE_SAMPLES) & (points[:, 2] > shortest)]
    if len(points) < _MIN_STROKES:
        return []
    low, high = np.percentile(points[:, 1], (5, 95))
    points = points[(points[:, 1] >= low) & (points[:, 1] <= high)]
    f, A = np.log(points[:, 1:]).T
    picks = {int(end(values)) for values in (f, A, f + A, f - A) for end in (np.argmin, np.argmax)}
    return [Condition(*points[i].tolist()) for i in sorted(picks)]


@once_per_run
def centred_motion(run: Run) -> Excitation:
    """Return the measured motion about its mid-stroke, cut into strokes once for every model that follows it."""
    motion = measured_motion(run).about(equivalent_sine(run).centre)
    motion.path  # noqa: B018
    return motion
