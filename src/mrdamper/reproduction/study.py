"""The study of Qian et al. 2024, step by step, on the virtual rig or on a dataset.

Identify every train run by the paper's recipe and by its consistent counterpart, turn the
parameters into the paper's functions, predict the runs that were held out, and set the
verdicts side by side. None of the authors' data or table values are used; what the virtual
rig gives is synthetic.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from mrdamper.data import Dataset, Run
from mrdamper.errors import IdentificationError, InputError
from mrdamper.gas_spring import GasSpring
from mrdamper.identification.harmonic_balance import SineRecord, read_force
from mrdamper.identification.loop_analysis import analyse_loop
from mrdamper.identification.methods.paper import Paper
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.optimizers.generation import GeneticSettings
from mrdamper.reproduction.found import Ended, GeneticCheck, Reproduction
from mrdamper.reproduction.seeds import over_seeds
from mrdamper.reproduction.sensitivity import OneAtATime, Sobol, one_at_a_time, sobol
from mrdamper.reproduction.switches import Switches
from mrdamper.reproduction.virtual_rig import CURRENTS, VirtualRig, friction_test, noisy_dataset, true_runs
from mrdamper.reproduction.ways import CONSISTENT, Steps, comparators, literature, ways
from mrdamper.study.parallel import identify_all, several
from mrdamper.study.recipe import Basis, Found, Progress, Scored, Settled, follow_all
from mrdamper.study.workflow import usable_sines

SEEDS = 20
_SOBOL_SAMPLES = 512


def reproduce(
    dataset: Dataset | None = None,
    gas: GasSpring | None = None,
    *,
    switches: Switches | None = None,
    with_comparators: bool = True,
    with_models: bool = False,
    seeds: int = SEEDS,
    jobs: int | None = None,
    progress: Progress = lambda what, share: None,
) -> Reproduction:
    """Run the study.

    Parameters
    ----------
    dataset : Dataset, optional
        One rig with train and validate runs. Default: the virtual rig, synthetic.
    gas : GasSpring, optional
        Of the dataset's rig. Unknown: k1 and m are taken from a regression of the consistent
        in-phase stiffness over the frequencies, k2 = k3 = 0.
    switches : Switches, optional
        What the paper's text leaves open.
    with_comparators : bool
        The paper's own comparators: all parameters by the genetic algorithm, and Ali's model.
    with_models : bool
        Also the other models of the literature, over the same conditions.
    seeds : int
        Noise seeds of the virtual rig over which held-out errors and verdicts are spread.
    jobs : int, optional
        Processes for the costly identifications; default one a core. Any number gives the same bits.
    progress : callable
        Told what is being done and the share done.

    Raises
    ------
    IdentificationError
        If the data hold no sine runs to identify from, or allow no way at all.
    """
    begin = time.perf_counter()

    def part(low: float, width: float) -> Progress:
        return lambda what, share: progress(what, low + width * share)

    chosen = switches or Switches()
    progress("tests", 0.0)
    rig = VirtualRig() if dataset is None else None
    if rig is not None:
        dataset, gas = noisy_dataset(rig, true_runs(rig, CURRENTS), 0), rig.gas
    assert dataset is not None
    train, held_out, notes = _splits(dataset)
    settled = Settled.of(train, gas).preset(chosen.fixed)
    found: Found = {}
    costly: Steps = comparators(train, held_out, settled) if with_comparators else []
    searches = _searches(train, settled, chosen) if with_comparators else []
    tasks = [(r.basis, run) for r, runs in costly for run in runs if r.basis] + searches
    workers = jobs or os.cpu_count() or 1
    found |= identify_all(tasks, workers, part(0.05, 0.4))
    steps = [*ways(train, held_out, settled, chosen), *costly, *(literature(train) if with_models else ())]
    contenders, refused = follow_all(steps, held_out, part(0.45, 0.2), leave_out=False, found=found)
    if not contenders:
        name, why = next(iter(refused.items()))
        raise IdentificationError(f"no way could be followed; {name}: {why}", where=dataset.name)
    impossible = tuple(f"left out: {name}: {why}" for name, why in refused.items())
    with several(workers) as processes:
        picks = _of_different_force(train)
        checks = processes.map(partial(_genetic_check, settled, chosen), picks, part(0.65, 0.1))
        errors, verdicts = over_seeds(rig, chosen, seeds, processes, part(0.75, 0.25)) if rig else ({}, {})
    single, indices, unknown = _sensitivity(contenders)
    progress("reproduced", 1.0)
    return Reproduction(
        dataset=dataset,
        rig=rig,
        gas=gas,
        train=tuple(train),
        held_out=tuple(held_out),
        friction=friction_test(rig, filled=chosen.friction_test == "filled") if rig else None,
        loops=tuple(analyse_loop(run) for run in (*train, *held_out)),
        readings=tuple(read_force(SineRecord.of(run)) for run in train),
        contenders=tuple(contenders),
        genetic=tuple(checks),
        ended=_ended(searches, found, settled, chosen),
        switches=chosen,
        seed_errors=errors,
        seed_verdicts=verdicts,
        sensitivity=single,
        sobol=indices,
        notes=(*notes, *settled.notes, *impossible, *unknown),
        seconds=time.perf_counter() - begin,
    )


def _splits(dataset: Dataset) -> tuple[list[Run], list[Run], tuple[str, ...]]:
    sines, refused = usable_sines(dataset)
    pure = []
    for run in sines:
        try:
            SineRecord.of(run)
            pure.append(run)
        except InputError as error:
            refused[run.id] = str(error)
    train, held_out = ([r for r in pure if r.split == split] for split in ("train", "validate"))
    if not train:
        raise IdentificationError(
            "no train run with a steady sine", where=dataset.name, mend="mark some in the split column of runs.csv"
        )
    if not held_out:
        refused["every prediction"] = "no validate run with a steady sine; mark some in the split column of runs.csv"
    return train, held_out, tuple(f"not used: {name}: {why}" for name, why in refused.items())


def _searches(train: Sequence[Run], settled: Settled, switches: Switches) -> list[tuple[Basis, Run]]:
    """The genetic search for alpha and beta on every train run, each with a seed of its own."""
    tasks = []
    for seed, run in enumerate(train):
        method = Paper(bounds=switches.bounds, genetic=GeneticSettings(seed=seed), explain=False)
        tasks.append((settled.basis(method), run))
    return tasks


def _ended(
    searches: Sequence[tuple[Basis, Run]], found: Found, settled: Settled, switches: Switches
) -> tuple[Ended, ...]:
    """Where the searches ended, over the optimum of the same runs."""
    optimum = settled.basis(Paper(search="optimum", bounds=switches.bounds))
    ends = []
    for basis, run in searches:
        one, seconds = found[basis, run.id]
        best, _ = found.get((optimum, run.id), ("", 0.0))
        if isinstance(one, str) or isinstance(best, str) or one.seed is None:
            continue
        a, b = (getattr(one.model, name) / getattr(best.model, name) for name in ("alpha", "beta"))
        error = one.scores.nrmse_pp / best.scores.nrmse_pp
        ends.append(Ended(run.id, one.seed, float(a), float(b), float(error), seconds))
    return tuple(ends)


def _of_different_force(train: Sequence[Run]) -> list[tuple[int, Run]]:
    """Two runs, a weak and a strong one, and a seed for each."""
    ordered = sorted(train, key=lambda run: float(np.ptp(run.force)))
    picks = dict.fromkeys(int(share * (len(ordered) - 1)) for share in (0.3, 0.7))
    return list(enumerate(ordered[i] for i in picks))


def _genetic_check(settled: Settled, switches: Switches, pick: tuple[int, Run], progress: Progress) -> GeneticCheck:
    """The genetic search with the paper's settings on a run."""
    seed, run = pick
    progress(f"genetic search, {run.id}", 0.0)
    method = Paper(genetic=GeneticSettings(seed=seed), bounds=switches.bounds, explain=False)
    problem, begin = settled.basis(method).problem(run), time.perf_counter()
    found = method.genetic_search(problem)
    seconds = time.perf_counter() - begin
    best = settled.basis(replace(method, search="optimum")).identify(run)
    ends = np.array([found.point, [getattr(best.model, name) for name in ("alpha", "beta")]])
    reached, optimum = method.cost(problem)(ends)
    return GeneticCheck(best.condition, found, float(reached), float(optimum), seconds)


def _sensitivity(
    contenders: Sequence[Scored],
) -> tuple[tuple[OneAtATime, ...], Sobol | None, tuple[str, ...]]:
    """At the run in the middle of the consistent identifications."""
    contender = next((c for c in contenders if c.recipe.title == CONSISTENT), None)
    if contender is None:
        return (), None, ("sensitivity was left out: the consistent way could not be followed",)
    found = contender.identifications
    middle = sorted(found, key=lambda i: i.condition.current_A * i.condition.peak_velocity)[len(found) // 2]
    model, condition = middle.model, middle.condition
    assert isinstance(model, BoucWen)
    try:
        single = one_at_a_time(model, condition)
        return single, sobol(model, condition, samples=_SOBOL_SAMPLES), ()
    except InputError as error:
        return (), None, (f"sensitivity was left out: {error}",)
