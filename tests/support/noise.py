"""Recorded coil currents: constant with several kinds of noise, or changing."""

import numpy as np

KINDS = ("white", "quantised", "ripple", "chopper", "spikes", "wander")
CHANGES = ("step", "ramp", "random", "switched", "sine", "pulse")


def constant_current(rng, time, level=None, noise=None, kind=None):
    """A recorded constant current [A]: 0.1 to 20 mA of noise of a kind, stored to 0 to 6 decimals."""
    kind = rng.choice(KINDS) if kind is None else kind
    level = rng.choice([0.0, 0.05, 0.25, 0.4, 1.0, 2.5]) if level is None else level
    noise = 10 ** rng.uniform(-4, np.log10(0.02)) if noise is None else noise
    size, rate = time.size, 1 / float(np.median(np.diff(time)))
    white = rng.standard_normal(size)
    if kind == "ripple":
        deviation = np.sqrt(2) * np.sin(2 * np.pi * rng.choice([50, 100, 300]) * (time + rng.uniform()))
        deviation += 0.1 * white
    elif kind == "chopper":
        period = rng.uniform(1.5, 12) / rate
        deviation = np.where((time / period) % 1 < 0.5, 1.0, -1.0) + 0.1 * white
    elif kind == "spikes":
        deviation = 0.02 * white + 3 * (rng.uniform(size=size) < 0.02)
    elif kind == "wander":
        memory = rng.uniform(0.2, 0.9)
        deviation = white.copy()
        for i in range(1, size):
            deviation[i] = memory * deviation[i - 1] + np.sqrt(1 - memory**2) * white[i]
    else:
        deviation = white
    current = level + noise * deviation
    digits = rng.integers(1, 7) if kind != "quantised" else rng.integers(1, 4)
    return np.round(current, digits) if rng.uniform() < 0.7 or kind == "quantised" else current


def changing_current(rng, time, kind=None):
    """A current [A] that changes by 0.1 A to 1 A within the record, with up to 20 mA of noise."""
    kind = rng.choice(CHANGES) if kind is None else kind
    share = (time - time[0]) / (time[-1] - time[0])
    low, by = rng.choice([0.0, 0.2, 1.0]), rng.uniform(0.1, 1.0)
    if kind == "step":
        shape = (share > rng.uniform(0.1, 0.9)).astype(float)
    elif kind == "ramp":
        shape = share
    elif kind == "random":
        knots = rng.uniform(0, 1, 24)
        shape = np.interp(share, np.linspace(0, 1, 24), knots)
    elif kind == "switched":
        shape = (np.sin(2 * np.pi * rng.uniform(2, 12) * share) > 0).astype(float)
    elif kind == "sine":
        shape = 0.5 + 0.5 * np.sin(2 * np.pi * rng.uniform(1, 12) * share)
    else:
        begin = rng.uniform(0.1, 0.8)
        shape = ((share > begin) & (share < begin + 0.1)).astype(float)
    return low + by * shape + rng.uniform(0, 0.02) * rng.standard_normal(time.size)
