"""Bounded Levenberg–Marquardt for one to a few coordinates.

Importing scipy.optimize takes half a second, more than the identification of a test matrix (docs/decisions/0003).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrdamper.statistics.linear import Floats
from mrdamper.statistics.stop_reason import StopReason

_DIFFERENCE_STEP = 1e-6  # forward difference, relative to the width of the box
_STIFFEST = 1e12  # damping at which the search ends
_CURVED = 1e-7  # difference of gradients, relative to the width of the box
_NEIGHBOURHOOD = 2e-2  # of the box: largest distance of a minimum from the end of a search
_STEP_TOLERANCE = 1e-13  # of the box: the end
_ROUNDING_STEP = 1e-10  # of the box: steps that rounding may prevent from decreasing
_FLAT_CURVATURE = 1e-12  # share of the largest curvature
_POLISHING = 25  # steps
_WORTHLESS = 1e-3  # share of the tolerated gain below which a step is not tried
_EXCEEDED = 1.3  # gain over the predicted one, from which a step is lengthened
_LENGTHENINGS, _MAX_LENGTHENING = 2, 4.0  # of a step, and the factor of each


@dataclass(frozen=True)
class Minimum:
    """Minimum of a sum of squares."""

    point: Floats  # (D,)
    residual: Floats  # (N,)
    cost: float  # sum of squared residuals
    evaluations: int
    ending: StopReason


def least_squares(
    residual: Callable[[Floats], Floats],
    start: Floats,
    lower: Floats,
    upper: Floats,
    most_steps: int = 40,
    tolerance: float = 1e-9,
    *,
    slopes: Callable[[Floats], Floats] | None = None,
    products: Callable[[Floats], tuple[Floats, Floats]] | None = None,
    curved: bool = False,
    lengthened: bool = False,
) -> Minimum:
    """Minimise |residual(point)|² inside a box, until a step gains less than `tolerance` of it.

    Points and ends of the box are (D,), residuals (N,). Coordinates at a bound whose gradient points outwards are held
    there for the step. `slopes` gives the (N, D) derivatives J of the residual r at a point, or `products` Jᵀr and JᵀJ;
    without, they are forward differences.

    `curved`: estimate the curvature that the Jacobian omits from changes of the gradient. With large residuals,
    Gauss–Newton converges linearly, this method faster [Dennis, Gay and Welsch 1981, ACM Trans. Math. Software 7, 348].
    `lengthened`: lengthen a step that gains more than predicted, because the Jacobian overestimates the curvature of
    residuals with narrow peaks, and a step takes many more operations than a residual.
    """
    width = upper - lower
    point = _inside(start, lower, upper)
    r = residual(point)
    cost, evaluations, damping = float(r @ r), 1, 1e-3
    extra = before = None
    ending = StopReason.STEPS_SPENT
    for _ in range(most_steps):
        if products is None:
            jacobian = slopes(point) if slopes else forward_differences(residual, point, r, lower, upper)
            gradient, normal = jacobian.T @ r, jacobian.T @ jacobian
        else:
            gradient, normal = products(point)
        evaluations += point.size
        if curved and before is not None:
            extra = _learnt_curvature(extra, point - before[0], gradient - before[1], normal)
        held = ((point <= lower) & (gradient > 0)) | ((point >= upper) & (gradient < 0))
        free = ~held & (normal.diagonal() > 0)  # a coordinate without an effect has no step
        if not free.any():
            ending = StopReason.AT_BOUNDS
            break
        better = None
        while better is None and damping < _STIFFEST:
            step, promised = _damped_step(normal, extra, gradient, free, damping)
            if promised <= _WORTHLESS * tolerance * cost:
                break
            trial = _inside(point + step, lower, upper)
            r_trial = residual(trial)
            evaluations += 1
            gain = cost - float(r_trial @ r_trial)
            if gain > 0:
                better, damping = (trial, r_trial), max(damping / 10, 1e-12)
                if lengthened and gain > _EXCEEDED * promised:
                    better, tried = _lengthened(residual, point, step, better, cost, promised, lower, upper)
                    evaluations += tried
            else:
                damping *= 10
        if better is None:
            ending = StopReason.NO_STEP
            break
        moved = float((np.abs(better[0] - point) / width).max())
        before, costlier = (point, gradient), cost
        point, r = better
        cost = float(r @ r)
        if costlier - cost <= tolerance * cost or moved < tolerance:
            ending = StopReason.SETTLED
            break
    return Minimum(point, r, cost, evaluations, ending)


def _inside(point: Floats, lower: Floats, upper: Floats) -> Floats:
    """Clip a point to a box, in a third of the time of NumPy's function."""
    return np.minimum(np.maximum(point, lower), upper)


def _lengthened(
    residual: Callable[[Floats], Floats],
    point: Floats,
    step: Floats,
    reached: tuple[Floats, Floats],
    cost: float,
    promised: float,
    lower: Floats,
    upper: Floats,
) -> tuple[tuple[Floats, Floats], int]:
    """Lengthen a step to the minimum of the parabola through its gains: point, residual, evaluations."""
    length, gain, tried = 1.0, cost - float(reached[1] @ reached[1]), 0
    for tried in range(1, _LENGTHENINGS + 1):
        curvature = max((2 * length * promised - gain) / (length**2 * promised), 1e-3)
        length = float(np.clip(1 / curvature, 1.5 * length, _MAX_LENGTHENING * length))
        trial = _inside(point + length * step, lower, upper)
        r = residual(trial)
        further = cost - float(r @ r)
        if further <= gain:
            return reached, tried
        reached, gain = (trial, r), further
        if gain <= _EXCEEDED * length * promised:
            break
    return reached, tried


def newton_refine(
    gradient: Callable[[Floats], Floats],
    point: Floats,
    lower: Floats,
    upper: Floats,
    first: Callable[[Floats, int], Floats] | None = None,
) -> Floats:
    """Refine the minimum next to a point where a search has stopped, to the last digits.

    The cost determines its minimum to half of the digits only, and the end of a search by the cost depends on rounding.
    The gradient (D,) at a point (D,), without noise and without jumps, determines all of them: Newton steps on it, with
    the curvature by differences, end below 1e-13 of the box. If they do not converge nearby, at a bound or in a flat
    region, the point is kept. Where the gradient is costly, `first` calculates a number of its first components: half
    of the curvature, which is symmetric.
    """
    width = upper - lower
    free = (point > lower) & (point < upper)
    here = slope = gradient(point)
    # Steps that stay inside, in widths of the box.
    shares = np.where(point + _CURVED * width > upper, -_CURVED, _CURVED)
    curvature = np.empty((point.size, point.size))
    for i, step in enumerate(np.diag(shares * width)):
        moved = (gradient(point + step) if first is None else first(point + step, i + 1))[: i + 1]
        curvature[i, : i + 1] = curvature[: i + 1, i] = (moved - here[: i + 1]) * width[: i + 1] / shares[i]
    curvature = curvature[np.ix_(free, free)]
    if not free.any() or _is_plain(curvature):
        return point
    refined, moved = point, np.inf
    for _ in range(_POLISHING):
        step = np.zeros(point.size)
        step[free] = -np.linalg.solve(curvature, (slope * width)[free])
        moved = float(np.max(np.abs(step)))
        if moved < _STEP_TOLERANCE:
            break
        refined = np.clip(refined + step * width, lower, upper)
        if np.max(np.abs(refined - point) / width) > _NEIGHBOURHOOD:
            return point
        slope = gradient(refined)
    return refined if moved < _ROUNDING_STEP else point


def _is_plain(curvature: Floats) -> bool:
    """Tell if some direction is flat within rounding, or leads down."""
    values = np.linalg.eigvalsh(curvature)
    return not values[0] > _FLAT_CURVATURE * values[-1]


def forward_differences(
    residual: Callable[[Floats], Floats], point: Floats, r: Floats, lower: Floats, upper: Floats
) -> Floats:
    """(N, D) derivatives of a residual, which is r at the point, by steps that stay inside the box."""
    width = upper - lower
    steps = np.where(point + _DIFFERENCE_STEP * width > upper, -_DIFFERENCE_STEP, _DIFFERENCE_STEP) * width
    return np.column_stack([(residual(point + s) - r) / d for s, d in zip(np.diag(steps), steps, strict=True)])


def _damped_step(
    normal: Floats, extra: Floats | None, gradient: Floats, free: NDArray[np.bool_], damping: float
) -> tuple[Floats, float]:
    """Step of the free coordinates, and its predicted gain."""
    if not free.all():
        normal, extra = normal[free][:, free], None if extra is None else extra[free][:, free]
    stiff, slope = np.zeros(normal.shape), gradient[free]
    stiff.ravel()[:: len(normal) + 1] = damping * np.maximum(normal.diagonal(), 1e-300)
    if extra is not None:
        whole = normal + extra
        normal = whole if _is_positive(whole + stiff) else normal
    moved = -np.linalg.solve(normal + stiff, slope)
    step = np.zeros(gradient.size)
    step[free] = moved
    return step, -float((2 * slope + moved @ normal) @ moved)


def _is_positive(matrix: Floats) -> bool:
    if matrix.size == 1:
        return bool(matrix[0, 0] > 0)
    return bool(np.linalg.eigvalsh(matrix)[0] > 0)


def _learnt_curvature(extra: Floats | None, moved: Floats, change: Floats, normal: Floats) -> Floats | None:
    """Update the contribution of the second derivatives of the residual to the normal matrix."""
    along = float(change @ moved)
    missing = change - normal @ moved
    if not along > 1e-12 * float(np.linalg.norm(change) * np.linalg.norm(moved)):
        return None
    if extra is None:
        extra = np.zeros((moved.size, moved.size))
    curvature = float(moved @ extra @ moved)
    shrunk = extra * min(1.0, abs(float(moved @ missing) / curvature)) if curvature else extra
    off = missing - shrunk @ moved
    pair = np.multiply.outer(off, change)
    return shrunk + (pair + pair.T) / along - float(off @ moved) / along**2 * np.multiply.outer(change, change)
