"""Synthetic motions: sine, triangle, sweep, random."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mrdamper.data.arrays import Floats
from mrdamper.data.conditions import Condition
from mrdamper.errors import ExcitationError, require_positive, validate_arguments
from mrdamper.physics.motion.excitation import Excitation

_SAMPLES_PER_CYCLE = 1000
_MAX_SAMPLES = 10**8  # samples of one motion


@validate_arguments()
def sine(condition: Condition, cycles: float = 1.0, samples_per_cycle: int = _SAMPLES_PER_CYCLE) -> Excitation:
    """Sine x = X sin(2πft) at constant current; the last sample closes the last cycle.

    Parameters
    ----------
    condition : Condition
        Amplitude X [m], frequency f [Hz], current [A].
    cycles : float
    samples_per_cycle : int

    Raises
    ------
    ExcitationError
        If the frequency, the amplitude or the number of cycles is not positive.

    Examples
    --------
    >>> from mrdamper import Condition, sine
    >>> motion = sine(Condition(current_A=0.5, frequency_Hz=2.0, amplitude_m=0.01), cycles=2)
    >>> len(motion), round(float(motion.velocity.max()), 4)  # [m/s]
    (2001, 0.1257)
    """
    require_positive(
        ExcitationError, frequency_Hz=condition.frequency_Hz, amplitude_m=condition.amplitude_m, cycles=cycles
    )
    _require_samples(cycles * samples_per_cycle if samples_per_cycle < _MAX_SAMPLES else np.inf)
    omega = 2 * np.pi * condition.frequency_Hz
    time = np.arange(round(cycles * samples_per_cycle) + 1) / (samples_per_cycle * condition.frequency_Hz)
    x = condition.amplitude_m * np.sin(omega * time)
    v = condition.amplitude_m * omega * np.cos(omega * time)
    return Excitation(time, x, v, -(omega**2) * x, np.full(time.size, condition.current_A))


def triangle(condition: Condition, cycles: float = 1.0, samples_per_cycle: int = _SAMPLES_PER_CYCLE) -> Excitation:
    """Constant speed 4fX between ±X at constant current, as in friction tests."""
    require_positive(
        ExcitationError, frequency_Hz=condition.frequency_Hz, amplitude_m=condition.amplitude_m, cycles=cycles
    )
    time = np.arange(round(cycles * samples_per_cycle) + 1) / (samples_per_cycle * condition.frequency_Hz)
    phase = (time * condition.frequency_Hz + 0.25) % 1.0
    rising = phase < 0.5
    x = condition.amplitude_m * np.where(rising, 4 * phase - 1, 3 - 4 * phase)
    v = 4 * condition.frequency_Hz * condition.amplitude_m * np.where(rising, 1.0, -1.0)
    return Excitation(time, x, v, np.zeros_like(x), np.full(time.size, condition.current_A))


@validate_arguments()
def sweep(
    start_Hz: float,
    end_Hz: float,
    duration: float,
    amplitude: float | Callable[[Floats], Floats],
    current: float = 0.0,
    sample_rate: float = 1000.0,
) -> Excitation:
    """Linear frequency sweep at constant current.

    Parameters
    ----------
    start_Hz, end_Hz : float
    duration : float
        [s]
    amplitude : float or callable
        [m]; a function gives it for an array of frequencies [Hz].
    current : float
        [A]
    sample_rate : float
        [Hz]

    Raises
    ------
    ExcitationError
        If a frequency, the duration or the sample rate is not positive.

    Examples
    --------
    >>> from mrdamper import sweep
    >>> motion = sweep(1.0, 15.0, duration=2.0, amplitude=0.002, current=0.5)
    >>> motion.displacement.shape
    (2001,)
    """
    require_positive(ExcitationError, start_Hz=start_Hz, end_Hz=end_Hz, duration=duration, sample_rate=sample_rate)
    _require_samples(duration * sample_rate)
    time = np.arange(int(duration * sample_rate) + 1) / sample_rate
    frequency = start_Hz + (end_Hz - start_Hz) * time / duration
    phase = 2 * np.pi * (start_Hz * time + (end_Hz - start_Hz) * time**2 / (2 * duration))
    try:
        envelope = np.asarray(amplitude(frequency) if callable(amplitude) else amplitude, dtype=float)
    except TypeError as error:
        raise ExcitationError(
            f"amplitude: {error}", remedy="give a number, or a function of the frequencies"
        ) from error
    if envelope.shape not in ((), time.shape):
        raise ExcitationError(
            f"amplitude has shape {envelope.shape}, time {time.shape}", remedy="give one value or all"
        )
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
    require_positive(ExcitationError, duration=duration, rms=rms, sample_rate=sample_rate)
    size = int(duration * sample_rate) + 1
    frequency = np.fft.rfftfreq(size, 1 / sample_rate)
    inside = (frequency >= band_Hz[0]) & (frequency <= band_Hz[1])
    if not inside.any():
        raise ExcitationError(f"no frequency line lies in {band_Hz} Hz", remedy="lengthen the record or widen the band")
    spectrum = inside * (rng.standard_normal(frequency.size) + 1j * rng.standard_normal(frequency.size))
    x = np.fft.irfft(spectrum, size)
    return _derived(np.arange(size) / sample_rate, x * rms / np.std(x), current)


def _derived(time: Floats, x: Floats, current: float) -> Excitation:
    v = np.gradient(x, time, edge_order=2)
    return Excitation(time, x, v, np.gradient(v, time, edge_order=2), np.full(time.size, float(current)))


def _require_samples(count: float) -> None:
    if not 2 <= count <= _MAX_SAMPLES:
        raise ExcitationError(f"a motion of {count:.3g} samples", remedy=f"give between 2 and {_MAX_SAMPLES:.0e}")
