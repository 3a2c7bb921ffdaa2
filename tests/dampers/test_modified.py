"""Parameter functions through identified values: those the values were made with come back, and the paper's own."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.dampers import modified_damper

from mrdamper.dampers import modified
from mrdamper.dampers.bands import band, portable_band
from mrdamper.dampers.causal import causal_force
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.modified import ModifiedModel, fit_modified
from mrdamper.dampers.normal_equations import FormChoice, Law
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.dampers.uncertainty import Uncertainty
from mrdamper.data import Condition
from mrdamper.errors import IdentificationError, InputError
from mrdamper.exporters.equations import equations
from mrdamper.models.bingham import Bingham
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper.functions import PAPER_FORMS, paper_functions
from mrdamper.physics.motion import sine
from mrdamper.report.plots.model import parameter_curves
from mrdamper.statistics.functions.fitting import choose_function
from mrdamper.statistics.functions.forms import FORMS, ParameterFunction
from mrdamper.statistics.functions.motion_hull import MotionHull

MOTIONS = ((0.5, 0.05), (1.0, 0.02), (1.5, 0.05), (2.0, 0.02))
CONDITIONS = [Condition(I, f, A) for I in (0.0, 0.5, 1.2, 2.0) for f, A in MOTIONS]
SPEED = np.array([c.frequency_Hz * c.amplitude_m for c in CONDITIONS])
CURRENT = np.array([c.current_A for c in CONDITIONS])


def identified(make, conditions=CONDITIONS, rig="bench", errors=None):
    return [
        SimpleNamespace(model=make(c), condition=c, rig=rig, standard_errors={} if errors is None else errors[n])
        for n, c in enumerate(conditions)
    ]


def by_the_papers_laws(c):
    I, f, A = c.current_A, c.frequency_Hz, c.amplitude_m
    beta = math.exp(3 * math.exp(-1.5 * I - 0.4 * f) + 2 * math.exp(-1.5 * I) + 12)
    return BoucWen(
        c=(900 * I - 100 * I * I + 400 + 3e3 * f * A - 8e3 * (f * A) ** 2) / (f * A) / 10,
        m=2 * I * I - 9 * I + 30 * math.exp(-0.8 * f) + 4,
        alpha=2e5 + 7e4 * I - 9e3 * I * I + 1e4 * f - 5e5 * A,
        beta=beta, gamma=beta, f0=40.0, k1=700.0, k2=30.0, k3=9e3,
    )  # fmt: skip


def test_the_papers_functions_come_back_and_predict_where_nobody_tested():
    fit = paper_functions(identified(by_the_papers_laws))
    assert {name: f.function.form for name, f in fit.functions.items()} == dict(PAPER_FORMS)
    for name, found in fit.functions.items():
        if name in ("c", "m", "alpha", "beta"):
            assert found.r2 == pytest.approx(1.0, abs=1e-6), name
    # Only the last needs searched rates, which are found to a part in ten thousand.
    unseen = Condition(0.8, 1.2, 0.03)
    wanted, given = by_the_papers_laws(unseen), fit.damper.model_at(unseen)
    for name in ("c", "m", "alpha", "beta", "f0", "k1", "k2", "k3"):
        assert getattr(given, name) == pytest.approx(getattr(wanted, name), rel=1e-3), name
    assert (fit.damper.rig, fit.damper.envelope) == ("bench", Envelope.of(CONDITIONS))
    assert list(fit.conditions) == CONDITIONS
    assert fit.values["c"] == pytest.approx([by_the_papers_laws(c).c for c in CONDITIONS])


def test_a_rate_at_a_bound_of_its_search_is_stated():
    def fading(c):
        return replace(by_the_papers_laws(c), m=30.0 - 5.0 * c.frequency_Hz)  # a decay slower than any that is searched

    assert "m" not in paper_functions(identified(by_the_papers_laws)).at_bounds
    assert "m" in paper_functions(identified(fading)).at_bounds


@pytest.mark.parametrize("law", ["exponential", "inverse-square", "power"])
def test_the_law_of_the_mass_is_a_switch(law):
    assert paper_functions(identified(by_the_papers_laws), law).functions["m"].function.form == f"mass-{law}"


@pytest.mark.parametrize(
    ("currents", "form"), [((0.0, 1.0, 2.0), "quadratic-current"), ((0.0, 1.0), "linear-current"), ((1.0,), "constant")]
)
def test_at_one_motion_the_papers_functions_are_shorter(currents, form):
    conditions = [Condition(I, 1.0, 0.02) for I in currents]
    fit = paper_functions(identified(by_the_papers_laws, conditions))
    assert {fit.functions[name].function.form for name in ("c", "alpha", "m")} == {form}
    for condition in conditions:
        wanted = by_the_papers_laws(condition)
        assert fit.damper.model_at(condition).alpha == pytest.approx(wanted.alpha, rel=1e-6)


def linear(c):
    return Bingham(fy=150 + 900 * c.current_A, c=1500 + 2e3 * c.frequency_Hz * c.amplitude_m, f0=-12.0)


def test_forms_are_chosen_parameter_by_parameter():
    forms = {"fy": ("constant", "linear-current"), "c": ("constant", "linear-current-speed"), "f0": ("constant",)}
    fit = fit_modified(identified(linear), forms, {"method": "made"})
    assert [f.function.form for f in fit.functions.values()] == ["linear-current", "linear-current-speed", "constant"]
    unseen = Condition(0.7, 1.3, 0.03)
    assert fit.damper.model_at(unseen).values() == pytest.approx(linear(unseen).values(), rel=1e-6)
    assert (fit.damper.rig, fit.damper.provenance["method"]) == ("bench", "made")
    assert fit.damper.provenance["depends on frequency and amplitude"] == "c"
    assert fit.damper.envelope == Envelope.of(CONDITIONS)
    assert fit.values["fy"] == pytest.approx(150 + 900 * CURRENT)
    assert list(fit.conditions) == CONDITIONS
    assert "method" not in fit_modified(identified(linear), forms).damper.provenance


def test_up_to_ten_motions_have_a_curve_each_and_near_ones_are_one():
    def curves(count, step):
        conditions = [Condition(0.0, 1.0 * step**k, 0.02) for k in range(count)]
        fit = fit_modified(identified(linear, conditions), {name: ("constant",) for name in ("fy", "c", "f0")})
        return len(parameter_curves(fit).axes[0].series)

    assert curves(10, 1.3) == 20
    assert curves(11, 1.3) == 12
    assert curves(11, 1.001) == 2


def test_certain_values_count_more_and_of_a_logarithm_relatively():
    def wild(c):
        return BoucWen.build({"c": 1e3, "yield_force": 500.0 + 100 * (c == CONDITIONS[3]), "f0": 0.0,
                              "yield_displacement": (3 if c == CONDITIONS[3] else 1) * 1e-4})  # fmt: skip

    errors = [{"yield_force": 1.0, "yield_displacement": 1e-6} for _ in CONDITIONS]
    errors[3] = {"yield_force": 1e3, "yield_displacement": 1e-1}
    forms = {name: ("constant",) for name in ("yield_force", "yield_displacement", "c", "f0", "k1", "k3")}
    model = fit_modified(identified(wild, errors=errors), forms).damper.model_at(CONDITIONS[0])
    assert model.yield_force == pytest.approx(500.0, abs=0.01)
    assert model.yield_displacement == pytest.approx(1e-4, rel=1e-4)
    told = []

    def spy(*args, **more):
        told.append((more["log"], more["uncertainty"]))
        return choose_function(*args, **more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(modified, "choose_function", spy)
        fit_modified(identified(wild, errors=errors), forms)
    assert [log for log, _ in told] == [False, True, False, False, False, False]
    assert told[0][1][[0, 3]] == pytest.approx([1.0, 1e3])
    assert told[1][1][[0, 3]] == pytest.approx([1e-6 / 1e-4, 1e-1 / 3e-4])
    assert np.isinf(told[2][1]).all()


def test_the_equation_says_how_coordinates_stand_for_parameters():
    model = modified_damper()
    relations = [BoucWen.coordinates[name][1] for name in ("yield_force", "yield_displacement")]
    assert model.equation == r",\quad ".join([BoucWen.equation, *relations])
    assert damper().equation == Bingham.equation


def test_a_joint_fit_is_made_of_forms_without_rates_but_for_the_shape(monkeypatch):
    asked = {}
    functions = {"yield_displacement": ParameterFunction("constant", (-7.0,), log=True),
                 "c": ParameterFunction("constant", (1e3,))}  # fmt: skip
    parameters = ParameterMap(BoucWen, functions)

    class Data:
        shape, conditions, model_type = "yield_displacement", tuple(CONDITIONS), BoucWen
        linear = ("c", "yield_force", "k1", "k3", "f0", "m")

        def only(self, rows):
            asked.update(rows=rows)
            return "part"

    def chosen(data, candidates, shapes, dissipating):
        asked.update(candidates=candidates, shapes=shapes, dissipating=dissipating)
        forms, fit = dict.fromkeys(functions, Law("constant")), SimpleNamespace(parameters=parameters, at_bounds=("c",))
        return FormChoice(forms, fit, {"c: plane": "negative at 0 A"})

    def condensed(runs, cls, more):
        asked.update(runs=runs, cls=cls, more=more)
        return Data()

    monkeypatch.setattr(modified, "_condensed", condensed)
    monkeypatch.setattr(modified, "choose_forms", chosen)
    monkeypatch.setattr(modified, "fit_jointly", lambda part, forms, start: SimpleNamespace(parameters=parameters))
    rows = SimpleNamespace(of=lambda c: SimpleNamespace(condition=c, sine=c))
    monkeypatch.setattr(modified, "RunRows", rows)
    fit, refit = modified.fit_modified_jointly(tuple(CONDITIONS), identified(by_the_papers_laws), {"a": "b"})
    lengths = [by_the_papers_laws(c).yield_displacement for c in CONDITIONS]
    assert (asked["runs"], asked["cls"], asked["more"]) == (tuple(CONDITIONS), BoucWen, ("m",))
    assert asked["dissipating"]["yield_force"] == "N"
    assert fit.refused == {"c: plane": "negative at 0 A"}
    assert asked["shapes"] == pytest.approx(np.array(lengths))
    for name, forms in BoucWen.map_forms().items():
        rated = [form for form in forms if FORMS[form].rate_bounds]
        free = [law.name for law in asked["candidates"][name] if not law.rates and law.form.rate_bounds]
        held = [law for law in asked["candidates"][name] if law.rates]
        assert free == (rated if name == "yield_displacement" else [])
        decays = {"decaying-current"} if name in ("c", "yield_force") else set()
        assert {form for form, _ in held} == decays | ({"onset-current"} if name == "yield_force" else set())
        assert {Law(form) for form in set(forms) - set(rated)} <= set(asked["candidates"][name])
    assert fit.values["c"] == pytest.approx([by_the_papers_laws(c).c for c in CONDITIONS])
    assert (fit.conditions, fit.at_bounds) == (tuple(CONDITIONS), ("c",))
    assert (fit.damper.rig, fit.damper.provenance["a"], set(fit.functions)) == ("bench", "b", set(functions))
    again = refit([0, 5])
    assert (asked["rows"], again.envelope) == ([0, 5], Envelope.of([CONDITIONS[0], CONDITIONS[5]]))


@pytest.mark.parametrize("any_motion", [True, False])
def test_decays_are_tried_relative_to_the_highest_current_where_a_parameter_may_change(any_motion):
    def candidates(model, highest):
        conditions = [Condition(I * highest, 1.0, 0.02) for I in (0.0, -1.0, 0.5)]
        data = SimpleNamespace(conditions=conditions, model_type=model, shape="yield_displacement", linear=("m",))
        return modified._candidates(data, any_motion)

    rates, onset_rates = [0.4, 0.8, 1.5, 2.5, 4.0], [1.2, 2.4, 4.0, 6.0, 9.0]
    for model in (BoucWen, Bingham):
        for highest, given in (
            (2.0, candidates(model, 2.0)),
            (5.0, candidates(model, 5.0)),
            (1.0, candidates(model, 0)),
        ):
            for name, forms in model.map_forms().items():
                plain = [law.name for law in given[name] if not law.rates]
                tried = [law for law in given[name] if law.rates]
                assert plain == [
                    f for f in forms
                    if (any_motion or not FORMS[f].follows_motion)
                    and (name == "yield_displacement" or not FORMS[f].rate_bounds)
                ]  # fmt: skip
                may = name in ("c", "yield_force", "fy") and len(plain) > 1
                onset = may and name != "c"
                assert tried == [
                    *([("decaying-current", (pytest.approx(r / highest),)) for r in rates] if may else []),
                    *([("onset-current", (pytest.approx(r / highest),)) for r in onset_rates] if onset else []),
                ]
            assert "m" in given


def test_a_function_that_is_meant_for_larger_amplitudes_is_followed_to_twice_the_tested():
    damped, constant = damper(), ParameterFunction("constant", (1.0,))
    parts = {name: constant for name in ("c", "fy", "f0")}

    def followed(functions):
        return replace(damped, parameters=replace(damped.parameters, functions=functions)).followed_amplitudes

    low, high = damped.envelope.amplitude_m
    viscous = ParameterFunction("viscous-paper", (1.0,) * len(FORMS["viscous-paper"].terms))
    assert followed(parts) == (low, high)
    assert followed(parts | {"c": viscous}) == (low, 2 * high)


def test_identifications_of_two_models_or_rigs_are_refused():
    here, there = identified(linear), identified(linear, rig="other")
    with pytest.raises(IdentificationError, match="1 models and 2 rigs"):
        fit_modified([*here, *there])
    with pytest.raises(IdentificationError, match="2 models and 1 rigs"):
        fit_modified([*here, *identified(by_the_papers_laws)])
    with pytest.raises(IdentificationError, match="no identifications"):
        fit_modified([])


def damper():
    functions = {
        "fy": ParameterFunction("linear-current", (900.0, 150.0)),
        "c": ParameterFunction("decaying-current", (0.5, 7.0), (2.0,), log=True),
        "f0": ParameterFunction("constant", (-12.0,)),
    }
    return ModifiedModel(
        ParameterMap(Bingham, functions), rig="bench", envelope=Envelope.of(CONDITIONS), provenance={"a": "b"}
    )


def test_a_saved_model_is_the_same_again_and_numbers_have_their_places():
    one, at = damper(), Condition(0.7, 1.0, 0.02)
    again = ModifiedModel.from_saved(one.to_saved(), rig="bench", envelope=one.envelope, provenance={"a": "b"})
    assert again.model_at(at).values() == one.model_at(at).values()
    assert (again.rig, again.envelope, dict(again.provenance)) == (one.rig, one.envelope, {"a": "b"})
    assert one.model_at(at).values() == pytest.approx(
        {**Bingham(fy=780.0, c=math.exp(0.5 * math.exp(-1.4) + 7), f0=-12.0).values()}
    )
    assert {name: number.value for name, number in one.fitted_parameters.items()} == {
        "fy.0": 900.0, "fy.1": 150.0, "c.0": 0.5, "c.1": 7.0, "c.2": 2.0, "f0.0": -12.0,
    }  # fmt: skip
    moved = one.with_parameters({"c.2": 3.0, "fy.1": 160.0})
    assert moved.functions["c"].rates == (3.0,)
    assert moved.functions["c"].coefficients == (0.5, 7.0)
    assert moved.functions["fy"].coefficients == (900.0, 160.0)
    assert one.parameter_count == 6


def test_a_held_parameter_is_that_value_everywhere():
    held = damper().holding({"c": 1234.0, "fy": 10.0}).model_at(Condition(2.0, 3.0, 0.01))
    assert (held.c, held.fy, held.f0) == pytest.approx((1234.0, 10.0, -12.0))
    with pytest.raises(InputError, match="k9"):
        damper().holding({"k9": 1.0})


def test_what_follows_a_logarithm_is_held_over_zero_only():
    assert modified_damper().holding({"yield_displacement": 1e-3}).functions["yield_displacement"].log
    with pytest.raises(InputError) as refused:
        modified_damper().holding({"yield_displacement": 0.0})
    assert refused.value.code == "E_PARAMETER"


CORNERS = ((0.5, 0.02), (3.0, 0.004), (1.0, 0.02))


@pytest.mark.parametrize("outside", [(3.0, 0.02), (0.5, 0.004), (10.0, 0.001)])
def test_outside_the_tested_motions_the_parameters_are_those_of_the_nearest_one(outside):
    slope = ParameterFunction("linear-current-speed", (100.0, 5e4, 300.0))
    functions = {"c": slope, "fy": slope, "k": ParameterFunction("constant", (0.0,)), "f0": slope}
    functions = {name: f for name, f in functions.items() if name in Bingham.map_forms()}
    motions = MotionHull(CORNERS)
    damper = ModifiedModel(ParameterMap(Bingham, functions, motions), rig="bench", envelope=Envelope.of(CONDITIONS))
    nearest = Condition(0.7, *(float(v) for v in motions.nearest(*outside)))
    assert damper.model_at(Condition(0.7, *outside)) == damper.model_at(nearest)
    assert damper.holding({"c": 700.0}).tested_motions == motions
    again = ModifiedModel.from_saved(damper.to_saved(), rig="bench", envelope=damper.envelope)
    assert again.parameters.motions == motions
    assert any("convex hull" in line for line in equations(damper))


def test_a_stream_holds_the_parameters_outside_the_tested_motions_too():
    slope = ParameterFunction("linear-current-speed", (100.0, 5e4, 300.0))
    still = ParameterFunction("constant", (0.0,))
    functions = {name: slope if name in ("c", "fy") else still for name in Bingham.map_forms()}
    tested = [Condition(i, f, A) for i in (0.0, 1.0) for f, A in CORNERS]
    damper = ModifiedModel(ParameterMap(Bingham, functions, MotionHull(CORNERS)), envelope=Envelope.of(tested))
    outside = Condition(0.7, 2.5, 0.018)
    motion = sine(outside, 40, 200)
    wanted, streamed = damper.force_along(motion, outside), causal_force(damper, motion)
    last = slice(-400, None)
    assert np.abs(streamed - wanted)[last].max() < 0.01 * np.ptp(wanted[last])
    free = replace(damper, parameters=replace(damper.parameters, motions=None))
    assert np.ptp(free.force_along(motion, outside)) > 1.1 * np.ptp(wanted)


@pytest.mark.parametrize("follows", [True, False])
def test_where_only_sines_were_tested_another_motion_may_have_the_parameters_of_any_of_them(follows):
    slope = ParameterFunction("linear-current-speed", (100.0, 5e4, 300.0))
    still = ParameterFunction("constant", (300.0,))
    functions = {name: slope if follows and name in ("c", "fy") else still for name in Bingham.map_forms()}
    tested = [Condition(i, f, A) for i in (0.0, 1.0) for f, A in CORNERS]
    known = Uncertainty((), (), np.zeros((0, 0)), np.zeros(0), run_gain=0.01, run_offset=3.0, run_dof=9.0, force=0.02)
    parameters, envelope = ParameterMap(Bingham, functions, MotionHull(CORNERS)), Envelope.of(tested)
    damper = ModifiedModel(parameters, envelope=envelope, uncertainty=known)
    slow, fast = sine(Condition(0.7, 0.5, 0.012), 4, 2000), sine(Condition(0.7, 2.5, 0.003), 20, 400)
    summed = {n: getattr(slow, n) + getattr(fast, n) for n in ("displacement", "velocity", "acceleration")}
    motion = replace(slow, **summed)
    prediction = damper.predict(motion)
    assert prediction.untested_kind
    sines = [damper.force_along(motion, Condition(0.7, f, A)) for f, A in CORNERS]
    spread = np.mean((np.array(sines) - prediction.force) ** 2, axis=0) if follows else np.zeros(len(motion))
    wide, at_tests = band(damper, prediction), band(damper, replace(prediction, untested_kind=False))
    widths = [(each.high - prediction.force) ** 2 for each in (wide, at_tests)]
    np.testing.assert_allclose(widths[0], widths[1] + 1.6448536**2 * spread, rtol=1e-6)
    assert (wide.peak[1] > 1.05 * at_tests.peak[1]) == (wide.energy[1] > 1.5 * at_tests.energy[1]) == follows
    also = replace(damper, envelope=replace(envelope, any_motion=True))
    assert not also.predict(motion).untested_kind
    of_kind, without = (portable_band(each).of_peak_untested for each in (damper, also))
    assert (of_kind > 1.05 * without) == follows
