"""The noise of a channel from sample to sample."""

from __future__ import annotations

import numpy as np

from mrdamper.data import Floats


def sample_noise(signal: Floats) -> float:
    """Standard deviation of white noise on a smooth signal, from its third differences.

    The median keeps corners of the signal out; 20 is the sum of the squared coefficients
    1, 3, 3, 1, and 0.6745 the median of a standard normal's size.
    """
    third = np.abs(np.diff(signal, 3))
    third = third[np.isfinite(third)]
    return float(np.median(third)) / 0.6745 / float(np.sqrt(20)) if third.size else 0.0
