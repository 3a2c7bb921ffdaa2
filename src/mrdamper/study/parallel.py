"""Work in several processes, bit for bit what one process gives."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from concurrent.futures import Executor, Future, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np

from mrdamper.data import Run, index_at
from mrdamper.errors import InputError
from mrdamper.identification import Identification, Method, Problem, conclude
from mrdamper.identification.basis import Basis
from mrdamper.identification.methods import method_named
from mrdamper.identification.methods.projection import Projection
from mrdamper.models import model_type
from mrdamper.physics.motion import analyse_motion
from mrdamper.statistics.linear import on_one_blas_thread
from mrdamper.study.processes import processes
from mrdamper.study.recipe import IdentificationCache, Progress, Recipe, RecipeResult, fit_and_score_all

_CYCLES = 2  # of a run that costly identifications see
_PER_CYCLE = 200  # samples of a cycle they see
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True)
class Processes:
    """The process at hand, and the pool of worker processes beside it if there is one. `several` starts the pool."""

    pool: Executor | None = None
    count: int = 1

    def map(
        self,
        function: Callable[[T, Progress], R],
        items: Sequence[T],
        progress: Progress = lambda what, share: None,
        weights: Sequence[float] = (),
    ) -> list[R]:
        """Return the results of a function of a module for every item, in order.

        A process that starts has imports to do, so this one takes an item too, the last, and goes on from the
        end with those that none has begun: the longest ought to stand first. Weights say how long each takes.
        """
        weight, last = list(weights or [1.0] * len(items)), len(items) - 1
        pending = [self.pool.submit(_quietly, function, item) for item in items[:-1]] if self.pool else []
        here: dict[int, R] = {}

        def tell(what: str, within: float) -> None:
            ended = (n in here or (n < len(pending) and _done(pending[n])) for n in range(len(items)))
            done = sum(w for w, end in zip(weight, ended, strict=True) if end)
            progress(what, (done + within) / sum(weight))

        for n in reversed(range(len(items))) if pending else range(len(items)):
            if not pending or n == last or pending[n].cancel():
                here[n] = function(items[n], lambda what, share, n=n: tell(what, weight[n] * share))
        for future in as_completed([future for future in pending if not future.cancelled()]):
            future.result()
            tell(f"{sum(map(_done, pending)) + len(here)} of {len(items)} done", 0.0)
        return [here[n] if n in here else pending[n].result() for n in range(len(items))]


IN_PROCESS = Processes()


@contextmanager
def several(count: int) -> Generator[Processes]:
    """Start `count` processes, this one included, for the length of a block."""
    if count < 2:
        yield IN_PROCESS
        return
    with processes(count - 1) as pool:
        yield Processes(pool, count)


def _done(future: Future[Any]) -> bool:
    return future.done() and not future.cancelled()


def _quietly(function: Callable[[T, Progress], R], item: T) -> R:
    return function(item, lambda what, share: None)


@contextmanager
def worker_pool(runs: Iterable[Run], workers: int) -> Generator[WorkerPool]:
    """Yield processes that hold these runs, of one thread each, so that their number changes no bit."""
    held = {run.id: run for run in runs}.values()
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        with processes(workers, _receive, ([_packed(run) for run in held],)) as pool:
            yield WorkerPool(pool)
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@dataclass(frozen=True)
class WorkerPool:
    """Processes that hold the runs of a dataset; `worker_pool` makes it."""

    pool: Executor

    def identify(self, tasks: Sequence[tuple[Basis, Run]], progress: Progress) -> IdentificationCache:
        """Every basis from its run; what takes long begins first."""
        named = [(basis, run.id) for basis, run in sorted(tasks, key=lambda task: not task[0].costly)]
        return self._each(_identify_one, {one: one for one in named}, "identified", progress)

    def follow(
        self,
        steps: Sequence[tuple[Recipe, Sequence[Run]]],
        held_out: Mapping[str, Sequence[Run]],
        cache: IdentificationCache,
        progress: Progress,
    ) -> dict[tuple[str, str], RecipeResult | str]:
        """Recipes followed from identifications there are already, or why not, by rig and name of the recipe.

        Parameters
        ----------
        steps : sequence of (Recipe, identification runs)
            The runs of one step are of one rig.
        held_out : mapping of rig to runs
        cache : mapping
            Identifications, by basis and run id.
        progress : callable
        """
        tasks: dict[tuple[str, str], tuple[Any, ...]] = {}
        for recipe, runs in sorted(steps, key=lambda step: step[0].basis is not None and not step[0].basis.costly):
            own = {(recipe.basis, run.id): cache[recipe.basis, run.id] for run in runs if recipe.basis}
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
    return identify_quickly(basis, _RUNS[run_id])


@on_one_blas_thread
def identify_quickly(basis: Basis, run: Run) -> tuple[Identification | str, float]:
    """One of many identifications, or why there is none, and its seconds: what is costly sees a few cycles."""
    begin = time.perf_counter()
    try:
        method, shortened_run = shortened_method(basis, run)
        return conclude(basis.problem(run), method, method.solve(shortened_run)), time.perf_counter() - begin
    except InputError as error:
        return str(error), time.perf_counter() - begin


def shortened_method(basis: Basis, run: Run) -> tuple[Method, Problem]:
    """Return the method where it is one of many, and what it sees of a run."""
    method = (method_named(basis.method) if isinstance(basis.method, str) else basis.method).for_many_runs()
    if model_type(basis.model).integrated:
        method = Projection(refine_best=1)
    return method, basis.problem(shortened(run) if basis.costly else run)


def _follow_one(
    recipe: Recipe, runs: Sequence[str], held_out: Sequence[str], cache: IdentificationCache
) -> RecipeResult | str:
    train = [_RUNS[run_id] for run_id in runs]
    scored, refused = fit_and_score_all([(recipe, train)], [_RUNS[run_id] for run_id in held_out], cache=cache)
    return scored[0] if scored else refused[recipe.name]


def shortened(run: Run) -> Run:
    """Return the last cycles of a run's steady window, thinned: what costly identifications see."""
    steady = run.steady()
    frequency = analyse_motion(run).condition.frequency_Hz
    begin = index_at(steady.time, steady.time[-1] - (_CYCLES + 1) / frequency)
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
