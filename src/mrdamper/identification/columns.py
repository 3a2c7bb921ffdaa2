"""The part of an identification that is linear: columns of a model, and bounded least squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrdamper.data import Floats
from mrdamper.models import Model
from mrdamper.motion import Excitation
from mrdamper.parameters import ParameterInfo


def linear_table(
    bare: Model, linear: Sequence[ParameterInfo], motion: Excitation, state: Floats
) -> tuple[Floats, Floats]:
    """Force of a model without its linear parameters, and what one unit of each adds.

    Parameters
    ----------
    bare : Model
        With all the linear parameters at zero.
    linear : sequence of ParameterInfo, length L
    motion : Excitation
        N samples.
    state : (N,) array

    Returns
    -------
    base : (N,) array
        [N]
    columns : (N, L) array
        [N per unit of the parameter]
    """
    base = bare.force(motion, state)
    units = [1.0 if info.bounds[0] <= 1.0 <= info.bounds[1] else info.bounds[1] for info in linear]
    columns = [
        (replace(bare, **{info.name: unit}).force(motion, state) - base) / unit
        for info, unit in zip(linear, units, strict=True)
    ]
    return base, np.column_stack(columns) if columns else np.zeros((base.size, 0))


def bounds_of(linear: Sequence[ParameterInfo]) -> tuple[Floats, Floats]:
    """Lower and upper bounds of parameters as arrays."""
    return np.array([info.bounds[0] for info in linear]), np.array([info.bounds[1] for info in linear])


def bounded_linear(columns: Floats, right: Floats, lower: Floats, upper: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Least squares with bounds on the coefficients, by holding violated ones at their bound.

    Parameters
    ----------
    columns : (N, L) array
    right : (N,) array
    lower, upper : (L,) arrays

    Returns
    -------
    solution : (L,) array
    held : (L,) boolean array
        Coefficients that ended at a bound.
    """
    scale = np.sqrt(np.mean(columns**2, axis=0))
    scale[scale == 0] = 1.0
    held = np.zeros(scale.size, dtype=bool)
    solution = np.zeros(scale.size)
    for _ in range(scale.size + 1):
        free = ~held
        scaled = columns[:, free] / scale[free]
        rest = right - columns[:, held] @ solution[held]
        solution[free] = _least_norm(scaled, rest) / scale[free]
        outside = free & ((solution < lower) | (solution > upper))
        if not outside.any():
            break
        solution = np.clip(solution, lower, upper)
        held |= outside
    return solution, held


def _least_norm(columns: Floats, right: Floats) -> Floats:
    # Normal equations of equilibrated columns: the few columns are far from dependent, and
    # this is several times faster than an orthogonal factorisation of N rows.
    normal = columns.T @ columns
    if normal.size and np.linalg.cond(normal) < 1e10:
        return np.asarray(np.linalg.solve(normal, columns.T @ right), dtype=float)
    return np.asarray(np.linalg.lstsq(columns, right, rcond=None)[0], dtype=float)
