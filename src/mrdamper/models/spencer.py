"""Spencer's modified Bouc–Wen: a damper in series with a Bouc–Wen element, parallel to a spring."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.errors import ParameterError, require_positive
from mrdamper.models.base import GENERAL_FORMS, Model, Scale, SearchAxis, axes_of
from mrdamper.physics.integrator import integrate
from mrdamper.physics.motion import Excitation


@dataclass(frozen=True)
class Spencer(Model):
    """F = c1 dy/dt + k1 x + f0, dy/dt = [alpha z + c0 v + k0 (x − y)]/(c0 + c1).

    z is a Bouc–Wen element driven by r = x − y. All forces over c1 are velocities, so that c1 scales the force
    linearly; the published parameters are properties, and `from_letters` accepts them. The publication's gamma
    multiplies |v| and its beta v, the reverse of the symbols used here for Bouc–Wen. A is 1, absorbed in the others; x0
    is part of the offset, f0 = −k1 x0. Integrated with error control.

    References
    ----------
    Spencer, Dyke, Sain and Carlson (1997), "Phenomenological model for magnetorheological
    dampers", J. Engineering Mechanics 123, 230–238. The equations agree in several public
    implementations.
    """

    name: ClassVar[str] = "spencer"
    title: ClassVar[str] = "Spencer's modified Bouc–Wen"
    equation: ClassVar[str] = (
        r"F = c_1 \dot y + k_1 x + f_0,\quad \dot y = \frac{v_z \zeta + \kappa_0 r + \nu_0 v}{1 + \nu_0},\quad "
        r"x_z \dot\zeta = \dot r - \frac{1 - \rho}{2} |\dot r| |\zeta|^{n-1} \zeta"
        r" - \frac{1 + \rho}{2} \dot r |\zeta|^n,\quad "
        r"r = x - y"
    )
    source: ClassVar[str] = "Spencer et al. 1997"
    coordinates: ClassVar[Mapping[str, tuple[str, str, str]]] = {
        "c0": ("c_0", r"\nu_0 = c_0/c_1", "N s/m"),
        "k0": ("k_0", r"\kappa_0 = k_0/c_1", "N/m"),
        "yield_force": ("F_z", "v_z = F_z/c_1", "N"),
    }
    integrated: ClassVar[bool] = True

    c1: float = param("N s/m", "viscous damping in series, seen at low velocity", bounds=(0, np.inf), linear=True)
    c0_ratio: float = param(
        "-", "c0/c1, viscous damping at high velocity", bounds=(1e-6, 1e3), scale="log", symbol=r"\nu_0"
    )
    k0_rate: float = param("1/s", "k0/c1, stiffness at high velocity", bounds=(0, 1e4), symbol=r"\kappa_0")
    creep: float = param(
        "m/s",
        "velocity of the series damper under the full hysteretic force",
        bounds=(1e-9, 1e2),
        scale="log",
        symbol="v_z",
    )
    yield_displacement: float = param(
        "m", "displacement in which the hysteretic force is spent", bounds=(1e-9, 1), scale="log", symbol="x_z"
    )
    k1: float = param("N/m", "stiffness of the accumulator", linear=True, default=0.0)
    f0: float = param("N", "offset force, −k1 x0", linear=True, default=0.0)
    asymmetry: float = param(
        "-", "(coefficient of v − of |v|)/(their sum)", bounds=(-1, 1), preset=True, default=0.0, symbol=r"\rho"
    )
    n: float = param("-", "sharpness of the yield", bounds=(1, 10), preset=True, default=2.0)

    @property
    def c0(self) -> float:
        """Viscous damping at high velocity [N s/m]."""
        return self.c0_ratio * self.c1

    @property
    def k0(self) -> float:
        """Stiffness at high velocity [N/m]."""
        return self.k0_rate * self.c1

    @property
    def yield_force(self) -> float:
        """Alpha z_max, the hysteretic force after yield [N]."""
        return self.creep * self.c1

    @classmethod
    def from_letters(
        cls,
        *,
        c0: float,
        c1: float,
        k0: float,
        k1: float,
        alpha: float,
        gamma: float,
        beta: float,
        A: float,
        n: float = 2.0,
        x0: float = 0.0,
    ) -> Self:
        """Make the model from the parameters of the publication.

        Parameters
        ----------
        c0, c1 : float
            [N s/m]
        k0, k1, alpha : float
            [N/m]
        gamma : float
            Coefficient of |v| [1/m^n], as the publication has it.
        beta : float
            Coefficient of v [1/m^n], as the publication has it.
        A, n : float
            [-]
        x0 : float
            Rest position of the accumulator [m].

        Raises
        ------
        ParameterError
            If the hysteresis is unbounded or c1 is not positive.
        """
        if not (c1 > 0 and A > 0 and gamma >= 0 and beta + gamma > 0):
            raise ParameterError(
                f"c1 = {c1:g}, A = {A:g}, gamma = {gamma:g}, beta = {beta:g}",
                where=cls.title,
                remedy="c1, A and beta + gamma are positive; gamma, the coefficient of |v|, is not negative",
            )
        require_positive(ParameterError, cls.title, n=n)
        z_max = (A / (beta + gamma)) ** (1 / n)
        return cls(
            c1=c1,
            c0_ratio=c0 / c1,
            k0_rate=k0 / c1,
            creep=alpha * z_max / c1,
            yield_displacement=z_max / A,
            k1=k1,
            f0=-k1 * x0,
            asymmetry=(beta - gamma) / (beta + gamma),
            n=n,
        )

    def to_letters(self, A: float = 1.0) -> dict[str, float]:
        """Return the parameters of the publication for a given A [-]: gamma with |v|, beta with v, SI units.

        x0 is 0 if k1 is zero.
        """
        require_positive(ParameterError, self.title, A=A)
        z_max = A * self.yield_displacement
        total = A / z_max**self.n
        return {
            "c0": self.c0,
            "c1": self.c1,
            "k0": self.k0,
            "k1": self.k1,
            "alpha": self.yield_force / z_max,
            "gamma": total * (1 - self.asymmetry) / 2,
            "beta": total * (1 + self.asymmetry) / 2,
            "A": A,
            "n": self.n,
            "x0": -self.f0 / self.k1 if self.k1 else 0.0,
        }

    def state(self, motion: Excitation) -> Floats:
        """(N, 2): r = x − y [m] and z/z_max, from 0."""
        channels = (motion.time, motion.displacement, motion.velocity, motion.current)
        share = 1 / (1 + self.c0_ratio)
        shape = (share, self.k0_rate, self.creep, 1 / self.yield_displacement, self.asymmetry, self.n)
        return integrate(series_rate, shape, channels, (0.0, 0.0), (self.yield_displacement, 1.0))

    def force(self, motion: Excitation, state: Floats) -> Floats:
        v = motion.velocity
        r, zeta = state[:, 0], state[:, 1]
        slip = (v - self.creep * zeta - self.k0_rate * r) / (1 + self.c0_ratio)
        return self.c1 * (v - slip) + self.k1 * motion.displacement + self.f0

    @classmethod
    def search_axes(cls, scale: Scale, free: Sequence[str]) -> tuple[SearchAxis, ...]:
        """Search the creep of the series damper between a hundredth and all of the peak velocity."""
        amplitude, speed = scale.amplitude, scale.speed
        return axes_of(
            free,
            SearchAxis("c0_ratio", 1e-3, 10.0, (0.05,), log=True),
            SearchAxis("k0_rate", 0.0, 20 * speed / amplitude, (0.1,)),
            SearchAxis("creep", 1e-4 * speed, 10 * speed, (0.03 * speed, 0.3 * speed), log=True),
            SearchAxis(
                "yield_displacement", 1e-5 * amplitude, amplitude, (3e-3 * amplitude, 5e-2 * amplitude), log=True
            ),
            SearchAxis("asymmetry", -0.98, 0.98, (0.0,)),
            SearchAxis("n", 1.0, 10.0, (2.0,)),
        )

    @classmethod
    def map_forms(cls) -> Mapping[str, tuple[str, ...]]:
        """Map the published parameters, because ratios mix quantities that depend on the current with others."""
        return {
            "c1": GENERAL_FORMS,
            "c0": GENERAL_FORMS,
            "yield_force": (*GENERAL_FORMS, "saturating-current"),
            "yield_displacement": GENERAL_FORMS,
            "k0": ("constant",),
            "k1": GENERAL_FORMS,
            "f0": GENERAL_FORMS,
        }

    @classmethod
    def log_coordinates(cls) -> frozenset[str]:
        return frozenset({"c1", "c0", "yield_force", "yield_displacement"})

    @classmethod
    def resolved(cls, values: Mapping[str, float]) -> dict[str, float]:
        """Parameters, from themselves or from `c0` [N s/m], `k0` [N/m], `yield_force` [N] in their place."""
        given = dict(values)
        if given.keys() & {"c0", "k0", "yield_force"}:
            require_positive(ParameterError, cls.title, c1=given["c1"])
        for letter, ratio in (("c0", "c0_ratio"), ("k0", "k0_rate"), ("yield_force", "creep")):
            if letter in given:
                given[ratio] = given.pop(letter) / given["c1"]
        return given


def series_rate(x: float, v: float, current: float, state: Floats, p: Floats, out: Floats) -> None:
    """d(r, zeta)/dt for p = (c1/(c0 + c1), k0/c1, creep, 1/yield displacement, asymmetry, n)."""
    zeta = state[1]
    slip = (v - p[2] * zeta - p[1] * state[0]) * p[0]
    grip = zeta * zeta if p[5] == 2 else abs(zeta) ** p[5]
    out[0] = slip
    out[1] = p[3] * (slip - grip * (0.5 * (1 + p[4]) * slip + 0.5 * (1 - p[4]) * abs(slip) * np.sign(zeta)))
