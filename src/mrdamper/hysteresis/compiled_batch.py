"""Fused sums over samples for many shapes: no array of shapes × samples is ever made.

Everything a least-squares search asks of a hysteretic state beside fixed columns are its
products with those columns and with itself. A block of states is made, multiplied into the
sums and forgotten. Where the state is saturated, nothing is evaluated at all: running sums of
the columns, made once, give the products. Importing this module imports numba.
"""

from __future__ import annotations

import numpy as np

from mrdamper.data import Floats
from mrdamper.hysteresis.compiled import CUT, Strokes, cut, fill
from mrdamper.hysteresis.compiled_options import inner_sum, kernel
from mrdamper.hysteresis.compiled_tables import curve_of

_BLOCK = np.uint64(512)  # samples whose states fit the first cache beside the columns


def batch_products(
    kappa: Floats, rho: Floats, n: float, strokes: Strokes, first: int, rows: Floats, running: Floats
) -> Floats:
    """Sums over samples first...N−1 of state × row, and of state × state, for P shapes of one n.

    Parameters
    ----------
    kappa, rho : (P,) arrays
        As in `Shape`.
    n : float
    strokes : Strokes
        N samples.
    first : int
        First sample that counts; the states before it are followed all the same.
    rows : (R, N) array
    running : (N+1, R) array
        Running sums of the rows, from 0; those of one sample lie together.

    Returns
    -------
    (P, R+1) array
    """
    out = np.zeros((kappa.size, rows.shape[0] + 1))
    add_products(kappa, rho, curve_of(n, bool(np.any(rho < 0))), strokes, np.uint64(first), rows, running, out)
    return out


@kernel
def add_products(kappas, rhos, curve, strokes, first, rows, running, out):
    """Add the sums for every shape to a row of `out`; arguments as `batch_products`."""
    buffer, block, cuts = np.empty(512), _BLOCK, np.empty(strokes.lengths.size, CUT)
    n, cells, distance, begin = curve.n, curve.cells, strokes.distance, strokes.begin
    for s in range(kappas.size):
        kappa, rho, sums = kappas[s], rhos[s], out[s]
        cut(kappa, rho, curve, strokes, 0.0, cuts)
        for k in range(cuts.size):
            stroke, a, b = cuts[k], max(begin[k], first), max(begin[k + 1], first)
            full = min(max(stroke.full, a), b)
            for i in range(a, full, block):
                end = min(i + block, full)
                fill(kappa, rho, n, cells, stroke, distance, i, end, buffer, i)
                _add(buffer, rows, i, end, sums)
            if full < b:
                for row in range(rows.shape[0]):
                    sums[row] += stroke.sign * (running[b, row] - running[full, row])
                sums[rows.shape[0]] += b - full


@inner_sum
def _add(states, rows, a, b, sums):
    size, count = b - a, rows.shape[0]
    row = 0
    while row + 1 < count:  # two rows at a time: each state is loaded half as often
        one, other = 0.0, 0.0
        for i in range(size):
            z = states[i]
            one += z * rows[row, a + i]
            other += z * rows[row + 1, a + i]
        sums[row] += one
        sums[row + 1] += other
        row += 2
    if row < count:
        one = 0.0
        for i in range(size):
            one += states[i] * rows[row, a + i]
        sums[row] += one
    one = 0.0
    for i in range(size):
        one += states[i] * states[i]
    sums[count] += one


@inner_sum
def dot(a, b, start, end):
    """Sum of products of two rows, from a start on."""
    total = 0.0
    for i in range(start, np.uint64(end)):
        total += a[i] * b[i]
    return total
