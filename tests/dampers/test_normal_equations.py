from dataclasses import replace

import numpy as np
import pytest
from support.synthetic import TRUTH, synthetic_run

from mrdamper.dampers.condensed_runs import condense
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.modified import fit_modified, fit_modified_jointly
from mrdamper.dampers.normal_equations import (
    Law,
    _Design,
    _ShapeSearch,
    _solve,
    choose_forms,
    fit_jointly,
    leave_out_errors,
)
from mrdamper.data import Condition, Run, same_condition
from mrdamper.errors import IdentificationError
from mrdamper.identification import identify
from mrdamper.models.bingham import Bingham
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.motion import sweep
from mrdamper.physics.simulation import simulate
from mrdamper.statistics.functions.forms import ParameterFunction, features
from mrdamper.study.validation import leave_out, validate

MATRIX = [Condition(i, f, a) for i in (0.0, 0.5, 1.0, 1.5) for f, a in ((1.0, 0.02), (2.0, 0.02), (0.5, 0.05))]
FORMS = {
    "c": Law("linear-current"),
    "yield_force": Law("quadratic-current"),
    **dict.fromkeys(("yield_displacement", "k1", "k3", "f0"), Law("constant")),
}


def truth(condition, yield_force=None):
    current = condition.current_A
    return BoucWen.build(
        {
            "c": 1000 + 200 * current,
            "yield_force": yield_force or 200 + 900 * current - 200 * current**2,
            "yield_displacement": 1.2e-3,
            "k1": 1400.0,
            "k3": TRUTH["k3"],
            "f0": 100.0,
        }
    )


@pytest.fixture(scope="module")
def runs():
    return [
        synthetic_run(c, noise=5.0, seed=i, cycles=3, samples_per_cycle=300, model=truth(c), id=f"r{i}", rig="s")
        for i, c in enumerate(MATRIX)
    ]


@pytest.fixture(scope="module")
def identifications(runs):
    return [identify(run) for run in runs]


def test_all_runs_at_once_recover_the_functions(runs):
    data = condense(runs, BoucWen)
    start = ParameterFunction("constant", (np.log(5e-4),), log=True)
    fit = fit_jointly(data, FORMS, start)
    at = fit.parameters.at(Condition(1.0, 1.0, 0.02))
    expected = truth(Condition(1.0, 1.0, 0.02))
    assert at.yield_force == pytest.approx(expected.yield_force, rel=0.01)
    assert at.yield_displacement == pytest.approx(1.2e-3, rel=0.02)
    assert at.c == pytest.approx(expected.c, rel=0.01)
    assert fit.nrmse_pp.max() < 0.01


def test_what_is_found_does_not_show_rounding(runs):
    """Linear algebra of another machine differs by rounding; so do these forces."""
    start = ParameterFunction("linear-current", (0.1, np.log(5e-4)), log=True)
    found = []
    for share in (0.0, 1e-14):
        seed = np.random.default_rng(3)
        moved = [replace(r, force=r.force * (1 + share * seed.standard_normal(r.force.size))) for r in runs]
        forms = {**FORMS, "yield_displacement": Law("linear-current")}
        fit = fit_jointly(condense(moved, BoucWen), forms, start)
        found.append([c for f in fit.parameters.functions.values() for c in f.coefficients])
    np.testing.assert_allclose(*found, rtol=1e-10, atol=1e-12)


def test_the_slopes_of_the_search_are_those_of_its_errors(runs):
    data = condense(runs, BoucWen)
    start = ParameterFunction("linear-current", (0.1, np.log(8e-4)), log=True)
    search = _ShapeSearch(_Design(data, FORMS), start, np.linspace(1, 2, len(runs)))
    at = np.array(start.coefficients) * search.scale
    expected = [
        (np.sum(search.residual(at + s) ** 2) - np.sum(search.residual(at - s) ** 2)) / 4e-5 for s in 1e-5 * np.eye(2)
    ]
    np.testing.assert_allclose(search.gradient(at), expected, rtol=1e-6)


def test_condensed_error_is_the_error_in_time(runs, identifications):
    """The Gram matrices say of every run what simulating it says."""
    fit, _ = fit_modified_jointly(runs, identifications)
    data = condense(runs, BoucWen)
    forms = {name: Law(f.function.form) for name, f in fit.functions.items()}
    condensed = fit_jointly(data, forms, fit.functions["yield_displacement"].function).nrmse_pp
    in_time = [run.scores.nrmse_pp for run in validate(fit.damper, runs).runs]
    np.testing.assert_allclose(condensed, in_time, rtol=0.05, atol=2e-4)


def test_leave_out_is_larger_than_fit_and_needs_every_group(runs):
    data = condense(runs, BoucWen)
    fit = fit_jointly(data, FORMS, ParameterFunction("constant", (np.log(1.2e-3),), log=True))
    errors = leave_out_errors(data, fit, FORMS)["condition"]
    assert errors.mean() >= fit.nrmse_pp.mean() * 0.999
    for place, group in enumerate(same_condition(data.conditions)):  # one condition a run, in the order of the runs
        kept = 1 / np.sqrt(fit.nrmse_pp)
        kept[group] = 0.0
        shapes = fit.parameters.functions[data.shape](*features(data.conditions))
        table, _ = _Design(data, FORMS).table(data.at(shapes)[0])
        assert errors[place] == pytest.approx(_solve(table, kept).nrmse_pp[group[0]], rel=1e-9)


def test_forms_are_chosen_short(runs, identifications):
    data = condense(runs, BoucWen)
    shapes = np.array([i.model.yield_displacement for i in identifications])
    candidates = {name: [Law(form) for form in ("constant", "linear-current", "quadratic-current")] for name in FORMS}
    forms = choose_forms(data, candidates, shapes).forms
    assert forms["yield_force"].name == "quadratic-current"
    assert forms["k1"] == forms["f0"] == Law("constant")


def test_a_law_that_begins_with_the_square_of_the_current_has_the_rate_of_its_damper():
    """The grid has two rates; that of the damper lies between them."""
    rise = {c: 150 + 900 * (1 - (1 + 3.1 * c.current_A) * np.exp(-3.1 * c.current_A)) for c in MATRIX}
    runs = [
        synthetic_run(c, noise=3.0, seed=i, cycles=3, samples_per_cycle=300, model=truth(c, rise[c]), id=f"r{i}")
        for i, c in enumerate(MATRIX)
    ]
    curved = [Law("quadratic-current"), *(Law(name, (rate,)) for name in ("decaying-current", "onset-current")
              for rate in (1.6, 2.7, 4.0))]  # fmt: skip
    candidates = {
        name: [Law("constant"), Law("linear-current"), *(curved if name == "yield_force" else [])] for name in FORMS
    }
    chosen = choose_forms(condense(runs, BoucWen), candidates, np.full(len(MATRIX), 1.2e-3), {"yield_force": "N"})
    assert chosen.forms["yield_force"].name == "onset-current"
    assert chosen.forms["yield_force"].rates == pytest.approx((3.1,), rel=0.1)


def test_a_condition_left_out_is_predicted(runs, identifications):
    fit, refit = fit_modified_jointly(runs, identifications)
    left_out = leave_out(runs, same_condition([i.condition for i in identifications]), refit, "joint")
    assert left_out.median() < 0.01
    assert len(left_out.runs) == len(runs)
    assert fit.damper.envelope == Envelope.of([i.condition for i in identifications])


def test_run_by_run_map_predicts_too(runs, identifications):
    fit = fit_modified(identifications)
    assert validate(fit.damper, runs).median() < 0.02
    assert all(np.isfinite(f.r2) for f in fit.functions.values())


def test_models_without_a_shape_are_fitted_too(runs):
    fit, _ = fit_modified_jointly(runs, [identify(run, "bingham") for run in runs])
    assert fit.damper.parameters.model_type is Bingham


def test_nothing_and_mixtures_are_refused(identifications, runs):
    with pytest.raises(IdentificationError, match="no identifications"):
        fit_modified([])
    with pytest.raises(IdentificationError, match="2 models"):
        fit_modified([identifications[0], identify(runs[0], "bingham")])
    with pytest.raises(IdentificationError, match="no runs"):
        condense([], BoucWen)


def test_envelope_flags_what_lies_outside():
    envelope = Envelope.of(MATRIX)
    assert envelope.flags(Condition(1.0, 1.0, 0.03)) == ()
    assert envelope.flags(Condition(3.0, 1.0, 0.03)) == ("current",)
    assert envelope.flags(Condition(1.0, 4.0, 0.1)) == ("frequency", "amplitude", "velocity")
    assert envelope.flags(Condition(1.51, 1.0, 0.03)) == ()  # within the bench's own repeatability


def test_a_dead_run_does_not_stop_the_others(runs, identifications):
    damper = fit_modified(identifications).damper
    still = Run("still", runs[0].time, np.zeros(runs[0].time.size), runs[0].force, 0.0, rig="s")
    validation = validate(damper, [runs[0], still])
    assert [r.run_id for r in validation.runs] == ["r0"]
    assert "does not move" in validation.refused["still"]


def test_other_motion_gets_running_estimates_and_is_flagged(runs, identifications):
    """On a slow sweep the blended force is near that of the truth at the momentary condition."""
    damper = fit_modified_jointly(runs, identifications)[0].damper
    motion = sweep(0.6, 1.9, 30.0, 0.03, 1.0, 400.0)
    run = Run("sweep", motion.time, motion.displacement, motion.velocity, 1.0, rig="s", excitation="chirp")
    prediction = damper.predict(run)
    assert "not a sine" in prediction.extrapolation
    expected = simulate(truth(Condition(1.0, 1.0, 0.03)), motion).force
    assert np.sqrt(np.mean((prediction.force - expected) ** 2)) < 0.04 * np.ptp(expected)


@pytest.mark.parametrize("knee", [2e-5, 4e-3, 8e-3])
def test_a_knee_of_any_length_is_fitted_jointly_as_run_by_run(knee):
    """The ladder of yield displacements follows the motions; it once ended at 3 mm, in silence."""
    made = [
        BoucWen.build({"c": 1e3, "yield_force": 300 + 900 * c.current_A, "yield_displacement": knee, "f0": 50.0})
        for c in MATRIX
    ]
    soft = [
        synthetic_run(c, cycles=3, samples_per_cycle=300, model=m, id=f"k{i}", rig="soft")
        for i, (c, m) in enumerate(zip(MATRIX, made, strict=True))
    ]
    found = [identify(run) for run in soft]
    jointly, _ = fit_modified_jointly(soft, found)
    assert validate(jointly.damper, soft).median() < 1e-3
    assert jointly.damper.model_at(MATRIX[4]).yield_displacement == pytest.approx(knee, rel=0.02)
    assert not jointly.at_bounds


def test_without_a_current_the_slope_of_the_shape_over_it_stays_that_of_the_start(runs):
    """As in a fold that keeps the runs at 0 A alone."""
    start = ParameterFunction("linear-current", (0.2, np.log(5e-4)), log=True)
    fit = fit_jointly(condense(runs[:3], BoucWen), dict.fromkeys(FORMS, Law("constant")), start)
    slope, log = fit.parameters.functions["yield_displacement"].coefficients
    assert (slope, np.exp(log)) == pytest.approx((0.2, 1.2e-3), rel=0.02)


def test_a_function_that_leaves_what_was_looked_for_says_so(runs):
    fit = fit_jointly(condense(runs, BoucWen), FORMS, ParameterFunction("constant", (np.log(1.0),), log=True))
    assert fit.at_bounds == ("yield_displacement",)
