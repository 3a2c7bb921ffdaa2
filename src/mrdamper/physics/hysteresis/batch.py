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
from mrdamper.physics.hysteresis.response import on_curve
from mrdamper.physics.hysteresis.shape import Shape
from mrdamper.physics.motion.path import Path
from mrdamper.statistics.linear import FixedColumns

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
