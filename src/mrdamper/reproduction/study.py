"""The study of Qian et al. 2024, step by step, on the virtual rig or on a dataset.

Identify every train run by the paper's recipe and by its consistent counterpart, turn the
parameters into the paper's functions, predict the runs that were held out, and set the
verdicts side by side. None of the authors' data or table values are used; what the virtual
rig gives is synthetic.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.dampers.paper import paper_functions
from mrdamper.data import Condition, Dataset, Floats, Run
from mrdamper.errors import IdentificationError, InputError
from mrdamper.gas_spring import GasSpring
from mrdamper.identification import Identification, Method, identify
from mrdamper.identification.harmonic_balance import ForceReading, SineRecord, read_force
from mrdamper.identification.loop_analysis import LoopAnalysis, analyse_loop
from mrdamper.identification.methods.balance import Balance
from mrdamper.identification.methods.paper import Paper
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.optimizers.generation import GeneticSettings
from mrdamper.optimizers.genetic import GeneticMinimum
from mrdamper.reproduction.sensitivity import OneAtATime, Sobol, one_at_a_time, sobol
from mrdamper.reproduction.switches import Switches
from mrdamper.reproduction.virtual_rig import CURRENTS, VirtualRig, friction_test, noisy_dataset, true_runs
from mrdamper.reproduction.ways import (
    CONSISTENT,
    HALF,
    LITERAL,
    SAME_FORMS,
    SLOWEST,
    TRADITIONAL,
    OnePerCurrent,
    Steps,
    chosen_functions,
    comparators,
    literature,
    nearest_speed,
    peak_velocity,
    ways,
)
from mrdamper.study.parallel import identify_all
from mrdamper.study.recipe import Basis, Found, Progress, Scored, Settled, follow_all
from mrdamper.study.workflow import usable_sines
from mrdamper.validation import validate

SEEDS = 20
_SOBOL_SAMPLES = 512
SEED_CURRENTS = (0.0, 0.5, 1.0, 1.5, 2.0)


@dataclass(frozen=True)
class GeneticCheck:
    """The genetic search with the paper's settings on one run beside the optimum it is after.

    Attributes
    ----------
    condition : Condition
    minimum : GeneticMinimum
    reached, optimum : float
        RMSE where it ended and the lowest there is [N].
    seconds : float
    """

    condition: Condition
    minimum: GeneticMinimum
    reached: float
    optimum: float
    seconds: float


@dataclass(frozen=True)
class Ended:
    """Where a genetic search of fewer generations ended on a run, over the optimum.

    Attributes
    ----------
    run_id : str
    seed : int
    alpha, beta : float
        Parameter reached over that of the optimum.
    error : float
        RMSE reached over the lowest there is.
    seconds : float
    """

    run_id: str
    seed: int
    alpha: float
    beta: float
    error: float
    seconds: float


@dataclass(frozen=True, eq=False)
class Reproduction:
    """Everything the study found.

    Attributes
    ----------
    dataset : Dataset
    rig : VirtualRig or None
        The truth, where the data are synthetic.
    gas : GasSpring or None
    train, held_out : tuple of Run
    friction : Run or None
    loops : tuple of LoopAnalysis
    readings : tuple of ForceReading
        F0, phi, f0 of the train runs.
    contenders : tuple of Scored
        Their `recipe.title` tells them apart.
    genetic : tuple of GeneticCheck
    ended : tuple of Ended
        Genetic searches over all train runs, one seed each.
    switches : Switches
    seed_errors : mapping of str to (S,) array
        Median nrmse_pp over the held-out runs, one a noise seed, by contender.
    sensitivity : tuple of OneAtATime
        At the run in the middle of the consistent identifications.
    sobol : Sobol or None
    notes : tuple of str
    seconds : float
    """

    dataset: Dataset
    rig: VirtualRig | None
    gas: GasSpring | None
    train: tuple[Run, ...]
    held_out: tuple[Run, ...]
    friction: Run | None
    loops: tuple[LoopAnalysis, ...]
    readings: tuple[ForceReading, ...]
    contenders: tuple[Scored, ...]
    genetic: tuple[GeneticCheck, ...]
    ended: tuple[Ended, ...]
    switches: Switches
    seed_errors: Mapping[str, Floats]
    sensitivity: tuple[OneAtATime, ...]
    sobol: Sobol | None
    notes: tuple[str, ...]
    seconds: float

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """Measured conditions of the train runs."""
        return tuple(loop.condition for loop in self.loops if loop.split == "train")

    def contender(self, title: str) -> Scored | None:
        """The contender of that title, where the data allowed it."""
        return next((c for c in self.contenders if c.recipe.title == title), None)

    @property
    def best(self) -> Scored:
        """The contender that predicts the held-out runs best."""
        return min(self.contenders, key=lambda c: c.held_out.median())


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
        Noise seeds of the virtual rig over which held-out errors are spread.
    jobs : int, optional
        Processes for the costly identifications; default one a core. Any number gives the same bits.
    progress : callable
        Told what is being done and the share done.

    Raises
    ------
    IdentificationError
        If the data hold no sine runs of one of the splits, or allow no way at all.
    """
    begin = time.perf_counter()
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
    found |= identify_all(tasks, jobs or os.cpu_count() or 1, lambda what, share: progress(what, 0.05 + 0.4 * share))
    steps = [*ways(train, held_out, settled, chosen), *costly, *(literature(train) if with_models else ())]
    contenders, refused = follow_all(
        steps, held_out, lambda what, share: progress(what, 0.45 + 0.2 * share), leave_out=False, found=found
    )
    if not contenders:
        name, why = next(iter(refused.items()))
        raise IdentificationError(f"no way could be followed; {name}: {why}", where=dataset.name)
    impossible = tuple(f"left out: {name}: {why}" for name, why in refused.items())
    checks, missing = _genetic_checks(train, settled, chosen, lambda what, share: progress(what, 0.65 + 0.1 * share))
    spread = _seed_errors(rig, chosen, seeds, lambda what, share: progress(what, 0.75 + 0.25 * share)) if rig else {}
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
        genetic=checks,
        ended=_ended(searches, found, settled, chosen),
        switches=chosen,
        seed_errors=spread,
        sensitivity=single,
        sobol=indices,
        notes=(*notes, *settled.notes, *impossible, *missing, *unknown),
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
    for split, runs in (("train", train), ("validate", held_out)):
        if not runs:
            raise IdentificationError(
                f"no {split} run with a steady sine",
                where=dataset.name,
                mend="mark some in the split column of runs.csv",
            )
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


def _genetic_checks(
    train: Sequence[Run], settled: Settled, switches: Switches, progress: Progress
) -> tuple[tuple[GeneticCheck, ...], tuple[str, ...]]:
    """The genetic search with the paper's settings on two runs of different force."""
    ordered = sorted(train, key=lambda run: float(np.ptp(run.force)))
    picks = list(dict.fromkeys(int(share * (len(ordered) - 1)) for share in (0.3, 0.7)))
    checks = []
    for number, run in enumerate(ordered[i] for i in picks):
        progress(f"genetic search, {run.id}", number / len(picks))
        method = Paper(genetic=GeneticSettings(seed=number), bounds=switches.bounds, explain=False)
        problem, begin = settled.basis(method).problem(run), time.perf_counter()
        found = method.genetic_search(problem)
        seconds = time.perf_counter() - begin
        best = settled.basis(replace(method, search="optimum")).identify(run)
        ends = np.array([found.point, [getattr(best.model, name) for name in ("alpha", "beta")]])
        reached, optimum = method.cost(problem)(ends)
        checks.append(GeneticCheck(best.condition, found, float(reached), float(optimum), seconds))
    return tuple(checks), ()


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


def _seed_errors(rig: VirtualRig, switches: Switches, seeds: int, progress: Progress) -> dict[str, Floats]:
    """Held-out error over noise seeds, on a thinner matrix: every other current, two cycles.

    The joint fit is left out: choosing its forms anew for every seed would take as long as all
    the rest.
    """
    truth = true_runs(rig, SEED_CURRENTS, cycles=2)
    literal = Paper(search="optimum", explain=False, bounds=switches.bounds)
    errors: dict[str, list[float]] = {}
    for seed in range(1, seeds + 1):
        progress(f"noise seed {seed} of {seeds}", (seed - 1) / seeds)
        dataset = noisy_dataset(rig, truth, seed)
        train, held_out = dataset.split("train"), dataset.split("validate")

        def identified(method: Method, runs: Sequence[Run] = train) -> list[Identification]:
            return [identify(run, BoucWen, method, gas=rig.gas, fixed=dict(switches.fixed)) for run in runs]

        consistent = identified(Balance())
        by_run = {one.run_id: one for one in consistent}
        speeds = {TRADITIONAL: peak_velocity(held_out), SLOWEST: 0.0}
        dampers = {
            LITERAL: paper_functions(identified(literal), switches.mass_law).damper,
            HALF: paper_functions(
                identified(replace(literal, force_amplitude="half-peak-to-peak")), switches.mass_law
            ).damper,
            SAME_FORMS: paper_functions(consistent, switches.mass_law).damper,
            CONSISTENT: chosen_functions(consistent).damper,
            **{
                title: OnePerCurrent.of([by_run[run.id] for run in nearest_speed(train, speed)])
                for title, speed in speeds.items()
            },
        }
        for title, damper in dampers.items():
            errors.setdefault(title, []).append(validate(damper, held_out).median())
    return {title: np.array(values) for title, values in errors.items()}
