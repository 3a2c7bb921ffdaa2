"""Folds by kind: what is omitted together, that something is left, and that no kind is made of too few tests."""

from dataclasses import replace

import numpy as np
import pytest

from mrdamper.data import Condition, Run
from mrdamper.errors import IdentificationError
from mrdamper.physics.motion import sine
from mrdamper.study.cross_validation import all_folds, condition_folds, cross_validate_by_kind, folds_by_kind

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
