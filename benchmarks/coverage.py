"""Share of 95 % intervals that hold the truth: ours beside the textbook's. `python -m benchmarks.coverage`."""

from __future__ import annotations

import argparse

import numpy as np
from scipy.signal import lfilter
from scipy.special import stdtrit

from mrdamper.data import Floats
from mrdamper.identification.covariance import spread

PARAMETERS = ("c", "k", "alpha", "z_y", "f0")
# Correlation of neighbouring samples of the noise, cycles, and the share of model error that repeats.
CASES = {
    "white": (0.0, 5, 0.0),
    "AR 0.9": (0.9, 5, 0.0),
    "AR 0.99": (0.99, 5, 0.0),
    "AR 0.998": (0.998, 5, 0.0),
    "repeats every cycle, 5 cycles": (0.0, 5, 1.0),
    "repeats every cycle, 20 cycles": (0.0, 20, 1.0),
}
_SAMPLES = 200  # a cycle


def design(cycles: int) -> Floats:
    """(N, P) derivatives of a damper's force with yield in a sine, by the parameters above."""
    phase = 2 * np.pi * np.arange(_SAMPLES * cycles) / _SAMPLES
    bent = np.tanh(8 * (np.cos(phase) + 0.3 * np.sin(phase)))
    return np.column_stack([np.cos(phase), np.sin(phase), bent, (1 - bent**2) * np.sin(phase), np.ones(phase.size)])


def error_of(case: tuple[float, int, float], rng: np.random.Generator) -> Floats:
    """One draw of what a record leaves over."""
    correlation, cycles, repeated = case
    noise = rng.standard_normal(_SAMPLES * cycles + 5000)
    if not repeated:
        return lfilter([1], [1, -correlation], noise)[5000:]
    spectrum = np.fft.rfft(rng.standard_normal(_SAMPLES))
    spectrum[1:] /= np.arange(1, spectrum.size)
    spectrum[0] = 0
    shape = np.fft.irfft(spectrum, _SAMPLES)
    return np.tile(shape / shape.std(), cycles) * repeated + 0.1 * noise[5000:]


def covered(case: tuple[float, int, float], repeats: int, seed: int = 0) -> tuple[Floats, Floats]:
    """(P,) shares of intervals that hold the truth: ours, the textbook's."""
    rng, jacobian = np.random.default_rng(seed), design(case[1])
    time = np.arange(len(jacobian)) / _SAMPLES
    solve, inverse = np.linalg.pinv(jacobian), np.linalg.inv(jacobian.T @ jacobian)
    ours, textbook = np.zeros(jacobian.shape[1]), np.zeros(jacobian.shape[1])
    for _ in range(repeats):
        error = error_of(case, rng)
        wrong = solve @ error
        residual = jacobian @ wrong - error
        found = spread(jacobian, residual, time, 1.0)
        ours += np.abs(wrong) <= stdtrit(found.dof, 0.975) * found.errors
        variance = residual @ residual / (residual.size - wrong.size)
        textbook += np.abs(wrong) <= 1.96 * np.sqrt(variance * np.diag(inverse))
    return ours / repeats, textbook / repeats


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=500)
    repeats = parser.parse_args().repeats
    print(f"share of 95 % intervals that hold the truth, {repeats} repeats, %; ours / textbook")
    print(f"{'':32}" + "".join(f"{name:>14}" for name in PARAMETERS))
    for title, case in CASES.items():
        ours, textbook = covered(case, repeats)
        cells = (f"{100 * a:.0f} / {100 * b:.0f}" for a, b in zip(ours, textbook, strict=True))
        print(f"{title:32}" + "".join(f"{cell:>14}" for cell in cells))


if __name__ == "__main__":
    main()
