"""Bingham: Coulomb yield force parallel to a viscous damper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.models.base import Model
from mrdamper.physics.motion import Excitation


@dataclass(frozen=True)
class Bingham(Model):
    """F = c v + f_y sgn(v) + f0.

    References
    ----------
    Stanway, Sproston and Stevens (1987), "Non-linear modelling of an electro-rheological
    vibration damper", J. Electrostatics 20, 167–184. The form is recalled.
    """

    name: ClassVar[str] = "bingham"
    title: ClassVar[str] = "Bingham"
    equation: ClassVar[str] = r"F = c\,v + f_y\,\mathrm{sgn}(v) + f_0"
    source: ClassVar[str] = "Stanway, Sproston and Stevens 1987"

    c: float = param("N s/m", "post-yield viscous damping", bounds=(0, np.inf), linear=True)
    fy: float = param("N", "yield force", bounds=(0, np.inf), linear=True)
    f0: float = param("N", "offset force", linear=True, default=0.0)

    def force(self, motion: Excitation, state: Floats) -> Floats:
        return self.c * motion.velocity + self.fy * np.sign(motion.velocity) + self.f0
