"""Plans: records inside the limits and the hours, each with a reason, that shrink the doubt."""

import csv
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.dampers import joint_damper
from support.sessions import session_runs
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.dampers.calibration import Growth
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.model_file import save_model
from mrdamper.dampers.prediction import distance_from_tests
from mrdamper.data import Condition
from mrdamper.errors import ConditionError, InputError
from mrdamper.rig_files.motion_file import load_motion
from mrdamper.study.first_matrix import first_matrix
from mrdamper.study.limits import Limits
from mrdamper.study.plan import ExperimentDesign, _slopes, _with_currents_between, least_informative_runs, plan_tests
from mrdamper.study.proposal import PlanRow

sys.path.insert(0, str(Path(__file__).parents[2]))
from benchmarks.planning import designs, reckoned

LIMITS = Limits((0.0, 1.0), (0.5, 4.0), (2.0, 20.0), velocity_m_s=0.2, force_N=1500.0, session_minutes=5.0)


@pytest.fixture(scope="module")
def damper():
    return estimate_uncertainty(joint_damper(), session_runs(joint_damper()))


@pytest.fixture(scope="module")
def reckoning(damper):
    return ExperimentDesign.of(damper, LIMITS, LIMITS.candidates(0.5))


def test_every_record_is_allowed_and_shrinks_the_doubt(reckoning):
    made = reckoning.proposals(reckoning.chosen(0.5))
    assert made
    sessions = {item.session for item in made}
    # A pause between records falls into setting a session up.
    assert sum(item.minutes for item in made) + len(sessions) * (5.0 - 3.0) <= 30
    assert sessions == set(range(1, len(sessions) + 1))
    assert [item.session for item in made] == sorted(item.session for item in made)
    for item in made:
        assert item.condition.peak_velocity <= 0.2 * (1 + 1e-9)
        assert item.after < item.before
    assert [item.before for item in made[1:]] == [item.after for item in made[:-1]]
    assert "90 % prediction interval of the force over the envelope" in reckoning.summary(made)


def test_sessions_are_taken_where_they_pay(reckoning):
    few, many = (len(reckoning.chosen(hours)) for hours in (0.5, 1.5))
    assert 1 < few < many <= LIMITS.sessions
    alike = replace(reckoning, session=np.array([1e12, 1e12]))
    assert len(alike.chosen(1.0)) == 1  # where sessions do not differ, the second has nothing to say
    assert len(replace(reckoning, limits=replace(LIMITS, sessions=2)).chosen(1.5)) == 2


def test_a_sessions_records_tell_what_its_own_gain_leaves(reckoning):
    size = len(reckoning.names)
    table = np.linalg.cholesky(reckoning.grams[5, 0] + 1e-9 * np.eye(size + 2)).T
    # By elimination: the gain and the offset are two more numbers, with their spread as what is known of them.
    whole = table.T @ table + np.diag([*np.zeros(size), *reckoning.session])
    expected = np.linalg.inv(np.linalg.inv(whole)[:size, :size])
    assert reckoning.information(reckoning.grams[5, :1]) == pytest.approx(expected, rel=1e-3, abs=1e-3)
    assert reckoning.spread([[5], [5]]) < reckoning.spread([[5, 5]]) < reckoning.spread([[5]])


def test_a_doubt_can_be_chosen(damper, reckoning):
    made, about = plan_tests(damper, LIMITS, 0.3, "c1")
    i = about.names.index("c1")
    error = np.sqrt(damper.uncertainty.covariance[i, i]) / damper.fitted_parameters["c1"].value
    assert made[0].before == pytest.approx(error, rel=1e-3)
    assert "standard error of c1" in about.summary(made)
    whole = reckoning.chosen(0.3)
    assert made[-1].after < about.spread(whole)
    _, at = plan_tests(damper, LIMITS, 0.3, Condition(1.0, 0.5, 0.02))
    assert "at 1 A" in at.about
    assert at.spread(at.chosen(0.3)) <= at.spread(whole)
    with pytest.raises(InputError, match="number to plan for"):
        plan_tests(damper, LIMITS, 0.3, "x")


def test_without_limits_the_tested_ranges_are_planned_in(damper):
    made, about = plan_tests(damper, hours=0.3)
    assert about.limits == Limits.of(damper)
    assert made == plan_tests(damper, Limits.of(damper), 0.3)[0]


def test_what_no_run_could_tell_is_planned_for():
    known = estimate_uncertainty(joint_damper(), [run for run in session_runs(joint_damper()) if run.current_A == 0.5])
    assert "c1" in known.uncertainty.unknown
    made, _ = plan_tests(known, LIMITS, 0.3)
    assert len({item.condition.current_A for item in made}) > 1
    assert made[-1].after < 0.2 * made[0].before


FEW = [Condition(0.0, 1.0, 0.01), Condition(1.0, 0.5, 0.02)]


def design(damper, about=None, **known):
    return ExperimentDesign.of(replace(damper, uncertainty=replace(damper.uncertainty, **known)), LIMITS, FEW, about)


def test_a_parameter_that_is_not_known_has_a_prior_and_one_that_is_its_covariance(damper):
    known = estimate_uncertainty(joint_damper(), [run for run in session_runs(joint_damper()) if run.current_A == 0.5])
    made = design(known)
    size = len(known.uncertainty.names)
    prior = np.linalg.inv(made.prior)
    assert prior[:size, :size] == pytest.approx(known.uncertainty.covariance, rel=1e-6, abs=1e-12)
    for i, name in enumerate(made.names[size:], size):
        expected = 1.0 if known.fitted_parameters[name].log else 1 / made.goal[i, i]
        assert prior[i, i] == pytest.approx(expected, rel=1e-6)
    logs = {known.fitted_parameters[name].log for name in made.names[size:]}
    assert logs == {True, False}
    # The error of a parameter is relative: of its logarithm as it is, of one that is zero in its unit.
    zero = replace(damper, model=replace(damper.model, f0=0.0))
    for name, goal in (("vh", 1.0), ("f0", 1.0), ("c1", damper.model.c1**-2)):
        made = design(zero, name)
        i = made.names.index(name)
        assert made.goal[i, i] == pytest.approx(goal)
        assert np.count_nonzero(made.goal) == 1


def test_errors_enter_a_design_by_their_squares(damper):
    none = dict(gain=0.0, offset=0.0, run_gain=0.0, run_offset=0.0)
    once, twice = (design(damper, force=force, **none) for force in (0.03, 0.06))
    assert once.grams == pytest.approx(4 * twice.grams)
    assert (once.beside, twice.beside) == pytest.approx((0.03**2, 0.06**2))
    halves = [np.ptp(damper.predict(condition).force) / 2 for condition in FEW]
    # A session is known to a ten thousandth and a thousandth of the force at best.
    assert once.session == pytest.approx([1e8, (1e-3 / np.mean(np.divide(1, halves))) ** -2], rel=0.05)
    gains, offsets = (design(damper, force=0.0, **none | {n: 0.2}) for n in ("gain", "offset"))
    assert gains.session[0] == pytest.approx(0.2**-2)
    assert offsets.beside == pytest.approx(0.2**2 * np.mean(np.divide(1, halves) ** 2), rel=0.05)
    wide = design(damper, force=0.0, **none | {"gain": 0.4})
    assert wide.beside == pytest.approx(4 * gains.beside)
    forces = [damper.predict(condition).force for condition in FEW]
    squares = [np.mean(force**2) / half**2 for force, half in zip(forces, halves, strict=True)]
    assert gains.beside == pytest.approx(0.2**2 * np.mean(squares), rel=0.05)


def test_a_plan_says_what_its_numbers_are(reckoning, damper):
    played = [[3], [5, 7]]
    made = reckoning.proposals(played)
    today = np.sqrt(np.diag(np.linalg.inv(reckoning.prior)))
    then = np.sqrt(np.diag(np.linalg.inv(reckoning.precision([[3], []])))) / today
    best = reckoning.names[int(np.argmin(then))]
    assert made[0].reason == f"standard error of {best} falls to {100 * then.min():.0f} % of today's"
    assert then.min() < 1
    before, after = reckoning.spread([]), reckoning.spread(played)
    assert (made[0].before, made[-1].after) == (before, pytest.approx(after))
    t = 164.4853627  # of a normal distribution, in per cent
    whole = [t * np.sqrt(s**2 + reckoning.beside) for s in (before, after)]
    text = reckoning.summary(made)
    assert f"±{t * before:.1f} % -> ±{t * after:.1f} % from the parameters and the distance from the tests" in text
    assert f"±{whole[0]:.1f} % -> ±{whole[1]:.1f} % with a future session and the model error at tests" in text
    own = design(damper, "c1").proposals([[0], [1]])
    shown = f"standard error of c1 {100 * own[0].before:.1f} % -> {100 * own[-1].after:.1f} % of its value"
    assert design(damper, "c1").summary(own) == shown
    wild = [replace(own[0], before=1.5), replace(own[-1], after=0.2)]
    expected = "standard error of c1 over 100 % (not determined) -> 20.0 % of its value"
    assert design(damper, "c1").summary(wild) == expected


def test_a_plan_between_two_currents_tests_one_between_and_reduces_what_the_interval_states(damper):
    """The model error between two tested currents is no variance of parameters."""
    tests = [Condition(i, f, a) for i in (0.0, 1.0) for f, a in ((0.5, 0.02), (4.0, 0.002), (0.5, 0.002), (1.0, 0.02))]
    known = replace(
        damper, envelope=Envelope.of(tests),
        uncertainty=replace(damper.uncertainty, growth=Growth(force=(0.15, 0.25, 0.25), dof=(1.0, 1.0, 1.0))),
    )  # fmt: skip
    limits = replace(LIMITS, sessions=1)
    made, reckoning = plan_tests(known, limits, 0.2)
    currents = [item.condition.current_A for item in made]
    assert {0.33, 0.67} & set(currents)
    reasons = [item.reason for item in made if 0 < item.condition.current_A < 1]
    rows = [
        reckoning.conditions.index(item.condition) for item in made[: 1 + [i.reason for i in made].index(reasons[0])]
    ]
    share = np.sqrt(reckoning.by_distance(rows)[0] / reckoning.by_distance([])[0])
    assert reasons[0] == f"model error between the tested currents falls to {100 * share:.0f} % of today's"
    # The variances are those of the interval, at the conditions of the grid and at currents between them.
    at = _with_currents_between(reckoning.conditions)
    assert {c.current_A for c in at} == {0.0, 0.165, 0.33, 0.5, 0.67, 0.835, 1.0}
    few = [Condition(0.0, 1.0, 0.01), Condition(1.0, 1.0, 0.01), Condition(1.0, 2.0, 0.01)]
    assert _with_currents_between(few) == [*few, Condition(0.5, 1.0, 0.01)]
    for rows in ([], [reckoning.conditions.index(item.condition) for item in made]):
        later = replace(known, envelope=known.envelope.with_tests([reckoning.conditions[i] for i in rows]))
        halves = [
            later.uncertainty.growth.half_width("force", distance_from_tests(later, c, np.array([c.current_A])), 0.9)
            for c in at
        ]
        assert reckoning.by_distance(rows).sum() == pytest.approx(np.mean(np.square(halves)) / 1.644853627**2)
    _, at_one = plan_tests(known, limits, 0.2, Condition(0.5, 1.0, 0.01))
    assert at_one.by_distance([])[0] > reckoning.by_distance([])[0]
    assert not plan_tests(known, limits, 0.2, "c1")[1].by_distance([]).any()


def small(records, minutes, *, sessions=1, opening=0.0, known=1e-9, session=1e12):
    """A design with records of known information on each parameter, and a gain that a session adds to all of them.

    records : C rows of the information on P parameters; known : that of today.
    """
    records = np.asarray(records, dtype=float)
    size = records.shape[1]
    grams = np.zeros((len(records), 1, size + 2, size + 2))
    for gram, row in zip(grams, records, strict=True):
        gram[0] = np.diag([*row, row.sum(), 1e-9])
        gram[0, :size, size] = gram[0, size, :size] = row
    return ExperimentDesign(
        SimpleNamespace(opening=opening, sessions=sessions, minutes=lambda at: minutes[at]), range(len(records)),
        tuple("abc"[:size]), known * np.eye(size), np.eye(size), grams, np.array([session, 1.0]), "", 0.0,
    )  # fmt: skip


def test_the_next_record_is_the_one_that_reduces_the_variance_most_for_its_time():
    """With sessions that are alike every variance is one over a sum: today's 1, then 0.45 of a, 0.3 of b, 0.55 of b."""
    made = small([(0.45, 0.0), (0.0, 0.3), (0.0, 0.55)], (1.0, 1.0, 2.0), known=1.0)
    assert made.chosen(1 / 60) == [[0]]
    filled = made._filled(1, 5 / 60)
    played, information = [], np.ones(2)
    while sum(made.minutes[i] for i in played) < 5:
        left = 5 - sum(made.minutes[i] for i in played)
        gains = [
            (np.sum(1 / information) - np.sum(1 / (information + row))) / minutes if minutes <= left else -1
            for row, minutes in (((0.45, 0.0), 1.0), ((0.0, 0.3), 1.0), ((0.0, 0.55), 2.0))
        ]
        played.append(int(np.argmax(gains)))
        information = information + ((0.45, 0.0), (0.0, 0.3), (0.0, 0.55))[played[-1]]
    assert filled == [played]
    assert made.variance(made.precision(filled)) == pytest.approx(np.sum(1 / information))


@pytest.mark.parametrize("sessions", [1, 2, 3])
def test_every_session_gets_a_record_and_none_that_fits_is_left(sessions):
    """Two minutes open a session; a long record in the first would leave the others empty."""
    made = small([(1.0,), (9.0,)], (1.0, 3.0), sessions=3, opening=2.0)
    for minutes in np.arange(3.0 * sessions, 3.0 * sessions + 9, 0.5):
        played = made._filled(sessions, minutes / 60)
        assert all(played)
        spent = 2.0 * sessions + sum(made.minutes[rows].sum() for rows in played)
        assert minutes - 1.0 < spent <= minutes + 1e-9


def test_an_exchange_never_raises_the_variance_and_none_is_left_for_the_last_record():
    """The record that is best alone adds nothing where another has told it."""
    made = small([(1.0, 0.0), (0.0, 3.0), (0.6, 0.6)], (1.0, 1.0, 1.0), known=1.0)
    for played in ([[0, 1]], [[1, 1]], [[2, 0, 1]], [[0, 0, 0]], [[0, 1], [1]], [[2], [2, 2]]):
        before = made.spread(played)
        exchanged = made._exchanged([list(rows) for rows in played])
        assert made.spread(exchanged) <= before * (1 + 1e-12)
        others = [*exchanged[:-1], exchanged[-1][:-1]]
        trials = [made.spread([*others[:-1], [*others[-1], i]]) for i in range(3)]
        assert made.spread(exchanged) == pytest.approx(min(trials))
    assert made._exchanged([[0, 1]]) == [[0, 1]]
    slow = small([(1.0,), (9.0,)], (1.0, 3.0))
    assert (slow._exchanged([[0]]), slow._exchanged([[1]])) == ([[0]], [[1]])  # no longer than the one it replaces


def test_the_number_of_sessions_is_the_best_of_those_the_hours_hold():
    """Where the gain of a session is all that is not known, every record beyond its first is lost."""
    for session, most, minutes, count in ((1.0, 3, 9.0, 3), (1.0, 2, 9.0, 2), (1.0, 5, 8.9, 2), (1e12, 3, 9.0, 1)):
        made = small([(1e4,), (1e4,)], (1.0, 5.0), sessions=most, opening=2.0, session=session)
        assert len(made.chosen(minutes / 60)) == count


def test_a_record_counts_by_samples_spread_evenly_over_a_steady_cycle(damper):
    condition = FEW[1]
    names = damper.uncertainty.names
    table, *drawn = _slopes(damper, damper.uncertainty, names, condition)
    assert [np.allclose(one, table, rtol=1e-3) for one in drawn] == [False] * 2  # at the estimate and beside it
    assert table.shape == (24, len(names) + 2)
    steady = damper.predict(condition).force
    force, half = table[:, -2] / table[:, -1], np.ptp(steady) / 2
    assert table[:, -1] == pytest.approx(1 / half, rel=0.02)
    assert (np.mean(force), np.std(force)) == pytest.approx(
        (np.mean(steady), np.std(steady)), rel=0.05, abs=0.02 * half
    )
    assert np.abs(np.fft.fft(force)[1]) == pytest.approx(12 * np.abs(np.fft.fft(steady)[1]) / steady.size * 2, rel=0.02)


def test_a_first_matrix_has_a_reason_for_every_row():
    made = first_matrix(LIMITS, 1.0)
    assert len({item.reason for item in made}) == len(made) > 8
    assert all(item.condition.peak_velocity <= 0.2 * (1 + 1e-9) for item in made)
    assert sum(item.minutes for item in made) + 2 * 2.0 <= 60
    assert [item.session for item in made] == [1] * (len(made) - 1) + [2]
    assert len(first_matrix(LIMITS, 0.1)) < len(made)
    assert {item.session for item in first_matrix(replace(LIMITS, sessions=1), 1.0)} == {1}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("current = [0, 1]", "current_A"),
        ("current_mA = [0, 1000]", "current_A"),
        ("current_A = [1, 0]\nfrequency_Hz = [1, 2]\namplitude_mm = [1, 2]", "in order"),
        ("current_A = [0, 1]\nfrequency_Hz = [1, 2]", "amplitude_mm"),
        ("current_A = [0, 1]\nfrequency_Hz = [1, 2]\namplitude_mm = [2000, 20000]", "µm"),
        ("current_A = [0, 1]\nfrequency_Hz = [1, 2]\namplitude_mm = [10, 20]\nvelocity_m_s = 0.001", "slowest"),
        ("current_A = [0, 1]\nfrequency_Hz = [1, 2]\namplitude_mm = [0.01, 0.02]", "in m?"),
        ("current_A = [0, 1000]\nfrequency_Hz = [1, 2]\namplitude_mm = [10, 20]", "mA"),
        ("current_A = [0, 1]\nfrequency_Hz = [1, 2]\namplitude_mm = [10, 20]\nvelocity_m_s = 200", "mm/s"),
        ("current_A = [0, 1]\nfrequency_Hz = [1, 2]\namplitude_mm = [10, 20]\nsessions = 1.5", "valid integer"),
        ("current_A = [0, 1]\nfrequency_Hz = [1, 2]\namplitude_mm = [10, 20]\ncycles = [5]", "valid number"),
        ("current_A = [0, nan]\nfrequency_Hz = [1, 2]\namplitude_mm = [10, 20]", "current_A"),
        ("current_A = ", "E_LIMITS"),
    ],
)
def test_limits_that_are_none_are_refused(tmp_path, text, says):
    path = tmp_path / "limits.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        Limits.read(path)
    assert "E_LIMITS" in str(caught.value)
    assert says in str(caught.value)


def test_hours_that_hold_no_record_and_models_that_know_nothing_are_refused(damper):
    for hours in (0.001, 5.0 / 60, float("nan"), -1.0):
        with pytest.raises(InputError, match="E_LIMITS"):
            plan_tests(damper, LIMITS, hours)
    with pytest.raises(InputError, match="E_ARGUMENT"):
        plan_tests(damper, LIMITS, "two")
    with pytest.raises(InputError, match="E_CERTAINTY"):
        plan_tests(joint_damper(), LIMITS, 1.0)


def test_the_least_informative_runs_are_those_of_the_smallest_shares(damper):
    shares = {"a": 0.4, "b": 0.1, "c": 0.3, "d": 0.2}
    told = replace(damper, uncertainty=replace(damper.uncertainty, information=shares))
    assert least_informative_runs(told, 3) == [("b", 0.1), ("d", 0.2), ("c", 0.3)]
    assert least_informative_runs(told, 4) == least_informative_runs(joint_damper()) == []


def test_the_records_are_read_back(damper, tmp_path):
    save_model(damper, tmp_path / "m.json")
    asked = ["plan", str(tmp_path / "m.json"), "--hours", "0.25", "--about", "0.5,2,8", "--out", str(tmp_path / "next")]
    got = CliRunner().invoke(application(), asked)
    assert got.exit_code == 0, got.output
    assert "least informative runs: r" in got.stdout
    assert "interval of the force at 0.5 A, 2 Hz, 8 mm" in got.stdout.replace("2.00", "2").replace("8.00", "8")
    with (tmp_path / "next" / "plan.csv").open() as file:
        listed = list(csv.DictReader(file))
    for row in listed:
        run = load_motion(tmp_path / "next" / row["file"])
        assert np.ptp(run.displacement) / 2 == pytest.approx(1e-3 * float(row["amplitude_mm"]), rel=0.02)
        assert run.current_A == pytest.approx(float(row["current_A"]))
        assert float(row["minutes"]) > 3
        assert float(row["standard_deviation_after"]) < float(row["standard_deviation_before"])
    read = CliRunner().invoke(
        application(),
        ["import", *(str(tmp_path / "next" / row["file"]) for row in listed), "--out", str(tmp_path / "d")],
    )
    assert (read.exit_code, "computed, not measured: predicted_force_N" in read.output) == (2, True), read.output
    none = CliRunner().invoke(application(), [*asked[:4], "--about", "1,2", "--out", str(tmp_path / "none")])
    assert isinstance(none.exception, ConditionError)


def test_a_motion_planned_without_a_model_has_no_force(tmp_path):
    limits = "current_A = [0, 2]\nfrequency_Hz = [0.5, 4]\namplitude_mm = [2, 20]\n"
    for rated, columns in (
        ("", "time_s,displacement_m,current_A"),
        ("force_N = 900", "time_s,displacement_m,estimated_force_N,current_A"),
    ):
        (tmp_path / "limits.toml").write_text(limits + rated)
        out = tmp_path / f"plan{rated}"
        asked = ["plan", "--limits", str(tmp_path / "limits.toml"), "--hours", "0.5", "--out", str(out)]
        got = CliRunner().invoke(application(), asked)
        assert ("estimated_force_N is from the rated force" in got.stdout) == ("force_N" in got.stdout) == bool(rated)
        assert {path.read_text().partition("\n")[0] for path in out.glob("plan_*.csv")} == {columns}


def test_a_plan_beats_chance_and_the_factorial_grid_by_choosing_its_sessions():
    found = designs(reckoned(1), 2.0, 1)
    for other in ("random records, one session", "factorial grid, one session", "plan that ignores drift"):
        assert found["plan"] < 0.75 * found[other], other
    assert found["plan"] < 0.9 * found["random records, sessions as the plan"]


def test_a_record_of_too_many_samples_is_refused_and_the_remedy_works():
    with pytest.raises(InputError, match=r"1.2e\+08 samples") as caught:
        replace(LIMITS, sample_rate_Hz=1e7)
    assert caught.value.code == "E_LIMITS"
    most = int(caught.value.remedy.split("at most ")[1].split()[0].replace(",", ""))
    assert replace(LIMITS, sample_rate_Hz=most * LIMITS.frequency_Hz[0] / LIMITS.cycles).sample_rate_Hz > 1e4


def test_conditions_of_a_plan_are_set_by_two_or_three_digits_inside_the_limits():
    allowed = replace(LIMITS, current_A=(0.0, 1.6), frequency_Hz=(0.4999998, 4.0000006), amplitude_mm=(5.004, 12.345))
    found = allowed.candidates(2.0)
    assert {c.current_A for c in found} == {0.0, 0.53, 1.07, 1.6}
    assert {c.frequency_Hz for c in found} == {0.5, 1.0, 2.0, 4.0}
    assert {round(1e3 * c.amplitude_m, 9) for c in found} == {5.004, 6.8, 9.1, 12.3}
    allowed = replace(
        LIMITS, current_A=(0.0, 2.0), frequency_Hz=(0.5, 4.0), amplitude_mm=(2.0, 20.0), velocity_m_s=0.13
    )
    for condition in [item.condition for item in first_matrix(allowed, 2.0)]:
        values = condition.current_A, condition.frequency_Hz, round(1e3 * condition.amplitude_m, 9)
        assert [float(f"{value:.2g}") for value in values] == list(values)
        assert condition.peak_velocity <= 0.13
    tested = Limits.of(joint_damper())
    assert all(
        len(f"{end:g}".strip("0.").replace(".", "")) <= 3 for end in (*tested.frequency_Hz, *tested.amplitude_mm)
    )


def test_the_table_of_a_plan_has_conditions_without_the_digits_of_a_measurement():
    item = SimpleNamespace(
        session=1, condition=Condition(0.5, 1.000000000006847, 0.0104), minutes=3.1, before=0.1, after=0.05, reason=""
    )
    row = PlanRow.of(1, item, "plan_01.csv")
    assert (row.frequency_Hz, row.amplitude_mm) == (1.0, 10.4)
