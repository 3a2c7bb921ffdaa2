"""Limitations are sentences in a fixed order, whatever the reason for which the search stopped."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.dampers import joint_damper, modified_damper

from mrdamper.dampers.joint import JointFit, LocalMinimum
from mrdamper.dampers.sessions import GainOffset
from mrdamper.dampers.uncertainty import Uncertainty
from mrdamper.data import Condition
from mrdamper.report.limitations import RANGE, _explain, limitations
from mrdamper.statistics.metrics import Scores
from mrdamper.statistics.stop_reason import StopReason
from mrdamper.study.recipe import RecipeResult, whole_damper
from mrdamper.study.validation import RunScore, Validation

NONE = Validation("none", ())


def texts_of(groups):
    return [text for texts in groups.values() for text in texts]


def texts(fit):
    return texts_of(limitations(scored(fit), ()))


def scored(fit):
    return RecipeResult(whole_damper("play-bypass"), fit.damper, fit, (), float("nan"), NONE, NONE, NONE, 0.1)


@pytest.mark.parametrize(
    ("why", "said"),
    [
        (StopReason.SETTLED, None),
        (StopReason.AT_BOUNDS, None),  # parameters at bounds have a sentence of their own
        (
            StopReason.STEPS_SPENT,
            "The global fit did not converge: the search stopped at the limit of steps, the cost still falling.",
        ),
    ],
)
def test_a_search_that_did_not_converge_is_said_so_in_a_sentence(why, said):
    fit = JointFit(joint_damper(), np.array([0.03, 0.04]), (), np.zeros(2), why, 0.1)
    sentences = [s for s in texts(fit) if "did not converge" in s]
    assert len(sentences) == (said is not None)
    if said:
        assert sentences[0] == said


def test_runs_of_fewer_than_two_whole_cycles_are_named():
    motion = SimpleNamespace(cycles=0.99, is_sine=True, drift=0.0)
    condition = Condition(0.5, 1.5, 0.015)
    fit = JointFit(joint_damper(), np.array([0.03, 0.04]), (), np.zeros(2), StopReason.SETTLED, 0.1)
    loops = [SimpleNamespace(run_id=name, condition=condition, motion=motion) for name in ("short", "shorter")]
    assert any(
        s.startswith("Fewer than two whole cycles in 2 runs: short") for s in texts_of(limitations(scored(fit), loops))
    )
    longer = [
        SimpleNamespace(**{**vars(loop), "motion": SimpleNamespace(**{**vars(motion), "cycles": 2.0})})
        for loop in loops
    ]
    assert not any("whole cycles" in s for s in texts_of(limitations(scored(fit), longer)))


def test_a_second_end_of_the_search_is_told_with_its_error():
    fit = JointFit(joint_damper(), np.array([0.03, 0.04]), (), np.zeros(2), StopReason.SETTLED, 0.1)
    worse, better = (LocalMinimum(1.4e-3, e, 4e-4, 0.0266) for e in (0.0273, 0.026))
    start = "Second local minimum of the fit: yield displacement 1.40 mm instead of 0.40 mm, mean error"
    assert f"{start} 2.73 % instead of 2.66 %." in texts(replace(fit, second=worse))
    chosen = f"{start} 2.60 % instead of 2.66 %; chosen by cross-validation."
    assert chosen in texts(replace(fit, second=better))
    assert not any("local minimum" in s for s in texts(fit))


def test_a_run_described_far_worse_than_the_others_is_named_by_its_factor():
    fit = JointFit(joint_damper(), np.array([0.02, 0.02, 0.09]), ("d",), np.zeros(2), StopReason.SETTLED, 0.1)
    sentences = texts(fit)
    assert any("4.5 times the median" in s for s in sentences)
    assert any("(interval one-sided): d (" in s for s in sentences)
    known = Uncertainty((), (), np.zeros((0, 0)), np.zeros(0), gain=0.0, offset=0.0, one_sided=("d",))
    stated = replace(fit.damper, uncertainty=known)
    known = texts_of(limitations(replace(scored(fit), damper=stated), ()))
    assert [s.startswith("d (") for s in known if "one-sided" in s] == [True]  # once
    calm = replace(fit, nrmse_pp=np.array([0.02, 0.02, 0.03]), at_bounds=())
    assert not any("times the median" in s or "bound" in s for s in texts(calm))


def test_the_meaning_of_a_parameter_is_no_part_of_a_formula():
    damper = modified_damper()
    texts = [["mass not identified: it is part of k1 (a = −ω² x); k1 holds k1 − m ω²", "f0 ended", "m.0 (2 kg)"]]
    _explain(texts, damper)
    assert texts == [
        [
            "mass not identified: it is part of k1 (stiffness; a = −ω² x); k1 holds k1 − m ω²",
            "f0 (offset force) ended",
            "m.0 (equivalent mass; 2 kg)",
        ]
    ]


def test_limitations_are_grouped_and_the_tested_range_stands_last():
    fit = JointFit(joint_damper(), np.array([0.02, 0.02, 0.09]), (), np.zeros(2), StopReason.SETTLED, 0.1)
    found = limitations(scored(fit), ())
    assert list(found)[-1] == RANGE
    assert all(found.values())
    assert texts_of(found)[0].startswith("No validation runs")


def test_the_worst_run_tells_its_kind_of_motion_apart_from_its_range():
    def run(error, flags=()):
        return RunScore("chirp", "rig", Condition(0.0, 5.3, 0.0017), Scores(error, *5 * (0.0,)), None, flags)

    runs = Validation("worst", (run(0.02), run(0.02), run(0.11, ("amplitude", "not a sine"))))
    fit = JointFit(joint_damper(), np.array([0.03, 0.04]), (), np.zeros(2), StopReason.SETTLED, 0.1)
    text = next(s for s in texts_of(limitations(replace(scored(fit), validation=runs), ())) if "Largest error" in s)
    assert "5.3 Hz, 1.7 mm, not a sine; amplitude outside the tested range)" in text
    crossed = replace(scored(fit), cross_validated=Validation("worst", (*runs.runs[:2], run(0.11, ("combination",)))))
    text = next(s for s in texts_of(limitations(crossed, ())) if "Largest error of a cross" in s)
    assert "5.3 Hz, 1.7 mm; combination outside the range of the other tests)" in text  # it is a test itself


@pytest.mark.parametrize(("error", "flags"), [(0.11, ()), (0.11, ("amplitude",)), (0.05, ())])
def test_a_run_that_is_predicted_several_times_worse_than_its_peers_is_a_finding(error, flags):
    def run(name, error, flags=()):
        return RunScore(name, "rig", Condition(0.5, 2, 0.01), Scores(error, *5 * (0.0,)), None, flags)

    runs = Validation("cross", (*(run(f"t{k}", 0.02) for k in range(5)), run("odd", error, flags)))
    fit = JointFit(joint_damper(), np.array([0.03, 0.04]), (), np.zeros(2), StopReason.SETTLED, 0.1)
    texts = texts_of(limitations(replace(scored(fit), cross_validated=runs), ()))
    found = [s for s in texts if "over 3 times the median of 2.0 %" in s and "11.0 % in odd (0.5 A, 2 Hz, 10 mm)" in s]
    assert bool(found) == (error > 0.06 and not flags)


@pytest.mark.parametrize(
    ("conditions", "said"),
    [
        ([(0.5, 1, 0.01), (0.5, 2, 0.01), (0.5, 2, 0.02), (0.5, 1, 0.02)], "One current was tested (0.5 A)"),
        ([(0.0, 1, 0.01), (0.5, 1, 0.01), (1.0, 1, 0.01), (1.5, 1, 0.01)], "One motion was tested (1 Hz, 10 mm)"),
        ([(0.0, 1, 0.01), (0.5, 2, 0.01), (1.0, 1, 0.02)], "Only 3 identification runs"),
        ([(0.0, 1, 0.01), (0.5, 1, 0.01), (0.5, 2, 0.01), (0.0, 2, 0.01)], None),
    ],
)
def test_what_the_design_of_the_tests_cannot_show_is_stated_first(conditions, said):
    fit = JointFit(joint_damper(), np.array([0.03, 0.04]), (), np.zeros(2), StopReason.SETTLED, 0.1)
    tests = {f"t{k}": Condition(*condition) for k, condition in enumerate(conditions)}
    runs = tuple(RunScore(name, "rig", at, Scores(0.02, *5 * (0.0,)), None, ()) for name, at in tests.items())
    motion = SimpleNamespace(is_sine=True, drift=0.0, cycles=5.0)
    loops = [
        SimpleNamespace(run_id=name, condition=at, motion=motion, dissipated_energy=1.0) for name, at in tests.items()
    ]
    entries = texts_of(limitations(replace(scored(fit), train=Validation("train", runs)), loops))
    design = ("One current", "One motion", "Only")
    assert [text.startswith(said) for text in entries if text.startswith(design)] == ([True] if said else [])
    assert said is None or entries[0].startswith(said)
    others = texts_of(limitations(replace(scored(fit), train=Validation("train", runs)), loops[1:]))
    assert not any(text.startswith(design[:2]) for text in others)  # a record of other motion varies the rest


def test_tests_at_different_temperatures_are_a_limitation():
    fit = JointFit(joint_damper(), np.array([0.03, 0.04]), (), np.zeros(2), StopReason.SETTLED, 0.1)
    ids = ("a", "b", "c")
    scores = Scores(0.02, *5 * (0.0,))
    runs = tuple(RunScore(name, "rig", Condition(0.5, 1.0, 0.01), scores, None, ()) for name in ids)
    train = replace(scored(fit), train=Validation("train", runs))

    def sentences(*temperatures):
        tests = [SimpleNamespace(id=n, notes={"temperature_C": t}) for n, t in zip(ids, temperatures, strict=True)]
        return [text for text in texts_of(limitations(train, (), tests)) if "°C" in text]

    assert sentences("23.5", "", "41.02") == [
        "Tests at 24 to 41 °C: the temperature is no input of the model, and its effect counts as scatter between runs."
    ]
    assert sentences("23.5", "25", "26") == []
    assert sentences("", "cold", "n/a") == []


def test_sessions_whose_forces_differ_by_more_than_their_runs_are_a_limitation():
    fit = JointFit(joint_damper(), np.array([0.03, 0.04]), (), np.zeros(2), StopReason.SETTLED, 0.1)
    condition, scores = Condition(0.5, 1.0, 0.01), Scores(0.02, *5 * (0.0,))

    def sentences(*sessions, clock=""):
        """Each session by the gains and offsets [N] of its runs."""
        read = [(f"day{day}", *one) for day, own in enumerate(sessions, 1) for one in own]
        runs, tests = [], []
        for n, (day, gain, offset) in enumerate(read):
            reading = GainOffset(gain, offset, 0.0, 1.0, 0.0, 2000.0)
            runs.append(RunScore(f"t{n}", "rig", condition, scores, None, (), reading=reading))
            tests.append(SimpleNamespace(id=f"t{n}", notes={"recorded_at": clock} if clock else {"session": day}))
        train = replace(scored(fit), train=Validation("train", tuple(runs)))
        return [text for text in texts_of(limitations(train, (), tests)) if text.startswith("Sessions")]

    alike = [(1.00, 4.0), (1.01, -3.0), (0.99, 2.0), (1.0, 0.0)]
    gains, offsets = [(of + 0.1, n) for of, n in alike], [(of, n + 150.0) for of, n in alike]
    assert sentences(alike, alike, alike) == sentences(alike) == sentences(alike[:1], gains[:1]) == []
    assert sentences(alike, gains, clock="noon") == []
    (gain,) = sentences(alike, gains, alike)
    assert gain.startswith("Sessions differ in the gain of measured over predicted force: 1 in day1, 1.1 in day2, 1 in")
    (offset,) = sentences(alike, offsets)
    assert "0.75 N in day1, 151 N in day2;" in offset
    (extremes,) = sentences(alike, alike, gains, alike, [(of - 0.1, n) for of, n in alike])
    assert "0.9 in day5 to 1.1 in day3;" in extremes
    scattered = [(0.9, 0.0), (1.1, 0.0), (1.0, 0.0)]
    assert sentences(scattered, [(of + 0.05, n) for of, n in scattered]) == []


@pytest.mark.parametrize(
    ("energies", "falling"),
    [
        ({0.0: 1.0, 0.5: 6.0, 1.0: 3.0, 1.5: 8.0}, "from 0.5 A to 1 A at all 2 motions tested at both, to 50 %"),
        ({0.0: 1.0, 0.5: 6.0, 1.0: 5.7, 1.5: 8.0}, ""),  # saturated
        ({0.0: 3.0, 0.5: 1.0}, "from 0 A to 0.5 A"),
        ({0.0: 3.0, 0.5: 2.0, 1.0: 1.0}, ""),  # a coil that weakens a magnet
        ({-0.5: 3.0, 0.0: 1.0, 0.5: 3.0}, ""),
    ],
)
def test_a_force_that_falls_between_two_currents_is_a_limitation(energies, falling):
    fit = JointFit(joint_damper(), np.array([0.03, 0.04]), (), np.zeros(2), StopReason.SETTLED, 0.1)
    motion = SimpleNamespace(is_sine=True, drift=0.0, cycles=5.0)
    tests = [(Condition(i, f, 0.01), e * f) for i, e in energies.items() for f in (1.0, 2.0)]
    loops = [
        SimpleNamespace(run_id=f"t{n}", condition=condition, motion=motion, dissipated_energy=energy)
        for n, (condition, energy) in enumerate(tests)
    ]
    scores = Scores(0.02, *5 * (0.0,))
    runs = tuple(RunScore(loop.run_id, "rig", loop.condition, scores, None, ()) for loop in loops)
    entries = texts_of(limitations(replace(scored(fit), train=Validation("train", runs)), loops))
    sentences = [text for text in entries if text.startswith("The dissipated energy falls")]
    assert [falling in text for text in sentences] == [True] * bool(falling)
