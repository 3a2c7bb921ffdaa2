"""Every "-type" law against the formula written down once more, at conditions that tell its exponents apart."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.published import all_published, dominguez
from mrdamper.data import Condition

REFERENCE = Condition(0.3, 1.1, 0.012)
ENVELOPE = Envelope((0.0, 2.0), (0.2, 5.0), (0.002, 0.05), (0.01, 1.0))
# Ratios to the reference differ: frequency 2, amplitude 3, and both sides of the break current.
CONDITIONS = [Condition(0.1, 2.2, 0.012), Condition(0.9, 1.1, 0.036), Condition(1.7, 0.55, 0.006)]


def damper(name, coefficients):
    return all_published()[name](coefficients, REFERENCE, envelope=ENVELOPE)


def quadratic(c, name, current):
    return c[f"{name}0"] + c[f"{name}1"] * current + c[f"{name}2"] * current**2


@pytest.mark.parametrize("condition", CONDITIONS, ids=str)
def test_dominguez(condition):
    c = {
        "c1": 900.0,
        "c2": 500.0,
        "c3": 2.0,
        "c4": 300.0,
        "alpha1": 2e6,
        "alpha2": 4e6,
        "alpha3": 1.5,
        "alpha4": 8e5,
        "d2": 0.15,
        "d4": 0.4,
        "beta": 4e6,
        "gamma1": 3e6,
        "gamma2": 1e6,
        "k1": 700.0,
        "k2": 300.0,
        "f0": 47.0,
    }
    model, I = damper("dominguez-type", c).model_at(condition), condition.current_A
    scale = (condition.frequency_Hz / 1.1) ** 0.15 * (condition.amplitude_m / 0.012) ** 0.4

    def law(name):
        one, two, three, four = (c[f"{name}{i}"] for i in (1, 2, 3, 4))
        if I <= 0.3:
            return four + (one - four) * I / 0.3
        return one + two * (1 - math.exp(-three * (I - 0.3)))

    assert model.c == pytest.approx(scale * law("c"), rel=1e-12)
    assert model.alpha == pytest.approx(scale * law("alpha"), rel=1e-12)
    assert model.k1 == pytest.approx(scale * (700 + 300 * I), rel=1e-12)
    assert model.gamma == pytest.approx(3e6 - 1e6 * I, rel=1e-12)
    assert (model.beta, model.f0, model.n) == (4e6, 47.0, 2.0)


@pytest.mark.parametrize("condition", CONDITIONS, ids=str)
def test_ali(condition):
    c = {
        "c10": 2e4,
        "c11": 1e4,
        "c12": -1e3,
        "c1_p": -0.1,
        "c1_q": 0.2,
        "c1_floor": 1.0,
        "c00": 900.0,
        "c01": 800.0,
        "c02": 50.0,
        "c0_p": 0.3,
        "c0_q": -0.15,
        "c0_floor": 1.0,
        "yield_force0": 200.0,
        "yield_force1": 700.0,
        "yield_force2": -50.0,
        "yield_force_p": 0.25,
        "yield_force_q": 0.35,
        "yield_force_floor": 1.0,
        "k0": 2e3,
        "k1": 300.0,
        "f0": 40.0,
        "yield_displacement_log": math.log(2e-4),
    }
    model, I = damper("ali-type", c).model_at(condition), condition.current_A
    X, f = condition.amplitude_m / 0.012, condition.frequency_Hz / 1.1
    c1 = quadratic(c, "c1", I) * X**-0.1 * f**0.2
    c0 = quadratic(c, "c0", I) * X**0.3 * f**-0.15
    force = quadratic(c, "yield_force", I) * X**0.25 * f**0.35
    assert model.c1 == pytest.approx(c1, rel=1e-12)
    assert model.c0_ratio * model.c1 == pytest.approx(c0, rel=1e-12)
    assert model.creep * model.c1 == pytest.approx(force, rel=1e-12)
    assert model.k0_rate * model.c1 == pytest.approx(2e3, rel=1e-12)
    assert (model.k1, model.f0) == (300.0, 40.0)
    assert model.yield_displacement == pytest.approx(2e-4, rel=1e-12)


@pytest.mark.parametrize("condition", CONDITIONS, ids=str)
def test_lei(condition):
    c = {
        "cpo0": 500.0,
        "cpo1": 300.0,
        "cpo2": -40.0,
        "cpr0": 9e3,
        "cpr1": 7e3,
        "cpr2": 600.0,
        "fy0": 100.0,
        "fy1": 800.0,
        "fy2": -90.0,
        "v00": 2e-3,
        "v01": 3e-3,
        "v02": -5e-4,
        "f0": 25.0,
    }
    model, I = damper("lei-type", c).model_at(condition), condition.current_A
    found = dict(
        zip(("cpo", "cpr", "fy", "v0"), (quadratic(c, name, I) for name in ("cpo", "cpr", "fy", "v0")), strict=True)
    )
    kind = type(model)
    wanted = kind.from_wereley(found["cpo"], found["cpr"], found["fy"], found["v0"], 25.0)
    assert model.values() == pytest.approx(wanted.values(), rel=1e-12)
    # Neither frequency nor amplitude matters.
    assert damper("lei-type", c).model_at(Condition(I, 0.7, 0.03)) == model


@pytest.mark.parametrize("condition", CONDITIONS, ids=str)
def test_lv(condition):
    c = {"fy0": 150.0, "fy1": 900.0, "fy2": -80.0, "m": 0.7, "consistency_log": math.log(2500.0), "f0": -12.0}
    model, I = damper("lv-type", c).model_at(condition), condition.current_A
    force = quadratic(c, "fy", I)
    assert model.fy == pytest.approx(force, rel=1e-12)
    assert model.m == pytest.approx(0.7, rel=1e-12)
    assert model.vc == pytest.approx((force / 2500.0) ** (1 / 0.7), rel=1e-12)
    assert model.f0 == -12.0


@pytest.mark.parametrize("condition", CONDITIONS, ids=str)
def test_boada(condition):
    """One hidden layer of five tanh units over standardised inputs, written out."""
    inputs, outputs, hidden = 3, 6, 5
    count = hidden * (inputs + 1) + outputs * (hidden + 1)
    weights = [0.3 * math.sin(1.7 * i + 0.4) for i in range(count)]
    centre, spread = (0.8, math.log(1.3), math.log(0.011)), (0.5, 0.4, 0.6)
    middle, width = (5.5, 4.0, -4.0, 900.0, 300.0, 20.0), (0.4, 0.3, 0.2, 150.0, 80.0, 9.0)
    c = {f"weight{i}": w for i, w in enumerate(weights)}
    for name, values in (("centre", centre), ("spread", spread), ("middle", middle), ("width", width)):
        c |= {f"{name}{i}": value for i, value in enumerate(values)}
    raw = (condition.current_A, math.log(condition.frequency_Hz), math.log(condition.amplitude_m))
    scaled = [(r - m) / s for r, m, s in zip(raw, centre, spread, strict=True)]
    model = damper("boada-type", c).model_at(condition)
    names = ("fy", "kappa", "v0", "c", "k", "f0")
    found = [math.log(getattr(model, n)) if i < 3 else getattr(model, n) for i, n in enumerate(names)]
    layer = [weights[i * (inputs + 1) : (i + 1) * (inputs + 1)] for i in range(hidden)]
    rest = weights[hidden * (inputs + 1) :]
    units = [math.tanh(sum(w * x for w, x in zip(row[:-1], scaled, strict=True)) + row[-1]) for row in layer]
    for i, value in enumerate(found):
        row = rest[i * (hidden + 1) : (i + 1) * (hidden + 1)]
        output = sum(w * u for w, u in zip(row[:-1], units, strict=True)) + row[-1]
        assert value == pytest.approx(middle[i] + width[i] * output, rel=1e-9), names[i]


@pytest.mark.parametrize(("gamma1", "gamma2", "share"), [(9e6, 0.0, 1.0), (0.0, 1e8, -0.999)])
def test_dominguez_keeps_a_loop_that_closes(gamma1, gamma2, share):
    laws = {f"{name}{i}": 1.0 for name in ("c", "alpha") for i in range(1, 5)}
    c = {**laws, "d2": 0.0, "d4": 0.0, "beta": 4e6, "gamma1": gamma1, "gamma2": gamma2, "k1": 0.0, "k2": 0.0, "f0": 0.0}
    assert damper("dominguez-type", c).model_at(CONDITIONS[1]).gamma == pytest.approx(share * 4e6, rel=1e-9)


def test_branches_of_lei_meet_where_quadratics_cross():
    c = {f"{name}{i}": 0.0 for name in ("cpo", "cpr", "fy", "v0") for i in range(3)} | {"f0": 0.0}
    c |= {"cpo0": 500.0, "cpr0": 100.0, "fy0": 20.0, "v00": 5.0}
    model = damper("lei-type", c).model_at(CONDITIONS[0])
    slope = 1.01 * 500 + 1
    wanted = type(model).from_wereley(500.0, slope, 20.0, 0.999 * 20 / slope, 0.0)
    assert model.values() == pytest.approx(wanted.values(), rel=1e-12)
    weak = damper("lei-type", {**c, "cpo0": -5.0, "cpr0": 900.0, "fy0": -3.0, "v00": -1.0}).model_at(CONDITIONS[0])
    assert weak.values() == pytest.approx(type(model).from_wereley(0.0, 900.0, 1.0, 0.0, 0.0).values(), rel=1e-12)


def test_one_current_gives_a_level_and_no_slope():
    values = np.array([1.0, 2.0, 9.0])
    assert dominguez._line(np.full(3, 0.5), values) == pytest.approx([0.0, 4.0])  # of least squares: the mean
    assert dominguez._line(np.array([0.0, 1.0, 2.0]), 3 * np.arange(3.0) + 1) == pytest.approx([3.0, 1.0])


def test_lv_starts_at_the_damping_and_speed_of_the_middle_run():
    """One run far from the others does not move the start; the stress at one speed is that of the viscous force."""
    runs = [
        SimpleNamespace(condition=Condition(I, f, 0.01), model=SimpleNamespace(values=lambda c=c, I=I: {
            "c": c, "fy": 100 + 200 * I, "f0": 5.0}))
        for I, f, c in ((0.0, 1.0, 800.0), (0.5, 2.0, 900.0), (1.0, 9.0, 9000.0))
    ]  # fmt: skip
    start = all_published()["lv-type"].start(runs, REFERENCE)
    speed = 2 * np.pi * 2.0 * 0.01
    assert math.exp(start["consistency_log"]) == pytest.approx(900.0 * speed**0.2 / 3)
    assert [start[f"fy{i}"] for i in range(3)] == pytest.approx([100.0, 200.0, 0.0], abs=1e-6)
    assert (start["m"], start["f0"]) == (0.8, 5.0)


@pytest.mark.parametrize(("given", "index"), [(0.01, 0.1), (7.0, 2.0), (0.6, 0.6)])
def test_the_flow_index_of_lv_is_kept_physical(given, index):
    c = {"fy0": 150.0, "fy1": 0.0, "fy2": 0.0, "m": given, "consistency_log": math.log(2500.0), "f0": 0.0}
    model = damper("lv-type", c).model_at(CONDITIONS[0])
    assert model.m == pytest.approx(index)
    assert model.vc == pytest.approx(min(max((150 / 2500) ** (1 / index), 1e-9), 1e6), rel=1e-9)
    stiff = damper("lv-type", {**c, "fy0": 1e12, "m": 0.5}).model_at(CONDITIONS[0])
    assert stiff.vc == 1e6
