"""Folds by kind: what is omitted together, that something is left, and that no kind is made of too few tests."""

from dataclasses import replace

import numpy as np
import pytest

from mrdamper.data import Condition, Dataset, Run
from mrdamper.errors import IdentificationError
from mrdamper.physics.motion import random_motion, sine
from mrdamper.study.cross_validation import (
    all_folds,
    condition_folds,
    cross_validate_by_kind,
    folds_by_kind,
    stretches,
)
from mrdamper.study.split import hold_out

MOTIONS = ((0.5, 0.02), (1.0, 0.02), (2.0, 0.008))


def run(current, frequency, amplitude, session):
    motion = sine(Condition(current, frequency, amplitude), 3, 60)
    notes = {"session": session} if session else {}
    force = 100 * motion.velocity
    return Run(f"{current} {frequency} {amplitude}", motion.time, motion.displacement, force, current, notes=notes)


def rig_tests(currents, motions=MOTIONS, sessions=("a", "b", "c", "d")):
    asked = [(I, *motion) for I in currents for motion in motions]
    return [run(*each, sessions[k % len(sessions)]) for k, each in enumerate(asked)]


def test_every_kind_omits_what_it_says():
    runs = rig_tests((0.0, 0.4, 1.0))
    kinds = folds_by_kind(runs)
    assert set(kinds) == {"current", "no current", "fastest motions", "session"}
    assert kinds["current"] == [[3, 4, 5], [6, 7, 8]]
    assert kinds["no current"] == [[0, 1, 2]]
    assert [sorted(fold) for fold in kinds["fastest motions"]] == [[1, 4, 7]]  # 1 Hz, 20 mm; two motions are left
    assert kinds["session"] == [[0, 4, 8], [1, 5], [2, 6], [3, 7]]
    assert condition_folds(runs) == [[i] for i in range(9)]
    assert len(all_folds(runs)) == 9 + 2 + 1 + 1 + 4


def test_only_a_lowest_current_below_which_others_can_be_asked_for_ranks_models():
    kinds = folds_by_kind(rig_tests((0.2, 0.6, 1.0)))
    assert kinds["current"] == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]
    assert "no current" not in kinds
    kinds = folds_by_kind(rig_tests((-0.0004, 0.6, 1.0)))
    assert kinds["current"] == [[3, 4, 5], [6, 7, 8]]
    assert kinds["no current"] == [[0, 1, 2]]


def test_a_current_either_way_is_one_level():
    kinds = folds_by_kind(rig_tests((-0.4, 0.0, 0.4, 1.0)))
    assert kinds["current"] == [[0, 1, 2, 6, 7, 8], [9, 10, 11]]


@pytest.mark.parametrize(
    ("runs", "absent"),
    [
        (rig_tests((0.0, 1.0)), {"current", "no current"}),
        (rig_tests((0.0, 0.4, 1.0), MOTIONS[:2]), {"fastest motions"}),
        (rig_tests((0.0, 0.4, 1.0), sessions=("a", "b")), {"session"}),
        (rig_tests((0.0, 0.4, 1.0), sessions=("a", "b", "")), {"session"}),
    ],
)
def test_a_kind_that_would_leave_too_little_is_absent(runs, absent):
    assert not absent & set(folds_by_kind(runs))


def test_a_record_that_is_no_sine_is_no_condition_of_a_split():
    motion = random_motion(np.random.default_rng(1), 20.0, 0.004, (0.5, 3.0))
    rough = Run("rough", motion.time, motion.displacement, 100 * motion.velocity, 0.4)
    split = hold_out(Dataset((*rig_tests((0.0, 0.4, 1.0)), rough)))
    assert split.shown["rough"] == "no sine"
    assert split.held_out
    assert "rough" not in split.held_out


def test_a_split_takes_clipped_runs_by_name_only_and_names_them():
    tests = rig_tests((0.0, 0.4, 1.0))
    dataset = Dataset(
        tuple(replace(run, notes={"findings": "W_CLIPPED"} if i < 3 else {}) for i, run in enumerate(tests))
    )
    clipped = [run.id for run in tests[:3]]
    for chosen in (hold_out(dataset), hold_out(dataset, every=2)):
        assert chosen.held_out
        assert not chosen.held_out & {*clipped}
    split = hold_out(dataset, runs=clipped[:1])
    assert split.held_out == {clipped[0]}
    assert split.reason == f"by hand; clipped, so that a study omits them: {clipped[0]}"


def test_records_with_a_current_that_changes_are_omitted_together():
    runs = rig_tests((0.0, 0.4, 1.0))
    switched = replace(runs[0], id="switched", current=np.linspace(0.0, 1.0, runs[0].time.size))
    assert folds_by_kind([*runs, switched])["other records"] == [[9]]


def test_a_fold_without_which_there_is_no_damper_is_refused_by_its_runs():
    def refit(rows):
        raise IdentificationError("nothing to fit", remedy="test more")

    found = cross_validate_by_kind(rig_tests((0.0, 0.4, 1.0)), refit, "none")
    assert all(not each.runs for each in found.values())
    assert len(found["current"].refused) == 6


def test_a_motion_within_a_fifth_of_the_fastest_goes_with_it():
    """Peak velocities of 1, 0.85, 0.7 and 0.5 times 2 pi 20 mm/s: two are among the fastest."""
    runs = rig_tests((0.0, 0.4, 1.0), ((1.0, 0.02), (0.85, 0.02), (0.7, 0.02), (0.5, 0.02)))
    (fastest,) = folds_by_kind(runs)["fastest motions"]
    assert sorted(fastest) == [0, 1, 4, 5, 8, 9]
    (fastest,) = folds_by_kind(rig_tests((0.0, 0.4), ((1.0, 0.02), (0.93, 0.02), (0.86, 0.02))))["fastest motions"]
    assert sorted(fastest) == [0, 3]  # two motions are left
    (fastest,) = folds_by_kind(rig_tests((0.0, 0.4), ((2.0, 0.02), (1.0, 0.02), (0.5, 0.02), (0.2, 0.02))))[
        "fastest motions"
    ]
    assert sorted(fastest) == [0, 4]


def test_a_fold_is_predicted_by_a_damper_of_all_other_runs():
    runs, made = rig_tests((0.0, 0.4, 1.0)), []

    def refit(rows):
        made.append(list(rows))
        raise IdentificationError("only asked", remedy="none")

    cross_validate_by_kind(runs, refit, "none")
    folds = [fold for groups in folds_by_kind(runs).values() for fold in groups]
    assert made == [[i for i in range(9) if i not in fold] for fold in folds]


@pytest.mark.parametrize("window", [None, (5.0, 95.0)])
def test_stretches_of_a_record_adjoin_and_begin_some_cycles_before_they_count(window):
    time = np.arange(0, 100, 0.01)
    waves = np.sin(2 * np.pi * np.linspace(0.7, 1.3, 9)[:, None] * time + np.arange(9.0)[:, None] ** 2)
    x = 0.01 * waves.mean(axis=0)
    parts = stretches(Run("random", time, x, 500 * x, 0.5, excitation="random", window=window))
    assert 2 <= len(parts) <= 8
    begin, end = window or (time[0], time[-1])
    edges = np.array([part.window for part in parts])
    assert edges[0, 0] == pytest.approx(begin)
    assert edges[-1, 1] == pytest.approx(end, abs=0.011)  # a sample
    np.testing.assert_allclose(edges[1:, 0] - edges[:-1, 1], 0.01, atol=1e-9)  # the next sample
    np.testing.assert_allclose(np.diff(edges, axis=1), (end - begin) / len(parts), atol=0.02)
    for part in parts:
        assert part.time[0] <= max(part.window[0] - 1.0, time[0])
    assert {part.notes["stretch of"] for part in parts} == {"random"}
