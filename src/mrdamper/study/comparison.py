"""Every model on the same data: accuracy, numbers, data, time; ranked by conditions left out.

A model is identified run by run, then made a damper over all conditions in its own way:
parameter functions, the published laws over current, frequency and amplitude, or one joint
fit. All are judged alike: on the train runs, on conditions left out, on held-out runs.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.data import Dataset, Run
from mrdamper.errors import IdentificationError
from mrdamper.identification import Identification
from mrdamper.study.parallel import identify_all
from mrdamper.study.recipe import Basis, Found, Progress, Recipe, Scored, follow_all, recipes
from mrdamper.study.workflow import believed, judged_on_all, usable, usable_sines


@dataclass(frozen=True, eq=False)
class RigComparison:
    """All recipes on one rig, the best on left-out conditions first.

    Attributes
    ----------
    rig : str
    dataset : Dataset
    sines : frozenset of str
        Runs whose motion is a steady sine; held-out errors of other motions stand apart.
    entries : tuple of Scored
    refused : mapping of name to reason
        Recipes that could not be followed with this rig's data.
    not_identified : mapping of run id to reason
    """

    rig: str
    dataset: Dataset
    sines: frozenset[str]
    entries: tuple[Scored, ...]
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
        If a rig has too few train sines, and no record of other motion.
    """
    begin = time.perf_counter()
    chosen = recipes(names, genetic)
    workers = jobs or os.cpu_count() or 1
    rigs = [dataset.rig(name) for name in dataset.rigs]
    sorted_runs = [usable_sines(rig) for rig in rigs]
    for rig, (sines, _) in zip(rigs, sorted_runs, strict=True):
        if len([run for run in sines if run.split == "train"]) < 3 and not _others(rig, sines):
            raise IdentificationError(
                "under three train runs with a steady sine", where=f"rig {rig.name}", mend="check the split column"
            )
    runs = [run for sines, _ in sorted_runs for run in sines]
    bases = list(dict.fromkeys(recipe.basis for recipe in chosen if recipe.basis))
    tasks = [(basis, run) for basis in bases for run in runs]
    found = identify_all(tasks, workers, lambda what, share: progress(what, 0.7 * share))
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
    chosen: Sequence[Recipe],
    found: Found,
    progress: Progress,
) -> RigComparison:
    train = [run for run in sines if run.split == "train"]
    everything = [*train, *_others(rig, sines)]
    steps = [(recipe, train if recipe.basis else everything) for recipe in chosen]
    held_out = [run for run in believed(rig)[0] if run.split == "validate"]
    entries, refused = follow_all(steps, held_out, progress, found=found)
    if not entries:
        name, reason = next(iter(refused.items()))
        raise IdentificationError(
            f"no model could be compared; {name}: {reason}",
            where=f"rig {rig.rigs[0] or rig.name}",
            mend="choose other models with --models, or leave this rig out of the dataset",
        )
    entries = [judged_on_all(entry, everything) for entry in entries]
    entries = [replace(entry, per_run=_per_run(entry.recipe.basis, sines, found)) for entry in entries]
    entries.sort(key=lambda entry: entry.left_out.median())
    steady = frozenset(run.id for run in sines)
    return RigComparison(rig.rigs[0], rig, steady, tuple(entries), refused, not_identified)


def _others(rig: Dataset, sines: Sequence[Run]) -> list[Run]:
    """Train runs of any other motion or a current that changes, which the joint model takes too."""
    known = {run.id for run in sines}
    return usable(run for run in believed(rig)[0] if run.split == "train" and run.id not in known)[0]


def _per_run(basis: Basis | None, sines: Sequence[Run], found: Found) -> float:
    """Median error of all sines, the held-out ones too, each identified for itself."""
    every = [found[basis, run.id][0] for run in sines] if basis else []
    errors = [one.scores.nrmse_pp for one in every if isinstance(one, Identification)]
    return float(np.median(errors)) if errors else float("nan")
