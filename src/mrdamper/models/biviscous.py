"""Hysteretic biviscous: steep before the yield, flat after it, shifted to either side of the loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.errors import ParameterError
from mrdamper.models.base import Model, Scale, SearchAxis, axes_of
from mrdamper.physics.motion import Excitation


@dataclass(frozen=True)
class Biviscous(Model):
    """F = c_po v + f_y clip((v − v_h sgn a)/v_y, −1, 1) + f0.

    The six published branches in one equation: c_pr (v ∓ v0) before the yield, c_po v ± f_y after it, with c_pr = c_po
    + f_y/v_y and v0 = v_h f_y/(v_y c_pr). In this form the force is linear in c_po and f_y. Memoryless: the branch
    follows the sign of the acceleration.

    References
    ----------
    Wereley, Pang and Kamath (1998), "Idealized hysteresis modeling of electrorheological and
    magnetorheological dampers", J. Intelligent Material Systems and Structures 9, 642–649. The form is recalled;
    its continuity was checked.
    """

    name: ClassVar[str] = "biviscous"
    title: ClassVar[str] = "hysteretic biviscous"
    equation: ClassVar[str] = (
        r"F = c_{po} v + f_y\,\mathrm{clip}\!\left(\frac{v - v_h\,\mathrm{sgn}\,a}{v_y}, -1, 1\right) + f_0"
    )
    source: ClassVar[str] = "Wereley, Pang and Kamath 1998"
    state_column: ClassVar[str | None] = "fy"

    cpo: float = param("N s/m", "post-yield viscous damping", bounds=(0, np.inf), linear=True)
    fy: float = param("N", "yield force", bounds=(0, np.inf), linear=True)
    vy: float = param("m/s", "half the width of the pre-yield slope in velocity", bounds=(1e-7, 10), scale="log")
    vh: float = param("m/s", "half the width of the loop in velocity, before post-yield damping", bounds=(0, 10))
    f0: float = param("N", "offset force", linear=True, default=0.0)

    @property
    def cpr(self) -> float:
        """Pre-yield damping c_pr [N s/m]."""
        return self.cpo + self.fy / self.vy

    @property
    def v0(self) -> float:
        """Velocity at which the force crosses zero [m/s]."""
        return self.vh * self.fy / (self.vy * self.cpr) if self.cpr > 0 else 0.0

    @classmethod
    def from_wereley(cls, cpo: float, cpr: float, fy: float, v0: float, f0: float = 0.0) -> Self:
        """Make the model from the published four parameters.

        Parameters
        ----------
        cpo, cpr : float
            Post- and pre-yield damping [N s/m].
        fy : float
            Yield force [N].
        v0 : float
            Velocity at which the force crosses zero [m/s].
        f0 : float
            Offset force [N].

        Raises
        ------
        ParameterError
            Unless cpr > cpo and fy > cpr v0.
        """
        if not (cpr > cpo and fy > cpr * v0):
            raise ParameterError(
                f"cpo = {cpo:g}, cpr = {cpr:g} N s/m, fy = {fy:g} N, v0 = {v0:g} m/s",
                where=cls.title,
                remedy="the branches meet only if cpr > cpo and fy > cpr v0",
            )
        return cls(cpo=cpo, fy=fy, vy=fy / (cpr - cpo), vh=cpr * v0 / (cpr - cpo), f0=f0)

    def state(self, motion: Excitation) -> Floats:
        """Share of the yield force, −1...1, at the samples."""
        return np.clip((motion.velocity - self.vh * np.sign(motion.acceleration)) / self.vy, -1.0, 1.0)

    def force(self, motion: Excitation, state: Floats) -> Floats:
        return self.cpo * motion.velocity + self.fy * state + self.f0

    @classmethod
    def search_axes(cls, scale: Scale, free: Sequence[str]) -> tuple[SearchAxis, ...]:
        """Both widths lie below the peak velocity."""
        speed = scale.speed
        return axes_of(
            free,
            SearchAxis("vy", 1e-4 * speed, 2 * speed, tuple(speed * np.geomspace(3e-3, 0.6, 7)), log=True),
            SearchAxis("vh", 0.0, speed, (0.003 * speed, 0.03 * speed, 0.2 * speed)),
        )
