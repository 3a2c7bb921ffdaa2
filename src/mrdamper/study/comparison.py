"""Comparison of models on the same data, ranked by cross-validation over conditions.

A damper over all conditions follows from individual fits with parameter functions, from the published functions of
current, frequency and amplitude, or from one global fit. All are scored on identification runs, cross-validated
conditions and validation runs.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mrdamper.data import Dataset, Displayable, Run
from mrdamper.data.displayable import joined
from mrdamper.data.progress import Progress, silent
from mrdamper.errors import IdentificationError, InputError, validate_arguments
from mrdamper.identification import Identification
from mrdamper.identification.basis import Basis
from mrdamper.physics.motion.sines import pure_sines
from mrdamper.study.parallel import follow_each, identify_each
from mrdamper.study.processes import several
from mrdamper.study.recipe import IdentificationCache, Recipe, RecipeResult, StudyMethod, recipes, recipes_of_models
from mrdamper.study.usable_runs import UsableRuns
from mrdamper.study.workflow import headline_of, table_of, with_unused_runs

RANKING = (
    "ranked by cross-validation over conditions; mrdamper study chooses the smallest model within one standard error "
    "of the best over conditions, currents, motions and sessions and in its worst kind of these, which may be another"
)


@dataclass(frozen=True, eq=False, repr=False)
class RigComparison(Displayable):
    """All recipes on one rig, the best in cross-validation over conditions first."""

    rig: str
    dataset: Dataset
    sines: frozenset[str]  # runs of a steady sine; validation errors of other motions are separate
    entries: tuple[RecipeResult, ...]
    refused: Mapping[str, str]  # by recipe, why this rig's data do not allow it
    not_identified: Mapping[str, str]  # reason by run

    @property
    def headline(self) -> str:
        """Rig, the model of the smallest cross-validation error, and its errors."""
        return headline_of(self.rig, self.entries[0]) if self.entries else f"no model of rig {self.rig}"

    @property
    def table(self) -> Mapping[str, Sequence[Any]]:
        """One row per model, the smallest cross-validation error first."""
        return table_of(self.dataset.name, self.entries)


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Displayable):
    """The comparison of a dataset, rig by rig."""

    dataset: Dataset
    rigs: tuple[RigComparison, ...]
    seconds: float
    jobs: int

    @property
    def headline(self) -> str:
        """The model of the smallest cross-validation error, by rig."""
        return f"comparison on {self.dataset.name} — " + "; ".join(rig.headline for rig in self.rigs)

    @property
    def table(self) -> Mapping[str, Sequence[Any]]:
        """One row per model of every rig."""
        return joined(self.rigs)


@validate_arguments()
def compare(
    dataset: Dataset,
    names: Sequence[str] = (),
    *,
    genetic: bool = False,
    method: StudyMethod | None = None,
    jobs: int | None = None,
    progress: Progress = silent,
) -> Comparison:
    """Compare models on a dataset.

    Parameters
    ----------
    dataset : Dataset
    names : sequence of str
        Models, each in all its ways ("bouc-wen"), or one of their ways ("bouc-wen:individual", "bouc-wen:joint");
        default all but the genetic ones.
    genetic : bool
        Include identification by genetic algorithm; of the named models, where some are named.
    method : StudyMethod, optional
        Options of a published method, as the gas spring and presets of `PaperOptions`.
    jobs : int, optional
        Processes; default one per core. Any number gives the same bits.
    progress : callable

    Raises
    ------
    UnknownNameError
        If there is no such model.
    InputError
        E_OPTION, if the named models have no genetic search, or `method` is none of them.
    IdentificationError
        If a rig has too few train sines, and no record of other motion.

    Examples
    --------
    >>> from mrdamper import compare, load_dataset
    >>> comparison = compare(load_dataset().rig("utfsm"), ["bingham"], jobs=1)
    >>> comparison.rigs[0].rig
    'utfsm'
    """
    begin = time.perf_counter()
    chosen = recipes(recipes_of_models(names), genetic, method)
    workers = jobs or os.cpu_count() or 1
    rigs = [_usable(dataset.rig(name)) for name in dataset.rigs]
    completed = [_completed(chosen, rig) for rig in rigs]
    tasks, steps = list[tuple[Basis, Run]](), list[tuple[Recipe, Sequence[Run], Sequence[Run]]]()
    for rig, (recipes_of_rig, _) in zip(rigs, completed, strict=True):
        bases = dict.fromkeys(recipe.basis for recipe in recipes_of_rig if recipe.basis)
        tasks += [(basis, run) for basis in bases for run in rig.sines]
        steps += [(recipe, rig.train if recipe.basis else rig.everything, rig.held_out) for recipe in recipes_of_rig]
    steps = [step for step in steps if step[1]]
    steps.sort(key=lambda step: step[0].basis is not None and not step[0].basis.costly)
    with several(workers) as processes:
        cache = identify_each(tasks, processes, lambda what, share: progress(what, 0.5 * share))
        results = follow_each(steps, cache, processes, lambda what, share: progress(what, 0.5 + 0.5 * share))
    followed = {(runs[0].rig, recipe.name): one for (recipe, runs, _), one in zip(steps, results, strict=True)}
    compared = tuple(_ranked(rig, *one, followed, cache) for rig, one in zip(rigs, completed, strict=True))
    progress("compared", 1.0)
    return Comparison(dataset, compared, time.perf_counter() - begin, workers)


def _usable(rig: Dataset) -> UsableRuns:
    runs = UsableRuns.of(rig)
    if len(runs.train) < 3 and len(runs.everything) == len(runs.train):
        raise IdentificationError(
            "fewer than three identification runs with a steady sine", where=rig.name, remedy="check the split column"
        )
    return runs


def _completed(chosen: Sequence[Recipe], rig: UsableRuns) -> tuple[list[Recipe], dict[str, str]]:
    """Complete the recipes for a rig, with the reasons why its runs do not allow some."""
    pure = pure_sines(rig.train)
    recipes_of_rig, refused = list[Recipe](), dict[str, str]()
    for recipe in chosen:
        try:
            recipes_of_rig.append(recipe.for_runs(pure))
        except InputError as error:
            refused[recipe.name] = str(error)
    return recipes_of_rig, refused


def _ranked(
    rig: UsableRuns,
    chosen: Sequence[Recipe],
    impossible: Mapping[str, str],
    followed: Mapping[tuple[str, str], RecipeResult | str],
    cache: IdentificationCache,
) -> RigComparison:
    name = rig.dataset.rigs[0]
    results = dict(impossible) | {
        recipe.name: followed.get((name, recipe.name), "no identification runs with a steady sine") for recipe in chosen
    }
    refused = {recipe: why for recipe, why in results.items() if isinstance(why, str)}
    entries = [with_unused_runs(one, rig.everything) for one in results.values() if isinstance(one, RecipeResult)]
    if not entries:
        recipe, reason = next(iter(refused.items()))
        raise IdentificationError(
            f"no model could be compared; {recipe}: {reason}",
            where=f"rig {name}" if name else rig.dataset.name,
            remedy="choose other models with --models, or leave this rig out of the dataset",
        )
    entries = [replace(entry, per_run=_per_run(entry.recipe.basis, rig.sines, cache)) for entry in entries]
    entries.sort(key=lambda entry: entry.cross_validated.median())
    steady = frozenset(run.id for run in rig.sines)
    return RigComparison(name, rig.dataset, steady, tuple(entries), refused, rig.not_identified)


def _per_run(basis: Basis | None, sines: Sequence[Run], cache: IdentificationCache) -> float:
    """Median error of the individual fits of all sines, including the validation runs."""
    every = [cache[basis, run.id][0] for run in sines] if basis else []
    errors = [one.scores.nrmse_pp for one in every if isinstance(one, Identification)]
    return float(np.median(errors)) if errors else float("nan")
