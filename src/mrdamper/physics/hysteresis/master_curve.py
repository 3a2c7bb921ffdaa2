"""The curve of which every Bouc–Wen stroke is a part, for n = 1, n = 2 and any other n >= 1.

In a monotone stroke, with w the state in the direction of motion in units of z_max and phi
the distance in units of the yield displacement,

    dw/dphi = 1 − w^n  (w >= 0, climb)        dw/dphi = 1 − rho |w|^n  (w < 0, release).

n = 1 and n = 2 have closed forms. Any other n is tabulated, once for each n: the factor
|rho|^(1/n) scales every release onto dy/dphi = 1 ∓ y^n, so two curves without a parameter
besides n serve all rho (rising to 1, growing without bound).

The tables hold r = −ln|1 − y| (or ln(1 + y) on the growing curve) over distance. In r the curves are nearly straight,
also where y is within rounding of 1, and dr/dphi and its derivative are known exactly; quintic Hermite cells then reach
1e-11. Nodes are dense near 0 because y^n is not smooth there.

This file contains the numerics of the function; `hysteresis` uses the methods of `MasterCurve` only. Each takes floats
with `xp=math`, or arrays and symbols with `xp=numpy`, and a single rho.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable
from functools import cached_property, lru_cache
from struct import Struct
from types import ModuleType
from typing import Any

import numpy as np

from mrdamper.data.arrays import Floats
from mrdamper.tracing.expression import Expression, choose, settled

STEEPEST = 1e6  # largest |rho| |w|^n: a shorter release is below rounding
SATURATED = 38.0  # in r: 1 − e^−38 rounds to 1
_BELOW_ONE = 1 - 2**-50  # keeps a state of 1 from the pole of a logarithm, by a rounding error
_CELL = Struct("7d")  # six coefficients and one over the width

Value = Any  # float or array, by `xp`


def master_curve(n: float) -> MasterCurve:
    """Return the curve for an exponent, calculated once."""
    if n == 1:
        return _Exponential()
    if n == 2:
        return _Tangent()
    return _tabulated(settled(n))


@lru_cache
def gauss_legendre(points: int) -> tuple[Floats, Floats]:
    """Return nodes and weights of a Gauss–Legendre rule on −1...1; NumPy solves an eigenvalue problem for them."""
    return np.polynomial.legendre.leggauss(points)


def approach_rate(r: Floats, n: float) -> Floats:
    """(1 − y^n)/(1 − y) at y = 1 − e^−r: the rate dr/dphi of the climb, all digits kept as y → 1."""
    gap = np.exp(-np.minimum(r, SATURATED))
    return -np.expm1(n * np.log1p(-gap)) / gap


class MasterCurve(ABC):
    """Climb and release for one exponent n."""

    full: float = math.inf  # distance past zero at which the state rounds to 1; infinite without a closed form

    @abstractmethod
    def rise(self, phi: Value, xp: ModuleType) -> Value:
        """State reached from w = 0 after a distance phi."""

    @abstractmethod
    def climb(self, w: Value, phi: Value, xp: ModuleType) -> Value:
        """State reached from w in 0...1 after a distance phi."""

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

    full = 37.5

    def rise(self, phi: Value, xp: ModuleType) -> Value:
        return -xp.expm1(-phi)

    def climb(self, w: Value, phi: Value, xp: ModuleType) -> Value:
        return w - (1.0 - w) * xp.expm1(-phi)

    def climb_distance(self, r: float) -> float:
        return r

    def release(self, phi: Value, rho: float, xp: ModuleType) -> Value:
        return choose(rho != 0, lambda: -xp.expm1(-rho * phi) / rho, lambda: phi)

    def release_distance(self, size: Value, rho: float, xp: ModuleType) -> Value:
        return choose(rho != 0, lambda: -xp.log1p(-rho * size * _BELOW_ONE) / rho, lambda: size)


class _Tangent(MasterCurve):
    """n = 2."""

    full = 19.1

    def rise(self, phi: Value, xp: ModuleType) -> Value:
        return xp.tanh(phi)

    def climb(self, w: Value, phi: Value, xp: ModuleType) -> Value:
        t = xp.tanh(phi)
        return (w + t) / (1.0 + w * t)

    def climb_distance(self, r: float) -> float:
        return 0.5 * (r + math.log1p(-math.expm1(-r)))

    def release(self, phi: Value, rho: float, xp: ModuleType) -> Value:
        root = xp.sqrt(abs(rho))
        return _by_sign(rho, lambda: xp.tanh(root * phi) / root, lambda: xp.tan(root * phi) / root, lambda: phi)

    def release_distance(self, size: Value, rho: float, xp: ModuleType) -> Value:
        root = xp.sqrt(abs(rho))
        return _by_sign(
            rho,
            lambda: xp.atanh(root * size * _BELOW_ONE) / root,
            lambda: xp.atan(root * size) / root,
            lambda: size,
        )


def _by_sign(
    rho: Value, positive: Callable[[], Value], negative: Callable[[], Value], zero: Callable[[], Value]
) -> Value:
    return choose(rho > 0, positive, lambda: choose(rho < 0, negative, zero))


class _Tabulated(MasterCurve):
    """Any n >= 1, from tables."""

    def __init__(self, n: float):
        self.n = n

    def rise(self, phi: Value, xp: ModuleType) -> Value:
        return -xp.expm1(-self._rising.coordinate(phi, xp))

    def climb(self, w: Value, phi: Value, xp: ModuleType) -> Value:
        start = -xp.log1p(-(min(w, 1.0) if xp is math else np.minimum(w, 1.0)) * _BELOW_ONE)  # by rounding above 1
        return -xp.expm1(-self._rising.coordinate(self._rising.distance(start, xp) + phi, xp))

    def climb_distance(self, r: float) -> float:
        # Past the table (1 − w^n)/(1 − w) is n.
        return self._rising.distance(min(r, SATURATED), math) + max(r - SATURATED, 0.0) / self.n

    def release(self, phi: Value, rho: float, xp: ModuleType) -> Value:
        scale = abs(rho) ** (1 / self.n)
        return _by_sign(
            rho,
            lambda: -xp.expm1(-self._rising.coordinate(scale * phi, xp)) / scale,
            lambda: xp.expm1(self._growing.coordinate(scale * phi, xp)) / scale,
            lambda: phi,
        )

    def release_distance(self, size: Value, rho: float, xp: ModuleType) -> Value:
        scale = abs(rho) ** (1 / self.n)
        return _by_sign(
            rho,
            lambda: self._rising.distance(-xp.log1p(-scale * size * _BELOW_ONE), xp) / scale,
            lambda: self._growing.distance(xp.log1p(scale * size), xp) / scale,
            lambda: size,
        )

    @cached_property
    def _rising(self) -> _CurveTable:
        """dy/dphi = 1 − y^n from 0 to 1; y = 1 − e^−r."""

        def rate(r: Floats) -> tuple[Floats, Floats]:
            with np.errstate(divide="ignore"):  # at r = 0 a logarithm of 0, which ends up as y^n = 0
                speed = approach_rate(r, self.n)
            return speed, speed - self.n * (-np.expm1(-r)) ** (self.n - 1)

        return _CurveTable(crowded_nodes(SATURATED), rate)

    @cached_property
    def _growing(self) -> _CurveTable:
        """dy/dphi = 1 + y^n from 0 on; y = e^r − 1."""

        def rate(r: Floats) -> tuple[Floats, Floats]:
            y = np.expm1(r)
            speed = (1 + y**self.n) / (1 + y)
            return speed, self.n * y ** (self.n - 1) - speed

        return _CurveTable(crowded_nodes(math.log1p(STEEPEST ** (1 / self.n))), rate)


_tabulated = lru_cache(maxsize=128)(_Tabulated)


def crowded_nodes(end: float) -> Floats:
    """Nodes of a table from 0 to an end, dense at 0 where y^n is not smooth."""
    return end * np.linspace(0, 1, 769) ** 4


class _CurveTable:
    """r over distance and distance over r, for dr/dphi = rate(r).

    `r` (K,): nodes, increasing; `rate`: r -> dr/dphi and the derivative of that with respect to r.
    """

    def __init__(self, r: Floats, rate: Callable[[Floats], tuple[Floats, Floats]]):
        node, weight = gauss_legendre(8)
        width = np.diff(r)
        inside = r[:-1, None] + 0.5 * width[:, None] * (1 + node)
        phi = np.concatenate([[0.0], np.cumsum(0.5 * width * ((1 / rate(inside)[0]) @ weight))])
        speed, change = rate(r)
        points = np.column_stack([phi, r, speed, change])
        self._r_of_phi = _Quintics(phi, r, speed, change * speed, points)
        self._phi_of_r = _Quintics(r, phi, 1 / speed, -change / speed**2, points, backwards=True)

    def coordinate(self, phi: Value, xp: ModuleType) -> Value:
        """Coordinate r at a distance."""
        return _evaluate(self._r_of_phi, phi, xp)

    def distance(self, r: Value, xp: ModuleType) -> Value:
        """Distance at r."""
        return _evaluate(self._phi_of_r, r, xp)


def _evaluate(table: _Quintics, x: Value, xp: ModuleType) -> Value:
    if isinstance(x, Expression):
        return x.tape.lookup(table, x)
    return table.at_float(x) if xp is math else table.at(x)


class _Quintics:
    """Piecewise quintic with given values and two derivatives at its nodes; constant beyond them.

    It is one direction of the table of `points` (phi, r, dr/dphi, its derivative with respect to r), which both
    directions share.
    """

    def __init__(self, x: Floats, y: Floats, slope: Floats, bend: Floats, points: Floats, *, backwards: bool = False):
        self.points, self.backwards = points, backwards
        step = np.diff(x)
        c0, c1, c2 = y[:-1], step * slope[:-1], 0.5 * step**2 * bend[:-1]
        value = y[1:] - c0 - c1 - c2
        rise = step * slope[1:] - c1 - 2 * c2
        curve = 0.5 * step**2 * bend[1:] - c2
        self.nodes, self._inverse_step = x, 1 / step
        self._coefficients = (
            c0,
            c1,
            c2,
            10 * value - 4 * rise + curve,
            -15 * value + 7 * rise - 2 * curve,
            6 * value - 3 * rise + curve,
        )
        # (K − 1, 7): coefficients of each cell, lowest first, and one over its width
        self.cells: Floats = np.column_stack([*self._coefficients, self._inverse_step])

    def at(self, x: Floats) -> Floats:
        x = np.clip(x, self.nodes[0], self.nodes[-1])
        cell = np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, self.nodes.size - 2)
        t = (x - self.nodes[cell]) * self._inverse_step[cell]
        result = self._coefficients[5][cell]
        for coefficient in self._coefficients[4::-1]:
            result = result * t + coefficient[cell]
        return result

    def at_float(self, x: float) -> float:
        nodes, cells = self._buffers
        cell = min(max(bisect_right(nodes, x) - 1, 0), len(nodes) - 2)
        c0, c1, c2, c3, c4, c5, inverse_step = _CELL.unpack_from(cells, _CELL.size * cell)
        t = (min(max(x, nodes[0]), nodes[-1]) - nodes[cell]) * inverse_step
        return c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))

    @cached_property
    def _buffers(self) -> tuple[list[float], bytes]:
        # Numbers read from memory: taking one out of an array costs more than the arithmetic here,
        # and lists of all of them more than a search over n asks of one curve.
        return self.nodes.tolist(), self.cells.tobytes()
