"""Frequency weightings of ISO 2631-1 for vibration of the whole body."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import UnknownNameError

_MEMORY = 4.0  # periods of the lowest corner after which the response of the filter has decayed


@dataclass(frozen=True)
class Weighting:
    """Corner frequencies [Hz] and qualities of the four factors; infinite where a factor is missing.

    Band limits f1, f2; acceleration–velocity transition f3, f4, Q4; upward step f5, Q5, f6, Q6.

    References
    ----------
    ISO 2631-1:1997, Annex A, Table A.1.
    """

    f1: float
    f2: float
    f3: float
    f4: float
    Q4: float
    f5: float = math.inf
    Q5: float = 1.0
    f6: float = math.inf
    Q6: float = 1.0

    def response(self, frequency: Any) -> Any:
        """Complex gain at frequencies [Hz] above zero."""
        p = 1j * np.asarray(frequency, dtype=float)
        band = 1 / (1 + math.sqrt(2) * self.f1 / p + (self.f1 / p) ** 2)
        band = band / (1 + math.sqrt(2) * p / self.f2 + (p / self.f2) ** 2)
        transition = (1 + p / self.f3) / (1 + p / (self.Q4 * self.f4) + (p / self.f4) ** 2)
        if math.isinf(self.f5):
            return band * transition
        step = (1 + p / (self.Q5 * self.f5) + (p / self.f5) ** 2) / (1 + p / (self.Q6 * self.f6) + (p / self.f6) ** 2)
        return band * transition * step * (self.f5 / self.f6) ** 2


WEIGHTINGS = {
    "Wk": Weighting(0.4, 100, 12.5, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91),
    "Wd": Weighting(0.4, 100, 2.0, 2.0, 0.63),
    "Wf": Weighting(0.08, 0.63, math.inf, 0.25, 0.86, 0.0625, 0.80, 0.1, 0.80),
}


def frequency_weighted(acceleration: Floats, step: float, weighting: str) -> Floats:
    """Weight an acceleration by its effect on a person.

    The gain is applied to the spectrum, with zeros appended for the decay of the filter, so that the gain does not
    depend on the sampling rate, as that of the bilinear transform does.
    """
    if weighting not in WEIGHTINGS:
        raise UnknownNameError.of("weighting", weighting, WEIGHTINGS)
    from scipy.fft import next_fast_len

    filters = WEIGHTINGS[weighting]
    size = int(next_fast_len(acceleration.size + int(_MEMORY / filters.f1 / step), real=True) or acceleration.size)
    frequency = np.fft.rfftfreq(size, step)
    gain = np.zeros(frequency.size, dtype=complex)
    gain[1:] = filters.response(frequency[1:])
    return np.fft.irfft(np.fft.rfft(acceleration, size) * gain, size)[: acceleration.size]
