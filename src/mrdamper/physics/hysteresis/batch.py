"""Least squares with a hysteretic column, for many shapes at once.

A force that is linear in everything but the shape of the hysteresis, F = columns · p + a zeta, needs only a few sums
for each shape in a search: zeta times every column, zeta times zeta. `products` computes the sums with columns that are
factored once (`FixedColumns`); costs follow from them without the samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mrdamper.data import Floats
from mrdamper.physics.hysteresis.master_curve import master_curve
from mrdamper.physics.hysteresis.response import advance, on_curve, state_at
from mrdamper.physics.hysteresis.shape import Shape
from mrdamper.physics.motion.path import Path
from mrdamper.statistics.linear import FixedColumns

_BLOCK = 20_000  # samples whose states are computed at a time
_MAX_STATES = 2**17  # states held at a time


@dataclass(frozen=True, eq=False)
class Products:
    """Sums over the samples for P shapes."""

    along: Floats  # (P, L) zeta · basis
    force: Floats  # (P,) zeta · rest of the force [N]
    square: Floats  # (P,) zeta · zeta


def batch_cost(path: Path, fixed: FixedColumns, shapes: Shape) -> Floats:
    """(P,) sums of squared force errors [N²] of P shapes, by their best coefficients, that of zeta not below zero.

    No array of shapes × samples is kept. The columns are those of the last M samples of the path; earlier samples only
    determine the state.
    """
    sums = products(path, fixed, shapes)
    left = sums.square - np.sum(sums.along**2, axis=1)  # squared zeta that no column explains
    gain = np.maximum(sums.force, 0.0) ** 2 / np.maximum(left, 1e-12 * sums.square + np.finfo(float).tiny)
    return fixed.rest_squared - gain


def products(path: Path, fixed: FixedColumns, shapes: Shape) -> Products:
    """Calculate sums of zeta times each column, the rest of the force and itself; arguments as `batch_cost`."""
    kappa, rho = (np.array(a, dtype=float) for a in np.broadcast_arrays(shapes.kappa, shapes.rho))
    first = len(path) - fixed.rest.size
    sums = np.empty((kappa.size, fixed.basis.shape[1] + 2))
    for value in dict.fromkeys(rho.tolist()):
        alike = np.flatnonzero(rho == value)
        few = max(1, _MAX_STATES // len(path))
        for part in (alike[i : i + few] for i in range(0, alike.size, few)):
            zeta = follow_alike(shapes.n, value, kappa[part], path)[:, first:]
            sums[part, :-2] = zeta @ fixed.basis
            sums[part, -2] = zeta @ fixed.rest
            sums[part, -1] = np.einsum("pn,pn->p", zeta, zeta)
    return Products(sums[:, :-2], sums[:, -2], sums[:, -1])


def follow_with_slope(kappa: float, rho: float, n: float, path: Path, part: slice) -> tuple[Floats, Floats]:
    """States as `follow_one`, and their derivative with respect to ln kappa.

    Along a stroke the state is a function of kappa times the distance, shifted by where the stroke
    began; so its derivative is the rate there times that distance and the derivative of the shift.
    """
    curve = master_curve(n)
    w, slope = 0.0, 0.0
    starts, shifts = [0.0], [0.0]
    full = (curve.release_distance(1.0, rho, math) + curve.full) / kappa
    for length in path.lengths:
        if w == -1.0 and length >= full:
            slope = 0.0
        else:
            end = advance(curve, rho, w, kappa * length)
            slope = -_rate(end, rho, n) * (kappa * length + shifts[-1])
            w = -end
        starts.append(w)
        shifts.append(slope / _rate(w, rho, n) if slope else 0.0)
    strokes, distances, directions = path.stroke[part], path.distance[part], path.direction[part]
    first, later = np.array(starts), np.array(shifts)
    states, slopes = np.empty((2, distances.size))
    for begin in range(0, distances.size, _BLOCK):  # of which all arrays stay in the processor's cache
        rows = slice(begin, begin + _BLOCK)
        stroke, phi, direction = strokes[rows], kappa * distances[rows], directions[rows]
        state = state_at(curve, rho, first, stroke, phi)
        size = np.abs(state)
        rate = 1.0 - (size if n == 1 else size * size if n == 2 else size**n)
        if rho != 1.0:
            before = np.flatnonzero(state < 0)
            rate[before] = (1.0 - rho) + rho * rate[before]
        states[rows], slopes[rows] = direction * state, direction * (rate * (phi + later[stroke]))
    return states, slopes


def _rate(w: float, rho: float, n: float) -> float:
    return 1.0 - w**n if w >= 0 else 1.0 - rho * (-w) ** n


def follow_alike(n: float, rho: float, kappa: Floats, path: Path) -> Floats:
    """(P, N) states from zero for P shapes that differ in kappa only, all at once."""
    curve = master_curve(n)
    starts = _starts(n, rho, kappa, path)
    to_zero = np.where(starts < 0, curve.release_distance(np.maximum(-starts, 0.0), rho, np), 0.0)
    phi = np.multiply.outer(kappa, path.distance)
    past = (phi - to_zero[:, path.stroke]).ravel()
    w = on_curve(curve, rho, past).reshape(phi.shape)
    if (starts > 0).any():
        ahead = np.maximum(starts, 0.0)[:, path.stroke]
        w = np.where(ahead > 0, curve.climb(ahead.ravel(), phi.ravel(), np).reshape(phi.shape), w)
    w *= path.direction
    return w


def _starts(n: float, rho: float, kappa: Floats, path: Path) -> Floats:
    """(P, K) state in the direction of motion at the beginning of each stroke."""
    curve = master_curve(n)
    starts = np.full((kappa.size, len(path.lengths) + 1), -1.0)
    starts[:, 0] = 0.0
    lengths = np.array(path.lengths)
    if not lengths.size:
        return starts
    # Shapes that saturate in every stroke need no recursion.
    full = curve.release_distance(1.0, rho, math) + curve.full
    stepped = np.flatnonzero(kappa * lengths.min() < full)
    kappa, w = kappa[stepped], np.zeros(stepped.size)
    for k, length in enumerate(path.lengths if stepped.size else (), 1):
        past = kappa * length - curve.release_distance(np.maximum(-w, 0.0), rho, np)
        end = curve.climb(np.maximum(w, 0.0), np.maximum(past, 0.0), np)
        turned = past < 0
        if turned.any():
            end[turned] = -curve.release(-past[turned], rho, np)
        w = starts[stepped, k] = -end
    return starts
