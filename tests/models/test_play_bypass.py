"""The play-and-bypass model against its equations, followed sample by sample in plain Python."""

import math

import numpy as np
import pytest

from mrdamper.models.play_bypass import PlayBypass
from mrdamper.motion import Excitation
from mrdamper.simulation import simulate

P = {"f0": 48.8, "k": 832.0, "c0": 632.0, "c1": 3622.0, "fy0": 143.0, "fy1": 1019.0, "d": 1.98e-4, "e": 2.55e-5,
     "cb": 3.74e4, "h0": 0.4, "h1": 0.35, "vh": 2.06e-3, "T": 3.4e-3, "asymmetry": 0.05, "m": 6.6}  # fmt: skip


def by_hand(p, t, x, v, a, I):
    """Force at every sample; the lag is the exact answer to a share that is straight between samples' ends."""
    delta, lagged, force = 0.0, 0.0, []
    for i in range(len(t)):
        if i:
            delta = min(max(delta + x[i] - x[i - 1], -p["d"]), p["d"])
        sign_d, sign_v = np.sign(delta), np.sign(v[i])
        phi = sign_d * max(0.0, abs(delta) - (p["d"] - p["e"])) / p["e"]
        eta = max(0.0, phi * sign_v)
        fy = p["fy0"] + p["fy1"] * I[i] * (1 - math.exp(-I[i] / 0.12))
        h = min(max(p["h0"] + p["h1"] * I[i], 0.0), 1.0)
        r = p["cb"] * abs(v[i]) / fy
        b = r / math.sqrt(1 + r * r)
        share = (1 - h) * phi + sign_v * (h * abs(v[i]) / (abs(v[i]) + p["vh"]) * eta + (1 - eta) * b)
        if i:
            keep = math.exp(-(t[i] - t[i - 1]) / p["T"])
            lagged = share + (lagged - share) * keep
        force.append(
            p["f0"] + p["k"] * x[i] * (1 - lagged) + (p["c0"] + p["c1"] * I[i]) * v[i]
            + fy * (lagged + p["asymmetry"] * abs(lagged)) + p["m"] * a[i]
        )  # fmt: skip
    return np.array(force)


def moved_by(t, x, current):
    v = np.gradient(x, t, edge_order=2)
    return Excitation(t, x, v, np.gradient(v, t, edge_order=2), np.full(t.size, current))


@pytest.mark.parametrize("current", [0.0, 0.3, 1.0])
def test_force_is_that_of_the_equations(current):
    # So finely sampled that how the share is taken over a step does not matter.
    t = np.linspace(0, 1.0, 40_001)
    x = 5e-3 * np.sin(2 * np.pi * 1.5 * t) + 1e-3 * np.sin(2 * np.pi * 4 * t)
    motion = moved_by(t, x, current)
    ours = simulate(PlayBypass(**P), motion).force
    hand = by_hand(P, t, motion.displacement, motion.velocity, motion.acceleration, motion.current)
    assert np.max(np.abs(ours - hand)[10:]) < 0.01 * np.ptp(hand)
    assert np.sqrt(np.mean((ours - hand) ** 2)) < 1e-3 * np.ptp(hand)


@pytest.mark.parametrize("name", [n for n in P if n != "f0"])
def test_every_parameter_moves_the_force(name):
    t = np.linspace(0, 1.0, 2001)
    motion = moved_by(t, 5e-3 * np.sin(2 * np.pi * 1.5 * t), 0.5)
    base = simulate(PlayBypass(**P), motion).force
    moved = simulate(PlayBypass(**{**P, name: 1.2 * P[name]}), motion).force
    assert np.max(np.abs(moved - base)) > 1e-4 * np.ptp(base), name
