"""Kerbs: up, down, up again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.parameters import param
from mrdamper.systems.inputs.base import Input


@dataclass(frozen=True)
class Steps(Input):
    """Ramps of half a cosine, up and down in turn, one every period."""

    name: ClassVar[str] = "steps"
    title: ClassVar[str] = "steps"
    kind: ClassVar[Any] = "road"

    height_m: float = param("m", "of a step", bounds=(-1, 1), default=0.02)
    rise_s: float = param("s", "from down to up", bounds=(1e-3, 10), default=0.02)
    period_s: float = param("s", "between steps", bounds=(0.05, 100), default=2.0)
    length_s: float = param("s", "simulated", bounds=(0.1, 3600), default=8.0)

    @property
    def step(self) -> float:
        return self.rise_s / 20

    def value(self, time: Floats) -> Floats:
        share, up = self._at(time)
        risen = 0.5 * (1 - np.cos(np.pi * share))
        return self.height_m * np.where(up, risen, 1 - risen)

    def rate(self, time: Floats) -> Floats:
        share, up = self._at(time)
        slope = 0.5 * np.pi / self.rise_s * np.sin(np.pi * share)
        return self.height_m * np.where(up, slope, -slope)

    def _at(self, time: Floats) -> tuple[Floats, Floats]:
        """How far the step at hand is done, and whether it goes up; the first comes after half a period."""
        turn = (time + 0.5 * self.period_s) / self.period_s
        which = np.maximum(np.floor(turn), 0)
        since = np.where(which == 0, self.rise_s, (turn - which) * self.period_s)
        return np.clip(since / self.rise_s, 0.0, 1.0), which % 2 == 1
