"""Least squares in a single parameter whose derivative is known.

One evaluation per step and no matrix, for thousands of searches. The curvature follows from the change of the gradient
(secant), at the first step from the Jacobian; a bracket of gradients of both signs limits the steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mrdamper.statistics.levenberg_marquardt import Minimum
from mrdamper.statistics.linear import Floats
from mrdamper.statistics.stop_reason import StopReason

_MOST_STEPS = 40
_TOLERANCE = 1e-9  # predicted relative gain of the last step

Evaluation = tuple[Floats, Floats]  # residual, its derivative


def least_squares_in_one(
    evaluate: Callable[[float], Evaluation | None], start: float, lower: float, upper: float
) -> Minimum | None:
    """Minimise |residual(u)|² between two bounds, until the predicted gain of a step is negligible.

    `evaluate` gives the residual (N,) and its derivative at u; None where they are undefined, and then there is no
    minimum.
    """
    low, high = -math.inf, math.inf  # points with gradients of both signs about the minimum
    u, before, best, evaluations = start, None, None, 0
    ending = StopReason.STEPS_SPENT
    for _ in range(_MOST_STEPS):
        value = evaluate(u)
        evaluations += 1
        if value is None:
            return None
        residual, slope = value
        cost, gradient, curvature = (float(a @ b) for a, b in ((residual, residual), (slope, residual), (slope, slope)))
        if best is None or cost <= best[0]:
            best = cost, u, residual
        low, high = (u, high) if gradient < 0 else (low, u)
        if before is not None and (gradient - before[1]) * (u - before[0]) > 0:
            curvature = (gradient - before[1]) / (u - before[0])
        if (u <= lower and gradient > 0) or (u >= upper and gradient < 0):
            ending = StopReason.AT_BOUNDS
            break
        if gradient**2 <= _TOLERANCE * cost * curvature:
            ending = StopReason.SETTLED
            break
        target = min(max(u - gradient / curvature, lower), upper)
        if not low < target < high:
            target = (max(low, lower) + min(high, upper)) / 2
        before, u = (u, gradient), target
    if best is None:
        return None
    return Minimum(np.array([best[1]]), best[2], best[0], evaluations, ending)
