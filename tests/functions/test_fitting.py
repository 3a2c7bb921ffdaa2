"""Fits beside NumPy's least squares, errors at left-out conditions beside refits, forms beside their formulas."""

from itertools import product
from math import exp
from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.data import Condition
from mrdamper.errors import IdentificationError
from mrdamper.statistics.functions import fitting
from mrdamper.statistics.functions.fitting import FunctionFit, assess, choose_function, fit_function, require_determined
from mrdamper.statistics.functions.forms import FORMS, ParameterFunction
from mrdamper.statistics.functions.selection import fold_groups


@pytest.mark.parametrize("name", [name for name, form in FORMS.items() if form.rate_bounds])
def test_rates_are_refined_from_the_three_best_points_of_a_grid_of_their_logarithms(monkeypatch, name):
    form, starts, refine = FORMS[name], [], fitting.least_squares
    monkeypatch.setattr(fitting, "least_squares", lambda f, u, *a, **k: starts.append(u) or refine(f, u, *a, **k))
    matrix = [(I, f, A) for I in (0.0, 0.3, 0.7, 1.5, 2.0) for f, A in ((0.5, 0.02), (1.0, 0.012), (3.0, 0.005))]
    I, f, A = np.array(matrix).T
    values = 3 + np.sin(9 * I + 5 * f + 300 * A)
    weight = np.linspace(1.0, 2.0, I.size)
    fitting._best_rates(form, I, f, A, values, weight)
    grid = np.array(list(product(*(np.linspace(*np.log(ends), 6) for ends in form.rate_bounds))))

    def left(u):
        table = form.columns(I, f, A, tuple(np.exp(u))) * weight[:, None]
        return np.sum((table @ np.linalg.lstsq(table, values * weight, rcond=None)[0] - values * weight) ** 2)

    best = sorted(left(u) for u in grid)[:3]
    assert [left(u) for u in starts] == pytest.approx(best, rel=1e-6)


I, f, A, r, s = 1.3, 0.7, 0.06, 0.9, 2.1  # no two products of their powers are alike
# Every form once more, term by term.
FORMULAS = {
    "constant": [1],
    "linear-current": [I, 1],
    "quadratic-current": [I * I, I, 1],
    "saturating-current": [I, I * exp(-r * I), 1],
    "decaying-current": [exp(-r * I), 1],
    "onset-current": [(1 + r * I) * exp(-r * I), 1],
    "linear-current-speed": [I, f * A, 1],
    "quadratic-current-linear-speed": [I * I, I, f * A, 1],
    "quadratic-current-speed": [I * I, I, f * f * A * A, f * A, 1],
    "viscous-paper": [I * I / (f * A), I / (f * A), f * A, 1, 1 / (f * A)],
    "mass-exponential": [I * I, I, exp(-r * f), 1],
    "mass-power": [I * I, I, f**-r, 1],
    "mass-inverse-square": [I * I, I, 1 / f**2, 1],
    "plane": [I * I, I, f, A, 1],
    "current-decay-frequency": [exp(-r * I) * exp(-s * f), exp(-r * I), 1],
}
RNG = np.random.default_rng(8)
CONDITIONS = [Condition(i, f, a) for i in (0.0, 0.4, 1.1, 2.0) for f, a in ((0.5, 0.05), (1.0, 0.02), (2.1, 0.02))]
CURRENT = np.array([c.current_A for c in CONDITIONS])
VALUES = 300 + 900 * CURRENT - 120 * CURRENT**2 + RNG.normal(0, 40, CURRENT.size)


def test_every_form_is_the_formula_it_names():
    assert set(FORMULAS) == set(FORMS)
    for name, terms in FORMULAS.items():
        rates = (r, s)[: len(FORMS[name].rate_bounds)]
        for k, term in enumerate(terms):
            unit = tuple(float(j == k) for j in range(len(terms)))
            assert ParameterFunction(name, unit, rates)(I, f, A) == pytest.approx(term, rel=1e-12), (name, k)
        whole = ParameterFunction(name, (2.0,) * len(terms), rates, log=True)(I, f, A)
        assert whole == pytest.approx(exp(2 * sum(terms)))


@pytest.mark.parametrize(
    ("form", "coefficients", "rates", "text"),
    [
        ("quadratic-current-speed", (1.0, -2.5, 3.0, 4.0, -5.0), (), "1 I^2 - 2.5 I + 3 f^2 A^2 + 4 f A - 5"),
        ("mass-power", (-1.188e7, 2.0, 3.0, 4.0), (0.5,), "-11.88e6 I^2 + 2 I + 3 f^-0.5 + 4"),
        ("current-decay-frequency", (1.0, 2.0, 3.0), (0.25, 7.0), "1 exp(-0.25 I) exp(-7 f) + 2 exp(-0.25 I) + 3"),
    ],
)
def test_a_function_reads_as_it_is_computed(form, coefficients, rates, text):
    assert ParameterFunction(form, coefficients, rates).formula == text
    assert ParameterFunction(form, coefficients, rates, log=True).formula == f"exp({text})"


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("log", [False, True])
def test_a_fit_is_that_of_weighted_least_squares_and_its_errors_those_of_refits(weighted, log):
    errors = np.where(np.arange(CURRENT.size) % 3 == 0, 60.0, 20.0) if weighted else None
    fit = fit_function("quadratic-current", CONDITIONS, np.exp(VALUES / 1e3) if log else VALUES, log=log,
                       uncertainty=errors)  # fmt: skip
    y = VALUES / 1e3 if log else VALUES
    # The most certain quarter counts 1; what is three times as uncertain counts a third.
    w = np.ones(y.size) if errors is None else 20.0 / errors
    assert fit.function.coefficients == pytest.approx(np.polyfit(CURRENT, y, 2, w=w).tolist())
    found = np.polyval(fit.function.coefficients, CURRENT)
    assert fit.r2 == pytest.approx(1 - np.sum((y - found) ** 2) / np.sum((y - np.mean(y)) ** 2))
    missed = []
    for i in range(y.size):
        rest = np.arange(y.size) != i
        missed.append(y[i] - np.polyval(np.polyfit(CURRENT[rest], y[rest], 2, w=w[rest]), CURRENT[i]))
    rms = np.sqrt(np.average(np.square(missed), weights=w**2))
    assert fit.left_out == pytest.approx(rms / np.std(y), rel=1e-6)


def test_searched_rates_are_charged_to_the_error_at_left_out_conditions():
    rate = 1.7
    y = 5 + 40 * np.exp(-rate * CURRENT) + 0.1 * RNG.standard_normal(CURRENT.size)
    fit = fit_function("decaying-current", CONDITIONS, y)
    (found,) = fit.function.rates
    columns = np.column_stack([np.exp(-found * CURRENT), np.ones(CURRENT.size)])
    assert found == pytest.approx(rate, rel=0.05)
    for other in (0.99 * found, 1.01 * found):  # no other rate is better
        moved = np.column_stack([np.exp(-other * CURRENT), np.ones(CURRENT.size)])
        costs = [np.sum((m @ np.linalg.lstsq(m, y)[0] - y) ** 2) for m in (columns, moved)]
        assert costs[0] < costs[1]
    hat = columns @ np.linalg.pinv(columns)
    missed = (y - hat @ y) / (1 - np.diag(hat))
    N = y.size
    assert fit.left_out == pytest.approx(np.sqrt(np.mean(missed**2)) / np.std(y) * N / (N - 1), rel=1e-6)


@pytest.mark.parametrize(("form", "rates"), [("linear-current", 0), ("decaying-current", 1)])
def test_errors_of_left_out_groups_are_those_of_refits_and_charged_for_rates(form, rates):
    """A fold of every kind is refitted without its values, at the rates of all; weights count in every error."""
    errors = np.where(np.arange(CURRENT.size) % 3 == 0, 60.0, 20.0)
    weight = fitting._weights(errors, len(CONDITIONS))
    found, beside = (fitting._fitted(f, CONDITIONS, VALUES, False, weight) for f in (form, "quadratic-current"))
    left_out = fitting._errors([found, beside], tuple(CONDITIONS))[0]
    w, y, N = 20.0 / errors, VALUES, VALUES.size
    first = CURRENT if not rates else np.exp(-found.fit.function.rates[0] * CURRENT)
    columns = np.column_stack([first, np.ones(N)])
    folds = fold_groups(CONDITIONS)
    assert set(left_out) == set(folds) == {"condition", "current", "motion"}
    for kind, groups in folds.items():
        missed = []
        for group in groups:
            rest = np.setdiff1d(np.arange(N), group)
            solved = np.linalg.lstsq(columns[rest] * w[rest, None], y[rest] * w[rest])[0]
            missed += [w[i] * abs(y[i] - columns[i] @ solved) for i in group]
        assert left_out[kind] == pytest.approx(np.array(missed) * N / (N - rates), rel=1e-6)


def test_a_form_that_breaks_a_law_of_physics_is_refused_with_its_reason():
    falling = 900.0 - 700 * CURRENT + 120 * CURRENT**2  # least at 2.9 A: negative beyond the tests
    free = choose_function(["constant", "linear-current", "quadratic-current"], CONDITIONS, falling)
    assert (free.function.form, free.refused) == ("quadratic-current", {})
    lawful = choose_function(["constant", "linear-current", "quadratic-current"], CONDITIONS, falling, dissipating="N")
    assert lawful.function.form == "constant"
    assert set(lawful.refused) == {"linear-current", "quadratic-current"}
    assert all("negative" in reason or "falls" in reason for reason in lawful.refused.values())
    # The smallest form stands where every form breaks a law.
    alone = choose_function(["constant"], CONDITIONS, -falling.clip(1.0), dissipating="N")
    assert (alone.function.form, alone.refused) == ("constant", {})


def test_a_yield_force_rises_with_the_current_before_the_tests_are_many():
    """Physics knows it: of three scattered values the line is taken where it rises, and the constant elsewhere."""
    few, values = [Condition(i, 1.0, 0.02) for i in (0.0, 1.0, 2.0)], np.array([300.0, 290.0, 330.0])

    def form(values, unit):
        return choose_function(["constant", "linear-current"], few, values, dissipating=unit).function.form

    assert (form(values, "N"), form(values, "N s/m"), form(values[::-1], "N")) == (
        "linear-current", "constant", "constant",
    )  # fmt: skip


def test_weights_count_in_the_search_of_rates_too():
    y = 5 + 40 * np.exp(-1.7 * CURRENT)
    spoiled, errors = y.copy(), np.full(y.size, 0.1)
    spoiled[4], errors[4] = y[4] + 30.0, 1e4
    fit = fit_function("decaying-current", CONDITIONS, spoiled, uncertainty=errors)
    assert fit.function.rates[0] == pytest.approx(1.7, rel=1e-3)
    assert fit_function("decaying-current", CONDITIONS, spoiled).function.rates[0] != pytest.approx(1.7, rel=1e-2)


def test_uncertainties_that_are_not_known_count_as_the_largest_known():
    errors = np.full(CURRENT.size, 10.0)
    errors[2], errors[5] = 40.0, np.nan
    known = np.where(np.isnan(errors), 40.0, errors)
    w = 10.0 / known
    fit = fit_function("linear-current", CONDITIONS, VALUES, uncertainty=errors)
    assert fit.function.coefficients == pytest.approx(np.polyfit(CURRENT, VALUES, 1, w=w).tolist())
    plain = np.polyfit(CURRENT, VALUES, 1).tolist()
    for nothing in (np.full(CURRENT.size, np.nan), np.zeros(CURRENT.size), np.full(CURRENT.size, 3.0)):
        alike = fit_function("linear-current", CONDITIONS, VALUES, uncertainty=nothing)
        assert alike.function.coefficients == pytest.approx(plain)


def test_no_value_counts_more_than_those_of_the_most_certain_quarter():
    errors = np.array([1e-9, *np.linspace(1, 4, CURRENT.size - 1)])
    w = np.quantile(errors, 0.25) / np.maximum(errors, np.quantile(errors, 0.25))
    fit = fit_function("linear-current", CONDITIONS, VALUES, uncertainty=errors)
    assert fit.function.coefficients == pytest.approx(np.polyfit(CURRENT, VALUES, 1, w=w).tolist())


@pytest.mark.parametrize("value", [0.0, 7.0])
def test_values_that_do_not_vary_have_no_variance_to_explain(value):
    values = np.full(CURRENT.size, value)
    fit = fit_function("constant", CONDITIONS, values)
    assert (fit.r2, fit.left_out) == (pytest.approx(np.nan, nan_ok=True), pytest.approx(0.0, abs=1e-12))
    for other in (values, values * (1 + 1e-11 * CURRENT)):
        assert np.isnan(assess(fit.function, CONDITIONS, other).r2)


def test_a_constant_knows_less_than_the_mean_of_all_and_explains_nothing():
    fit = fit_function("constant", CONDITIONS, VALUES)
    N = VALUES.size
    assert fit.r2 == pytest.approx(0.0, abs=1e-12)
    assert fit.left_out == pytest.approx(N / (N - 1))


def test_a_function_found_otherwise_is_assessed_by_the_values_beside_it():
    line = ParameterFunction("linear-current", (800.0, 310.0))
    missed = np.sum((VALUES - 310 - 800 * CURRENT) ** 2)
    assert assess(line, CONDITIONS, VALUES).r2 == pytest.approx(1 - missed / np.sum((VALUES - VALUES.mean()) ** 2))
    assert np.isnan(assess(line, CONDITIONS, VALUES).left_out)
    grown, target = ParameterFunction("linear-current", (0.8, 0.3), log=True), VALUES / 1e3
    missed = np.sum((target - 0.3 - 0.8 * CURRENT) ** 2)
    expected = 1 - missed / np.sum((target - target.mean()) ** 2)
    assert assess(grown, CONDITIONS, np.exp(target)).r2 == pytest.approx(expected)


def fits(monkeypatch, errors):
    """The form chosen where the errors of all are given, a value a condition; None is refused."""

    def fit(form, *args, **more):
        if errors[form.name] is None:
            raise IdentificationError(f"no {form.name}")
        function = SimpleNamespace(form=form.name)
        folds = {"condition": np.array(errors[form.name])}
        return SimpleNamespace(fit=FunctionFit(function, 0.0, 0.0), errors=folds)

    monkeypatch.setattr(fitting, "_fitted", fit)
    monkeypatch.setattr(fitting, "_errors", lambda tried, conditions: [one.errors for one in tried])
    return choose_function(errors, CONDITIONS, VALUES).function.form


def test_a_longer_form_must_win_by_a_standard_error(monkeypatch):
    uneven, even = [1.0, 2.0, 3.0], [0.9, 1.9, 2.9]
    assert fits(monkeypatch, {"quadratic-current": even, "constant": uneven}) == "quadratic-current"  # everywhere
    assert fits(monkeypatch, {"quadratic-current": [0.5, 2.2, 3.1], "constant": uneven}) == "constant"
    # A searched rate counts as a coefficient: three against two.
    assert fits(monkeypatch, {"decaying-current": uneven, "linear-current": uneven}) == "linear-current"
    assert fits(monkeypatch, {"constant": None, "quadratic-current": uneven}) == "quadratic-current"
    with pytest.raises(IdentificationError, match="no plane"):
        fits(monkeypatch, {"plane": None})
    with pytest.raises(IdentificationError, match="no form to choose from"):
        fits(monkeypatch, {})


def test_forms_the_conditions_cannot_tell_apart_are_refused_with_what_was_tested():
    one_speed = [Condition(i, 2.0, 0.01) for i in (0.0, 0.5, 1.0, 1.5, 2.0)]
    counts = "5 coefficients and they do not tell its terms apart: 5 currents, 1 frequencies, 1 amplitudes"
    with pytest.raises(IdentificationError, match=counts):
        fit_function("plane", one_speed, np.arange(5.0))
    with pytest.raises(IdentificationError, match="current-decay-frequency has 5 coefficients and 4 conditions: 4 cur"):
        fit_function("current-decay-frequency", one_speed[:4], np.arange(4.0))


@pytest.mark.parametrize(("count", "enough"), [(2, False), (3, True)])
def test_as_many_conditions_as_coefficients_are_enough(count, enough):
    few = [Condition(i, 1.0, 0.02) for i in (0.0, 1.0, 2.0)][:count]
    if enough:
        require_determined("quadratic-current", few)
        assert fit_function("quadratic-current", few, [1.0, 2.0, 5.0]).function.coefficients == pytest.approx((1, 0, 1))
        return
    with pytest.raises(IdentificationError, match="2 conditions"):
        require_determined("quadratic-current", few)
    with pytest.raises(IdentificationError, match=r"quadratic-current has 3 coefficients and 2 conditions: 2 currents"):
        fit_function("quadratic-current", few, [1.0, 2.0])


def test_terms_that_rest_on_the_scatter_of_a_rig_are_not_determined():
    scattered = [Condition(i, 1.0, 0.02 * (1 + 1e-6 * k)) for k, i in enumerate((0.0, 0.5, 1.0, 1.5, 2.0, 0.2))]
    with pytest.raises(IdentificationError, match="tell its terms apart"):
        require_determined("linear-current-speed", scattered)
    require_determined("linear-current-speed", [*scattered, Condition(1.0, 1.0, 0.021)])
    dark = [Condition(0.0, 1.0, 0.02)] * 5
    with pytest.raises(IdentificationError, match="tell its terms apart"):
        require_determined("linear-current", dark)
    with pytest.raises(IdentificationError, match="rates to search"):
        require_determined("decaying-current", CONDITIONS)


@pytest.mark.parametrize("eps", [1.5e-5, 2.5e-5])
def test_columns_are_told_apart_from_an_angle_on(eps):
    # Of unit vectors at a small angle ε the singular values are √2 and ε/√2: their ratio is ε/2, the limit 1e-5.
    assert fitting._determined(np.array([[1.0, 3.0], [0.0, 3 * eps]])) is (eps > 2e-5)


def test_a_refusal_counts_levels_to_a_micrometre():
    few = [Condition(0.5 * (k > 1), f, a) for k, (f, a) in enumerate([(1, 0.02), (2, 0.0200001), (3, 0.021)])]
    with pytest.raises(IdentificationError, match="2 currents, 3 frequencies, 2 amplitudes"):
        fit_function("plane", few, [1.0, 2.0, 3.0])


@pytest.mark.parametrize("seed", range(6))
def test_rates_are_the_best_of_all_though_the_error_has_several_valleys(seed):
    values = np.random.default_rng(seed).normal(0, 1, CURRENT.size)
    found = fit_function("decaying-current", CONDITIONS, values)
    least = min(
        float(np.sum((X @ np.linalg.lstsq(X, values, rcond=None)[0] - values) ** 2))
        for X in (np.column_stack([np.exp(-r * CURRENT), np.ones(CURRENT.size)]) for r in np.geomspace(0.2, 30, 400))
    )
    spread = float(np.sum((values - values.mean()) ** 2))
    assert found.r2 >= 1 - least / spread - 1e-6


def test_r2_of_small_values_and_errors_known_to_be_none():
    small = fit_function("linear-current", CONDITIONS, 1e-6 * VALUES)
    assert small.r2 == pytest.approx(fit_function("linear-current", CONDITIONS, VALUES).r2)
    assert small.r2 < 0.999
    # Where a quarter is without error nothing says what the others' are worth beside it.
    none = np.where(np.arange(CURRENT.size) % 3, 5.0, 0.0)
    assert fitting._weights(none, CURRENT.size).tolist() == [1.0] * CURRENT.size
    assert fitting._weights(np.full(3, np.nan), 3).tolist() == [1.0] * 3


def test_a_choice_hands_on_logarithm_and_uncertainty():
    values, errors = np.exp(0.01 * VALUES), np.where(CURRENT > 1, 100.0, 1.0)
    found = choose_function(("linear-current",), CONDITIONS, values, log=True, uncertainty=errors)
    alone = fit_function("linear-current", CONDITIONS, values, log=True, uncertainty=errors)
    assert found == alone
    assert found.function.log
    assert (
        found.function.coefficients
        != fit_function("linear-current", CONDITIONS, values, log=True).function.coefficients
    )


def test_functions_take_plain_lists():
    assert ParameterFunction("linear-current", (2.0, 1.0))([0.0, 1.0], 1, 0.02).tolist() == [1.0, 3.0]


def test_a_parameter_that_does_not_change_does_not_turn():
    assert ParameterFunction("constant", (2.0,)).turning_point(2.0, 1.0, 0.02) is None


@pytest.mark.parametrize(("top", "turn"), [(2.0, 1.5), (1.1, 1.5), (0.9, None), (6.0, 1.5)])
def test_a_parabola_turns_where_its_slope_is_zero_within_half_more_than_was_tested(top, turn):
    found = ParameterFunction("quadratic-current", (-1.0, 3.0, 0.0)).turning_point(top, 1.0, 0.02)
    assert found is None if turn is None else found == pytest.approx(turn, abs=1.5 * top / 600)
    early = ParameterFunction("quadratic-current", (-1.0, 0.4, 0.0)).turning_point(top, 1.0, 0.02)
    assert early == pytest.approx(0.2, abs=1.5 * top / 600)


@pytest.mark.parametrize("name", [name for name, form in FORMS.items() if form.rate_bounds])
def test_derivatives_by_the_rates_are_those_of_the_columns(name):
    form = FORMS[name]
    features = [np.array([getattr(c, n) for c in CONDITIONS]) for n in ("current_A", "frequency_Hz", "amplitude_m")]
    at = np.log([0.7, 1.3][: len(form.rate_bounds)])

    def columns(u):
        return form.columns(*features, tuple(np.exp(u)))

    slopes = form.slopes(columns(at), *features[:2], tuple(np.exp(at)))
    for k, step in enumerate(1e-5 * np.eye(at.size)):
        np.testing.assert_allclose(slopes[k], (columns(at + step) - columns(at - step)) / 2e-5, atol=1e-8)


def test_rates_are_settled_to_the_last_digits():
    """A search that ends by its cost knows them to half of the digits; a small error in the values shows it."""
    values = 200 + 900 * np.exp(-1.7 * CURRENT) + RNG.normal(0, 20, CURRENT.size)
    rate, near = (
        fit_function("decaying-current", CONDITIONS, values * (1 + e)).function.rates[0] for e in (0.0, 3e-13)
    )
    assert near == pytest.approx(rate, rel=1e-11)


def test_a_form_that_needs_every_condition_is_not_chosen():
    """Without a condition it knows nothing of it; its error there was rounding over rounding."""
    few, values = [CONDITIONS[i] for i in (0, 4, 6, 8, 11)], np.array([300.0, 640.0, 1290.0, 1310.0, 2080.0])
    assert fit_function("plane", few, values).left_out == np.inf
    dark = [Condition(i, 1.0, 0.02) for i in (0.0, 0.0, 0.0, 1.0)]  # the slope rests on the last
    assert fit_function("linear-current", dark, [1.0, 2.0, 3.0, 9.0]).left_out == np.inf
    assert choose_function(["constant", "linear-current", "plane"], few, values).function.form == "linear-current"
    assert choose_function(["constant"], few[:1], [3.0]).function.coefficients == (3.0,)
