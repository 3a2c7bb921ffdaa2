"""Bounded Levenberg–Marquardt for one to a few coordinates.

scipy.optimize would do; importing it costs half a second, more than identifying a whole
test matrix, so the thirty lines that are needed stand here (docs/decisions/0003).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mrdamper.data import Floats

_STEP = 1e-6  # forward difference, relative to the width of the box
_TOLERANCE = 1e-9


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
    residual: Callable[[Floats], Floats], start: Floats, lower: Floats, upper: Floats, most_steps: int = 40
) -> Minimum:
    """Minimise |residual(point)|² inside a box.

    Coordinates at a bound whose gradient points outwards are held there for the step.
    """
    width = upper - lower
    point = np.clip(start, lower, upper)
    r = residual(point)
    cost, evaluations, damping = float(r @ r), 1, 1e-3
    message = f"stopped after {most_steps} steps; the cost was still falling: start nearer or raise most_steps"
    for _ in range(most_steps):
        sign = np.where(point + _STEP * width > upper, -1.0, 1.0)
        steps = sign * _STEP * width
        jacobian = np.column_stack([(residual(point + s) - r) / d for s, d in zip(np.diag(steps), steps, strict=True)])
        evaluations += point.size
        gradient = jacobian.T @ r
        free = ~(((point <= lower) & (gradient > 0)) | ((point >= upper) & (gradient < 0)))
        if not free.any():
            message = "every coordinate ended at a bound"
            break
        normal = jacobian[:, free].T @ jacobian[:, free]
        accepted = False
        while damping < 1e12 and not accepted:
            move = np.zeros_like(point)
            diagonal = np.diag(np.maximum(np.diag(normal), 1e-300))
            move[free] = -np.linalg.solve(normal + damping * diagonal, gradient[free])
            trial = np.clip(point + move, lower, upper)
            r_trial = residual(trial)
            evaluations += 1
            accepted = float(r_trial @ r_trial) < cost
            damping = max(damping / 10, 1e-12) if accepted else damping * 10
        if not accepted:
            message = "converged: no step lowers the cost"
            break
        fall = cost - float(r_trial @ r_trial)
        small = np.max(np.abs(trial - point) / width) < _TOLERANCE
        point, r, cost = trial, r_trial, float(r_trial @ r_trial)
        if fall <= _TOLERANCE * cost or small:
            message = "converged: the cost changes no more"
            break
    return Minimum(point, r, cost, evaluations, message)
