"""The same strokes in machine code: for batches, fleets and long records.

The NumPy path of `response` does the main job. This one does the same arithmetic at 2 ns a
sample instead of 30, and costs the import of a compiler. A stroke is cut where the state
passes zero and where it is saturated to the last bit, so every piece is a loop without a
branch, which becomes a loop over vector registers. Importing this module imports numba.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit

from mrdamper.data import Floats
from mrdamper.hysteresis.compiled_math import expm1, tan, tanh
from mrdamper.hysteresis.master_curve import _BELOW_ONE, MasterCurve, _Quintics, _Tabulated, master_curve
from mrdamper.hysteresis.path import Path
from mrdamper.hysteresis.shape import Shape

_compile = njit(cache=True, error_model="numpy", nogil=True, fastmath={"contract"})
_FULL_1, _FULL_2 = 37.5, 19.1  # distances past zero at which 1 − e^−phi and tanh phi round to 1


@dataclass(frozen=True, eq=False)
class Strokes:
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
    begin: np.ndarray
    lengths: Floats
    first_direction: float

    @classmethod
    def of(cls, path: Path) -> Strokes:
        """Read a path."""
        strokes = len(path.lengths) + 1
        begin = np.searchsorted(path.stroke, np.arange(strokes + 1)).astype(np.uint64)  # no sign, no wrap-around
        return cls(
            np.ascontiguousarray(path.distance),
            begin,
            np.array([*path.lengths, 0.0]),
            path.first_direction,
        )


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
    strokes = Strokes.of(path)
    out = np.empty(len(path))
    states(
        float(shape.kappa),
        float(shape.rho),
        float(shape.n),
        *tables(float(shape.n)),
        strokes.distance,
        strokes.begin,
        strokes.lengths,
        strokes.first_direction,
        zeta0,
        out,
    )
    return out


@lru_cache(maxsize=32)
def tables(n: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Cells of the tabulated curves for an exponent; n = 1 and 2 have closed forms and need none.

    Returns
    -------
    rising, rising_distance, growing, growing_distance : (K, 8) arrays
        One cell a row, in one line of the cache: node, 1/width, six coefficients. The last row
        holds the last node alone.
    """
    curve: MasterCurve = master_curve(n)
    if not isinstance(curve, _Tabulated):
        nothing = np.zeros((2, 8))
        return nothing, nothing, nothing, nothing
    rising, growing = curve._rising, curve._growing
    return (
        _cells(rising._r_of_phi),
        _cells(rising._phi_of_r),
        _cells(growing._r_of_phi),
        _cells(growing._phi_of_r),
    )


def _cells(quintics: _Quintics) -> Floats:
    rows = np.zeros((quintics.nodes.size, 8))
    rows[:, 0] = quintics.nodes
    rows[:-1, 1], rows[:-1, 2:] = quintics.cells[:, 6], quintics.cells[:, :6]
    return rows


@_compile
def states(
    kappa,
    rho,
    n,
    rising,
    rising_distance,
    growing,
    growing_distance,
    distance,
    begin,
    lengths,
    first_direction,
    zeta0,
    out,
):
    """State at every sample; arguments as `Shape`, `tables` and `Strokes` hold them."""
    w, sign = first_direction * zeta0, first_direction
    for k in range(begin.size - 1):
        a, b = begin[k], begin[k + 1]
        to_zero = release_distance(w, rho, n, rising_distance, growing_distance)
        zero, full = pieces(kappa, n, to_zero, distance, a, b)
        if a < zero:
            release(kappa, rho, n, rising, growing, to_zero, sign, distance, a, zero, out, np.uint64(0))
        if zero < full:
            climb(
                kappa, n, rising, rising_distance, max(w, 0.0), to_zero, sign, distance, zero, full, out, np.uint64(0)
            )
        for i in range(full, b):
            out[i] = sign
        w = -advance(kappa, rho, n, rising, rising_distance, growing, growing_distance, w, to_zero, lengths[k])
        sign = -sign


@_compile
def pieces(kappa, n, to_zero, distance, a, b):
    """First sample past zero, and first sample at which the state is 1 to the last bit."""
    zero = _first_from(distance, a, b, kappa, to_zero) if to_zero > 0.0 else a
    if n == 1.0:
        return zero, _first_from(distance, zero, b, kappa, to_zero + _FULL_1)
    if n == 2.0:
        return zero, _first_from(distance, zero, b, kappa, to_zero + _FULL_2)
    return zero, b


@_compile
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


@_compile
def release_distance(w, rho, n, rising_distance, growing_distance):
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
        return cell_value(rising_distance, -math.log1p(-scale * size * _BELOW_ONE)) / scale
    return cell_value(growing_distance, math.log1p(scale * size)) / scale


@_compile
def advance(kappa, rho, n, rising, rising_distance, growing, growing_distance, w, to_zero, length):
    """State at the end of a stroke."""
    phi = kappa * length - to_zero
    if phi < 0.0:
        return _release_end(rho, n, rising, growing, -phi)
    start = max(w, 0.0)
    if n == 1.0:
        return start - (1.0 - start) * math.expm1(-phi)
    if n == 2.0:
        t = math.tanh(phi) if phi < _FULL_2 else 1.0
        return (start + t) / (1.0 + start * t)
    travelled = cell_value(rising_distance, -math.log1p(-start * _BELOW_ONE)) + phi
    return -math.expm1(-cell_value(rising, travelled))


@_compile
def _release_end(rho, n, rising, growing, before):
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
        return math.expm1(-cell_value(rising, scale * before)) / scale
    return -math.expm1(cell_value(growing, scale * before)) / scale


@_compile
def release(kappa, rho, n, rising, growing, to_zero, sign, distance, a, b, out, origin):
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
        cells = rising if rho > 0.0 else growing
        at = cells.shape[0] - 2
        for i in range(a, b):  # the distance to zero shrinks, so the cells pass one after the other
            x = min(scale * (to_zero - kappa * distance[i]), cells[-1, 0])
            while at > 0 and cells[at, 0] > x:
                at -= 1
            r = _in_cell(cells, at, x)
            out[i - origin] = sign * math.expm1(-r) / scale if rho > 0.0 else -sign * math.expm1(r) / scale


@_compile
def climb(kappa, n, rising, rising_distance, w, to_zero, sign, distance, a, b, out, origin):
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
        start = cell_value(rising_distance, -math.log1p(-w * _BELOW_ONE)) - to_zero
        at, last = 0, rising.shape[0] - 2
        for i in range(a, b):
            x = min(kappa * distance[i] + start, rising[-1, 0])
            while at < last and rising[at + 1, 0] <= x:
                at += 1
            out[i - origin] = -sign * math.expm1(-_in_cell(rising, at, x))


@_compile
def cell_value(cells, x):
    """Value of tabulated quintics at one place."""
    x = min(max(x, cells[0, 0]), cells[-1, 0])
    low, high = 0, cells.shape[0] - 2
    while low < high:
        middle = (low + high + 1) >> 1
        if cells[middle, 0] <= x:
            low = middle
        else:
            high = middle - 1
    return _in_cell(cells, low, x)


@_compile
def _in_cell(cells, at, x):
    t = (x - cells[at, 0]) * cells[at, 1]
    return cells[at, 2] + t * (
        cells[at, 3] + t * (cells[at, 4] + t * (cells[at, 5] + t * (cells[at, 6] + t * cells[at, 7])))
    )
