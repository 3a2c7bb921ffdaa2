"""Models against independently computed numbers."""

import numpy as np
import pytest

from mrdamper.data import Condition
from mrdamper.errors import ParameterError
from mrdamper.models.bingham import Bingham
from mrdamper.models.biviscous import Biviscous
from mrdamper.models.dahl import Dahl
from mrdamper.models.guo import Guo
from mrdamper.models.herschel_bulkley import HerschelBulkley, flow_curve
from mrdamper.models.kwok import Kwok
from mrdamper.models.lugre import LuGre
from mrdamper.models.smooth_bingham import SmoothBingham
from mrdamper.models.spencer import Spencer
from mrdamper.physics.motion import Excitation, sine
from mrdamper.physics.simulation import simulate, steady_loop


@pytest.fixture
def static(vectors):
    case = vectors["V11_static"]
    zero = np.zeros(len(case["v"]))
    motion = Excitation(
        np.arange(zero.size) * 1.0, np.array(case["x"]), np.array(case["v"]), np.array(case["accel_sign"]), zero
    )
    return case, motion


def force(model, motion):
    return model.force(motion, model.state(motion))


def test_bingham_and_its_smooth_form(static):
    case, motion = static
    p = case["bingham"]["params"]
    np.testing.assert_allclose(force(Bingham(c=p["c"], fy=p["fc"], f0=p["f0"]), motion), case["bingham"]["F"])
    p = case["bingham_tanh"]["params"]
    smooth = SmoothBingham(c=p["c"], fy=p["fc"], vs=p["vs"], f0=p["f0"])
    np.testing.assert_allclose(force(smooth, motion), case["bingham_tanh"]["F"])


def test_kwok_at_three_currents(static):
    case, motion = static
    for entry in case["kwok"]:
        np.testing.assert_allclose(force(Kwok(**entry["params"]), motion), entry["F"])


def test_guo(static):
    case, motion = static
    p = case["guo"]["params"]
    model = Guo(fy=p["fy"], c=p["c"], kappa=p["kk"], v0=p["V0"], f0=p["f0"])
    np.testing.assert_allclose(force(model, motion), case["guo"]["F"])


def test_biviscous_in_the_published_letters(static):
    case, motion = static
    p = case["bivisc"]["params"]
    model = Biviscous.from_wereley(p["Cpo"], p["Cpr"], p["fy"], p["v0"])
    np.testing.assert_allclose(force(model, motion), case["bivisc"]["F"], atol=1e-10)
    assert model.cpr == pytest.approx(p["Cpr"])
    assert model.v0 == pytest.approx(p["v0"])
    with pytest.raises(ParameterError, match="the branches meet only if"):
        Biviscous.from_wereley(1000.0, 900.0, 600.0, 0.02)


def test_dahl_closed_forms(vectors):
    for case in vectors["V12_dahl"]:
        model = Dahl(kappa_x=0.0, kappa_w=case["beta"] ** -1, yield_displacement=1 / case["beta"])
        loop = steady_loop(model, Condition(0.0, 1.0, case["X"]), 20000)
        x, z = loop.excitation.displacement, loop.force
        assert z.max() == pytest.approx(case["Z_peak"], rel=1e-9)
        # The trapezoid over 20 000 samples cuts the corners at the reversals.
        assert np.sum((z[1:] + z[:-1]) / 2 * np.diff(x)) == pytest.approx(case["loop_area"], rel=1e-5)
        rising = loop.excitation.velocity > 0
        order = np.argsort(x[rising])
        np.testing.assert_allclose(
            np.interp(case["x"], x[rising][order], z[rising][order]), case["z_loading"], atol=1e-6 * case["Z_peak"]
        )


def test_spencer_at_constant_voltage(vectors):
    """Three published sets, with Spencer's letters: gamma goes with |v|."""
    group = vectors["V10_spencer"]
    for case in (c for c in group["cases"] if c["u0"] == c["V"]):
        s, u = group["params"][case["set"]], case["V"]
        model = Spencer.from_letters(
            c0=s["c0a"] + s["c0b"] * u,
            c1=s["c1a"] + s["c1b"] * u,
            k0=s["k0"],
            k1=s["k1"],
            alpha=s["aa"] + s["ab"] * u,
            gamma=s["gamma"],
            beta=s["beta"],
            A=s["A"],
            n=s["n"],
            x0=s["x0"],
        )
        found = simulate(model, sine(Condition(0.0, case["f"], case["X"]), 2, 2000)).force
        index = np.round(np.array(case["t"]) * case["f"] * 2000).astype(int)
        np.testing.assert_allclose(found[index], case["F"], atol=1e-6 * np.ptp(found))


def test_spencers_letters_come_back_with_any_a():
    letters = {
        "c0": 2100.0, "c1": 28300.0, "k0": 4690.0, "k1": 500.0, "alpha": 14000.0, "gamma": 3.63e6, "beta": 2e6,
        "A": 301.0, "n": 2.0, "x0": 0.143,
    }  # fmt: skip
    model = Spencer.from_letters(**letters)
    assert model.to_letters(301.0) == pytest.approx(letters)
    motion = sine(Condition(0.0, 1.0, 0.01), 1, 200)
    again = Spencer.from_letters(**model.to_letters(1.0))
    np.testing.assert_allclose(force(again, motion), force(model, motion), rtol=1e-6, atol=1e-3)


def test_lugre(vectors):
    case = vectors["V13_lugre"]
    p = case["params"]
    model = LuGre.from_bristles(p["s0"], p["s1"], p["s2"], p["Fc"], p["Fs"], p["vs"])
    response = simulate(model, sine(Condition(0.0, case["f"], case["X"]), 1, 1000))
    index = np.round(np.array(case["t"]) * case["f"] * 1000).astype(int)
    np.testing.assert_allclose(response.state[index] * model.presliding, case["z"], atol=2e-9)
    np.testing.assert_allclose(response.force[index], case["F"], atol=1e-4)


def test_slot_flow_of_a_bingham_fluid(vectors):
    """P(T) of the cubic: the flow curve with m = 1, its force over the Newtonian one."""
    for case in vectors["V14_slot_flow"]["bingham_cubic"]:
        if case["T"] > 0:
            speed = np.array([1 / (6 * case["T"])])
            assert 2 * case["T"] * flow_curve(speed, 1.0)[0] == pytest.approx(case["P"], rel=1e-12)


def test_slot_flow_of_a_herschel_bulkley_fluid(vectors):
    """The published flow at a pressure gradient, read backwards: the force at that flow."""
    area, length = 1e-3, 0.05
    for case in vectors["V14_slot_flow"]["HB"]:
        if case["Q"] == 0:
            continue
        model = HerschelBulkley.from_slot(case["w"], case["h"], length, area, case["tauy"], case["K"], case["m"])
        speed = np.array([case["Q"] / area])
        motion = Excitation(np.zeros(1), np.zeros(1), speed, np.zeros(1), np.zeros(1))
        assert force(model, motion)[0] == pytest.approx(case["G"] * length * area, rel=1e-10)
