"""Recipes by dampers that remember: what was fitted, left out and held out; refits know only what is kept."""

from dataclasses import astuple, dataclass, replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from support.dampers import joint_damper
from support.synthetic import synthetic_run

from mrdamper.dampers.calibration import PredictedRun
from mrdamper.dampers.published import all_published
from mrdamper.data import Condition, Run
from mrdamper.errors import IdentificationError, InputError, UnknownNameError
from mrdamper.identification import basis as bases
from mrdamper.identification.basis import Basis
from mrdamper.identification.methods.balance import Balance
from mrdamper.models import model_type
from mrdamper.models.bingham import Bingham
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper.assumptions import PaperAssumptions
from mrdamper.paper.functions import fit_paper_functions
from mrdamper.paper.options import PaperOptions
from mrdamper.paper.recipes import fit_chosen_functions, one_per_current
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.physics.motion import measured_motion, sine, sines
from mrdamper.statistics.metrics import Scores
from mrdamper.study import cross_validation
from mrdamper.study import recipe as recipes
from mrdamper.study.cross_validation import stretches
from mrdamper.study.fit_result import FitResult
from mrdamper.study.recipe import Recipe, fit_and_score, fit_and_score_all, fit_per_run, identified
from mrdamper.study.validation import RunScore, Validation


@dataclass(frozen=True)
class Said:
    force: np.ndarray
    motion: object
    condition: Condition
    extrapolation: tuple = ()


class Memory:
    """Knows the force of the runs it was made of, and says zero of all others."""

    envelope = None
    title = "memory"
    one_model = None

    def __init__(self, runs):
        self.known = {run.id for run in runs}

    def predict(self, run):
        motion = sine(run.nominal, 3, 100)
        return Said(run.force if run.id in self.known else np.zeros(run.time.size), motion, run.nominal)


def remember(runs, identifications):
    return FitResult(Memory(runs), lambda rows: Memory([runs[i] for i in rows]))


def made(current, frequency, name):
    condition = Condition(current, frequency, 0.01)
    motion = sine(condition, 3, 100)
    window = (float(motion.time[100]), float(motion.time[-1]))
    force = (100 + 50 * current) * motion.velocity
    return Run(name, motion.time, motion.displacement, force, current, nominal=condition, window=window)


TRAIN = [made(I, f, f"{I}A-{f}Hz") for I in (0.0, 1.0) for f in (1.0, 2.0)]
HELD = [made(0.5, 1.0, "held")]
REMEMBER = Recipe("memory", Basis("bingham"), remember)


def test_fitted_left_out_and_held_out_errors_stay_apart():
    errors = [SimpleNamespace(scores=SimpleNamespace(nrmse_pp=e)) for e in (0.1, 0.9, 0.2)]
    found = fit_and_score(REMEMBER, TRAIN, errors, HELD, spent=100.0)
    wape = {
        name: [run.scores.wape for run in getattr(found, name).runs]
        for name in ("train", "cross_validated", "validation")
    }
    # What it was made of it knows; without the condition, and of what was held out, it knows nothing.
    assert wape == {"train": [0.0] * 4, "cross_validated": pytest.approx([1.0] * 4), "validation": pytest.approx([1.0])}
    assert [run.run_id for run in found.cross_validated.runs] == [run.id for run in TRAIN]
    assert [run.run_id for run in found.validation.runs] == ["held"]
    errors = replace(found, validation=replace(found.validation, runs=())).errors
    assert list(errors.items()) == [
        ("per_run_nrmse_pp", 0.2), ("train_nrmse_pp", 0.0), ("cv_nrmse_pp", found.cross_validated.median()),
        ("cv_worst_nrmse_pp", found.cross_validated.worst_error()),
        ("validation_nrmse_pp", None), ("validation_worst_nrmse_pp", None),
    ]  # fmt: skip
    assert found.per_run == 0.2
    assert 100.0 <= found.seconds < 110.0
    without = fit_and_score(REMEMBER, TRAIN, [], HELD, leave_out=False)
    assert without.cross_validated.runs == ()
    assert np.isnan(without.per_run)


def test_parameters_spread_as_each_condition_is_left_out():
    def of(runs):
        return replace(joint_damper("bingham"), model=Bingham(fy=sum(run.nominal.current_A for run in runs), c=9.0))

    recipe = Recipe("sum", None, lambda runs, _: FitResult(of(runs), lambda rows: of([runs[i] for i in rows])))
    found = fit_and_score(recipe, [*TRAIN, made(4.0, 1.0, "4A")], [], HELD)
    assert found.damper.model.fy == 6.0
    assert (found.spread["fy"], found.spread["c"]) == ((2.0, 6.0), (9.0, 9.0))
    assert fit_and_score(REMEMBER, TRAIN, [], HELD).spread == {}


def test_what_cannot_be_made_is_refused_by_its_name_and_the_others_go_on():
    def broken(runs, identifications):
        raise IdentificationError("too few runs")

    steps = [(Recipe("broken", None, broken), TRAIN), (Recipe("memory", None, remember), TRAIN[:2])]
    told = []
    scored, refused = fit_and_score_all(steps, HELD, lambda what, share: told.append((what, share)))
    assert [s.recipe.name for s in scored] == ["memory"]
    assert [run.run_id for run in scored[0].train.runs] == [run.id for run in TRAIN[:2]]
    assert set(refused) == {"broken"}
    assert "too few runs" in refused["broken"]
    assert all(0 <= share <= 1 for _, share in told)
    assert [share for _, share in told] == sorted(share for _, share in told)


def test_a_run_is_identified_once_for_all_recipes_of_one_basis():
    basis, other = Basis("bingham"), Basis("dahl")
    found = {(basis, TRAIN[0].id): ("no motion", 1.0), (other, TRAIN[0].id): (7, 7.0)}
    made_, spent = identified(other, TRAIN[:1], found)
    assert (made_, spent) == ([7], 7.0)
    assert identified(None, TRAIN, found) == ([], 0.0)
    with pytest.raises(IdentificationError, match=f"run {TRAIN[0].id}: no motion"):
        identified(basis, TRAIN[:1], found)
    one, spent = identified(basis, TRAIN[1:2], found)
    assert one[0].run_id == TRAIN[1].id
    assert found[basis, TRAIN[1].id] == (one[0], spent)


@pytest.fixture(scope="module")
def tests():
    """Runs of a Bouc–Wen damper and what single ones say."""
    matrix = [Condition(I, f, A) for I in (0.0, 0.5, 1.0, 2.0) for f, A in ((0.5, 0.03), (1.0, 0.02), (2.0, 0.01))]
    runs = [
        synthetic_run(c, 3.0, seed=n, cycles=2, samples_per_cycle=100, id=f"run {n}", rig="made")
        for n, c in enumerate(matrix)
    ]
    return runs, [Basis("bouc-wen", Balance()).identify(run) for run in runs]


@pytest.mark.parametrize("make", [fit_per_run, fit_paper_functions, one_per_current, fit_chosen_functions])
def test_a_refit_is_what_the_kept_runs_alone_make(tests, make):
    runs, identifications = tests
    rows = [i for i in range(len(runs)) if i not in (1, 7)]
    refitted = make(runs, identifications).refit(rows)
    alone = make([runs[i] for i in rows], [identifications[i] for i in rows]).damper
    everything = make(runs, identifications).damper
    for condition in (Condition(0.7, 0.7, 0.02), runs[1].nominal or Condition(0.0, 1.0, 0.02)):
        assert refitted.model_at(condition).values() == alone.model_at(condition).values()
        if make is not one_per_current:
            assert refitted.model_at(condition).values() != everything.model_at(condition).values()


def test_by_the_paper_only_identifications_of_kept_runs_count_where_some_runs_have_none(tests):
    runs, identifications = tests
    some = identifications[2:]  # the first two runs were no pure sines
    rows = [i for i in range(len(runs)) if i != 5]
    refitted = fit_paper_functions(runs, some).refit(rows)
    alone = fit_paper_functions(runs, [i for i in some if i.run_id != runs[5].id]).damper
    assert refitted.model_at(Condition(0.7, 0.7, 0.02)).values() == alone.model_at(Condition(0.7, 0.7, 0.02)).values()
    with pytest.raises(IdentificationError, match="none of the runs"):
        fit_paper_functions(runs, some).refit([0, 1])


def noise_record(seconds, rate=200):
    time = np.arange(0, seconds, 1 / rate)
    x = 0.01 * np.sin(2 * np.pi * time) + 0.006 * np.sin(2 * np.pi * 1.618 * time + 1)
    return Run("sweep", time, x, 1e3 * np.gradient(x, time), 1.0, window=(2.0, float(time[-1])))


def test_a_long_record_is_left_out_in_stretches_that_cover_it_once():
    parts = stretches(noise_record(100.0))
    assert 2 <= len(parts) <= 8
    assert [part.id for part in parts] == [f"sweep {n}/{len(parts)}" for n in range(1, len(parts) + 1)]
    edges = [part.window for part in parts]
    assert edges[0][0] == pytest.approx(2.0, abs=0.01)
    assert edges[-1][1] == pytest.approx(99.995, abs=0.01)
    for (_, end), (begin, _) in pairwise(edges):
        assert begin - end == pytest.approx(1 / 200)  # the next sample
    # A run-in before each window but the first, for what remembers.
    assert all(part.time[0] < part.window[0] - 0.5 for part in parts)
    assert stretches(noise_record(15.0))[0].id == "sweep"
    assert stretches(TRAIN[0]) == [TRAIN[0]]


@pytest.mark.parametrize(("seconds", "count"), [(20.0, 1), (28.0, 2), (52.0, 4)])
def test_a_stretch_has_a_dozen_cycles_and_a_lead_in_of_one_and_a_half(seconds, count):
    time = np.arange(0, seconds, 0.01)
    run = Run("made", time, 0.01 * np.sin(2 * np.pi * time) + 1e-5, np.cos(2 * np.pi * time), 1.0)
    changing = replace(run, current=np.where(time < 3, 0.5, 1.0))
    with pytest.MonkeyPatch.context() as patch:

        def equivalent(condition, is_sine=False):
            for module in (cross_validation, sines):
                patch.setattr(
                    module, "equivalent_sine", lambda run: SimpleNamespace(condition=condition, is_sine=is_sine)
                )

        condition = Condition(1.0, 1.0, 0.01)
        equivalent(condition)
        parts = stretches(run)
        assert len(parts) == count
        assert count == 1 or [len(p.time) for p in parts[1:-1]] == pytest.approx([1350] * (count - 2), abs=200)
        for part in parts[1:]:
            assert part.window[0] - part.time[0] == pytest.approx(1.5)
        equivalent(Condition(1.0, 0.5, 0.01))
        assert len(stretches(run)) == max(1, count // 2)
        assert all(p.window[0] - p.time[0] == pytest.approx(3.0) for p in stretches(run)[1:])
        assert len(stretches(replace(run, window=(10.0, seconds - 0.01)))) == max(1, int((seconds - 10) / 24))
        # A sine whose current changes is cut too, a sine at one current stays whole.
        equivalent(condition, is_sine=True)
        assert (len(stretches(run)), len(stretches(changing))) == (1, count)


class Zero:
    envelope = None
    title, one_model = "zero", None

    def predict(self, run):
        return Said(np.zeros(run.time.size), measured_motion(run), Condition(0.0, 1.0, 0.01))


def test_records_that_are_no_sine_are_cut_and_left_out_by_themselves(monkeypatch):
    asked = {}

    def leave(pieces, folds, refit, title):
        asked.update(ids=[p.id for p in pieces], folds=list(folds))
        return Validation(title, ())

    monkeypatch.setattr(cross_validation, "leave_out", leave)
    changing = replace(TRAIN[1], id="changing", current=np.linspace(0, 1, TRAIN[1].time.size))
    train = [TRAIN[0], noise_record(40.0), changing]
    parts = [part.id for part in stretches(train[1])]
    zero = FitResult(Zero(), lambda rows: Zero())
    fit_and_score(Recipe("zero", None, lambda runs, _: zero), train, [], [])
    ids = [TRAIN[0].id, *parts, "changing"]
    assert asked == {"ids": ids, "folds": [[i] for i in range(len(ids))]}
    assert len(parts) > 1
    fit_and_score(Recipe("zero", Basis("bingham"), lambda runs, _: zero), train, [], [])
    assert asked["ids"] == [TRAIN[0].id, "sweep", "changing"]


def test_a_basis_asks_for_what_it_names(monkeypatch):
    basis = Basis("bouc-wen", Balance(), ("n",), (("m", 2.0),), GasSpring(1.5e6, 1.5e-4, 3e-4))
    problem = basis.problem(TRAIN[3])
    assert problem.fixed["m"] == 2.0
    assert "n" in problem.free
    assert problem.model_type is BoucWen
    asked = {}
    monkeypatch.setattr(bases, "identify", lambda *given, **more: asked.update(more, given=given))
    basis.identify(TRAIN[3])
    assert asked == {"given": (TRAIN[3], "bouc-wen", basis.method), "free": ("n",), "fixed": {"m": 2.0},
                     "gas": basis.gas}  # fmt: skip


@pytest.mark.parametrize(("way", "any_motion"), [(("global fit",), True), ((), True), (("current laws",), False)])
def test_joint_fits_of_functions_follow_the_motion_or_the_current_alone(monkeypatch, way, any_motion):
    identifications, asked = [SimpleNamespace(method="balance")] * 2, []
    fit = SimpleNamespace(damper="damper")
    monkeypatch.setattr(
        recipes, "fit_modified_jointly", lambda *given, **named: asked.append((given, named)) or (fit, "refit")
    )
    made_ = recipes.fit_functions_jointly("ab", identifications, *way)
    assert (made_.damper, made_.refit, made_.fit) == ("damper", "refit", fit)
    about = {"method": "balance", "identification runs": "2", "functions": (*way, "global fit")[0]}
    assert asked == [(("ab", identifications, about), {"any_motion": any_motion})]


def test_joint_ways_hand_on_what_their_fits_make(monkeypatch):
    asked, fit = [], SimpleNamespace(damper="damper")
    folds = SimpleNamespace(refit=lambda rows: SimpleNamespace(damper=("without", rows)))
    choice = SimpleNamespace(problem="problem", fit=fit, searched=("leak",))
    monkeypatch.setattr(recipes, "identify_jointly", lambda runs, model: asked.append((runs, model)) or choice)
    monkeypatch.setattr(recipes, "all_folds", lambda runs: [[0], [1]])
    monkeypatch.setattr(recipes, "FoldFits", lambda *given: asked.append(given) or folds)
    made_ = recipes.fit_whole_damper("tanh", "ab", [])
    assert (made_.damper, made_.fit, made_.refit([1])) == ("damper", fit, ("without", [1]))
    assert asked[-2:] == [("ab", "tanh"), ("problem", [[0], [1]], ("leak",))]
    law = SimpleNamespace(basis="spencer", fit=lambda *given: given)
    made_ = recipes.fit_published(law, "abc", [7, 8, 9])
    assert made_.damper == (["a", "b", "c"], [7, 8, 9], {"identification runs": "3"})
    assert made_.refit([2, 0]) == (["c", "a"], [9, 7], {"identification runs": "3"})
    law.basis = None
    assert recipes.fit_published(law, "abc", []).damper == (["a", "b", "c"], [], {"identification runs": "3"})


def test_a_recipe_that_depends_on_the_runs_is_completed_by_them():
    plain = Recipe("memory", None, remember)
    completed = replace(plain, complete=lambda sines: replace(plain, notes=tuple(sines)))
    assert plain.for_runs("ab") is plain
    assert completed.for_runs("ab").notes == ("a", "b")


def test_a_study_follows_the_studied_models_the_published_method_and_the_model_asked_for():
    def names(train, everything, model=None):
        return [recipe.name for recipe, _ in recipes.recipes_of_study(train, everything, None, model)]

    studied = [f"{name}{way}" for name in recipes.STUDIED for way in ("", ":joint", ":current")]
    whole = list(recipes.WHOLE_DAMPER)
    assert names(TRAIN, TRAIN) == [*studied, "paper", *whole]
    assert names(TRAIN[:3], TRAIN[:3]) == [*studied, "paper", *whole]
    assert names(TRAIN[:2], TRAIN[:2]) == [*studied, *whole]
    assert names(TRAIN, TRAIN, "bouc-wen") == [*studied, "paper", *whole]  # genetic searches are asked for by name
    assert names(TRAIN, TRAIN, "dahl") == [*studied, "dahl", "dahl:joint", "paper", *whole]
    assert names(TRAIN, TRAIN, "dahl:joint") == [*studied, "dahl:joint", "paper", *whole]
    records = [noise_record(15.0), replace(noise_record(15.0), id="other")]
    assert names([], records) == [f"{name}:current" for name in recipes.STUDIED] + whole
    assert names([], records[:1]) == whole


def test_a_study_method_has_its_options_from_text_and_the_gas_that_is_known():
    gas = GasSpring(1.5e6, 1.5e-4, 3e-4)
    assert recipes.study_method("paper", {"n": "3", "phase": "peaks"}, gas) == PaperOptions(gas, n=3.0, phase="peaks")
    assert recipes.study_method("paper") == PaperOptions()


def test_steps_tell_how_far_they_are_and_take_pure_sines_where_they_must(monkeypatch):
    monkeypatch.setattr(recipes, "pure_sines", lambda runs: [run for run in runs if run.id != "sweep"])
    told, found, given = [], {}, []
    zero = FitResult(Zero(), lambda rows: Zero())

    def make(runs, identifications):
        given.append(([run.id for run in runs], [i.run_id for i in identifications]))
        return zero

    runs = [TRAIN[2], noise_record(15.0), TRAIN[3]]
    steps = [(Recipe(name, Basis("bingham"), make, pure=pure), runs) for name, pure in (("all", False), ("pure", True))]
    scored, refused = fit_and_score_all(
        steps, HELD, lambda what, share: told.append((what, share)), leave_out=False, cache=found
    )
    assert refused == {}
    names = [run.id for run in runs]
    assert given == [(names, names), (names, [names[0], names[2]])]
    shares = [("all, run " + name, 0.25 * k / 3) for k, name in enumerate(names)]
    assert told == [*shares, ("all, over all conditions", 0.25), ("pure, over all conditions", 0.75)]
    assert {run_id for _, run_id in found} == set(names)
    assert [s.cross_validated.runs for s in scored] == [(), ()]
    spent = sum(seconds for _, seconds in found.values())
    assert spent <= scored[0].seconds < spent + 60
    assert spent < 60


def test_stretches_are_scored_as_the_record_they_were_cut_from():
    def score(name, k, flags):
        return RunScore(name, "rig", Condition(0, 1, 1), Scores(*(k * np.arange(1.0, 7.0))), None, flags)

    pieces = [replace(TRAIN[0], id=f"long {n}", notes={cross_validation._STRETCH_NOTE: "long"}) for n in (1, 2)] + [
        TRAIN[1]
    ]
    scores = (
        score("long 1", 3.0, ("current",)),
        score("long 2", 4.0, ("current", "amplitude")),
        score(TRAIN[1].id, 9, ()),
    )
    whole = cross_validation._whole_again(Validation("x", scores), pieces)
    assert [run.run_id for run in whole.runs] == ["long", TRAIN[1].id]
    rms = np.sqrt((3.0**2 + 4.0**2) / 2)
    assert astuple(whole.runs[0].scores) == pytest.approx((rms, 2 * rms, 3 * 3.5, 4 * 3.5, 5 * 3.5, 6 * 3.5))
    assert whole.runs[0].extrapolation == ("current", "amplitude")
    assert astuple(whole.runs[1].scores) == astuple(scores[2].scores)
    rests = zip(scores[:2], (3.0, 12.0), strict=True)
    three = [replace(s, rest=rest) for s, rest in rests] + [score("long 1", 11.0, ())]
    three[2] = replace(three[2], condition=Condition(2, 1, 1), rest=4.0)
    joined = cross_validation._joined("long", three)
    rms = np.sqrt((3.0**2 + 4.0**2 + 11.0**2) / 3)
    assert astuple(joined.scores) == pytest.approx((rms, 2 * rms, 3 * 6, 4 * 6, 5 * 6, 6 * 6))
    assert (joined.rest, joined.condition) == (pytest.approx(13 / np.sqrt(3)), Condition(0, 1, 1))
    assert cross_validation._joined("long", [replace(three[0], rest=None), three[1]]).rest == 12.0
    (alone,) = cross_validation._whole_again(Validation("x", scores[:1]), pieces).runs
    assert (alone.run_id, astuple(alone.scores)) == ("long", pytest.approx(astuple(scores[0].scores)))
    assert cross_validation._joined("long 1", [scores[0]]) is scores[0]
    forces = [np.arange(8.0), 10 + np.arange(6.0)]
    predictions = [PredictedRun(f"long {n}", "day", f, -f, f[:1], f[1:2]) for n, f in enumerate(forces)]
    assert joined.predicted is None
    (beside,) = cross_validation._whole_again(
        Validation("x", tuple(replace(s, predicted=p) for s, p in zip(scores[:2], predictions, strict=True))), pieces
    ).runs
    assert (beside.predicted.run_id, beside.predicted.session) == ("long", "day")
    assert beside.predicted.predicted.tolist() == [0, 2, 4, 6, 10, 12, 14]  # every second of each of two
    assert beside.predicted.measured.tolist() == [0, -2, -4, -6, -10, -12, -14]
    assert (beside.predicted.peak.tolist(), beside.predicted.energy.tolist()) == ([0, 10], [1, 11])


def test_a_recipe_says_its_model_and_an_unknown_fault_is_not_hidden():
    assert Recipe("bouc-wen:joint", None, remember).model == "bouc-wen"
    assert Recipe("play-bypass", None, remember).model == "play-bypass"

    def ours(runs, identifications):
        raise ValueError("a fault of the program")

    with pytest.raises(ValueError, match="a fault"):
        fit_and_score_all([(Recipe("ours", None, ours), TRAIN)], HELD)
    assert not issubclass(ValueError, InputError)


def test_every_recipe_says_what_it_is():
    known = recipes.catalogue()
    assert {"bouc-wen", "bouc-wen:joint", "play-bypass", "bouc-wen:paper", "ali-type", "kernel"} <= set(known)
    assert not {"play-bypass:joint", "tanh:joint"} & set(known)
    joint = {name.partition(":")[0] for name in known if name.endswith(":joint")}
    assert {"bingham", "bouc-wen", "dahl"} <= joint  # at most one shape coordinate, the yield displacement
    assert not {"lugre", "spencer", "kwok"} & joint
    one, both, ali = known["dahl"], known["dahl:joint"], known["ali-type"]
    assert (one.way, both.way, one.title, both.title) == (
        "individual fits", "global fit", "viscous and Dahl", "viscous and Dahl",
    )  # fmt: skip
    assert one.source == both.source == model_type("dahl").source
    assert "stepped, not closed" in known["spencer"].limits
    assert "stepped" not in one.limits
    assert (ali.title, ali.basis.model, ali.source) == (
        "Ali-type (Spencer-based)", "spencer", all_published()["ali-type"].source,
    )  # fmt: skip
    assert (both.basis, both.make, one.basis) == (Basis("dahl"), recipes.fit_functions_jointly, Basis("dahl"))
    ours = known["play-bypass"]
    assert (ours.basis, ours.way, ours.title, ours.source) == (
        None, "global fit", "play and bypass", model_type("play-bypass").source,
    )  # fmt: skip
    assert (ours.make.func, ours.make.args) == (recipes.fit_whole_damper, ("play-bypass",))
    assert (ali.make.func, ali.make.args) == (recipes.fit_published, (all_published()["ali-type"],))
    paper = PaperOptions(functions="shorter").recipe(runs_with(1400.0, 12.0, (0.5, 1.0, 2.0)))
    assert (paper.name, paper.make.func, paper.pure) == ("paper", fit_paper_functions, True)
    assert paper.basis.method.search == "genetic"
    assert known["kernel"].basis is None
    assert known["bouc-wen:paper"].basis.method == "paper"
    assert known["bouc-wen:paper"].way.endswith("method paper")
    assert [r.name for r in recipes.recipes(("dahl", "ali-type"))] == ["dahl", "ali-type"]
    genetic = {"bouc-wen:paper", "bouc-wen:direct-genetic"}
    assert not genetic & {r.name for r in recipes.recipes()}
    assert genetic <= {r.name for r in recipes.recipes(genetic=True)}
    with pytest.raises(UnknownNameError, match="dahl"):
        recipes.recipes(("dall",))
    assert [Basis("bingham").costly, Basis("spencer").costly, Basis("bouc-wen", "balance").costly] == [
        False,
        True,
        True,
    ]


def runs_with(k1, mass, frequencies):
    model = BoucWen.build(
        {"c": 900.0, "yield_force": 300.0, "yield_displacement": 3e-4, "f0": 0.0, "k1": k1, "m": mass}
    )
    return [
        synthetic_run(Condition(0.5, f, 0.02), cycles=2, samples_per_cycle=200, id=f"{f} Hz", model=model)
        for f in frequencies
    ]


def test_an_unknown_gas_spring_is_told_from_the_mass_by_the_frequencies():
    assumptions = PaperAssumptions.of(runs_with(1400.0, 12.0, (0.5, 1.0, 2.0)), None)
    assert dict(assumptions.fixed)["k1"] == pytest.approx(1400.0, rel=0.01)
    assert (dict(assumptions.fixed)["k2"], dict(assumptions.fixed)["k3"], assumptions.free) == (0.0, 0.0, ("m",))
    assert "m = 12" in assumptions.notes[0] or "m = 11.9" in assumptions.notes[0]
    alone = PaperAssumptions.of(runs_with(1400.0, 12.0, (1.0,)), None)
    assert (alone.gas, alone.fixed, alone.free) == (None, (), ())
    assert "k1 holds k1 − m ω²" in alone.notes[0]
    basis = assumptions.preset((("n", 3.0),)).basis("balance")
    assert basis == Basis("bouc-wen", "balance", ("m",), (*assumptions.fixed, ("n", 3.0)), None)


def test_a_gas_spring_that_is_known_must_leave_volume():
    runs = runs_with(0.0, 0.0, (1.0,))
    gas = GasSpring(1.5e6, 1.5e-4, 3e-4)
    assert PaperAssumptions.of(runs, gas) == PaperAssumptions(gas)
    with pytest.raises(InputError, match="gas volume"):
        PaperAssumptions.of(runs, GasSpring(1.5e6, 5e-6, 3e-4))
    # 30 mm of gas: room for ±20 mm, none for ±40.
    short = GasSpring(1.5e6, 9e-6, 3e-4)
    assert PaperAssumptions.of(runs, short).gas is short
    wide = synthetic_run(Condition(0.5, 1.0, 0.04), cycles=2, samples_per_cycle=200)
    for train in ([*runs, wide], [wide, *runs]):
        with pytest.raises(InputError, match="gas volume"):
            PaperAssumptions.of(train, short)


def test_the_numbers_of_a_way_are_counted():
    function = SimpleNamespace(function=SimpleNamespace(coefficients=(1.0, 2.0, 3.0), rates=(4.0,)))
    short = SimpleNamespace(function=SimpleNamespace(coefficients=(1.0,), rates=()))
    scored = fit_and_score(
        REMEMBER, TRAIN, [SimpleNamespace(free=("c", "fy"), scores=SimpleNamespace(nrmse_pp=0.1))], HELD
    )
    assert (scored.parameters_per_run, scored.conditions_needed, scored.title) == (2, 3, "memory")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recipes, "ModifiedFit", SimpleNamespace)
        fitted = replace(scored, fit=SimpleNamespace(functions={"a": short, "b": function}))
        assert fitted.conditions_needed == 4
    assert fit_and_score(Recipe("memory", None, remember, "global fit"), TRAIN, [], HELD).title == "memory, global fit"
    assert fit_and_score(REMEMBER, TRAIN, [], HELD).parameters_per_run == 0
