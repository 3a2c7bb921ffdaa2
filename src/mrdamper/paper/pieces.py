"""What the study has to compute, in pieces that do not need each other: runs, searches, checks, sensitivities."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from mrdamper.data import Run
from mrdamper.errors import InputError
from mrdamper.identification import conclude
from mrdamper.identification.harmonic_balance import SineRecord
from mrdamper.identification.methods.balance import Balance
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper.assumptions import PaperAssumptions
from mrdamper.paper.direct_genetic import DirectGenetic
from mrdamper.paper.generation import GeneticSettings
from mrdamper.paper.options import PaperOptions
from mrdamper.paper.paper_method import Paper
from mrdamper.paper.recipes import CONSISTENT, DIRECT, JOINT, LITERAL, Steps
from mrdamper.paper.results import Ended, GeneticCheck
from mrdamper.paper.sensitivity import OneAtATime, Sobol, one_at_a_time, sobol
from mrdamper.study.parallel import Processes, identify_quickly, quickened
from mrdamper.study.recipe import Basis, IdentificationCache, Progress, Recipe, Scored, fit_and_score_all

SOBOL_SAMPLES = 512


@dataclass(frozen=True)
class OnRun:
    """Everything to be identified from one run.

    Attributes
    ----------
    run : Run
    whole, quick : tuple of Basis
        From all of it; from a few cycles, as costly ones.
    searched : tuple of Basis
        By genetic algorithms, of which is told when they assumptions.
    """

    run: Run
    whole: tuple[Basis, ...] = ()
    quick: tuple[Basis, ...] = ()
    searched: tuple[Basis, ...] = ()


@dataclass(frozen=True)
class FromRun:
    """Identifications of a run, and forces computed until a genetic search settled, by basis and run id."""

    found: IdentificationCache = field(default_factory=dict)
    to_settle: dict[tuple[Basis, str], int] = field(default_factory=dict)


def tasks(steps: Steps, costly: Steps, searches: Mapping[str, Basis], held_out: Sequence[Run]) -> list[OnRun]:
    """What every run has to be identified for; the literal and the consistent way from held-out runs too."""
    shown: Steps = [(recipe, held_out) for recipe, _ in steps if recipe.title in (LITERAL, CONSISTENT)]
    runs = {run.id: run for _, seen in (*steps, *costly, *shown) for run in seen}
    whole = _bases([*steps, *shown])
    quick = _bases([step for step in costly if step[0].title != DIRECT])
    searched = _bases([step for step in costly if step[0].title == DIRECT])
    for name, basis in searches.items():
        searched.setdefault(name, []).append(basis)
    found = [
        OnRun(run, *(tuple(side.get(name, ())) for side in (whole, quick, searched))) for name, run in runs.items()
    ]
    return sorted(found, key=lambda task: -len(task.quick))


def _bases(steps: Steps) -> dict[str, list[Basis]]:
    found: dict[str, list[Basis]] = {}
    for recipe, runs in steps:
        for run in runs:
            known = found.setdefault(run.id, [])
            if recipe.basis and recipe.basis not in known:
                known.append(recipe.basis)
    return found


def identified_from(task: OnRun, progress: Progress) -> FromRun:
    """Identify it all; what cannot be is left out."""
    run, made = task.run, FromRun()
    progress(f"run {run.id}", 0.0)
    for basis in task.quick:
        made.found[basis, run.id] = identify_quickly(basis, run)
    for basis in task.whole:
        begin = time.perf_counter()
        try:
            made.found[basis, run.id] = basis.identify(run), time.perf_counter() - begin
        except InputError as error:
            made.found[basis, run.id] = str(error), time.perf_counter() - begin
    for basis in task.searched:
        begin = time.perf_counter()
        try:
            method, seen = quickened(basis, run)
            assert isinstance(method, Paper | DirectGenetic)
            minimum = method.genetic_search(seen)
            one = conclude(basis.problem(run), method, method.solution(seen, minimum))
            made.found[basis, run.id] = one, time.perf_counter() - begin
            made.to_settle[basis, run.id] = minimum.to_settle
        except InputError as error:
            made.found[basis, run.id] = str(error), time.perf_counter() - begin
    return made


def followed(
    steps: Steps, held_out: Sequence[Run], found: IdentificationCache, processes: Processes, progress: Progress
) -> tuple[list[Scored], dict[str, str]]:
    """`fit_and_score_all` from what is identified already, a recipe a piece; the joint fit takes longest."""
    order = sorted(steps, key=lambda step: step[0].title != JOINT)
    pieces = [
        (recipe, runs, {(b, run.id): found[b, run.id] for run in runs if (b := recipe.basis) and (b, run.id) in found})
        for recipe, runs in order
    ]
    done = processes.map(partial(_follow, held_out), pieces, progress)
    scored = {one.recipe.title: one for part, _ in done for one in part}
    refused = {name: why for _, part in done for name, why in part.items()}
    return [scored[recipe.title] for recipe, _ in steps if recipe.title in scored], refused


def _follow(
    held_out: Sequence[Run], piece: tuple[Recipe, Sequence[Run], IdentificationCache], progress: Progress
) -> tuple[list[Scored], dict[str, str]]:
    recipe, runs, found = piece
    return fit_and_score_all([(recipe, runs)], held_out, progress, leave_out=False, found=found)


def searches_of(train: Sequence[Run], assumptions: PaperAssumptions, options: PaperOptions) -> dict[str, Basis]:
    """The genetic search for alpha and beta on every train run, each with a seed of its own."""
    return {
        run.id: assumptions.basis(Paper(bounds=options.bounds, genetic=GeneticSettings(seed=seed), explain=False))
        for seed, run in enumerate(train)
    }


def ended(searches: Mapping[str, Basis], optimum: Basis | None, made: FromRun) -> tuple[Ended, ...]:
    """Where the searches ended, over the optimum of the same runs."""
    ends = []
    for run_id, basis in searches.items():
        one, seconds = made.found[basis, run_id]
        best, _ = made.found[optimum, run_id] if optimum else ("", 0.0)
        if isinstance(one, str) or isinstance(best, str) or one.seed is None:
            continue
        if (
            min(getattr(best.model, name) for name in ("alpha", "beta")) <= 0
        ):  # the box ends the optimum itself: nothing to be over
            continue
        a, b = (getattr(one.model, name) / getattr(best.model, name) for name in ("alpha", "beta"))
        error = one.scores.nrmse_pp / best.scores.nrmse_pp
        to_settle = made.to_settle[basis, run_id]
        ends.append(Ended(run_id, one.seed, float(a), float(b), float(error), one.evaluations, to_settle, seconds))
    return tuple(ends)


def of_different_force(train: Sequence[Run]) -> list[tuple[int, Run]]:
    """Two runs, a weak and a strong one, and a seed for each."""
    ordered = sorted(train, key=lambda run: float(np.ptp(run.force)))
    picks = dict.fromkeys(int(share * (len(ordered) - 1)) for share in (0.3, 0.7))
    return list(enumerate(ordered[i] for i in picks))


def genetic_check(
    assumptions: PaperAssumptions, options: PaperOptions, pick: tuple[int, Run], progress: Progress
) -> GeneticCheck:
    """The genetic search with the paper's settings on a run."""
    seed, run = pick
    progress(f"genetic search, {run.id}", 0.0)
    method = Paper(genetic=GeneticSettings(seed=seed), bounds=options.bounds, explain=False)
    problem, begin = assumptions.basis(method).problem(run), time.perf_counter()
    found = method.genetic_search(problem)
    seconds = time.perf_counter() - begin
    best = assumptions.basis(replace(method, search="optimum")).identify(run)
    ends = np.array([found.point, [getattr(best.model, name) for name in ("alpha", "beta")]])
    reached, optimum = method.cost(problem)(ends)
    return GeneticCheck(best.condition, found, float(reached), float(optimum), seconds)


def sensitivities(
    assumptions: PaperAssumptions, train: Sequence[Run], progress: Progress
) -> tuple[tuple[OneAtATime, ...], Sobol | None, tuple[str, ...]]:
    """At the run in the middle of the train runs, as the consistent way identifies it; and why there are none."""
    progress("sensitivity", 0.0)
    conditions = {run.id: SineRecord.of(run).condition for run in train}
    middle = sorted(train, key=lambda r: conditions[r.id].current_A * conditions[r.id].peak_velocity)[len(train) // 2]
    try:
        found = assumptions.basis(Balance()).identify(middle)
        assert isinstance(found.model, BoucWen)
        single = one_at_a_time(found.model, found.condition)
        return single, sobol(found.model, found.condition, samples=SOBOL_SAMPLES), ()
    except InputError as error:
        return (), None, (f"sensitivity was left out: {error}",)
