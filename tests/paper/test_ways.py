"""The ways of the paper: what its options mean, which runs each way takes, and which tests its functions need."""

from dataclasses import fields
from itertools import combinations
from types import SimpleNamespace
from typing import Literal, get_args, get_origin, get_type_hints

import numpy as np
import pytest

from mrdamper.data import Condition
from mrdamper.errors import IdentificationError, ParameterError, UnknownNameError
from mrdamper.identification.methods.balance import Balance
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper import assumptions, options, recipes
from mrdamper.paper.assumptions import PaperAssumptions
from mrdamper.paper.options import PaperOptions
from mrdamper.paper.paper_method import Paper

SET = PaperOptions(
    A=3.0, n=3.0, gamma=4.0, force_amplitude="maximum", phase="peaks", offset="mean", quadratic_stiffness="dropped",
    mass_law="power", search="optimum", generations=60, seed=5, alpha_box=(1.0, 3.0), beta_box=(2.0, 7.0),
)  # fmt: skip


def runs(*conditions):
    """Stand-ins of sine runs: the ways ask for their conditions only."""
    return [SimpleNamespace(condition=Condition(*c)) for c in conditions]


@pytest.fixture
def asking(monkeypatch):
    monkeypatch.setattr(recipes, "SineRecord", SimpleNamespace(of=lambda run: run))
    monkeypatch.setattr(assumptions, "analyse_motion", lambda run: run)


def test_a_preset_A_changes_the_parameters_and_no_force():
    """z' = A v − beta |v| |z|^(n−1) z − gamma v |z|^n and alpha z, of z scaled by A."""
    alpha, beta, gamma = 5e3, 40.0, 30.0
    scaled = {name: SET.scaled(name, value) for name, value in (("alpha", alpha), ("beta", beta), ("gamma", gamma))}
    for v in (-0.3, 0.2):
        for z in (-0.25, 0.1):
            rate = v - beta * abs(v) * z**2 * z - gamma * v * abs(z) ** 3
            Z = SET.A * z
            Rate = SET.A * v - scaled["beta"] * abs(v) * Z**2 * Z - scaled["gamma"] * v * abs(Z) ** 3
            assert pytest.approx(SET.A * rate) == Rate
            assert scaled["alpha"] * Z == pytest.approx(alpha * z)
    assert SET.scaled("c", 900.0) == 900.0
    ends = [[SET.scaled(name, end) for end in box] for name, box in zip(("alpha", "beta"), SET.bounds, strict=True)]
    assert ends == [pytest.approx([1.0, 3.0]), pytest.approx([2.0, 7.0])]  # as the boxes were stated


def test_options_reach_the_identification_of_single_runs():
    method = SET.method()
    shared = {f.name for f in fields(Paper)} & {f.name for f in fields(PaperOptions)}
    assert {"force_amplitude", "phase", "offset", "quadratic_stiffness", "search"} <= shared
    assert all(getattr(method, name) == getattr(SET, name) for name in shared)
    assert (method.genetic.generations, method.genetic.seed, method.bounds) == (60, 5, SET.bounds)
    assert SET.method("genetic").search == "genetic"
    assert (SET.fixed, PaperOptions().fixed) == ((("n", 3.0), ("gamma", 4.0)), ())
    assert SET.beside_others().search == "optimum"
    assert (PaperOptions().beside_others().search, SET.beside_others().functions) == ("optimum", "shorter")


@pytest.mark.parametrize(
    ("name", "inside", "outside"),
    [
        ("A", (1e-3, 1e3), (0.0, -1.0, np.inf, np.nan)),
        ("n", (1.0, 10.0), (0.99, 10.01, np.nan)),
        ("gamma", (None, 0.0, 1e9), (-1e-3, np.inf, np.nan)),
        ("alpha_box", ((0.0, 1e-3), (1.0, 1e9)), ((-1.0, 1.0), (1.0, 1.0), (2.0, 1.0), (0.0, np.inf))),
        ("beta_box", ((0.0, 1e-3), (1.0, 1e9)), ((-1.0, 1.0), (1.0, 1.0), (2.0, 1.0), (0.0, np.inf))),
    ],
)
def test_options_outside_their_range_are_refused_by_name(name, inside, outside):
    for value in inside:
        assert getattr(PaperOptions(**{name: value}), name) == value
    for value in outside:
        with pytest.raises(ParameterError, match=name.partition("_")[0]):
            PaperOptions(**{name: value})


def test_every_reading_that_is_offered_is_taken_and_no_other():
    readings = {
        name: get_args(kind) for name, kind in get_type_hints(PaperOptions).items() if get_origin(kind) is Literal
    }
    assert {"force_amplitude", "phase", "offset", "mass_law", "functions", "friction_test", "search"} <= set(readings)
    for name, words in readings.items():
        assert [getattr(PaperOptions(**{name: word}), name) for word in words] == list(words)
        with pytest.raises(UnknownNameError, match=name.replace("_", " ")):
            PaperOptions(**{name: "none of these"})


def test_the_recipe_holds_the_presets_and_names_what_the_paper_did_not_test(asking, monkeypatch):
    gas = SimpleNamespace()
    monkeypatch.setattr(PaperAssumptions, "of", classmethod(lambda cls, train, given: cls(given, notes=("origin",))))
    matrix = runs(*((I, f, A) for I in (0.0, 1.0, 2.0) for f in (0.5, 1.0, 2.0) for A in (0.01, 0.02)))
    recipe = PaperOptions(gas=gas, n=3.0, mass_law="power").recipe(matrix)
    assert (recipe.name, recipe.pure, recipe.way, recipe.notes) == ("paper", True, options._WAY, ("origin",))
    assert recipe.make.func is options.fit_paper_functions
    assert recipe.make.keywords == {"mass_law": "power"}
    assert (recipe.basis.gas, recipe.basis.fixed, recipe.basis.model) == (gas, (("n", 3.0),), "bouc-wen")
    assert recipe.basis.method == PaperOptions(n=3.0).method()
    others, *searches = PaperOptions(gas=gas).compared()
    assert (recipe.title, recipe.source, recipe.limits) == (others.title, others.source, others.limits)
    assert [r.name for r in searches] == ["bouc-wen:paper", "bouc-wen:direct-genetic"]
    assert all(r.on_request for r in searches)
    few = runs((0.0, 1.0, 0.02), (0.5, 1.0, 0.02), (1.0, 1.0, 0.02))
    assert others.for_runs(few).basis.method.search == "optimum"  # and shorter functions: one frequency was tested
    with pytest.raises(IdentificationError, match="fewer than three"):
        others.for_runs(few[:2])
    with pytest.raises(IdentificationError) as refused:
        PaperOptions(gas=gas).recipe(few)
    assert refused.value.code == "E_PAPER_TESTS"
    assert "3 currents, 1 frequency, 1 amplitude:" in str(refused.value)


@pytest.mark.parametrize("sign", [1, -1])
def test_tests_beyond_the_papers_are_named_with_their_highest(asking, sign):
    def notes(current, frequency):
        return assumptions.outside_paper_range(
            runs((0.0, 0.5, 0.02), (sign * current, 1.0, 0.02), (1.0, frequency, 0.02))
        )

    assert notes(2.0, 2.0) == notes(2.09, 2.09) == ()  # a rig's repeatability
    (current,), (frequency,), (both,) = notes(2.2, 2.0), notes(2.0, 2.3), notes(2.2, 2.3)
    assert "currents up to 2.2 A" in current
    assert "Hz" not in current.partition("tested: ")[2].partition("(")[0]
    assert "frequencies up to 2.3 Hz" in frequency
    assert "currents" not in frequency
    assert "currents up to 2.2 A" in both
    assert "frequencies up to 2.3 Hz" in both


def test_a_function_is_missing_where_the_levels_it_takes_are():
    """By their count, whatever their order and the scatter of a rig about each."""
    matrix = [Condition(I, f, A) for I in (0.0, 1.0, 2.0) for f in (0.5, 1.0, 2.0) for A in (0.01, 0.02)]
    assert assumptions.missing_functions(matrix[::-1]) == ()

    def missing(kept):
        scattered = [Condition(c.current_A, c.frequency_Hz * s, c.amplitude_m / s) for c in kept for s in (1.0, 1.03)]
        names = [name.partition(" ")[0] for name in assumptions.missing_functions(scattered)]
        assert names == [name.partition(" ")[0] for name in assumptions.missing_functions(scattered[::-1])]
        return set(names)

    assert missing([c for c in matrix if c.current_A < 2]) == {"c", "m", "alpha", "beta"}
    assert missing([c for c in matrix if c.frequency_Hz < 2]) == {"m", "beta"}  # three products are left: 5, 10, 20
    assert missing([c for c in matrix if c.frequency_Hz == 1.0]) == {"c", "m", "alpha", "beta"}
    assert missing([c for c in matrix if c.amplitude_m == 0.01]) == {"alpha"}


def test_the_traditional_use_takes_the_nearest_speed_of_every_current(asking):
    matrix = runs(*((I, f, A) for I in (2.0, 0.0, 1.0) for f, A in ((1.0, 0.02), (0.5, 0.01), (2.0, 0.03))))
    for speed in (0.0, 0.12, 1.0):
        chosen = recipes.nearest_speed(matrix, speed)
        assert [run.condition.current_A for run in chosen] == [0.0, 1.0, 2.0]
        for run in chosen:
            same = [r.condition.peak_velocity for r in matrix if r.condition.current_A == run.condition.current_A]
            assert abs(run.condition.peak_velocity - speed) == min(abs(v - speed) for v in same)


def test_every_way_of_the_comparison_says_what_it_identifies_and_from_which_runs(asking):
    matrix = runs(*((I, f, 0.02) for I in (0.0, 1.0, 2.0) for f in (0.5, 1.0, 2.0)))
    held = runs((1.0, 1.8, 0.02), (1.0, 2.1, 0.02), (1.0, 1.9, 0.02))
    held_by = PaperAssumptions(None, fixed=(("k1", 1.0), *SET.fixed), free=("m",))
    steps = recipes.recipes_of_paper(matrix, held, held_by, SET, explain=True)
    ways = {recipe.title: (recipe, train) for recipe, train in steps}
    literal, half = ways[options.LITERAL][0], ways[options.HALF][0]
    assert (literal.basis.method.explain, half.basis.method.explain) == (True, False)
    assert (literal.basis.method.force_amplitude, half.basis.method.force_amplitude) == ("maximum", "half-peak-to-peak")
    assert literal.basis.method.search == "optimum"
    for title in (options.SAME_FORMS, options.CONSISTENT, options.TRADITIONAL, options.SLOWEST):
        assert ways[title][0].basis == held_by.basis(Balance())
    assert (ways[options.JOINT][0].basis.fixed, ways[options.JOINT][0].basis.free) == (SET.fixed, ())
    makers = {title: recipe.make for title, (recipe, _) in ways.items()}
    for title in (options.LITERAL, options.HALF, options.SAME_FORMS):
        assert (makers[title].func, makers[title].keywords) == (recipes.fit_paper_functions, {"mass_law": "power"})
    assert makers[options.CONSISTENT] is recipes.fit_chosen_functions
    assert makers[options.JOINT] is recipes.fit_functions_jointly
    assert makers[options.TRADITIONAL] is makers[options.SLOWEST] is recipes.one_per_current
    frequencies = {title: [run.condition.frequency_Hz for run in train] for title, (_, train) in ways.items()}
    assert (frequencies.pop(options.TRADITIONAL), frequencies.pop(options.SLOWEST)) == ([2.0] * 3, [0.5] * 3)
    assert all(train == [run.condition.frequency_Hz for run in matrix] for train in frequencies.values())
    groups = {recipe.title: recipe.way for recipe, _ in steps}
    assert set(groups.values()) == {"paper", "consistent", "joint", "traditional"}
    unheld = [recipe.title for recipe, _ in recipes.recipes_of_paper(matrix, [], held_by, SET, explain=False)]
    assert unheld == [title for title in ways if title != options.TRADITIONAL]


@pytest.mark.parametrize(("count", "kept"), [(5, [0, 1, 2, 3, 4]), (6, [0, 2, 4, 5]), (7, [0, 2, 4, 6])])
def test_the_costly_model_takes_every_other_current_of_a_large_matrix_and_the_highest(asking, count, kept):
    matrix = runs(*((float(I), f, 0.02) for f in (0.5, 2.0) for I in reversed(range(count))))
    (direct, nearest), (ali, some) = recipes.comparators(matrix, runs((1.0, 1.9, 0.02)), PaperAssumptions(None))
    assert sorted({run.condition.current_A for run in some}) == kept
    assert len(some) == 2 * len(kept)
    assert [run.condition.frequency_Hz for run in nearest] == [2.0] * count
    assert (direct.basis.method, direct.make, direct.title) == (
        "direct-genetic",
        recipes.one_per_current,
        options.DIRECT,
    )
    assert (ali.title, ali.way) == (options.ALI, "literature")
    typical = recipes.comparators(matrix, [], PaperAssumptions(None))[0][1]  # at the median speed of all runs
    middle = np.median([run.condition.peak_velocity for run in matrix])
    assert typical == recipes.nearest_speed(matrix, middle)


def test_models_of_the_literature_are_made_from_all_runs():
    matrix = runs((0.0, 1.0, 0.02))
    ways = recipes.literature(matrix)
    assert all(train is matrix and recipe.way == "literature" for recipe, train in ways)
    names = [recipe.name for recipe, _ in ways]
    assert {"bingham", "kwok", "play-bypass", "boada-type"} <= set(names)
    assert "ali-type" not in names


def test_one_model_a_current_is_that_of_the_nearest_current():
    models = [BoucWen.build({"c": c, "yield_force": 300.0, "yield_displacement": 3e-4}) for c in (1.0, 2.0, 3.0)]
    identifications = [
        SimpleNamespace(model=model, condition=Condition(I, f, 0.02), rig="bench", free=("c",))
        for model, I, f in zip(models, (0.0, 1.0, 3.0), (0.5, 2.0, 1.0), strict=True)
    ]
    damper = recipes.OnePerCurrent.of(identifications)
    for current, c in ((0.4, 1.0), (0.6, 2.0), (1.9, 2.0), (2.1, 3.0), (9.0, 3.0)):
        assert damper.model_at(Condition(current, 9.0, 0.01)).c == c
    assert damper.parameter_count == 3 * 5
    assert (damper.rig, damper.envelope.current_A, damper.envelope.frequency_Hz) == ("bench", (0.0, 3.0), (0.5, 2.0))
    for one, other in combinations(identifications, 2):
        assert recipes.OnePerCurrent.of([other, one]).model_at(Condition(0.0, 1.0, 0.02)).c == one.model.c


def test_what_is_held_is_constant_and_what_is_free_has_its_choice_of_forms(monkeypatch):
    monkeypatch.setattr(recipes, "fit_modified", lambda identifications, forms: forms)
    forms = recipes.chosen_functions([SimpleNamespace(free=("c", "k2")), SimpleNamespace(free=("alpha",))])
    choice = {**BoucWen.map_forms(), "k2": ("constant",), "m": ("constant", "quadratic-current")}
    assert set(forms) == set(choice)
    held = {field.name for field in fields(BoucWen)} - {"c", "k2"}
    assert {"k1", "m", "n"} <= held
    assert all(forms[name] == (("constant",) if name in held else choice[name]) for name in choice)
