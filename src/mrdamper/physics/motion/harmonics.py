"""Harmonic regression: mean, drift and harmonics of a periodic signal by least squares.

Unlike a Fourier transform it needs neither a whole number of cycles nor uniform sampling.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.data.arrays import Floats
from mrdamper.statistics.linear import solve_linear

_HARMONICS = 3  # by which a frequency is found, from three cycles on
_FEW = 250  # samples on which a frequency is found to begin with
_SAMPLES_PER_BLOCK = 50_000  # samples whose waves are held at a time
_SAMPLES_PER_HALF_PERIOD = 16  # between two changes of sign, with which the strongest line of a long record is found
_MAX_SPECTRUM_SAMPLES = 2**20  # largest number of samples of a zero-padded spectrum


@dataclass(frozen=True, eq=False)
class HarmonicSeries:
    """mean + drift (t − t0) + Σ_k sine_k sin kω(t − t0) + cosine_k cos kω(t − t0), k = 1...K."""

    frequency: float  # ω/2π [Hz]
    origin: float  # t0 [s]
    # mean, drift: [signal], [signal/s]
    mean: float
    drift: float
    # sine, cosine: (K,) [signal]
    sine: Floats
    cosine: Floats

    def __call__(self, time: ArrayLike, derivative: int = 0) -> Floats:
        """Evaluate the series (or a derivative with respect to time) at the given times."""
        given = np.asarray(time, dtype=float)
        if given.ndim == 1 and given.size > _SAMPLES_PER_BLOCK:
            return np.concatenate([self(given[part], derivative) for part in _blocks(given.size)])
        t = given - self.origin
        omega = 2 * np.pi * self.frequency
        scale = (omega * np.arange(1, self.sine.size + 1)) ** derivative
        trend = {0: self.mean + self.drift * t, 1: np.full_like(t, self.drift)}.get(derivative, np.zeros_like(t))
        sine, cosine = _waves(omega * t, self.sine.size)
        for _ in range(derivative % 4):  # a quarter period for each derivative
            sine, cosine = cosine, -sine
        return trend + (scale * self.sine) @ sine + (scale * self.cosine) @ cosine

    def amplitude(self, order: int = 1) -> float:
        """Amplitude of one harmonic."""
        return float(np.hypot(self.sine[order - 1], self.cosine[order - 1]))

    def phase(self, order: int = 1) -> float:
        """φ of one harmonic written as amplitude · sin(kω(t − t0) + φ) [rad]."""
        return float(np.arctan2(self.cosine[order - 1], self.sine[order - 1]))

    def half_peak_to_peak(self) -> float:
        """Half the difference of maximum and minimum of the periodic part."""
        sine, cosine = _cycle(self.sine.size)
        return float(np.ptp(self.sine @ sine + self.cosine @ cosine) / 2)


def fit_harmonics(time: Floats, signal: Floats, orders: int, *, frequency: float, drift: bool = True) -> HarmonicSeries:
    """Least-squares harmonic series of a signal (N,) at a known fundamental frequency [Hz], with a drift if asked.

    The number of harmonics is reduced to those that the record resolves.
    """
    origin = float(time[0])
    nyquist = 0.5 * (time.size - 1) / float(time[-1] - time[0])
    orders = int(np.clip(nyquist / frequency, 1, orders))
    coefficients = _solved(time.size, signal, lambda part: _rows(time[part] - origin, frequency, orders, drift))
    lead = 2 if drift else 1
    return HarmonicSeries(
        frequency=frequency,
        origin=origin,
        mean=float(coefficients[0]),
        drift=float(coefficients[1]) if drift else 0.0,
        sine=coefficients[lead : lead + orders],
        cosine=coefficients[lead + orders :],
    )


def fundamental_frequency(time: Floats, signal: Floats) -> float:
    """Fundamental frequency [Hz] of a record of about one cycle or more.

    The search of the best single sine begins at the strongest spectral line; Gauss–Newton on frequency and coefficients
    then converges to rounding. Harmonics are included from three cycles on, because harmonics of a slower motion could
    describe a shorter record.
    """
    t = time - time[0]
    guess = _spectral_line(time, signal)
    few = slice(None, None, max(1, t.size // 150))  # for the grid, with less than four cycles
    if guess * t[-1] < 4:
        ladder = guess * np.geomspace(0.4, 2.5, 45)
        guess = ladder[int(np.argmin(_single_sine_costs(t[few], signal[few], ladder)))]
    orders = _HARMONICS if guess * t[-1] >= 3 else 1
    # Most steps on few samples: the last ones, on all, decide.
    near, coefficients = float(guess), None
    if t.size > 4 * _FEW:
        some = slice(None, None, t.size // _FEW)
        near, coefficients = _refined(t[some], signal[some], near, orders, 1e-6)
    return _refined(t, signal, near, orders, 1e-11, coefficients)[0]


def _refined(
    t: Floats, signal: Floats, frequency: float, orders: int, tolerance: float, coefficients: Floats | None = None
) -> tuple[float, Floats]:
    """Gauss–Newton on frequency and coefficients, until a step is below a share of the frequency."""

    def rows(part: slice) -> Floats:
        return _rows(t[part], frequency, orders, True, coefficients)

    if coefficients is None:
        coefficients = _solved(t.size, signal, rows)
    for _ in range(30):
        solution = _solved(t.size, signal, rows)
        coefficients, step = solution[:-1], float(solution[-1])
        frequency += float(np.clip(step, -0.1 * frequency, 0.1 * frequency))
        if abs(step) < tolerance * frequency:
            break
    return frequency, coefficients


def _solved(size: int, signal: Floats, rows: Callable[[slice], Floats]) -> Floats:
    """Least-squares coefficients of some rows over the samples; long records block by block, as triangles."""
    if size <= _SAMPLES_PER_BLOCK:
        return solve_linear(rows(slice(None)).T, signal)
    triangle: Floats = np.empty((0, rows(slice(0, 1)).shape[0] + 1))
    for part in _blocks(size):
        table = np.vstack([rows(part), signal[part]]).T
        triangle = np.asarray(np.linalg.qr(np.vstack([triangle, table]), mode="r"))
    return solve_linear(triangle[:, :-1], triangle[:, -1])


def _blocks(size: int) -> Iterator[slice]:
    return (slice(begin, begin + _SAMPLES_PER_BLOCK) for begin in range(0, size, _SAMPLES_PER_BLOCK))


def _single_sine_costs(t: Floats, signal: Floats, frequencies: Floats) -> Floats:
    """Squared residuals of one sine, a mean and a drift at each frequency."""
    angle = 2 * np.pi * np.multiply.outer(frequencies, t)
    trend = np.broadcast_to(np.stack([np.ones_like(t), t / t[-1]]), (frequencies.size, 2, t.size))
    rows = np.concatenate([trend, np.sin(angle)[:, None], np.cos(angle)[:, None]], axis=1)
    right = rows @ signal
    coefficients = np.linalg.solve(rows @ rows.transpose(0, 2, 1), right[..., None])[..., 0]
    return float(signal @ signal) - np.sum(right * coefficients, axis=1)


def _spectral_line(time: Floats, signal: Floats) -> float:
    """Find the strongest line of the detrended, zero-padded spectrum [Hz].

    A long record is thinned to the samples that its changes of sign require.
    """
    if time.size > _SAMPLES_PER_BLOCK:
        often = _crossings(signal - float(np.mean(signal)))
        every = max(1, time.size // max(_SAMPLES_PER_BLOCK, _SAMPLES_PER_HALF_PERIOD * often))
        time, signal = time[::every], signal[::every]
    size = time.size
    wave = np.interp(np.linspace(float(time[0]), float(time[-1]), size), time, signal)
    place = np.arange(size) - (size - 1) / 2
    wave = wave - wave.mean() - place * (place @ wave / (place @ place))
    window = np.hanning(size + 2)[1:-1] if _crossings(wave) > 4 else np.ones(size)
    padded = max(size, min(8 * size, _MAX_SPECTRUM_SAMPLES))
    power = np.abs(np.fft.rfft(wave * window, padded)) ** 2
    power[: max(1, padded // size // 2)] = 0.0
    peak = int(np.argmax(power))
    return max(peak, 1) * (size - 1) / (padded * float(time[-1] - time[0]))


def _crossings(wave: Floats) -> int:
    return int(np.count_nonzero(np.diff(np.signbit(wave))))


def _waves(angle: Floats, orders: int) -> tuple[Floats, Floats]:
    """Sines and cosines of 1...orders times an angle, (K, N) each: powers of one complex number."""
    sine, cosine = np.empty((2, orders, angle.size))
    _fill_waves(angle, sine, cosine)
    return sine, cosine


def _fill_waves(angle: Floats, sine: Floats, cosine: Floats) -> None:
    np.sin(angle, out=sine[0])
    np.cos(angle, out=cosine[0])
    for k in range(1, len(sine)):
        sine[k] = sine[k - 1] * cosine[0] + cosine[k - 1] * sine[0]
        cosine[k] = cosine[k - 1] * cosine[0] - sine[k - 1] * sine[0]


@lru_cache
def _cycle(orders: int) -> tuple[Floats, Floats]:
    return _waves(np.linspace(0, 2 * np.pi, 2048, endpoint=False), orders)


def _rows(t: Floats, frequency: float, orders: int, drift: bool, coefficients: Floats | None = None) -> Floats:
    """(L, N) mean, drift, sines and cosines: the transpose of a least-squares table, whose rows are long.

    With coefficients, the derivative of their sum with respect to the frequency as a last row.
    """
    lead, last = 1 + drift, 1 + drift + 2 * orders
    rows = np.empty((last + (coefficients is not None), t.size))
    rows[0] = 1.0
    if drift:
        rows[1] = t
    sine, cosine = rows[lead : lead + orders], rows[lead + orders : last]
    _fill_waves(2 * np.pi * frequency * t, sine, cosine)
    if coefficients is not None:
        k = np.arange(1, orders + 1)
        of_sine, of_cosine = np.reshape(coefficients[lead:], (2, orders))
        rows[-1] = 2 * np.pi * t * ((k * of_sine) @ cosine - (k * of_cosine) @ sine)
    return rows
