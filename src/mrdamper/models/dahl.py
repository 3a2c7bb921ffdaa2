"""Dahl: friction that increases exponentially with displacement, parallel to a viscous damper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.models.base import GENERAL_FORMS, YIELD_DISPLACEMENTS, Model, Scale, SearchAxis, axes_of
from mrdamper.physics.hysteresis import Shape, follow
from mrdamper.physics.motion import Excitation


@dataclass(frozen=True)
class Dahl(Model):
    """F = kappa_x v + kappa_w w + f0, dw/dt = rho (v − |v| w).

    A Bouc–Wen element with n = 1 and gamma = 0, with an exact solution. `yield_displacement` is 1/rho.

    References
    ----------
    Dahl (1968), "A solid friction model", The Aerospace Corporation TOR-0158(3107-18)-1; as
    "viscous + Dahl" for MR dampers in Ikhouane and Rodellar (2007), "Systems with Hysteresis".
    The forms are recalled.
    """

    name: ClassVar[str] = "dahl"
    title: ClassVar[str] = "viscous and Dahl"
    equation: ClassVar[str] = r"F = \kappa_x v + \kappa_w w + f_0,\quad \dot w = (v - |v|\,w)/x_y"
    source: ClassVar[str] = "Dahl 1968; Ikhouane and Rodellar 2007"
    state_column: ClassVar[str | None] = "kappa_w"

    kappa_x: float = param("N s/m", "post-yield viscous damping", bounds=(0, np.inf), linear=True)
    kappa_w: float = param("N", "yield force", bounds=(0, np.inf), linear=True)
    yield_displacement: float = param(
        "m", "displacement in which the friction builds up, 1/rho", bounds=(1e-12, 1e3), scale="log", symbol="x_y"
    )
    f0: float = param("N", "offset force", linear=True, default=0.0)

    @property
    def rho(self) -> float:
        """1/yield_displacement [1/m]."""
        return 1 / self.yield_displacement

    def state(self, motion: Excitation) -> Floats:
        """w, −1...1, along the motion, from w = 0."""
        return follow(Shape(self.rho, -1.0, 1.0), motion.path)

    def force(self, motion: Excitation, state: Floats) -> Floats:
        return self.kappa_x * motion.velocity + self.kappa_w * state + self.f0

    @classmethod
    def search_axes(cls, scale: Scale, free: Sequence[str]) -> tuple[SearchAxis, ...]:
        """Search the displacement over which the friction increases."""
        amplitude = scale.amplitude
        ladder = tuple((amplitude * YIELD_DISPLACEMENTS).tolist())
        return axes_of(free, SearchAxis("yield_displacement", amplitude * 1e-5, amplitude * 10, ladder, log=True))

    @classmethod
    def map_forms(cls) -> Mapping[str, tuple[str, ...]]:
        """Let the yield force saturate with the current, and the displacement decrease with it."""
        return {
            "kappa_x": GENERAL_FORMS,
            "kappa_w": (*GENERAL_FORMS, "saturating-current"),
            "yield_displacement": (*GENERAL_FORMS, "decaying-current", "current-decay-frequency"),
            "f0": GENERAL_FORMS,
        }
