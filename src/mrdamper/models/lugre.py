"""LuGre: elastic bristles that slide, with a Stribeck curve, parallel to a viscous damper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.errors import ParameterError, require_positive
from mrdamper.models.base import Model, Scale, SearchAxis, axes_of
from mrdamper.physics.integrator import integrate
from mrdamper.physics.motion import Excitation


@dataclass(frozen=True)
class LuGre(Model):
    """F = F_c u + sigma1 dz/dt + sigma2 v + f0 with z = z_c u the deflection of the bristles.

    dz/dt = v − |v| u/g, g = 1 + (s − 1) exp(−(v/v_s)²). In the published symbols z_c = F_c/sigma0 and s = F_s/F_c; with
    z_c the force is linear in F_c, sigma1 and sigma2. The rate of z depends on the velocity, so it is integrated with
    error control.

    References
    ----------
    Canudas de Wit, Olsson, Åström and Lischinsky (1995), "A new model for control of systems
    with friction", IEEE Trans. Automatic Control 40, 419–425. Recalled. For
    MR dampers Jiménez and Álvarez-Icaza (2005) use a variant without the Stribeck curve, which
    is s = 1.
    """

    name: ClassVar[str] = "lugre"
    title: ClassVar[str] = "LuGre"
    equation: ClassVar[str] = (
        r"F = F_c u + \sigma_1 \dot z + \sigma_2 v + f_0,\quad \dot z = v - |v| u / g,\quad z = z_c u,\quad "
        r"g = 1 + (s - 1) e^{-(v/v_s)^2}"
    )
    source: ClassVar[str] = "Canudas de Wit et al. 1995"
    integrated: ClassVar[bool] = True

    fc: float = param("N", "yield force while sliding", bounds=(0, np.inf), linear=True, symbol="F_c")
    presliding: float = param(
        "m", "deflection of the bristles while sliding, F_c/sigma0", bounds=(1e-9, 1), scale="log", symbol="z_c"
    )
    stribeck: float = param(
        "-", "force at the onset of sliding over the sliding force", bounds=(0.2, 10), scale="log", symbol="s"
    )
    vs: float = param("m/s", "velocity in which the onset force fades", bounds=(1e-6, 10), scale="log")
    sigma1: float = param("N s/m", "damping of the bristles", bounds=(0, np.inf), linear=True)
    sigma2: float = param("N s/m", "post-yield viscous damping", bounds=(0, np.inf), linear=True)
    f0: float = param("N", "offset force", linear=True, default=0.0)

    @property
    def sigma0(self) -> float:
        """Stiffness of the bristles [N/m]."""
        return self.fc / self.presliding

    @classmethod
    def from_bristles(cls, sigma0: float, sigma1: float, sigma2: float, fc: float, fs: float, vs: float) -> Self:
        """Make the model from the published parameters.

        Parameters
        ----------
        sigma0 : float
            Stiffness of the bristles [N/m].
        sigma1, sigma2 : float
            Damping of the bristles and of the fluid [N s/m].
        fc, fs : float
            Sliding and onset force [N].
        vs : float
            Stribeck velocity [m/s].

        Raises
        ------
        ParameterError
            Unless sigma0, fc and vs are positive.
        """
        require_positive(ParameterError, cls.title, sigma0=sigma0, fc=fc, vs=vs)
        return cls(fc=fc, presliding=fc / sigma0, stribeck=fs / fc, vs=vs, sigma1=sigma1, sigma2=sigma2)

    def state(self, motion: Excitation) -> Floats:
        """(N,) u, the deflection of the bristles over that while sliding, from 0."""
        channels = (motion.time, motion.displacement, motion.velocity, motion.current)
        shape = (1 / self.presliding, self.stribeck, 1 / self.vs)
        return integrate(bristle_rate, shape, channels, (0.0,), (1.0,))[:, 0]

    def force(self, motion: Excitation, state: Floats) -> Floats:
        v = motion.velocity
        onset = 1 + (self.stribeck - 1) * np.exp(-((v / self.vs) ** 2))
        bristles = v - np.abs(v) * state / onset
        return self.fc * state + self.sigma1 * bristles + self.sigma2 * v + self.f0

    @classmethod
    def search_axes(cls, scale: Scale, free: Sequence[str]) -> tuple[SearchAxis, ...]:
        """Search the Stribeck velocity, well below the peak velocity."""
        amplitude, speed = scale.amplitude, scale.speed
        lengths = tuple(amplitude * np.geomspace(1e-3, 0.3, 5))
        return axes_of(
            free,
            SearchAxis("presliding", 1e-4 * amplitude, amplitude, lengths, log=True),
            SearchAxis("stribeck", 0.3, 5.0, (1.0,), log=True),
            SearchAxis("vs", 1e-3 * speed, speed, (0.02 * speed, 0.2 * speed), log=True),
        )


def bristle_rate(x: float, v: float, current: float, state: Floats, p: Floats, out: Floats) -> None:
    """du/dt for p = (1/z_c, s, 1/v_s)."""
    onset = 1 + (p[1] - 1) * np.exp(-((v * p[2]) ** 2))
    out[0] = (v - abs(v) * state[0] / onset) * p[0]
