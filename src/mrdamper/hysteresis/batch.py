"""Least squares with a hysteretic column, for many shapes at once.

A force that is linear in everything but the shape of the hysteresis, F = columns · p + a zeta,
costs a search only a few sums for each shape: zeta times every column, zeta times zeta. `Fixed`
holds what does not change from shape to shape; `products` takes the sums, in NumPy for
small work and in machine code for large; costs follow from them without touching a sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from mrdamper.data import Floats
from mrdamper.hysteresis.master_curve import master_curve
from mrdamper.hysteresis.response import _advance, _states, on_curve, starts_of_strokes
from mrdamper.hysteresis.shape import Shape
from mrdamper.motion import Path

# Shapes × samples from which machine code is worth it: over 1 s in NumPy, a fifth of that compiled, and 0.3 s
# to import the compiler; where nothing is kept on disk yet, compiling takes a few seconds once.
WORTH_COMPILING = 2e8
_AT_ONCE = 2**17  # states held at a time by the NumPy path


@dataclass(frozen=True, eq=False)
class Fixed:
    """What a search over shapes holds fixed: the motion, the columns and the measured force.

    Attributes
    ----------
    path : Path
        N samples.
    first : int
        First sample that counts; the ones before only set the state.
    basis : (M, L) array
        Orthonormal basis of the columns, M = N − first.
    triangle : (L, L) array
        columns = basis · triangle.
    along : (L,) array
        basisᵀ · force.
    rest : (M,) array
        Force less its projection on the columns [N].
    """

    path: Path
    first: int
    basis: Floats
    triangle: Floats
    along: Floats
    rest: Floats

    @classmethod
    def of(cls, path: Path, columns: Floats, force: Floats) -> Self:
        """Take (M, L) columns and an (M,) force at the last M samples of a path."""
        basis, triangle = np.linalg.qr(columns)
        along = basis.T @ force
        return cls(path, len(path) - force.size, basis, triangle, along, force - basis @ along)

    @cached_property
    def rest_squared(self) -> float:
        """Squared force that no column explains [N²]."""
        return float(self.rest @ self.rest)

    @cached_property
    def _rows(self) -> tuple[Floats, Floats]:
        """Rows for the compiled sums, whole path, and their running sums."""
        rows = np.zeros((self.basis.shape[1] + 1, len(self.path)))
        rows[:-1, self.first :], rows[-1, self.first :] = self.basis.T, self.rest
        running = np.zeros((rows.shape[1] + 1, rows.shape[0]))
        np.cumsum(rows.T, axis=0, out=running[1:])
        return rows, running


@dataclass(frozen=True, eq=False)
class Products:
    """Sums over the samples for P shapes.

    Attributes
    ----------
    along : (P, L) array
        zeta · basis.
    force : (P,) array
        zeta · rest of the force [N].
    square : (P,) array
        zeta · zeta.
    """

    along: Floats
    force: Floats
    square: Floats


def batch_cost(
    fixed: Fixed, shapes: Shape, coefficients: Floats | None = None, *, compiled: bool | None = None
) -> Floats:
    """Sum of squared force errors for many shapes; nothing of shapes × samples is kept.

    Parameters
    ----------
    fixed : Fixed
    shapes : Shape
        P of them.
    coefficients : (P, L+1) array, optional
        Coefficients of the columns and, last, of zeta [N]. Without them the best ones are taken:
        least squares, that of zeta not below zero.
    compiled : bool, optional
        Use machine code; default: if shapes × samples come to `WORTH_COMPILING`. It depends on the
        work alone, so that the same input gives the same bits whatever ran before.

    Returns
    -------
    (P,) array
        [N²]
    """
    sums = products(fixed, shapes, compiled=compiled)
    if coefficients is None:
        return projected_cost(fixed, sums)
    off = coefficients[:, :-1] @ fixed.triangle.T - fixed.along
    size = coefficients[:, -1]
    outside = size**2 * sums.square - 2 * size * sums.force
    return np.sum(off * (off + 2 * size[:, None] * sums.along), axis=1) + outside + fixed.rest_squared


def projected_cost(fixed: Fixed, sums: Products) -> Floats:
    """Cost of the best coefficients, that of zeta not below zero [N²]."""
    left = sums.square - np.sum(sums.along**2, axis=1)  # squared zeta that no column explains
    gain = np.maximum(sums.force, 0.0) ** 2 / np.maximum(left, 1e-12 * sums.square + np.finfo(float).tiny)
    return fixed.rest_squared - gain


def products(fixed: Fixed, shapes: Shape, *, compiled: bool | None = None) -> Products:
    """Sums of zeta times each column, the rest of the force and itself; arguments as `batch_cost`."""
    kappa, rho = (np.array(a, dtype=float) for a in np.broadcast_arrays(shapes.kappa, shapes.rho))
    if compiled or (compiled is None and kappa.size * len(fixed.path) >= WORTH_COMPILING):
        from mrdamper.hysteresis.compiled import Strokes
        from mrdamper.hysteresis.compiled_batch import batch_products

        sums = batch_products(kappa, rho, shapes.n, Strokes.of(fixed.path), fixed.first, *fixed._rows)
        return Products(sums[:, :-2], sums[:, -2], sums[:, -1])
    sums = np.empty((kappa.size, fixed.basis.shape[1] + 2))
    for value in dict.fromkeys(rho.tolist()):
        alike = np.flatnonzero(rho == value)
        few = max(1, _AT_ONCE // len(fixed.path))
        for part in (alike[i : i + few] for i in range(0, alike.size, few)):
            zeta = follow_alike(shapes.n, value, kappa[part], fixed.path)[:, fixed.first :]
            sums[part, :-2] = zeta @ fixed.basis
            sums[part, -2] = zeta @ fixed.rest
            sums[part, -1] = np.einsum("pn,pn->p", zeta, zeta)
    return Products(sums[:, :-2], sums[:, -2], sums[:, -1])


def follow_quickly(kappa: float, rho: float, n: float, path: Path, part: slice = slice(None)) -> Floats:
    """States of one shape at a part of the samples, from zero, nothing checked: for inner loops."""
    curve = master_curve(n)
    starts = starts_of_strokes(curve, kappa, rho, path, 0.0)
    return path.direction[part] * _states(curve, rho, np.array(starts), path.stroke[part], kappa * path.distance[part])


def follow_with_slope(kappa: float, rho: float, n: float, path: Path, part: slice) -> tuple[Floats, Floats]:
    """States as `follow_quickly`, and their derivative with respect to ln kappa.

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
            end = _advance(curve, rho, w, kappa * length)
            slope = -_rate(end, rho, n) * (kappa * length + shifts[-1])
            w = -end
        starts.append(w)
        shifts.append(slope / _rate(w, rho, n) if slope else 0.0)
    stroke, phi = path.stroke[part], kappa * path.distance[part]
    states = _states(curve, rho, np.array(starts), stroke, phi)
    size = np.abs(states)
    rate = 1.0 - (size if n == 1 else size * size if n == 2 else size**n)
    if rho != 1.0:
        before = np.flatnonzero(states < 0)
        rate[before] = (1.0 - rho) + rho * rate[before]
    direction = path.direction[part]
    return direction * states, direction * (rate * (phi + np.array(shifts)[stroke]))


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
    # Shapes that every stroke takes from saturation to saturation need no recursion.
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
