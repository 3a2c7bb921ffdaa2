"""Levenberg–Marquardt of many problems of one kind at once, such as fits without each fold.

The problems are independent: each has its own damping, steps and end, as in `levenberg_marquardt`. What they share is
every operation of NumPy, whose overhead is larger than the arithmetic of one small problem.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mrdamper.statistics.linear import Floats, inverse_of_gram, solve_linear

_FIRST_DAMPING, _STIFFEST = 1e-3, 1e12
_WORTHLESS = 1e-3  # share of the tolerated gain below which a step is not tried
_CURVED = 1e-7  # difference of gradients, relative to the width of the box
_NEIGHBOURHOOD = 2e-2  # of the box: largest distance of a minimum from the end of a search
_STEP_TOLERANCE = 1e-13  # of the box: the end
_ROUNDING_STEP = 1e-10  # of the box: steps that rounding may prevent from decreasing
_FLAT_CURVATURE = 1e-12  # share of the largest curvature
_POLISHING = 25  # steps
_RANK_LIMIT = 1e-10  # singular value over the largest below which a coefficient is not determined

Rows = NDArray[np.intp]  # indices of some of the problems


# Of the problems at some indices (B,), each at its point (B, D): sums of squared residuals (B,), and a function of
# marks (B,) that gives Jᵀr (M, D) and JᵀJ (M, D, D) of the marked ones, of residuals r and their derivatives J
Products = Callable[[NDArray[np.bool_]], tuple[Floats, Floats]]
Evaluate = Callable[[Rows, Floats], tuple[Floats, Products]]


def least_squares_of_each(
    evaluate: Evaluate, rows: Rows, start: Floats, lower: Floats, upper: Floats, most_steps: int, tolerance: float
) -> Floats:
    """Minimise each of B problems inside its box as `least_squares` with `curved`; (B, D) each, and the minima."""
    count, size = start.shape
    point = np.minimum(np.maximum(start, lower), upper)
    before_point, before_gradient, gradient = np.zeros((3, count, size))
    normal, extra = np.zeros((2, count, size, size))
    damping, steps, at_fresh = np.full(count, _FIRST_DAMPING), np.zeros(count, dtype=int), np.ones(count, dtype=bool)
    cost, products = evaluate(rows, point)
    active = fresh = np.flatnonzero(at_fresh)
    while active.size:
        if fresh.size:
            gradient[fresh], normal[fresh] = products(at_fresh)
            moved = fresh[steps[fresh] > 0]
            change = gradient[moved] - before_gradient[moved]
            extra[moved] = _learnt_curvature(extra[moved], point[moved] - before_point[moved], change, normal[moved])
        at, slope = point[active], gradient[active]
        held = ((at <= lower[active]) & (slope > 0)) | ((at >= upper[active]) & (slope < 0))
        free = ~held & (normal[active].diagonal(0, 1, 2) > 0)
        step, promised = _damped_steps(normal[active], extra[active], slope, free, damping[active])
        going = free.any(axis=1) & (promised > _WORTHLESS * tolerance * cost[active])
        active, at, step = active[going], at[going], step[going]
        if not active.size:
            break
        trial = np.minimum(np.maximum(at + step, lower[active]), upper[active])
        reached, products = evaluate(rows[active], trial)
        gain = cost[active] - reached
        accepted = gain > 0
        better = active[accepted]
        damping[active] = np.where(accepted, np.maximum(damping[active] / 10, 1e-12), damping[active] * 10)
        before_point[better], before_gradient[better] = point[better], gradient[better]
        point[better], cost[better] = trial[accepted], reached[accepted]
        steps[better] += 1
        width = upper[active] - lower[active]
        settled = (gain <= tolerance * cost[active]) | (np.max(np.abs(trial - at) / width, axis=1) < tolerance)
        ended = np.where(accepted, settled | (steps[active] >= most_steps), damping[active] >= _STIFFEST)
        at_fresh = accepted & ~ended
        fresh, active = active[at_fresh], active[~ended]
    return point


def newton_refine_each(evaluate: Evaluate, start: Floats, lower: Floats, upper: Floats) -> Floats:
    """Refine the minimum of every problem to the last digits as `newton_refine`; (B, D) each."""
    rows, size = np.arange(len(start)), start.shape[1]

    def gradient(points: Floats) -> Floats:
        return evaluate(rows, points)[1](np.ones(len(rows), dtype=bool))[0]

    width = upper - lower
    slope = here = gradient(start)
    shares = np.where(start + _CURVED * width > upper, -_CURVED, _CURVED)
    curvature = np.empty((len(start), size, size))
    for i in range(size):
        step = np.zeros(start.shape)
        step[:, i] = (shares * width)[:, i]
        moved = (gradient(start + step) - here)[:, : i + 1] * width[:, : i + 1] / shares[:, i : i + 1]
        curvature[:, i, : i + 1] = curvature[:, : i + 1, i] = moved
    diagonal = curvature.diagonal(0, 1, 2)
    free = (start > lower) & (start < upper) & (diagonal != 0)  # a coordinate without an effect stays as it is
    diagonal = np.where(free, diagonal, 0.0)
    curvature = np.where(free[:, :, None] & free[:, None, :], curvature, 0.0)
    mean = np.sum(diagonal, axis=1) / np.maximum(free.sum(axis=1), 1)  # between the eigenvalues of the others
    curvature += np.where(free, 0.0, mean[:, None])[:, :, None] * np.eye(size)
    values = np.linalg.eigvalsh(curvature)
    able = free.any(axis=1) & (values[:, 0] > _FLAT_CURVATURE * values[:, -1])
    curvature[~able] = np.eye(size)
    refined, last = start.copy(), np.full(len(start), np.inf)
    active = able.copy()
    for _ in range(_POLISHING):
        step = -np.linalg.solve(curvature, np.where(free, slope * width, 0.0)[:, :, None])[:, :, 0]
        last[active] = np.max(np.abs(step), axis=1)[active]
        active &= last >= _STEP_TOLERANCE
        if not active.any():
            break
        refined[active] = np.clip(refined + step * width, lower, upper)[active]
        near = np.max(np.abs(refined - start) / width, axis=1) <= _NEIGHBOURHOOD
        active, able = active & near, able & near
        slope = gradient(refined)
    return np.where((able & (last < _ROUNDING_STEP))[:, None], refined, start)


def solve_each(columns: Floats, right: Floats) -> Floats:
    """(B, L, D) coefficients of B problems of least squares, from (B, N, L) columns and (B, N, D) right sides.

    A column that is zero in some of the problems has a coefficient of zero there.
    """
    turned = columns.transpose(0, 2, 1)
    gram: Floats = turned @ columns
    diagonal = np.einsum("bii->bi", gram)
    diagonal[diagonal == 0] = 1.0
    if (inverse := inverse_of_gram(gram)) is None:
        each = [[solve_linear(c, side, _RANK_LIMIT) for side in r.T] for c, r in zip(columns, right, strict=True)]
        return np.array(each).transpose(0, 2, 1)
    solution = inverse @ (turned @ right)
    return solution + inverse @ (turned @ (right - columns @ solution))


def _damped_steps(
    normal: Floats, extra: Floats, gradient: Floats, free: NDArray[np.bool_], damping: Floats
) -> tuple[Floats, Floats]:
    """(B, D) steps of the free coordinates, and (B,) their predicted gains."""
    unit = np.eye(gradient.shape[1])
    pairs = free[:, :, None] & free[:, None, :]
    slope, normal, extra = np.where(free, gradient, 0.0), np.where(pairs, normal, 0.0), np.where(pairs, extra, 0.0)
    stiff = (damping[:, None] * np.maximum(normal.diagonal(0, 1, 2), 1e-300) + ~free)[:, :, None] * unit
    whole = normal + extra
    positive = np.linalg.eigvalsh(whole + stiff)[:, 0] > 0
    normal = np.where(positive[:, None, None], whole, normal)
    step = -np.linalg.solve(normal + stiff, slope[:, :, None])
    promised = -((2 * slope[:, None, :] + step.transpose(0, 2, 1) @ normal) @ step)
    return np.asarray(step[:, :, 0], dtype=float), promised[:, 0, 0]


def _learnt_curvature(extra: Floats, moved: Floats, change: Floats, normal: Floats) -> Floats:
    """Update the contributions of the second derivatives of the residuals; zero where they are not known."""
    along = np.sum(change * moved, axis=1)
    missing = change - (normal @ moved[:, :, None])[:, :, 0]
    sizes = np.linalg.norm(change, axis=1) * np.linalg.norm(moved, axis=1)
    usable = along > 1e-12 * sizes
    along = np.where(usable, along, 1.0)
    curvature = np.sum((extra @ moved[:, :, None])[:, :, 0] * moved, axis=1)
    share = np.abs(np.sum(moved * missing, axis=1) / np.where(curvature == 0, 1.0, curvature))
    shrunk = extra * np.where(curvature == 0, 1.0, np.minimum(1.0, share))[:, None, None]
    off = missing - (shrunk @ moved[:, :, None])[:, :, 0]
    pair = off[:, :, None] * change[:, None, :] / along[:, None, None]
    square = change[:, :, None] * change[:, None, :]
    weight = (np.sum(off * moved, axis=1) / along**2)[:, None, None]
    return np.where(usable[:, None, None], shrunk + pair + pair.transpose(0, 2, 1) - weight * square, 0.0)
