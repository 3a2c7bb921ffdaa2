"""The study of Qian et al. 2024, step by step, on the virtual rig or on a dataset.

Identify every identification run by the paper's method and by its consistent counterpart, turn the parameters into the
paper's functions, predict the validation runs, and compare. None of the authors' data or table values are used; the
data of the virtual rig are synthetic.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from mrdamper.data import Dataset, Run
from mrdamper.data.progress import Progress, silent
from mrdamper.errors import IdentificationError, InputError, validate_arguments
from mrdamper.identification import conclude
from mrdamper.identification.basis import Basis
from mrdamper.identification.harmonic_balance import SineRecord, read_force
from mrdamper.identification.loop_analysis import analyse_loop
from mrdamper.identification.methods.balance import Balance
from mrdamper.models import model_type
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper.assumptions import PaperAssumptions, missing_functions, outside_paper_range
from mrdamper.paper.claims import check_claims
from mrdamper.paper.direct_genetic import DirectGenetic
from mrdamper.paper.genetic import GeneticSettings
from mrdamper.paper.options import CONSISTENT, DIRECT, HALF, JOINT, LITERAL, PaperOptions
from mrdamper.paper.paper_method import Paper
from mrdamper.paper.recipes import Steps, comparators, literature, recipes_of_paper
from mrdamper.paper.results import GeneticCheck, GeneticEnd, Reproduction
from mrdamper.paper.sensitivity import OneAtATime, Sobol, one_at_a_time, sobol
from mrdamper.paper.virtual_rig import CURRENTS, VirtualRig, friction_test, virtual_dataset
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.study.parallel import follow_each, identify_quickly, shortened_method
from mrdamper.study.processes import IN_PROCESS, Processes
from mrdamper.study.recipe import IdentificationCache, RecipeResult, fit_and_score_all
from mrdamper.study.usable_runs import usable_sines

SOBOL_SAMPLES = 512
SEED_CURRENTS, _SEED_CYCLES = (0.0, 0.5, 1.0, 1.5, 2.0), 2  # [A], cycles per run: tests of each noise seed
_MAX_SLOW_SPEED = 1e-4  # mean speed below which a test is quasi-static [m/s]
_NO_CURRENT = 0.02  # largest current of a test without current [A]
_SENSITIVITY, _CHECK, _SEED, _RUN = 3.0, 1.5, 1.2, 0.5  # relative durations of the tasks, for the time left


@validate_arguments()
def reproduce(
    dataset: Dataset | None = None,
    options: PaperOptions | None = None,
    *,
    with_comparators: bool = True,
    with_models: bool = False,
    seeds: int = 0,
    processes: Processes = IN_PROCESS,
    progress: Progress = silent,
) -> Reproduction:
    """Run the study.

    Parameters
    ----------
    dataset : Dataset, optional
        One rig with train and validate runs. Default: the virtual rig, synthetic.
    options : PaperOptions, optional
        Gas spring of the dataset's rig, presets, and choices that the paper's text leaves open.
    with_comparators : bool
        The paper's own comparators: all parameters by the genetic algorithm, and Ali's model.
    with_models : bool
        Also the other models of the literature, over the same conditions.
    seeds : int
        Noise seeds of the virtual rig over which validation errors and verdicts are repeated.
    processes : Processes
        Processes for independent tasks; any number gives the same bits.
    progress : callable
        Called with the name of the step and the share done.

    Raises
    ------
    IdentificationError
        If the data hold no sine runs to identify from, or allow no method at all.

    Examples
    --------
    >>> from mrdamper import reproduce
    >>> reproduction = reproduce()  # doctest: +SKIP
    """
    begin = time.perf_counter()
    chosen = options or PaperOptions()
    progress("tests", 0.0)
    rig = VirtualRig() if dataset is None else None
    gas = rig.gas if rig else chosen.gas
    study = _tests(virtual_dataset(rig, CURRENTS) if dataset is None else dataset, rig, gas, chosen)
    train, held_out = study.train, study.held_out
    assumptions = PaperAssumptions.of(train, gas).preset(chosen.fixed)
    steps = [*recipes_of_paper(train, held_out, assumptions, chosen), *(literature(train) if with_models else ())]
    searches: dict[str, Basis] = {}
    if with_comparators:
        steps += comparators(train, held_out, assumptions)
        settings = [GeneticSettings(seed=n) for n in range(len(train))]
        methods = [Paper(bounds=chosen.bounds, genetic=each, explain=False) for each in settings]
        searches = {run.id: assumptions.basis(method) for run, method in zip(train, methods, strict=True)}
    work = [(_SENSITIVITY, partial(_sensitivities, assumptions, train))]
    work += [(_CHECK, partial(_genetic_check, assumptions, chosen, *pick)) for pick in _weak_and_strong(train)]
    work += [(_SEED, partial(_one_seed, rig, chosen, n)) for n in range(1, seeds + 1) if rig]
    work += [(_RUN, partial(_identify_all, *task)) for task in _tasks(steps, searches, study)]
    done = processes.map(_do, work, lambda what, share: progress(what, 0.02 + 0.88 * share), [w for w, _ in work])
    cache = _Identified.joined([part for part in done if isinstance(part, _Identified)])
    contenders, refused = _fit_all(
        steps, held_out, cache.runs, processes, lambda what, share: progress(what, 0.9 + 0.1 * share)
    )
    if not contenders:
        name, why = next(iter(refused.items()))
        raise IdentificationError(f"no method could be followed; {name}: {why}", where=study.dataset.name)
    bases = {recipe.title: recipe.basis for recipe, _ in steps}
    compared = [(title, basis) for title in (LITERAL, CONSISTENT) if (basis := bases[title])]
    one_by_one, indices, left_out = done[0]
    progress("reproduced", 1.0)
    return replace(
        study,
        contenders=tuple(contenders),
        there={(title, run.id): cache.runs[basis, run.id][0] for title, basis in compared for run in held_out},
        genetic=tuple(part for part in done if isinstance(part, GeneticCheck)),
        ended=_genetic_ends(searches, bases[LITERAL], cache),
        direct={run: n for (basis, run), n in cache.to_settle.items() if basis == bases.get(DIRECT)},
        **_over_seeds([part for part in done if isinstance(part, _Seed)]),
        sensitivity=one_by_one,
        sobol=indices,
        notes=(
            *study.notes,
            *assumptions.notes,
            *_range_notes(train),
            *(f"left out: {name}: {why}" for name, why in refused.items()),
            *left_out,
        ),
        seconds=time.perf_counter() - begin,
    )


def _over_seeds(seeds: Sequence[_Seed]) -> dict[str, Any]:
    if not seeds:
        return {}
    return {
        "seed_errors": {title: np.array([seed.errors[title] for seed in seeds]) for title in seeds[0].errors},
        "seed_verdicts": {key: tuple(seed.verdicts[key] for seed in seeds) for key in seeds[0].verdicts},
    }


def _tests(
    dataset: Dataset, rig: VirtualRig | None, gas: GasSpring | None, options: PaperOptions, seed: int = 0
) -> Reproduction:
    """Return the study with the tests alone: pure sines, slow test, loops, first harmonics of the force."""
    sines, refused = usable_sines(dataset)
    pure = []
    for run in sines:
        try:
            SineRecord.of(run)
            pure.append(run)
        except InputError as error:
            refused[run.id] = str(error)
    train, held_out = (tuple(run for run in pure if run.split == split) for split in ("train", "validate"))
    if not train:
        raise IdentificationError(
            "no identification run with a steady sine",
            where=dataset.name,
            remedy="mark some in the split column of runs.csv",
        )
    if not held_out:
        refused["every prediction"] = "no validate run with a steady sine; mark some in the split column of runs.csv"
    return Reproduction(
        dataset, rig, gas, train, held_out,
        friction=friction_test(rig, seed, filled=options.friction_test == "filled") if rig else _slow_test(dataset),
        loops=tuple(analyse_loop(run) for run in (*train, *held_out)),
        readings=tuple(read_force(SineRecord.of(run)) for run in train),
        options=options,
        notes=tuple(f"not used: {name}: {why}" for name, why in refused.items()),
    )  # fmt: skip


def _slow_test(dataset: Dataset) -> Run | None:
    for run in dataset:
        travel = np.abs(np.diff(run.displacement[:: max(1, run.time.size // 2000)])).sum()
        speed = float(travel) / max(float(np.ptp(run.time)), 1e-9)
        if speed < _MAX_SLOW_SPEED and float(np.max(np.abs(run.current))) < _NO_CURRENT:
            return run
    return None


def _range_notes(train: Sequence[Run]) -> tuple[str, ...]:
    """List conditions outside the paper's range, and its functions that these tests do not determine."""
    missing = missing_functions([SineRecord.of(run).condition for run in train])
    return (
        *outside_paper_range(train),
        *(f"the tests do not determine the paper's function of {name}: a shorter one replaces it" for name in missing),
    )


def _do(task: tuple[float, Any], progress: Progress) -> Any:
    return task[1](progress)


@dataclass(frozen=True)
class _Identified:
    """Identifications, and forces computed until a genetic search settled, by basis and run id."""

    runs: IdentificationCache = field(default_factory=dict)
    to_settle: dict[tuple[Basis, str], int] = field(default_factory=dict)

    @classmethod
    def joined(cls, parts: Sequence[_Identified]) -> _Identified:
        return cls(
            {key: one for part in parts for key, one in part.runs.items()},
            {key: count for part in parts for key, count in part.to_settle.items()},
        )


def _tasks(steps: Steps, searches: Mapping[str, Basis], study: Reproduction) -> list[tuple[Run, list[Basis]]]:
    """List what to identify from every run, slow models first; validation runs by two methods, to compare."""
    there: Steps = [(recipe, study.held_out) for recipe, _ in steps if recipe.title in (LITERAL, CONSISTENT)]
    tasks: dict[str, tuple[Run, list[Basis]]] = {}
    for recipe, runs in (*steps, *there):
        for run in runs:
            _, bases = tasks.setdefault(run.id, (run, []))
            if recipe.basis and recipe.basis not in bases:
                bases.append(recipe.basis)
    for run_id, basis in searches.items():
        tasks[run_id][1].append(basis)
    return sorted(tasks.values(), key=lambda task: not any(model_type(b.model).integrated for b in task[1]))


def _identify_all(run: Run, bases: Sequence[Basis], progress: Progress) -> _Identified:
    """Identify every basis from a run; keep the reason where it is not possible."""
    progress(f"run {run.id}", 0.0)
    cache = _Identified()
    for basis in bases:
        key, begin = (basis, run.id), time.perf_counter()
        try:
            if model_type(basis.model).integrated:
                cache.runs[key] = identify_quickly(basis, run)
            elif basis.method == DirectGenetic.name or getattr(basis.method, "search", "") == "genetic":
                method, problem = shortened_method(basis, run)
                assert isinstance(method, Paper | DirectGenetic)
                minimum = method.genetic_search(problem)
                one = conclude(basis.problem(run), method, method.solution(problem, minimum))
                cache.runs[key] = one, time.perf_counter() - begin
                cache.to_settle[key] = minimum.to_settle
            else:
                cache.runs[key] = basis.identify(run), time.perf_counter() - begin
        except InputError as error:
            cache.runs[key] = str(error), time.perf_counter() - begin
    return cache


def _fit_all(
    steps: Steps, held_out: Sequence[Run], cache: IdentificationCache, processes: Processes, progress: Progress
) -> tuple[list[RecipeResult], dict[str, str]]:
    tasks = [(*step, held_out) for step in sorted(steps, key=lambda step: step[0].title != JOINT)]
    done = follow_each(tasks, cache, processes, progress, leave_out=False)
    scored = {one.recipe.title: one for one in done if isinstance(one, RecipeResult)}
    refused = {recipe.name: why for (recipe, *_), why in zip(tasks, done, strict=True) if isinstance(why, str)}
    return [scored[recipe.title] for recipe, _ in steps if recipe.title in scored], refused


def _genetic_ends(searches: Mapping[str, Basis], optimum: Basis | None, cache: _Identified) -> tuple[GeneticEnd, ...]:
    ends = []
    for run_id, basis in searches.items():
        (one, seconds), (best, _) = cache.runs[basis, run_id], cache.runs.get((optimum, run_id), ("", 0.0))  # type: ignore[arg-type]
        if isinstance(one, str) or isinstance(best, str) or one.seed is None:
            continue
        a, b = (getattr(best.model, name) for name in ("alpha", "beta"))
        if min(a, b) > 0:  # otherwise a bound of the box is the optimum: there is no ratio
            ratios = float(one.model.alpha / a), float(one.model.beta / b)  # type: ignore[attr-defined]
            error = float(one.scores.nrmse_pp / best.scores.nrmse_pp)
            count = cache.to_settle[basis, run_id]
            ends.append(GeneticEnd(run_id, one.seed, *ratios, error, one.evaluations, count, seconds))
    return tuple(ends)


def _weak_and_strong(train: Sequence[Run]) -> list[tuple[int, Run]]:
    ordered = sorted(train, key=lambda run: float(np.ptp(run.force)))
    places = dict.fromkeys(int(share * (len(ordered) - 1)) for share in (0.3, 0.7))
    return list(enumerate(ordered[i] for i in places))


def _genetic_check(
    assumptions: PaperAssumptions, options: PaperOptions, seed: int, run: Run, progress: Progress
) -> GeneticCheck:
    progress(f"genetic search, {run.id}", 0.0)
    method = Paper(genetic=GeneticSettings(seed=seed), bounds=options.bounds, explain=False)
    problem, begin = assumptions.basis(method).problem(run), time.perf_counter()
    minimum = method.genetic_search(problem)
    seconds = time.perf_counter() - begin
    best = assumptions.basis(replace(method, search="optimum")).identify(run)
    ends = np.array([minimum.point, [getattr(best.model, name) for name in ("alpha", "beta")]])
    reached, optimum = method.cost(problem)(ends)
    return GeneticCheck(best.condition, minimum, float(reached), float(optimum), seconds)


def _sensitivities(
    assumptions: PaperAssumptions, train: Sequence[Run], progress: Progress
) -> tuple[tuple[OneAtATime, ...], Sobol | None, tuple[str, ...]]:
    """Compute sensitivities at the middle identification run by the consistent method, or state why there are none."""
    progress("sensitivity", 0.0)
    conditions = {run.id: SineRecord.of(run).condition for run in train}
    middle = sorted(train, key=lambda r: conditions[r.id].current_A * conditions[r.id].peak_velocity)[len(train) // 2]
    try:
        one = assumptions.basis(Balance()).identify(middle)
        assert isinstance(one.model, BoucWen)
        return (one_at_a_time(one.model, one.condition), sobol(one.model, one.condition, samples=SOBOL_SAMPLES), ())
    except InputError as error:
        return (), None, (f"sensitivity was left out: {error}",)


@dataclass(frozen=True)
class _Seed:
    """Median validation nrmse_pp by method, and verdicts by claim, of one noise seed."""

    errors: Mapping[str, float]
    verdicts: Mapping[str, str]


def _one_seed(rig: VirtualRig, options: PaperOptions, seed: int, progress: Progress) -> _Seed:
    """Run the fast methods with one seed of noise, on every other current and two cycles per run.

    The joint fit, which takes as long as the others together, and the second definition of F0, which noise changes
    equally, are omitted.
    """
    progress(f"noise seed {seed}", 0.0)
    study = _tests(virtual_dataset(rig, SEED_CURRENTS, seed, _SEED_CYCLES), rig, rig.gas, options, seed)
    assumptions = PaperAssumptions.of(study.train, rig.gas).preset(options.fixed)
    steps = recipes_of_paper(study.train, study.held_out, assumptions, options, explain=False)
    quick = [step for step in steps if step[0].title not in (JOINT, HALF)]
    contenders, _ = fit_and_score_all(quick, study.held_out, leave_out=False)
    claims = check_claims(replace(study, contenders=tuple(contenders)))
    return _Seed({c.recipe.title: c.validation.median() for c in contenders}, {c.key: c.verdict for c in claims})
