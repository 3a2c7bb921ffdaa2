"""Runs of a known damper in several sessions."""

import numpy as np

from mrdamper.data import Condition, Run
from mrdamper.physics.motion import sine

MATRIX = [Condition(i, f, a) for i in (0.0, 0.5, 1.0) for f, a in ((0.5, 0.02), (1.0, 0.01), (2.0, 0.005))]


def session_runs(damper, gain=0.045, seed=0, noise=3.0, repeats=1):
    """Runs of a damper, each in a session with its own gain."""
    rng = np.random.default_rng(seed)
    runs = []
    for number, condition in enumerate(MATRIX * repeats):
        motion = sine(condition, 4, 200)
        force = damper.force_along(motion, condition) * (1 + gain * rng.standard_normal())
        force = force + noise * rng.standard_normal(force.size)
        runs.append(Run(f"r{number}", motion.time, motion.displacement, force, condition.current_A, rig="bench"))
    return runs
