"""Linear part of an identification: the force per unit of each parameter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrdamper.data.arrays import Floats
from mrdamper.data.parameters import ParameterInfo
from mrdamper.models.base import Model
from mrdamper.physics.motion.excitation import Excitation


def linear_table(
    bare: Model, linear: Sequence[ParameterInfo], motion: Excitation, state: Floats, base: Floats | None = None
) -> tuple[Floats, Floats]:
    """Force of a model without its linear parameters (N,) [N], and the force per unit of each parameter (N, L).

    `bare` has all the linear parameters at zero; `base` is its force, where it is known.
    """
    base = bare.force(motion, state) if base is None else base
    units = [1.0 if info.bounds[0] <= 1.0 <= info.bounds[1] else info.bounds[1] for info in linear]
    columns = np.empty((len(units), base.size))
    for column, info, unit in zip(columns, linear, units, strict=True):
        np.subtract(replace(bare, **{info.name: unit}).force(motion, state), base, out=column)
        column /= unit
    return base, columns.T


def bounds_of(linear: Sequence[ParameterInfo]) -> tuple[Floats, Floats]:
    """Lower and upper bounds of parameters as arrays."""
    return np.array([info.bounds[0] for info in linear]), np.array([info.bounds[1] for info in linear])
