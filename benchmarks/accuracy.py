"""Largest error of the state compared with a calculation of 25 digits, along a motion with reversals of every size."""

from __future__ import annotations

import importlib.util

import numpy as np

from mrdamper.physics.hysteresis import Shape, follow
from mrdamper.physics.motion import Path

PLACES = np.array([0.0, 3e-4, 2e-3, 1.1e-3, 1.4e-3, -4e-3, 2e-2, 1.9e-2, -2e-2, 5e-3])  # turning points [m]
KAPPA = 632.0


def largest_errors() -> dict[str, float | None]:
    """Of closed forms (n = 1, 2) and of tables (other n); None without mpmath."""
    if importlib.util.find_spec("mpmath") is None:
        return {"closed": None, "tables": None}
    found = {"closed": 0.0, "tables": 0.0}
    for n in (1.0, 2.0, 1.5, 3.0):
        for rho in (-0.6, 0.0, 0.5):
            truth = _exact(n, rho)
            path = Path.of(PLACES, peaks="samples")
            shape = Shape(KAPPA, rho, n)
            error = float(np.abs(follow(shape, path) - truth).max())
            kind = "closed" if n in (1.0, 2.0) else "tables"
            found[kind] = max(found[kind], error)
    return dict(found)


def _exact(n: float, rho: float) -> np.ndarray:
    """States at the turning points: the distance is a hypergeometric function of the state, solved for it."""
    import mpmath as mp

    with mp.workdps(25):
        power = mp.mpf(n)

        def distance(y: mp.mpf, q: mp.mpf) -> mp.mpf:
            """∫_0^y dt/(1 − q t^n)."""
            return y * mp.hyp2f1(1, 1 / power, 1 + 1 / power, q * y**power)

        w, states = mp.mpf(0), [mp.mpf(0)]
        direction = 1
        for move in np.diff(PLACES):
            sign = 1 if move > 0 else -1
            w = w if sign == direction else -w
            direction = sign
            phi = mp.mpf(KAPPA) * abs(mp.mpf(float(move)))
            w = _stroke(mp, distance, w, phi, mp.mpf(rho))
            states.append(sign * w)
        return np.array([float(s) for s in states])


def _stroke(mp, distance, w, phi, rho):
    if w < 0:
        to_zero = distance(-w, rho)
        if phi < to_zero:
            return -_inverse(mp, lambda y: distance(y, rho), to_zero - phi, -w)
        return _inverse(mp, lambda y: distance(y, mp.mpf(1)), phi - to_zero, mp.mpf(1))
    return _inverse(mp, lambda y: distance(y, mp.mpf(1)), distance(w, mp.mpf(1)) + phi, mp.mpf(1))


def _inverse(mp, function, value, highest):
    """Place below `highest` at which an increasing function takes a value, by bisection."""
    low, high = mp.mpf(0), highest
    for _ in range(75):
        middle = (low + high) / 2
        if function(middle) < value:
            low = middle
        else:
            high = middle
    return (low + high) / 2
