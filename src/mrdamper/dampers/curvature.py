"""Curvature of the force over the velocity that the runs of a damper show beside its parameters.

In laminar flow the force grows with the velocity, through an orifice with its square, and with less than the velocity
where a valve opens or the fluid thins. Within the tested velocities the parameters of a damper make up for most of it;
beyond them they do not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.run_residuals import RunResiduals
from mrdamper.dampers.slopes import force_slopes, relative_variances
from mrdamper.data import Condition, Floats
from mrdamper.physics.motion.made import sine
from mrdamper.statistics.linear import solve_linear

_FASTER = 2.0  # times the largest tested velocity
_CYCLES = 2  # of a sine from rest
_MAX_GROWTH = 1.0  # error over the distance of a motion: all of the force that the velocity adds
_RANK_LIMIT = 1e-6  # singular value over the largest below which a direction is not determined


def growth_by_curvature(
    damper: Damper, parts: Sequence[RunResiduals], slopes: Sequence[Floats], names: Sequence[str]
) -> Floats | None:
    """Relative errors (3,) of the force, the peak and the energy over the distance of a motion, by this curvature.

    A force over v² in each direction is fitted to the residuals of the R runs the damper was identified from, beside
    its parameters of P names, to first order; `slopes` are the (N, P) derivatives of their forces by these. The change
    of the force by this fit at twice the largest tested velocity counts as an error of the damper there. None where
    only the ranges of the tests are known.
    """
    tested = damper.envelope
    if not tested.conditions:
        return None
    velocities = [part.prediction.motion.velocity[part.picked] for part in parts]
    tables = [part.weighted(_with_squares(s, v)) for part, s, v in zip(parts, slopes, velocities, strict=True)]
    rests = np.concatenate([part.weight * part.residual for part in parts])
    change = solve_linear(np.concatenate(tables), rests, _RANK_LIMIT)
    fastest = max((Condition(*point) for point in tested.conditions), key=lambda condition: condition.peak_velocity)
    errors, distance = np.zeros(3), 0.0
    frequency = _FASTER * tested.peak_velocity_m_s[1] / (2 * np.pi * fastest.amplitude_m)
    for current in sorted({*tested.current_A, tested.middle.current_A}):
        faster = damper.predict(sine(Condition(current, frequency, fastest.amplitude_m), _CYCLES))
        there = _with_squares(force_slopes(damper, faster, names), faster.motion.velocity)
        errors += relative_variances(
            there, np.outer(change, change), faster.force, faster.motion.velocity, faster.motion.time
        )
        distance += faster.distance(damper).motion ** 2
    return np.minimum(np.sqrt(errors / distance), _MAX_GROWTH)


def _with_squares(slopes: Floats, velocity: Floats) -> Floats:
    """Add columns of v² in either direction to a table (N, P)."""
    return np.column_stack([slopes, np.maximum(velocity, 0.0) ** 2, -(np.minimum(velocity, 0.0) ** 2)])
