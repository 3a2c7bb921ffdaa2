"""Which terms the tests show: what is left out is predicted by the rest alone, term by term, by refits written out."""

from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.dampers import choice
from mrdamper.dampers.choice import CrossValidation, ModelTerm
from mrdamper.dampers.search_space import level_count, undetermined
from mrdamper.data import Condition, level_groups
from mrdamper.models.play_bypass import RISE_CURRENT, PlayBypass

RNG = np.random.default_rng(2)
N, NAMES = 120, ("d", "h1", "c1", "f0")
JACOBIAN = RNG.standard_normal((N, 4)) * [1.0, 2.0, 0.5, 3.0]
VALUES = np.array([0.4, 0.3, 2.0, 1.0])
GROUPS = [np.arange(k, N, 4) for k in range(4)]
RESIDUAL = RNG.standard_normal(N) + np.repeat([0.0, 1.0], N // 2)


def evidence(residual=RESIDUAL, groups=None, names=NAMES):
    return CrossValidation(names, VALUES, residual, JACOBIAN, np.ones(N), np.ones(N), groups or {"condition": GROUPS})


def left_out(active, residual=RESIDUAL, groups=GROUPS):
    """Every group predicted by least squares on the other rows alone; parameters that are off at zero."""
    on = [i for i, name in enumerate(NAMES) if name in active]
    off = [i for i in range(4) if i not in on]
    base = residual - JACOBIAN[:, off] @ VALUES[off]
    errors = []
    for group in groups:
        rest = np.setdiff1d(np.arange(N), group)
        step = np.linalg.lstsq(JACOBIAN[np.ix_(rest, on)], -base[rest], rcond=None)[0]
        errors.append(np.sqrt(np.mean((base[group] + JACOBIAN[np.ix_(group, on)] @ step) ** 2)))
    return np.array(errors)


@pytest.mark.parametrize("active", [NAMES, ("d", "f0"), ("d", "h1", "f0")])
def test_what_is_left_out_is_predicted_by_the_rest_alone(active):
    found = evidence(groups={"condition": GROUPS, "session": GROUPS[:2]}).scores(frozenset(active))
    assert found["condition"] == pytest.approx(left_out(active), rel=1e-6)
    assert found["session"] == pytest.approx(left_out(active, groups=GROUPS[:2]), rel=1e-6)
    # A group that is nothing but a leverage point of its own says how wrong its prediction is, not its fit.
    lonely = RESIDUAL.copy()
    lonely[GROUPS[1]] += 50.0
    assert evidence(lonely).scores(frozenset(active))["condition"].mean() > 10.0


def test_lags_of_the_coil_stay_whatever_is_taken_away():
    coil = evidence(names=("coil.rise_s", "h1", "c1", "f0"))
    without = evidence().scores(frozenset(("d", "f0")))["condition"]
    assert coil.scores(frozenset(("f0",)))["condition"] == pytest.approx(without)


def test_a_term_stays_where_without_it_more_is_missed():
    # Where the values are the residual is noise: without h1 it is large; c1 is made up for by nothing but its own 2.
    terms = [ModelTerm("h1 matters", ("h1",)), ModelTerm("c1 does not", ("c1",))]
    made = evidence(JACOBIAN @ np.array([0.0, 0.0, 2.0, 0.0]) + 0.01 * RNG.standard_normal(N))
    active, tried = made.choose(terms)
    assert active == frozenset(("d", "h1", "f0"))
    assert [(t.term, t.kept) for t in tried] == [("h1 matters", True), ("c1 does not", False)]
    # Of a term that is kept the error without it, beside the error with it; of another the other way round.
    assert tried[0].left_out["condition"] > 10 * tried[0].before["condition"]
    assert tried[1].left_out["condition"] >= 0.98 * tried[1].before["condition"]


def part(current, changes=False, is_sine=True):
    condition = Condition(current, 1.0, 0.01)
    return SimpleNamespace(condition=condition, sine=condition if is_sine and not changes else None)


def test_levels_are_runs_of_constant_current_from_the_lowest():
    currents = [1.0, 0.0, 0.5, 1.004, 0.004, 0.3]
    assert level_groups([*currents, None]) == {0.0: [1, 4], 0.3: [5], 0.5: [2], 1.0: [0, 3]}
    assert level_groups([0.0, 2.0, 1.9, None, -2.0]) == {0.0: [0], 1.9: [2], 2.0: [1, 4]}
    assert level_groups([None]) == level_groups([]) == {}


@pytest.mark.parametrize(
    ("levels", "changes", "forms"),
    [(1, False, 1), (2, False, 1), (3, False, 4), (4, False, 5), (5, False, 6), (2, True, 6)],
)
def test_the_law_of_the_current_has_a_number_fewer_than_there_are_levels(levels, changes, forms):
    problem = SimpleNamespace(currents=[0.5 * k for k in range(levels)] + [None] * changes)
    found = choice._level_laws(problem)
    assert len(found) == forms
    straight = 2  # yield force without current, and its rise
    # Of three levels a saturation is determined, though not by two of them.
    own = [set(term.names) - ({"si"} if levels == 3 else set()) for term in found]
    assert changes or all(straight + len(names) <= max(levels - 1, straight) for names in own)


def test_two_levels_show_a_straight_line_and_more_choose_between_it_and_the_onset_of_the_preset():
    def rise(law):
        onset = dict(law.held).get("Ic", RISE_CURRENT)
        values = {info.name: min(max(info.bounds[0], 0.1), info.bounds[1]) for info in PlayBypass.parameters()}
        values |= {"fy0": 10.0, "fy1": 100.0, "Ic": onset, "si": 0.0}
        return PlayBypass(**values).yield_force(np.array([0.05, 0.25, 0.5]))

    few, several = (choice._level_laws(SimpleNamespace(currents=[0.5 * k for k in range(n)])) for n in (2, 3))
    assert [rise(law) for law in few] == [pytest.approx([15.0, 35.0, 60.0])]
    assert rise(several[0]) == pytest.approx([15.0, 35.0, 60.0])
    assert rise(several[1])[0] < 0.5 * 15.0 + 5.0


def test_of_the_laws_of_the_current_the_selected_one_is_named():
    kept = [choice.TermTrial(law.title, True, {}, {}) for law in choice.LEVEL_LAWS[1:3]]
    inertia = choice.TermTrial("inertia", True, {}, {})
    assert choice._kept_terms([*kept, inertia], choice.LEVEL_LAWS[2]) == f"{choice.LEVEL_LAWS[2].title}; inertia"
    assert choice._kept_terms([], choice.LEVEL_LAWS[0]) == "none beyond the plain form"


def test_one_level_determines_no_rise_with_current():
    assert level_count([1.0, 1.004]) == level_count([-1.0, 1.0]) == 1
    assert level_count([1.0, 0.9, 1.0]) == 2
    assert undetermined(PlayBypass, [1.0, 1.004]) == ("fy1", "c1", "h1", "si")
    assert undetermined(PlayBypass, [1.0, 0.9]) == ("si",)
    assert undetermined(PlayBypass, [None]) == ()


def test_conditions_are_left_out_whole_and_other_records_in_stretches():
    motion = SimpleNamespace(time=np.array([0.0, 60.0]))
    parts = [part(0.0), part(1.0), part(0.0), part(1.0, is_sine=False)]
    for each in parts:
        each.motion = motion
    owner = np.repeat([0, 1, 2, 3], [3, 2, 3, 20])
    (groups,) = choice._folds(SimpleNamespace(parts=parts), owner, False).values()
    assert [g.tolist() for g in groups[:2]] == [[0, 1, 2, 5, 6, 7], [3, 4]]
    assert [g.size for g in groups[2:]] == [4] * 5  # sixty cycles, a dozen each
    assert sorted(np.concatenate(groups).tolist()) == list(range(28))
    assert choice._folds(SimpleNamespace(parts=parts[:2]), owner[:5], False) == {}


def test_sessions_are_left_out_where_some_hold_several_runs():
    def asked(*names):
        runs = [SimpleNamespace(id=str(i), notes={"session": name}) for i, name in enumerate(names)]
        motion = SimpleNamespace(time=np.array([0.0, 9.0]))
        parts = [SimpleNamespace(**vars(part(0.0)), motion=motion) for _ in names]
        problem = SimpleNamespace(runs=runs, parts=parts)
        found = choice._folds(problem, np.repeat(np.arange(len(names)), 2), True)
        return [g.tolist() for g in found.get("session", [])]

    assert asked("a", "b", "a", "c") == [[0, 1, 4, 5], [2, 3], [6, 7]]
    assert asked("a", "b", "a") == []  # two sessions: what one shares cannot be told from the other
    assert asked("a", "b", "c") == []  # a run each


def test_a_current_is_predicted_by_a_fit_to_the_others_from_a_start_that_never_saw_it():
    asked = []

    class Problem:
        def __init__(self):
            self.currents = [0.0, 0.5, 1.0, 0.5, 2.0]
            self.parts = [part(current) for current in self.currents]

        def from_point(self, start):
            return f"point of {start}"

        def fit(self, rest, point, **effort):
            asked.append((rest, point))
            return tuple(rest)

        def errors(self, without, level):
            assert not set(without) & set(level)
            return np.array([0.1 * i for i in level])

    problem = Problem()
    found = choice._left_out_current(problem, ["a", "b"], [*level_groups(problem.currents).values()][1:-1])
    assert asked == [([0, 2, 4], "point of a"), ([0, 1, 3, 4], "point of b")]
    assert found == pytest.approx([0.1, 0.3, 0.2])
