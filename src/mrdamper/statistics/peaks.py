"""Largest and smallest values of cycles, without what noise adds to them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrdamper.data.arrays import Floats

_DENSE = 64  # samples per cycle from which the noise is told from the shape of the loop
_QUIET = 1e-4  # noise over the peak-to-peak force that changes no figure; the differences of a clean loop are as large
_MAX_SAMPLES = 200_000  # samples that get noise, of all draws together
_DRAWS = (4, 20)  # fewest and most
# Relative growth of the excess of the largest sample from noise to √2 times the noise. The excess is in proportion to
# the noise at a level peak, and grows slightly faster at a round or sharp one: more samples come near the largest.
_GROWTH = 2**0.54 - 1


def sample_noise(signal: Floats) -> float:
    """Return standard deviation of white noise on a smooth signal, from its third differences.

    The median keeps corners of the signal out; 20 is the sum of the squared coefficients
    1, 3, 3, 1, and 0.6745 the median of a standard normal's size.
    """
    third = np.abs(signal[3:] - signal[:-3] - 3 * (signal[2:-1] - signal[1:-2]))
    third = third[np.isfinite(third)]
    if not third.size:
        return 0.0
    middle = third.size // 2  # of an even number, the upper of the two
    return float(np.partition(third, middle)[middle]) / 0.6745 / float(np.sqrt(20))


def cycle_starts(samples: int, cycles: int) -> NDArray[np.intp]:
    """(K,) first samples of cycles that share so many samples evenly."""
    return np.array([part[0] for part in np.array_split(np.arange(samples), cycles)])


def cycle_extremes(values: Floats, starts: NDArray[np.intp]) -> tuple[float, float]:
    """Largest and smallest value of a cycle, median over the cycles that begin at some samples."""
    return _median(np.maximum.reduceat(values, starts)), _median(np.minimum.reduceat(values, starts))


def _median(values: Floats) -> float:
    """Median of a few values: a third of the time of NumPy's, which is made for arrays of several dimensions."""
    values.sort()  # NaN last
    middle = values.size // 2
    return float((values[middle] + values[~middle]) / 2 if values[-1] == values[-1] else values[-1])


def extreme_forces(force: Floats, starts: NDArray[np.intp]) -> tuple[float, float]:
    """Largest and smallest force of a cycle [N], median over the cycles, without what noise adds to them.

    The largest of noisy samples exceeds the largest force. Noise of the same size is added to the record, and the
    change is extrapolated to no noise [SIMEX: Cook and Stefanski 1994, J. Am. Stat. Assoc. 89, 1314]. Nothing is
    smoothed, so that sharp peaks remain.
    """
    ends, part = cycle_extremes(force, starts), force[:_MAX_SAMPLES]
    noise, begins, rng = sample_noise(part), starts[starts < part.size], np.random.default_rng(0)
    if force.size < _DENSE * starts.size or noise < _QUIET * (ends[0] - ends[1]):
        return ends
    draws = int(np.clip(_MAX_SAMPLES // part.size, *_DRAWS))
    noisy = [cycle_extremes(part + noise * rng.standard_normal(part.size), begins) for _ in range(draws)]
    excess = (np.mean(noisy, axis=0) - cycle_extremes(part, begins)) / _GROWTH
    return ends[0] - float(excess[0]), ends[1] - float(excess[1])
