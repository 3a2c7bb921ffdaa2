"""Work in several processes, bit for bit what one process gives."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np

from mrdamper.data import Run
from mrdamper.errors import InputError
from mrdamper.identification import Identification, conclude
from mrdamper.identification.methods import method_named
from mrdamper.identification.methods.direct_genetic import DirectGenetic
from mrdamper.identification.methods.paper import Paper
from mrdamper.identification.methods.projection import Projection
from mrdamper.models import model_type
from mrdamper.motion import analyse_motion
from mrdamper.study.processes import processes
from mrdamper.study.recipe import Basis, Found, Progress, Recipe, Scored, follow_all

_CYCLES = 2  # of a run that costly identifications see
_PER_CYCLE = 200  # samples of a cycle they see
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

T = TypeVar("T")
R = TypeVar("R")

GENERATIONS = 60  # of a genetic search here, where the paper takes 500: a comparison has dozens of runs


@dataclass(frozen=True)
class Processes:
    """Where independent pieces of work are done: here, and in a pool beside it if there is one. `several` makes one."""

    pool: Executor | None = None

    def map(
        self, function: Callable[[T, Progress], R], items: Sequence[T], progress: Progress = lambda what, share: None
    ) -> list[R]:
        """Results of a function for every item, in order; it is a function of a module.

        A process that starts has imports to do, so this one takes an item too, the last.
        """
        *others, own = items
        if self.pool is None:
            return [function(item, _part(progress, n, len(items))) for n, item in enumerate(items)]
        pending = [self.pool.submit(_quietly, function, item) for item in others]
        last = function(own, lambda what, share: progress(what, 0.9 * share))
        for done, future in enumerate(as_completed(pending), 1):
            future.result()
            progress(f"{done + 1} of {len(items)} done", 0.9 + 0.1 * done / len(pending))
        return [*(future.result() for future in pending), last]


HERE = Processes()


@contextmanager
def several(count: int) -> Iterator[Processes]:
    """As many processes as `count` says, this one among them, for the length of a block."""
    if count < 2:
        yield HERE
        return
    with processes(count - 1) as pool:
        yield Processes(pool)


def _part(progress: Progress, number: int, count: int) -> Progress:
    return lambda what, share: progress(what, (number + share) / count)


def _quietly(function: Callable[[T, Progress], R], item: T) -> R:
    return function(item, lambda what, share: None)


def identify_all(tasks: Sequence[tuple[Basis, Run]], workers: int, progress: Progress) -> Found:
    """Every basis from its run, in several processes."""
    with crew([run for _, run in tasks], workers) as several_of_us:
        return several_of_us.identify(tasks, progress)


@contextmanager
def crew(runs: Iterable[Run], workers: int) -> Iterator[Crew]:
    """Processes that hold these runs, of one thread each, so that their number changes no bit."""
    held = {run.id: run for run in runs}.values()
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        with processes(workers, _receive, ([_packed(run) for run in held],)) as pool:
            yield Crew(pool)
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@dataclass(frozen=True)
class Crew:
    """Processes that hold the runs of a dataset; `crew` makes it."""

    pool: Executor

    def identify(self, tasks: Sequence[tuple[Basis, Run]], progress: Progress) -> Found:
        """Every basis from its run; what takes long begins first."""
        named = [(basis, run.id) for basis, run in sorted(tasks, key=lambda task: not task[0].costly)]
        return self._each(_identify_one, {one: one for one in named}, "identified", progress)

    def follow(
        self,
        steps: Sequence[tuple[Recipe, Sequence[Run]]],
        held_out: Mapping[str, Sequence[Run]],
        found: Found,
        progress: Progress,
    ) -> dict[tuple[str, str], Scored | str]:
        """Recipes followed from identifications there are already, or why not, by rig and name of the recipe.

        Parameters
        ----------
        steps : sequence of (Recipe, train runs)
            The runs of one step are of one rig.
        held_out : mapping of rig to runs
        found : mapping
            Identifications, by basis and run id.
        progress : callable
        """
        tasks: dict[tuple[str, str], tuple[Any, ...]] = {}
        for recipe, runs in sorted(steps, key=lambda step: step[0].basis is not None and not step[0].basis.costly):
            own = {(recipe.basis, run.id): found[recipe.basis, run.id] for run in runs if recipe.basis}
            ids, held = [run.id for run in runs], [run.id for run in held_out[runs[0].rig]]
            tasks[runs[0].rig, recipe.name] = (recipe, ids, held, own)
        return self._each(_follow_one, tasks, "followed", progress)

    def _each(
        self, function: Callable[..., R], tasks: Mapping[T, tuple[Any, ...]], what: str, progress: Progress
    ) -> dict[T, R]:
        waiting = {self.pool.submit(function, *task): key for key, task in tasks.items()}
        results: dict[T, R] = {}
        for done in as_completed(waiting):
            results[waiting[done]] = done.result()
            progress(f"{len(results)} of {len(waiting)} {what}", len(results) / len(waiting))
        return results


_RUNS: dict[str, Run] = {}  # of a worker process, received once


def _receive(packed: Sequence[Mapping[str, Any]]) -> None:
    _RUNS.update({values["id"]: Run(**values) for values in packed})


def _packed(run: Run) -> dict[str, Any]:
    return {f.name: getattr(run, f.name) for f in fields(run)} | {"notes": dict(run.notes)}


def _identify_one(basis: Basis, run_id: str) -> tuple[Identification | str, float]:
    run = _RUNS[run_id]
    begin = time.perf_counter()
    try:
        method = method_named(basis.method) if isinstance(basis.method, str) else basis.method
        if isinstance(method, Paper | DirectGenetic):
            method = replace(method, genetic=replace(method.genetic, generations=GENERATIONS))
        if model_type(basis.model).integrated:
            method = Projection(refine_best=1)
        seen = shortened(run) if basis.costly else run
        solution = method.solve(basis.problem(seen))
        return conclude(basis.problem(run), method, solution), time.perf_counter() - begin
    except InputError as error:
        return str(error), time.perf_counter() - begin


def _follow_one(recipe: Recipe, runs: Sequence[str], held_out: Sequence[str], found: Found) -> Scored | str:
    train = [_RUNS[run_id] for run_id in runs]
    scored, refused = follow_all([(recipe, train)], [_RUNS[run_id] for run_id in held_out], found=found)
    return scored[0] if scored else refused[recipe.name]


def shortened(run: Run) -> Run:
    """The last cycles of a run's steady window, thinned: what costly identifications see."""
    steady = run.steady()
    frequency = analyse_motion(run).condition.frequency_Hz
    begin = int(np.searchsorted(steady.time, steady.time[-1] - (_CYCLES + 1) / frequency))
    if len(run.segments) > 1:
        return run
    cut = steady.part(begin, steady.time.size)
    step = max(1, int(cut.time.size / (np.ptp(cut.time) * frequency) / _PER_CYCLE))
    pick = slice(None, None, step)
    window = (float(max(cut.time[0], cut.time[-1] - _CYCLES / frequency)), float(cut.time[-1]))
    return replace(
        cut,
        time=cut.time[pick],
        displacement=cut.displacement[pick],
        force=cut.force[pick],
        current=cut.current[pick],
        velocity=None,
        window=window,
        segments=(),
    )
