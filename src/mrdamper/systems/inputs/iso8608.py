"""Random roads of ISO 8608, classes A to E."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.systems.inputs.base import Input

REFERENCE = 0.1  # cycles/m
LOWEST, HIGHEST = 0.011, 2.83  # cycles/m, of the classification
_CLASSES = {"a": 16e-6, "b": 64e-6, "c": 256e-6, "d": 1024e-6, "e": 4096e-6}
_POINTS_A_WAVE = 24  # of the shortest
_FADE_IN = 0.5  # s


@dataclass(frozen=True)
class Road(Input):
    """A sum of waves of random phase, amplitude by G_d(n) = G_d(n0) (n/n0)^−2.

    The wave numbers are multiples of one over the length of the road. The first half second fades in, because the car
    begins at rest.

    References
    ----------
    ISO 8608:2016, "Mechanical vibration — Road surface profiles — Reporting of measured data".
    """

    name: ClassVar[str] = "iso8608"
    title: ClassVar[str] = "random road, ISO 8608"
    kind: ClassVar[Any] = "road"

    roughness_m3: float = param("m³", "G_d at 0.1 cycles/m", bounds=(0, 1), default=64e-6)
    speed_m_s: float = param("m/s", "of travel", bounds=(0.1, 150), default=20.0)
    length_s: float = param("s", "driven", bounds=(1, 3600), default=30.0)
    seed: float = param("-", "of the phases", bounds=(0, 2**53), default=1.0)

    @classmethod
    def variants(cls) -> Mapping[str, Mapping[str, float]]:
        return {f"iso8608-{letter}": {"roughness_m3": value} for letter, value in _CLASSES.items()}

    @property
    def step(self) -> float:
        return 1 / (_POINTS_A_WAVE * HIGHEST * self.speed_m_s)

    @cached_property
    def profile(self) -> Any:
        """Height [m] over distance [m], a spline."""
        from scipy.interpolate import CubicSpline

        length = self.speed_m_s * self.length_s
        points = 2 * math.ceil(length * HIGHEST * _POINTS_A_WAVE / 2)
        n = np.arange(points // 2 + 1) / length
        inside = (n >= LOWEST) & (n <= HIGHEST)
        amplitude = np.zeros(n.size)
        amplitude[inside] = np.sqrt(2 * self.roughness_m3 * (n[inside] / REFERENCE) ** -2.0 / length)
        phase = np.random.default_rng(int(self.seed)).uniform(0, 2 * np.pi, n.size)
        height = np.fft.irfft(amplitude * np.exp(1j * phase) * points / 2, points)
        distance = np.linspace(0, length, points + 1)
        return CubicSpline(distance, np.append(height, height[0]), bc_type="periodic")

    def value(self, time: Floats) -> Floats:
        distance = np.maximum(time, 0.0) * self.speed_m_s
        return _fade(time)[0] * self.profile(distance)

    def rate(self, time: Floats) -> Floats:
        distance = np.maximum(time, 0.0) * self.speed_m_s
        share, slope = _fade(time)
        return share * self.speed_m_s * self.profile(distance, 1) + slope * self.profile(distance)


def _fade(time: Floats) -> tuple[Floats, Floats]:
    phase = np.clip(time / _FADE_IN, 0.0, 1.0) * np.pi
    fading = (time > 0) & (time < _FADE_IN)
    return 0.5 * (1 - np.cos(phase)), np.where(fading, 0.5 * np.pi / _FADE_IN * np.sin(phase), 0.0)
