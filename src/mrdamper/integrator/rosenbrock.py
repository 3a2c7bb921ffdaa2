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
_compile = njit(cache=True, error_model="numpy")


@lru_cache
def compiled(rate: Callable[..., None]) -> Any:
    """The rate in machine code; kept on disk for the package's own, whose place does not change."""
    ours = rate.__module__.startswith("mrdamper.")
    return njit("void(f8, f8, f8, f8[::1], f8[::1], f8[::1])", cache=ours, error_model="numpy")(rate)


@_compile
def _cubic(piece, width, x0, x1, v0, v1):
    """Coefficients of the displacement between two samples, as velocities."""
    mean = (x1 - x0) / width
    piece[0], piece[1] = x0, v0
    piece[2], piece[3] = 3 * mean - 2 * v0 - v1, v0 + v1 - 2 * mean


@_compile
def _rate_at(rate, p, piece, width, t, y, out):
    s = t / width
    x = piece[0] + width * s * (piece[1] + s * (piece[2] + s * piece[3]))
    v = piece[1] + s * (2 * piece[2] + 3 * s * piece[3])
    rate(x, v, piece[4] + s * piece[5], y, p, out)


@_compile
def _step(rate, p, piece, width, t, h, y, scale, tolerance, new, work):
    """One step from y at time t into `new`; returns its error over the tolerance."""
    size = y.size
    k, f, slope, here, moved = work[:4], work[4], work[5], work[6], work[7]
    jacobian, matrix = work[8 : 8 + size], work[8 + size :]
    _rate_at(rate, p, piece, width, t, y, f)
    # Derivatives by differences: small errors in them cost Rodas3 accuracy, not stability.
    for j in range(size):
        here[:] = y
        nudge = 1e-7 * max(abs(y[j]), scale[j])
        here[j] += nudge
        _rate_at(rate, p, piece, width, t, here, moved)
        jacobian[:, j] = (moved - f) / nudge
    _rate_at(rate, p, piece, width, t + 1e-5 * h, y, moved)
    slope[:] = (moved - f) / 1e-5  # times h
    k[0] = f + 0.5 * slope
    _solve(jacobian, h, k[0], matrix)
    k[1] = f + 4 / h * k[0] + 1.5 * slope
    _solve(jacobian, h, k[1], matrix)
    here[:] = y + 2 * k[0]
    _rate_at(rate, p, piece, width, t + h, here, f)
    k[2] = f + (k[0] - k[1]) / h
    _solve(jacobian, h, k[2], matrix)
    here += k[2]
    _rate_at(rate, p, piece, width, t + h, here, f)
    k[3] = f + (k[0] - k[1] - 8 / 3 * k[2]) / h
    _solve(jacobian, h, k[3], matrix)
    new[:] = here + k[3]
    worst = 0.0
    for j in range(size):
        size_of = max(abs(y[j]), scale[j])
        error = abs(k[3, j]) / (tolerance * size_of)
        # A step may not change a state by more than itself: the method would else hop over a pole.
        error = max(error, abs(new[j] - y[j]) / size_of)
        if not error <= worst:  # catches NaN too
            worst = error
    return worst


@_compile
def _solve(jacobian, h, right, matrix):
    """Solve (2/h − J) k = right in place, by elimination with row exchange."""
    size = right.size
    for m in range(size):
        for j in range(size):
            matrix[m, j] = -jacobian[m, j]
        matrix[m, m] += 2 / h
    for m in range(size):
        top = m
        for r in range(m + 1, size):
            if abs(matrix[r, m]) > abs(matrix[top, m]):
                top = r
        if top != m:
            for j in range(size):
                matrix[m, j], matrix[top, j] = matrix[top, j], matrix[m, j]
            right[m], right[top] = right[top], right[m]
        for r in range(m + 1, size):
            factor = matrix[r, m] / matrix[m, m]
            for j in range(m, size):
                matrix[r, j] -= factor * matrix[m, j]
            right[r] -= factor * right[m]
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
    work = np.empty((8 + 2 * size, size))
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
            worst = _step(rate, p, piece, width, done, h, y, scale, tolerance, new, work)
            if worst <= 1.0:
                done += h
                y[:] = new
                for j in range(size):
                    if not abs(y[j]) <= RUNAWAY * scale[j]:
                        return RAN_AWAY, i + 1
            step = h * (0.1 if not worst < 1e9 else min(5.0, max(0.1, 0.9 / max(worst, 1e-6) ** (1 / 3))))
        out[i + 1] = y
    return DONE, 0
