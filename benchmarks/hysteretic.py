"""The hysteretic benchmark of Noël and Schoukens: `python -m benchmarks.hysteretic`.

The system of Noël and Schoukens (2016), integrated here: a multisine of 5 to 150 Hz to identify from, another one and a
sweep from 20 to 50 Hz to predict, with and without a delay of one sample between the channels, and noise of 1 % of the
displacement. This identification uses the structure of the system; black-box methods of the literature do not, and the
best published one has 7.2e-6 m on the multisine [recalled].
"""

from __future__ import annotations

import time

import numpy as np

from mrdamper.data import Floats
from mrdamper.systems.oscillator import Oscillator, OscillatorFit, identify_oscillator, multisine

SYSTEM = Oscillator(m=2.0, c=10.0, k=5e4, alpha=5e4, beta=1e3, gamma=0.8, delta=-1.1)
RATE = 750.0  # sample rate [Hz]
FINER = 4  # steps of the integration of the records, relative to those of the identification
_SIZE = 8192  # samples of a period
_NOISE = 0.01  # standard deviation, relative to that of the displacement


def made_record(force: Floats, *, periodic: bool) -> Floats:
    """Displacement [m] of the system, integrated at finer steps than the identification's."""
    from scipy.interpolate import CubicSpline
    from scipy.signal import resample

    if periodic:
        return SYSTEM.response(np.asarray(resample(force, FINER * force.size)), FINER * RATE, periodic=True)[::FINER]
    places = np.arange((force.size - 1) * FINER + 1) / FINER
    return SYSTEM.response(CubicSpline(np.arange(force.size), force)(places), FINER * RATE)[::FINER]


def sweep(seconds: float, amplitude: float = 40.0) -> Floats:
    """Sine sweep from 20 to 50 Hz [N]."""
    at = np.arange(0, seconds, 1 / RATE)
    return amplitude * np.sin(2 * np.pi * (20 * at + 15 * at**2 / seconds))


def identified(seed: int, delay: int, size: int = _SIZE) -> OscillatorFit:
    """The system identified from one noisy period, its displacement late by some samples."""
    rng = np.random.default_rng(seed)
    force = multisine(rng, size, RATE, (5.0, 150.0), rms=50.0)
    clean = np.roll(made_record(force, periodic=True), delay)
    return identify_oscillator(force, clean + _NOISE * np.std(clean) * rng.standard_normal(size), RATE)


def errors(fit: OscillatorFit, seed: int, seconds: float = 180.0, size: int = _SIZE) -> tuple[float, float]:
    """RMS errors of the displacement under another multisine and under the sweep [m]."""
    force = multisine(np.random.default_rng(seed), size, RATE, (5.0, 150.0), rms=50.0)
    missed = fit.oscillator.response(force, RATE, periodic=True) - made_record(force, periodic=True)
    swept = sweep(seconds)
    late = fit.oscillator.response(swept, RATE) - made_record(swept, periodic=False)
    return float(np.sqrt(np.mean(missed**2))), float(np.sqrt(np.mean(late**2)))


def main() -> None:
    print("| delay | identified delay | multisine, RMS error | sweep, RMS error | processor time |")
    print("|---|---|---|---|---|")
    for delay in (0, 1):
        begin = time.process_time()
        fit = identified(1, delay)
        spent = time.process_time() - begin
        first, second = errors(fit, 2)
        print(
            f"| {delay} samples | {RATE * fit.delay_s:.3f} samples | {first:.1e} m | {second:.1e} m | {spent:.1f} s |"
        )


if __name__ == "__main__":
    main()
