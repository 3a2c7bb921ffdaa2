"""The closed Bouc–Wen loop under x = X sin θ: peak, shape, harmonics, dissipated energy.

All follow from the condition that a full stroke 2X leads from −Z to Z. [derived]
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.data import Floats
from mrdamper.errors import ParameterError
from mrdamper.hysteresis import Shape
from mrdamper.master_curve import curve, inverse

_GAUSS = np.polynomial.legendre.leggauss(24)


def steady_peak(shape: Shape, amplitude: float) -> float:
    """Z = ζ at x = ±X on the closed loop.

    Solved in r = −ln(1 − Z), which keeps its digits when the loop saturates.
    """
    return float(-np.expm1(-_log_gap(shape, amplitude)))


def steady_loop(shape: Shape, amplitude: float, theta: ArrayLike) -> Floats:
    """ζ at phases θ [rad] of x = X sin θ on the closed loop."""
    theta = np.asarray(theta, dtype=float)
    rising = np.cos(theta) >= 0
    q = np.where(rising, 1.0, -1.0)
    start = _start(shape, amplitude)
    way = amplitude * (1.0 + q * np.sin(theta))
    return q * curve(start + shape.kappa * way, shape.rho, shape.n)


def loop_harmonics(shape: Shape, amplitude: float, orders: Sequence[int]) -> tuple[Floats, Floats]:
    """Harmonics of the closed loop, ζ = Σ sine_k sin kθ + cosine_k cos kθ, for odd k.

    Gauss–Legendre over pieces of the rising half-cycle that shrink towards the reversal and
    end where ζ crosses zero, so it converges however sharp the knee. Even orders are zero.

    Returns
    -------
    sine, cosine : (K,) arrays
    """
    theta, weight = _rising_nodes(shape, amplitude)
    zeta = steady_loop(shape, amplitude, theta)
    k = np.asarray(orders)[:, None]
    odd = np.asarray(orders) % 2
    sine = 2 / np.pi * (np.sin(k * theta) * zeta) @ weight * odd
    cosine = 2 / np.pi * (np.cos(k * theta) * zeta) @ weight * odd
    return sine, cosine


def loop_area(shape: Shape, amplitude: float) -> float:
    """∮ζ dx of the closed loop [m]: dissipated energy per unit yield force.

    The integrand is written as a sum of positive terms, so that loops far below yield, where
    the area is a small remainder, keep their digits.
    """
    rho, n = float(shape.rho), shape.n
    gap = _log_gap(shape, amplitude)
    # ∮ζ dφ = 2 ∫_0^Z y^(1+n) (1 − ρ) / ((1 − yⁿ)(1 − ρ yⁿ)) dy, in r = −ln(1 − y)
    edges = np.unique(np.concatenate([[0.0], np.minimum(np.geomspace(1e-8, 60.0, 200), gap), [min(gap, 60.0)]]))
    left, right = edges[:-1, None], edges[1:, None]
    r = left + (right - left) * (_GAUSS[0] + 1) / 2
    y = -np.expm1(-r)
    power = y**n
    one_minus = -np.expm1(n * np.log1p(-np.exp(-r)))
    integrand = y * power * (1 - rho) * np.exp(-r) / (one_minus * (1 - rho * power))
    area = float(np.sum(integrand * _GAUSS[1] * (right - left) / 2))
    if gap > 60.0:  # there the integrand is its limit, 1/n
        area += (gap - 60.0) / n
    return 2 * area / float(shape.kappa)


def saturated_deficit(rho: float, n: float) -> float:
    """C in ∮ζ dx → 4X − 2C/κ for motion far beyond the yield displacement."""
    if not n >= 1:
        raise ParameterError(f"n is {n}", mend="it is 1 or more")
    t = _GAUSS[0] / 2 + 0.5
    total = 0.0
    for edge in range(64):  # pieces keep the integrand smooth for large n and |ρ|
        y = (edge + t) / 64
        power = y**n
        total += float(
            np.sum(_GAUSS[1] * ((1 + y) / (1 - rho * power) + (1 - y) / -np.expm1(n * np.log(y))) / 128)
        )
    return total


def _start(shape: Shape, amplitude: float) -> float:
    """φ at the start of the rising stroke, where ζ = −Z."""
    return float(inverse(np.array(-steady_peak(shape, amplitude)), shape.rho, shape.n))


def _log_gap(shape: Shape, amplitude: float) -> float:
    """r = −ln(1 − Z): G⁻¹(Z) − G⁻¹(−Z) = 2κX, by safeguarded Newton."""
    if not amplitude > 0:
        raise ParameterError(f"amplitude is {amplitude}", mend="give a positive amplitude")
    rho, n, target = float(shape.rho), shape.n, 2 * float(shape.kappa) * amplitude
    low, high = 0.0, n * target + 50.0
    r = min(target / 2, high / 2)
    for _ in range(200):
        z = -np.expm1(-r)
        value = _to_peak(r, n) - float(inverse(np.array(-z), rho, n)) - target
        low, high = (r, high) if value < 0 else (low, r)
        with np.errstate(divide="ignore"):
            slope = np.exp(-r) / -np.expm1(n * np.log1p(-np.exp(-r))) if r < 700 else 1 / n
        slope += np.exp(-r) / (1 - rho * z**n)
        move = r - value / slope
        new = move if low < move < high else (low + high) / 2
        if abs(new - r) <= 1e-15 * max(r, 1e-300):
            return float(new)
        r = new
    return float(r)


def _to_peak(r: float, n: float) -> float:
    """G⁻¹ on the upper side as a function of r, without loss near saturation."""
    if n == 1:
        return r
    if n == 2:
        return 0.5 * (r + float(np.log1p(-np.expm1(-r))))
    # r/n plus the integral of the bounded remainder 1/(1 − yⁿ) − 1/(n (1 − y))
    # near y = 1 the remainder is the difference of two huge numbers; its limit is (n − 1)/2n.
    top = -np.expm1(-min(r, 16.0))
    edges = top * np.linspace(0, 1, 33) ** 3
    left, right = edges[:-1, None], edges[1:, None]
    y = left + (right - left) * (_GAUSS[0] + 1) / 2
    remainder = 1 / -np.expm1(n * np.log(y)) - 1 / (n * (1 - y))
    tail = (-np.expm1(-r) - top) * (n - 1) / (2 * n)
    return r / n + float(np.sum(remainder * _GAUSS[1] * (right - left) / 2)) + float(tail)


def _rising_nodes(shape: Shape, amplitude: float) -> tuple[Floats, Floats]:
    """Gauss nodes and weights over θ from −π/2 to π/2."""
    start, kappa = _start(shape, amplitude), float(shape.kappa)
    full = 2 * kappa * amplitude
    ladder = np.concatenate([np.linspace(0, 12, 25), np.geomspace(12, max(full, 13), 30)])
    marks = np.concatenate([ladder, -start + ladder, [full]])
    way = np.unique(marks[(marks >= 0) & (marks <= full)]) / full
    theta = np.arcsin(np.clip(2 * way - 1, -1, 1))
    left, right = theta[:-1, None], theta[1:, None]
    nodes = left + (right - left) * (_GAUSS[0] + 1) / 2
    return nodes.ravel(), (_GAUSS[1] * (right - left) / 2).ravel()
