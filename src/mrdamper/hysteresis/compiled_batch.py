"""Fused sums over samples for many shapes: no array of shapes × samples is ever made.

Everything a least-squares search asks of a hysteretic state beside fixed columns are its
products with those columns and with itself. A block of states is made, multiplied into the
sums and forgotten. Where the state is saturated, nothing is evaluated at all: running sums of
the columns, made once, give the products. Importing this module imports numba.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mrdamper.data import Floats
from mrdamper.hysteresis.compiled import Strokes, _compile, advance, climb, pieces, release, release_distance, tables

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
    _products(
        kappa,
        rho,
        n,
        *tables(n),
        strokes.distance,
        strokes.begin,
        strokes.lengths,
        strokes.first_direction,
        np.uint64(first),
        rows,
        running,
        out,
    )
    return out


@_compile
def _products(
    kappas,
    rhos,
    n,
    rising,
    rising_distance,
    growing,
    growing_distance,
    distance,
    begin,
    lengths,
    first_direction,
    first,
    rows,
    running,
    out,
):
    buffer, block = np.empty(512), _BLOCK
    for s in range(kappas.size):
        kappa, rho, sums = kappas[s], rhos[s], out[s]
        w, sign = 0.0, first_direction
        for k in range(begin.size - 1):
            to_zero = release_distance(w, rho, n, rising_distance, growing_distance)
            if begin[k + 1] > first:
                a, b = max(begin[k], first), begin[k + 1]
                zero, full = pieces(kappa, n, to_zero, distance, a, b)
                start = max(w, 0.0)
                for i in range(a, zero, block):
                    end = min(i + block, zero)
                    release(kappa, rho, n, rising, growing, to_zero, sign, distance, i, end, buffer, i)
                    _add(buffer, rows, i, end, sums)
                for i in range(zero, full, block):
                    end = min(i + block, full)
                    climb(kappa, n, rising, rising_distance, start, to_zero, sign, distance, i, end, buffer, i)
                    _add(buffer, rows, i, end, sums)
                if full < b:
                    for row in range(rows.shape[0]):
                        sums[row] += sign * (running[b, row] - running[full, row])
                    sums[rows.shape[0]] += b - full
            w = -advance(kappa, rho, n, rising, rising_distance, growing, growing_distance, w, to_zero, lengths[k])
            sign = -sign


# Sums may be taken in any order here, or they could not be taken in vector registers.
@njit(cache=True, error_model="numpy", nogil=True, fastmath={"reassoc", "nsz", "contract"})
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


@njit(cache=True, error_model="numpy", nogil=True, fastmath={"reassoc", "nsz", "contract"})
def _sum(a, b, start, end):
    """Sum of products of two rows, from a start on."""
    total = 0.0
    for i in range(start, np.uint64(end)):
        total += a[i] * b[i]
    return total
