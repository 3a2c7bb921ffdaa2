"""Doubts are sentences, whatever ended the search."""

from dataclasses import replace

import numpy as np
import pytest
from support.dampers import joint_damper

from mrdamper.dampers.joint import JointFit, Valley
from mrdamper.optimizers.ending import Ending
from mrdamper.report.distrust import doubts
from mrdamper.study.recipe import Scored, play_and_bypass
from mrdamper.validation import Validation

NONE = Validation("none", ())


def scored(fit):
    return Scored(play_and_bypass(), fit.damper, fit, (), float("nan"), NONE, NONE, NONE, 0.1)


@pytest.mark.parametrize(
    ("why", "said"),
    [
        (Ending.SETTLED, None),
        (Ending.AT_BOUNDS, None),  # the bounds have a sentence of their own
        (Ending.STEPS_SPENT, "one set of parameters stopped at the limit of steps, the cost still falling"),
    ],
)
def test_a_search_that_did_not_converge_is_said_so_in_a_sentence(why, said):
    fit = JointFit(joint_damper(), np.array([0.03, 0.04]), (), np.zeros(2), why, 9, 0.1)
    sentences = [s for s in doubts(scored(fit), ()) if "search" in s]
    assert len(sentences) == (said is not None)
    if said:
        assert said in sentences[0]
        assert sentences[0].startswith("The search ")


def test_a_second_end_of_the_search_is_told_with_its_error():
    fit = JointFit(joint_damper(), np.array([0.03, 0.04]), (), np.zeros(2), Ending.SETTLED, 9, 0.1)
    worse, better = (Valley(1.4e-3, e, 4e-4, 0.0266) for e in (0.0273, 0.026))
    said = "The search also ended at a knee of 1.40 mm instead of 0.40, with a mean error of"
    assert f"{said} 2.73 % instead of 2.66 %." in doubts(scored(replace(fit, second=worse)), ())
    told = f"{said} 2.60 % instead of 2.66 %; conditions left out decided."
    assert told in doubts(scored(replace(fit, second=better)), ())
    assert not any("also ended" in s for s in doubts(scored(fit), ()))


def test_a_run_described_far_worse_than_the_others_is_named_by_its_factor():
    fit = JointFit(joint_damper(), np.array([0.02, 0.02, 0.09]), ("d",), np.zeros(2), Ending.SETTLED, 9, 0.1)
    sentences = doubts(scored(fit), ())
    assert any("4.5 times the median" in s for s in sentences)
    assert any("known from one side only: d (half the play and seat" in s for s in sentences)
    calm = replace(fit, nrmse_pp=np.array([0.02, 0.02, 0.03]), at_bounds=())
    assert not any("times the median" in s or "limit" in s for s in doubts(scored(calm), ()))
