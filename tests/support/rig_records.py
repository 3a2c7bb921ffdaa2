"""Synthetic rig records of dampers of many models, and their faults."""

from dataclasses import replace

import numpy as np

from mrdamper.errors import QualityError
from mrdamper.models import model_type
from mrdamper.physics.motion import Excitation, random_motion, sweep
from mrdamper.physics.simulation import simulate
from mrdamper.rig_files.quality import check_record
from mrdamper.rig_files.record import Record


def clean_record(seed, *, noise=10.0, cycles=None, points=None, velocity=False, sensor=0.0, damper=None, make=None):
    """A clean record of a random damper: 0.5–2 Hz, 5–50 mm, 1.2–5.3 cycles, 100–400 points a cycle."""
    rng = np.random.default_rng([7, seed])
    frequency, amplitude = rng.uniform(0.5, 2.0), rng.uniform(0.005, 0.05)
    cycles = rng.uniform(1.2, 5.3) if cycles is None else cycles
    points = rng.integers(100, 401) if points is None else points
    time = np.arange(int(cycles * points) + 1) / (points * frequency)
    phase = rng.choice([0.0, rng.uniform(0, 2 * np.pi)])
    omega = 2 * np.pi * frequency
    angle = omega * time + phase
    current = rng.choice([0.0, 0.25, 0.5, 1.0])
    x, v = amplitude * np.sin(angle), amplitude * omega * np.cos(angle)
    motion = Excitation(time, x, v, -(omega**2) * x, np.full(time.size, current))
    force = simulate((make or random_damper)(rng, damper), motion).force + noise * rng.standard_normal(time.size)
    zero = rng.uniform(-0.03, 0.03)
    return Record(
        f"r{seed}",
        time + rng.choice([0.0, rng.uniform(0, 100)]),
        x + zero + sensor * rng.standard_normal(time.size),
        force,
        velocity=v.copy() if velocity else None,
        current=motion.current.copy(),
    )


def random_damper(rng, name=None):
    """A plausible damper of a random or given model, soft to strong."""
    strength, viscosity = rng.uniform(200, 2500), rng.uniform(500, 5000)
    offset, knee = rng.uniform(-200, 300), 10 ** rng.uniform(-3.7, -2.7)
    beta = knee**-2 / 2
    makers = {
        "bouc-wen": lambda: {
            "c": viscosity, "alpha": strength / knee, "beta": beta, "gamma": beta, "f0": offset,
            "k1": rng.uniform(0, 4000),
        },
        "smooth-bingham": lambda: {"c": viscosity, "fy": strength, "vs": rng.uniform(0.005, 0.03), "f0": offset},
        "kwok": lambda: {
            "c": viscosity, "k": rng.uniform(0, 3000), "alpha": strength, "beta": rng.uniform(20, 80),
            "delta": rng.uniform(0.1, 0.8), "f0": offset,
        },
        "guo": lambda: {
            "fy": strength, "c": viscosity, "kappa": rng.uniform(30, 120), "v0": rng.uniform(0.002, 0.015),
            "f0": offset,
        },
        "dahl": lambda: {"kappa_x": viscosity, "kappa_w": strength, "yield_displacement": knee, "f0": offset},
        "lugre": lambda: {
            "fc": strength, "presliding": knee, "stribeck": 1.2, "vs": 0.01, "sigma1": 300.0, "sigma2": viscosity,
            "f0": offset,
        },
        "spencer": lambda: {
            "c1": 2e4 + 4 * viscosity, "c0_ratio": 0.06, "k0_rate": 0.15, "creep": 0.03, "yield_displacement": knee / 3,
            "k1": 800.0, "f0": offset,
        },
    }  # fmt: skip
    name = name or str(rng.choice(sorted(makers)))
    return model_type(name).build(makers[name]())


def wide_damper(rng, name=None):
    """A damper whose hysteresis builds up slowly: over 1 to 5 mm, or over a wide band of velocities."""
    strength, viscosity = rng.uniform(400, 3000), rng.uniform(200, 2000)
    offset, knee = rng.uniform(-200, 300), 10 ** rng.uniform(-3.0, -2.3)
    share = rng.choice([0.5, 0.8])  # of beta in beta + gamma: less fullness, rounder corners
    makers = {
        "bouc-wen": lambda: {
            "c": viscosity, "alpha": strength / knee, "beta": share / knee**2, "gamma": (1 - share) / knee**2,
            "f0": offset, "k1": rng.uniform(0, 8000),
        },
        "dahl": lambda: {"kappa_x": viscosity, "kappa_w": strength, "yield_displacement": knee, "f0": offset},
        "kwok": lambda: {
            "c": viscosity, "k": rng.uniform(0, 3000), "alpha": strength, "beta": rng.uniform(20, 80),
            "delta": rng.uniform(0.3, 1.2), "f0": offset,
        },
        "lugre": lambda: {
            "fc": strength, "presliding": knee, "stribeck": 1.5, "vs": 0.01, "sigma1": 300.0, "sigma2": viscosity,
            "f0": offset,
        },
        "spencer": lambda: {
            "c1": 2e4 + 4 * viscosity, "c0_ratio": 0.06, "k0_rate": 0.15, "creep": 0.03, "yield_displacement": knee / 3,
            "k1": 800.0, "f0": offset,
        },
    }  # fmt: skip
    name = name or str(rng.choice(sorted(makers)))
    return model_type(name).build(makers[name]())


def chirp_record(seed=1, noise=10.0):
    """A sweep of 1 to 8 Hz at 5 mm."""
    return _of(sweep(1.0, 8.0, 10.0, 0.005), seed, noise, "chirp")


def random_record(seed=1, noise=10.0):
    """Gaussian motion of 5 mm RMS up to 4 Hz."""
    return _of(
        random_motion(np.random.default_rng(seed), 12.0, 0.005, (0.2, 4.0), sample_rate=500.0), seed, noise, "random"
    )


def _of(motion, seed, noise, kind):
    rng = np.random.default_rng([8, seed])
    force = simulate(random_damper(rng), motion).force + noise * rng.standard_normal(len(motion))
    return Record(
        f"{kind}{seed}", motion.time, motion.displacement.copy(), force, current=motion.current.copy(), excitation=kind
    )


def codes_of(record):
    """Codes of the findings of a record, or of its refusal."""
    try:
        return [finding.code for finding in check_record(record).findings]
    except QualityError as error:
        return [error.code]


def with_channel(record, name, change):
    """The record with one channel changed in place by a function."""
    values = getattr(record, name).copy()
    change(values)
    return replace(record, **{name: values})
