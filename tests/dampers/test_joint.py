"""Joint identification: one model for a whole damper, any motion."""

from dataclasses import astuple, replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from export import c_bench
from hypothesis import given, settings
from hypothesis import strategies as st
from support.dampers import joint_damper

from mrdamper.dampers import joint
from mrdamper.dampers.coil import Coil
from mrdamper.dampers.concatenated_runs import JointResiduals, concatenate, force_slopes
from mrdamper.dampers.envelope import UNTESTED, Envelope
from mrdamper.dampers.joint import JointDamper, JointFit, JointProblem, damper_of
from mrdamper.dampers.model_file import dump_model, parse_model
from mrdamper.dampers.run_rows import RunRows, envelope_of
from mrdamper.dampers.search_space import FALL, RISE
from mrdamper.dampers.uncertainty import FittedParameter, Uncertainty
from mrdamper.data import Condition, Run
from mrdamper.errors import IdentificationError, InputError, RunError
from mrdamper.models import Scale
from mrdamper.models.play_bypass import PlayBypass, play_position
from mrdamper.physics.motion import random_motion, sine, sweep
from mrdamper.physics.motion.lag import first_order_lag
from mrdamper.physics.motion.sines import extreme_strokes
from mrdamper.physics.simulation import simulate, steady_loop
from mrdamper.statistics.levenberg_marquardt import Minimum
from mrdamper.statistics.linear import project_out_columns
from mrdamper.statistics.stop_reason import StopReason
from mrdamper.study.validation import validate

TRUTH = PlayBypass(
    f0=50.0, k=900.0, c0=700.0, c1=1500.0, fy0=100.0, fy1=1000.0, d=2e-4, e=2.5e-5, cb=3.5e4, h0=0.4, h1=0.4,
    vh=3e-3, T=5e-3, asymmetry=0.03, m=5.0,
)  # fmt: skip
MATRIX = [Condition(i, f, a) for i in (0.0, 0.25, 0.5, 1.0) for f, a in ((0.5, 0.02), (1.0, 0.01), (2.0, 0.005))]


def recorded(motion, noise=0.0, seed=0, **options):
    force = simulate(TRUTH, motion).force
    force = force + noise * np.random.default_rng(seed).standard_normal(force.size)
    return Run(time=motion.time, displacement=motion.displacement, force=force, current=motion.current, **options)


@pytest.fixture(scope="module")
def runs():
    return [
        recorded(sine(c, 3, 360), 5.0, i, id=f"r{i}", window=(1.5 / c.frequency_Hz, 3 / c.frequency_Hz))
        for i, c in enumerate(MATRIX)
    ]


@pytest.fixture(scope="module")
def problem(runs):
    return JointProblem(runs, "play-bypass")


@pytest.fixture(scope="module")
def fit(problem):
    return problem.fit()


def test_the_stop_operator_moves_stops_and_forgets():
    x = np.array([0.0, 3.0, 5.0, 4.0, 1.0, -2.0, 0.0]) * 1e-3
    expected = np.zeros(x.size)
    for i in range(1, x.size):
        expected[i] = np.clip(expected[i - 1] + x[i] - x[i - 1], -2e-3, 2e-3)
    from mrdamper.physics.motion import Path

    np.testing.assert_allclose(play_position(Path.of(x, peaks="samples"), 2e-3), expected, atol=1e-15)


@settings(max_examples=30, deadline=None)
@given(constant=st.floats(1e-5, 10.0), seed=st.integers(0, 99))
def test_lag_equals_the_recursion_on_uneven_samples(constant, seed):
    rng = np.random.default_rng(seed)
    time, signal = np.sort(rng.uniform(0, 1, 200)), rng.standard_normal(200)
    value, expected = 0.0, [0.0]
    for i in range(1, 200):
        h = (time[i] - time[i - 1]) / constant
        keep, mean = np.exp(-h), -np.expm1(-h) / h if h > 1e-9 else 1.0
        value = keep * value + (mean - keep) * signal[i - 1] + (1 - mean) * signal[i]
        expected.append(value)
    np.testing.assert_allclose(first_order_lag(time, signal, constant), expected, atol=1e-7)


def test_lag_of_a_step_is_the_exponential_whatever_the_step():
    for count in (50, 5000):
        t = np.linspace(0, 1, count)
        lagged = first_order_lag(t, np.ones(count), 0.1)
        np.testing.assert_allclose(lagged, 1 - np.exp(-t / 0.1), atol=1e-12)
    assert first_order_lag(t, t, 0.0) is not t


@pytest.mark.parametrize("condition", [Condition(0.0, 1.0, 0.01), Condition(1.0, 0.5, 0.02), Condition(0.5, 5, 0.002)])
def test_a_closed_loop_dissipates(condition):
    loop = steady_loop(TRUTH, condition)
    force, x = loop.force, loop.excitation.displacement
    assert np.sum((force[1:] + force[:-1]) / 2 * np.diff(x)) > 0


def test_the_force_converges_with_the_sampling():
    condition = Condition(0.5, 1.0, 0.01)
    fine = simulate(TRUTH, sine(condition, 3, 16000)).force[::16]
    errors = [np.abs(simulate(TRUTH, sine(condition, 3, n)).force[:: n // 1000] - fine).max() for n in (1000, 4000)]
    assert errors[1] < 0.4 * errors[0]


def test_known_damper_is_recovered(runs, fit):
    found = fit.damper.model
    for name, tolerance in {"fy1": 0.01, "c1": 0.05, "d": 0.02, "cb": 0.05, "T": 0.1, "k": 0.1, "f0": 0.02}.items():
        assert getattr(found, name) == pytest.approx(getattr(TRUTH, name), rel=tolerance), name
    assert fit.ending.converged
    assert validate(fit.damper, runs).median() < 0.01


def test_of_each_length_the_best_start_and_the_first_length_first_unless_another_is_clearly_better(
    problem, monkeypatch
):
    at = [axis.name for axis in problem.space.axes].index("d")
    lengths = [problem.space.axes[at].coordinate(g) for g in problem.space.axes[at].grid]
    grid = [np.array(u) for u in product(*([axis.coordinate(g) for g in axis.grid] for axis in problem.space.axes))]
    for costs, order in (([1.0, 0.86, 0.9, 9.0], [0, 1, 2]), ([1.0, 0.9, 0.84, 9.0], [2, 0, 1])):
        other, left = JointProblem(problem.runs, "play-bypass", parts=problem.parts), iter(costs)
        monkeypatch.setattr(
            JointProblem, "_downhill", lambda self, u, left=left: Minimum(u, u, next(left), 1, StopReason.SETTLED)
        )
        assert [u[at] for u in other.promising[:3]] == [lengths[k] for k in order]
        assert np.array_equal(other.start, other.promising[0])
    for u in other.promising:
        alike = [v for v in grid if v[at] == u[at]]
        assert np.array_equal(u, min(alike, key=lambda v: float(np.sum(other._few.solve(v).nrmse_pp))))


def ended(error, knee):
    damper = replace(joint_damper(), model=replace(joint_damper().model, d=knee / 2))
    return JointFit(damper, np.array([error / 2, 3 * error / 2]), (), np.zeros(2), StopReason.SETTLED, 0.1)


@pytest.mark.parametrize(
    ("ends", "best", "second"),
    [
        ([(0.03, 1e-3)], 0, None),
        ([(0.03, 1e-3), (0.031, 2e-3)], 0, (2e-3, 0.031, 1e-3, 0.03)),
        ([(0.03, 1e-3), (0.0299, 2e-3)], 0, (2e-3, 0.0299, 1e-3, 0.03)),  # as good: the likelier length
        ([(0.03, 1e-3), (0.029, 2e-3)], 1, (1e-3, 0.03, 2e-3, 0.029)),
        ([(0.03, 1e-3), (0.031, 1.09e-3)], 0, None),  # the same knee
        ([(0.03, 1e-3), (0.031, 0.89e-3)], 0, (0.89e-3, 0.031, 1e-3, 0.03)),
        ([(0.03, 1e-3), (0.038, 2e-3)], 0, None),  # a quarter worse describes the tests no more
        ([(0.03, 1e-3), (0.036, 2e-3), (0.033, 5e-4)], 0, (5e-4, 0.033, 1e-3, 0.03)),
    ],
)
def test_a_search_ends_in_the_best_valley_and_names_the_next(problem, monkeypatch, ends, best, second):
    made = [ended(*end) for end in ends]
    other = JointProblem(problem.runs, "play-bypass", parts=problem.parts)
    other.__dict__["promising"] = [np.array([k]) for k in range(2)][: len(made)]
    monkeypatch.setattr(JointProblem, "_downhill", lambda self, u: SimpleNamespace(point=u))
    asked = []
    monkeypatch.setattr(JointProblem, "fit", lambda self, start, **how: asked.append(how) or made[int(start[0])])
    found = other.search(np.array([2]) if len(made) > 2 else None, rounds=1, most_steps=7, settled=1e-3)
    assert (found.damper, found.error) == (made[best].damper, pytest.approx(made[best].error))
    assert (found.second and pytest.approx(second)) == (found.second and astuple(found.second))
    assert (found.second is None) == (second is None)
    assert asked == [{"rounds": 1, "most_steps": 7, "settled": 1e-3}] * len(made)


def test_constants_of_other_dampers_are_no_parameters_from_the_tests(problem, fit):
    """The 0.12 A of fy1 I (1 − exp(−I/Ic)) count where these tests determine them."""
    assert fit.damper.parameter_count == len(fit.damper.fitted_parameters) == 15
    freed = JointProblem(problem.runs, "play-bypass", free=("Ic",), parts=problem.parts)
    assert JointDamper(fit.damper.model, freed.free, envelope=fit.damper.envelope).parameter_count == 16


def test_own_numbers_are_those_the_tests_gave_with_their_units_and_scales(fit):
    held = replace(fit.damper, free=("d", "h0"))
    infos = {info.name: info for info in PlayBypass.parameters()}
    assert dict(held.fitted_parameters) == {
        "d": FittedParameter(fit.damper.model.d, infos["d"].bounds, True, "m"),
        "h0": FittedParameter(fit.damper.model.h0, infos["h0"].bounds, False, "-"),
    }
    assert held.with_parameters({"d": 1e-3}).model == replace(fit.damper.model, d=1e-3)
    bare = damper_of(TRUTH)
    assert (bare.model, bare.rig, bare.free, bare.envelope) == (TRUTH, "", (), UNTESTED)
    assert damper_of(held) is held


@pytest.mark.parametrize("name", ["play-bypass", "bouc-wen", "spencer", "bingham"])
def test_an_axis_is_entangled_if_it_moves_another_parameter_than_that_of_its_name(runs, name):
    problem = JointProblem(runs, name)
    lower, upper = problem.space.box() if problem.space.axes else (np.zeros(0), np.zeros(0))
    point = lower + 0.4 * (upper - lower)
    plain = problem.space.without_linear(point).values()
    for i, axis in enumerate(problem.space.axes):
        moved = problem.space.without_linear(point + 0.02 * (upper - lower) * (np.arange(point.size) == i)).values()
        others = {n for n in plain if moved[n] != plain[n]} ^ {axis.name}
        assert (i in problem.space._entangled_axes) == bool(others), axis.name


def test_a_damper_holds_parameters_of_its_model_only():
    held = replace(joint_damper(), uncertainty=Uncertainty((), (), np.zeros((0, 0)), np.zeros(0), (), ())).holding(
        {"c1": 1234.0}
    )
    assert held.model == replace(joint_damper().model, c1=1234.0)
    assert held.uncertainty is None
    with pytest.raises(InputError, match="k9"):
        joint_damper().holding({"k9": 1.0})


def test_a_coil_is_looked_for_where_a_current_changes_or_taken_as_given(runs, problem):
    changing = replace(runs[3], id="changing", current=np.linspace(0.1, 0.9, runs[3].time.size))
    names = [axis.name for axis in problem.space.axes]
    assert not {RISE, FALL} & set(names)
    for coil, more in (("determined", [RISE, FALL]), (Coil(0.02, 0.03), []), (None, [])):
        with_change = JointProblem([*runs[:3], changing], "play-bypass", coil=coil)
        assert [axis.name for axis in with_change.space.axes] == [*names, *more]
        at = with_change.space.coil_at(np.array([a.coordinate(a.grid[0]) for a in with_change.space.axes]))
        wanted = Coil(8e-3, 8e-3) if more else coil
        assert (at and (at.rise_s, at.fall_s)) == (wanted and pytest.approx((wanted.rise_s, wanted.fall_s)))
        assert [(a.lower, a.upper, a.log) for a in with_change.space.axes[9:]] == [(1e-4, 0.2, True)] * len(more)


def test_problems_made_of_another_keep_what_it_was_given(runs, problem):
    changing = replace(runs[3], id="changing", current=np.linspace(0.1, 0.9, runs[3].time.size))
    one = JointProblem([*runs[:3], changing], "play-bypass", {"m": 5.0}, free=("leak",), coil=None)
    again = one.with_free(("si",), {"k": 9.0})
    assert again.given_coil is None
    assert again.fixed == {"m": 5.0, "k": 9.0}
    assert ("si" in again.free, "leak" in again.free) == (True, False)
    assert again.parts == one.parts


def test_lags_are_handed_on_and_found_at_their_own_places(runs, problem, fit):
    changing = replace(runs[3], id="changing", current=np.linspace(0.1, 0.9, runs[3].time.size))
    lagged = JointProblem([*runs[:3], changing], "play-bypass")
    known = SimpleNamespace(damper=replace(fit.damper, coil=Coil(0.02, 0.05)), searched=fit.searched)
    point = lagged.from_point(known)
    found = lagged.space.coil_at(point)
    assert (found.rise_s, found.fall_s) == pytest.approx((0.02, 0.05))
    far = lagged.from_point(SimpleNamespace(damper=replace(fit.damper, coil=Coil(1e-9, 9.0)), searched=fit.searched))
    assert (lagged.space.coil_at(far).rise_s, lagged.space.coil_at(far).fall_s) == pytest.approx((1e-4, 0.2))
    names = [axis.name for axis in lagged.space.axes]
    for low, told in (("d", ("d",)), ("seat_share", ("e",)), (RISE, (RISE,)), (None, ())):
        at = point.copy()
        if low:
            at[names.index(low)] = lagged.space.box()[0][names.index(low)]
        assert tuple(lagged.space.at_bounds(at)) == told
    at = point.copy()
    at[names.index("cb")] = lagged.space.box()[1][names.index("cb")]
    assert lagged.space.at_bounds(at) == ["cb"]


def test_scales_and_ranges_are_those_of_the_runs(runs, problem):
    conditions = [Condition(0.2, 1.0, 0.01), Condition(0.4, 3.0, 0.02), Condition(0.1, 0.5, 0.09)]
    made = [
        SimpleNamespace(condition=c, scale=scale, motion=SimpleNamespace(current=np.array(current)))
        for c, scale, current in zip(conditions, (300.0, 900.0, 500.0), ([0.1], [0.2, 0.3], [-0.8, 0.5]), strict=True)
    ]
    assert joint._scale(made) == Scale(0.02, sorted(c.peak_velocity for c in conditions)[1], 450.0, 0.8)
    changing = replace(runs[3], id="changing", current=np.linspace(0.1, 0.9, runs[3].time.size))
    sine_, other = problem.parts[0], RunRows.of(changing)
    plain = Envelope.of([sine_.condition, other.condition])
    extent = np.array([[other.lowest, other.highest]])
    wider = plain.with_motion(other.motion.current, extent, other.motion.velocity, sine=True)
    assert envelope_of([sine_, other]) == wider != plain
    assert envelope_of([sine_]) == Envelope.of([sine_.condition])
    extent = np.array([[sine_.lowest, sine_.highest]])
    conditions = [sine_.condition, *extreme_strokes(sine_.motion)]
    rough = Envelope.of(conditions).with_motion(sine_.motion.current, extent, sine_.motion.velocity)
    assert envelope_of([replace(sine_, is_sine=False)]) == rough


def test_starts_are_tried_on_six_runs_and_a_single_start_is_taken_as_it_is(runs, problem, monkeypatch):
    assert len(problem._few.parts) == 6
    few = JointProblem(problem.runs, "play-bypass", parts=problem.parts[:4])
    assert len(few._few.parts) == 4
    monkeypatch.setattr(JointProblem, "_downhill", lambda self, u: pytest.fail("one start needs no trial"))
    held = problem.with_free((), {"d": 3e-4, "cb": 3e4})
    (start,) = held.promising
    assert start.tolist() == [axis.coordinate(axis.grid[0]) for axis in held.space.axes]


def test_the_third_valley_is_not_looked_into(problem, monkeypatch):
    made = [ended(0.03, 1e-3), ended(0.031, 2e-3), ended(0.01, 3e-3)]
    other = JointProblem(problem.runs, "play-bypass", parts=problem.parts)
    other.__dict__["promising"] = [np.array([k]) for k in range(3)]
    monkeypatch.setattr(JointProblem, "fit", lambda self, start, **how: made[int(start[0])])
    assert other.search().error == pytest.approx(0.03)


def test_a_linearisation_is_that_of_its_own_fit_and_made_once(problem, fit):
    other = problem.fit(start=fit.point + 1e-3, rounds=1, most_steps=1)
    known = problem.linearised(fit)
    residual, jacobian, table = known.residual, known.jacobian, known.table
    assert problem.linearised(fit) is known
    assert problem.linearised(other) is not known
    errors = np.sqrt(np.bincount(table.owner, residual**2))
    assert errors / errors[0] == pytest.approx(np.sqrt(fit.nrmse_pp / fit.nrmse_pp[0]), rel=0.05)  # weights: 1 / √error
    assert jacobian.shape == (residual.size, len(problem.space.axes) + len(problem.space.linear))
    assert fit.seconds < 600


def test_what_a_search_without_some_runs_foresees_is_where_it_goes(problem, fit):
    known, rows = problem.linearised(fit), list(range(1, len(problem.runs)))
    owner, weights = known.table.owner, known.table.weights
    for run, triangle in enumerate(known._triangles):  # fewer rows, the same sums of squares of any change
        change = np.arange(triangle.shape[1]) + 1.0
        whole = np.column_stack([known.residual, known.jacobian])[owner == run] / weights[run]
        assert np.linalg.norm(triangle @ change) == pytest.approx(np.linalg.norm(whole @ change))
    errors, point = known.extrapolate_refit(rows, problem.space.box())
    found = problem.refit(fit, rows, 1e-6)
    assert np.linalg.norm(point - found.point) < 0.3 * np.linalg.norm(fit.point - found.point)
    assert errors == pytest.approx(found.nrmse_pp, rel=0.05)


@pytest.mark.parametrize("far", [False, True])
def test_a_refit_begins_where_the_derivatives_lead_unless_that_is_worse(problem, fit, monkeypatch, far):
    """By the sum of squares over the runs that are kept."""
    rows, begins = [0, 3, 5, 7, 8, 11], []
    lower, upper = problem.space.box()
    errors, near = problem.linearised(fit).extrapolate_refit(rows, problem.space.box())
    away = lower + 0.9 * (upper - lower) if far else near
    monkeypatch.setattr(joint.Linearisation, "extrapolate_refit", lambda self, rows, box: (errors, away))
    monkeypatch.setattr(JointProblem, "_search", lambda self, table, parts, point, *rest: begins.append((parts, point)))
    problem.refit(fit, rows[::-1])
    ((parts, point),) = begins
    assert parts == [problem.parts[i] for i in rows]
    assert point is (fit.point if far else near)


@pytest.mark.skipif(not c_bench.COMPILERS, reason="no C compiler on this machine")
def test_slopes_by_the_search_axes_are_those_of_the_force(runs, problem, fit):
    motion = sine(MATRIX[5], 3, 20_000)
    picked = np.arange(0, motion.time.size, 97)
    by_axes, by_parameters = force_slopes(problem.space, fit.point, fit.damper.one_model, motion, picked)
    slopes = (by_axes @ by_parameters).T
    linear = {info.name for info in PlayBypass.parameters() if info.linear}
    held = {name: getattr(fit.damper.one_model, name) for name in linear}
    for i, axis in enumerate(problem.space.axes):
        step = np.where(np.arange(fit.point.size) == i, 1e-5, 0.0)
        ends = [replace(problem.space.without_linear(fit.point + s * step), **held) for s in (-1, 1)]
        low, high = (simulate(end, motion).force[picked] for end in ends)
        expected = (high - low) / 2e-5
        assert slopes[:, i] == pytest.approx(expected, abs=2e-3 * np.max(np.abs(expected))), axis.name
    changing = replace(runs[3], id="changing", current=np.linspace(0.1, 0.9, runs[3].time.size))
    lagging = JointProblem([*runs[:3], changing], "play-bypass")
    start = np.append(fit.point, np.log([0.01, 0.01]))
    assert force_slopes(lagging.space, start, fit.damper.one_model, motion, picked) is None


def test_products_are_those_of_the_derivatives_with_the_linear_parameters_refitted(problem, fit):
    table = JointResiduals(problem.space, problem.parts)
    solved, (gradient, normal) = table.solve(fit.point), table.products(fit.point)
    jacobian = table.linearise(fit.point, solved.model)[1][:, : fit.point.size]
    refitted = project_out_columns(solved.columns, jacobian)
    assert gradient == pytest.approx(refitted.T @ solved.residual, abs=1e-9 * np.abs(gradient).max())
    size = np.linalg.norm(refitted, axis=0)
    assert normal / size / size[:, None] == pytest.approx(refitted.T @ refitted / size / size[:, None], abs=1e-6)


def test_the_last_digits_do_not_hang_on_the_start(problem, fit):
    """The gradient vanishes where the search goes on to the last digit, and not where it ends as usual."""
    starts = [fit.point + shift for shift in (-2e-3, 2e-3)]
    asked = dict(rows=[0, 3, 5, 7, 8, 11], rounds=1, settled=1e-4)
    one, other = (problem.fit(start=u, to_the_last_digit=True, **asked).point for u in starts)
    assert one == pytest.approx(other, abs=1e-8)
    assert problem.fit(start=starts[0], **asked).point != pytest.approx(one, abs=1e-8)


def test_samples_of_some_runs_are_those_they_have_among_all(problem, fit):
    whole, rows = problem.linearised(fit).table, [2, 5]
    some = whole.only(rows)
    missed = np.bincount(whole.owner, whole.residual(fit.point, fit.damper.model) ** 2)[rows]
    np.testing.assert_allclose(np.bincount(some.owner, some.residual(fit.point, fit.damper.model) ** 2), missed)
    assert np.all(
        some.solve(fit.point).nrmse_pp.mean() <= np.sqrt(missed).mean() * 1.001
    )  # their own linear parameters
    assert some.linear_forces(fit.point)[1].shape[1] == some.picked.size < whole.picked.size


def test_a_fit_begins_where_another_problem_ended(problem, fit):
    free = JointProblem(problem.runs, "play-bypass", free=("Ic", "si"), parts=problem.parts)
    point = dict(zip((a.name for a in free.space.axes), free.from_point(fit), strict=True))
    own = dict(zip(fit.searched, fit.point, strict=True))
    assert {name: point[name] for name in own} == pytest.approx(own)
    for axis in free.space.axes:
        if axis.name in ("Ic", "si"):
            assert point[axis.name] == axis.coordinate(axis.grid[0])
    held = problem.with_free((), {"d": 3e-4})
    assert "d" not in [axis.name for axis in held.space.axes]
    assert held.space.without_linear(held.from_point(fit)).d == 3e-4


def test_predictions_of_a_run_share_its_motion(runs, fit):
    one, other = (fit.damper.predict(runs[2]).motion for _ in range(2))
    assert one is other  # cut into strokes once


def test_errors_of_left_out_runs_are_those_of_a_prediction(runs, problem, fit):
    found = problem.errors(fit, [2, 7])
    for error, i in zip(found, (2, 7), strict=True):
        run = runs[i]
        missed = (fit.damper.predict(run).force - run.force)[run.in_window]
        # On the samples that enter, a few hundred of the window.
        assert error == pytest.approx(np.sqrt(np.mean(missed**2)) / np.ptp(run.force[run.in_window]), rel=0.1)
    assert fit.error == pytest.approx(sum(fit.nrmse_pp) / len(runs))
    assert problem.linearised(fit).table.solve(fit.point).nrmse_pp == pytest.approx(fit.nrmse_pp, rel=1e-6)


def test_it_predicts_motions_it_was_never_shown(fit):
    rng = np.random.default_rng(7)
    unseen = [
        recorded(sweep(0.3, 4.0, 20.0, 0.006, 0.75, 500.0), id="sweep", excitation="chirp"),
        recorded(random_motion(rng, 20.0, 0.004, (0.2, 3.0), 0.75, 500.0), id="road", excitation="random"),
    ]
    for score in validate(fit.damper, unseen).runs:
        assert score.scores.nrmse_pp < 0.02, score.run_id


def test_current_may_vary_from_sample_to_sample(fit):
    motion = sine(Condition(0.0, 1.0, 0.01), 4, 500)
    varied = motion.with_current(0.5 + 0.5 * np.sin(2 * np.pi * 0.3 * motion.time))
    truth = simulate(TRUTH, varied).force
    assert np.sqrt(np.mean((fit.damper.force_along(varied, MATRIX[0]) - truth) ** 2)) < 0.02 * np.ptp(truth)


def test_the_coil_follows_a_changed_current_late(fit):
    motion = sine(Condition(0.0, 1.0, 0.01), 4, 500)
    current = np.where(motion.time < 2, 0.0, 1.0)
    run = Run("step", motion.time, motion.displacement, motion.velocity, current)
    late, prompt = (replace(fit.damper, coil=coil).predict(run).force for coil in (Coil(0.05, 0.05), None))
    before, after, later = motion.time < 2, (motion.time > 2) & (motion.time < 2.05), motion.time > 2.6
    np.testing.assert_allclose(late[before], prompt[before])
    assert np.abs(late[after]).mean() < 0.9 * np.abs(prompt[after]).mean()
    np.testing.assert_allclose(late[later], prompt[later], atol=1e-3 * np.ptp(prompt))


def test_a_fit_without_some_runs_ends_where_a_search_that_never_saw_them_does(runs, fit):
    other = [*runs]
    for i in (6, 7, 8):  # a whole current, of another day
        other[i] = replace(runs[i], force=1.15 * runs[i].force)
    problem = JointProblem(other, "play-bypass")
    fit = problem.fit(start=fit.point)
    rest = [i for i in range(len(runs)) if i not in (6, 7, 8)]
    again, anew = problem.refit(fit, rest), problem.fit(rest, fit.point)
    assert sum(again.nrmse_pp) == pytest.approx(sum(anew.nrmse_pp), rel=2e-3)
    assert again.nrmse_pp == pytest.approx(problem.errors(again, rest), rel=1e-6)
    assert again.nrmse_pp == pytest.approx(problem.refit(fit, rest[::-1]).nrmse_pp)
    moved = abs(anew.damper.model.fy1 - fit.damper.model.fy1)
    assert abs(again.damper.model.fy1 - anew.damper.model.fy1) < 0.1 * moved
    assert again.damper.provenance["runs"] == "9"


def test_a_bad_session_does_not_bend_the_model(runs, fit):
    drifted = [*runs[:-1], replace(runs[-1], id="bad", force=1.5 * runs[-1].force)]
    fit = JointProblem(drifted, "play-bypass").fit(start=fit.point)
    assert fit.damper.model.fy1 == pytest.approx(TRUTH.fy1, rel=0.05)
    assert np.argmax(fit.nrmse_pp) == len(runs) - 1


def test_round_trip_of_the_saved_model(runs, problem, fit):
    damper = JointProblem(runs, "play-bypass", {"m": 5.0}, parts=problem.parts).fit(start=fit.point, rounds=1).damper
    assert "m" not in damper.free
    back = parse_model(dump_model(damper))
    assert back.model == damper.model
    assert dump_model(back) == dump_model(damper)


def test_strung_motions_keep_their_samples_and_a_rising_clock():
    a, b = sine(MATRIX[0], 1, 50), sine(MATRIX[5], 1, 50)
    both = concatenate([a, b])
    assert np.all(np.diff(both.time) > 0)
    np.testing.assert_array_equal(both.displacement, np.concatenate([a.displacement, b.displacement]))


def test_nothing_several_rigs_and_dead_channels_are_refused(runs):
    with pytest.raises(IdentificationError, match="no runs"):
        JointProblem([], "play-bypass")
    other = recorded(sine(MATRIX[0], 4, 500), id="x", rig="other")
    with pytest.raises(IdentificationError, match="2 rigs"):
        JointProblem([*runs, other], "play-bypass")
    t = np.linspace(0, 4, 400)
    dead = Run("dead", t, np.sin(6 * t), np.zeros(400), 0.0)
    with pytest.raises(RunError, match="force does not change"):
        JointProblem([dead], "play-bypass")


def test_an_excitation_is_predicted_about_its_own_mid_stroke():
    """A short sweep ends away from its middle; a run of the same samples would be moved there."""
    damper = joint_damper()
    motion = sweep(0.5, 1.0, 1.2, 0.01, current=0.5)
    prediction = damper.predict(motion)
    np.testing.assert_allclose(prediction.force, simulate(damper.model, motion).force, rtol=1e-12)
    assert damper.predict(sine(Condition(0.5, 1.0, 0.01), 3)).extrapolation == ()
    assert "not a sine" not in prediction.extrapolation  # the model takes any motion


def test_effects_of_the_current_that_its_levels_do_not_determine_are_held_at_zero(problem):
    assert problem.determined() is problem
    one_level = problem.determined([i for i, current in enumerate(problem.currents) if current == 1.0])
    assert one_level.fixed == dict.fromkeys(("fy1", "c1", "h1", "si"), 0.0)
    assert set(one_level.free) == set(problem.free) - set(one_level.fixed)
    assert len(one_level.parts) == len(problem.parts)
