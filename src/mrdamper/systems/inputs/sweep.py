"""A sine whose frequency rises."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.parameters import param
from mrdamper.systems.inputs.base import Input


@dataclass(frozen=True)
class Sweep(Input):
    """A sin φ(t), the frequency rising in proportion to its logarithm; amplitude falls as 1/f above the first.

    So the speed of the road stays below that at the lowest frequency, as on a test rig with
    limited oil flow.
    """

    name: ClassVar[str] = "sweep"
    title: ClassVar[str] = "swept sine"
    kind: ClassVar[Any] = "road"

    amplitude_m: float = param("m", "at the lowest frequency", bounds=(0, 1), default=0.02)
    lowest_Hz: float = param("Hz", "at the start", bounds=(0.01, 100), default=0.5)
    highest_Hz: float = param("Hz", "at the end", bounds=(0.01, 100), default=15.0)
    length_s: float = param("s", "of the sweep", bounds=(1, 3600), default=30.0)

    @property
    def step(self) -> float:
        return 1 / (60 * max(self.lowest_Hz, self.highest_Hz))

    def value(self, time: Floats) -> Floats:
        f, phase = self._at(time)
        return self.amplitude_m * self.lowest_Hz / f * np.sin(phase)

    def rate(self, time: Floats) -> Floats:
        f, phase = self._at(time)
        moving = (time >= 0) & (time <= self.length_s)
        slope = 2 * math.pi * f * np.cos(phase) - self._growth * np.sin(phase)
        return np.where(moving, self.amplitude_m * self.lowest_Hz / f * slope, 0.0)

    @property
    def _growth(self) -> float:
        """D ln f / dt [1/s]; a hair above zero for one frequency."""
        return (math.log(self.highest_Hz / self.lowest_Hz) or 1e-9) / self.length_s

    def _at(self, time: Floats) -> tuple[Floats, Floats]:
        t = np.clip(time, 0.0, self.length_s)
        f = self.lowest_Hz * np.exp(self._growth * t)
        return f, 2 * math.pi * self.lowest_Hz * np.expm1(self._growth * t) / self._growth
