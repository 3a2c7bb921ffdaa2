"""Bingham model with a smooth yield."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.models.base import Model, Scale, SearchAxis, axes_of
from mrdamper.physics.motion import Excitation


@dataclass(frozen=True)
class SmoothBingham(Model):
    """F = c v + f_y tanh(v/v_s) + f0.

    References
    ----------
    Stanway, Sproston and Stevens (1987) for Bingham's form, recalled; the tanh in place of the sign is common practice.
    """

    name: ClassVar[str] = "smooth-bingham"
    title: ClassVar[str] = "smoothed Bingham"
    equation: ClassVar[str] = r"F = c\,v + f_y \tanh(v/v_s) + f_0"
    source: ClassVar[str] = "Stanway, Sproston and Stevens 1987, smoothed"
    state_column: ClassVar[str | None] = "fy"

    c: float = param("N s/m", "post-yield viscous damping", bounds=(0, np.inf), linear=True)
    fy: float = param("N", "yield force", bounds=(0, np.inf), linear=True)
    vs: float = param("m/s", "velocity in which the yield force builds up", bounds=(1e-7, 1e3), scale="log")
    f0: float = param("N", "offset force", linear=True, default=0.0)

    def state(self, motion: Excitation) -> Floats:
        """Share of the yield force, −1...1, at the samples."""
        return np.tanh(motion.velocity / self.vs)

    def force(self, motion: Excitation, state: Floats) -> Floats:
        return self.c * motion.velocity + self.fy * state + self.f0

    @classmethod
    def search_axes(cls, scale: Scale, free: Sequence[str]) -> tuple[SearchAxis, ...]:
        """Search the yield velocity between a thousandth and all of the peak velocity."""
        speed = scale.speed
        ladder = tuple(speed * np.geomspace(3e-3, 1.0, 8))
        return axes_of(free, SearchAxis("vs", 1e-4 * speed, 10 * speed, ladder, log=True))
