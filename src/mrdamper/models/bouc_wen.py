"""Bouc–Wen with viscosity, gas spring, inertia and offset: the model of the method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.errors import IdentificationError, ParameterError, require_positive
from mrdamper.models.base import GENERAL_FORMS, YIELD_DISPLACEMENTS, Model, Scale, SearchAxis
from mrdamper.models.recorded import recorded
from mrdamper.physics.hysteresis import Shape, follow
from mrdamper.physics.motion import Excitation
from mrdamper.tracing import plain


@dataclass(frozen=True)
class BoucWen(Model):
    """F = k1 x + k2 x² + k3 x³ + c v + m a + alpha z + f0, dz/dt = v − beta |v| |z|^(n−1) z − gamma v |z|^n.

    The factor A of the general form is 1: it can be absorbed in alpha, beta and gamma without changing any force.
    `beta` multiplies |v| and `gamma` multiplies v; Spencer and co-workers exchange the two symbols. At one frequency m
    and k1 cannot be separated (a = −ω² x), so m is preset to zero unless the gas spring is known.

    References
    ----------
    Wen (1976), "Method for random vibration of hysteretic systems"; Qian et al. (2024),
    Actuators 13, 297, Eq. 2 and 8, for the gas spring and the inertia.
    """

    name: ClassVar[str] = "bouc-wen"
    title: ClassVar[str] = "Bouc–Wen"
    equation: ClassVar[str] = (
        r"F = k_1 x + k_2 x^2 + k_3 x^3 + c\,v + m\,a + \alpha z + f_0,\quad"
        r"\dot z = v - \beta |v| |z|^{n-1} z - \gamma v |z|^n"
    )
    source: ClassVar[str] = "Wen 1976; Qian et al. 2024, Eq. 8"
    state_column: ClassVar[str | None] = "alpha"
    coordinates: ClassVar[Mapping[str, tuple[str, str, str]]] = {
        "yield_force": ("F_z", r"\alpha = F_z (\beta + \gamma)^{1/n}", "N"),
        "yield_displacement": ("x_z", r"\beta + \gamma = x_z^{-n}", "m"),
        "asymmetry": (r"\rho", r"\gamma - \beta = \rho (\beta + \gamma)", "-"),
    }

    c: float = param("N s/m", "post-yield viscous damping", bounds=(0, np.inf), linear=True)
    alpha: float = param("N/m", "hysteretic stiffness", bounds=(0, np.inf), linear=True)
    beta: float = param("m^-n", "Bouc–Wen coefficient of |v|", bounds=(0, np.inf), scale="log")
    gamma: float = param("m^-n", "Bouc–Wen coefficient of v", preset=True)
    n: float = param("-", "sharpness of the yield", bounds=(1, 10), preset=True, default=2.0)
    f0: float = param("N", "offset force", linear=True, default=0.0)
    k1: float = param("N/m", "stiffness", linear=True, default=0.0)
    k2: float = param("N/m^2", "quadratic stiffness", linear=True, preset=True, default=0.0)
    k3: float = param("N/m^3", "cubic stiffness", linear=True, default=0.0)
    m: float = param("kg", "equivalent mass", linear=True, preset=True, default=0.0)

    @cached_property
    def shape(self) -> Shape:  # type: ignore[override]  # a model is frozen: computed once
        """Shape of the hysteresis without its force scale."""
        return Shape.from_bouc_wen(self.beta, self.gamma, self.n)

    @property
    def yield_displacement(self) -> float:
        """z_max: the displacement at which the hysteretic element yields [m]."""
        return self.shape.yield_displacement  # type: ignore[return-value]

    @property
    def asymmetry(self) -> float:
        """(gamma − beta)/(gamma + beta)."""
        return (self.gamma - self.beta) / (self.gamma + self.beta)

    @property
    def yield_force(self) -> float:
        """Alpha · z_max, the hysteretic force after yield [N]."""
        return self.alpha * self.yield_displacement

    @recorded
    def state(self, motion: Excitation) -> Floats:
        """Z [m] along the motion, from z = 0."""
        return self.yield_displacement * follow(self.shape, motion.path)

    def force(self, motion: Excitation, state: Floats) -> Floats:
        x, v, a = motion.displacement, motion.velocity, motion.acceleration
        spring = x * (self.k1 + x * (self.k2 + x * self.k3))
        return spring + self.c * v + self.m * a + self.alpha * state + self.f0

    @classmethod
    def search_axes(cls, scale: Scale, free: Sequence[str]) -> tuple[SearchAxis, ...]:
        """Yield displacement (log), asymmetry (gamma − beta)/(gamma + beta) and n: nearly orthogonal."""
        amplitude = scale.amplitude
        ladder = tuple((amplitude * YIELD_DISPLACEMENTS).tolist())
        axes: list[SearchAxis] = []
        if "beta" in free or "gamma" in free:
            axes.append(SearchAxis("yield_displacement", amplitude * 1e-5, amplitude * 10, ladder, log=True))
        if "beta" in free and "gamma" in free:
            axes.append(SearchAxis("asymmetry", -0.98, 0.98, (-0.8, 0.0, 0.8)))
        if "n" in free:
            axes.append(SearchAxis("n", 1.0, 10.0, (1.0, 2.0, 4.0)))
        return tuple(axes)

    @classmethod
    def within(cls, axes: tuple[SearchAxis, ...], fixed: Mapping[str, float]) -> tuple[SearchAxis, ...]:
        """Bound the yield displacement: a fixed gamma allows beta >= 0 below gamma^(−1/n)."""
        gamma = fixed.get("gamma", 0.0)
        if gamma <= 0 or "beta" in fixed:
            return axes
        if "n" not in fixed:
            raise IdentificationError(
                "gamma is held while n is free, and its unit m^-n changes with n",
                where=cls.title,
                remedy="hold n as well, or free gamma",
            )
        limit = (1 - 1e-12) * gamma ** (-1 / fixed["n"])  # rounding must not make beta negative
        return tuple(axis.below(limit) if axis.name == "yield_displacement" else axis for axis in axes)

    @classmethod
    def map_forms(cls) -> Mapping[str, tuple[str, ...]]:
        """Yield force and yield displacement are mapped, because alpha and beta are strongly correlated."""
        yielding = ("decaying-current", "current-decay-frequency")
        return {
            "c": GENERAL_FORMS,
            "yield_force": (*GENERAL_FORMS, "saturating-current"),
            "yield_displacement": (*GENERAL_FORMS, *yielding),
            "k1": GENERAL_FORMS,
            "k3": ("constant",),
            "f0": GENERAL_FORMS,
        }

    @classmethod
    def log_coordinates(cls) -> frozenset[str]:
        return frozenset({"beta", "yield_displacement"})

    @classmethod
    def resolved(cls, values: Mapping[str, float]) -> dict[str, float]:
        """Parameters, from themselves or from physical coordinates.

        `yield_displacement` [m] with `asymmetry` (default 0: gamma = beta), or with one of beta and gamma, replaces
        both; `yield_force` [N] replaces alpha.
        """
        given = dict(values)
        n = given.get("n", 2.0)
        if (length := given.pop("yield_displacement", None)) is not None:
            require_positive(ParameterError, cls.title, yield_displacement=length, n=n)
            if "gamma" in given:
                given["beta"] = length**-n - given["gamma"]
            elif "beta" in given:
                given["gamma"] = length**-n - given["beta"]
            else:
                shape = Shape(1 / length, given.pop("asymmetry", 0.0), n)
                beta, gamma = shape.to_bouc_wen()
                given["beta"], given["gamma"] = plain(beta), plain(gamma)
        elif "gamma" not in given:
            given["gamma"] = given["beta"]
        if (force := given.pop("yield_force", None)) is not None:
            require_positive(ParameterError, cls.title, n=n)
            given["alpha"] = plain(force * (given["beta"] + given["gamma"]) ** (1 / n))
        return given
