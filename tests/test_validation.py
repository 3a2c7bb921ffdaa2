"""Scores on what was not seen: an oracle that remembers shows any leak, and scores are those worked out by hand."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.dampers import joint_damper
from support.synthetic import synthetic_run

from mrdamper.data import Condition, Run, same_condition
from mrdamper.errors import InputError
from mrdamper.physics.motion import analyse_motion, sine
from mrdamper.statistics.metrics import dissipated_power
from mrdamper.study import validation
from mrdamper.study.validation import (
    RunScore,
    Validation,
    leave_out,
    peak_band,
    score_run,
    validate,
)


@dataclass(frozen=True)
class Said:
    """What a damper says of a run."""

    force: np.ndarray
    motion: object
    condition: Condition
    extrapolation: tuple = ()

    def corrected(self, gain, offset):
        return replace(self, force=gain * self.force + offset)


class Memory:
    """Knows the force of every run it was made of, and of every run at their conditions; says zero of all others."""

    envelope = None
    title = "memory"

    def __init__(self, runs):
        self.known = {(run.nominal.current_A, run.nominal.frequency_Hz) for run in runs}

    def predict(self, run):
        motion = sine(run.nominal, 3, 100)
        knows = (run.nominal.current_A, run.nominal.frequency_Hz) in self.known
        return Said(run.force if knows else np.zeros(run.time.size), motion, run.nominal)


def made(current, frequency, name, gain=1.0, offset=0.0):
    condition = Condition(current, frequency, 0.01)
    motion = sine(condition, 3, 100)
    force = offset + gain * (100 + 50 * current) * motion.velocity
    window = (float(motion.time[100]), float(motion.time[-1]))
    return Run(name, motion.time, motion.displacement, force, current, nominal=condition, window=window)


# Every condition twice, one of them three times: a fold that keeps any twin knows the answer.
RUNS = [made(I, f, f"{I}A-{f}Hz-{k}") for I in (0.0, 1.0) for f in (1.0, 2.0) for k in range(2)] + [made(0, 1, "third")]


def test_no_fold_knows_the_condition_it_is_scored_on():
    asked = []

    def fit(rows):
        asked.append(tuple(rows))
        return Memory([RUNS[i] for i in rows])

    found = leave_out(RUNS, same_condition([run.nominal for run in RUNS]), fit, "memory")
    assert [score.run_id for score in found.runs] == [run.id for run in RUNS]
    for score in found.runs:
        # Zero was predicted: every absolute error is the force itself. A leak makes it none.
        assert score.scores.wape == pytest.approx(1.0)
    # Four conditions, four folds; each run is left out once and kept in all the others.
    assert len(asked) == 4
    left = [i for rows in asked for i in set(range(len(RUNS))) - set(rows)]
    assert sorted(left) == list(range(len(RUNS)))
    assert min(map(len, asked)) == len(RUNS) - 3
    knowing = validate(Memory(RUNS), RUNS)
    assert all(score.scores.wape == 0.0 for score in knowing.runs)


def test_runs_at_one_condition_leave_nothing_to_score():
    alone = [run for run in RUNS if run.nominal == RUNS[0].nominal]
    found = leave_out(alone, same_condition([run.nominal for run in alone]), Memory, "memory")
    assert found.runs == ()
    assert np.isnan(found.median())


class Exact:
    envelope = None
    title = "exact"

    def predict(self, run):
        motion = sine(run.nominal, 3, 100)
        return Said((100 + 50 * run.nominal.current_A) * motion.velocity, motion, run.nominal, ("current",))


def test_scores_are_taken_inside_the_window_only():
    run = made(1.0, 1.0, "one")
    spoiled = run.force.copy()
    spoiled[:100] += 1e4  # before the window
    score = score_run(Exact(), replace(run, force=spoiled))
    assert score.scores.nrmse_pp == pytest.approx(0.0, abs=1e-12)
    assert score.extrapolation == ("current",)
    spoiled = run.force.copy()
    spoiled[100:] += 3.0
    score = score_run(Exact(), replace(run, force=spoiled))
    assert score.scores.nrmse_pp == pytest.approx(3.0 / np.ptp(run.force[100:]))
    assert score.scores.peak_error == pytest.approx(0.0, abs=1e-12)


def test_standing_still_has_an_error_of_its_own_and_the_best_gain_and_offset_are_of_the_window():
    run = made(1.0, 1.0, "one", gain=1.25, offset=4.0)
    still = run.time > 2.5
    wrong = run.force + np.where(still, np.where(np.arange(still.size) % 2, 30.0, 40.0), 0.0)

    class Resting(Exact):
        def predict(self, run):
            said = super().predict(run)
            velocity = np.where(still, 0.0, said.motion.velocity)
            return replace(said, motion=SimpleNamespace(velocity=velocity, current=still, resting=still))

    score = score_run(Resting(), replace(run, force=wrong))
    miss = wrong - 0.8 * (run.force - 4.0)
    assert score.rest == pytest.approx(np.sqrt(np.mean(miss[still] ** 2)) / np.ptp(wrong))
    assert score_run(Exact(), run).rest is None
    reading = score_run(Exact(), run).reading
    assert (reading.gain, reading.offset) == pytest.approx((1.25, 4.0))


def test_a_force_too_large_has_positive_errors():
    score = score_run(Exact(), made(1.0, 1.0, "one", gain=0.8))
    assert score.scores.peak_error == pytest.approx(0.25)
    assert score.scores.energy_error == pytest.approx(0.25)


def test_noise_of_the_measured_force_is_no_error_of_the_peak():
    run, rng = made(1.0, 1.0, "one"), np.random.default_rng(3)
    noises = rng.normal(0.0, 0.01 * np.ptp(run.force), (10, run.force.size))
    errors = [score_run(Exact(), replace(run, force=run.force + noise)).scores.peak_error for noise in noises]
    assert np.mean(errors) == pytest.approx(0.0, abs=0.01)  # -0.04 of the raw samples


def test_median_and_worst_count_magnitudes_and_refused_runs_stay_apart():
    runs = [made(1.0, 1.0, f"{gain}", gain=gain) for gain in (0.5, 0.9, 1.25)]
    still = replace(runs[0], id="still", force=np.ones(runs[0].time.size))
    found = validate(Exact(), [*runs, still])
    assert [run.run_id for run in found.runs] == ["0.5", "0.9", "1.25"]
    assert "does not change" in found.refused["still"]
    errors = [1.0, 1 / 0.9 - 1, -0.2]
    assert [run.scores.energy_error for run in found.runs] == pytest.approx(errors)
    assert found.median("energy_error") == pytest.approx(0.2)
    assert found.worst("energy_error").run_id == "0.5"
    assert found.worst_error("energy_error") == pytest.approx(1.0)
    assert replace(found, runs=found.runs[2:]).worst_error("energy_error") == pytest.approx(0.2)
    assert np.isnan(Validation("none", ()).worst_error())
    assert replace(found, runs=found.runs[1:]).worst("energy_error").run_id == "1.25"  # −0.2 beside +0.11
    assert found.only({"1.25"}).runs[0].run_id == "1.25"
    assert Validation("none", ()).only({"x"}).runs == ()
    assert isinstance(found.runs[0], RunScore)


def test_the_readings_of_runs_are_the_gains_and_offsets_put_in():
    gains, offsets = np.array([0.9, 1.0, 1.2]), np.array([-10.0, 0.0, 20.0])
    runs = [made(1.0, 1.0, f"{g}", gain=g, offset=o) for g, o in zip(gains, offsets, strict=True)]
    readings = [score.reading for score in validate(Exact(), runs).runs]
    assert [reading.gain for reading in readings] == pytest.approx(gains.tolist())
    assert [reading.offset for reading in readings] == pytest.approx(offsets.tolist())
    assert [reading.error(reading.gain, reading.offset) for reading in readings] == pytest.approx([0.0] * 3, abs=1e-9)


def test_the_floor_is_the_error_left_by_a_gain_and_an_offset():
    run = made(1.0, 1.0, "one", gain=1.1, offset=5.0)
    inside = run.in_window
    wave = 2.0 * np.sin(2 * np.pi * 5 * run.time)  # five times the frequency: no gain and no offset takes it up
    reading = validate(Exact(), [replace(run, force=run.force + wave)]).runs[0].reading
    spread = np.ptp((run.force + wave)[inside])
    assert reading.error(reading.gain, reading.offset) == pytest.approx(np.sqrt(2.0) / spread, rel=0.02)


def test_a_validation_is_called_after_its_damper_unless_named():
    assert validate(Exact(), []).title == "exact"
    assert validate(Exact(), [], "other").title == "other"


def test_a_table_holds_every_score_under_its_own_name():
    runs = [replace(made(1.0, 1.0, f"{gain}", gain=gain), rig="bench 2") for gain in (0.5, 0.8)]
    found = validate(Exact(), [*runs, replace(runs[0], id="still", force=np.ones(runs[0].time.size))])
    assert [run.rig for run in found.runs] == ["bench 2"] * 2
    assert found.headline.startswith("exact: 2 runs, 1 refused, median nrmse_pp ")
    assert "refused" not in validate(Exact(), runs).headline
    scores = [run.scores for run in found.runs]
    assert found.table == {
        "run_id": ["0.5", "0.8"],
        "nrmse_pp": [s.nrmse_pp for s in scores],
        "nrmse_std": [s.nrmse_std for s in scores],
        "wape": [s.wape for s in scores],
        "energy_error": [s.energy_error for s in scores],
        "peak_error": [s.peak_error for s in scores],
        "session": ["unknown", "unknown"],
        "extrapolation": ["current", "current"],
    }
    # A dashpot's force spans √8 standard deviations; every number by hand, none a per cent.
    assert found.table["nrmse_pp"] == pytest.approx([1 / np.sqrt(8), 0.25 / np.sqrt(8)], rel=5e-3)
    assert found.table["nrmse_std"] == pytest.approx([1.0, 0.25], rel=5e-3)


def test_the_band_of_the_peak_is_told_beside_the_measured_peak_of_the_window(monkeypatch):
    run = made(1.0, 2.0, "one", gain=0.9)
    spoiled = run.force.copy()
    spoiled[50] = 1e4  # before the window
    run, asked = replace(run, force=spoiled), {}

    def said(damper, prediction, level, shown):
        asked.update(level=level, shown=shown, title=damper.title, predicted=prediction.condition)
        return SimpleNamespace(peak=(8.0, 13.0), energy=(-0.1, 0.2)) if level > 0.5 else None

    monkeypatch.setattr(validation, "band", said)
    half = np.ptp(run.force[100:]) / 2
    seen = Exact().predict(run)
    inside, of_a_cycle = run.in_window, 1 / seen.condition.frequency_Hz
    energy, expected = (
        of_a_cycle * dissipated_power(force[inside], seen.motion.velocity[inside], run.time[inside])
        for force in (run.force, seen.force)
    )
    measured = {"peak_force_measured_N": half, "energy_measured_J": energy}
    band = {"peak_force_low_N": 8.0, "peak_force_high_N": 13.0}
    band |= {"energy_low_J": 0.9 * expected, "energy_high_J": 1.2 * expected}
    assert peak_band(Exact(), run) == pytest.approx({**measured, **band})
    assert (asked["level"], asked["title"], asked["predicted"]) == (0.9, "exact", run.nominal)
    assert np.array_equal(asked["shown"], run.in_window)
    assert peak_band(Exact(), run, 0.3) == pytest.approx(measured)
    monkeypatch.setattr(validation, "session_band", lambda expected, *given: said(*given))
    known = peak_band(Exact(), run, expected=SimpleNamespace(gain=2.0, offset=0.0))
    assert known == pytest.approx({**measured, **band, "energy_low_J": 1.8 * expected, "energy_high_J": 2.4 * expected})


def test_what_no_rig_measures_has_no_score():
    run = synthetic_run(Condition(0.5, 1.0, 0.01))
    damper = joint_damper("bouc-wen")
    for force in (1e-300 * run.force, 1e297 * run.force):
        refused = validate(damper, [replace(run, force=force)]).refused
        assert "the force changes by" in refused[run.id]
    three = run.part(0, 3)
    with pytest.raises(InputError):
        analyse_motion(three)
    with pytest.raises(InputError, match="give amperes"):
        Condition(1e300, 1.0, 0.01)
