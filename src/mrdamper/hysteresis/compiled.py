"""The same strokes in machine code: for batches, fleets and long records.

The NumPy path of `response` does the main job. This one does the same arithmetic at 2 ns a
sample instead of 30, and costs the import of a compiler. A first pass goes from reversal to
reversal and cuts each stroke where the state passes zero and where it is saturated to the last
bit; every piece is then a loop without a branch, which becomes a loop over vector registers.
Importing this module imports numba.

For whoever changes this file: numba keeps compiled functions by the date of the file they stand
in, not of the files they call. `touch` the other `compiled_*.py` too.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from mrdamper.data import Floats
from mrdamper.hysteresis.compiled_math import expm1, tan, tanh
from mrdamper.hysteresis.compiled_options import inner, kernel
from mrdamper.hysteresis.compiled_tables import (
    GROWING,
    GROWING_DISTANCE,
    RISING,
    RISING_DISTANCE,
    curve_of,
)
from mrdamper.hysteresis.master_curve import _BELOW_ONE, master_curve
from mrdamper.hysteresis.shape import Shape
from mrdamper.motion import Path

_FULL_1, _FULL_2 = master_curve(1.0).full, master_curve(2.0).full


class Strokes(NamedTuple):
    """A path as the kernels want it.

    Attributes
    ----------
    distance : (N,) array
        Distance since the reversal that began the stroke [m].
    begin : (K+1,) int array
        First sample of every stroke, and N; unsigned, so that loops need not look for negative indices.
    lengths : (K,) array
        Length of every stroke; 0 for the last, which nothing follows [m].
    first_direction : float
    """

    distance: Floats
    begin: NDArray[np.uint64]
    lengths: Floats
    first_direction: float

    @classmethod
    def of(cls, path: Path) -> Self:
        """Read a path."""
        strokes = len(path.lengths) + 1
        begin = np.searchsorted(path.stroke, np.arange(strokes + 1)).astype(np.uint64)  # no sign, no wrap-around
        lengths = np.array([*path.lengths, 0.0])
        return cls(np.ascontiguousarray(path.distance), begin, lengths, path.first_direction)


# What the first pass finds for a stroke: the state where it begins, in its direction; the distance
# from there to zero; the direction; the first sample past zero, and the first whose state rounds to 1.
CUT = np.dtype([("start", "f8"), ("to_zero", "f8"), ("sign", "f8"), ("zero", "u8"), ("full", "u8")])


def follow_compiled(shape: Shape, path: Path, zeta0: float = 0.0) -> Floats:
    """`follow` in machine code, for one shape and a start within ±1.

    Parameters
    ----------
    shape : Shape
        One shape.
    path : Path
        N samples.
    zeta0 : float
        State before the first sample [z_max], −1...1.

    Returns
    -------
    (N,) array
        zeta [-], the same as `follow` to 1e-13 for n = 1 and 2, and to 1e-12 from the tables.
    """
    return follow_strokes(float(shape.kappa), float(shape.rho), float(shape.n), Strokes.of(path), zeta0)


def follow_strokes(kappa: float, rho: float, n: float, strokes: Strokes, zeta0: float = 0.0) -> Floats:
    """The same for strokes that are followed often, and nothing checked."""
    out = np.empty(strokes.distance.size)
    states(kappa, rho, curve_of(n, rho < 0), strokes, zeta0, out)
    return out


@kernel
def states(kappa, rho, curve, strokes, zeta0, out):
    """State at every sample, into `out`."""
    cuts = np.empty(strokes.lengths.size, CUT)
    cut(kappa, rho, curve, strokes, zeta0, cuts)
    n, cells, distance, begin = curve.n, curve.cells, strokes.distance, strokes.begin
    for k in range(cuts.size):
        fill(kappa, rho, n, cells, cuts[k], distance, begin[k], begin[k + 1], out, np.uint64(0))


@inner
def cut(kappa, rho, curve, strokes, zeta0, cuts):
    """Go from reversal to reversal, from a state zeta0 on; what a stroke needs goes into `cuts`."""
    n, cells = curve.n, curve.cells
    distance, begin, lengths, sign = strokes
    w = sign * zeta0
    for k in range(lengths.size):
        to_zero = _release_distance(w, rho, n, cells)
        one = cuts[k]
        one.start, one.to_zero, one.sign = w, to_zero, sign
        one.zero, one.full = _pieces(kappa, n, to_zero, distance, begin[k], begin[k + 1])
        w, sign = -_advance(rho, n, cells, w, kappa * lengths[k] - to_zero), -sign


@inner
def fill(kappa, rho, n, cells, stroke, distance, a, b, out, origin):
    """States at samples a...b−1, which are of one stroke, into out[i − origin]."""
    to_zero, sign = stroke.to_zero, stroke.sign
    zero, full = min(max(stroke.zero, a), b), min(max(stroke.full, a), b)
    if a < zero:
        _release(kappa, rho, n, cells, to_zero, sign, distance, a, zero, out, origin)
    if zero < full:
        _climb(kappa, n, cells, max(stroke.start, 0.0), to_zero, sign, distance, zero, full, out, origin)
    for i in range(full, b):
        out[i - origin] = sign


@inner
def _pieces(kappa, n, to_zero, distance, a, b):
    """First sample past zero, and first sample at which the state is 1 to the last bit."""
    zero = _first_from(distance, a, b, kappa, to_zero) if to_zero > 0.0 else a
    if n != 1.0 and n != 2.0:
        return zero, b
    return zero, _first_from(distance, zero, b, kappa, to_zero + (_FULL_1 if n == 1.0 else _FULL_2))


@inner
def _first_from(distance, low, high, kappa, limit):
    """First sample in low...high whose kappa · distance reaches a limit; distances increase.

    Halving without a branch: a processor cannot foresee where the sample lies.
    """
    one = np.uint64(1)
    left = high - low
    if left == 0:
        return low
    while left > one:
        half = left >> one
        low += half * np.uint64(kappa * distance[low + half - one] < limit)
        left -= half
    return low + np.uint64(kappa * distance[low] < limit)


@inner
def _release_distance(w, rho, n, cells):
    """Distance in which a state w < 0 gets to zero; 0 for w >= 0."""
    if w >= 0.0:
        return 0.0
    size = -w
    if rho == 0.0:
        return size
    if n == 1.0:
        return -math.log1p(-rho * size * _BELOW_ONE) / rho
    if n == 2.0:
        root = math.sqrt(abs(rho))
        return math.atanh(root * size * _BELOW_ONE) / root if rho > 0.0 else math.atan(root * size) / root
    scale = abs(rho) ** (1.0 / n)
    if rho > 0.0:
        return _cell_value(cells, RISING_DISTANCE, -math.log1p(-scale * size * _BELOW_ONE)) / scale
    return _cell_value(cells, GROWING_DISTANCE, math.log1p(scale * size)) / scale


@inner
def _advance(rho, n, cells, w, phi):
    """State at the end of a stroke from w that goes a distance phi past zero."""
    if phi < 0.0:
        return _release_end(rho, n, cells, -phi)
    start = max(w, 0.0)
    if n == 1.0:
        return start - (1.0 - start) * math.expm1(-phi)
    if n == 2.0:
        t = math.tanh(phi) if phi < _FULL_2 else 1.0
        return (start + t) / (1.0 + start * t)
    travelled = _cell_value(cells, RISING_DISTANCE, -math.log1p(-start * _BELOW_ONE)) + phi
    return -math.expm1(-_cell_value(cells, RISING, travelled))


@inner
def _release_end(rho, n, cells, before):
    """State at a distance before zero."""
    if rho == 0.0:
        return -before
    if n == 1.0:
        return math.expm1(-rho * before) / rho
    if n == 2.0:
        root = math.sqrt(abs(rho))
        return -math.tanh(root * before) / root if rho > 0.0 else -math.tan(root * before) / root
    scale = abs(rho) ** (1.0 / n)
    if rho > 0.0:
        return math.expm1(-_cell_value(cells, RISING, scale * before)) / scale
    return -math.expm1(_cell_value(cells, GROWING, scale * before)) / scale


@inner
def _release(kappa, rho, n, cells, to_zero, sign, distance, a, b, out, origin):
    """States before zero at samples a...b−1, into out[i − origin], in the direction `sign` of the motion."""
    if rho == 0.0:
        for i in range(a, b):
            out[i - origin] = -sign * (to_zero - kappa * distance[i])
    elif n == 1.0:
        factor = sign / rho
        for i in range(a, b):
            out[i - origin] = factor * expm1(-rho * (to_zero - kappa * distance[i]))
    elif n == 2.0:
        root = math.sqrt(abs(rho))
        factor = -sign / root
        if rho > 0.0:
            for i in range(a, b):
                out[i - origin] = factor * tanh(root * (to_zero - kappa * distance[i]))
        else:
            for i in range(a, b):
                out[i - origin] = factor * tan(root * (to_zero - kappa * distance[i]))
    else:
        scale = abs(rho) ** (1.0 / n)
        table = RISING if rho > 0.0 else GROWING
        at = cells.shape[1] - 2
        for i in range(a, b):  # the distance to zero shrinks, so the cells pass one after the other
            x = min(scale * (to_zero - kappa * distance[i]), cells[table, -1, 0])
            while at > 0 and cells[table, at, 0] > x:
                at -= 1
            r = _in_cell(cells, table, at, x)
            out[i - origin] = sign * math.expm1(-r) / scale if rho > 0.0 else -sign * math.expm1(r) / scale


@inner
def _climb(kappa, n, cells, w, to_zero, sign, distance, a, b, out, origin):
    """States from w >= 0 on at samples a...b−1, into out[i − origin], in the direction `sign` of the motion."""
    if n == 1.0:
        for i in range(a, b):
            out[i - origin] = sign * (w - (1.0 - w) * expm1(to_zero - kappa * distance[i]))
    elif n == 2.0:
        if w == 0.0:
            for i in range(a, b):
                out[i - origin] = sign * tanh(kappa * distance[i] - to_zero)
        else:
            for i in range(a, b):
                t = tanh(kappa * distance[i] - to_zero)
                out[i - origin] = sign * ((w + t) / (1.0 + w * t))
    else:
        start = _cell_value(cells, RISING_DISTANCE, -math.log1p(-w * _BELOW_ONE)) - to_zero
        at, last = 0, cells.shape[1] - 2
        for i in range(a, b):
            x = min(kappa * distance[i] + start, cells[RISING, -1, 0])
            while at < last and cells[RISING, at + 1, 0] <= x:
                at += 1
            out[i - origin] = -sign * math.expm1(-_in_cell(cells, RISING, at, x))


@inner
def _cell_value(cells, table, x):
    """Value of a tabulated curve at one place."""
    x = min(max(x, cells[table, 0, 0]), cells[table, -1, 0])
    low, high = 0, cells.shape[1] - 2
    while low < high:
        middle = (low + high + 1) >> 1
        if cells[table, middle, 0] <= x:
            low = middle
        else:
            high = middle - 1
    return _in_cell(cells, table, low, x)


@inner
def _in_cell(cells, table, at, x):
    t = (x - cells[table, at, 0]) * cells[table, at, 1]
    value = cells[table, at, 7]
    for j in range(6, 1, -1):
        value = value * t + cells[table, at, j]
    return value
