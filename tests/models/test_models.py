"""Laws every model in the house obeys, found by discovery, and what is particular to the first two."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrdamper.data import Condition
from mrdamper.errors import ParameterError, UnknownNameError
from mrdamper.models import all_models, model_type
from mrdamper.models.bingham import Bingham
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.models.lugre import LuGre
from mrdamper.models.spencer import Spencer
from mrdamper.physics.hysteresis import loop_harmonics
from mrdamper.physics.motion import Excitation, sine
from mrdamper.physics.simulation import simulate, steady_loop


@pytest.mark.parametrize("model", all_models().values(), ids=lambda m: m.name)
def test_every_parameter_states_unit_meaning_and_bounds(model):
    infos = model.parameters()
    assert infos
    for info in infos:
        assert info.unit
        assert info.meaning
        assert info.bounds[0] < info.bounds[1]
    assert model.title
    assert model.equation
    assert model.source


def test_unknown_model_offers_near_names():
    with pytest.raises(UnknownNameError, match="did you mean bouc-wen"):
        model_type("boucwen")


def test_parameters_outside_physics_are_refused():
    with pytest.raises(ParameterError, match=r"c = -1 N s/m; post-yield viscous damping lies between 0"):
        Bingham(c=-1, fy=10)
    with pytest.raises(ParameterError):
        BoucWen(c=1, alpha=1, beta=np.nan, gamma=0)


bouc_wen = st.builds(
    lambda c, fy, length, asymmetry, n, f0: BoucWen.build(
        {"c": c, "yield_force": fy, "yield_displacement": length, "asymmetry": asymmetry, "n": n, "f0": f0}
    ),
    st.floats(0, 5e3),
    st.floats(1, 3e3),
    st.floats(1e-5, 5e-3),
    st.floats(-0.9, 0.9),
    st.sampled_from([1.0, 2.0, 3.0]),
    st.floats(-100, 100),
)
somewhere = Condition(0.5, 1.0, 0.01)


@settings(max_examples=30, deadline=None)
@given(model=bouc_wen)
def test_dissipated_energy_is_viscous_plus_hysteretic(model):
    """W = π c ω X² + f_z ∮ζ dx: springs, mass and offset take nothing."""
    loop = steady_loop(model, somewhere, samples_per_cycle=4000)
    x, force = loop.excitation.displacement, loop.force
    area = float(np.sum((force[1:] + force[:-1]) / 2 * np.diff(x)))
    viscous = np.pi * model.c * 2 * np.pi * 0.01**2
    hysteretic = model.yield_force * np.pi * 0.01 * loop_harmonics(model.shape, 0.01, [1])[1][0]
    # The trapezoid cuts the corner at the reversal, within the yield displacement.
    assert area == pytest.approx(viscous + hysteretic, rel=2e-3, abs=1e-6)


@settings(max_examples=30, deadline=None)
@given(model=bouc_wen)
def test_without_offset_and_even_stiffness_the_loop_is_odd(model):
    loop = steady_loop(model, somewhere, samples_per_cycle=400)
    force = loop.force - model.f0
    scale = np.abs(force).max()
    np.testing.assert_allclose(force[200:401], -force[:201], atol=1e-7 * scale)


def test_force_does_not_depend_on_the_sampling():
    model = BoucWen.build({"c": 1e3, "yield_force": 500.0, "yield_displacement": 2e-4})
    coarse, fine = sine(somewhere, 3, 400), sine(somewhere, 3, 4000)
    a, b = simulate(model, coarse).force, simulate(model, fine).force[::10]
    np.testing.assert_allclose(a, b, atol=1e-6 * 500)


def test_coordinates_and_parameters_are_two_ways_to_say_the_same():
    model = BoucWen.build({"c": 1.0, "yield_force": 800.0, "yield_displacement": 3e-4, "asymmetry": 0.2, "n": 3.0})
    assert model.yield_force == pytest.approx(800.0)
    assert model.yield_displacement == pytest.approx(3e-4)
    assert BoucWen(**model.values()) == model
    assert BoucWen.build({"c": 1.0, "alpha": 1.0, "beta": 5.0}).gamma == 5.0


def test_stiff_bouc_wen_becomes_bingham():
    """β → ∞ at constant yield force; away from reversals nothing is left of the knee."""
    motion = sine(somewhere, 2, 1000)
    moving = np.abs(motion.velocity) > 0.1 * np.abs(motion.velocity).max()
    stiff = BoucWen.build({"c": 900.0, "yield_force": 700.0, "yield_displacement": 1e-7, "f0": 30.0})
    force = simulate(Bingham(c=900.0, fy=700.0, f0=30.0), motion).force
    np.testing.assert_allclose(simulate(stiff, motion).force[moving][5:], force[moving][5:], rtol=1e-9)


def test_full_model_matches_the_vectors(vectors):
    for case in vectors["V06_full_model_steady"]["cases"]:
        names = ("c", "m", "alpha", "beta", "gamma", "n", "f0", "k1", "k2", "k3")
        model = BoucWen(**{name: case[name] for name in names})
        loop = steady_loop(model, Condition(0.0, case["f"], case["X"]), samples_per_cycle=4800)
        theta = np.array(case["theta"]) % (2 * np.pi)
        index = np.round(theta / (2 * np.pi) * 4800).astype(int)
        exact = np.isclose(index * 2 * np.pi / 4800, theta, atol=1e-12)
        assert exact.sum() >= 8
        np.testing.assert_allclose(loop.force[index[exact]], np.array(case["F"])[exact], atol=2e-6 * case["F_max"])


def test_bingham_matches_the_vectors(vectors):
    case = vectors["V11_static"]
    params = case["bingham"]["params"]
    motion = Excitation(np.arange(len(case["v"])), np.array(case["x"]), np.array(case["v"]), 0.0, 0.0)
    model = Bingham(c=params["c"], fy=params["fc"], f0=params["f0"])
    np.testing.assert_allclose(model.force(motion, np.zeros(len(motion))), case["bingham"]["F"], rtol=1e-12)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Spencer.build(
            {"c1": 0.0, "c0": 1e2, "k0": 1.0, "yield_force": 1.0, "yield_displacement": 1e-4, "k1": 0.0, "f0": 0.0}
        ),
        lambda: Spencer.from_letters(c0=0, c1=1e4, k0=0, k1=0, alpha=0, gamma=1e6, beta=0, A=1),
        lambda: Spencer.from_letters(c0=1e2, c1=1e4, k0=0, k1=0, alpha=1e2, gamma=1e6, beta=0, A=1, n=0),
        lambda: LuGre.from_bristles(0.0, 1.0, 1.0, 1.0, 1.0, 1.0),
        lambda: LuGre.from_bristles(1e6, 1.0, 1.0, 0.0, 1.0, 1.0),
        lambda: BoucWen.build({"c": 1.0, "yield_force": 1.0, "yield_displacement": 0.0}),
        lambda: BoucWen.build({"c": 1.0, "yield_force": 1.0, "yield_displacement": 1e-3, "n": 0.0}),
        lambda: BoucWen.build({"c": 1.0, "yield_force": 1.0, "beta": 1e5, "n": 0.0}),
    ],
)
def test_a_zero_below_a_fraction_line_is_named(make):
    with pytest.raises(ParameterError):
        make()
