"""Synthetic roads of few parameters: a bump, steps, a swept sine."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
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


@dataclass(frozen=True)
class Steps(Input):
    """Ramps of half a cosine, alternately up and down, one per period."""

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
        """Calculate the completed part of the present step, and if it goes up; the first comes after half a period."""
        turn = (time + 0.5 * self.period_s) / self.period_s
        which = np.maximum(np.floor(turn), 0)
        since = np.where(which == 0, self.rise_s, (turn - which) * self.period_s)
        return np.clip(since / self.rise_s, 0.0, 1.0), which % 2 == 1


@dataclass(frozen=True)
class Sweep(Input):
    """A sin φ(t) of exponentially rising frequency; the amplitude falls as 1/f, as on a rig with limited oil flow."""

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
        """D ln f / dt [1/s]; slightly above zero for a single frequency."""
        return (math.log(self.highest_Hz / self.lowest_Hz) or 1e-9) / self.length_s

    def _at(self, time: Floats) -> tuple[Floats, Floats]:
        t = np.clip(time, 0.0, self.length_s)
        f = self.lowest_Hz * np.exp(self._growth * t)
        return f, 2 * math.pi * self.lowest_Hz * np.expm1(self._growth * t) / self._growth
