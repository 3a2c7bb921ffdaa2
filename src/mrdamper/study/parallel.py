"""Identifications and recipes of a comparison in several processes, bit for bit what one process gives."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from functools import lru_cache, partial

import numpy as np

from mrdamper.data import Run, index_at
from mrdamper.data.progress import Progress
from mrdamper.errors import InputError
from mrdamper.identification import Identification, Method, Problem, conclude
from mrdamper.identification.basis import Basis
from mrdamper.identification.methods import method_named
from mrdamper.identification.methods.projection import Projection
from mrdamper.models import model_type
from mrdamper.physics.motion import analyse_motion
from mrdamper.statistics.linear import on_one_blas_thread
from mrdamper.study.processes import Processes
from mrdamper.study.recipe import IdentificationCache, Recipe, RecipeResult, fit_and_score_all

_CYCLES = 2  # last cycles of a run for expensive identifications
_PER_CYCLE = 200  # samples per cycle for these


def identify_each(tasks: Iterable[tuple[Basis, Run]], processes: Processes, progress: Progress) -> IdentificationCache:
    """Make the individual fits: every basis from its run."""
    bases: dict[str, tuple[Run, list[Basis]]] = {}
    for basis, run in tasks:
        bases.setdefault(run.id, (run, []))[1].append(basis)
    done = processes.map(_identify_run, list(bases.values()), progress)
    return {key: one for part in done for key, one in part.items()}


def _identify_run(task: tuple[Run, Sequence[Basis]], progress: Progress) -> IdentificationCache:
    run, bases = task
    cache: IdentificationCache = {}
    for number, basis in enumerate(bases):
        progress(f"run {run.id}", number / len(bases))
        cache[basis, run.id] = identify_quickly(basis, run)
    return cache


def follow_each(
    steps: Sequence[tuple[Recipe, Sequence[Run], Sequence[Run]]],
    cache: IdentificationCache,
    processes: Processes,
    progress: Progress,
    *,
    leave_out: bool = True,
) -> list[RecipeResult | str]:
    """Follow recipes from existing identifications; return the result of each, or why there is none.

    A step is a recipe, its identification runs and the validation runs; the longest should be first.
    """
    tasks = [
        (recipe, runs, held_out, {key: cache[key] for r in runs if (b := recipe.basis) and (key := (b, r.id)) in cache})
        for recipe, runs, held_out in steps
    ]
    return processes.map(partial(_follow_one, leave_out), tasks, progress)


@on_one_blas_thread
def _follow_one(
    leave_out: bool, task: tuple[Recipe, Sequence[Run], Sequence[Run], IdentificationCache], progress: Progress
) -> RecipeResult | str:
    recipe, runs, held_out, cache = task
    scored, refused = fit_and_score_all([(recipe, runs)], held_out, progress, leave_out=leave_out, cache=cache)
    return scored[0] if scored else refused[recipe.name]


@on_one_blas_thread
def identify_quickly(basis: Basis, run: Run) -> tuple[Identification | str, float]:
    """One of many identifications, or why there is none, and its time; expensive ones use a few cycles."""
    begin = time.perf_counter()
    try:
        method, shortened_run = shortened_method(basis, run)
        return conclude(basis.problem(run), method, method.solve(shortened_run)), time.perf_counter() - begin
    except InputError as error:
        return str(error), time.perf_counter() - begin


def shortened_method(basis: Basis, run: Run) -> tuple[Method, Problem]:
    """Return the method with reduced effort, and its part of a run."""
    method = (method_named(basis.method) if isinstance(basis.method, str) else basis.method).for_many_runs()
    if model_type(basis.model).integrated:
        method = Projection(refine_best=1)
    return method, basis.problem(shortened(run) if basis.costly else run)


@lru_cache(maxsize=1)  # of successive runs, for several models
def shortened(run: Run) -> Run:
    """Return the last cycles of a run's steady window, thinned, for expensive identifications."""
    steady = run.steady()
    frequency = analyse_motion(run).condition.frequency_Hz
    begin = index_at(steady.time, steady.time[-1] - (_CYCLES + 1) / frequency)
    if len(run.segments) > 1:
        return run
    cut = steady.part(begin, steady.time.size)
    step = max(1, int(cut.time.size / (np.ptp(cut.time) * frequency) / _PER_CYCLE))
    return cut.thinned(step, (float(max(cut.time[0], cut.time[-1] - _CYCLES / frequency)), float(cut.time[-1])))
