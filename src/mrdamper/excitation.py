"""Motion and current in time: measured, or made.

`measured_motion` turns a recorded displacement into smooth displacement, velocity and
acceleration at the right phase; `analyse_motion` says which sine it is; `sine`, `triangle`,
`sweep` and `random_motion` make motions. Everything is computed from the motion that was
measured, never from the one that was commanded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.data import Condition, Floats, Run, once_per_run
from mrdamper.errors import ExcitationError
from mrdamper.harmonics import HarmonicSeries, fit_harmonics, fundamental_frequency
from mrdamper.hysteresis import Path

SINE_DISTORTION_LIMIT = 0.05  # above it a motion is no sine for harmonic balance
_SAMPLES_PER_CYCLE = 1000
_ORDERS = 7  # harmonics a measured motion is described by
_UNIFORM = 1e-8  # spread of the sampling interval, relative, up to which it counts as one
_STILL = 1e-9  # a displacement that moves less does not move [m]


@dataclass(frozen=True, eq=False)
class Excitation:
    """Motion and current at the samples of one stretch of time.

    Attributes
    ----------
    time, displacement, velocity, acceleration, current : (N,) arrays
        [s], [m], [m/s], [m/s²], [A].
    """

    time: Floats
    displacement: Floats
    velocity: Floats
    acceleration: Floats
    current: Floats

    def __post_init__(self) -> None:
        size = self.time.size
        for name in ("displacement", "velocity", "acceleration", "current"):
            array = np.broadcast_to(np.asarray(getattr(self, name), dtype=float), (size,))
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return self.time.size

    @cached_property
    def path(self) -> Path:
        """The motion cut into strokes."""
        return Path.of(self.displacement)

    def part(self, mask: ArrayLike | slice) -> Excitation:
        """The samples selected by a mask, slice or index."""
        pick = {name: getattr(self, name)[mask] for name in self.__dataclass_fields__}
        return Excitation(**pick)

    def with_current(self, current: ArrayLike) -> Excitation:
        """The same motion at another current [A], a scalar or one value per sample."""
        return replace(self, current=np.asarray(current, dtype=float))

    def about(self, centre: float) -> Excitation:
        """The same motion with displacements counted from `centre` [m]."""
        return replace(self, displacement=self.displacement - centre)

    def delayed(self, delay: float) -> Excitation:
        """The motion `delay` seconds later, to first order in the delay, for small delays."""
        return replace(
            self,
            displacement=self.displacement - delay * self.velocity,
            velocity=self.velocity - delay * self.acceleration,
        )


@once_per_run
def measured_motion(run: Run) -> Excitation:
    """Smooth motion of a run, from its measured displacement.

    A quadratic is fitted around each sample over a fortieth of the motion's period (at least
    five samples); its value, slope and curvature are displacement, velocity and
    acceleration. The fit is centred, so no phase is lost; it never reaches across a gap in
    time.
    """
    parts = [smooth(run.time[a:b], run.displacement[a:b]) for a, b in run.segments]
    x, v, a = (np.concatenate(p) for p in zip(*parts, strict=True))
    return Excitation(run.time, x, v, a, run.current)


def motion_from_samples(time: ArrayLike, displacement: ArrayLike, current: ArrayLike = 0.0) -> Excitation:
    """Motion from time [s], displacement [m] and current [A]; velocity is derived.

    Raises
    ------
    InputError
        If the arrays do not make a run (lengths, order of time, finite values).
    """
    time = np.asarray(time, dtype=float)
    return measured_motion(Run("motion", time, displacement, np.zeros(time.size), current))  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class MotionAnalysis:
    """Which sine a measured motion is.

    Attributes
    ----------
    condition : Condition
        Measured current, frequency and amplitude (half the peak-to-peak stroke).
    series : HarmonicSeries
        Mean, drift and harmonics of the displacement.
    cycles : float
        Length of the record in cycles.
    distortion : float
        RMS of harmonics 2 and up over the RMS of the first (THD).
    drift : float
        Slow movement of the mean position [m/s].
    residual : float
        RMS of what the series does not explain [m].
    """

    condition: Condition
    series: HarmonicSeries
    cycles: float
    distortion: float
    drift: float
    residual: float

    @property
    def is_sine(self) -> bool:
        """Whether harmonic balance may treat the motion as a sine."""
        return self.distortion <= SINE_DISTORTION_LIMIT


@once_per_run
def analyse_motion(run: Run) -> MotionAnalysis:
    """Frequency, amplitude, distortion and drift of the run's steady motion.

    Harmonic regression on the samples of the steady window, so the record need not hold a
    whole number of cycles.

    Raises
    ------
    ExcitationError
        If the steady window holds under one cycle, or no motion.
    """
    run = run.steady()
    where = f"run {run.id}"
    if np.ptp(run.displacement) < _STILL:
        raise ExcitationError("the displacement does not move", where=where, mend="check the channel")
    frequency = fundamental_frequency(run.time, run.displacement)
    orders = _ORDERS if np.ptp(run.time) * frequency > 2 else 3  # harmonics of a short record overlap its drift
    series = fit_harmonics(run.time, run.displacement, orders, frequency=frequency)
    cycles = float(np.ptp(run.time) * series.frequency)
    if cycles < 0.95:
        raise ExcitationError(
            f"the steady window holds {cycles:.2f} cycles",
            where=where,
            mend="record at least one full cycle",
        )
    power = series.sine**2 + series.cosine**2
    return MotionAnalysis(
        condition=Condition(round(float(np.mean(run.current)), 9), series.frequency, series.half_peak_to_peak()),
        series=series,
        cycles=cycles,
        distortion=float(np.sqrt(power[1:].sum() / power[0])),
        drift=series.drift,
        residual=float(np.std(run.displacement - series(run.time))),
    )


@dataclass(frozen=True)
class EquivalentSine:
    """The sine a motion amounts to.

    Attributes
    ----------
    condition : Condition
    centre : float
        Mean position [m].
    is_sine : bool
        Whether the motion is that sine, or only shares its RMS displacement and velocity.
    """

    condition: Condition
    centre: float
    is_sine: bool


@once_per_run
def equivalent_sine(run: Run) -> EquivalentSine:
    """Measure the sine, or for any other motion the sine of the same RMS displacement and velocity.

    Raises
    ------
    ExcitationError
        If nothing moves.
    """
    run = run.steady()
    centred = run.displacement - np.mean(run.displacement)
    try:
        analysis = analyse_motion(run)
    except ExcitationError:
        if np.ptp(centred) < _STILL:
            raise
        analysis = None
    if analysis is not None and analysis.residual < 0.3 * np.std(centred):
        return EquivalentSine(analysis.condition, analysis.series.mean, True)
    motion = measured_motion(run)
    rms_x, rms_v = float(np.std(motion.displacement)), float(np.std(motion.velocity))
    condition = Condition(round(float(np.mean(run.current)), 9), rms_v / (2 * np.pi * rms_x), float(np.sqrt(2) * rms_x))
    return EquivalentSine(condition, float(np.mean(motion.displacement)), False)


def running_sine(motion: Excitation) -> tuple[Floats, Floats]:
    """Frequency [Hz] and amplitude [m] of the sine a motion resembles, at every sample.

    From the analytic signal of displacement and velocity, averaged over about a cycle. For
    motion of one slowly changing frequency; for broad-band motion it is a rough description
    and no more. It looks ahead as far as it looks back.
    """
    x = motion.displacement - np.mean(motion.displacement)
    v = motion.velocity
    x_turned, v_turned = _quarter_turn(x), _quarter_turn(v)
    spin, size = x * v_turned - x_turned * v, x**2 + x_turned**2
    moving = float(np.sqrt(np.mean(v**2) / np.mean(x**2)))
    width = max(3, round(2 * np.pi / moving / float(np.median(np.diff(motion.time)))))
    mean = np.ones(width) / width
    scale = np.convolve(np.ones(x.size), mean, "same")
    size = np.maximum(np.convolve(size, mean, "same") / scale, np.finfo(float).tiny)
    omega = np.convolve(spin, mean, "same") / scale / size
    return np.maximum(omega, 1e-3 * moving) / (2 * np.pi), np.sqrt(size)


def _quarter_turn(signal: Floats) -> Floats:
    """Hilbert transform; the record is mirrored at both ends so that they do not leak into each other."""
    mirrored = np.concatenate([signal, signal[::-1]])
    spectrum = np.fft.rfft(mirrored)
    turned = np.fft.irfft(-1j * spectrum, mirrored.size)
    return turned[: signal.size]


def smooth(time: Floats, signal: Floats, span: float | None = None) -> tuple[Floats, Floats, Floats]:
    """Value, slope and curvature of local quadratics through a sampled signal.

    Parameters
    ----------
    time, signal : (N,) arrays
        Sampling need not be uniform.
    span : float, optional
        Width of the fit [s]; default a fortieth of the signal's characteristic period
        2π rms(signal)/rms(slope). Never under five samples.

    Returns
    -------
    value, slope, curvature : (N,) arrays
    """
    size = time.size
    if span is None:
        span = _characteristic_period(time, signal) / 40
    spacing = float(np.median(np.diff(time)))
    half = int(np.clip(round(span / spacing / 2), 2, max((size - 1) // 2, 1)))
    width = min(2 * half + 1, size)
    if width == 2 * half + 1 and np.ptp(np.diff(time)) < _UNIFORM * spacing:
        return _smooth_uniform(signal, half, spacing)
    start = np.clip(np.arange(size) - half, 0, size - width)
    windows = np.lib.stride_tricks.sliding_window_view
    tau = (windows(time, width)[start] - time[:, None]) / spacing
    values = windows(signal, width)[start] - signal[:, None]
    moments = [np.ones_like(tau), tau, tau * tau]
    normal = np.stack([[np.sum(p * q, axis=1) for q in moments] for p in moments])
    right = np.stack([np.sum(p * values, axis=1) for p in moments])
    c0, c1, c2 = np.linalg.solve(normal.transpose(2, 0, 1), right.T[..., None])[..., 0].T
    return signal + c0, c1 / spacing, 2 * c2 / spacing**2


def _smooth_uniform(signal: Floats, half: int, spacing: float) -> tuple[Floats, Floats, Floats]:
    """The same fits where all windows are alike (Savitzky and Golay).

    Windows are taken relative to their sample and the two sides in pairs, so that a signal at rest, or
    one that turns symmetrically about a sample, has a slope of exactly zero there.
    """
    tau = np.arange(-half, half + 1.0)
    fit = np.linalg.pinv(np.column_stack([np.ones_like(tau), tau, tau**2])).T  # (width, 3)
    windows = np.lib.stride_tricks.sliding_window_view(signal, tau.size)
    middle = windows[:, half : half + 1]
    after, before = windows[:, half + 1 :] - middle, windows[:, half - 1 :: -1] - middle
    c = np.empty((signal.size, 3))
    inside = slice(half, signal.size - half)
    c[inside, 0::2] = (after + before) @ fit[half + 1 :, 0::2]
    c[inside, 1] = (after - before) @ fit[half + 1 :, 1]
    for window, away in ((windows[0], slice(0, half)), (windows[-1], slice(signal.size - half, None))):
        d0, d1, d2 = ((window - signal[away, None]) @ fit).T  # seen away from the middle of the window
        at = tau[:half] if away.start == 0 else tau[half + 1 :]
        c[away] = np.stack([d0 + at * (d1 + at * d2), d1 + 2 * at * d2, d2], axis=1)
    return signal + c[:, 0], c[:, 1] / spacing, 2 * c[:, 2] / spacing**2


def _characteristic_period(time: Floats, signal: Floats) -> float:
    # Slopes over about 1/200 of the record keep sample noise out of the estimate.
    step = max(1, time.size // 2000)
    t, s = time[::step], signal[::step]
    slope = np.diff(s) / np.diff(t)
    moving = np.sqrt(np.mean(slope**2))
    return float(2 * np.pi * np.std(s) / moving) if moving > 0 else 0.0


def sine(condition: Condition, cycles: float = 1.0, samples_per_cycle: int = _SAMPLES_PER_CYCLE) -> Excitation:
    """X = X sin(2πft) at constant current; the last sample closes the last cycle."""
    _require_positive(frequency_Hz=condition.frequency_Hz, amplitude_m=condition.amplitude_m, cycles=cycles)
    omega = 2 * np.pi * condition.frequency_Hz
    time = np.arange(round(cycles * samples_per_cycle) + 1) / (samples_per_cycle * condition.frequency_Hz)
    x = condition.amplitude_m * np.sin(omega * time)
    v = condition.amplitude_m * omega * np.cos(omega * time)
    return Excitation(time, x, v, -(omega**2) * x, np.full(time.size, condition.current_A))


def triangle(condition: Condition, cycles: float = 1.0, samples_per_cycle: int = _SAMPLES_PER_CYCLE) -> Excitation:
    """Constant speed 4fX between ±X at constant current, as in friction tests."""
    _require_positive(frequency_Hz=condition.frequency_Hz, amplitude_m=condition.amplitude_m, cycles=cycles)
    time = np.arange(round(cycles * samples_per_cycle) + 1) / (samples_per_cycle * condition.frequency_Hz)
    phase = (time * condition.frequency_Hz + 0.25) % 1.0
    rising = phase < 0.5
    x = condition.amplitude_m * np.where(rising, 4 * phase - 1, 3 - 4 * phase)
    v = 4 * condition.frequency_Hz * condition.amplitude_m * np.where(rising, 1.0, -1.0)
    return Excitation(time, x, v, np.zeros_like(x), np.full(time.size, condition.current_A))


def sweep(
    start_Hz: float,
    end_Hz: float,
    duration: float,
    amplitude: float | Callable[[Floats], Floats],
    current: float = 0.0,
    sample_rate: float = 1000.0,
) -> Excitation:
    """Linear frequency sweep [Hz] over a duration [s]; the amplitude [m] may depend on frequency."""
    _require_positive(start_Hz=start_Hz, end_Hz=end_Hz, duration=duration, sample_rate=sample_rate)
    time = np.arange(int(duration * sample_rate) + 1) / sample_rate
    frequency = start_Hz + (end_Hz - start_Hz) * time / duration
    phase = 2 * np.pi * (start_Hz * time + (end_Hz - start_Hz) * time**2 / (2 * duration))
    envelope = amplitude(frequency) if callable(amplitude) else amplitude
    return _derived(time, envelope * np.sin(phase), current)


def random_motion(
    rng: np.random.Generator,
    duration: float,
    rms: float,
    band_Hz: tuple[float, float] = (0.1, 5.0),
    current: float = 0.0,
    sample_rate: float = 1000.0,
) -> Excitation:
    """Gaussian motion of given RMS [m], flat in displacement over a frequency band [Hz]."""
    _require_positive(duration=duration, rms=rms, sample_rate=sample_rate)
    size = int(duration * sample_rate) + 1
    frequency = np.fft.rfftfreq(size, 1 / sample_rate)
    inside = (frequency >= band_Hz[0]) & (frequency <= band_Hz[1])
    if not inside.any():
        raise ExcitationError(f"no frequency line lies in {band_Hz} Hz", mend="lengthen the record or widen the band")
    spectrum = inside * (rng.standard_normal(frequency.size) + 1j * rng.standard_normal(frequency.size))
    x = np.fft.irfft(spectrum, size)
    return _derived(np.arange(size) / sample_rate, x * rms / np.std(x), current)


def _derived(time: Floats, x: Floats, current: float) -> Excitation:
    v = np.gradient(x, time, edge_order=2)
    return Excitation(time, x, v, np.gradient(v, time, edge_order=2), np.full(time.size, float(current)))


def _require_positive(**values: float) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise ExcitationError(f"{name} is {value}", mend="give a positive number")
