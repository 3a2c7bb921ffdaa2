"""Sessions: what runs of a day share is learnt, corrects others of that day, and nothing else."""

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.dampers.joint import damper_of
from mrdamper.dampers.sessions import GainOffset, RecordingTime, RunScatter, Sessions, known_errors, sessions_known
from mrdamper.dampers.uncertainty import Uncertainty, uncertainty_warnings
from mrdamper.data import Condition, Run
from mrdamper.errors import InputError
from mrdamper.models.bingham import Bingham
from mrdamper.physics.motion import sine
from mrdamper.physics.simulation import simulate
from mrdamper.study.validation import validate
from mrdamper.study.workflow import _with_sessions

DAMPER = damper_of(Bingham(c=9000.0, fy=1.0))


def recorded(name, clock, gain=1.0, offset=0.0, amplitude=0.01, **notes):
    motion = sine(Condition(0.0, 1.0, amplitude), 2, 100)
    force = gain * simulate(DAMPER.one_model, motion).force + offset
    return Run(name, motion.time, motion.displacement, force, 0.0, notes={"recorded_at": clock, **notes})


def reading(gain, offset=0.0):
    return GainOffset(gain, offset, 0.0, 1e4, 0.04, 400.0)


def test_a_reading_is_least_squares_and_knows_every_other_error():
    run = recorded("a", "2024-05-01T10:00:00", gain=1.1, offset=7.0)
    predicted = simulate(DAMPER.one_model, sine(Condition(0.0, 1.0, 0.01), 2, 100)).force
    noisy = run.force + 5 * np.sin(np.arange(run.force.size))
    found = GainOffset.of(noisy, predicted)
    assert (found.gain, found.offset) == pytest.approx((1.1, 7.0), rel=0.02)
    for gain, offset in ((1.0, 0.0), (1.3, -20.0)):
        direct = np.sqrt(np.mean((gain * predicted + offset - noisy) ** 2)) / np.ptp(noisy)
        assert found.error(gain, offset) == pytest.approx(direct)


@pytest.mark.parametrize("unit", [1e-7, 1.0, 1e5])
def test_a_reading_does_not_depend_on_the_unit_and_a_constant_shows_no_gain(unit):
    predicted = unit * 100 * np.sin(np.linspace(0, 7, 90))
    found = GainOffset.of(1.2 * predicted + 3 * unit, predicted)
    assert (found.gain, found.offset) == pytest.approx((1.2, 3 * unit))
    still = GainOffset.of(unit * np.linspace(1, 3, 90), np.full(90, 0.1 * unit))
    assert (still.gain, still.offset) == (1.0, pytest.approx(1.9 * unit))


def test_a_record_predicted_in_parts_takes_no_part_in_the_scatter_between_sessions():
    runs, readings = days(3)
    whole = [SimpleNamespace(run_id=r.id, reading=reading) for r, reading in zip(runs, readings, strict=True)]
    parts = SimpleNamespace(run_id="parts", reading=None)
    chosen = SimpleNamespace(
        damper=replace(DAMPER, uncertainty=None),
        train=SimpleNamespace(runs=[*whole, SimpleNamespace(run_id="parts", reading=readings[0])]),
        cross_validated=SimpleNamespace(runs=[parts, *whole]),
    )
    dataset = {run.id: run for run in (*runs, replace(runs[0], id="parts"))}
    assert _with_sessions(chosen, dataset)[1] == pytest.approx(float(np.median(known(runs, readings))))


def test_check_runs_join_the_own_tests_and_replace_those_of_their_name():
    runs, readings = days(3)
    sessions = Sessions.of(runs, readings, readings)
    assert sessions.seen(DAMPER, [], own=True) == sessions
    assert sessions.seen(DAMPER, [], own=False).run_ids == ()
    again = replace(runs[4], force=1.3 * runs[4].force)
    joined = sessions.seen(DAMPER, [again], own=True)
    assert set(joined.run_ids) == set(sessions.run_ids)
    gains = dict(zip(joined.run_ids, joined.gains, strict=True))
    before = dict(zip(sessions.run_ids, sessions.gains, strict=True))
    assert gains == {**before, again.id: pytest.approx(1.3, rel=1e-2)}
    assert dict(zip(joined.run_ids, joined.when, strict=True)) == dict(
        zip(sessions.run_ids, sessions.when, strict=True)
    )
    assert sessions.seen(DAMPER, [again], own=False).run_ids == (again.id,)


def test_a_run_of_no_session_is_scored_as_it_is():
    runs, readings = days(4)
    alone, odd = replace(runs[0], id="alone", notes={}), reading(1.2, 30.0)
    assert known([*runs, alone], [*readings, odd])[-1] == odd.error(1.0, 0.0)


def test_sessions_share_what_they_share_without_a_clock():
    rng = np.random.default_rng(5)
    when = [RecordingTime(f"day {i // 3}") for i in range(60)]
    values = np.repeat(0.05 * rng.standard_normal(20), 3) + 0.01 * rng.standard_normal(60)
    found = RunScatter.likeliest(when, values)
    assert np.hypot(found.session, found.hour) == pytest.approx(0.05, rel=0.35)
    mean, left = found.given(RecordingTime("day 0"), when[:3], values[:3])
    assert mean == pytest.approx(np.mean(values[:3]), rel=0.15)
    assert left < 0.03


def test_gains_that_do_not_scatter_have_no_spread():
    when = [RecordingTime(f"day {i // 3}", 24.0 * (i // 3) + i) for i in range(12)]
    assert RunScatter.likeliest(when, np.zeros(12)).total == 0.0


@pytest.mark.slow
def test_the_three_spreads_are_found_from_many_days():
    rng = np.random.default_rng(0)
    truth = RunScatter(0.03, 0.02, 0.01, 2.0)
    when = [RecordingTime(f"day {day}", 24.0 * day + hour) for day in range(40) for hour in (0, 1, 2, 4, 7)]
    K = truth.covariance(when, when)
    np.fill_diagonal(K, truth.total**2)
    found = RunScatter.likeliest(when, np.linalg.cholesky(K) @ rng.standard_normal(len(when)))
    assert found.total == pytest.approx(truth.total, rel=0.15)
    assert found.session == pytest.approx(truth.session, rel=0.35)
    assert 0.004 < found.run < 0.02


@pytest.mark.parametrize(
    "shares", [(3.0, 0.3, 0.1), (0.3, 3.0, 0.1), (0.02, 0.02, 1.0), (1.0, 0.02, 1.0), (2.0, 2.0, 2.0)]
)
def test_no_other_shares_of_the_scatter_are_likelier(shares):
    """Among all on a grid, and beside those found by a twentieth either way."""
    when = [RecordingTime(f"day {day}", 24.0 * day + hour) for day in range(8) for hour in (0, 0.5, 3)]
    truth = RunScatter(*(0.01 * s for s in shares), 2.0)
    K = truth.covariance(when, when)
    np.fill_diagonal(K, truth.total**2)
    values = np.linalg.cholesky(K) @ np.random.default_rng(7).standard_normal(len(when))
    found = RunScatter.likeliest(when, values)

    clock = np.array([each.hour for each in when])
    day = np.equal.outer(clock // 24, clock // 24).astype(float)
    near = {
        hours: day * np.exp(-np.abs(np.subtract.outer(clock, clock)) / hours) for hours in (0.5, 1.0, 2.0, 4.0, 8.0)
    }

    def unlikely(session, hour, run, hours):
        K = session**2 * day + hour**2 * near[hours] + run**2 * np.eye(len(when))
        return np.linalg.slogdet(K)[1] + values @ np.linalg.solve(K, values)

    best = unlikely(found.session, found.hour, found.run, found.hours)
    steps = [(a, b, c) for a in (0.95, 1, 1.05) for b in (0.95, 1, 1.05) for c in (0.95, 1, 1.05)]
    assert best < 0.003 + min(
        unlikely(a * found.session, b * found.hour, c * found.run, found.hours) for a, b, c in steps
    )
    sizes = 0.01 * np.array([0.05, 0.3, 1.0, 3.0])
    grid = product(sizes, sizes, sizes, (0.5, 2.0, 8.0))
    assert best < 0.003 + min(unlikely(*point) for point in grid)


def test_what_is_given_is_the_conditional_normal():
    spread = RunScatter(0.03, 0.0, 0.02, 1.0)
    mean, left = spread.given(
        RecordingTime("a"), [RecordingTime("a"), RecordingTime("a"), RecordingTime("b")], np.array([0.05, 0.03, -0.5])
    )
    share = 0.03**2 / (0.03**2 + 0.02**2 / 2)  # two runs of the day, the other day tells nothing
    assert mean == pytest.approx(share * 0.04)
    assert left == pytest.approx(np.sqrt(0.03**2 * (1 - share) + 0.02**2))


def days(count=6):
    rng = np.random.default_rng(1)
    runs, readings = [], []
    for day in range(1, count + 1):
        shared = rng.normal(0, 0.04)
        for hour in (9, 11, 15):
            runs.append(recorded(f"{day}-{hour}", f"2024-05-{day:02}T{hour:02}:00:00"))
            readings.append(reading(1 + shared + rng.normal(0, 0.005)))
    return runs, readings


def known(runs, readings):
    return known_errors(Sessions.of(runs, readings, readings), runs, readings)


def test_other_runs_of_the_day_take_most_of_a_day_away():
    runs, readings = days()
    unknown = [each.error(1.0, 0.0) for each in readings]
    assert np.mean(known(runs, readings)) < 0.6 * np.mean(unknown)
    shuffled = [replace(r, notes={"session": f"{i % 6} {i // 6}"}) for i, r in enumerate(runs[:12])]
    with pytest.raises(InputError, match="every session holds one run") as caught:
        known(shuffled, readings[:12])
    assert caught.value.code == "E_SESSION"


def test_a_session_with_another_gain_is_named_and_sessions_that_scatter_are_not():
    def gains(*shared):
        rows = [(f"2024-05-0{day}", gain, k) for day, gain in enumerate(shared, 1) for k in range(3)]
        runs = [recorded(f"{day}-{k}", f"{day}T{9 + k:02}:00:00") for day, _, k in rows]
        readings = [reading(gain + 0.002 * (k - 1)) for _, gain, k in rows]
        return Sessions.of(runs, readings, readings)

    sessions = gains(1.003, 1.083, 0.997, 1.0)
    assert sessions.deviating() == {"2024-05-02": pytest.approx(1.083, abs=1e-6)}
    damper = replace(DAMPER, uncertainty=Uncertainty((), (), np.zeros((0, 0)), np.zeros(0), sessions=sessions))
    assert "of session 2024-05-02 are 8.3 % above those of the other sessions" in " ".join(uncertainty_warnings(damper))
    assert gains(0.95, 1.083, 1.03, 1.0).deviating() == {}
    assert gains(0.997, 1.035, 1.003, 1.0).deviating() == {}


def test_a_check_run_corrects_its_day_only_and_the_scores_say_so():
    runs, readings = days()
    sessions = Sessions.of(runs, readings, readings)
    damper = replace(DAMPER, uncertainty=Uncertainty((), (), np.zeros((0, 0)), np.zeros(0), sessions=sessions))
    hot = [recorded(f"hot {i}", f"2024-06-01T1{i}:00:00", gain=0.9, amplitude=0.01 + 0.002 * i) for i in range(3)]
    other = recorded("other", "2024-06-02T10:00:00", gain=0.9)
    plain = validate(damper, [*hot, other])
    scores = validate(damper, [*hot[1:], other], sessions=sessions_known(damper, hot[:1]))
    assert [run.session for run in plain.runs] == ["unknown"] * 4
    assert [run.session for run in scores.runs] == ["known", "known", "unknown"]
    assert all(run.scores.nrmse_pp < 0.2 * plain.median() for run in scores.runs[:2])
    assert scores.runs[2].scores == plain.runs[3].scores
    itself = validate(damper, hot[:1], sessions=sessions_known(damper, hot[:1]))
    assert itself.runs[0].session == "unknown"  # a run does not correct itself
    with pytest.raises(InputError, match="could not tell") as caught:
        sessions_known(DAMPER, hot[:1])
    assert caught.value.code == "E_SESSION"


@pytest.mark.parametrize(
    ("notes", "said"),
    [
        ([{"recorded_at": "yesterday"}], "recorded_at is 'yesterday'"),
        (
            [{"recorded_at": f"2024-05-01T1{hour}:00:00", "session": name} for hour, name in enumerate("ABA")],
            "goes on after session",
        ),
    ],
)
def test_a_clock_that_cannot_be_is_refused(notes, said):
    runs = [replace(recorded(str(i), "2024-05-01"), notes=note) for i, note in enumerate(notes)]
    with pytest.raises(InputError, match=said) as caught:
        known(runs, [reading(1.0)] * len(runs))
    assert caught.value.code == "E_CLOCK"
    assert f"run {len(runs) - 1}" in str(caught.value)  # the last: it comes back to a session that had ended
