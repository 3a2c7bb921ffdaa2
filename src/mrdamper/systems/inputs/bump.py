"""A single bump."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.parameters import param
from mrdamper.systems.inputs.base import Input

_BEFORE = 0.2  # s on flat road


@dataclass(frozen=True)
class Bump(Input):
    """A haversine: h (1 − cos 2πs/L)/2."""

    name: ClassVar[str] = "bump"
    title: ClassVar[str] = "haversine bump"
    kind: ClassVar[Any] = "road"

    height_m: float = param("m", "of the bump", bounds=(-1, 1), default=0.05)
    bump_m: float = param("m", "length of the bump", bounds=(0.01, 100), default=2.0)
    speed_m_s: float = param("m/s", "of travel", bounds=(0.1, 150), default=8.0)
    length_s: float = param("s", "simulated", bounds=(0.1, 3600), default=4.0)

    @property
    def step(self) -> float:
        return self.bump_m / self.speed_m_s / 40

    def value(self, time: Floats) -> Floats:
        return 0.5 * self.height_m * (1 - np.cos(self._phase(time)))

    def rate(self, time: Floats) -> Floats:
        return np.pi * self.speed_m_s / self.bump_m * self.height_m * np.sin(self._phase(time))

    def _phase(self, time: Floats) -> Floats:
        return 2 * math.pi * np.clip((time - _BEFORE) * self.speed_m_s / self.bump_m, 0.0, 1.0)
