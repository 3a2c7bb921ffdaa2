"""Harmonic regression: mean, drift and harmonics of a periodic signal by least squares.

Unlike a Fourier transform it needs neither a whole number of cycles nor uniform sampling.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.data.arrays import Floats, blocks
from mrdamper.statistics.linear import solve_linear

_HARMONICS = 3  # by which a frequency is found, from three cycles on
_FEW = 250  # samples on which a frequency is found to begin with
_SAMPLES_PER_BLOCK = 50_000  # samples whose waves are held at a time
_SAMPLES_PER_HALF_PERIOD = 16  # between two changes of sign, with which the strongest line is found
_MAX_SPECTRUM_SAMPLES = 2**20  # largest number of samples of a zero-padded spectrum
_MIN_CYCLES = 0.25  # cycles of a record below which there is no sine to be found
_MAX_FEW_CYCLES = 4  # cycles of a record below which its line is too broad to be a start value
_RANGE = 2.5  # factor of the frequency, to either side, in which the best single sine then lies


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
            return np.concatenate([self(given[part], derivative) for part in blocks(given.size, _SAMPLES_PER_BLOCK)])
        mean, drift, sine, cosine = self.mean, self.drift, self.sine, self.cosine
        omega = 2 * np.pi * self.frequency * np.arange(1, sine.size + 1)
        for _ in range(derivative):
            mean, drift, sine, cosine = drift, 0.0, -omega * cosine, omega * sine
        return np.concatenate([[mean, drift], sine, cosine]) @ _rows(given - self.origin, self.frequency, sine.size)

    def amplitude(self, order: int = 1) -> float:
        """Amplitude of one harmonic."""
        return float(np.hypot(self.sine[order - 1], self.cosine[order - 1]))

    def phase(self, order: int = 1) -> float:
        """φ of one harmonic written as amplitude · sin(kω(t − t0) + φ) [rad]."""
        return float(np.arctan2(self.cosine[order - 1], self.sine[order - 1]))

    def half_peak_to_peak(self) -> float:
        """Half the difference of maximum and minimum of the periodic part."""
        return float(np.ptp(np.concatenate([self.sine, self.cosine]) @ _cycle(self.sine.size)) / 2)


def fit_harmonics(time: Floats, signal: Floats, orders: int, *, frequency: float, drift: bool = True) -> HarmonicSeries:
    """Least-squares harmonic series of a signal (N,) at a known fundamental frequency [Hz], with a drift if asked.

    The number of harmonics is reduced to those that the record resolves.
    """
    origin = float(time[0])
    nyquist = 0.5 * (time.size - 1) / float(time[-1] - time[0])
    orders = min(max(int(nyquist / frequency), 1), orders)
    coefficients = _solved(time.size, signal, lambda part: _rows(time[part] - origin, frequency, orders, drift))
    sine, cosine = np.reshape(coefficients[1 + drift :], (2, orders))
    slope = float(coefficients[1]) if drift else 0.0
    return HarmonicSeries(frequency, origin, float(coefficients[0]), slope, sine, cosine)


def fundamental_frequency(time: Floats, signal: Floats) -> float:
    """Fundamental frequency [Hz] of a record of about one cycle or more.

    The search of the best single sine begins at the strongest spectral line; Gauss–Newton on frequency and coefficients
    then converges to rounding. Harmonics are included from three cycles on, because harmonics of a slower motion could
    describe a shorter record.
    """
    t = time - time[0]
    near, coefficients = _spectral_line(t, signal), None
    orders = _HARMONICS if near * t[-1] >= 3 else 1
    # Most steps on few samples: the last ones, on all, decide.
    if t.size > 4 * _FEW:
        some = slice(None, None, t.size // _FEW)
        near, coefficients = _refined(t[some], signal[some], near, orders, 1e-6)
    return _refined(t, signal, near, orders, 1e-11, coefficients)[0]


def _refined(
    t: Floats, signal: Floats, frequency: float, orders: int, tolerance: float, coefficients: Floats | None = None
) -> tuple[float, Floats]:
    """Gauss–Newton on frequency and coefficients, until a step is below a share of the frequency, or it is lost."""

    def rows(part: slice) -> Floats:
        return _rows(t[part], frequency, orders, True, coefficients)

    if coefficients is None:
        coefficients = _solved(t.size, signal, rows)
    for _ in range(30):
        solution = _solved(t.size, signal, rows)
        coefficients, step = solution[:-1], float(solution[-1])
        frequency += min(max(step, -0.1 * frequency), 0.1 * frequency)
        if abs(step) < tolerance * frequency or frequency * t[-1] < _MIN_CYCLES:
            break
    return frequency, coefficients


def _solved(size: int, signal: Floats, rows: Callable[[slice], Floats]) -> Floats:
    """Least-squares coefficients of some rows over the samples; long records block by block, as triangles."""
    if size <= _SAMPLES_PER_BLOCK:
        return solve_linear(rows(slice(None)).T, signal)
    triangle: Floats = np.empty((0, rows(slice(0, 1)).shape[0] + 1))
    for part in blocks(size, _SAMPLES_PER_BLOCK):
        table = np.vstack([rows(part), signal[part]]).T
        triangle = np.asarray(np.linalg.qr(np.vstack([triangle, table]), mode="r"))
    return solve_linear(triangle[:, :-1], triangle[:, -1])


def _spectral_line(t: Floats, signal: Floats) -> float:
    """Find the strongest line of the detrended, zero-padded spectrum [Hz]; of few cycles the best single sine.

    The record is thinned to the samples that its changes of sign require.
    """
    place, wave = t - float(np.mean(t)), signal - float(np.mean(signal))
    wave -= place * (place @ wave / (place @ place))
    often = int(np.count_nonzero(np.diff(np.signbit(wave))))  # changes of sign
    every = max(1, t.size // max(_FEW, _SAMPLES_PER_HALF_PERIOD * often))
    t, wave = t[::every], wave[::every]
    size = t.size
    window = np.hanning(size + 2)[1:-1] if often > 4 else 1.0
    padded = max(size, min(1 << (8 * size - 1).bit_length(), _MAX_SPECTRUM_SAMPLES))
    spectrum = np.fft.rfft(np.interp(np.linspace(0.0, float(t[-1]), size), t, wave) * window, padded)
    power = spectrum.real**2 + spectrum.imag**2
    power[: max(1, padded // size // 2)] = 0.0
    cycles = max(int(np.argmax(power)), 1) * (size - 1) / padded
    if cycles < _MAX_FEW_CYCLES:
        ladder, waves = _sines_of_few_cycles()
        begin, end = np.searchsorted(ladder, (cycles / _RANGE, cycles * _RANGE))
        wave = np.interp(np.linspace(0.0, float(t[-1]), waves.shape[2]), t, wave)
        cycles = float(ladder[begin + np.argmax(np.sum((waves[begin:end] @ wave) ** 2, axis=1))])
    return cycles / float(t[-1])


@lru_cache
def _sines_of_few_cycles() -> tuple[Floats, Floats]:
    """Return numbers of cycles of a record, and what a mean and a drift leave of their sines and cosines, normalised.

    About the middle of an even record sines and drift are odd, cosines and mean even.
    """
    ladder = np.geomspace(0.2, _MAX_FEW_CYCLES * _RANGE, 97)
    place = np.linspace(-0.5, 0.5, 64)
    angle = 2 * np.pi * np.multiply.outer(ladder, place)
    sine, cosine = np.sin(angle), np.cos(angle)
    sine -= np.multiply.outer(sine @ place / (place @ place), place)
    cosine -= np.mean(cosine, axis=1, keepdims=True)
    waves = np.stack([sine, cosine], axis=1)
    return ladder, waves / np.linalg.norm(waves, axis=2, keepdims=True)


@lru_cache
def _cycle(orders: int) -> Floats:
    return _rows(np.linspace(0, 1, 2048, endpoint=False), 1.0, orders, drift=False)[1:]


def _rows(t: Floats, frequency: float, orders: int, drift: bool = True, coefficients: Floats | None = None) -> Floats:
    """(L, N) mean, drift, sines and cosines: the transpose of a least-squares table, whose rows are long.

    Sines and cosines follow from those of the two orders before. With coefficients, the derivative of their sum with
    respect to the frequency is a last row.
    """
    lead, last = 1 + drift, 1 + drift + 2 * orders
    rows = np.empty((last + (coefficients is not None), t.size))
    rows[0] = 1.0
    if drift:
        rows[1] = t
    waves = rows[lead:last].reshape(2, orders, t.size)
    np.multiply(2 * np.pi * frequency, t, out=waves[1, 0])
    np.sin(waves[1, 0], out=waves[0, 0])
    np.cos(waves[1, 0], out=waves[1, 0])
    twice, before = 2 * waves[1, 0], np.array([[0.0], [1.0]])
    for k in range(1, orders):
        np.multiply(twice, waves[:, k - 1], out=waves[:, k])
        waves[:, k] -= before
        before = waves[:, k - 1]
    if coefficients is not None:
        k = 2 * np.pi * np.arange(1, orders + 1)
        of_sine, of_cosine = np.reshape(coefficients[lead:], (2, orders))
        np.multiply(t, np.concatenate([-k * of_cosine, k * of_sine]) @ rows[lead:last], out=rows[-1])
    return rows
