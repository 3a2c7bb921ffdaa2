"""Shape of the hysteresis: three parameters, their conversion from Bouc–Wen parameters, and their bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from mrdamper.data.arrays import Floats
from mrdamper.errors import ParameterError
from mrdamper.physics.hysteresis.master_curve import STEEPEST

HIGHEST_N = 20.0  # the tabulated curves hold 1e-8 up to here (for rho >= −30)


@dataclass(frozen=True, eq=False)
class Shape:
    """Shape of the hysteresis, without its force scale. One, or P of them with a common n.

    Raises `ParameterError` if a value lies outside these ranges.
    """

    kappa: float | Floats  # (P,) initial slope dzeta/dx = A/z_max [1/m]
    # (P,) (gamma − beta)/(gamma + beta) [-], at most 1. 0: beta = gamma; −1: gamma = 0; 1: beta = 0, an elastic spring,
    # whose state is lost once zeta rounds to 1. Above 0, gamma > beta: still dissipating, but bounded only for
    # states that start within rho^(−1/n).
    rho: float | Floats
    n: float = 2.0  # sharpness of the yield [-], from 1 to 20

    def __post_init__(self) -> None:
        least, most = _ends(self.kappa)
        if not (least > 0 and most < np.inf):
            raise ParameterError(f"kappa is {self.kappa}", remedy="A/z_max must be positive and finite")
        least, most = _ends(self.rho)
        if not (least >= -STEEPEST and most <= 1):
            raise ParameterError(
                f"(gamma − beta)/(gamma + beta) is {self.rho}", remedy=f"it lies between {-STEEPEST:g} and 1"
            )
        if not 1 <= self.n <= HIGHEST_N:
            raise ParameterError(f"n is {self.n}", remedy=f"n lies between 1 and {HIGHEST_N:g}")

    @classmethod
    def from_bouc_wen(cls, beta: float | Floats, gamma: float | Floats, n: float = 2.0, A: float = 1.0) -> Self:
        """Shape of dz/dt = A v − beta |v| |z|^(n−1) z − gamma v |z|^n, beta and gamma (P,) in m^−n for z in m.

        Raises `ParameterError` if energy would be created (beta < 0) or z has no bound (beta + gamma <= 0 or A <= 0).
        """
        if not (np.all(dissipates(beta, gamma)) and A > 0):
            raise ParameterError(
                f"A = {A}, beta = {beta}, gamma = {gamma} is no damper",
                remedy="A > 0, beta >= 0 and beta + gamma > 0 are needed (beta belongs to |v|)",
            )
        return cls(A / z_max(beta, gamma, n, A), (gamma - beta) / (gamma + beta), n)

    @classmethod
    def from_ikhouane_rodellar(cls, rho: float | Floats, sigma: float | Floats, n: float = 2.0) -> Self:
        """Shape from the normalised form dw/dt = rho (v − sigma |v| |w|^(n−1) w + (sigma − 1) v |w|^n).

        Their rho [1/m] is kappa here; sigma = beta/(beta + gamma) [-].
        """
        return cls(rho, 1 - 2 * sigma, n)

    def to_bouc_wen(self, A: float = 1.0) -> tuple[float | Floats, float | Floats]:
        """(beta, gamma) [m^−n] that give this shape for an A."""
        total = A * (self.kappa / A) ** self.n
        return self.sigma * total, (1 - self.sigma) * total

    @property
    def sigma(self) -> float | Floats:
        """beta/(beta + gamma) [-], the sigma of Ikhouane and Rodellar."""
        return (1 - self.rho) / 2

    @property
    def yield_displacement(self) -> float | Floats:
        """1/kappa = z_max/A: distance at which the initial slope reaches z_max [m]."""
        return 1 / self.kappa

    @property
    def is_many(self) -> bool:
        """True if this holds P shapes rather than one."""
        return np.ndim(self.kappa) > 0 or np.ndim(self.rho) > 0


def _ends(value: Any) -> tuple[Any, Any]:
    """Smallest and largest of some numbers, NaN if one of them is; of one number or symbol, itself."""
    return (value.min(), value.max()) if isinstance(value, np.ndarray) else (value, value)


def z_max(beta: float | Floats, gamma: float | Floats, n: float = 2.0, A: float = 1.0) -> float | Floats:
    """Ultimate hysteretic displacement (A/(beta + gamma))^(1/n) [m if A has no unit]."""
    return (A / (beta + gamma)) ** (1 / n)


def dissipates(beta: float | Floats, gamma: float | Floats) -> np.bool | np.ndarray:
    """Tell if every motion dissipates energy, for A > 0: beta >= 0 and beta + gamma > 0.

    The condition usually quoted, beta >= |gamma|, is sufficient only. Derived, with the storage
    ∫ y/(A − gamma y^n) dy. With gamma > beta the
    state is bounded only from |z| <= (A/(gamma − beta))^(1/n) [Ikhouane and Rodellar 2007, recalled].
    """
    return np.logical_and(np.greater_equal(beta, 0), np.greater(np.add(beta, gamma), 0))
