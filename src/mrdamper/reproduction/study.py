"""The study of Qian et al. 2024, step by step, on the virtual rig or on a dataset.

Identify every train run by the paper's recipe and by its consistent counterpart, turn the
parameters into the paper's functions, predict the runs that were held out, and set the
verdicts side by side. None of the authors' data or table values are used; what the virtual
rig gives is synthetic.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.dampers.paper import paper_functions
from mrdamper.data import Condition, Dataset, Floats, Run
from mrdamper.errors import IdentificationError, InputError, MissingExtraError
from mrdamper.gas_spring import GasSpring
from mrdamper.identification import Identification, Method, identify
from mrdamper.identification.harmonic_balance import ForceReading, SineRecord, read_force
from mrdamper.identification.loop_analysis import LoopAnalysis, analyse_loop
from mrdamper.identification.methods.balance import Balance
from mrdamper.identification.methods.paper import Paper
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.optimizers.generation import GeneticSettings
from mrdamper.optimizers.genetic import GeneticMinimum
from mrdamper.reproduction.virtual_rig import CURRENTS, VirtualRig, friction_test, noisy_dataset, true_runs
from mrdamper.reproduction.ways import (
    CONSISTENT,
    HALF,
    LITERAL,
    SAME_FORMS,
    SLOWEST,
    TRADITIONAL,
    OnePerCurrent,
    chosen_functions,
    direct_genetic,
    literature,
    nearest_speed,
    peak_velocity,
    ways,
)
from mrdamper.study.recipe import Progress, Scored, Settled, follow_all
from mrdamper.study.workflow import usable_sines
from mrdamper.validation import validate

SEEDS = 20
SEED_CURRENTS = (0.0, 0.5, 1.0, 1.5, 2.0)


@dataclass(frozen=True)
class GeneticCheck:
    """The genetic search on one run beside the optimum it is after.

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
    seed_errors : mapping of str to (S,) array
        Median nrmse_pp over the held-out runs, one a noise seed, by contender.
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
    seed_errors: Mapping[str, Floats]
    notes: tuple[str, ...]
    seconds: float

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """Measured conditions of the train runs."""
        return tuple(loop.condition for loop in self.loops if loop.split == "train")

    def contender(self, title: str) -> Scored:
        """The contender of that title."""
        return next(c for c in self.contenders if c.recipe.title == title)

    @property
    def best(self) -> Scored:
        """The contender that predicts the held-out runs best."""
        return min(self.contenders, key=lambda c: c.held_out.median())


def reproduce(
    dataset: Dataset | None = None,
    gas: GasSpring | None = None,
    *,
    with_direct_genetic: bool = False,
    with_models: bool = False,
    seeds: int = SEEDS,
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
    with_direct_genetic : bool
        Also identify all parameters at once by the genetic algorithm; takes minutes.
    with_models : bool
        Also the other models of the literature, over the same conditions.
    seeds : int
        Noise seeds of the virtual rig over which held-out errors are spread.
    progress : callable
        Told what is being done and the share done.

    Raises
    ------
    IdentificationError
        If the data hold no sine runs of one of the splits.
    """
    begin = time.perf_counter()
    progress("tests", 0.0)
    rig = VirtualRig() if dataset is None else None
    if rig is not None:
        dataset, gas = noisy_dataset(rig, true_runs(rig, CURRENTS), 0), rig.gas
    assert dataset is not None
    train, held_out, notes = _splits(dataset)
    settled = Settled.of(train, gas)
    steps = ways(train, held_out, settled)
    if with_direct_genetic:
        steps += direct_genetic(train, held_out, settled)
    if with_models:
        steps += literature(train)
    contenders, refused = follow_all(
        steps, held_out, lambda what, share: progress(what, 0.05 + 0.45 * share), leave_out=False
    )
    left_out = tuple(f"left out: {name}: {why}" for name, why in refused.items())
    checks, missing = _genetic_checks(train, settled, lambda what, share: progress(what, 0.5 + 0.2 * share))
    spread = _seed_errors(rig, seeds, lambda what, share: progress(what, 0.7 + 0.3 * share)) if rig and seeds else {}
    progress("reproduced", 1.0)
    return Reproduction(
        dataset=dataset,
        rig=rig,
        gas=gas,
        train=tuple(train),
        held_out=tuple(held_out),
        friction=friction_test(rig) if rig else None,
        loops=tuple(analyse_loop(run) for run in (*train, *held_out)),
        readings=tuple(read_force(SineRecord.of(run)) for run in train),
        contenders=tuple(contenders),
        genetic=checks,
        seed_errors=spread,
        notes=(*notes, *settled.notes, *left_out, *missing),
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


def _genetic_checks(
    train: Sequence[Run], settled: Settled, progress: Progress
) -> tuple[tuple[GeneticCheck, ...], tuple[str, ...]]:
    """The genetic search with the paper's settings on two runs of different force."""
    ordered = sorted(train, key=lambda run: float(np.ptp(run.force)))
    picks = [ordered[int(share * (len(ordered) - 1))] for share in (0.3, 0.7)]
    checks = []
    for number, run in enumerate(picks):
        progress(f"genetic search, {run.id}", number / len(picks))
        problem, begin = settled.basis(Paper()).problem(run), time.perf_counter()
        try:
            found = Paper(genetic=GeneticSettings(seed=number)).genetic_search(problem)
        except MissingExtraError as error:
            return (), (f"the genetic search was left out: {error}",)
        seconds = time.perf_counter() - begin
        best = settled.basis(Paper(search="optimum")).identify(run)
        ends = np.array([found.point, [getattr(best.model, name) for name in ("alpha", "beta")]])
        reached, optimum = Paper().cost(problem)(ends)
        checks.append(GeneticCheck(best.condition, found, float(reached), float(optimum), seconds))
    return tuple(checks), ()


def _seed_errors(rig: VirtualRig, seeds: int, progress: Progress) -> dict[str, Floats]:
    """Held-out error over noise seeds, on a thinner matrix: every other current, two cycles.

    The joint fit is left out: choosing its forms anew for every seed would take as long as all
    the rest.
    """
    truth = true_runs(rig, SEED_CURRENTS, cycles=2)
    literal = Paper(search="optimum", explain=False)
    errors: dict[str, list[float]] = {}
    for seed in range(1, seeds + 1):
        progress(f"noise seed {seed} of {seeds}", (seed - 1) / seeds)
        dataset = noisy_dataset(rig, truth, seed)
        train, held_out = dataset.split("train"), dataset.split("validate")

        def identified(method: Method, runs: Sequence[Run] = train) -> list[Identification]:
            return [identify(run, BoucWen, method, gas=rig.gas) for run in runs]

        consistent = identified(Balance())
        by_run = {one.run_id: one for one in consistent}
        speeds = {TRADITIONAL: peak_velocity(held_out), SLOWEST: 0.0}
        dampers = {
            LITERAL: paper_functions(identified(literal)).damper,
            HALF: paper_functions(identified(replace(literal, force_amplitude="half-peak-to-peak"))).damper,
            SAME_FORMS: paper_functions(consistent).damper,
            CONSISTENT: chosen_functions(consistent).damper,
            **{
                title: OnePerCurrent.of([by_run[run.id] for run in nearest_speed(train, speed)])
                for title, speed in speeds.items()
            },
        }
        for title, damper in dampers.items():
            errors.setdefault(title, []).append(validate(damper, held_out).median())
    return {title: np.array(values) for title, values in errors.items()}
