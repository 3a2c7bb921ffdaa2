"""Identifications of many runs in several processes, bit for bit what one process gives."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import fields, replace
from multiprocessing import get_context
from typing import Any

import numpy as np

from mrdamper.data import Run
from mrdamper.errors import InputError
from mrdamper.identification import Identification, Problem, conclude
from mrdamper.identification.methods import method_named
from mrdamper.identification.methods.direct_genetic import DirectGenetic
from mrdamper.identification.methods.paper import Paper
from mrdamper.identification.methods.projection import Projection
from mrdamper.models import model_type
from mrdamper.motion import analyse_motion
from mrdamper.study.comparison.contestants import Basis
from mrdamper.study.workflow import Progress

_CYCLES = 2  # of a run that costly identifications see
_PER_CYCLE = 200  # samples of a cycle they see
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

Found = dict[tuple[Basis, str], tuple[Identification | str, float]]

GENERATIONS = 60  # of a genetic search here, where the paper takes 500: a comparison has dozens of runs


def identify_all(bases: Sequence[Basis], runs: Sequence[Run], workers: int, progress: Progress) -> Found:
    """Every basis from every run, in processes of one thread each, so that their number changes no bit."""
    tasks = [(basis, run.id) for basis in sorted(bases, key=lambda b: not b.costly) for run in runs]
    if not tasks:
        return {}
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        with ProcessPoolExecutor(
            workers, get_context("spawn"), initializer=_receive, initargs=([_packed(run) for run in runs],)
        ) as pool:
            waiting = {pool.submit(_identify_one, *task): task for task in tasks}
            found: Found = {}
            for done in as_completed(waiting):
                task = waiting[done]
                found[task] = done.result()
                progress(f"{task[0].model}, run {task[1]}", len(found) / len(tasks))
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
    return found


_RUNS: dict[str, Run] = {}  # of a worker process, received once


def _receive(packed: Sequence[Mapping[str, Any]]) -> None:
    _RUNS.update({values["id"]: Run(**values) for values in packed})


def _packed(run: Run) -> dict[str, Any]:
    return {f.name: getattr(run, f.name) for f in fields(run)} | {"notes": dict(run.notes)}


def _identify_one(basis: Basis, run_id: str) -> tuple[Identification | str, float]:
    run = _RUNS[run_id]
    begin = time.perf_counter()
    try:
        method, cls = method_named(basis.method), model_type(basis.model)
        if isinstance(method, Paper | DirectGenetic):
            method = replace(method, genetic=replace(method.genetic, generations=GENERATIONS))
        if cls.integrated:
            method = Projection(refine_best=1)
        seen = shortened(run) if basis.costly else run
        solution = method.solve(Problem.of(seen, cls, free=basis.free))
        return conclude(Problem.of(run, cls, free=basis.free), method, solution), time.perf_counter() - begin
    except InputError as error:
        return str(error), time.perf_counter() - begin


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
