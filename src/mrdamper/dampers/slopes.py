"""Derivatives of a damper's force by its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrdamper.dampers.prediction import Prediction
from mrdamper.dampers.protocols import DamperLike as Damper
from mrdamper.data import Floats
from mrdamper.identification.columns import linear_table
from mrdamper.statistics.metrics import dissipated_power, peak_force

_RELATIVE_STEP = 1e-4  # relative step of a parameter


def force_slopes(damper: Damper, prediction: Prediction, names: Sequence[str]) -> Floats:
    """(N, P) derivatives of a predicted force by some of the damper's parameters, or by their logarithm [N per unit].

    Those by linear parameters of one model are columns of one state; for the others the force is predicted again.
    """
    prediction.motion.path  # noqa: B018  cut into strokes once, for every number that is moved
    columns = _linear(damper, prediction, names)
    table = [columns[n] if n in columns else _moved(damper, prediction, n) for n in names]
    return np.column_stack(table) if table else np.zeros((prediction.force.size, 0))


def relative_variances(slopes: Floats, covariance: Floats, force: Floats, velocity: Floats, time: Floats) -> Floats:
    """Propagate a covariance of parameters to the force, its peak and the dissipated energy.

    `slopes` (N, P) are derivatives of the force (N,) [N] by parameters of covariance (P, P); velocity and time (N,)
    [m/s], [s]. Returns (3,): the mean variance of the force and that of its peak over the square of half the
    peak-to-peak value; that of the energy, relative.
    """
    half = peak_force(force) or 1.0
    power = dissipated_power(force, velocity, time) or 1.0
    variance: Floats = np.sum(slopes @ covariance * slopes, axis=1)
    mean = float(np.mean(variance)) / half**2
    swing = (slopes[int(np.argmax(force))] - slopes[int(np.argmin(force))]) / 2 / half
    loss = np.array([dissipated_power(column, velocity, time) for column in slopes.T]) / power
    return np.array([mean, float(swing @ covariance @ swing), float(loss @ covariance @ loss)])


def _linear(damper: Damper, prediction: Prediction, names: Sequence[str]) -> dict[str, Floats]:
    model = damper.one_model
    if model is None:
        return {}
    linear = [info for info in model.parameters() if info.linear and info.name in names]
    if prediction.steady:
        loop = damper.loop(prediction.condition)
        motion, state = loop.excitation, loop.state
    else:
        motion = damper.with_field_current(prediction.motion)
        state = model.state(motion)
    bare = replace(model, **{info.name: 0.0 for info in linear})
    return dict(zip([info.name for info in linear], linear_table(bare, linear, motion, state)[1].T, strict=True))


def _moved(damper: Damper, prediction: Prediction, name: str) -> Floats:
    own = damper.fitted_parameters[name]
    step = _RELATIVE_STEP if own.log else _RELATIVE_STEP * (abs(own.value) or 1.0)
    there = own.value * np.exp(step) if own.log else own.value + step
    if there > own.bounds[1]:
        step, there = -step, own.value * np.exp(-step) if own.log else own.value - step
    return (damper.with_parameters({name: there}).force_for(prediction) - prediction.force) / step
