"""Hyperbolic tangent over velocity and displacement, with one set of parameters for every current."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.models.base import Model, Scale, SearchAxis, axes_of
from mrdamper.physics.motion import Excitation


@dataclass(frozen=True)
class Tanh(Model):
    """F = f0 + (k0 + k1 I) x + (c0 + c1 I) v |v|^p + cq |v| + fy(I) (S + q |S|) + m a, S a sigmoid.

    S = (1 - w) tanh u + w (2/pi) arctan(pi u/2), u = (v + lambda x)/vy, fy(I) = fy0 + fy1 I/(1 + si I).

    The model has no memory and no jumps: the displacement from mid-stroke shifts the yield to the branches of the loop,
    in any motion. The viscous damping is c0 + c1 I at 1 m/s; p is negative for a fluid that thins with shear, 1 for
    quadratic damping. Of the parameters that are preset to zero, only those that reduce the cross-validated error are
    determined. I is the magnitude of the current.

    References
    ----------
    Common in work on control; the sum of velocity and displacement in one argument is recalled
    from Guo, Yang and Pan (2006), whose function is an arctangent.
    """

    name: ClassVar[str] = "tanh"
    title: ClassVar[str] = "shifted hyperbolic tangent"
    equation: ClassVar[str] = (
        r"F = f_0 + (k_0 + k_1 I) x + (c_0 + c_1 I) v |v|^p + c_q |v| + f_y (S + q |S|) + m a,\quad "
        r"S = (1 - w) \tanh u + w \frac{2}{\pi} \arctan\frac{\pi u}{2},\quad u = \frac{v + \lambda x}{v_y},\quad "
        r"f_y = f_{y0} + \frac{f_{y1} I}{1 + s_i I}"
    )
    source: ClassVar[str] = "common practice in control"
    current_levels: ClassVar[Mapping[str, int]] = {"k1": 2, "c1": 2, "fy1": 2, "si": 3}

    f0: float = param("N", "offset force", linear=True)
    k0: float = param("N/m", "stiffness without current", linear=True)
    c0: float = param("N s/m", "post-yield viscous damping without current", bounds=(0, np.inf), linear=True)
    c1: float = param("N s/m/A", "rise of the viscous damping with current", bounds=(0, np.inf), linear=True)
    fy0: float = param("N", "yield force without current", bounds=(0, np.inf), linear=True)
    fy1: float = param("N/A", "rise of the yield force with current", bounds=(0, np.inf), linear=True)
    vy: float = param("m/s", "velocity in which the yield force builds up", bounds=(1e-7, 1e3), scale="log")
    shift: float = param("1/s", "velocity of the zero crossing per displacement", bounds=(-1e3, 1e3), symbol=r"\lambda")
    k1: float = param("N/m/A", "rise of the stiffness with current", linear=True, preset=True, default=0.0)
    si: float = param(
        "1/A", "saturation of the yield force with current", bounds=(0, 1e3), preset=True, default=0.0, symbol="s_i"
    )
    p: float = param(
        "-",
        "excess over one of the exponent of the velocity [m/s] in the viscous force",
        bounds=(-0.9, 2),
        preset=True,
        default=0.0,
    )
    tail: float = param(
        "-", "share of the arctangent, which saturates slowly", bounds=(0, 1), preset=True, default=0.0, symbol="w"
    )
    asymmetry: float = param(
        "-",
        "surplus of the yield force in extension over the mean",
        bounds=(-0.9, 0.9),
        preset=True,
        default=0.0,
        symbol="q",
    )
    cq: float = param("N s/m", "surplus of the viscous damping in extension", linear=True, preset=True, default=0.0)
    m: float = param("kg", "inertia", bounds=(0, np.inf), linear=True, preset=True, default=0.0)

    def state(self, motion: Excitation) -> Floats:
        """Share of the yield force, −1...1, at the samples."""
        u = (motion.velocity + self.shift * motion.displacement) / self.vy
        return (1 - self.tail) * np.tanh(u) + self.tail * 2 / np.pi * np.arctan(np.pi / 2 * u)

    def force(self, motion: Excitation, state: Floats) -> Floats:
        x, v, a, current = motion.displacement, motion.velocity, motion.acceleration, np.abs(motion.current)
        yield_force = self.fy0 + self.fy1 * current / (1 + self.si * current)
        viscous = (self.c0 + self.c1 * current) * np.sign(v) * np.abs(v) ** (1 + self.p) + self.cq * np.abs(v)
        yielded = yield_force * (state + self.asymmetry * np.abs(state))
        return self.f0 + (self.k0 + self.k1 * current) * x + viscous + yielded + self.m * a

    @classmethod
    def search_axes(cls, scale: Scale, free: Sequence[str]) -> tuple[SearchAxis, ...]:
        """Search the yield velocity about the peak velocity, the shift about the angular frequency of the motion."""
        speed, frequency, current = scale.speed, scale.speed / scale.amplitude, scale.current or 1.0
        return axes_of(
            free,
            SearchAxis("vy", 1e-3 * speed, 30 * speed, (0.03 * speed, 0.2 * speed, speed), log=True),
            SearchAxis("shift", -frequency, 30 * frequency, (0.05 * frequency, 0.5 * frequency)),
            SearchAxis("si", 0.0, 10 / current, (0.1 / current,)),
            SearchAxis("p", -0.7, 1.0, (0.0,)),
            SearchAxis("tail", 0.0, 1.0, (0.1,)),
            SearchAxis("asymmetry", -0.9, 0.9, (0.0,)),
        )
