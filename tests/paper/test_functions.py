"""The paper's identification with its biases, as they were worked out, and its options."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.data import Condition, Run
from mrdamper.errors import IdentificationError, ParameterError
from mrdamper.identification import identify
from mrdamper.identification.harmonic_balance import SineRecord
from mrdamper.identification.problem import Problem
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper import paper_method as paper
from mrdamper.paper.genetic import GeneticMinimum, GeneticSettings
from mrdamper.paper.paper_method import Paper
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.physics.hysteresis import steady_loop
from mrdamper.physics.motion import sine
from mrdamper.statistics import levenberg_marquardt
from mrdamper.statistics.stop_reason import StopReason

GAS = GasSpring(1.5e6, 1.5e-4, np.pi * 1e-4)
READINGS = ("first-harmonic", "half-peak-to-peak")
# X [m], f [Hz], I [A]; then c, m, f_z, beta/true, NRMSE for each reading of F0.
BIASES = [
    (0.02, 1.0, 1.0, (14858, -867, 160, 1.6, 0.286), (12132, -701, 417, 1.4, 0.228)),
    (0.02, 2.0, 0.0, (2588, -31, 33, 1.6, 0.184), (2354, -27, 74, 1.6, 0.155)),
    (0.05, 0.5, 2.0, (16427, -1174, 261, 1.6, 0.314), (13290, -923, 605, 1.4, 0.247)),
    (0.05, 1.5, 1.0, (5222, -86, 199, 1.6, 0.260), (4443, -71, 452, 1.5, 0.207)),
    (0.08, 1.0, 1.0, (5033, -98, 214, 1.6, 0.263), (4271, -77, 474, 1.4, 0.208)),
]


def synthetic(current: float) -> BoucWen:
    k1, k2, k3 = GAS.stiffnesses("extension")
    c, yield_force = 1200 + 300 * current - 60 * current**2, 300 + 1500 * current - 350 * current**2
    values = {"c": c, "yield_force": yield_force, "beta": 2e5, "f0": 120.0, "k1": k1, "k2": k2, "k3": k3, "m": 15.0}
    return BoucWen.build(values)


def exact_force(model: BoucWen, motion, condition: Condition) -> np.ndarray:
    theta = 2 * np.pi * condition.frequency_Hz * motion.time
    return model.force(motion, model.yield_displacement * steady_loop(model.shape, condition.amplitude_m, theta))


def steady_run(condition: Condition, samples: int = 2000) -> Run:
    motion = sine(condition, 1.25, samples).part(slice(samples // 4, -1))
    force = exact_force(synthetic(condition.current_A), motion, condition)
    return Run("synthetic", motion.time, motion.displacement, force, condition.current_A)  # type: ignore[arg-type]


@pytest.mark.parametrize(("reading", "column"), [(READINGS[0], 3), (READINGS[1], 4)])
@pytest.mark.parametrize("row", BIASES)
def test_the_recipe_has_the_biases_worked_out_for_it(row, reading, column):
    condition = Condition(row[2], row[1], row[0])
    found = identify(steady_run(condition), "bouc-wen", Paper(force_amplitude=reading, search="optimum"), gas=GAS)
    c, m, yield_force, beta, nrmse = row[column]
    model = found.model
    assert isinstance(model, BoucWen)
    assert round(model.c) == pytest.approx(c, abs=1)  # the last digit given
    assert round(model.m) == pytest.approx(m, abs=1)
    assert round(model.yield_force) == pytest.approx(yield_force, abs=1)
    assert model.beta / 2e5 == pytest.approx(beta, abs=0.051)
    motion = sine(condition, 1.0, 2000)
    measured, predicted = (exact_force(one, motion, condition) for one in (synthetic(row[2]), model))
    assert np.std(predicted - measured) / np.std(measured) == pytest.approx(nrmse, abs=0.0006)


def test_the_note_says_how_much_of_c_is_hysteretic():
    found = identify(steady_run(Condition(1.0, 1.0, 0.02)), "bouc-wen", Paper(search="optimum"), gas=GAS)
    # (14858 − 1440)/14858
    assert any("counted twice: 90 % of c" in note for note in found.notes)


def test_the_recipe_makes_frequency_dependence_out_of_a_constant_damper():
    k1, _, k3 = GAS.stiffnesses()
    found = {}
    for X, f in ((0.02, 0.5), (0.08, 2.0)):
        model = BoucWen.build({"c": 1500.0, "yield_force": 1200.0, "beta": 2e5, "k1": k1, "k3": k3, "m": 15.0})
        condition = Condition(0.0, f, X)
        motion = sine(condition, 1.25, 1000).part(slice(250, -1))
        run = Run("constant", motion.time, motion.displacement, exact_force(model, motion, condition), 0.0)  # type: ignore[arg-type]
        found[X] = identify(run, "bouc-wen", Paper(search="optimum"), gas=GAS).model
    assert [round(found[X].c) for X in found] == pytest.approx([23709, 2987], abs=1)
    assert [round(found[X].m) for X in found] == pytest.approx([-2904, -8], abs=1)


def test_the_genetic_search_comes_to_the_optimum_it_is_after():
    run = steady_run(Condition(1.0, 1.0, 0.05), samples=400)
    optimum = identify(run, "bouc-wen", Paper(search="optimum"), gas=GAS)
    # A tenth of the paper's generations, to be quick; eight boxes make up for it.
    search = GeneticSettings(generations=50, narrowings=8)
    found = identify(run, "bouc-wen", Paper(genetic=search), gas=GAS)
    assert found.seed == 0
    assert found.model.c == optimum.model.c
    assert found.scores.nrmse_std == pytest.approx(optimum.scores.nrmse_std, rel=2e-3)
    assert found.model.yield_force == pytest.approx(optimum.model.yield_force, rel=0.02)


def test_the_genetic_search_alone_is_the_one_that_identifies():
    run = steady_run(Condition(1.0, 1.0, 0.05), samples=200)
    method = Paper(genetic=GeneticSettings(generations=3, population=8), explain=False)
    alone = method.genetic_search(Problem.of(run, BoucWen, gas=GAS))
    found = identify(run, "bouc-wen", method, gas=GAS)
    assert (found.model.alpha, found.model.beta) == pytest.approx(alone.point.tolist())
    assert (found.evaluations, found.ending) == (alone.evaluations, alone.ending)
    assert found.end == {"beta": found.model.beta}


def test_the_search_for_the_optimum_begins_at_the_best_of_its_grid(monkeypatch):
    run = steady_run(Condition(1.0, 1.0, 0.05), samples=400)
    method, asked = Paper(search="optimum", bounds=((0.0, 1e8), (0.0, 1e7))), {}

    def search(residual, start, lower, upper):
        asked.update(residual=residual, start=start, lower=lower, upper=upper)
        return levenberg_marquardt.least_squares(residual, start, lower, upper)

    monkeypatch.setattr(paper, "least_squares", search)
    found = identify(run, "bouc-wen", method, gas=GAS)
    X = SineRecord.of(run).condition.amplitude_m
    steepest = BoucWen.build({"c": 0.0, "alpha": 0.0, "beta": 1e7}).yield_displacement
    ends = [float(asked[name][0]) for name in ("lower", "upper")]
    assert ends == pytest.approx(np.log([steepest, 20 * X]))
    grid = np.linspace(*ends, 24)
    costs = [float(np.sum(asked["residual"](np.array([u])) ** 2)) for u in grid]
    assert asked["start"][0] == pytest.approx(grid[int(np.argmin(costs))])
    assert np.log(found.model.yield_displacement) == pytest.approx(asked["start"][0], abs=grid[1] - grid[0])


def test_a_gamma_that_is_held_ends_where_it_leaves_nothing_for_beta():
    def longest(**fixed):
        return paper._Remainder(SimpleNamespace(fixed=fixed), None, None).longest

    def rho(beta, **fixed):
        return paper._Remainder(SimpleNamespace(fixed=fixed), None, None).shape(beta).rho

    assert rho(7e3, gamma=2e3, n=3.0) == pytest.approx(-5 / 9) == -rho(2e3, gamma=7e3, n=3.0)
    assert rho(7e3) == 0.0  # tied to beta
    assert longest(gamma=0.5, n=2.0) == pytest.approx(0.999 * 0.5**-0.5)
    assert longest(gamma=8e3, n=3.0) == pytest.approx(0.999 / 20)
    assert longest(n=2.0) == longest(gamma=0.0, n=2.0) == np.inf


@pytest.mark.parametrize(
    ("alpha", "beta", "ended"),
    [(10.0005, 5e6, ("alpha",)), (10.00101, 5e6, ()), (1009.9995, 1e7 - 1, ("alpha", "beta")), (500.0, 3.0, ("beta",))],
)
def test_a_search_ended_at_its_box_within_a_millionth_of_it(monkeypatch, alpha, beta, ended):
    minimum = GeneticMinimum(np.array([alpha, beta]), 0.0, 1, np.array([]), (), StopReason.SETTLED)
    monkeypatch.setattr(paper, "_optimum", lambda *_: minimum)
    run = steady_run(Condition(1.0, 1.0, 0.05), samples=200)
    method = Paper(search="optimum", bounds=((10.0, 1010.0), (0.0, 1e7)), explain=False)
    assert identify(run, "bouc-wen", method, gas=GAS).at_bounds == ended


def test_every_switch_changes_what_it_is_named_after():
    run = steady_run(Condition(1.0, 1.0, 0.05), samples=400)

    def model(**options) -> BoucWen:
        return identify(run, "bouc-wen", Paper(search="optimum", **options), gas=GAS).model

    literal = model()
    assert model(force_amplitude="half-peak-to-peak").c < literal.c < model(force_amplitude="maximum").c * 1.2
    assert model(phase="peaks").m != literal.m
    # The mid-point of the extremes is off the true 120 N by what k2 does at the peaks.
    assert model(offset="mean").f0 == pytest.approx(120, abs=1e-3)
    assert literal.f0 == pytest.approx(120, abs=5)
    assert model(quadratic_stiffness="dropped").k2 == 0.0 != literal.k2


def test_without_a_gas_spring_the_in_phase_force_is_stiffness_and_the_result_says_so():
    run = steady_run(Condition(1.0, 1.0, 0.05), samples=400)
    known = identify(run, "bouc-wen", Paper(search="optimum"), gas=GAS)
    unknown = identify(run, "bouc-wen", Paper(search="optimum"))
    assert any("no gas spring is given" in note for note in unknown.notes)
    k1, _, k3 = GAS.stiffnesses()
    in_phase = k1 + 0.75 * k3 * 0.05**2 - known.model.m * (2 * np.pi) ** 2
    assert unknown.model.k1 == pytest.approx(in_phase, rel=1e-9)
    assert unknown.model.m == 0.0


def test_a_motion_that_leaves_no_gas_volume_is_refused():
    run = steady_run(Condition(1.0, 1.0, 0.05), samples=200)
    with pytest.raises(ParameterError, match="no gas volume"):
        identify(run, "bouc-wen", Paper(search="optimum"), gas=GasSpring(1.5e6, 1e-5, np.pi * 1e-4))


@pytest.mark.parametrize(
    ("request_", "text"),
    [
        ({"model": "bingham"}, "not Bingham"),
        ({"fixed": {"alpha": 1e5}}, "leave alpha free"),
        ({"free": ("n",)}, "leave n preset"),
        ({"with_delay": True}, "no delay"),
    ],
)
def test_what_the_recipe_cannot_do_is_refused(request_, text):
    run = steady_run(Condition(1.0, 1.0, 0.05), samples=200)
    with pytest.raises(IdentificationError, match=text):
        identify(run, **{"model": "bouc-wen", **request_}, method=Paper(search="optimum"))


def test_the_cost_is_the_error_over_all_samples_and_a_box_is_told_where_it_ends_the_search():
    run = steady_run(Condition(1.0, 1.0, 0.05), samples=400)
    method = Paper(search="optimum")
    found = identify(run, "bouc-wen", method, gas=GAS)
    problem = Problem.of(run, BoucWen, gas=GAS)
    record = SineRecord.of(run)
    points = [(found.model.alpha, found.model.beta), (2e5, 3e5), (0.0, 1e6)]
    for (alpha, beta), cost in zip(points, method.cost(problem)(np.array(points)), strict=True):
        model = replace(found.model, alpha=alpha, beta=beta, gamma=beta)
        state = model.yield_displacement * steady_loop(model.shape, record.condition.amplitude_m, record.theta)
        assert cost == pytest.approx(
            np.sqrt(np.mean((model.force(record.motion, state) - record.force) ** 2)), rel=1e-6
        )
    assert found.at_bounds == ()
    assert found.evaluations > 24
    assert found.seed is None
    best = method.cost(problem)(np.array([[a * found.model.alpha, b * found.model.beta] for a, b in
                                          ((1, 1), (1.02, 1), (0.98, 1), (1, 1.05), (1, 0.95))]))  # fmt: skip
    assert int(np.argmin(best)) == 0
    low = identify(run, "bouc-wen", Paper(search="optimum", bounds=((0.0, 1e3), (0.0, 1e8))), gas=GAS)
    assert low.at_bounds == ("alpha",)
    assert low.model.alpha == pytest.approx(1e3)
    steep = identify(run, "bouc-wen", Paper(search="optimum", bounds=((0.0, 1e8), (0.0, 1e4))), gas=GAS)
    assert steep.at_bounds == ("beta",)
    assert steep.model.beta == pytest.approx(1e4, rel=1e-6)
