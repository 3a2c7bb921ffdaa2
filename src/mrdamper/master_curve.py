"""The one curve all Bouc–Wen loops are pieces of.

With ζ = z/z_max and φ growing by κ |dx| along the motion, dζ/dφ = 1 − ζ^n where ζ ≥ 0 and
1 − ρ |ζ|^n where ζ < 0. Every solution is a shift of the one through ζ(0) = 0:
ζ = G(φ0 + κ u), φ0 = G⁻¹(ζ0). For n = 1 and 2, G is elementary; for other n it is tabulated
once per (n, ρ) from Gauss–Legendre integrals of its inverse (derived).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_SPACING = 0.001  # of the tables in φ; cubics through values and exact slopes err by under 5e-9
_NODES = 1 / 256  # of the tables in ln(1 ± y)
_DEEPEST = 4.0  # largest |ρ|^(1/n) |ζ| on the side where the curve steepens
_TINY = 1e-8


def curve(phi: Floats, rho: Floats | float, n: float) -> Floats:
    """G(φ), elementwise; ρ broadcasts."""
    phi, rho = np.broadcast_arrays(np.asarray(phi, dtype=float), np.asarray(rho, dtype=float))
    if phi.ndim == 0:
        return curve(phi[None], rho[None], n)[0]
    if n == 1:
        result = -np.expm1(-np.maximum(phi, 0.0))
    elif n == 2:
        result = np.tanh(np.maximum(phi, 0.0))
    else:
        result = _table(n, 1).forward(np.maximum(phi, 0.0))
    below = phi < 0
    if below.any():
        result[below] = -_below(-phi[below], rho[below], n)
    return result


def inverse(zeta: Floats, rho: Floats | float, n: float) -> Floats:
    """G⁻¹(ζ), elementwise, for ζ ≤ 1; infinite at ζ = 1."""
    zeta, rho = np.broadcast_arrays(np.asarray(zeta, dtype=float), np.asarray(rho, dtype=float))
    if zeta.ndim == 0:
        return inverse(zeta[None], rho[None], n)[0]
    up = np.clip(zeta, 0.0, 1.0)
    with np.errstate(divide="ignore"):
        if n == 1:
            result = -np.log1p(-up)
        elif n == 2:
            result = np.arctanh(up)
        else:
            result = _table(n, 1).inverse(up)
    below = zeta < 0
    if below.any():
        result[below] = -_below_inverse(-zeta[below], rho[below], n)
    return result


def _below(distance: Floats, rho: Floats, n: float) -> Floats:
    """|ζ| at a distance before zero: the solution of dy/dφ = 1 − ρ yⁿ."""
    if n == 1:
        safe = np.where(np.abs(rho) < _TINY, 1.0, rho)
        return np.where(np.abs(rho) < _TINY, distance, -np.expm1(-safe * distance) / safe)
    root = np.abs(rho) ** (1 / n)
    safe = np.where(root < _TINY, 1.0, root)
    stretched = safe * distance
    if n == 2:
        bent = np.where(rho > 0, np.tanh(stretched), np.tan(np.minimum(stretched, 1.5707)))
    else:
        bent = np.where(rho > 0, _table(n, 1).forward(stretched), _table(n, -1).forward(stretched))
    return np.where(root < _TINY, distance, bent / safe)


def _below_inverse(depth: Floats, rho: Floats, n: float) -> Floats:
    with np.errstate(divide="ignore", invalid="ignore"):
        if n == 1:
            safe = np.where(np.abs(rho) < _TINY, 1.0, rho)
            return np.where(np.abs(rho) < _TINY, depth, -np.log1p(-safe * depth) / safe)
        root = np.abs(rho) ** (1 / n)
        safe = np.where(root < _TINY, 1.0, root)
        stretched = safe * depth
        if n == 2:
            bent = np.where(rho > 0, np.arctanh(np.minimum(stretched, 1.0)), np.arctan(stretched))
        else:
            bent = np.where(
                rho > 0, _table(n, 1).inverse(np.minimum(stretched, 1.0)), _table(n, -1).inverse(stretched)
            )
    return np.where(root < _TINY, depth, bent / safe)


@dataclass(frozen=True, eq=False)
class _Table:
    """y(φ) and φ(y) of dy/dφ = 1 − sign·yⁿ through the origin."""

    n: float
    sign: int
    log_step: float
    phi_at_log: Floats
    y_at_phi: Floats

    def forward(self, phi: Floats) -> Floats:
        u = np.minimum(phi / _SPACING, self.y_at_phi.size - 1.0)
        i = np.minimum(u.astype(np.intp), self.y_at_phi.size - 2)
        left, right = self.y_at_phi[i], self.y_at_phi[i + 1]
        return _hermite(u - i, left, right, _SPACING * self._slope(left), _SPACING * self._slope(right))

    def inverse(self, y: Floats) -> Floats:
        r = -np.log1p(-y) if self.sign > 0 else np.log1p(y)
        u = np.minimum(r / self.log_step, self.phi_at_log.size - 1.0)
        i = np.minimum(u.astype(np.intp), self.phi_at_log.size - 2)
        near = _hermite(u - i, self.phi_at_log[i], self.phi_at_log[i + 1], *(self.log_step * self._rate(i + k) for k in (0, 1)))
        return np.where(y >= 1, np.inf, near) if self.sign > 0 else near

    def _slope(self, y: Floats) -> Floats:
        return 1.0 - self.sign * y**self.n

    def _rate(self, index: NDArray[np.intp]) -> Floats:
        """dφ/dr at a node of the logarithmic ladder."""
        return _rate_of(self.log_step * index, self.n, self.sign)


def _rate_of(r: Floats, n: float, sign: int) -> Floats:
    if sign < 0:
        return np.exp(r) / (1.0 + np.expm1(r) ** n)
    # 1 − yⁿ with y = 1 − exp(−r) keeps its digits near y = 1 in this form.
    with np.errstate(divide="ignore"):
        return np.exp(-r) / -np.expm1(n * np.log1p(-np.exp(-r)))


@lru_cache(maxsize=32)
def _table(n: float, sign: int) -> _Table:
    if not n >= 1:
        raise ValueError(f"n = {n}: the exponent is 1 or more")
    last = 36.0 if sign > 0 else math.log1p(_DEEPEST)
    count = math.ceil(last / _NODES)
    nodes, weights = np.polynomial.legendre.leggauss(6)
    edges = np.arange(count) * _NODES
    r = edges[:, None] + _NODES * (nodes + 1) / 2
    phi = np.concatenate([[0.0], np.cumsum(_NODES / 2 * (_rate_of(r, n, sign) @ weights))])
    ladder = np.arange(count + 1) * _NODES
    y_ladder = -np.expm1(-ladder) if sign > 0 else np.expm1(ladder)
    grid = np.arange(int(phi[-1] / _SPACING) + 1) * _SPACING
    i = np.clip(np.searchsorted(phi, grid, side="right") - 1, 0, count - 1)
    width = phi[i + 1] - phi[i]
    slope = 1.0 - sign * y_ladder**n
    y = _hermite((grid - phi[i]) / width, y_ladder[i], y_ladder[i + 1], width * slope[i], width * slope[i + 1])
    return _Table(n, sign, _NODES, phi, y)


def _hermite(t: Floats, left: Floats, right: Floats, left_slope: Floats, right_slope: Floats) -> Floats:
    s = 1.0 - t
    return s * s * ((1 + 2 * t) * left + t * left_slope) + t * t * ((1 + 2 * s) * right - s * right_slope)
