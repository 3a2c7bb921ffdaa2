"""Harmonic regression: mean, drift and harmonics of a periodic signal by least squares.

Unlike a Fourier transform it needs neither a whole number of cycles nor uniform sampling.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.data import Floats


@dataclass(frozen=True, eq=False)
class HarmonicSeries:
    """mean + drift (t − t0) + Σ_k sine_k sin kω(t − t0) + cosine_k cos kω(t − t0), k = 1...K.

    Attributes
    ----------
    frequency : float
        ω/2π [Hz].
    origin : float
        t0 [s].
    mean, drift : float
        [signal], [signal/s].
    sine, cosine : (K,) arrays
        [signal].
    """

    frequency: float
    origin: float
    mean: float
    drift: float
    sine: Floats
    cosine: Floats

    def __call__(self, time: ArrayLike, derivative: int = 0) -> Floats:
        """The series (or a derivative with respect to time) at the given times."""
        t = np.asarray(time, dtype=float) - self.origin
        k_omega = 2 * np.pi * self.frequency * np.arange(1, self.sine.size + 1)
        angle = np.multiply.outer(t, k_omega) + derivative * np.pi / 2
        scale = k_omega**derivative
        trend = {0: self.mean + self.drift * t, 1: np.full_like(t, self.drift)}.get(derivative, np.zeros_like(t))
        return trend + np.sin(angle) @ (scale * self.sine) + np.cos(angle) @ (scale * self.cosine)

    def amplitude(self, order: int = 1) -> float:
        """Amplitude of one harmonic."""
        return float(np.hypot(self.sine[order - 1], self.cosine[order - 1]))

    def phase(self, order: int = 1) -> float:
        """φ of one harmonic written as amplitude · sin(kω(t − t0) + φ) [rad]."""
        return float(np.arctan2(self.cosine[order - 1], self.sine[order - 1]))

    def half_peak_to_peak(self) -> float:
        """Half the difference of maximum and minimum of the periodic part."""
        theta = np.linspace(0, 2 * np.pi, 2048, endpoint=False)
        k = np.arange(1, self.sine.size + 1)
        wave = np.sin(np.outer(theta, k)) @ self.sine + np.cos(np.outer(theta, k)) @ self.cosine
        return float(np.ptp(wave) / 2)


def fit_harmonics(time: Floats, signal: Floats, orders: int, *, frequency: float, drift: bool = True) -> HarmonicSeries:
    """Least-squares harmonic series at a known fundamental.

    Parameters
    ----------
    time, signal : (N,) arrays
    orders : int
        Number of harmonics; lowered where the record cannot resolve them.
    frequency : float
        Fundamental [Hz].
    drift : bool
        Fit a linear drift of the mean.
    """
    origin = float(time[0])
    nyquist = 0.5 / float(np.median(np.diff(time)))
    orders = int(np.clip(nyquist / frequency, 1, orders))
    coefficients = _solve(_columns(time - origin, frequency, orders, drift), signal)
    lead = 2 if drift else 1
    return HarmonicSeries(
        frequency=frequency,
        origin=origin,
        mean=float(coefficients[0]),
        drift=float(coefficients[1]) if drift else 0.0,
        sine=coefficients[lead : lead + orders],
        cosine=coefficients[lead + orders :],
    )


def fundamental_frequency(time: Floats, signal: Floats, orders: int = 3) -> float:
    """Fundamental frequency [Hz] of a record of about one cycle or more.

    The strongest spectral line is where a search of the best single sine begins; Gauss–Newton
    on frequency and coefficients then finds it to rounding. Harmonics join only from three
    cycles on: a shorter record could be explained by the harmonics of a slower motion.
    """
    t = time - time[0]
    guess = _spectral_line(time, signal)
    few = slice(None, None, max(1, t.size // 400))
    if guess * t[-1] < 4:
        ladder = guess * np.geomspace(0.4, 2.5, 45)
        guess = min(ladder, key=lambda f: float(np.sum(_residual(t[few], signal[few], f) ** 2)))
    orders = orders if guess * t[-1] >= 3 else 1
    frequency = float(guess)
    for _ in range(30):
        columns = _columns(t, frequency, orders, drift=True)
        coefficients = _solve(columns, signal)
        slope = _frequency_derivative(t, frequency, coefficients, orders)
        step = float(_solve(np.column_stack([columns, slope]), signal)[-1])
        frequency += float(np.clip(step, -0.1 * frequency, 0.1 * frequency))
        if abs(step) < 1e-11 * frequency:
            break
    return frequency


def _residual(t: Floats, signal: Floats, frequency: float) -> Floats:
    columns = _columns(t, frequency, 1, drift=True)
    return columns @ _solve(columns, signal) - signal


def _spectral_line(time: Floats, signal: Floats) -> float:
    """Find the strongest line of the detrended, zero-padded spectrum [Hz]."""
    size = time.size
    wave = np.interp(np.linspace(time[0], time[-1], size), time, signal)
    wave = wave - np.polynomial.Polynomial.fit(np.arange(size), wave, 1)(np.arange(size))
    window = np.hanning(size + 2)[1:-1] if _crossings(wave) > 4 else np.ones(size)
    padded = 8 * size
    power = np.abs(np.fft.rfft(wave * window, padded)) ** 2
    power[: padded // size // 2] = 0.0
    peak = int(np.argmax(power))
    return max(peak, 1) * (size - 1) / (padded * float(time[-1] - time[0]))


def _crossings(wave: Floats) -> int:
    return int(np.count_nonzero(np.diff(np.signbit(wave))))


def _columns(t: Floats, frequency: float, orders: int, drift: bool) -> Floats:
    angle = np.outer(t, 2 * np.pi * frequency * np.arange(1, orders + 1))
    trend = [np.ones_like(t), t] if drift else [np.ones_like(t)]
    return np.column_stack([*trend, np.sin(angle), np.cos(angle)])


def _frequency_derivative(t: Floats, frequency: float, coefficients: Floats, orders: int) -> Floats:
    k = np.arange(1, orders + 1)
    angle = np.outer(t, 2 * np.pi * frequency * k)
    sine, cosine = coefficients[2 : 2 + orders], coefficients[2 + orders :]
    return 2 * np.pi * t * (np.cos(angle) @ (k * sine) - np.sin(angle) @ (k * cosine))


def _solve(columns: Floats, signal: Floats) -> Floats:
    scale = np.sqrt(np.mean(columns**2, axis=0))
    scale[scale == 0] = 1.0
    return np.linalg.lstsq(columns / scale, signal, rcond=None)[0] / scale
