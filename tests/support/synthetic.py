"""Runs of a damper with known parameters."""

import numpy as np

from mrdamper.data import Run
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.motion import sine
from mrdamper.physics.simulation import simulate

TRUTH = {"c": 1440.0, "alpha": 9e5, "beta": 2e5, "gamma": 2e5, "n": 2.0, "f0": 120.0, "k1": 1381.0, "k3": 8000.0}


def synthetic_run(condition, noise=0.0, seed=1, cycles=4, samples_per_cycle=800, model=None, **options):
    """A run of a Bouc–Wen damper with known parameters, from rest, window without the first cycle."""
    motion = sine(condition, cycles, samples_per_cycle)
    model = model or BoucWen(**TRUTH)
    force = simulate(model, motion).force + noise * np.random.default_rng(seed).standard_normal(len(motion))
    return Run(
        options.pop("id", f"{condition}"),
        motion.time,
        motion.displacement,
        force,
        condition.current_A,
        window=(1 / condition.frequency_Hz, float(motion.time[-1])),
        **options,
    )
