from dataclasses import replace

import numpy as np
import pytest
from support.models import EXAMPLES
from support.synthetic import TRUTH, synthetic_run

from mrdamper.data import Condition, Dataset, Run
from mrdamper.errors import IdentificationError, RunError, UnknownNameError
from mrdamper.identification import identify
from mrdamper.identification.covariance import spread
from mrdamper.identification.methods import all_methods, projection
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.models.spencer import Spencer
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.physics.motion import sine
from mrdamper.physics.simulation import simulate
from mrdamper.statistics.levenberg_marquardt import least_squares
from mrdamper.statistics.linear import solve_bounded
from mrdamper.study.usable_runs import usable_sines


@pytest.mark.parametrize("current_frequency", [(0.0, 0.5), (1.0, 1.0), (2.0, 2.0)])
def test_known_damper_is_recovered(current_frequency):
    current, frequency = current_frequency
    found = identify(synthetic_run(Condition(current, frequency, 0.02)))
    # The motion is smoothed before use, which costs a few parts in a thousand of the slope.
    assert found.model.c == pytest.approx(TRUTH["c"], rel=5e-3)
    assert found.model.yield_force == pytest.approx(BoucWen(**TRUTH).yield_force, rel=2e-3)
    assert found.model.yield_displacement == pytest.approx(BoucWen(**TRUTH).yield_displacement, rel=5e-3)
    assert found.model.f0 == pytest.approx(120, abs=0.5)
    assert found.scores.nrmse_pp < 1e-3
    assert found.ending.converged
    assert not found.at_bounds


def test_standard_errors_cover_the_truth_under_noise(condition):
    truth, inside = BoucWen(**TRUTH), 0
    for seed in range(20):
        found = identify(synthetic_run(condition, noise=30.0, seed=seed))
        inside += abs(found.model.c - truth.c) < 2 * found.standard_errors["c"]
    assert inside >= 15  # nominally 19 of 20; smoothing bias takes some


def test_sharper_knee_is_found_when_n_is_freed(condition):
    model = BoucWen.build({"c": 1000.0, "yield_force": 900.0, "yield_displacement": 1e-3, "n": 4.0})
    found = identify(synthetic_run(condition, model=model), free=("n",))
    assert found.model.n == pytest.approx(4.0, rel=0.05)


def test_delay_is_found_within_its_bounds(condition):
    run = synthetic_run(condition)
    delayed = Run(
        "late", run.time, run.displacement, np.interp(run.time - 2e-3, run.time, run.force), 1.0, window=run.window
    )
    found = identify(delayed, with_delay=True)
    assert found.delay == pytest.approx(2e-3, rel=0.1)


def test_a_known_gas_spring_frees_the_mass():
    """k and m act alike at one frequency; the gas spring settles k."""
    gas = GasSpring(1.5e6, 1.5e-4, np.pi * 1e-4)
    k1, k2, k3 = gas.stiffnesses("extension")
    model = BoucWen(c=1440, alpha=9e5, beta=2e5, gamma=2e5, f0=120, k1=k1, k2=k2, k3=k3, m=15.0)
    found = identify(synthetic_run(Condition(1.0, 2.0, 0.05), model=model), gas=gas)
    assert found.model.m == pytest.approx(15.0, rel=0.02)
    assert "m" in found.free
    assert "k1" not in found.free


def test_mass_and_stiffness_together_are_refused(condition):
    with pytest.raises(IdentificationError, match="one parameter"):
        identify(synthetic_run(condition), free=("m",))


def test_result_says_that_the_mass_was_left_out(condition):
    assert any("mass not identified" in note for note in identify(synthetic_run(condition)).notes)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"model": "bingam"}, "did you mean bingham"),
        ({"method": "projektion"}, "did you mean projection"),
        ({"free": ("gama",)}, "did you mean gamma"),
        ({"fixed": {"q": 1.0}}, "no parameter of bouc-wen is called 'q'"),
    ],
)
def test_unknown_names_are_refused_with_near_ones(condition, arguments, text):
    with pytest.raises(UnknownNameError, match=text):
        identify(synthetic_run(condition), **arguments)


def test_a_dead_force_and_a_varying_current_are_refused(condition):
    run = synthetic_run(condition)
    with pytest.raises(IdentificationError, match="force does not change"):
        identify(Run("dead", run.time, run.displacement, np.zeros(run.time.size), 1.0))
    with pytest.raises(RunError, match="the current changes within the run"):
        identify(Run("vary", run.time, run.displacement, run.force, np.linspace(0, 1, run.time.size)))


def test_projection_is_found_by_discovery():
    assert "projection" in all_methods()


def test_bounded_least_squares_stop_at_bounds_and_resolves_the_rest():
    columns = np.random.default_rng(0).standard_normal((50, 3))
    right = columns @ np.array([1.0, -2.0, 3.0])
    solution, held = solve_bounded(columns, right, np.array([-9.0, 0.0, -9.0]), np.full(3, 9.0))
    assert solution[1] == 0.0
    assert held.tolist() == [False, True, False]
    rest = np.linalg.lstsq(columns[:, [0, 2]], right, rcond=None)[0]
    np.testing.assert_allclose(solution[[0, 2]], rest)


def test_levenberg_marquardt_finds_rosenbrocks_valley_and_respects_its_box():
    def rosenbrock(p):
        return np.array([10 * (p[1] - p[0] ** 2), 1 - p[0]])

    found = least_squares(rosenbrock, np.array([-1.2, 1.0]), np.full(2, -2.0), np.full(2, 2.0), most_steps=100)
    np.testing.assert_allclose(found.point, 1.0, atol=1e-4)
    boxed = least_squares(rosenbrock, np.array([-1.2, 1.0]), np.full(2, -2.0), np.array([0.5, 2.0]), most_steps=100)
    np.testing.assert_allclose(boxed.point, [0.5, 0.25], atol=1e-4)


def test_standard_errors_widen_with_autocorrelation():
    rng = np.random.default_rng(1)
    white = rng.standard_normal(4_000)
    slow = np.zeros(4_000)
    for i in range(1, 4_000):
        slow[i] = 0.9 * slow[i - 1] + white[i]
    column = np.ones((4_000, 1))
    assert 4_000 / spread(column, white).memory == pytest.approx(1, abs=0.3)
    assert 4_000 / spread(column, slow).memory == pytest.approx(19, rel=0.4)  # (1 + 0.9)/(1 − 0.9)
    assert spread(column, slow).effective[0] == pytest.approx(4_000 / 19, rel=0.4)
    assert spread(column, slow).errors[0] > 3 * spread(column, slow[rng.permutation(4_000)]).errors[0]
    assert spread(np.zeros((10, 1)), np.ones(10)).errors[0] == np.inf


@pytest.mark.parametrize(("rig", "model", "bound"), [
    ("utfsm", "bouc-wen", 0.032), ("labcontrol", "bouc-wen", 0.044),
    ("utfsm", "bingham", 0.080), ("labcontrol", "bingham", 0.089),
])  # fmt: skip
def test_real_runs_are_described_at_least_as_well_as_by_the_reference_fits(bundled, rig, model, bound):
    runs = [run for run in bundled.rig(rig) if run.excitation == "sine"]
    errors = [identify(run, model).scores.nrmse_pp for run in runs]
    assert np.median(errors) <= bound


def test_a_clipped_record_is_refused_unless_wanted(bundled):
    run = replace(bundled["utf_5mm4Hz_1A"], notes={"findings": "W_DRIFT W_CLIPPED"})
    with pytest.raises(IdentificationError, match="clipped"):
        identify(run)
    assert identify(run, clipped=True).scores.nrmse_pp < 0.1
    assert usable_sines(Dataset((run,)))[1].keys() == {run.id}


def test_a_dataset_in_place_of_a_run_is_told_what_to_call(bundled):
    with pytest.raises(IdentificationError) as error:
        identify(bundled)
    assert "run_study(dataset)" in error.value.remedy


def test_a_long_record_of_a_stepped_model_is_searched_on_its_end_first(monkeypatch):
    """Where the whole leads, at fewer forces along all of it."""
    motion = sine(Condition(1.0, 1.0, 0.01), 12, 400)
    force = simulate(Spencer(**EXAMPLES["spencer"]), motion).force
    run = Run("long", motion.time, motion.displacement, force + np.sin(40 * motion.time), 1.0)
    held = {name: EXAMPLES["spencer"][name] for name in ("k0_rate", "yield_displacement")}
    whole = identify(run, "spencer", fixed=held)
    monkeypatch.setattr(projection, "_LONG_RECORD_SAMPLES", 3000)
    rehearsed = identify(run, "spencer", fixed=held)
    for name in ("c1", "c0_ratio", "creep"):
        assert getattr(rehearsed.model, name) == pytest.approx(getattr(whole.model, name), rel=1e-4)
    assert rehearsed.scores.nrmse_pp == pytest.approx(whole.scores.nrmse_pp, rel=1e-6)


def test_a_window_without_samples_is_named():
    run = replace(synthetic_run(Condition(0.5, 1.0, 0.01)), window=(500.0, 600.0))
    with pytest.raises(RunError, match="holds 0 samples"):
        identify(run)
