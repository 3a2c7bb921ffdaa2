"""Hyperbolic tangent model: a tanh over velocity, shifted to either side of the loop."""

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
class Kwok(Model):
    """F = c v + k x + alpha tanh(beta v + delta sgn x) + f0.

    Memoryless: sgn(x) replaces the branch of the loop, so the form holds for sines about mid-stroke. At x = 0 the force
    jumps by alpha [tanh(beta v + delta) − tanh(beta v − delta)], which is small where beta v is large; a positive `xs`
    smooths it.

    References
    ----------
    Kwok, Ha, Nguyen, Li and Samali (2006), "A novel hysteretic model for magnetorheological
    fluid dampers and parameter identification using particle swarm optimization", Sensors
    and Actuators A 132, 441–451. The form is recalled.
    """

    name: ClassVar[str] = "kwok"
    title: ClassVar[str] = "hyperbolic tangent"
    equation: ClassVar[str] = (
        r"F = c\,v + k\,x + \alpha \tanh(\beta v + \delta\,\sigma) + f_0,\quad "
        r"\sigma = \tanh(x/x_s)\;\mathrm{(}x_s = 0{:}\;\mathrm{sgn}\,x\mathrm{)}"
    )
    source: ClassVar[str] = "Kwok et al. 2006"
    state_column: ClassVar[str | None] = "alpha"

    c: float = param("N s/m", "post-yield viscous damping", bounds=(0, np.inf), linear=True)
    k: float = param("N/m", "stiffness", linear=True)
    alpha: float = param("N", "hysteretic force", bounds=(0, np.inf), linear=True)
    beta: float = param("s/m", "steepness of the pre-yield curve", bounds=(1e-3, 1e6), scale="log")
    delta: float = param("-", "half the width of the loop over beta v", bounds=(0, 20))
    f0: float = param("N", "offset force", linear=True, default=0.0)
    xs: float = param(
        "m", "displacement in which the loop changes side; 0: at once", bounds=(0, 1), preset=True, default=0.0
    )

    def state(self, motion: Excitation) -> Floats:
        """Share of the hysteretic force, −1...1, at the samples."""
        return np.tanh(self.beta * motion.velocity + self.delta * side(motion.displacement, self.xs))

    def force(self, motion: Excitation, state: Floats) -> Floats:
        return self.c * motion.velocity + self.k * motion.displacement + self.alpha * state + self.f0

    @classmethod
    def search_axes(cls, scale: Scale, free: Sequence[str]) -> tuple[SearchAxis, ...]:
        """Search the yield of the curve between a thousandth and all of the peak velocity."""
        speed, amplitude = scale.speed, scale.amplitude
        return axes_of(
            free,
            SearchAxis("beta", 0.1 / speed, 1e4 / speed, tuple(np.geomspace(1, 300, 6) / speed), log=True),
            SearchAxis("delta", 0.0, 10.0, (0.1, 0.8, 2.0)),
            SearchAxis("xs", 1e-4 * amplitude, amplitude, (0.05 * amplitude,), log=True),
        )
