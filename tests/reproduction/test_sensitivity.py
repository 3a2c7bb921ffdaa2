"""Sensitivity in coordinates that no unit of length changes, and what presets cost."""

import numpy as np
import pytest

from mrdamper.data import Condition
from mrdamper.errors import ParameterError
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.reproduction.sensitivity import one_at_a_time, sobol

MODEL = BoucWen(c=1440, alpha=9e5, beta=2e5, gamma=2e5, f0=120, k1=1382, k3=8243, m=15.0)


def test_a_preset_that_others_make_up_for_costs_nothing():
    found = {s.name: s for s in one_at_a_time(MODEL, Condition(1.0, 1.0, 0.05))}
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
    pytest.importorskip("SALib")
    names = ("c", "yield_force", "m")
    found = sobol(MODEL, Condition(1.0, 1.0, 0.05), names, samples=128)
    single = {s.name: s.effect for s in one_at_a_time(MODEL, Condition(1.0, 1.0, 0.05), names, refit=())}
    assert [names[i] for i in np.argsort(found.total)] == sorted(names, key=single.get)
    assert np.all(found.total > -0.05)
    assert np.all((found.total_confidence > 0) & (found.total_confidence < 0.5))
    with pytest.raises(ParameterError, match="spread is 2"):
        sobol(MODEL, Condition(1.0, 1.0, 0.05), spread=2.0)


def test_the_effect_of_a_linear_parameter_is_that_of_its_own_force():
    condition = Condition(1.0, 1.0, 0.05)
    found = {s.name: s.effect for s in one_at_a_time(MODEL, condition, refit=())}
    velocity = 2 * np.pi * 0.05
    assert found["c"] / found["f0"] == pytest.approx(144 * velocity / np.sqrt(2) / 12, rel=0.01)
    assert found["m"] / found["f0"] == pytest.approx(1.5 * velocity * 2 * np.pi / np.sqrt(2) / 12, rel=0.01)
    doubled = {s.name: s.effect for s in one_at_a_time(MODEL, condition, change=0.2, refit=())}
    assert doubled["c"] == pytest.approx(2 * found["c"], rel=1e-9)
