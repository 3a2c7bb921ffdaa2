"""Every model on the same data: accuracy, numbers, data, time; ranked by conditions left out.

A model is identified run by run, then made a damper over all conditions in its own way:
parameter functions, the published laws over current, frequency and amplitude, or one joint
fit. All are judged alike: on the train runs, on conditions left out, on held-out runs.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import JointProblem
from mrdamper.dampers.modified import fit_modified, fit_modified_jointly
from mrdamper.data import Dataset, Run
from mrdamper.errors import IdentificationError, InputError
from mrdamper.identification import Identification
from mrdamper.motion import equivalent_sine
from mrdamper.study.comparison.contestants import (
    Basis,
    Contestant,
    conditions_needed,
    contestants,
    limits,
    source,
    title,
)
from mrdamper.study.comparison.parallel import Found, identify_all
from mrdamper.study.workflow import Progress, usable_sines
from mrdamper.validation import Validation, leave_one_condition_out, validate

__all__ = ["Comparison", "Entry", "RigComparison", "compare", "contestants"]


@dataclass(frozen=True, eq=False)
class Entry:
    """How one model did on one rig.

    Attributes
    ----------
    name, title, source, limits : str
    damper : Damper
    identifications : tuple of Identification
        Of the train runs; empty where nothing is identified from single runs.
    per_run : float
        Median nrmse_pp of all sine runs, each identified for itself; NaN without.
    numbers_per_run : int
        Parameters determined from a single run.
    train, left_out, held_out, other : Validation
        Train runs; train runs predicted without their condition; held-out sines; held-out other motions.
    runs_needed : int
        Fewest conditions that determine it.
    seconds : float
        Identification of the train runs on one core, and the fit over conditions.
    """

    name: str
    title: str
    source: str
    limits: str
    damper: Damper
    identifications: tuple[Identification, ...]
    per_run: float
    numbers_per_run: int
    train: Validation
    left_out: Validation
    held_out: Validation
    other: Validation
    runs_needed: int
    seconds: float


@dataclass(frozen=True, eq=False)
class RigComparison:
    """All entries of one rig, the best on left-out conditions first.

    Attributes
    ----------
    rig : str
    dataset : Dataset
    entries : tuple of Entry
    refused : mapping of name to reason
        Models that could not be determined from this rig's data.
    not_identified : mapping of run id to reason
    """

    rig: str
    dataset: Dataset
    entries: tuple[Entry, ...]
    refused: Mapping[str, str]
    not_identified: Mapping[str, str]


@dataclass(frozen=True, eq=False)
class Comparison:
    """The comparison of a dataset, rig by rig."""

    dataset: Dataset
    rigs: tuple[RigComparison, ...]
    seconds: float
    jobs: int


def compare(
    dataset: Dataset,
    names: Sequence[str] = (),
    *,
    genetic: bool = False,
    jobs: int | None = None,
    progress: Progress = lambda what, share: None,
) -> Comparison:
    """Compare models on a dataset.

    Parameters
    ----------
    dataset : Dataset
    names : sequence of str
        Models; default all but the genetic ones.
    genetic : bool
        Include identification by genetic algorithm.
    jobs : int, optional
        Processes; default one a core. Any number gives the same bits. A script that calls this
        needs `if __name__ == "__main__":`, because the processes import it anew.
    progress : callable

    Raises
    ------
    UnknownNameError
        If there is no such model.
    IdentificationError
        If a rig has too few train sines.
    """
    begin = time.perf_counter()
    chosen = contestants(names, genetic)
    workers = jobs or os.cpu_count() or 1
    rigs = [dataset.rig(name) for name in dataset.rigs]
    sorted_runs = [usable_sines(rig) for rig in rigs]
    for rig, (sines, _) in zip(rigs, sorted_runs, strict=True):
        if len([run for run in sines if run.split == "train"]) < 3:
            raise IdentificationError(
                "under three train runs with a steady sine", where=f"rig {rig.name}", mend="check the split column"
            )
    runs = [run for sines, _ in sorted_runs for run in sines]
    bases = list(dict.fromkeys(c.basis for c in chosen if c.basis))
    found = identify_all(bases, runs, workers, lambda what, share: progress(what, 0.7 * share))
    compared = []
    for number, (rig, (sines, refused)) in enumerate(zip(rigs, sorted_runs, strict=True)):

        def tell(what: str, share: float, number: int = number) -> None:
            progress(what, 0.7 + 0.3 * (number + share) / len(rigs))

        compared.append(_compare_rig(rig, sines, refused, chosen, found, tell))
    progress("compared", 1.0)
    return Comparison(dataset, tuple(compared), time.perf_counter() - begin, workers)


def _compare_rig(
    rig: Dataset,
    sines: Sequence[Run],
    not_identified: Mapping[str, str],
    chosen: Sequence[Contestant],
    found: Found,
    progress: Progress,
) -> RigComparison:
    entries, refused = [], {}
    for number, contestant in enumerate(chosen):
        progress(f"{rig.name}: {contestant.name} over all conditions", number / len(chosen))
        try:
            entries.append(_enter(contestant, rig, sines, found))
        except InputError as error:
            refused[contestant.name] = str(error)
    if not entries:
        name, reason = next(iter(refused.items()))
        raise IdentificationError(
            f"no model could be compared; {name}: {reason}",
            where=f"rig {rig.rigs[0] or rig.name}",
            mend="choose other models with --models, or leave this rig out of the dataset",
        )
    entries.sort(key=lambda entry: entry.left_out.median())
    return RigComparison(rig.rigs[0], rig, tuple(entries), refused, not_identified)


def _enter(contestant: Contestant, rig: Dataset, sines: Sequence[Run], found: Found) -> Entry:
    train = [run for run in sines if run.split == "train"]
    identifications, per_run, spent = _gathered(contestant.basis, sines, found)
    conditions = [equivalent_sine(run).condition for run in train]
    begin = time.perf_counter()
    damper, refit = _made(contestant, train, identifications)
    spent += time.perf_counter() - begin
    left_out = leave_one_condition_out(train, conditions, refit, title=damper.title)
    sine_ids = {run.id for run in sines}
    unseen = rig.split("validate")
    return Entry(
        name=contestant.name,
        title=title(contestant, damper),
        source=source(contestant),
        limits=limits(contestant),
        damper=damper,
        identifications=identifications,
        per_run=per_run,
        numbers_per_run=len(identifications[0].free) if identifications else 0,
        train=validate(damper, train),
        left_out=left_out,
        held_out=validate(damper, [run for run in unseen if run.id in sine_ids]),
        other=validate(damper, [run for run in unseen if run.id not in sine_ids]),
        runs_needed=conditions_needed(damper),
        seconds=spent,
    )


def _gathered(
    basis: Basis | None, sines: Sequence[Run], found: Found
) -> tuple[tuple[Identification, ...], float, float]:
    """Identifications of the train runs, median error of all runs, seconds for the train runs."""
    if basis is None:
        return (), float("nan"), 0.0
    results = {run.id: found[basis, run.id] for run in sines}
    failed = next((f"run {run_id}: {r[0]}" for run_id, r in results.items() if isinstance(r[0], str)), None)
    if failed:
        raise IdentificationError(failed)
    identified = [r for r, _ in results.values() if isinstance(r, Identification)]
    train = {run.id for run in sines if run.split == "train"}
    return (
        tuple(i for i in identified if i.run_id in train),
        float(np.median([i.scores.nrmse_pp for i in identified])),
        sum(results[run_id][1] for run_id in train),
    )


def _made(
    contestant: Contestant, train: Sequence[Run], identifications: Sequence[Identification]
) -> tuple[Damper, Callable[[Sequence[int]], Damper]]:
    """The damper, and how to make it from some of the runs only."""
    about = {"train runs": str(len(train)), "comparison": contestant.name}
    if contestant.damper is not None:
        cls = contestant.damper

        def refit(rows: Sequence[int]) -> Damper:
            return cls.fit([train[i] for i in rows], [identifications[i] for i in rows] if cls.basis else [], about)

        return refit(range(len(train))), refit
    if contestant.basis is None:
        problem = JointProblem(train, contestant.name)
        fit = problem.fit()
        return fit.damper, lambda rows: problem.without(fit, rows)

    if contestant.jointly:
        joint, rejoin = fit_modified_jointly(train, identifications, about)
        return joint.damper, rejoin

    def remap(rows: Sequence[int]) -> Damper:
        return fit_modified([identifications[i] for i in rows], provenance=about).damper

    return remap(range(len(train))), remap
