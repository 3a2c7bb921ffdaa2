import numpy as np
import pint
import pytest

from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.data import Condition
from mrdamper.errors import IdentificationError, UnknownNameError
from mrdamper.models import all_models
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.statistics.functions.fitting import choose_function, fit_function
from mrdamper.statistics.functions.forms import FORMS, Form, ParameterFunction, features

MATRIX = [
    Condition(i, f, a)
    for i in (0.0, 0.5, 1.0, 1.5, 2.0)
    for f, a in ((1.0, 0.02), (1.5, 0.02), (2.0, 0.02), (0.5, 0.05), (1.0, 0.05), (1.5, 0.05))
]


@pytest.mark.parametrize("form", FORMS.values(), ids=lambda f: f.name)
def test_every_form_recovers_itself(form):
    rng = np.random.default_rng(4)
    coefficients = tuple(rng.uniform(0.5, 2.0, len(form.terms)))
    rates = tuple(float(np.sqrt(low * high)) for low, high in form.rate_bounds)
    truth = ParameterFunction(form.name, coefficients, rates)
    values = truth(*features(MATRIX))
    fit = fit_function(form, MATRIX, values)
    np.testing.assert_allclose(fit.function(*features(MATRIX)), values, rtol=1e-4)
    assert fit.r2 == pytest.approx(1.0, abs=1e-6) or form.name == "constant"


@pytest.mark.parametrize("form", FORMS.values(), ids=lambda f: f.name)
def test_coefficients_have_the_units_that_give_the_unit_of_the_parameter(form):
    function = ParameterFunction(form.name, (1.0,) * len(form.terms), (2.0,) * len(form.rate_bounds))
    units = function.units("N s/m")
    assert {*units[len(form.terms) :]} <= {"1/A", "1/Hz", "-"}
    for term, unit in zip(form.terms, map(pint.Unit, units), strict=False):
        power = term.frequency - (0 if term.power_f is None else 2.0)
        product = unit * pint.Unit("A") ** term.current * pint.Unit("Hz") ** power * pint.Unit("m") ** term.amplitude
        assert product == pint.Unit("N s/m")


def test_units_of_logarithmic_functions_and_rates():
    decaying = ParameterFunction("decaying-current", (1.0, 2.0), (3.0,), log=True)
    assert decaying.units("m") == ["-", "ln(m)", "1/A"]
    assert ParameterFunction("linear-current", (1.0, 2.0)).units("-") == ["1/A", "-"]
    for kind in all_models().values():
        known = {*kind.coordinates, *(info.name for info in kind.parameters())}
        assert set(kind.map_forms()) <= known


def test_logarithmic_functions_stay_positive():
    values = 1e-4 * np.exp(-np.array([c.current_A for c in MATRIX]))
    fit = fit_function("linear-current", MATRIX, values, log=True)
    assert fit.function(50.0, 1.0, 0.02) > 0
    assert fit.r2 == pytest.approx(1.0)


def test_too_few_currents_for_a_quadratic_are_refused():
    few = [c for c in MATRIX if c.current_A in (0.0, 1.0)]
    with pytest.raises(IdentificationError, match="2 currents"):
        fit_function("quadratic-current", few, np.arange(len(few)))


def test_choice_prefers_the_short_form_that_predicts():
    rng = np.random.default_rng(5)
    current = np.array([c.current_A for c in MATRIX])
    values = 100 + 50 * current + rng.normal(0, 3, current.size)
    chosen = choose_function(("constant", "linear-current", "quadratic-current", "plane"), MATRIX, values)
    assert chosen.function.form == "linear-current"
    assert 0 < chosen.left_out < 0.2


def test_a_line_does_not_turn():
    assert ParameterFunction("linear-current", (1.0, 0.0)).turning_point(2.0, 1.0, 0.02) is None


def test_forms_match_the_vectors(vectors):
    case = vectors["V09_parameter_functions"]
    k = case["coefficients"]
    force, beta, mass = k["F0"], k["beta"], k["m"]
    per_omega = k["sinphi"] / (2 * np.pi)
    functions = {
        "F0": ParameterFunction("quadratic-current-speed", tuple(force)),
        "c": ParameterFunction("viscous-paper", tuple(per_omega * np.array(force))),
        "m": ParameterFunction("mass-exponential", (mass[0], mass[1], mass[2], mass[4]), (mass[3],)),
        "alpha": ParameterFunction("plane", tuple(k["alpha"])),
        "beta": ParameterFunction("current-decay-frequency", (beta[0], beta[2], beta[4]), (beta[3], beta[1])),
    }
    for point in case["points"]:
        for name, function in functions.items():
            assert function(point["I"], point["f"], point["X"]) == pytest.approx(point[name], rel=1e-12), name


def test_wrong_number_of_coefficients_and_unknown_forms_are_refused():
    with pytest.raises(IdentificationError, match="it takes 2 and 0"):
        ParameterFunction("linear-current", (1.0,))
    with pytest.raises(UnknownNameError, match="did you mean plane"):
        ParameterFunction("plan", (1.0,))


def test_a_map_stops_at_physical_bounds():
    constant = {name: ParameterFunction("constant", (value,)) for name, value in
                {"yield_force": 500.0, "k1": 0.0, "k3": 0.0, "f0": 0.0}.items()}  # fmt: skip
    functions = {
        **constant,
        "yield_displacement": ParameterFunction("constant", (np.log(1e-4),), log=True),
        "c": ParameterFunction("linear-current", (-1000.0, 500.0)),
    }
    assert ParameterMap(BoucWen, functions).at(Condition(2.0, 1.0, 0.01)).c == 0.0


@pytest.mark.parametrize("form", FORMS.values(), ids=lambda f: f.name)
def test_a_form_counts_its_parameters_over_current_and_motion(form):
    """Terms that change with the motion follow it; the others, and their rates, are over the current."""
    rates = [1.3, 0.7][: len(form.rate_bounds)]
    motions = ((1.0, 0.02), (1.7, 0.031))
    here, elsewhere = (form.columns(np.array([0.8]), np.array([f]), np.array([a]), rates)[0] for f, a in motions)
    follows = here != elsewhere
    assert form.follows_motion == follows.any()
    assert [term.follows_motion for term in form.terms] == follows.tolist()
    over_current = [term for term, moved in zip(form.terms, follows, strict=True) if not moved]
    rates_of = {rate for term in over_current for rate in (term.decay_I, term.onset_I)} - {None}
    assert form.current_terms == len(over_current) + len(rates_of)
    assert form.current_terms + form.motion_terms == len(form.terms) + len(form.rate_bounds)


@pytest.mark.parametrize(
    ("name", "count"),
    [("constant", 1), ("linear-current", 2), ("saturating-current", 4), ("decaying-current", 3), ("onset-current", 3)],
)
def test_a_rate_over_the_current_is_a_parameter_of_its_law(name, count):
    assert (FORMS[name].current_terms, FORMS[name].motion_terms) == (count, 0)


def test_a_form_without_terms_has_no_column_but_every_condition():
    assert Form("absent", ()).columns(*features(MATRIX), ()).shape == (len(MATRIX), 0)
