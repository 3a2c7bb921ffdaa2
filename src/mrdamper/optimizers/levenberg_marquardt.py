"""Bounded Levenberg–Marquardt for one to a few coordinates.

scipy.optimize would do; importing it costs half a second, more than identifying a whole
test matrix, so the few lines that are needed stand here (docs/decisions/0003).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrdamper.data import Floats

_STEP = 1e-6  # forward difference, relative to the width of the box
_STIFFEST = 1e12  # damping at which no step is left to try


@dataclass(frozen=True)
class Minimum:
    """Where a least-squares search ended.

    Attributes
    ----------
    point : (D,) array
    residual : (N,) array
    cost : float
        Sum of squared residuals.
    evaluations : int
    message : str
        Why it stopped.
    """

    point: Floats
    residual: Floats
    cost: float
    evaluations: int
    message: str


def least_squares(
    residual: Callable[[Floats], Floats],
    start: Floats,
    lower: Floats,
    upper: Floats,
    most_steps: int = 40,
    tolerance: float = 1e-9,
) -> Minimum:
    """Minimise |residual(point)|² inside a box, until a step gains less than `tolerance` of it.

    Coordinates at a bound whose gradient points outwards are held there for the step.
    """
    width = upper - lower
    point = np.clip(start, lower, upper)
    r = residual(point)
    cost, evaluations, damping = float(r @ r), 1, 1e-3
    message = f"stopped after {most_steps} steps; the cost was still falling: start nearer or raise most_steps"
    for _ in range(most_steps):
        jacobian = _forward_differences(residual, point, r, upper, width)
        evaluations += point.size
        gradient = jacobian.T @ r
        free = ~(((point <= lower) & (gradient > 0)) | ((point >= upper) & (gradient < 0)))
        if not free.any():
            message = "every coordinate ended at a bound"
            break
        better = None
        while better is None and damping < _STIFFEST:
            trial = np.clip(point + _damped_step(jacobian, gradient, free, damping), lower, upper)
            r_trial = residual(trial)
            evaluations += 1
            if float(r_trial @ r_trial) < cost:
                better, damping = (trial, r_trial), max(damping / 10, 1e-12)
            else:
                damping *= 10
        if better is None:
            message = "converged: no step lowers the cost"
            break
        moved = float(np.max(np.abs(better[0] - point) / width))
        before, (point, r) = cost, better
        cost = float(r @ r)
        if before - cost <= tolerance * cost or moved < tolerance:
            message = "converged: the cost changes no more"
            break
    return Minimum(point, r, cost, evaluations, message)


def _forward_differences(
    residual: Callable[[Floats], Floats], point: Floats, r: Floats, upper: Floats, width: Floats
) -> Floats:
    steps = np.where(point + _STEP * width > upper, -_STEP, _STEP) * width
    return np.column_stack([(residual(point + s) - r) / d for s, d in zip(np.diag(steps), steps, strict=True)])


def _damped_step(jacobian: Floats, gradient: Floats, free: NDArray[np.bool_], damping: float) -> Floats:
    normal = jacobian[:, free].T @ jacobian[:, free]
    stiff = np.diag(np.maximum(np.diag(normal), 1e-300))
    step = np.zeros(gradient.size)
    step[free] = -np.linalg.solve(normal + damping * stiff, gradient[free])
    return step
