"""Rodas3 in machine code: four stages, order three, an error estimate of order two, L-stable.

Plain loops over small arrays, compiled once and kept on disk between sessions. Importing this
module imports the compiler; `integrate` does so when it is called.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit, types

MOST_STEPS = 20_000  # between two samples; a sound model takes a handful
SHORTEST = 1e-12  # step over sample interval at which the search for a step ends
RUNAWAY = 1e6  # state over its scale
DONE, TOO_STIFF, RAN_AWAY = 0, 1, 2

_vector = types.float64[::1]
_matrix = types.float64[:, ::1]
_rate = types.FunctionType(types.void(types.float64, types.float64, types.float64, _vector, _vector, _vector))
_inlined = njit(error_model="numpy", inline="always")  # a call with arrays costs more than a rate


@lru_cache
def compiled(rate: Callable[..., None]) -> Any:
    """The rate in machine code; kept on disk for the package's own, whose place does not change."""
    ours = rate.__module__.startswith("mrdamper.")
    return njit("void(f8, f8, f8, f8[::1], f8[::1], f8[::1])", cache=ours, error_model="numpy")(rate)


@_inlined
def _cubic(piece, width, x0, x1, v0, v1):
    """Coefficients of the displacement between two samples, as velocities."""
    mean = (x1 - x0) / width
    piece[0], piece[1] = x0, v0
    piece[2], piece[3] = 3 * mean - 2 * v0 - v1, v0 + v1 - 2 * mean


@_inlined
def _rate_at(rate, p, piece, width, t, y, out):
    s = t / width
    x = piece[0] + width * s * (piece[1] + s * (piece[2] + s * piece[3]))
    v = piece[1] + s * (2 * piece[2] + 3 * s * piece[3])
    rate(x, v, piece[4] + s * piece[5], y, p, out)


@_inlined
def _step(rate, p, piece, width, t, h, y, scale, tolerance, new, work, swapped):
    """One step from y at time t into `new`; returns its error over the tolerance.

    Element by element: an expression of arrays would make one for every step.
    """
    size = y.size
    f, slope, here, moved = work[0], work[1], work[2], work[3]
    k0, k1, k2, k3, matrix = work[4], work[5], work[6], work[7], work[8:]
    _rate_at(rate, p, piece, width, t, y, f)
    # Derivatives by differences: small errors in them cost Rodas3 accuracy, not stability.
    for j in range(size):
        here[:] = y
        nudge = 1e-7 * max(abs(y[j]), scale[j])
        here[j] += nudge
        _rate_at(rate, p, piece, width, t, here, moved)
        for m in range(size):
            matrix[m, j] = -((moved[m] - f[m]) / nudge)
        matrix[j, j] += 2 / h
    _factor(matrix, swapped)
    _rate_at(rate, p, piece, width, t + 1e-5 * h, y, moved)
    for j in range(size):
        slope[j] = (moved[j] - f[j]) / 1e-5  # times h
        k0[j] = f[j] + 0.5 * slope[j]
    _solve(matrix, swapped, k0)
    for j in range(size):
        k1[j] = f[j] + 4 / h * k0[j] + 1.5 * slope[j]
    _solve(matrix, swapped, k1)
    for j in range(size):
        here[j] = y[j] + 2 * k0[j]
    _rate_at(rate, p, piece, width, t + h, here, f)
    for j in range(size):
        k2[j] = f[j] + (k0[j] - k1[j]) / h
    _solve(matrix, swapped, k2)
    for j in range(size):
        here[j] += k2[j]
    _rate_at(rate, p, piece, width, t + h, here, f)
    for j in range(size):
        k3[j] = f[j] + (k0[j] - k1[j] - 8 / 3 * k2[j]) / h
    _solve(matrix, swapped, k3)
    worst = 0.0
    for j in range(size):
        new[j] = here[j] + k3[j]
        size_of = max(abs(y[j]), scale[j])
        error = abs(k3[j]) / (tolerance * size_of)
        # A step may not change a state by more than itself: the method would else hop over a pole.
        error = max(error, abs(new[j] - y[j]) / size_of)
        if not error <= worst:  # catches NaN too
            worst = error
    return worst


@_inlined
def _factor(matrix, swapped):
    """Eliminate below the diagonal in place, by exchange of rows; the factors stay where they made zeros."""
    size = swapped.size
    for m in range(size):
        top = m
        for r in range(m + 1, size):
            if abs(matrix[r, m]) > abs(matrix[top, m]):
                top = r
        swapped[m] = top
        for j in range(size if top != m else 0):
            matrix[m, j], matrix[top, j] = matrix[top, j], matrix[m, j]
        for r in range(m + 1, size):
            matrix[r, m] /= matrix[m, m]
            for j in range(m + 1, size):
                matrix[r, j] -= matrix[r, m] * matrix[m, j]


@_inlined
def _solve(matrix, swapped, right):
    """Solve (2/h − J) k = right in place, from its factors."""
    size = right.size
    for m in range(size):
        right[m], right[swapped[m]] = right[swapped[m]], right[m]
    for m in range(size):
        for r in range(m + 1, size):
            right[r] -= matrix[r, m] * right[m]
    for m in range(size - 1, -1, -1):
        for j in range(m + 1, size):
            right[m] -= matrix[m, j] * right[j]
        right[m] /= matrix[m, m]


@njit(
    types.UniTuple(types.int64, 2)(
        _rate, _vector, _vector, _vector, _vector, _vector, _vector, _vector, types.float64, _matrix
    ),
    cache=True,
    error_model="numpy",
)
def path(rate, p, time, x, v, current, start, scale, tolerance, out):
    """States at all samples into `out`; returns a status and the sample it was met at."""
    size = start.size
    y = start.copy()
    out[0] = y
    new = np.empty(size)
    work = np.empty((8 + size, size))
    swapped = np.empty(size, dtype=np.int64)
    piece = np.empty(6)
    step = time[1] - time[0] if time.size > 1 else 1.0
    for i in range(time.size - 1):
        width = time[i + 1] - time[i]
        _cubic(piece, width, x[i], x[i + 1], v[i], v[i + 1])
        piece[4], piece[5] = current[i], current[i + 1] - current[i]
        done, tries = 0.0, 0
        step = min(max(step, 1e-3 * width), width)
        while done < width * (1 - SHORTEST):
            tries += 1
            h = min(step, width - done)
            if tries > MOST_STEPS or h < SHORTEST * width * 1e-3:
                return TOO_STIFF, i + 1
            worst = _step(rate, p, piece, width, done, h, y, scale, tolerance, new, work, swapped)
            if worst <= 1.0:
                done += h
                y[:] = new
                for j in range(size):
                    if not abs(y[j]) <= RUNAWAY * scale[j]:
                        return RAN_AWAY, i + 1
            step = h * (0.1 if not worst < 1e9 else min(5.0, max(0.1, 0.9 / max(worst, 1e-6) ** (1 / 3))))
        out[i + 1] = y
    return DONE, 0
