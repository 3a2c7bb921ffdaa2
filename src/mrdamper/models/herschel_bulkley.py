"""Herschel–Bulkley flow through a slot: quasi-static, no hysteresis, for high shear rates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.errors import ParameterError, require_positive
from mrdamper.models.base import Model, Scale, SearchAxis, axes_of
from mrdamper.physics.motion import Excitation

_NEWTON = 5  # steps of Newton's method that invert the flow curve to rounding
_AT_REST = 1e-300  # smallest speed [v_c] in the logarithm


@dataclass(frozen=True)
class HerschelBulkley(Model):
    """F = f_y G(|v|/v_c; m) sgn v + c v + f0, G from the flow of a yield-stress fluid through a slot.

    The shear stress is tau_y + K (shear rate)^m. With T = tau_y over the shear stress at the
    wall, the flow through a slot of width w and height h is

    |v|/v_c = m/(2m + 1) T^(−1/m) (1 − T)^(1 + 1/m) (1 + T m/(m + 1)),  G = 1/T,

    f_y = 2 L A_p tau_y/h and v_c = w h²/(2 A_p) (tau_y/K)^(1/m), for a piston area A_p and a slot length L. A force
    record determines f_y, v_c and m, but not the geometry.

    References
    ----------
    Derived for this package from the plug flow of a Herschel–Bulkley fluid and checked against
    quadrature; m = 1 gives the cubic of Bingham slot flow.
    """

    name: ClassVar[str] = "herschel-bulkley"
    title: ClassVar[str] = "Herschel–Bulkley slot flow"
    equation: ClassVar[str] = (
        r"F = \frac{f_y}{T}\,\mathrm{sgn}\,v + c\,v + f_0,\quad \frac{|v|}{v_c} = \frac{m}{2m+1} T^{-1/m}"
        r" (1-T)^{1+1/m} \left(1 + \frac{m}{m+1} T\right)"
    )
    source: ClassVar[str] = "Herschel and Bulkley 1926, slot flow derived"
    state_column: ClassVar[str | None] = "fy"

    fy: float = param("N", "yield force", bounds=(0, np.inf), linear=True)
    vc: float = param("m/s", "velocity scale of the viscous stress", bounds=(1e-9, 1e6), scale="log")
    m: float = param("-", "flow index; below 1 the fluid thins with shear", bounds=(0.05, 2))
    f0: float = param("N", "offset force", linear=True, default=0.0)
    c: float = param(
        "N s/m", "viscous damping outside the slot", bounds=(0, np.inf), linear=True, preset=True, default=0.0
    )

    @classmethod
    def from_slot(
        cls, width: float, height: float, length: float, piston_area: float, yield_stress: float, K: float, m: float
    ) -> Self:
        """Make the model from a slot and a fluid.

        Parameters
        ----------
        width, height, length : float
            Of the slot [m].
        piston_area : float
            Area that displaces the fluid [m²].
        yield_stress : float
            [Pa]
        K : float
            Consistency [Pa s^m].
        m : float
            Flow index [-].

        Raises
        ------
        ParameterError
            If one is not positive.
        """
        given = {"width": width, "height": height, "length": length, "piston_area": piston_area}
        require_positive(ParameterError, cls.title, **given, yield_stress=yield_stress, K=K, m=m)
        force = 2 * length * piston_area * yield_stress / height
        return cls(fy=force, vc=width * height**2 / (2 * piston_area) * (yield_stress / K) ** (1 / m), m=m)

    def state(self, motion: Excitation) -> Floats:
        """G(|v|/v_c) sgn v (N,): the force of the slot over the yield force."""
        v = motion.velocity
        return np.sign(v) * flow_curve(np.abs(v) / self.vc, self.m)

    def force(self, motion: Excitation, state: Floats) -> Floats:
        return self.fy * state + self.c * motion.velocity + self.f0

    @classmethod
    def search_axes(cls, scale: Scale, free: Sequence[str]) -> tuple[SearchAxis, ...]:
        """v_c from a hundredth of the peak velocity (viscous) to a hundred times it (all yield)."""
        speed = scale.speed
        ladder = tuple(speed * np.geomspace(1e-2, 1e2, 6))
        return axes_of(
            free,
            SearchAxis("vc", 1e-4 * speed, 1e4 * speed, ladder, log=True),
            SearchAxis("m", 0.1, 2.0, (0.3, 0.6, 1.0)),
        )


def flow_curve(speed: Floats, m: float) -> Floats:
    """Force over yield force at a speed.

    `speed` (N,): |v|/v_c [-], not negative; `m`: flow index [-]. Returns (N,) array: G = 1/T, one at rest. The curve is
    convex over the logarithms, so Newton's method converges from below.
    """
    y = np.log(np.maximum(speed, _AT_REST))
    level = np.log(m / (2 * m + 1))
    u = np.minimum((y - level - np.log(1 + m / (m + 1))) / (1 + 1 / m), m * (y - level))
    for _ in range(_NEWTON):
        value, slope = _log_speed(u, m)
        u = u - (value - y) / slope
    return np.where(speed > 0, 1 + np.exp(u), 1.0)


def _log_speed(u: Floats, m: float) -> tuple[Floats, Floats]:
    """Logarithm of the speed at G = 1 + e^u, and its slope."""
    e = np.exp(u)
    G = 1 + e
    b = m / (m + 1)
    # T^(−1/m) (1 − T)^(1 + 1/m) (1 + b T) with T = 1/G and 1 − T = e/G
    value = np.log(m / (2 * m + 1)) + (1 + 1 / m) * u + np.log(G + b) - 2 * np.log(G)
    slope = (1 + 1 / m) + e / (G + b) - 2 * e / G
    return value, slope
