"""Which terms the tests show: what is left out is predicted by the rest alone, term by term, by refits written out."""

from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.dampers import choice
from mrdamper.dampers.choice import Evidence, Term, levels_of
from mrdamper.data import Condition

RNG = np.random.default_rng(2)
N, NAMES = 120, ("d", "h1", "c1", "f0")
JACOBIAN = RNG.standard_normal((N, 4)) * [1.0, 2.0, 0.5, 3.0]
VALUES = np.array([0.4, 0.3, 2.0, 1.0])
NEUTRAL = np.array([0.4, 0.0, 0.0, 1.0])
GROUPS = [np.arange(k, N, 4) for k in range(4)]
RESIDUAL = RNG.standard_normal(N) + np.repeat([0.0, 1.0], N // 2)


def rms(weighted, group):
    return float(np.sqrt(np.mean(weighted[group] ** 2)))


def evidence(residual=RESIDUAL, groups=None, names=NAMES):
    return Evidence(names, VALUES, NEUTRAL, residual, JACOBIAN, groups or {"condition": GROUPS}, rms)


def left_out(active, residual=RESIDUAL, groups=GROUPS):
    """Every group predicted by least squares on the other rows alone; parameters that are off at their neutral."""
    on = [i for i, name in enumerate(NAMES) if name in active]
    off = [i for i in range(4) if i not in on]
    base = residual + JACOBIAN[:, off] @ (NEUTRAL - VALUES)[off]
    errors = []
    for group in groups:
        rest = np.setdiff1d(np.arange(N), group)
        step = np.linalg.lstsq(JACOBIAN[np.ix_(rest, on)], -base[rest], rcond=None)[0]
        errors.append(np.sqrt(np.mean((base[group] + JACOBIAN[np.ix_(group, on)] @ step) ** 2)))
    return float(np.mean(errors))


@pytest.mark.parametrize("active", [NAMES, ("d", "f0"), ("d", "h1", "f0")])
def test_what_is_left_out_is_predicted_by_the_rest_alone(active):
    found = evidence(groups={"condition": GROUPS, "session": GROUPS[:2]}).scores(frozenset(active))
    assert found["condition"] == pytest.approx(left_out(active), rel=1e-6)
    assert found["session"] == pytest.approx(left_out(active, groups=GROUPS[:2]), rel=1e-6)
    # A group that is nothing but a leverage point of its own says how wrong its prediction is, not its fit.
    lonely = RESIDUAL.copy()
    lonely[GROUPS[1]] += 50.0
    assert evidence(lonely).scores(frozenset(active))["condition"] > 10.0


def test_lags_of_the_coil_stay_whatever_is_taken_away():
    coil = evidence(names=("coil.rise_s", "h1", "c1", "f0"))
    assert coil.scores(frozenset(("f0",))) == pytest.approx(evidence().scores(frozenset(("d", "f0"))))


def test_a_term_stays_where_without_it_more_is_missed():
    # Where the values are the residual is noise: without h1 it is large; c1 is made up for by nothing but its own 2.
    terms = [Term("h1 matters", ("h1",), (0.0,)), Term("c1 does not", ("c1",), (0.0,))]
    made = evidence(JACOBIAN @ np.array([0.0, 0.0, 2.0, 0.0]) + 0.01 * RNG.standard_normal(N))
    active, tried = made.choose(terms)
    assert active == frozenset(("d", "h1", "f0"))
    assert [(t.term, t.kept) for t in tried] == [("h1 matters", True), ("c1 does not", False)]
    # Of a term that is kept the error without it, beside the error with it; of another the other way round.
    assert tried[0].left_out["condition"] > 10 * tried[0].before["condition"]
    assert tried[1].left_out["condition"] >= 0.98 * tried[1].before["condition"]


@pytest.mark.parametrize(
    ("scores", "before", "better"),
    [
        ({"condition": 0.98}, {"condition": 1.0}, True),
        ({"condition": 0.99}, {"condition": 1.0}, False),  # not worth a number
        ({"condition": 1.02}, {"condition": 1.0}, False),
        ({"condition": 0.9, "current": 1.009}, {"condition": 1.0, "current": 1.0}, True),
        ({"condition": 0.9, "current": 1.011}, {"condition": 1.0, "current": 1.0}, False),  # harm done
        ({"condition": 0.018}, {"condition": 0.02}, True),
        ({}, {}, False),
    ],
)
def test_a_term_must_earn_its_place_and_harm_nothing(scores, before, better):
    assert choice._better(scores, before) is better


def part(current, changes=False, is_sine=True):
    return SimpleNamespace(condition=Condition(current, 1.0, 0.01), changes=changes, is_sine=is_sine)


def test_levels_are_runs_of_constant_current_a_two_hundredth_apart():
    currents = [1.0, 0.0, 0.5, 1.004, 0.004, 0.3]
    problem = SimpleNamespace(parts=[*map(part, currents), part(0.7, changes=True)])
    assert levels_of(problem) == [[1, 4], [5], [2], [0, 3]]
    problem.parts = [part(0.0), part(2.0), part(1.989)]
    assert levels_of(problem) == [[0], [2], [1]]


@pytest.mark.parametrize(
    ("levels", "changes", "forms"), [(2, False, 0), (3, False, 2), (4, False, 2), (2, True, 2), (1, False, 0)]
)
def test_as_many_numbers_of_the_level_law_as_there_are_currents(levels, changes, forms):
    problem = SimpleNamespace(parts=[part(0.5 * k) for k in range(levels)] + [part(0.1, changes=True)] * changes)
    found = choice._level_laws(problem)
    assert len(found) == forms
    if levels > 3 or changes:
        assert [term.names for term in found] == [("Ic",), ("Ic", "si")]
    elif forms:
        assert [term.names for term in found] == [("Ic",), ("si",)]


def test_one_level_determines_no_rise_with_current():
    def run(*current):
        return SimpleNamespace(coil_current=np.array(current))

    assert choice._undetermined([run(1.0), run(1.004, 1.0)]) == {"fy1": 0.0, "c1": 0.0, "h1": 0.0}
    assert choice._undetermined([run(1.0), run(0.9)]) == {}
    assert choice._undetermined([run(-1.0), run(1.0)]) == {"fy1": 0.0, "c1": 0.0, "h1": 0.0}


def test_conditions_are_left_out_whole_and_other_records_in_stretches():
    motion = SimpleNamespace(time=np.array([0.0, 60.0]))
    parts = [part(0.0), part(1.0), part(0.0), part(1.0, is_sine=False)]
    for each in parts:
        each.motion = motion
    owner = np.repeat([0, 1, 2, 3], [3, 2, 3, 20])
    (groups,) = choice._by_condition(SimpleNamespace(parts=parts), owner).values()
    assert [g.tolist() for g in groups[:2]] == [[0, 1, 2, 5, 6, 7], [3, 4]]
    assert [g.size for g in groups[2:]] == [4] * 5  # sixty cycles, a dozen each
    assert sorted(np.concatenate(groups).tolist()) == list(range(28))
    assert choice._by_condition(SimpleNamespace(parts=parts[:2]), owner[:5]) == {}


def test_sessions_are_left_out_where_some_hold_several_runs():
    def asked(*names):
        runs = [SimpleNamespace(id=str(i), notes={"session": name}) for i, name in enumerate(names)]
        found = choice._by_session(SimpleNamespace(runs=runs), np.repeat(np.arange(len(names)), 2))
        return [g.tolist() for g in found.get("session", [])]

    assert asked("a", "b", "a", "c") == [[0, 1, 4, 5], [2, 3], [6, 7]]
    assert asked("a", "b", "a") == []  # two sessions: what one shares cannot be told from the other
    assert asked("a", "b", "c") == []  # a run each


def test_an_inner_current_is_predicted_by_the_others():
    asked = []

    class Problem:
        def __init__(self):
            self.parts = [part(I) for I in (0.0, 0.5, 1.0, 0.5, 2.0)]

        def refit(self, fit, rest, settled):
            asked.append(rest)
            return tuple(rest)

        def errors(self, without, level):
            assert not set(without) & set(level)
            return np.array([0.1 * i for i in level])

    problem = Problem()
    found = choice._left_out_current(problem, "fit", levels_of(problem))
    assert asked == [[0, 2, 4], [0, 1, 3, 4]]
    assert found == pytest.approx((0.1 + 0.3 + 0.2) / 3)
