"""Fits without a fold: their starts never saw it, and every fold lies in a block."""

from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.dampers import fold_fits
from mrdamper.dampers.fold_fits import FoldFits
from mrdamper.dampers.joint import JointProblem
from mrdamper.data import level_groups

FOLDS = [[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11], [0, 3, 6, 9], [1, 4], [11]]
COUNT = 12
STARTS = ((0.3, 1.0), (0.2, 1.04), (0.1, 1.06))  # error of the end, and of the start on every run


def test_blocks_hold_every_fold_and_at_most_half_of_the_runs():
    blocks = fold_fits._blocks(FOLDS, COUNT)
    assert all(any(set(fold) <= block for block in blocks) for fold in FOLDS)
    assert all(len(block) <= COUNT / 2 for block in blocks)
    assert len(blocks) < len(FOLDS)
    whole = list(range(10))  # a fold may be larger by itself
    assert frozenset(whole) in fold_fits._blocks([whole, [1]], COUNT)


@pytest.mark.parametrize("fold", [*FOLDS, [0, 11]])
def test_no_start_saw_what_is_left_out_and_the_best_end_is_taken(fold, monkeypatch):
    searched, followed = [], []

    class Problem:
        parts = tuple(range(COUNT))

        def determined(self, rows):
            return self  # the kept runs determine every effect of the current

        def refit(self, start, rows, settled):
            followed.append(start.error)
            return SimpleNamespace(error=start.error, rows=rows)

    def search(self, block):
        searched.append(block)
        return [SimpleNamespace(error=error, nrmse_pp=np.full(COUNT, near)) for error, near in STARTS]

    monkeypatch.setattr(FoldFits, "_search", search)
    fits = FoldFits(Problem(), FOLDS)
    rows = [i for i in range(COUNT) if i not in fold]
    found = fits.refit(rows)
    assert (found.error, found.rows) == (0.2, rows)
    assert set(fold) <= searched[0]
    assert fits.refit(rows) is found
    assert len(searched) == 1
    assert followed == [0.3, 0.2]  # the third start describes the remaining runs worse by more than a twentieth


def test_a_search_frees_no_effect_of_the_current_that_its_runs_do_not_determine(bundled):
    runs = [run for run in bundled.rig("utfsm").split("train") if run.excitation == "sine"]
    levels = [*level_groups(JointProblem(runs, "tanh").currents).values()]
    few = [runs[i] for level in levels[:3] for i in level[:2]]
    problem = JointProblem(few, "tanh", free=("si",))
    assert [axis.name for axis in problem.space.axes] == ["vy", "shift", "si"]
    (start, *_) = FoldFits(problem, [[4, 5]])._search(frozenset([4, 5]))
    assert start.searched == ("vy", "shift")


def test_a_search_of_the_same_runs_and_parameters_is_made_once(bundled, monkeypatch):
    """Fits without an effect of the current search the blocks of those with it anew, and often the same."""
    runs = [run for run in bundled.rig("utfsm").split("train") if run.excitation == "sine"]
    levels = [*level_groups(JointProblem(runs, "tanh").currents).values()]
    problem = JointProblem([runs[i] for level in levels[:3] for i in level[:2]], "tanh", free=("si",))
    searched, fit = [], JointProblem.fit
    monkeypatch.setattr(JointProblem, "fit", lambda self, *given, **how: searched.append(self.free) or fit(self, **how))
    fits = FoldFits(problem, [[4, 5], [4]])
    assert fits.refit([0, 1, 2, 3]).searched == ("vy", "shift")  # two levels are left
    count = len(searched)
    assert fits.refit([0, 1, 2, 3, 5]).searched == ("vy", "shift", "si")  # begun from the same search
    assert len(searched) == count
