"""Algebraic model: an arctangent over velocity, shifted to either side of the loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.models.base import Model, Scale, SearchAxis, axes_of
from mrdamper.models.sides import side
from mrdamper.physics.motion import Excitation


@dataclass(frozen=True)
class Guo(Model):
    """F = (2/pi) f_y arctan[kappa (v + v0 sgn x)] + c v + k x + f0, k is zero unless freed.

    Memoryless: sgn(x) replaces the branch of the loop, so the form holds for sines about mid-stroke. Just before a
    reversal at positive x the force is still positive, which determines the sign of the shift.

    References
    ----------
    Guo, Yang and Pan (2006), "Dynamical modeling of magneto-rheological damper behaviors",
    J. Intelligent Material Systems and Structures 17, 3–14. The form is recalled.
    """

    name: ClassVar[str] = "guo"
    title: ClassVar[str] = "algebraic (arctangent)"
    equation: ClassVar[str] = (
        r"F = \frac{2}{\pi} f_y \arctan[\kappa (v + v_0\,\sigma)] + c\,v + k\,x + f_0,\quad "
        r"\sigma = \tanh(x/x_s)\;\mathrm{(}x_s = 0{:}\;\mathrm{sgn}\,x\mathrm{)}"
    )
    source: ClassVar[str] = "Guo, Yang and Pan 2006"
    state_column: ClassVar[str | None] = "fy"

    fy: float = param("N", "yield force", bounds=(0, np.inf), linear=True)
    c: float = param("N s/m", "post-yield viscous damping", bounds=(0, np.inf), linear=True)
    kappa: float = param("s/m", "steepness of the pre-yield curve", bounds=(1e-3, 1e7), scale="log")
    v0: float = param("m/s", "velocity at which the force changes sign", bounds=(0, 10))
    f0: float = param("N", "offset force", linear=True, default=0.0)
    k: float = param("N/m", "stiffness", linear=True, preset=True, default=0.0)
    xs: float = param(
        "m", "displacement in which the loop changes side; 0: at once", bounds=(0, 1), preset=True, default=0.0
    )

    def state(self, motion: Excitation) -> Floats:
        """Share of the yield force, −1...1, at the samples."""
        shifted = motion.velocity + self.v0 * side(motion.displacement, self.xs)
        return 2 / np.pi * np.arctan(self.kappa * shifted)

    def force(self, motion: Excitation, state: Floats) -> Floats:
        return self.fy * state + self.c * motion.velocity + self.k * motion.displacement + self.f0

    @classmethod
    def search_axes(cls, scale: Scale, free: Sequence[str]) -> tuple[SearchAxis, ...]:
        """Search the yield of the curve between a thousandth and all of the peak velocity."""
        speed, amplitude = scale.speed, scale.amplitude
        return axes_of(
            free,
            SearchAxis("kappa", 0.1 / speed, 1e5 / speed, tuple(np.geomspace(2, 2e3, 6) / speed), log=True),
            SearchAxis("v0", 0.0, speed, (0.003 * speed, 0.03 * speed, 0.2 * speed)),
            SearchAxis("xs", 1e-4 * amplitude, amplitude, (0.05 * amplitude,), log=True),
        )
