"""Response time of a damper to a step of current, as test laboratories state it."""

from __future__ import annotations

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.streaming import stepper
from mrdamper.errors import ParameterError

_STEP_SAMPLES = 4000
_SETTLE = 12.0  # lags of the coil after which the force is constant


def rise_times(damper: Damper) -> dict[str, float]:
    """Measure the times of the force at constant velocity after steps of current, up and down [s].

    To 63 % and 90 % of the change of force: rise_63 and rise_90 with the current switched on, fall_63 and fall_90 off.
    The highest tested current is switched on and off at half the highest tested velocity. Without a coil the response
    is that of the model. Raises `ParameterError` if the force does not change with the current.
    """
    current, velocity = damper.envelope.current_A[1], 0.5 * damper.envelope.peak_velocity_m_s[1]
    lag = max(damper.coil.rise_s, damper.coil.fall_s, 1e-3) if damper.coil else 1e-3
    dt = 2 * _SETTLE * lag / _STEP_SAMPLES
    half = _STEP_SAMPLES // 2
    steps = stepper(damper)
    travel = 3.0  # time at constant speed beyond the yield point before the switch
    begin = np.linspace(-travel * _SETTLE * lag, 0.0, 2000)
    still = [steps.step_motion(velocity * t, velocity, 0.0, 0.0, begin[1] - begin[0]) for t in begin.tolist()][-1]
    on = np.where(np.arange(2 * half) < half, current, 0.0).tolist()
    forces = np.array([steps.step_motion(velocity * i * dt, velocity, 0.0, now, dt) for i, now in enumerate(on, 1)])
    # The effect of the stroke, such as a gas spring, is subtracted as a straight line.
    end = forces[-1]
    forces -= still + (end - still) * (np.arange(2 * half) + 1) / (2 * half)
    top = forces[half - 1]
    if not abs(top) > 0:
        raise ParameterError("the force does not change with the current", where=damper.title, remedy="another damper")

    parts, shares = {"rise": forces[:half] / top, "fall": 1 - forces[half:] / top}, {63: 1 - np.exp(-1), 90: 0.9}
    return {  # the step takes one sample
        f"{way}_{percent}": float((np.argmax(part >= share) + 0.5) * dt)
        for way, part in parts.items()
        for percent, share in shares.items()
    }
