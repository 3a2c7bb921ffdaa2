"""The one curve that every Bouc–Wen stroke is a piece of, for n = 1, n = 2 and any other n >= 1.

In a monotone stroke, with w the state in the direction of motion in units of z_max and phi
the distance in units of the yield displacement,

    dw/dphi = 1 − w^n  (w >= 0, climb)        dw/dphi = 1 − rho |w|^n  (w < 0, release).

n = 1 and n = 2 have closed forms. Any other n is tabulated, once for each n: the factor
|rho|^(1/n) scales every release onto dy/dt = 1 ∓ y^n, so three curves without a parameter
besides n serve all rho (rising to 1, growing without bound, decaying to 1 from above).

The tables hold r = −ln|1 − y| (or ln(1 + y) on the growing curve) over distance. In r the
curves are nearly straight, also when y is within rounding of 1, and dr/dphi and its
derivative are known exactly; quintic Hermite cells then reach 1e-11. Nodes crowd towards 0
as the fourth power because y^n is not smooth there.

This is a file of its own because it is the numerics of a function of two variables;
`hysteresis` is the mechanics and needs to know only the four methods of `MasterCurve`.
Each method takes floats with `xp=math`, or arrays with `xp=numpy`, and a single rho.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from bisect import bisect_right
from functools import cached_property, lru_cache
from types import ModuleType
from typing import Any

import numpy as np

from mrdamper.data import Floats

CEILING = 11.0  # largest |w| a state may start from, in units of z_max
STEEPEST = 1e6  # largest |rho| |w|^n: beyond it the release is shorter than rounding resolves
_SATURATED = 38.0  # e^−38 is below rounding of 1

Value = Any  # float or array, as `xp` says


@lru_cache(maxsize=128)
def master_curve(n: float) -> MasterCurve:
    """The curve for an exponent, made once."""
    if n == 1:
        return _Exponential()
    if n == 2:
        return _Tangent()
    return _Tabulated(n)


def approach_rate(r: Floats, n: float) -> Floats:
    """(1 − y^n)/(1 − y) at y = 1 − e^−r, the rate dr/dphi of the climb; no digits lost near y = 1."""
    gap = np.exp(-r)
    return -np.expm1(n * np.log1p(-gap)) / gap


class MasterCurve(ABC):
    """Climb and release for one exponent n."""

    @abstractmethod
    def climb(self, w: Value, phi: Value, xp: ModuleType) -> Value:
        """State reached from w >= 0 (also above 1) after a distance phi."""

    @abstractmethod
    def climb_distance(self, r: float) -> float:
        """Distance from w = 0 to w = 1 − e^−r."""

    @abstractmethod
    def release(self, phi: Value, rho: float, xp: ModuleType) -> Value:
        """|w| at a distance phi before the state passes zero."""

    @abstractmethod
    def release_distance(self, size: Value, rho: float, xp: ModuleType) -> Value:
        """Distance in which a state w = −size gets to zero."""


class _Exponential(MasterCurve):
    """n = 1."""

    def climb(self, w: Value, phi: Value, xp: ModuleType) -> Value:
        return w - (1.0 - w) * xp.expm1(-phi)

    def climb_distance(self, r: float) -> float:
        return r

    def release(self, phi: Value, rho: float, xp: ModuleType) -> Value:
        return -xp.expm1(-rho * phi) / rho if rho else phi

    def release_distance(self, size: Value, rho: float, xp: ModuleType) -> Value:
        return -xp.log1p(-rho * size) / rho if rho else size


class _Tangent(MasterCurve):
    """n = 2."""

    def climb(self, w: Value, phi: Value, xp: ModuleType) -> Value:
        # The addition theorem of tanh is also that of coth, so w > 1 needs no case of its own.
        t = xp.tanh(phi)
        return t if w is ZERO else (w + t) / (1.0 + w * t)

    def climb_distance(self, r: float) -> float:
        return 0.5 * (r + math.log1p(-math.expm1(-r)))

    def release(self, phi: Value, rho: float, xp: ModuleType) -> Value:
        if rho == 0:
            return phi
        root = math.sqrt(abs(rho))
        return (xp.tanh if rho > 0 else xp.tan)(root * phi) / root

    def release_distance(self, size: Value, rho: float, xp: ModuleType) -> Value:
        if rho == 0:
            return size
        root = math.sqrt(abs(rho))
        return (xp.atanh if rho > 0 else xp.atan)(root * size) / root


ZERO = 0.0  # this very object tells n = 2 that a climb starts at zero: the usual case, three passes less


class _Tabulated(MasterCurve):
    """Any n >= 1, from tables."""

    def __init__(self, n: float):
        self.n = n

    def climb(self, w: Value, phi: Value, xp: ModuleType) -> Value:
        if xp is math:
            return self._climb_above(w, phi, xp) if w > 1 else self._climb_below(w, phi, xp)
        w = np.broadcast_to(w, phi.shape)
        above = w > 1
        if not above.any():
            return self._climb_below(w, phi, xp)
        reached = np.empty_like(phi)
        reached[above] = self._climb_above(w[above], phi[above], xp)
        reached[~above] = self._climb_below(w[~above], phi[~above], xp)
        return reached

    def climb_distance(self, r: float) -> float:
        return self._rising.distance(min(r, _SATURATED), math) + max(r - _SATURATED, 0.0) / self.n

    def release(self, phi: Value, rho: float, xp: ModuleType) -> Value:
        scale = abs(rho) ** (1 / self.n)
        if scale == 0:
            return phi
        if rho > 0:
            return -xp.expm1(-self._rising.coordinate(scale * phi, xp)) / scale
        return xp.expm1(self._growing.coordinate(scale * phi, xp)) / scale

    def release_distance(self, size: Value, rho: float, xp: ModuleType) -> Value:
        scale = abs(rho) ** (1 / self.n)
        if scale == 0:
            return size
        if rho > 0:
            return self._rising.distance(-xp.log1p(-scale * size), xp) / scale
        return self._growing.distance(xp.log1p(scale * size), xp) / scale

    def _climb_below(self, w: Value, phi: Value, xp: ModuleType) -> Value:
        # A climb from exactly 1 would start at r = inf; one rounding less is the same state.
        start = -xp.log1p(-w * (1 - 2**-53))
        return -xp.expm1(-self._rising.coordinate(self._rising.distance(start, xp) + phi, xp))

    def _climb_above(self, w: Value, phi: Value, xp: ModuleType) -> Value:
        start = self._falling.distance(-xp.log(w - 1.0), xp)
        return 1.0 + xp.exp(-self._falling.coordinate(start + phi, xp))

    @cached_property
    def _rising(self) -> _Table:
        """dy/dphi = 1 − y^n from 0 to 1; y = 1 − e^−r."""

        def rate(r: Floats) -> tuple[Floats, Floats]:
            with np.errstate(divide="ignore"):  # r = 0: log 0, whose exponential is 0 again
                speed = approach_rate(r, self.n)
            return speed, speed - self.n * (-np.expm1(-r)) ** (self.n - 1)

        return _Table(_SATURATED * np.linspace(0, 1, 385) ** 4, rate)

    @cached_property
    def _growing(self) -> _Table:
        """dy/dphi = 1 + y^n from 0; y = e^r − 1."""

        def rate(r: Floats) -> tuple[Floats, Floats]:
            y = np.expm1(r)
            speed = (1 + y**self.n) / (1 + y)
            return speed, self.n * y ** (self.n - 1) - speed

        return _Table(1.01 * math.log1p(STEEPEST ** (1 / self.n)) * np.linspace(0, 1, 385) ** 4, rate)

    @cached_property
    def _falling(self) -> _Table:
        """dy/dphi = 1 − y^n from the ceiling down to 1; y = 1 + e^−r."""

        def rate(r: Floats) -> tuple[Floats, Floats]:
            gap = np.exp(-r)
            speed = np.expm1(self.n * np.log1p(gap)) / gap
            return speed, speed - self.n * (1 + gap) ** (self.n - 1)

        return _Table(np.linspace(-math.log(CEILING - 1), _SATURATED, 1537), rate)


class _Table:
    """r over distance and distance over r for dr/dphi = rate(r), by quintic Hermite cells.

    Parameters
    ----------
    r : (K,) array
        Nodes, increasing.
    rate : function
        r -> dr/dphi and its derivative with respect to r.
    """

    def __init__(self, r: Floats, rate: Any):
        node, weight = np.polynomial.legendre.leggauss(8)
        width = np.diff(r)
        inside = r[:-1, None] + 0.5 * width[:, None] * (1 + node)
        lengths = 0.5 * width * ((1 / rate(inside)[0]) @ weight)
        phi = np.concatenate([[0.0], np.cumsum(lengths)])
        speed, change = rate(r)
        self._r, self._phi = r, phi
        self._r_of_phi = _hermite_cells(phi, r, speed, change)
        self._phi_of_r = _hermite_cells(r, phi, 1 / speed, -change / speed**2)

    def coordinate(self, phi: Value, xp: ModuleType) -> Value:
        """r at a distance; the last node beyond the table."""
        if xp is math:
            return _at_float(phi, *self._lists[0])
        return _at_array(phi, self._phi, self._r_of_phi)

    def distance(self, r: Value, xp: ModuleType) -> Value:
        """Distance at r; the last node beyond the table."""
        if xp is math:
            return _at_float(r, *self._lists[1])
        return _at_array(r, self._r, self._phi_of_r)

    @cached_property
    def _lists(self) -> tuple[tuple[list[float], list[tuple[float, ...]]], ...]:
        # Python floats: indexing an array for one number costs more than the arithmetic.
        return (
            (self._phi.tolist(), list(zip(*self._r_of_phi.tolist(), strict=True))),
            (self._r.tolist(), list(zip(*self._phi_of_r.tolist(), strict=True))),
        )


def _hermite_cells(x: Floats, y: Floats, slope: Floats, bend: Floats) -> Floats:
    """Coefficients (6, cells) in (x − x_i) of the quintics with given values and two derivatives.

    `bend` is the derivative of the slope with respect to x divided by the slope where x is a
    distance, or itself where x is r; see the two calls.
    """
    raise NotImplementedError
