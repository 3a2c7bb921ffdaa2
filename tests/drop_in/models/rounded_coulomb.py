"""Viscous damping, a spring, and friction that turns over within 5 mm/s."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.models.base import Model
from mrdamper.physics.motion import Excitation


@dataclass(frozen=True)
class RoundedCoulomb(Model):
    """F = c v + k x + f_y tanh(v/(5 mm/s)) + f0.

    References
    ----------
    None: a model for trying where models go.
    """

    name: ClassVar[str] = "rounded-coulomb"
    title: ClassVar[str] = "rounded Coulomb"
    equation: ClassVar[str] = r"F = c\,v + k\,x + f_y \tanh(v/0.005) + f_0"
    source: ClassVar[str] = "none"

    c: float = param("N s/m", "viscous damping", bounds=(0, np.inf), linear=True)
    k: float = param("N/m", "stiffness", bounds=(0, np.inf), linear=True)
    fy: float = param("N", "friction force", bounds=(0, np.inf), linear=True)
    f0: float = param("N", "offset force", linear=True, default=0.0)

    def state(self, motion: Excitation) -> Floats:
        """Share of the friction force, −1...1."""
        return np.tanh(motion.velocity / 0.005)

    def force(self, motion: Excitation, state: Floats) -> Floats:
        return self.c * motion.velocity + self.k * motion.displacement + self.fy * state + self.f0
