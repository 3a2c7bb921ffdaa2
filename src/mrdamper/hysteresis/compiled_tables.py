"""The tabulated curves made in machine code, for a search in which n changes at every step.

The same quadrature and the same quintics as the NumPy path makes them by, ten times faster: what
does not depend on n is kept, and what does is one power a point. Importing this module imports numba.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrdamper.data import Floats
from mrdamper.hysteresis.compiled_math import expm1
from mrdamper.hysteresis.compiled_options import inner, kernel
from mrdamper.hysteresis.master_curve import SATURATED, STEEPEST, crowded_nodes

RISING, RISING_DISTANCE, GROWING, GROWING_DISTANCE = np.arange(4)  # typed: Python numbers would each be compiled for


class Curve(NamedTuple):
    """An exponent and the cells of its curves; n = 1 and 2 have closed forms and need none.

    Attributes
    ----------
    n : float
    cells : (4, K, 8) array
        Of RISING, RISING_DISTANCE, GROWING and GROWING_DISTANCE. A cell is a row, in one line of
        the cache: node, 1/width, six coefficients. The last row holds the last node alone.
    """

    n: float
    cells: Floats


@lru_cache(maxsize=32)
def curve_of(n: float, growing: bool = True) -> Curve:
    """Curves of an exponent; those of a release along a growing slope (rho < 0) only if asked for."""
    if n in (1.0, 2.0):
        return Curve(n, np.zeros((4, 2, 8)))
    nodes = _rising_nodes()
    cells = np.zeros((4, nodes.r.size, 8))
    _tabulate(n, -1.0, nodes, cells[RISING], cells[RISING_DISTANCE])
    if growing:
        nodes = _nodes(math.log1p(STEEPEST ** (1 / n)), 1.0)
        _tabulate(n, 1.0, nodes, cells[GROWING], cells[GROWING_DISTANCE])
    return Curve(n, cells)


class _Nodes(NamedTuple):
    """Nodes of a table, places of its quadrature, and what is the same there for every n.

    A curve follows dr/dphi = (1 ∓ y^n)/(1 ∓ y), with y = 1 − e^−r rising and y = e^r − 1 growing.
    """

    r: Floats
    log_y: Floats
    below: Floats  # 1 ∓ y
    log_y_inside: NDArray[np.float64]
    below_inside: NDArray[np.float64]
    weight: Floats


@lru_cache(maxsize=1)
def _rising_nodes() -> _Nodes:
    return _nodes(SATURATED, -1.0)


def _nodes(end: float, sign: float) -> _Nodes:
    r = crowded_nodes(end)
    place, weight = np.polynomial.legendre.leggauss(8)
    inside = r[:-1, None] + 0.5 * np.diff(r)[:, None] * (1 + place)
    with np.errstate(divide="ignore"):  # at r = 0
        logs = [np.log1p(-np.exp(-at)) if sign < 0 else np.log(np.expm1(at)) for at in (r, inside)]
    return _Nodes(r, logs[0], np.exp(sign * r), logs[1], np.exp(sign * inside), weight)


@kernel
def _tabulate(n, sign, nodes, of_phi, of_r):
    """Cells of r over distance and of distance over r."""
    phi = speed = slope = 0.0
    for k in range(nodes.r.size):
        before_phi, before_speed, before_slope = phi, speed, slope
        speed = _rate(n, sign, nodes.log_y[k], nodes.below[k])
        slope = sign * (n * (1.0 + expm1(max((n - 1.0) * nodes.log_y[k], -700.0))) - speed)
        if k > 0:
            width, total = nodes.r[k] - nodes.r[k - 1], 0.0
            for j in range(8):
                rate = _rate(n, sign, nodes.log_y_inside[k - 1, j], nodes.below_inside[k - 1, j])
                total += nodes.weight[j] / rate
            phi += 0.5 * width * total
            step = phi - before_phi
            bend, before_bend = slope * speed, before_slope * before_speed  # d²r/dphi²
            _cell(of_phi[k - 1], step, width, before_speed, speed, before_bend, bend)
            bend, before_bend = -slope / speed**2, -before_slope / before_speed**2  # d²phi/dr²
            _cell(of_r[k - 1], width, step, 1.0 / before_speed, 1.0 / speed, before_bend, bend)
            of_phi[k - 1, 2], of_r[k - 1, 2] = nodes.r[k - 1], before_phi
        of_phi[k, 0], of_r[k, 0] = phi, nodes.r[k]


@inner
def _rate(n, sign, log_y, below):
    return ((1.0 + sign) + sign * expm1(max(n * log_y, -700.0))) / below


@inner
def _cell(row, step, gained, slope0, slope1, bend0, bend1):
    """Quintic over one cell from what it gains, and slopes and second derivatives at its ends."""
    c1, c2 = step * slope0, 0.5 * step**2 * bend0
    value = gained - c1 - c2
    rise = step * slope1 - c1 - 2 * c2
    curve = 0.5 * step**2 * bend1 - c2
    row[1], row[3], row[4] = 1.0 / step, c1, c2
    row[5] = 10 * value - 4 * rise + curve
    row[6] = -15 * value + 7 * rise - 2 * curve
    row[7] = 6 * value - 3 * rise + curve
