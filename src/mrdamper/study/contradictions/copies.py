"""Runs that are copies of others: with added noise, cropped, shifted in time, decimated, or under another name.

Two tests never share their noise. The highest frequencies of the force, where a sampled test holds
noise alone, are correlated between two runs over all shifts in time; a copy has one sharp peak.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mrdamper.data import Floats, Run

_MAX_SAMPLES = 2**15  # samples of a run that are compared
_SAME_STROKE = 0.05  # relative difference of the strokes of two records of one test
_RANGE_SAMPLES = 4000  # samples from which ranges are taken
_SAME_RANGE = 0.15  # relative difference of their peak-to-peak forces
_MIN_OVERLAP = 150  # samples two records have to share
_MIN_CORRELATION = 0.35  # of the noise of two copies
# by which it exceeds the largest correlation of a run's noise with itself at another time
_MIN_EXCESS_CORRELATION = 0.25
_SIGNIFICANCE = 9.0  # standard deviations of a correlation by chance
_MAX_RATE_RATIO = 10  # ratio of two sample rates
_PHASES = 8  # fractions of a sample by which a run is shifted before the comparison at another sample rate
_RATIO_TOLERANCE = 0.01  # relative deviation of that ratio from a whole number


@dataclass(frozen=True)
class Copy:
    """A run that holds the samples of another."""

    run_id: str
    original: str
    correlation: float  # of the noise of the two forces


def find_copies(runs: Sequence[Run]) -> list[Copy]:
    """Find the runs whose force is another's; of an identification and a validation run, the validation run."""
    ranges = {run.id: _ranges(run) for run in runs}
    copies: dict[str, Copy] = {}
    for first, second in combinations(runs, 2):
        if first.id in copies or second.id in copies or not _alike(ranges[first.id], ranges[second.id]):
            continue
        correlation = _shared_noise(first, second)
        if correlation is not None:
            original, copy = (second, first) if first.split == "validate" != second.split else (first, second)
            copies[copy.id] = Copy(copy.id, original.id, correlation)
    return list(copies.values())


def _ranges(run: Run) -> tuple[float, float]:
    """Range of displacement [m] and force [N], without the outermost samples."""
    every = slice(None, None, max(1, run.force.size // _RANGE_SAMPLES))
    x, force = (np.percentile(values[every], (1, 99)) for values in (run.displacement, run.force))
    return float(np.ptp(x)), float(np.ptp(force))


def _alike(a: tuple[float, float], b: tuple[float, float]) -> bool:
    limits = (_SAME_STROKE, _SAME_RANGE)
    return all(abs(p - q) <= limit * max(p, q) for p, q, limit in zip(a, b, limits, strict=True))


def _shared_noise(first: Run, second: Run) -> float | None:
    """Correlation of the noise of two runs at the best shift, None if they are two tests."""
    steps = [float(run.time[-1] - run.time[0]) / (run.time.size - 1) for run in (first, second)]
    fine, coarse = (first, second) if steps[0] <= steps[1] else (second, first)
    ratio = max(steps) / min(steps)
    every = round(ratio)
    if every > _MAX_RATE_RATIO:
        return None
    other = _noise(coarse.force)
    best: float | None = None
    is_even = abs(ratio / every - 1) <= _RATIO_TOLERANCE
    for phase in range(every if is_even else _PHASES):
        if is_even:
            force = fine.force[phase::every]
        else:
            places = np.arange(phase / _PHASES, fine.force.size / ratio - 1) * ratio
            force = np.interp(places, np.arange(fine.force.size), fine.force)
        correlation = _correlation(_noise(force), other)
        if correlation is not None and (best is None or correlation > best):
            best = correlation
    return best


def _correlation(a: Floats, b: Floats) -> float | None:
    if min(a.size, b.size) < _MIN_OVERLAP:
        return None
    size = 2 ** int(np.ceil(np.log2(a.size + b.size)))
    spectra = [np.fft.rfft(x, size) for x in (a, b)]
    power = [np.fft.rfft(x * x, size) for x in (a, b)]
    there = [np.fft.rfft(np.ones(x.size), size) for x in (a, b)]

    def over_shifts(one: np.ndarray, two: np.ndarray) -> Floats:
        return np.fft.irfft(one * np.conj(two), size)

    overlap = over_shifts(there[0], there[1])
    energy = np.sqrt(np.maximum(over_shifts(power[0], there[1]) * over_shifts(there[0], power[1]), 0.0))
    usable = (overlap > max(_MIN_OVERLAP, 0.3 * min(a.size, b.size))) & (energy > 0)
    if not usable.any():
        return None
    values = np.where(usable, over_shifts(*spectra) / np.where(usable, energy, 1.0), 0.0)
    peak = int(np.argmax(values))
    own = max(_largest_own(x) for x in (a, b))
    least = max(_MIN_CORRELATION, own + _MIN_EXCESS_CORRELATION, _SIGNIFICANCE / float(np.sqrt(overlap[peak])))
    return float(values[peak]) if values[peak] > least else None


def _largest_own(noise: Floats) -> float:
    """Largest correlation of a run's noise with itself at another time: noise that repeats in every cycle."""
    size = 2 ** int(np.ceil(np.log2(2 * noise.size)))
    own = np.fft.irfft(np.abs(np.fft.rfft(noise, size)) ** 2, size)[: noise.size // 2]
    if own[0] <= 0:
        return 1.0
    share = np.arange(noise.size, noise.size - own.size, -1) / noise.size
    return float(np.max((own / own[0] / share)[8:], initial=0.0))


def _noise(force: Floats) -> Floats:
    """Return the highest frequencies of a force, without dominant lines."""
    part = force[:_MAX_SAMPLES]
    if part.size < _MIN_OVERLAP:
        return np.zeros(0)
    rest = part[2:-2] - (4 * (part[1:-3] + part[3:-1]) - (part[:-4] + part[4:])) / 6
    limit = 4 * float(np.median(np.abs(rest))) / 0.6745
    return np.clip(rest, -limit, limit)
