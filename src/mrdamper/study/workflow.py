"""The whole method, in order: identify every run, map the parameters, validate what was held out.

`run_study` reads like the methods section of a paper; everything it returns is a result
object that plots, reports and files take from there.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import JointFit, JointProblem
from mrdamper.dampers.modified import ModifiedFit, fit_modified, fit_modified_jointly
from mrdamper.dampers.paper import Settled, paper_functions
from mrdamper.data import Dataset, Run
from mrdamper.errors import IdentificationError, InputError, UnknownNameError
from mrdamper.identification import Identification, identify, refuse_clipped
from mrdamper.identification.loop_analysis import DynamicRange, LoopAnalysis, analyse_loop, dynamic_ranges
from mrdamper.identification.methods.paper import Paper
from mrdamper.motion import analyse_motion, equivalent_sine
from mrdamper.validation import Validation, leave_one_condition_out, validate

Progress = Callable[[str, float], None]
_WORTH = 1.1  # more numbers must lower the left-out error by a tenth
_MANY = 20  # runs from which on leaving one out is followed by a single step
JOINTLY = "play-bypass"  # the model whose parameters hold for a whole damper
STUDIED = ("bouc-wen", "bingham")  # the model of the method, and the one everybody compares with


@dataclass(frozen=True, eq=False)
class Candidate:
    """One model of a rig: identified per run, mapped, validated.

    Attributes
    ----------
    model : str
        Name of the model type.
    way : str
        "run by run": functions through identified values; "paper, literal": the same by the
        paper's recipe; "joint": fitted to the forces of
        all train runs at once.
    identifications : tuple of Identification
        Of the train runs, one by one; empty for models that are identified jointly only.
    fit : ModifiedFit or JointFit
    left_out : Validation
        Train runs, each predicted without its condition.
    held_out : Validation
        Validate runs.
    seconds : float
        Spent on identification, mapping and leave-one-out.
    """

    model: str
    way: str
    identifications: tuple[Identification, ...]
    fit: ModifiedFit | JointFit
    left_out: Validation
    held_out: Validation
    seconds: float

    @property
    def title(self) -> str:
        """Model and way, for tables."""
        return f"{self.damper.title}, {self.way}"

    @property
    def per_run_median(self) -> float:
        """Median nrmse_pp of the run-by-run identifications: what one run allows this model."""
        errors = [i.scores.nrmse_pp for i in self.identifications]
        return float(np.median(errors)) if errors else float("nan")

    @property
    def damper(self) -> Damper:
        """What predicts."""
        return self.fit.damper


@dataclass(frozen=True, eq=False)
class RigStudy:
    """The study of one rig.

    Attributes
    ----------
    rig : str
    dataset : Dataset
    loops : tuple of LoopAnalysis
        Of every sine run.
    ranges : tuple of DynamicRange
    candidates : tuple of Candidate
        The chosen one first, the others by their error on left-out conditions.
    not_identified : mapping of run id to the reason
    asked_for : bool
        The user named the model; the evidence did not choose it.
    """

    rig: str
    dataset: Dataset
    loops: tuple[LoopAnalysis, ...]
    ranges: tuple[DynamicRange, ...]
    candidates: tuple[Candidate, ...]
    not_identified: dict[str, str]
    asked_for: bool = False

    @property
    def chosen(self) -> Candidate:
        """The candidate with the fewest numbers among those that predict left-out conditions about best."""
        return self.candidates[0]

    @property
    def damper(self) -> Damper:
        """The chosen damper."""
        return self.chosen.damper


@dataclass(frozen=True, eq=False)
class Study:
    """A study of a dataset, rig by rig.

    Attributes
    ----------
    dataset : Dataset
    rigs : tuple of RigStudy
    seconds : float
    finished : tuple
        What `finish` of `run_study` made of each rig; empty without it.
    """

    dataset: Dataset
    rigs: tuple[RigStudy, ...]
    seconds: float
    finished: tuple[Any, ...] = ()

    @property
    def model(self) -> Damper:
        """The damper, where the dataset holds one rig.

        Raises
        ------
        IdentificationError
            If it holds several: take `study.rig(name).damper`.
        """
        if len(self.rigs) > 1:
            names = ", ".join(r.rig for r in self.rigs)
            raise IdentificationError(f"the dataset holds {len(self.rigs)} rigs", mend=f"use study.rig(name): {names}")
        return next(iter(self.rigs)).damper

    def rig(self, name: str) -> RigStudy:
        """The study of one rig."""
        self.dataset.rig(name)
        return next(r for r in self.rigs if r.rig == name)


Finish = Callable[[RigStudy], Any]


def run_study(
    dataset: Dataset,
    progress: Progress = lambda what, share: None,
    *,
    model: str | None = None,
    workers: int = 1,
    finish: Finish | None = None,
) -> Study:
    """Study a dataset: identify, map, validate, rig by rig.

    Parameters
    ----------
    dataset : Dataset
    progress : callable
        Told what is being done and the share done, 0...1.
    model : str, optional
        Choose the best candidate of this model instead of the best of all.
    workers : int
        Rigs studied at once, each in a process of its own; the results are the same bits.
    finish : callable, optional
        More to make of a rig in the process that studied it: its figures, say. A function of a module.

    Raises
    ------
    UnknownNameError
        If no candidate is of that model.
    IdentificationError
        If a rig has too few runs to identify anything from.
    """
    begin = time.perf_counter()
    count = len(dataset.rigs)
    if workers > 1 and count > 1:
        rigs, finished = zip(*_in_parallel(dataset, progress, model, min(workers, count), finish), strict=True)
        return Study(dataset, rigs, time.perf_counter() - begin, finished if finish else ())
    rigs = []
    for number, name in enumerate(dataset.rigs):

        def tell(what: str, share: float, number: int = number, name: str = name) -> None:
            progress(f"{name or 'rig'}: {what}", (number + share) / count)

        rigs.append(study_rig(dataset.rig(name), tell, model=model))
    progress("studied", 1.0)
    finished = tuple(finish(rig) for rig in rigs) if finish else ()
    return Study(dataset, tuple(rigs), time.perf_counter() - begin, finished)


def _in_parallel(
    dataset: Dataset, progress: Progress, model: str | None, workers: int, finish: Finish | None
) -> list[tuple[RigStudy, Any]]:
    # Spawned, not forked: a fork of a process whose libraries run threads can hang.
    *others, own = dataset.rigs  # a process that starts has imports to do, so this one studies too
    with ProcessPoolExecutor(workers - 1, mp_context=get_context("spawn")) as pool:
        pending = [pool.submit(_study, dataset.rig(name), model, finish) for name in others]
        share = workers / len(dataset.rigs)  # of the time, until this process is done
        last = _study(dataset.rig(own), model, finish, lambda what, done: progress(f"{own}: {what}", share * done))
        for done, future in enumerate(as_completed(pending), 1):
            future.result()
            progress(f"{done + 1} of {len(pending) + 1} rigs studied", share + (1 - share) * done / len(pending))
        return [*(future.result() for future in pending), last]


def _study(
    dataset: Dataset, model: str | None, finish: Finish | None, progress: Progress = lambda what, share: None
) -> tuple[RigStudy, Any]:
    rig = study_rig(dataset, progress, model=model)
    return rig, finish(rig) if finish else None


def study_rig(dataset: Dataset, progress: Progress = lambda what, share: None, *, model: str | None = None) -> RigStudy:
    """Study the runs of one rig; arguments as `run_study`."""
    if model not in (None, *STUDIED, JOINTLY):
        raise UnknownNameError.of("studied model", str(model), (*STUDIED, JOINTLY))
    rig = dataset.rigs[0]
    progress("loops", 0.0)
    sines, refused = usable_sines(dataset)
    loops = tuple(analyse_loop(run) for run in sines)
    train = [run for run in sines if run.split == "train"]
    if len(train) < 2:
        raise IdentificationError(
            f"{len(train)} train runs with a steady sine",
            where=f"rig {rig or dataset.name}",
            mend="a model over conditions needs at least two; check the split column of runs.csv",
        )
    candidates = []
    for number, name in enumerate(STUDIED):

        def tell(what: str, share: float, number: int = number, name: str = name) -> None:
            progress(f"{name} {what}", 0.85 * (number + share) / len(STUDIED))

        candidates += _candidates(name, dataset, train, tell)
    progress("the paper's recipe", 0.85)
    candidates += _paper_candidates(dataset, train)
    progress("play-bypass jointly", 0.9)
    candidates.append(_joint_candidate(dataset, train))
    candidates.sort(key=lambda c: c.left_out.median())
    eligible = [c for c in candidates if model in (None, c.model)]
    near = [c for c in eligible if c.left_out.median() <= _WORTH * eligible[0].left_out.median()]
    chosen = min(near, key=lambda c: c.damper.parameter_count)
    candidates.sort(key=lambda c: c is not chosen)
    return RigStudy(rig, dataset, loops, dynamic_ranges(loops), tuple(candidates), refused, model is not None)


def usable_sines(dataset: Dataset, clipped: bool = False) -> tuple[list[Run], dict[str, str]]:
    """The runs whose motion is a sine at one current, and why the others are not used."""
    sines, refused = [], {}
    for run in dataset:
        try:
            refuse_clipped(run, clipped)
            run.current_A  # noqa: B018
            found = equivalent_sine(run)
        except InputError as error:
            refused[run.id] = str(error)
            continue
        if found.is_sine:
            sines.append(run)
        else:
            refused[run.id] = "the motion is no sine: it is predicted, but not identified from"
    return sines, refused


def _candidates(model: str, dataset: Dataset, train: Sequence[Run], progress: Progress) -> list[Candidate]:
    """Identify a model run by run, then map it in both ways."""
    begin = time.perf_counter()
    identifications = []
    for number, run in enumerate(train):
        progress(f"run {run.id}", 0.6 * number / len(train))
        identifications.append(identify(run, model))
    spent = time.perf_counter() - begin
    conditions = [i.condition for i in identifications]
    provenance = {"dataset": dataset.name, "method": identifications[0].method, "train runs": str(len(train))}
    candidates = []
    for way, share in (("run by run", 0.6), ("joint", 0.75)):
        progress(f"over all conditions, {way}", share)
        begin = time.perf_counter()
        about = {**provenance, "functions": way}
        if way == "joint":
            fit, refit = fit_modified_jointly(train, identifications, about)
        else:
            fit = fit_modified(identifications, provenance=about)
            refit = _refit_run_by_run(identifications)
        left_out = leave_one_condition_out(train, conditions, refit, title=fit.damper.title)
        seconds = spent + time.perf_counter() - begin
        held_out = validate(fit.damper, dataset.split("validate"))
        candidates.append(Candidate(model, way, tuple(identifications), fit, left_out, held_out, seconds))
    return candidates


def _paper_candidates(dataset: Dataset, train: Sequence[Run]) -> list[Candidate]:
    """The literal recipe, for its verdict beside the others; it takes sines only.

    Its alpha and beta are the optimum that the genetic search of the paper approaches. None
    where under three runs are sines.
    """
    begin = time.perf_counter()
    sines = [run for run in train if analyse_motion(run).is_sine]
    if len(sines) < 3:
        return []
    settled = Settled.of(sines, None)
    found = [settled.identify(run, Paper(search="optimum")) for run in sines]
    fit = paper_functions(found)
    left_out = leave_one_condition_out(
        sines,
        [i.condition for i in found],
        lambda rest: paper_functions([found[i] for i in rest]).damper,
        title=fit.damper.title,
    )
    seconds = time.perf_counter() - begin
    held_out = validate(fit.damper, dataset.split("validate"))
    return [Candidate("bouc-wen", "paper, literal", tuple(found), fit, left_out, held_out, seconds)]


def _joint_candidate(dataset: Dataset, train: Sequence[Run]) -> Candidate:
    """Identify the model that takes the current as an input from all train runs at once."""
    begin = time.perf_counter()
    conditions = [equivalent_sine(run).condition for run in train]
    problem = JointProblem(train, JOINTLY)
    fit = problem.fit()

    def refit(rest: Sequence[int]) -> Damper:
        # With many runs, one missing hardly moves the fit, and a single step finds where to.
        if len(train) > _MANY:
            return problem.without(fit, rest)
        return problem.fit(rest, fit.point, rounds=1, most_steps=4).damper

    left_out = leave_one_condition_out(train, conditions, refit, title=fit.damper.title)
    seconds = time.perf_counter() - begin
    held_out = validate(fit.damper, dataset.split("validate"))
    return Candidate(JOINTLY, "joint", (), fit, left_out, held_out, seconds)


def _refit_run_by_run(identifications: Sequence[Identification]) -> Callable[[Sequence[int]], Damper]:
    return lambda rest: fit_modified([identifications[i] for i in rest]).damper
