"""The play-and-bypass model against its equations, followed sample by sample in plain Python."""

import math

import numpy as np
import pytest

from mrdamper.models import Scale
from mrdamper.models.play_bypass import PlayBypass, play_position
from mrdamper.physics.motion import Excitation, Path
from mrdamper.physics.simulation import simulate

P = {"f0": 48.8, "k": 832.0, "c0": 632.0, "c1": 3622.0, "fy0": 143.0, "fy1": 1019.0, "d": 1.98e-4, "e": 2.55e-5,
     "cb": 3.74e4, "h0": 0.4, "h1": 0.35, "vh": 2.06e-3, "T": 3.4e-3, "asymmetry": 0.05, "m": 6.6}  # fmt: skip
PRESET = {"cq": 0.0, "qb": 0.0, "Ic": 0.12, "si": 0.0}
OTHER = {"cb": 4e3, "cq": 150.0, "qb": 0.3, "Ic": 0.25, "si": 0.6}


def by_hand(p, t, x, v, a, I):
    """Force at every sample; the lag is the exact answer to a share that is straight between samples' ends."""
    delta, lagged, force = 0.0, 0.0, []
    for i in range(len(t)):
        if i:
            delta = min(max(delta + x[i] - x[i - 1], -p["d"]), p["d"])
        sign_d, sign_v = np.sign(delta), np.sign(v[i])
        phi = sign_d * max(0.0, abs(delta) - (p["d"] - p["e"])) / p["e"]
        eta = max(0.0, phi * sign_v)
        fy = p["fy0"] + p["fy1"] * I[i] * (1 - math.exp(-I[i] / p["Ic"])) / (1 + p["si"] * I[i])
        h = min(max(p["h0"] + p["h1"] * I[i], 0.0), 1.0)
        r = p["cb"] * (1 + p["qb"] * sign_v) * abs(v[i]) / fy
        b = r / math.sqrt(1 + r * r)
        share = (1 - h) * phi + sign_v * (h * abs(v[i]) / (abs(v[i]) + p["vh"]) * eta + (1 - eta) * b)
        if i:
            keep = math.exp(-(t[i] - t[i - 1]) / p["T"])
            lagged = share + (lagged - share) * keep
        force.append(
            p["f0"] + p["k"] * x[i] * (1 - lagged) + (p["c0"] + p["c1"] * I[i]) * v[i]
            + p["cq"] * abs(v[i])
            + fy * (lagged + p["asymmetry"] * abs(lagged)) + p["m"] * a[i]
        )  # fmt: skip
    return np.array(force)


def moved_by(t, x, current):
    v = np.gradient(x, t, edge_order=2)
    return Excitation(t, x, v, np.gradient(v, t, edge_order=2), np.full(t.size, current))


@pytest.mark.parametrize(
    ("current", "more", "sign"), [(0.0, PRESET, 1), (0.3, PRESET, -1), (1.0, PRESET, 1), (0.4, OTHER, -1)]
)
def test_force_is_that_of_the_equations(current, more, sign):
    # So finely sampled that how the share is taken over a step does not matter.
    t = np.linspace(0, 1.0, 40_001)
    x = sign * (5e-3 * np.sin(2 * np.pi * 1.5 * t) + 1e-3 * np.sin(2 * np.pi * 4 * t))
    motion = moved_by(t, x, current)
    ours = simulate(PlayBypass(**{**P, **more}), motion).force
    hand = by_hand({**P, **more}, t, motion.displacement, motion.velocity, motion.acceleration, motion.current)
    assert np.max(np.abs(ours - hand)[10:]) < 0.01 * np.ptp(hand)
    assert np.sqrt(np.mean((ours - hand) ** 2)) < 1e-3 * np.ptp(hand)


@pytest.mark.parametrize(("current", "share"), [(0.3, 1 - 0.4 - 0.35 * 0.3), (3.0, 0.0)])
def test_a_damper_held_at_rest_keeps_what_does_not_fade_with_velocity(current, share):
    """Moved out by far more than its lost motion and held: the share 1 − h of the yield force, h being 1 at most."""
    t = np.linspace(0, 0.2, 401)
    x = np.minimum(0.05 * t, 0.005)
    v = np.where(t < 0.1, 0.05, 0.0)
    motion = Excitation(t, x, v, np.zeros_like(t), np.full(t.size, current))
    held = simulate(PlayBypass(**P, **PRESET), motion).force
    assert np.isfinite(held).all()
    fy = P["fy0"] + P["fy1"] * current * (1 - math.exp(-current / PRESET["Ic"]))
    assert held[-1] == pytest.approx(
        P["f0"] + P["k"] * 0.005 * (1 - share) + fy * share * (1 + P["asymmetry"]), rel=1e-6
    )


@pytest.mark.parametrize("name", [n for n in P if n != "f0"])
def test_every_parameter_moves_the_force(name):
    t = np.linspace(0, 1.0, 2001)
    motion = moved_by(t, 5e-3 * np.sin(2 * np.pi * 1.5 * t), 0.5)
    base = simulate(PlayBypass(**P), motion).force
    moved = simulate(PlayBypass(**{**P, name: 1.2 * P[name]}), motion).force
    assert np.max(np.abs(moved - base)) > 1e-4 * np.ptp(base), name


@pytest.mark.parametrize("limit", [2e-4, 3e-3, 0.05])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_play_is_the_sum_of_clipped_moves_over_any_reversals(limit, sign):
    x = sign * np.cumsum(np.random.default_rng(3).normal(0, 2e-3, 700))
    x -= x[0]
    delta, expected = 0.0, [0.0]
    for step in np.diff(x):
        delta = min(max(delta + step, -limit), limit)
        expected.append(delta)
    assert play_position(Path.of(x, peaks="samples"), limit) == pytest.approx(np.array(expected), abs=1e-15)


def test_searches_follow_the_scale_of_the_data():
    free = (*P, "qb", "Ic", "leak", "si")
    at_one = {a.name: (a.lower, a.upper, *a.grid) for a in PlayBypass.search_axes(Scale(0.01, 1.0, 1.0, 1.0), free)}
    assert at_one == {
        "fy0": (1e-3, 3.0, 0.08), "fy1": (1e-3, 30.0, 0.7), "d": (1e-6, 0.7 * 0.01, 2e-4, 5e-5, 8e-4, 3e-3),
        "seat_share": (5e-3, 1.0, 0.1), "cb": (0.02, 1e3, 1.0, 5.0), "h0": (0.0, 1.0, 0.4), "h1": (-2.0, 3.0, 0.3),
        "vh": (1e-3, 0.5, 0.02), "T": (2e-4, 5e-2, 5e-3), "qb": (-0.9, 0.9, 0.0), "Ic": (0.01, 2.0, 0.12),
        "leak": (0.2, 2e3, 18.0), "si": (0.0, 10.0, 0.1),
    }  # fmt: skip
    X, V, F, I = 0.1, 0.25, 4000.0, 2.0
    times = {"fy0": F, "fy1": F / I, "cb": F / V, "h1": 1 / I, "vh": V, "Ic": I, "si": 1 / I}
    scaled = PlayBypass.search_axes(Scale(X, V, F, I), free)
    for axis in scaled:
        if axis.name != "d":
            expected = np.array(at_one[axis.name]) * times.get(axis.name, 1.0)
            assert [axis.lower, axis.upper, *axis.grid] == pytest.approx(expected.tolist()), axis.name
    assert {a.name for a in scaled if a.log} >= {"seat_share", "d", "T", "Ic", "leak"}
    (short,) = [a for a in PlayBypass.search_axes(Scale(2e-5, V, F, 0.0), free) if a.name == "d"]
    assert (short.upper, *short.grid) == pytest.approx((1.4e-5, 0.2 * 1.4e-5))
    (rise,) = [a for a in PlayBypass.search_axes(Scale(X, V, F, 0.0), free) if a.name == "fy1"]
    assert rise.upper == pytest.approx(30 * F)  # no current flowed: an ampere
    (long,) = [a for a in scaled if a.name == "d"]
    assert long.upper == 1e-2


def test_its_lengths_are_lost_motion_and_seat():
    model = PlayBypass.build({**{n: v for n, v in P.items() if n != "e"}, "seat_share": 0.25})
    assert (model.e, model.yield_length) == pytest.approx((0.25 * P["d"], 2 * P["d"]))
    assert model.seat_share == pytest.approx(0.25)
    assert PlayBypass.build(P).e == P["e"]
