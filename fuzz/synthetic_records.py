"""Clean synthetic records of seven model families, as a good rig would record them.

Amplitude, frequency, yield displacement and every other figure are drawn continuously. The yield
displacement lies between 0.3 and 30 % of the amplitude, the viscous force between a quarter and
four times the yield force.
"""

from __future__ import annotations

import numpy as np

from mrdamper.data import Floats
from mrdamper.models import model_type
from mrdamper.physics.motion import Excitation
from mrdamper.physics.simulation import simulate
from mrdamper.rig_files.record import Record

ELASTIC_PLASTIC = "elastic-plastic"
FAMILIES = ("bouc-wen", "smooth-bingham", "kwok", "guo", "dahl", "lugre", ELASTIC_PLASTIC)
OTHERS = ("spencer", "biviscous", "herschel-bulkley")  # drawn apart: the numbers of the faults stay as they are
CURRENTS = (0.0, 0.25, 0.5, 1.0, 2.0)  # [A]


def clean_record(
    number: int, rng: np.random.Generator, least_cycles: float = 1.3, families: tuple[str, ...] = FAMILIES
) -> Record:
    """Draw a clean record.

    Parameters
    ----------
    number : int
        Chooses the model family in turn; part of the record's name.
    rng : Generator
    least_cycles : float
        One record in ten holds so many to 4 cycles, the others 4 to 15.
    families : tuple of str
        They take turns.

    Returns
    -------
    Record
        A sine of 0.3 to 4 Hz and 2 to 50 mm, 80 to 500 samples a cycle; force noise 0.02 to 0.4 % and warming at most 0.8 % of the force;
        both channels quantised to 16 bits of twice their range.
    """
    frequency, amplitude = _log_uniform(rng, 0.3, 4.0), _log_uniform(rng, 0.002, 0.05)
    cycles = rng.uniform(least_cycles, 4.0) if rng.random() < 0.1 else rng.uniform(4.0, 15.0)
    rate = _log_uniform(rng, 80, 500) * frequency
    time = np.arange(int(cycles * rate / frequency) + 1) / rate
    omega = 2 * np.pi * frequency
    angle = omega * time + rng.uniform(0, 2 * np.pi)
    distortion = rng.uniform(0, 0.02)
    x = amplitude * (np.sin(angle) + distortion * np.sin(3 * angle))
    v = amplitude * omega * (np.cos(angle) + 3 * distortion * np.cos(3 * angle))
    current = float(rng.choice(CURRENTS))
    motion = Excitation(time, x, v, np.gradient(v, time), np.full(time.size, current))
    force = force_of(families[number % len(families)], motion, rng)
    warming = 1 - rng.uniform(0, 0.008) * time / time[-1]
    force = force * warming + _log_uniform(rng, 2e-4, 4e-3) * np.ptp(force) * rng.standard_normal(time.size)
    x = x + rng.uniform(-0.03, 0.03) + _log_uniform(rng, 1e-5, 3e-4) * amplitude * rng.standard_normal(time.size)
    channel = current + 0.003 * rng.standard_normal(time.size)
    return Record(f"s{number}", time, quantised(x, 16), quantised(force, 16), current=channel)


def force_of(family: str, motion: Excitation, rng: np.random.Generator) -> Floats:
    """Draw a damper of a family and return its force [N] along a motion."""
    amplitude, speed = 0.5 * float(np.ptp(motion.displacement)), float(np.max(np.abs(motion.velocity)))
    yield_force = _log_uniform(rng, 100.0, 3000.0)
    viscosity = yield_force / speed * _log_uniform(rng, 0.25, 4.0)
    offset = rng.uniform(-0.2, 0.3) * yield_force
    bend = amplitude * _log_uniform(rng, 0.003, 0.3)  # yield displacement [m]
    width = speed * _log_uniform(rng, 0.01, 0.2)  # velocity in which a yield force builds up [m/s]
    stiffness = rng.uniform(0, 0.3) * yield_force / amplitude
    share = rng.uniform(0.5, 0.9)
    values = {
        "bouc-wen": {
            "c": viscosity, "alpha": yield_force / bend, "beta": share / bend**2, "gamma": (1 - share) / bend**2,
            "f0": offset, "k1": stiffness,
        },
        "smooth-bingham": {"c": viscosity, "fy": yield_force, "vs": width, "f0": offset},
        "kwok": {
            "c": viscosity, "k": stiffness, "alpha": yield_force, "beta": 1 / width,
            "delta": rng.uniform(0.1, 0.6) * width / 0.03, "f0": offset,
        },
        "guo": {
            "fy": yield_force, "c": viscosity, "kappa": 1 / width, "v0": rng.uniform(0.1, 0.6) * width, "f0": offset,
        },
        "dahl": {"kappa_x": viscosity, "kappa_w": yield_force, "yield_displacement": bend, "f0": offset},
        "lugre": {
            "fc": yield_force, "presliding": bend, "stribeck": rng.uniform(1.0, 1.3), "vs": width,
            "sigma1": 0.1 * viscosity, "sigma2": viscosity, "f0": offset,
        },
        "spencer": {  # without k0, by which the mean force would take many cycles to settle
            "c1": yield_force / (0.3 * width), "c0_ratio": 0.3 * width * viscosity / yield_force, "k0_rate": 0.0,
            "creep": 0.3 * width, "yield_displacement": bend, "k1": stiffness, "f0": offset,
        },
        "biviscous": {"cpo": viscosity, "fy": yield_force, "vy": width, "vh": 2 * (share - 0.5) * width, "f0": offset},
        "herschel-bulkley": {"fy": yield_force, "vc": speed, "m": share, "c": viscosity * speed**share, "f0": offset},
    }  # fmt: skip
    if family == ELASTIC_PLASTIC:
        loop = _elastic_plastic(motion.displacement, bend)
        return offset + stiffness * motion.displacement + viscosity * motion.velocity + yield_force * loop
    return simulate(model_type(family).build(values[family]), motion).force


def _elastic_plastic(x: Floats, bend: float) -> Floats:
    """Return the state of an ideal elastic–plastic element, in -1...1."""
    state, states = 0.0, np.empty_like(x)
    for i, step in enumerate(np.diff(x, prepend=x[0]) / bend):
        state = min(max(state + step, -1.0), 1.0)
        states[i] = state
    return states


def quantised(values: Floats, bits: int) -> Floats:
    """Round to the steps of a converter whose range is twice the signal's peak-to-peak value."""
    step = 2 * float(np.ptp(values)) / 2**bits
    return np.round(values / step) * step


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
