"""One rule between a smaller and a larger model, and what a function may not do."""

import numpy as np
import pytest

from mrdamper.data import Condition
from mrdamper.statistics.functions.forms import FORMS, ParameterFunction
from mrdamper.statistics.functions.selection import broken_law, fold_groups, mean_error, smaller_wins, supported

LEVELS, MOTIONS = (0.0, 0.5, 1.0, 1.5), ((0.5, 0.025), (1.0, 0.025), (2.0, 0.010))
MATRIX = [Condition(i, f, A) for i in LEVELS for f, A in MOTIONS]


def test_equal_errors_keep_the_smaller_model_and_a_clear_gain_the_larger():
    errors = {"condition": np.array([1.0, 2.0, 3.0]), "current": np.array([2.0, 4.0])}
    assert smaller_wins(errors, errors)
    half = {kind: values / 2 for kind, values in errors.items()}
    assert smaller_wins(half, errors)
    assert not smaller_wins({k: v + [0.1] * len(v) for k, v in errors.items()}, errors)


def test_false_alarms_are_as_rare_as_one_standard_error_says():
    """Two models of equal error: the larger one wins in about a sixth of the draws, by chance."""
    rng = np.random.default_rng(4)
    larger = np.mean([
        not smaller_wins({"condition": 1 + rng.normal(0, 0.1, 40)}, {"condition": 1 + rng.normal(0, 0.1, 40)})
        for _ in range(2000)
    ])  # fmt: skip
    assert 0.13 < larger < 0.19


def test_the_worst_kind_of_fold_has_a_say():
    small = {"condition": np.full(20, 1.0), "current": np.array([5.0, 5.2, 5.1])}
    large = {"condition": np.full(20, 2.0), "current": np.array([4.6, 4.8, 4.7])}
    assert mean_error(small) < mean_error(large)
    assert not smaller_wins(small, large)  # better on the whole, worse where it is worst


def test_few_scattered_units_do_not_hide_what_many_show():
    generator = np.random.default_rng(4)
    large = {"condition": 0.3 + 0.05 * generator.random(30), "current": np.array([1.0, 2.4, 0.4])}
    small = {"condition": 4 * large["condition"], "current": np.array([2.9, 1.0, 1.2])}
    assert not smaller_wins(small, large)
    assert smaller_wins({**small, "condition": large["condition"]}, large)


def test_an_error_without_end_never_wins():
    finite, endless = {"condition": np.array([1.0])}, {"condition": np.array([np.inf])}
    assert smaller_wins(finite, endless)
    assert not smaller_wins(endless, finite)


def test_a_form_has_a_parameter_fewer_than_levels_and_two_fewer_than_motions():
    named = {name: supported(form, MATRIX) for name, form in FORMS.items()}
    assert named["quadratic-current"]
    assert named["linear-current-speed"]
    assert not named["quadratic-current-speed"]  # two parameters over three motions
    three = [c for c in MATRIX if c.current_A < 1.2]
    assert not supported(FORMS["quadratic-current"], three)
    two = [c for c in MATRIX if c.current_A < 0.7]
    assert supported(FORMS["linear-current"], two)
    assert not supported(FORMS["linear-current"], [c for c in MATRIX if c.current_A == 0.0])


def test_folds_leave_out_conditions_inner_currents_and_motions():
    groups = fold_groups(MATRIX * 2)
    assert [len(group) for group in groups["condition"]] == [2] * 12
    assert [MATRIX[group[0]].current_A for group in groups["current"]] == [0.5, 1.0]
    assert len(groups["motion"]) == 3


@pytest.mark.parametrize(
    ("form", "coefficients", "unit", "reason"),
    [
        ("linear-current", (100.0, 10.0), "N", ""),
        ("linear-current", (-100.0, 120.0), "N s/m", "negative at 1.8 A"),
        ("linear-current-speed", (1.0, -1e5, 500.0), "N s/m", "negative at 0 A"),
        ("quadratic-current", (500.0, -500.0, 300.0), "N", "falls with the current"),
        ("quadratic-current", (-400.0, 1000.0, 300.0), "N", "falls with the current"),  # from 1.25 A
        ("quadratic-current", (500.0, -200.0, 300.0), "N s/m", "no test shows"),
        ("quadratic-current", (500.0, -700.0, 300.0), "N s/m", ""),  # falls and rises at the tests themselves
    ],
)
def test_a_function_that_breaks_a_law_is_named(form, coefficients, unit, reason):
    said = broken_law(ParameterFunction(form, coefficients), MATRIX, unit)
    assert reason in said
    assert bool(said) == bool(reason)
