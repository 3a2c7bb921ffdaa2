"""Response time of a damper to a step of current, as test laboratories state it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.streaming import stepper
from mrdamper.errors import ParameterError

_STEP_SAMPLES = 4000
_SETTLE = 12.0  # lags of the coil after which nothing changes any more


@dataclass(frozen=True)
class RiseTimes:
    """Times from the step of current to shares of the change of force [s]."""

    rise_63: float  # these two with the current switched on
    rise_90: float
    fall_63: float  # and these switched off
    fall_90: float


def rise_times(damper: Damper) -> RiseTimes:
    """Measure the times of the force at constant velocity after steps of current, up and down.

    The highest tested current is switched on and off at half the highest tested velocity. Without a coil the answer is
    the model's own. Raises `ParameterError` if the force does not change with the current.
    """
    current, velocity = damper.envelope.current_A[1], 0.5 * damper.envelope.peak_velocity_m_s[1]
    lag = max(damper.coil.rise_s, damper.coil.fall_s, 1e-3) if damper.coil else 1e-3
    dt = 2 * _SETTLE * lag / _STEP_SAMPLES
    half = _STEP_SAMPLES // 2
    steps = stepper(damper)
    travel = 3.0  # settled in the knee and at constant speed, before anything is switched
    begin = np.linspace(-travel * _SETTLE * lag, 0.0, 2000)
    still = [steps.step_motion(velocity * t, velocity, 0.0, 0.0, begin[1] - begin[0]) for t in begin.tolist()][-1]
    forces = np.empty(2 * half)
    for i in range(2 * half):
        on = current if i < half else 0.0
        forces[i] = steps.step_motion(velocity * (i + 1) * dt, velocity, 0.0, on, dt)
    # What the stroke itself changes, a gas spring for one, is taken out along a straight line.
    end = forces[-1]
    forces -= still + (end - still) * (np.arange(2 * half) + 1) / (2 * half)
    top = forces[half - 1]
    if not abs(top) > 0:
        raise ParameterError("the force does not change with the current", where=damper.title, remedy="another damper")

    def when(part: np.ndarray, share: float) -> float:
        return float((np.argmax(part >= share) + 0.5) * dt)  # the step itself takes a sample

    up, down = forces[:half] / top, 1 - forces[half:] / top
    return RiseTimes(when(up, 1 - np.exp(-1)), when(up, 0.9), when(down, 1 - np.exp(-1)), when(down, 0.9))
