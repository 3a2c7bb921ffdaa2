"""Sensitivity in coordinates that no unit of length changes, and what presets cost."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.data import Condition
from mrdamper.errors import ParameterError, UnknownNameError
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper import sensitivity
from mrdamper.paper.sensitivity import one_at_a_time, sobol

MODEL = BoucWen(c=1440, alpha=9e5, beta=2e5, gamma=2e5, f0=120, k1=1382, k3=8243, m=15.0)


def test_a_preset_that_others_make_up_for_costs_nothing():
    found = {s.name: s for s in one_at_a_time(MODEL, Condition(0.7, 1.3, 0.05))}
    assert found["A"].effect > 0.01
    assert found["A"].left < 1e-9  # A is redundant: α, β, γ absorb it exactly
    assert found["n"].left < 0.01
    assert np.isnan(found["c"].left)


def test_sensitivity_does_not_depend_on_the_unit_of_length():
    """The same damper and motion, written in decimetres: every coordinate as sensitive."""
    short = BoucWen.build(
        {"c": 144.0, "yield_force": MODEL.yield_force, "yield_displacement": 10 * MODEL.yield_displacement, "f0": 120.0,
         "k1": 138.2, "k3": 8.243, "m": 1.5, "n": 2.0}
    )  # fmt: skip
    metres = one_at_a_time(MODEL, Condition(1.0, 1.0, 0.05))
    decimetres = one_at_a_time(short, Condition(1.0, 1.0, 0.5), refit=())
    for a, b in zip(metres, decimetres, strict=True):
        assert a.name == b.name
        assert b.effect == pytest.approx(a.effect, rel=1e-6), a.name


def test_sobol_indices_have_intervals_and_rank_like_single_changes():
    names = ("c", "yield_force", "m")
    found = sobol(MODEL, Condition(1.0, 1.0, 0.05), names, samples=64)
    single = {s.name: s.effect for s in one_at_a_time(MODEL, Condition(1.0, 1.0, 0.05), names, refit=())}
    assert [names[i] for i in np.argsort(found.total)] == sorted(names, key=single.get)
    assert np.all(found.total > -0.05)
    assert np.all((found.total_confidence > 0) & (found.total_confidence < 0.5))
    with pytest.raises(ParameterError, match=r"spread is 1\.5"):
        sobol(MODEL, Condition(1.0, 1.0, 0.05), spread=1.5)


def test_intervals_of_indices_are_drawn_the_same_every_time():
    first, again = (sobol(MODEL, Condition(1.0, 1.0, 0.05), ("c", "f0"), samples=8) for _ in range(2))
    assert first.first_confidence.tolist() == again.first_confidence.tolist()
    assert first.total_confidence.tolist() == again.total_confidence.tolist()


def test_indices_are_those_of_the_change_of_the_force(monkeypatch):
    """The RMS change of the viscous force and of the offset: of two changes the indices are those of their squares."""
    from scipy.stats import qmc  # half a second, for whoever collects it

    condition, given = Condition(0.7, 1.3, 0.05), []

    def indices(func, n):
        given.append(func)
        return SimpleNamespace(first_order=np.zeros(2), total_order=np.ones(2))

    monkeypatch.setattr("scipy.stats.sobol_indices", indices)
    found = sobol(MODEL, condition, ("c", "f0"), spread=0.1, samples=4)
    assert (found.first.tolist(), found.total.tolist()) == ([0, 0], [1, 1])
    points = np.split(qmc.Sobol(4, seed=np.random.default_rng(0)).random(4).T * 0.2 + 0.9, 2)
    viscous, offset = MODEL.c * 2 * np.pi * 1.3 * 0.05 / np.sqrt(2), MODEL.f0
    wanted = [np.hypot((c - 1) * viscous, (f0 - 1) * offset) for c, f0 in points[0].T]
    assert given[0]["f_A"][0] == pytest.approx(wanted, rel=5e-3)
    swapped = [np.hypot((c - 1) * viscous, (f0 - 1) * offset) for c, f0 in zip(points[1][0], points[0][1], strict=True)]
    assert given[0]["f_AB"][0, 0] == pytest.approx(swapped, rel=5e-3)


def test_what_is_left_is_of_the_changed_force(monkeypatch):
    condition, asked = Condition(0.7, 1.3, 0.05), []
    monkeypatch.setattr(
        sensitivity, "_left_after_refit", lambda model, changed, at: asked.append((model, changed.n, at)) or 0.3
    )
    (found,) = one_at_a_time(MODEL, condition, ("n",))
    assert (found.left, asked) == (0.3, [(MODEL, pytest.approx(1.1 * MODEL.n), condition)])
    monkeypatch.undo()
    other = replace(MODEL, f0=150.0)
    monkeypatch.setattr(
        sensitivity, "identify", lambda *_, **__: SimpleNamespace(model=replace(other, c=1500.0, f0=130.0))
    )
    left = sensitivity._left_after_refit(MODEL, other, condition)
    missed = np.hypot(60 * 2 * np.pi * 1.3 * 0.05 / np.sqrt(2), 20)
    assert left == pytest.approx(missed / np.std(loop_by_hand(other, condition)), rel=3e-3)


def test_the_effect_of_a_linear_parameter_is_that_of_its_own_force():
    condition = Condition(1.0, 1.0, 0.05)
    found = {s.name: s.effect for s in one_at_a_time(MODEL, condition, refit=())}
    velocity = 2 * np.pi * 0.05
    assert found["c"] / found["f0"] == pytest.approx(144 * velocity / np.sqrt(2) / 12, rel=0.01)
    assert found["m"] / found["f0"] == pytest.approx(1.5 * velocity * 2 * np.pi / np.sqrt(2) / 12, rel=0.01)
    doubled = {s.name: s.effect for s in one_at_a_time(MODEL, condition, change=0.2, refit=())}
    assert doubled["c"] == pytest.approx(2 * found["c"], rel=1e-9)


def loop_by_hand(model, condition, count=4096):
    """The steady force by many small steps of dz = v − β|v| |z|^(n−1) z − γ v |z|^n, over the last of three cycles."""
    t = np.arange(3 * count + 1) / count / condition.frequency_Hz
    omega, X = 2 * np.pi * condition.frequency_Hz, condition.amplitude_m
    x, v, a = X * np.sin(omega * t), X * omega * np.cos(omega * t), -X * omega**2 * np.sin(omega * t)
    z, beta, gamma, n = np.zeros(t.size), model.beta, model.gamma, model.n

    def rate(z, step):
        return step - beta * abs(step) * abs(z) ** (n - 1) * z - gamma * step * abs(z) ** n

    for i in range(t.size - 1):
        half = (x[i + 1] - x[i]) / 2
        middle = z[i] + rate(z[i], half)
        z[i + 1] = z[i] + rate(middle, 2 * half)
    force = model.c * v + model.k1 * x + model.k2 * x**2 + model.k3 * x**3 + model.m * a + model.f0 + model.alpha * z
    return force[-count:]


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("yield_force", {"alpha": 1.1 * 9e5}),
        # d = (β + γ)^(−1/n) grows by a tenth at the same α d.
        ("yield_displacement", {"alpha": 9e5 / 1.1, "beta": 2e5 / 1.21, "gamma": 2e5 / 1.21}),
        ("c", {"c": 1.1 * 1440}),
        ("k3", {"k3": 1.1 * 8243}),
        # (γ − β)/(γ + β) goes from 0 to 0.1 at the same sum.
        ("asymmetry", {"beta": 1.8e5, "gamma": 2.2e5}),
    ],
)
def test_the_effect_is_the_change_of_the_force_by_brute_integration(name, changed):
    condition = Condition(1.0, 1.3, 0.01)
    (found,) = one_at_a_time(MODEL, condition, (name,), refit=())
    base, other = loop_by_hand(MODEL, condition), loop_by_hand(replace(MODEL, **changed), condition)
    expected = np.sqrt(np.mean((other - base) ** 2)) / np.std(base)
    assert found.effect == pytest.approx(expected, rel=0.02)
    assert (found.name, found.change) == (name, 0.1)


def test_a_factor_of_v_acts_as_in_the_printed_equation():
    """dz = A v − β|v| |z| z − γ v z²: with y = z/A, α A takes the place of α, β A and γ A those of β and γ."""
    condition = Condition(1.0, 1.3, 0.01)
    (found,) = one_at_a_time(MODEL, condition, ("A",), refit=())
    base = loop_by_hand(MODEL, condition)
    other = loop_by_hand(replace(MODEL, alpha=1.1 * 9e5, beta=1.1 * 2e5, gamma=1.1 * 2e5), condition)
    assert found.effect == pytest.approx(np.sqrt(np.mean((other - base) ** 2)) / np.std(base), rel=0.02)


def test_an_asymmetry_at_its_end_stays_a_loop():
    steep = BoucWen.build({**MODEL.values(), "beta": 1e3, "gamma": 3.99e5})
    (found,) = one_at_a_time(steep, Condition(1.0, 1.0, 0.05), ("asymmetry",), refit=())
    assert np.isfinite(found.effect)
    assert sensitivity._varied(steep, {"asymmetry": 1.1}).shape.rho == pytest.approx(0.98)
    with pytest.raises(UnknownNameError, match="weight"):
        one_at_a_time(MODEL, Condition(1.0, 1.0, 0.05), ("weight",))


def test_what_is_left_is_the_misfit_of_the_best_loop_with_the_old_preset():
    condition = Condition(1.0, 1.0, 0.02)
    (found,) = one_at_a_time(MODEL, condition, ("n",), change=0.5, refit=("n",))
    assert 0 < found.left < found.effect
    (mild,) = one_at_a_time(MODEL, condition, ("n",), change=0.25, refit=("n",))
    assert mild.left < found.left


def test_first_order_indices_of_two_forces_add_up_and_follow_their_variance():
    found = sobol(MODEL, Condition(1.0, 1.0, 0.05), ("c", "f0"), spread=0.1, samples=256)
    assert found.names == ("c", "f0")
    assert found.first.sum() == pytest.approx(1.0, abs=0.1)
    assert np.all(found.total >= found.first - 0.1)
    assert found.first[0] > 0.8
