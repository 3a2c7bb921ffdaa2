"""Recipes: procedures from the runs of one rig to a damper, and the scores of that damper.

A recipe states the individual fits and the procedure from these to one damper over all conditions. A study, a
comparison, the reproduction of the paper and the app use these recipes, so that one name has one meaning and all are
scored in the same way.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import ClassVar

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.choice import MODEL, identify_jointly
from mrdamper.dampers.fold_fits import FoldFits
from mrdamper.dampers.joint import JointFit
from mrdamper.dampers.modified import ModifiedFit, fit_modified, fit_modified_jointly
from mrdamper.dampers.published import Published, all_published
from mrdamper.data import Run
from mrdamper.data.encoding import finite
from mrdamper.data.progress import Progress, silent
from mrdamper.discovery import Registry
from mrdamper.errors import IdentificationError, InputError, UnknownNameError
from mrdamper.identification import Identification
from mrdamper.identification.basis import Basis
from mrdamper.identification.methods import values_of_fields
from mrdamper.models import Scale, all_models, model_type
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.physics.motion.sines import pure_sines
from mrdamper.study.cross_validation import all_folds, cross_validate, cross_validate_by_kind, stretches
from mrdamper.study.fit_result import FitResult
from mrdamper.study.validation import Validation, validate

STUDIED = ("bouc-wen", "bingham")  # the model of the method, and the usual reference
_GLOBAL_FIT, _CURRENT_LAWS = "global fit", "current laws"  # procedures in words
WHOLE_DAMPER = ("tanh", MODEL)  # models with one set of parameters for every current, which a study compares


IdentificationCache = dict[tuple[Basis, str], tuple[Identification | str, float]]  # or why there is none; seconds


@dataclass(frozen=True)
class Recipe:
    """Procedure from runs of one rig to a damper over all conditions."""

    name: str  # model, and procedure if there are several: "bouc-wen:joint"
    basis: Basis | None  # identification of single runs, if any
    # makes the damper from runs and their identifications
    make: Callable[[Sequence[Run], Sequence[Identification]], FitResult] = field(compare=False)
    way: str = ""  # in words: "individual fits", "global fit"
    title: str = ""  # label of the method in a reproduction; `RecipeResult.title` stands in tables
    source: str = ""  # where it was published
    limits: str = ""  # limitations
    pure: bool = False  # identified from pure sines only, and scored on every run
    on_request: bool = False  # takes most of the time of a comparison
    notes: tuple[str, ...] = ()  # note on the result
    complete: Callable[[Sequence[Run]], Recipe] | None = field(default=None, compare=False)  # from the runs of a rig

    def for_runs(self, sines: Sequence[Run]) -> Recipe:
        """Return the recipe for a rig from its pure sines; raises `InputError` if these do not allow it."""
        return self if self.complete is None else self.complete(sines)

    @property
    def model(self) -> str:
        """Name of its model."""
        return self.name.partition(":")[0]


@dataclass(frozen=True, eq=False)
class RecipeResult:
    """Damper of a recipe on one rig, and its scores."""

    recipe: Recipe
    damper: Damper
    fit: ModifiedFit | JointFit | None
    # individual fits of the identification runs; empty if there are none
    identifications: tuple[Identification, ...]
    per_run: float  # median nrmse_pp of individual fits; NaN without
    # train, cross_validated and validation: identification runs; the same cross-validated by condition; validation runs
    train: Validation
    cross_validated: Validation
    validation: Validation
    seconds: float  # spent on identification and the fit over conditions
    # train runs predicted without their fold, by kind of fold (`cross_validation.folds_by_kind`)
    by_kind: Mapping[str, Validation] = field(default_factory=dict[str, Validation])
    # lowest and highest value of a constant parameter over leave-one-condition-out fits
    spread: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])

    @property
    def title(self) -> str:
        """Damper and procedure, for tables."""
        return f"{self.damper.title}, {self.recipe.way}" if self.recipe.way else self.damper.title

    @property
    def errors(self) -> dict[str, float | None]:
        """Median and largest nrmse_pp by the columns of tables; None where there are no runs."""
        errors = {"per_run": self.per_run, "train": self.train.median()}
        for name, scores in (("cv", self.cross_validated), ("validation", self.validation)):
            errors |= {name: scores.median(), f"{name}_worst": scores.worst_error()}
        return {f"{name}_nrmse_pp": finite(error) for name, error in errors.items()}

    @property
    def parameters_per_run(self) -> int:
        """Parameters determined from a single run."""
        return len(self.identifications[0].free) if self.identifications else 0

    @property
    def conditions_needed(self) -> int:
        """Number of conditions for the coefficients of the longest function; a global fit needs currents instead."""
        if not isinstance(self.fit, ModifiedFit):
            return 3
        return max(len(f.function.coefficients) + len(f.function.rates) for f in self.fit.functions.values())


def fit_and_score(
    recipe: Recipe,
    train: Sequence[Run],
    identifications: Sequence[Identification],
    held_out: Sequence[Run],
    *,
    spent: float = 0.0,
    leave_out: bool = True,
    kinds: bool = False,
) -> RecipeResult:
    """Identify a recipe's damper and score it.

    The damper is identified from `train`, runs of one rig, whose identifications `identified` gives for the recipe's
    basis in `spent` seconds. The held-out runs are predicted only. `leave_out`: predict every identification run
    without its condition, too; `kinds`: and without its current, the fastest motions, its session and other records.
    Raises `InputError` if the damper cannot be determined from these runs.
    """
    begin = time.perf_counter()
    pieces = [piece for run in train for piece in stretches(run)] if recipe.basis is None else list(train)
    result = recipe.make(pieces, identifications)
    seconds = spent + time.perf_counter() - begin
    title, without = result.damper.title, list[Damper]()

    def refit(rows: Sequence[int]) -> Damper:
        without.append(result.refit(rows))
        return without[-1]

    errors = [i.scores.nrmse_pp for i in identifications]
    return RecipeResult(
        recipe=recipe,
        damper=result.damper,
        fit=result.fit,
        identifications=tuple(identifications),
        per_run=float(np.median(errors)) if errors else float("nan"),
        train=validate(result.damper, train),
        cross_validated=cross_validate(pieces, refit, title) if leave_out else Validation(title, ()),
        validation=validate(result.damper, held_out),
        seconds=seconds,
        by_kind=cross_validate_by_kind(pieces, result.refit, title) if kinds else {},
        spread=_spread(without),
    )


def _spread(dampers: Sequence[Damper]) -> dict[str, tuple[float, float]]:
    """Lowest and highest value of every parameter of dampers with one model."""
    values = [model.values() for damper in dampers if (model := damper.one_model) is not None]
    return {name: (min(v[name] for v in values), max(v[name] for v in values)) for name in (values or [{}])[0]}


def fit_and_score_all(
    steps: Sequence[tuple[Recipe, Sequence[Run]]],
    held_out: Sequence[Run],
    progress: Progress = silent,
    *,
    leave_out: bool = True,
    kinds: bool = False,
    cache: IdentificationCache | None = None,
) -> tuple[list[RecipeResult], dict[str, str]]:
    """Follow several recipes, each with its identification runs, on one rig; shared individual fits are made once.

    `cache` holds existing identifications, to which new ones are added; the other arguments are those of
    `fit_and_score`. Returns the results, and by name the reasons why a damper cannot be determined from these runs.
    """
    cache = {} if cache is None else cache
    scored, refused = list[RecipeResult](), dict[str, str]()
    for number, (recipe, runs) in enumerate(steps):

        def tell(what: str, share: float, number: int = number, recipe: Recipe = recipe) -> None:
            progress(f"{recipe.name}, {what}", (number + share) / len(steps))

        try:
            followed = pure_sines(runs) if recipe.pure else runs
            identifications, spent = identified(
                recipe.basis, followed, cache, lambda what, share: tell(what, 0.5 * share)
            )
            tell("over all conditions", 0.5)
            scored.append(
                fit_and_score(recipe, runs, identifications, held_out, spent=spent, leave_out=leave_out, kinds=kinds)
            )
        except InputError as error:
            refused[recipe.name] = str(error)
    return scored, refused


def identified(
    basis: Basis | None, runs: Sequence[Run], cache: IdentificationCache, progress: Progress = silent
) -> tuple[list[Identification], float]:
    """Identifications of runs, made if missing, and their time [s]; raises `IdentificationError` if one is refused."""
    if basis is None:
        return [], 0.0
    identifications: list[Identification] = []
    spent = 0.0
    for number, run in enumerate(runs):
        if (basis, run.id) not in cache:
            progress(f"run {run.id}", number / len(runs))
            begin = time.perf_counter()
            cache[basis, run.id] = basis.identify(run), time.perf_counter() - begin
        one, seconds = cache[basis, run.id]
        if isinstance(one, str):
            raise IdentificationError(f"run {run.id}: {one}")
        identifications.append(one)
        spent += seconds
    return identifications, spent


def fit_per_run(runs: Sequence[Run], identifications: Sequence[Identification]) -> FitResult:
    """Parameter functions fitted to individual fits."""
    about = _about(runs, identifications, "individual fits")
    fit = fit_modified(identifications, provenance=about)
    return FitResult(fit.damper, lambda rows: fit_modified([identifications[i] for i in rows]).damper, fit)


def fit_functions_jointly(
    runs: Sequence[Run], identifications: Sequence[Identification], way: str = _GLOBAL_FIT
) -> FitResult:
    """Parameter functions, or those of the current alone, fitted to the forces of all runs at once."""
    about = _about(runs, identifications, way)
    fit, refit = fit_modified_jointly(runs, identifications, about, any_motion=way != _CURRENT_LAWS)
    return FitResult(fit.damper, refit, fit)


def fit_whole_damper(model: str, runs: Sequence[Run], identifications: Sequence[Identification]) -> FitResult:
    """One set of parameters for every condition, of a model that takes the current as an input."""
    choice = identify_jointly(runs, model)
    without = FoldFits(choice.problem, all_folds(runs), choice.searched)
    return FitResult(choice.fit.damper, lambda rows: without.refit(rows).damper, choice.fit)


def fit_published(cls: Published, runs: Sequence[Run], identifications: Sequence[Identification]) -> FitResult:
    """Return the functions of a published damper, from individual fits and refined on all runs."""
    about = {"identification runs": str(len(runs))}

    def refit(rows: Sequence[int]) -> Damper:
        return cls.fit([runs[i] for i in rows], [identifications[i] for i in rows] if cls.basis else [], about)

    return FitResult(refit(range(len(runs))), refit)


def modified(name: str, method: str = "projection") -> Recipe:
    """Return a model with parameter functions fitted to individual fits."""
    cls = model_type(name)
    stepped = "stepped, not closed; " if cls.integrated else ""
    plain = method == "projection"
    return Recipe(
        name if plain else f"{name}:{method}",
        Basis(name, method),
        fit_per_run,
        "individual fits" if plain else f"individual fits, method {method}",
        cls.title,
        cls.source,
        f"{stepped}parameter functions need the frequency and amplitude of a sine",
    )


def jointly(name: str) -> Recipe:
    """Return a model whose parameter functions are fitted to all forces at once."""
    return replace(modified(name), name=f"{name}:joint", make=fit_functions_jointly, way=_GLOBAL_FIT)


def current_only(name: str) -> Recipe:
    """Return a model whose parameters follow the current alone, fitted to all forces at once."""
    make, limits = partial(fit_functions_jointly, way=_CURRENT_LAWS), "the same at any motion"
    return replace(modified(name), name=f"{name}:current", make=make, way=_CURRENT_LAWS, limits=limits)


def whole_damper(name: str) -> Recipe:
    """Return a model with one set of parameters for every condition."""
    cls, limits = model_type(name), "takes any motion and a current that varies"
    return Recipe(name, None, partial(fit_whole_damper, name), _GLOBAL_FIT, cls.title, cls.source, limits)


def conditioned(cls: Published) -> Recipe:
    """Return a published damper with its own laws over current, frequency and amplitude."""
    basis = Basis(cls.basis, free=cls.basis_free) if cls.basis else None
    return Recipe(cls.name, basis, partial(fit_published, cls), "", cls.heading, cls.source, cls.limits)


class StudyMethod(ABC):
    """A published method that a study can follow, with its name for `study --model`, and its options as fields."""

    name: ClassVar[str]

    @abstractmethod
    def recipe(self, train: Sequence[Run]) -> Recipe:
        """Make the recipe for the sine runs of one rig; raises `InputError` if these runs do not allow the method."""

    def beside_others(self) -> StudyMethod:
        """Return the method with reduced effort for a comparison."""
        return self

    def compared(self) -> Sequence[Recipe]:
        """Further recipes for a comparison of models."""
        return ()


_study_methods: Registry[StudyMethod] = Registry("mrdamper.studies", StudyMethod, "study method")  # type: ignore[type-abstract]
study_methods = _study_methods.all


def study_method(name: str, settings: Mapping[str, str] | None = None, gas: GasSpring | None = None) -> StudyMethod:
    """Return the study method of a name with its options from text, and with a known gas spring of the damper.

    Raises `UnknownNameError` if there is no such method, option or value; with the near matches.
    """
    chosen = _study_methods.type_named(name)
    values = values_of_fields(chosen, settings or {})
    return chosen(**values, **({} if gas is None else {"gas": gas}))


def catalogue(method: StudyMethod | None = None) -> Mapping[str, Recipe]:
    """Every recipe that can be compared, by name, including those of added models and dampers.

    `method` is a published method with options, in place of its own defaults.
    """
    all_recipes = [whole_damper(n) if cls.current_levels else modified(n) for n, cls in all_models().items()]
    all_recipes += [jointly(name) for name in _closed_shapes()]
    all_recipes += [current_only(name) for name in STUDIED]
    methods = {name: cls() for name, cls in study_methods().items()} | ({method.name: method} if method else {})
    all_recipes += [recipe for one in methods.values() for recipe in one.compared()]
    all_recipes += [conditioned(cls) for cls in all_published().values()]
    return {recipe.name: recipe for recipe in all_recipes}


def recipes(names: Sequence[str] = (), genetic: bool = False, method: StudyMethod | None = None) -> list[Recipe]:
    """Recipes of some names, or all; raises `UnknownNameError` with the near matches.

    Those by genetic algorithms, which take most of the time, are included if `genetic`: of the named models, where some
    are named. `method` is a published method with options, in place of its own defaults. Raises `InputError` (E_OPTION)
    if the named models have no genetic search, or do not follow that method.
    """
    by_name = catalogue(method)
    for name in names:
        if name not in by_name:
            raise UnknownNameError.of("model", name, by_name)
    if genetic and names:
        models = {by_name[name].model for name in names}
        searches = [name for name, recipe in by_name.items() if recipe.on_request and recipe.model in models]
        if not searches:
            there = ", ".join(dict.fromkeys(recipe.model for recipe in by_name.values() if recipe.on_request))
            remedy = f"the models with one: {there}; compare these, too, or omit --genetic"
            raise InputError(f"no genetic search of {', '.join(names)}", remedy=remedy, code="E_OPTION")
        names = [*names, *searches]
    if method is not None and names and method.name not in names:
        remedy = f"compare the model {method.name}, too, or omit the options"
        raise InputError(f"options of the model {method.name}, which is not compared", remedy=remedy, code="E_OPTION")
    return [by_name[name] for name in (names or by_name) if names or genetic or not by_name[name].on_request]


INDIVIDUAL = ":individual"  # end of the name of a model's individual fits alone


def recipes_of_models(names: Sequence[str]) -> list[str]:
    """Return the names of all recipes of some models, as a study follows them; the name of a recipe is kept.

    The individual fits alone of a model with other ways are called "bouc-wen:individual".
    """
    by_name = catalogue()
    chosen = [
        [r.name for r in by_name.values() if name == r.name or (name == r.model and not r.on_request)]
        or [name.removesuffix(INDIVIDUAL)]
        for name in names
    ]
    return list(dict.fromkeys(name for some in chosen for name in some))


def recipes_of_study(
    train: Sequence[Run], everything: Sequence[Run], method: StudyMethod | None, model: str | None
) -> list[tuple[Recipe, Sequence[Run]]]:
    """Return the recipes of a study, and the runs each is followed on: sines run by run, everything at once.

    With fewer than two sines, laws of the current alone are fitted to the records of constant current.
    """
    pure = pure_sines(train)
    if method is not None:
        return [(method.recipe(pure), train), *((modified(name), train) for name in STUDIED)]
    steps: list[tuple[Recipe, Sequence[Run]]] = []
    named = [
        recipe for name, recipe in catalogue().items()
        if name not in WHOLE_DAMPER and (model == name or (model == recipe.model and not recipe.on_request))
    ]  # fmt: skip
    if len(train) > 1:
        steps += [(make(name), train) for name in STUDIED for make in (modified, jointly, current_only)]
        there = {recipe.name for recipe, _ in steps}
        steps += [(recipe, train) for recipe in named if recipe.basis is not None and recipe.name not in there]
    elif len(held := [run for run in everything if not run.current_changes]) > 1:
        steps += [(current_only(name), held) for name in STUDIED]
    if len(pure) > 2:
        steps += [(cls().beside_others().recipe(pure), train) for cls in study_methods().values()]
    steps += [(recipe, everything) for recipe in named if recipe.basis is None]
    return [*steps, *((whole_damper(name), everything) for name in WHOLE_DAMPER)]


def _closed_shapes() -> list[str]:
    """Models whose loop has at most one shape coordinate, the yield displacement: all runs fit at once."""
    shapes = {
        name: [
            axis.name for axis in cls.search_axes(Scale(1.0, 1.0), [i.name for i in cls.parameters() if not i.preset])
        ]
        for name, cls in all_models().items()
        if not cls.current_levels
    }
    return [name for name, axes in shapes.items() if axes in ([], ["yield_displacement"])]


def _about(runs: Sequence[Run], identifications: Sequence[Identification], functions: str) -> dict[str, str]:
    return {"method": identifications[0].method, "identification runs": str(len(runs)), "functions": functions}
