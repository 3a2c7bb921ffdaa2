"""The study of Qian et al. 2024, step by step, on the virtual rig or on a dataset.

Identify every train run by the paper's recipe and by its consistent counterpart, turn the
parameters into the paper's functions, predict the runs that were held out, and set the
verdicts side by side. None of the authors' data or table values are used; what the virtual
rig gives is synthetic.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from mrdamper.data import Dataset, Run
from mrdamper.errors import IdentificationError, InputError
from mrdamper.identification.harmonic_balance import SineRecord, read_force
from mrdamper.identification.loop_analysis import analyse_loop
from mrdamper.paper.assumptions import PaperAssumptions, missing_functions, outside_paper_range
from mrdamper.paper.options import PaperOptions
from mrdamper.paper.pieces import (
    FromRun,
    ended,
    followed,
    genetic_check,
    identified_from,
    of_different_force,
    searches_of,
    sensitivities,
    tasks,
)
from mrdamper.paper.recipes import CONSISTENT, DIRECT, LITERAL, Steps, comparators, literature, recipes_of_paper
from mrdamper.paper.results import GeneticCheck, Reproduction
from mrdamper.paper.seeds import Seed, by_seed, one_seed
from mrdamper.paper.virtual_rig import CURRENTS, VirtualRig, friction_test, noisy_dataset, true_runs
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.study.parallel import HERE, Processes
from mrdamper.study.recipe import Progress
from mrdamper.study.workflow import usable_sines

_SLOW = 1e-4  # mean speed below which a test is quasi-static [m/s]
_SENSITIVITY, _CHECK, _SEED, _RUN = 3.0, 1.5, 1.2, 0.5  # how long a piece of each kind takes, for the time left


def reproduce(
    dataset: Dataset | None = None,
    gas: GasSpring | None = None,
    *,
    options: PaperOptions | None = None,
    with_comparators: bool = True,
    with_models: bool = False,
    seeds: int = 0,
    processes: Processes = HERE,
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
    options : PaperOptions, optional
        What the paper's text leaves open.
    with_comparators : bool
        The paper's own comparators: all parameters by the genetic algorithm, and Ali's model.
    with_models : bool
        Also the other models of the literature, over the same conditions.
    seeds : int
        Noise seeds of the virtual rig over which held-out errors and verdicts are spread.
    processes : Processes
        Where the pieces that do not need each other are done; any number gives the same bits.
    progress : callable
        Told what is being done and the share done.

    Raises
    ------
    IdentificationError
        If the data hold no sine runs to identify from, or allow no way at all.

    Examples
    --------
    >>> from mrdamper import reproduce
    >>> reproduction = reproduce()  # doctest: +SKIP
    """
    begin = time.perf_counter()
    chosen = options or PaperOptions()
    progress("tests", 0.0)
    rig = VirtualRig() if dataset is None else None
    if rig is not None:
        dataset, gas = noisy_dataset(rig, true_runs(rig, CURRENTS), 0), rig.gas
    assert dataset is not None
    train, held_out, notes = _splits(dataset)
    assumptions = PaperAssumptions.of(train, gas or chosen.gas).preset(chosen.fixed)
    steps = [*recipes_of_paper(train, held_out, assumptions, chosen), *(literature(train) if with_models else ())]
    costly: Steps = comparators(train, held_out, assumptions) if with_comparators else []
    searches = searches_of(train, assumptions, chosen) if with_comparators else {}
    work = [(_SENSITIVITY, partial(sensitivities, assumptions, train))]
    work += [(_CHECK, partial(genetic_check, assumptions, chosen, pick)) for pick in of_different_force(train)]
    work += [(_SEED, partial(one_seed, rig, chosen, n)) for n in range(1, seeds + 1) if rig]
    work += [(_RUN, partial(identified_from, task)) for task in tasks(steps, costly, searches, held_out)]
    done = processes.map(_do, work, lambda what, share: progress(what, 0.02 + 0.88 * share), [w for w, _ in work])
    runs = [one for one in done if isinstance(one, FromRun)]
    made = FromRun(
        {k: v for one in runs for k, v in one.found.items()}, {k: v for one in runs for k, v in one.to_settle.items()}
    )
    contenders, refused = followed(
        [*steps, *costly],
        held_out,
        made.found,
        processes,
        lambda what, share: progress(what, 0.9 + 0.1 * share),
    )
    if not contenders:
        name, why = next(iter(refused.items()))
        raise IdentificationError(f"no way could be followed; {name}: {why}", where=dataset.name)
    impossible = tuple(f"left out: {name}: {why}" for name, why in refused.items())
    single, indices, unknown = done[0]
    errors, verdicts = by_seed([one for one in done if isinstance(one, Seed)])
    bases = {recipe.title: recipe.basis for recipe, _ in (*steps, *costly)}
    progress("reproduced", 1.0)
    return Reproduction(
        dataset=dataset,
        rig=rig,
        gas=gas,
        train=tuple(train),
        held_out=tuple(held_out),
        friction=friction_test(rig, filled=chosen.friction_test == "filled") if rig else _slow_test(dataset),
        loops=tuple(analyse_loop(run) for run in (*train, *held_out)),
        readings=tuple(read_force(SineRecord.of(run)) for run in train),
        contenders=tuple(contenders),
        there={
            (title, run.id): made.found[basis, run.id][0]
            for title in (LITERAL, CONSISTENT)
            for run in held_out
            if (basis := bases[title])
        },
        genetic=tuple(one for one in done if isinstance(one, GeneticCheck)),
        ended=ended(searches, bases[LITERAL], made),
        direct={run: n for (basis, run), n in made.to_settle.items() if basis == bases.get(DIRECT)},
        options=chosen,
        seed_errors=errors,
        seed_verdicts=verdicts,
        sensitivity=single,
        sobol=indices,
        notes=(*notes, *assumptions.notes, *range_notes(train), *impossible, *unknown),
        seconds=time.perf_counter() - begin,
    )


def _slow_test(dataset: Dataset) -> Run | None:
    """Return the quasi-static test without current, where the data hold one [section 2]."""
    for run in dataset:
        travel = np.abs(np.diff(run.displacement[:: max(1, run.time.size // 2000)])).sum()
        speed = float(travel) / max(float(np.ptp(run.time)), 1e-9)
        if speed < _SLOW and float(np.max(np.abs(run.current))) < 0.02:
            return run
    return None


def range_notes(train: list[Run]) -> tuple[str, ...]:
    """Name what leaves the paper's range, and its functions that these tests do not determine."""
    missing = missing_functions([SineRecord.of(run).condition for run in train])
    shorter = [
        f"the tests do not determine the paper's function of {name}: a shorter one replaces it" for name in missing
    ]
    return (*outside_paper_range(train), *shorter)


def _do(piece: tuple[float, Callable[[Progress], Any]], progress: Progress) -> Any:
    return piece[1](progress)


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
