"""Synthetic conditions with known parameters: one recorded cycle of 1,000 samples each, with noise."""

from __future__ import annotations

from functools import cache

import numpy as np

from mrdamper.data import Condition, Run
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.motion import sine
from mrdamper.physics.simulation import simulate

NOISE = 0.03  # standard deviation over that of the force
SAMPLES = 1000  # a cycle; the cycle before it only sets the state
MATRIX = [
    Condition(current, frequency, amplitude)
    for current in (0.0, 0.5, 1.0, 1.5)
    for frequency in (0.5, 1.0, 1.5, 2.0)
    for amplitude in (0.005, 0.02, 0.05)
]
ONE = Condition(1.0, 1.0, 0.02)


def damper(condition: Condition) -> BoucWen:
    """The truth at a condition."""
    return BoucWen.build(
        {
            "c": 1300 + 250 * condition.current_A,
            "yield_force": 100 + 600 * condition.current_A,
            "yield_displacement": 0.06 * condition.amplitude_m,
            "f0": 120.0,
            "k1": 1400.0,
            "k3": 8000.0,
        }
    )


@cache
def run(condition: Condition = ONE, seed: int = 0, samples: int = SAMPLES) -> Run:
    """A noisy record of the damper at a condition."""
    motion = sine(condition, 2, samples)
    force = simulate(damper(condition), motion).force
    noise = NOISE * np.std(force[samples:]) * np.random.default_rng(seed).standard_normal(force.size)
    window = (1 / condition.frequency_Hz, float(motion.time[-1]))
    return Run(f"{condition}", motion.time, motion.displacement, force + noise, condition.current_A, window=window)
