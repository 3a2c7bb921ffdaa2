"""The complete procedure: identify every run, fit parameter functions or one global model, validate.

`run_study` returns result objects, which plots, reports and files use.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.calibration import QUANTITIES, Calibration
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.joint import JointFit
from mrdamper.dampers.modified import ModifiedFit
from mrdamper.dampers.sessions import GainOffset, Sessions, known_errors
from mrdamper.data import Dataset, Displayable, Floats, Run
from mrdamper.data.displayable import joined
from mrdamper.data.progress import Progress, silent
from mrdamper.data.wording import counted
from mrdamper.errors import IdentificationError, InputError, UnknownNameError, validate_arguments
from mrdamper.identification.characteristics import Characteristics
from mrdamper.identification.loop_analysis import DynamicRange, LoopAnalysis, analyse_loop, at_levels, dynamic_ranges
from mrdamper.statistics.functions.selection import mean_error, smaller_wins
from mrdamper.statistics.linear import on_one_blas_thread
from mrdamper.study.contradictions import Contradiction
from mrdamper.study.cross_validation import NO_CURRENT
from mrdamper.study.dissipation import gains_energy
from mrdamper.study.processes import IN_PROCESS, Processes
from mrdamper.study.recipe import (
    RecipeResult,
    StudyMethod,
    catalogue,
    fit_and_score_all,
    recipes_of_study,
    study_methods,
)
from mrdamper.study.usable_runs import UsableRuns, characterise_usable
from mrdamper.study.validation import RunScore, Validation, validate

CONDITION = "condition"  # kind of fold: the runs of one condition, a stretch of another record
AWAY = ("current", "fastest motions")  # kinds that determine the growth of errors away from the tests


def headline_of(rig: str, result: RecipeResult) -> str:
    """Return rig, model and its errors in one line."""
    kinds = {"cross-validation": result.cross_validated, "validation": result.validation}
    errors = ", ".join(f"{kind} {100 * s.median():.2f} %" if s.runs else f"no {kind} runs" for kind, s in kinds.items())
    return f"{f'rig {rig}: ' if rig else ''}{result.title}, {errors} (median nrmse_pp)"


def table_of(rig: str, results: Sequence[RecipeResult]) -> dict[str, list[Any]]:
    """Return columns with a row for each model of a rig."""
    return {
        "rig": [rig] * len(results),
        "model": [result.title for result in results],
        "parameters": [result.damper.parameter_count for result in results],
        "cv_nrmse_pp": [result.cross_validated.median() for result in results],
        "validation_nrmse_pp": [result.validation.median() for result in results],
    }


@dataclass(frozen=True, eq=False, repr=False)
class RigStudy(Displayable):
    """The study of one rig."""

    rig: str
    dataset: Dataset
    loops: tuple[LoopAnalysis, ...]  # of every sine run
    ranges: tuple[DynamicRange, ...]
    # the chosen one first, the others by their mean error over the kinds of fold
    candidates: tuple[RecipeResult, ...]
    not_identified: Mapping[str, str]  # reason by run
    # by recipe, why its damper cannot be determined from this rig's data, or where its loops gain energy
    refused: Mapping[str, str]
    asked_for: bool = False  # the model was requested by the user, not selected
    # median nrmse_pp of omitted conditions, corrected by the other runs of their session (scores are for unknown
    # sessions); or why there is none
    session_known: float | str = ""
    # runs that were set aside because they contradict the others; `dataset` is without them
    contradictions: tuple[Contradiction, ...] = ()
    comparison_notes: tuple[str, ...] = ()  # of the comparison of the runs with each other
    measured: Characteristics | None = None  # of the runs, without a model; None where no cycle is steady

    @property
    def omitted(self) -> dict[str, str]:
        """Runs that are not identified though they contradict no other, and the reasons."""
        excluded = {one.run_id for one in self.contradictions}
        return {run: why for run, why in self.not_identified.items() if run not in excluded}

    @property
    def headline(self) -> str:
        """Rig, chosen model and its errors."""
        return headline_of(self.rig, self.chosen)

    @property
    def table(self) -> Mapping[str, Sequence[Any]]:
        """One row per candidate, the selected one first."""
        return table_of(self.dataset.name, self.candidates)

    @property
    def folds(self) -> Sequence[Mapping[str, tuple[float, float]]]:
        """Median and largest cross-validated nrmse_pp of every candidate, by kind of fold."""
        return [
            {kind: (float(np.median(errors)), float(np.max(errors))) for kind, errors in each.items()}
            for each in errors_by_kind(self.candidates)
        ]

    @property
    def chosen(self) -> RecipeResult:
        """The candidate with the fewest parameters among those of about the smallest error over all kinds of fold."""
        return self.candidates[0]

    @property
    def damper(self) -> Damper:
        """The chosen damper."""
        return self.chosen.damper

    @property
    def readings(self) -> list[GainOffset]:
        """Gain and offset of every identification run against the chosen damper; no score is corrected by them.

        They contain the scatter between sessions and that between runs, less what the parameters compensate for.
        """
        scores = (*self.chosen.cross_validated.runs, *self.chosen.train.runs)  # those of the damper itself come last
        return list({score.run_id: score.reading for score in scores if score.reading}.values())

    @property
    def calibration(self) -> Calibration | None:
        """Of the chosen damper's prediction intervals."""
        return self.damper.uncertainty.calibration if self.damper.uncertainty else None

    @property
    def interval_coverage(self) -> dict[str, float] | None:
        """Shares of cross-validated samples, peaks and energies inside their intervals, and the level of these."""
        calibration = self.calibration
        if calibration is None:
            return None
        return {
            "level": calibration.level,
            "units": calibration.units,
            **dict(zip(QUANTITIES, calibration.coverage, strict=True)),
        }


@dataclass(frozen=True, eq=False, repr=False)
class Study(Displayable):
    """A study of a dataset, rig by rig."""

    dataset: Dataset
    rigs: tuple[RigStudy, ...]
    seconds: float

    @property
    def headline(self) -> str:
        """Selected model and its errors, by rig."""
        return f"study of {self.dataset.name} — " + "; ".join(rig.headline for rig in self.rigs)

    @property
    def table(self) -> Mapping[str, Sequence[Any]]:
        """A row a candidate of every rig."""
        return joined(self.rigs)

    @property
    def model(self) -> Damper:
        """The damper, where the dataset holds one rig; raises `IdentificationError` if it holds several."""
        if len(self.rigs) > 1:
            names = ", ".join(r.rig for r in self.rigs)
            raise IdentificationError(
                f"the dataset holds {len(self.rigs)} rigs", remedy=f"use study.rig(name): {names}"
            )
        return next(iter(self.rigs)).damper

    def write_report(self, folder: str | Path, **options: Any) -> list[Path]:
        """Write report.html, models, tables and figures to a folder; return the written files, the report first.

        Options are keywords of `mrdamper.report.study.write_study`: about, limits, also, paper. `about` is an `About`,
        a mapping of its names to texts, or the path of a TOML file (`mrdamper init about`). Raises `AboutError` if it
        has an unknown name, and `OutputError` if the folder cannot be written to.
        """
        write = importlib.import_module("mrdamper.report.study").write_study  # draws: needed here only
        return write(self, folder, **options)

    def rig(self, name: str) -> RigStudy:
        """Return the study of one rig."""
        self.dataset.rig(name)
        return next(r for r in self.rigs if r.rig == name)


@validate_arguments()
def run_study(
    dataset: Dataset,
    progress: Progress = silent,
    *,
    model: str | StudyMethod | None = None,
    keep: Sequence[str] = (),
    processes: Processes = IN_PROCESS,
) -> Study:
    """Study a dataset: identify, map, validate, rig by rig.

    Parameters
    ----------
    dataset : Dataset
    progress : callable
        Told what is being done and the share done, 0...1.
    model : str or StudyMethod, optional
        Choose the best candidate of this model, or the recipe of this name ("bouc-wen:joint"), instead of the best of
        all; or follow this published method with its options ("paper" with its defaults).
    keep : sequence of str
        Runs that are used although they contradict the others.
    processes : Processes
        Where rigs are studied; the results are the same bits.

    Raises
    ------
    UnknownNameError
        If there is no such model, recipe, method or run.
    IdentificationError
        If a rig has too few runs to identify anything from.
    ContradictionError
        If more than a third of a rig's runs contradict the others.

    Examples
    --------
    >>> from mrdamper import Condition, load_dataset, run_study
    >>> tests = load_dataset().rig("utfsm")
    >>> study = run_study(tests.only([run for run in tests if run.excitation == "sine"][::3]))
    >>> study.rigs[0].rig
    'utfsm'
    >>> prediction = study.model.predict(Condition(current_A=0.5, frequency_Hz=2.0, amplitude_m=0.01))
    >>> bool(prediction.force.max() > 500)  # [N]
    True
    """
    begin = time.perf_counter()
    for name in keep:
        dataset[name]  # refuses a name that no run has
    study = partial(study_rig, model=model, keep=tuple(keep))
    rigs = processes.map(study, [dataset.rig(name) for name in dataset.rigs], progress)
    progress("studied", 1.0)
    return Study(dataset, tuple(rigs), time.perf_counter() - begin)


@on_one_blas_thread
def study_rig(
    dataset: Dataset,
    progress: Progress = silent,
    *,
    model: str | StudyMethod | None = None,
    keep: Collection[str] = (),
) -> RigStudy:
    """Study the runs of one rig; arguments as `run_study`."""
    methods = study_methods()
    if isinstance(model, str) and model in methods:
        model = methods[model]()
    if not isinstance(model, StudyMethod) and model is not None and model not in catalogue():
        raise UnknownNameError.of("model", str(model)[:100], (*catalogue(), *methods))
    method, model = (model, model.name) if isinstance(model, StudyMethod) else (None, model)
    rig = dataset.rigs[0]
    progress(f"{rig or 'rig'}: loops", 0.0)
    runs = UsableRuns.of(dataset, keep)
    dataset, train, everything = runs.dataset, runs.train, runs.everything
    loops = at_levels([analyse_loop(run) for run in runs.sines])
    _require_runs(train, everything, runs.unusable, f"rig {rig}" if rig else dataset.name)
    candidates, impossible = fit_and_score_all(
        recipes_of_study(train, everything, method, model if method is None else None),
        runs.held_out,
        lambda what, share: progress(f"{rig or 'rig'}: {what}", share),
        kinds=True,
    )
    candidates = [with_unused_runs(c, everything) for c in candidates]
    eligible = [c for c in candidates if model in (None, c.recipe.model, c.recipe.name)]
    if not eligible:
        reasons = [f"{n}: {why}" for n, why in impossible.items() if model in (None, n, n.partition(":")[0])]
        reasons += [f"{model}: identified from steady sines at constant current, of which there are {len(train)}"]
        raise IdentificationError(
            f"no damper could be determined; {reasons[0]}",
            where=f"rig {rig}" if rig else dataset.name,
            remedy="test more conditions, choose another --model, or leave this rig out of the dataset",
        )
    unphysical = {c.recipe.name: why for c in candidates if (why := gains_energy(c.damper))}
    eligible = [c for c in eligible if c.recipe.name not in unphysical] or eligible
    candidates = _chosen_first(candidates, eligible)
    fitted = [dataset[one.run_id] for one in candidates[0].identifications]
    chosen = _with_uncertainty(candidates[0], fitted or everything)
    candidates[0], sessions_note = _with_sessions(_with_errors(chosen), dataset)
    impossible |= unphysical
    return RigStudy(
        rig, dataset, loops, dynamic_ranges(loops), tuple(candidates), runs.not_identified, impossible,
        model is not None, sessions_note, tuple(runs.comparison.contradictions), runs.comparison.notes,
        _measured(dataset),
    )  # fmt: skip


def _measured(dataset: Dataset) -> Characteristics | None:
    """Characterise compared runs in the process of their study, which has checked them."""
    try:
        return characterise_usable(dataset, compared=True)
    except IdentificationError:
        return None


def _require_runs(sines: Sequence[Run], usable: Sequence[Run], unusable: Mapping[str, str], where: str) -> None:
    """Raise `IdentificationError` where no identification run is usable, or one sine is all there is."""
    if not usable:
        raise IdentificationError(
            "no identification run passes the checks",
            where=where,
            remedy=next((f"run {n}: {why}" for n, why in unusable.items()), "check the split column of runs.csv"),
        )
    if len(usable) == len(sines) < 2:
        raise IdentificationError(
            f"{counted(len(sines), 'identification run')} with a steady sine",
            where=where,
            remedy="a model over conditions needs at least two, or a record of other motion; check the split column",
        )


def _chosen_first(candidates: Sequence[RecipeResult], eligible: Sequence[RecipeResult]) -> list[RecipeResult]:
    """Rank candidates by their mean error over the kinds of folds; the one that `smaller_wins` chooses comes first."""
    errors = {
        id(c): {kind: values for kind, values in each.items() if kind != NO_CURRENT}
        for c, each in zip(candidates, errors_by_kind(candidates), strict=True)
    }
    ranked = sorted(candidates, key=lambda c: mean_error(errors[id(c)]))
    best = next(c for c in ranked if c in eligible)
    smaller = sorted(eligible, key=lambda c: c.damper.parameter_count)
    chosen = next(c for c in smaller if c is best or smaller_wins(errors[id(c)], errors[id(best)]))
    return sorted(ranked, key=lambda c: c is not chosen)


def _with_uncertainty(chosen: RecipeResult, taken: Sequence[Run]) -> RecipeResult:
    """Return the candidate with the uncertainty that the runs it is fitted to and its omitted runs show."""
    held = chosen.fit.at_bounds if isinstance(chosen.fit, JointFit | ModifiedFit) else ()
    beside = [score.predicted for score in chosen.cross_validated.runs if score.predicted is not None]
    away, other_sessions = (
        [score.predicted for kind in kinds for score in _runs(chosen, kind) if score.predicted is not None]
        for kinds in (AWAY, ("session",))
    )
    damper = estimate_uncertainty(chosen.damper, taken, beside, held, away=away, other_sessions=other_sessions)
    return replace(chosen, damper=damper)


def _with_errors(chosen: RecipeResult) -> RecipeResult:
    """Return the candidate with its mean cross-validated errors, by kind of fold, among the facts of its damper."""
    errors = {
        f"cross-validation, {kind}": [abs(run.scores.nrmse_pp) for run in _runs(chosen, kind)]
        for kind in (CONDITION, *chosen.by_kind)
        if kind != NO_CURRENT
    }
    means = {kind: f"{100 * np.mean(each):.2f} %" for kind, each in errors.items() if each}
    return replace(chosen, damper=replace(chosen.damper, provenance={**chosen.damper.provenance, **means}))


def _with_sessions(chosen: RecipeResult, dataset: Dataset) -> tuple[RecipeResult, float | str]:
    """Return the candidate with what sessions share, and its cross-validated error with them known, or a reason."""
    damper, own = chosen.damper, {score.run_id: score.reading for score in chosen.train.runs}
    # A record whose parts several folds predict has no gain of its own.
    scored = [
        (dataset[score.run_id], score.reading, reading)
        for score in chosen.cross_validated.runs
        if score.reading is not None and (reading := own.get(score.run_id)) is not None
    ]
    runs, readings = [run for run, _, _ in scored], [left_out for _, left_out, _ in scored]
    try:
        sessions = Sessions.of(runs, readings, [reading for _, _, reading in scored])
        error = float(np.median(known_errors(sessions, runs, readings)))
    except InputError as reason:
        return chosen, str(reason)
    if damper.uncertainty is None:
        return chosen, error
    uncertainty = replace(damper.uncertainty, sessions=sessions)
    return replace(chosen, damper=replace(damper, uncertainty=uncertainty)), error


def with_unused_runs(candidate: RecipeResult, everything: Sequence[Run]) -> RecipeResult:
    """Add scores of the identification runs that the recipe could not use to its cross-validated ones."""
    scored = {score.run_id for score in (*candidate.train.runs, *candidate.cross_validated.runs)}
    others = validate(candidate.damper, [run for run in everything if run.id not in scored])
    if not others.runs:
        return candidate
    left_out = candidate.cross_validated
    return replace(
        candidate, cross_validated=Validation(left_out.title, (*left_out.runs, *others.runs), others.refused)
    )


def errors_by_kind(candidates: Sequence[RecipeResult]) -> list[dict[str, Floats]]:
    """Cross-validated errors of the runs that all candidates have, by kind of fold, in the order of their names.

    A run that a candidate cannot take was omitted from it in every way; one that no damper could be made without
    counts as infinitely wrong.
    """
    by_candidate: list[dict[str, Floats]] = [{} for _ in candidates]
    for kind in dict.fromkeys(name for c in candidates for name in (CONDITION, *c.by_kind)):
        errors: list[dict[str, float]] = []
        for candidate in candidates:
            own = {run.run_id: abs(run.scores.nrmse_pp) for run in candidate.cross_validated.runs}
            left_out = {run.run_id: abs(run.scores.nrmse_pp) for run in _runs(candidate, kind)}
            refused: Mapping[str, str] = candidate.by_kind[kind].refused if kind in candidate.by_kind else {}
            errors.append({**own, **left_out, **dict.fromkeys(refused, np.inf)})
        of_any = {run.run_id for c in candidates for run in _runs(c, kind)}
        common = sorted(of_any.intersection(*errors))
        for errors_of, row in zip(by_candidate, errors, strict=True):
            if common:
                errors_of[kind] = np.array([row[name] for name in common])
    return by_candidate


def _runs(candidate: RecipeResult, kind: str) -> Sequence[RunScore]:
    """Scores of runs whose fold of a kind was omitted."""
    if kind == CONDITION:
        return candidate.cross_validated.runs
    return candidate.by_kind[kind].runs if kind in candidate.by_kind else ()
