"""The Bouc–Wen equation by RK4 at the sample step, as it is usually written and compiled."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def rate(z: float, v: float, A: float, beta: float, gamma: float, n: float) -> float:
    return A * v - beta * abs(v) * abs(z) ** (n - 1) * z - gamma * v * abs(z) ** n


@njit(cache=True)
def rk4(v: np.ndarray, dt: float, A: float, beta: float, gamma: float, n: float) -> np.ndarray:
    out = np.empty(v.size)
    z = 0.0
    for i in range(v.size):
        out[i] = z
        if i + 1 < v.size:
            middle = 0.5 * (v[i] + v[i + 1])
            k1 = rate(z, v[i], A, beta, gamma, n)
            k2 = rate(z + 0.5 * dt * k1, middle, A, beta, gamma, n)
            k3 = rate(z + 0.5 * dt * k2, middle, A, beta, gamma, n)
            k4 = rate(z + dt * k3, v[i + 1], A, beta, gamma, n)
            z += dt * (k1 + 2 * k2 + 2 * k3 + k4) / 6
    return out
