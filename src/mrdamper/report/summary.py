"""Summary of a study for the terminal and for the first page of its report."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrdamper.dampers.uncertainty import table
from mrdamper.data.runs import once_per_run
from mrdamper.data.wording import counted
from mrdamper.errors import listed
from mrdamper.report.limitations import limitations
from mrdamper.study.recipe import RecipeResult
from mrdamper.study.validation import Validation, peak_band
from mrdamper.study.workflow import RigStudy, Study

LEVEL = 0.9  # coverage of the stated prediction intervals [-]
_MAX_LINES = 20  # number of lines on a terminal
_MAX_LIMITATIONS = 5  # number of limitations on a terminal
_MUCH_SMALLER = 2 / 3  # of the validation error of the selected model


@dataclass(frozen=True)
class IntervalCheck:
    """Prediction intervals of the peak force against measured validation runs."""

    # inside and runs: runs whose measured peak force lies inside its interval, of how many
    inside: int
    runs: int
    half_width: float  # median half width of the interval over the predicted peak force [-]


@once_per_run  # of the page and of the terminal
def check_intervals(rig: RigStudy) -> IntervalCheck | None:
    """Compare the prediction intervals of the peak force with the validation runs; None where there are none."""
    rows = [peak_band(rig.damper, rig.dataset[run.run_id], LEVEL) for run in rig.chosen.validation.runs]
    rows = [row for row in rows if "peak_force_low_N" in row]
    if not rows:
        return None
    low, high, measured = (
        np.array([row[f"peak_force_{name}_N"] for row in rows]) for name in ("low", "high", "measured")
    )
    half = float(np.median((high - low) / (high + low)))
    return IntervalCheck(int(np.sum((low <= measured) & (measured <= high))), len(rows), half)


def error_sentence(rig: RigStudy) -> str:
    """State the prediction error and the prediction interval in one sentence."""
    chosen = rig.chosen
    scores, runs = (
        (chosen.validation, "validation runs") if chosen.validation.runs else (chosen.cross_validated, "runs")
    )
    how = "" if chosen.validation.runs else " in leave-one-condition-out cross-validation"
    text = (
        f"The model predicts the force of {len(scores.runs)} {runs}{how} with a median error of "
        f"{100 * scores.median():.1f} % of the peak-to-peak force (largest {100 * scores.worst_error():.1f} %)"
    )
    intervals = check_intervals(rig)
    if intervals is None:
        return text + "."
    future = " in a future test session" if rig.damper.uncertainty and rig.damper.uncertainty.of_sessions else ""
    return text + (
        f"; the {100 * LEVEL:.0f} % prediction interval of the peak force{future} is "
        f"±{100 * intervals.half_width:.0f} %, and {intervals.inside} of the {intervals.runs} measured peak forces "
        "lie inside it."
    )


def omission_lines(results: Sequence[RecipeResult], reasons: Mapping[str, str], most: int) -> list[str]:
    """List the runs without an individual fit, and those that are not used; one line per reason."""
    used = {score.run_id for r in results for v in (r.train, r.cross_validated, r.validation) for score in v.runs}
    groups: dict[tuple[str, str], list[str]] = {}
    for run, why in reasons.items():
        groups.setdefault(("no individual fit" if run in used else "not used", why), []).append(run)
    return [f"{what}: {listed(runs, most)} ({why})" for (what, why), runs in groups.items()]


def study_lines(study: Study, files: Sequence[str], *, verbose: bool = False) -> list[str]:
    """Summarise a study in at most 20 lines; with `verbose` every model, parameter and limitation."""
    runs, name = study.dataset.runs, study.dataset.name
    validation = sum(run.split == "validate" for run in runs)
    head = f"{name}: {len(runs)} runs, {len(runs) - validation} for identification, {validation} for validation"
    lines = [head]
    fixed = 1 + len(files)
    per_rig = (_MAX_LINES - fixed) // max(len(study.rigs), 1)
    shown = min(per_rig - 6, math.ceil(_MAX_LIMITATIONS / len(study.rigs)) if len(study.rigs) < 3 else 0)
    left = _MAX_LIMITATIONS
    for rig in study.rigs:
        block, used = _rig_lines(rig, max(min(shown, left), 0), verbose=verbose)
        left -= used
        lines += block if verbose else block[: max(per_rig, 1)]
    if not verbose and len(lines) + len(files) > _MAX_LINES:
        rest = len(lines) + len(files) - _MAX_LINES + 1
        lines = [*lines[: _MAX_LINES - len(files) - 1], f"... {rest} more lines with --verbose"]
    return [*lines, *files]


def _rig_lines(rig: RigStudy, shown: int, *, verbose: bool) -> tuple[list[str], int]:
    chosen = rig.chosen
    lines = [
        f"{rig.dataset.name}: {chosen.title}, {chosen.damper.parameter_count} parameters, "
        + counted(len(chosen.identifications) or len(chosen.cross_validated.runs), "identification run"),
        f"  force error (median, worst run): {_errors('cross-validation', chosen.cross_validated)}; "
        f"{_errors('validation', chosen.validation)}",
    ]
    if intervals := check_intervals(rig):
        lines.append(
            f"  {100 * LEVEL:.0f} % prediction interval of the peak force: ±{100 * intervals.half_width:.0f} %; "
            f"{intervals.inside} of {counted(intervals.runs, 'validation run')} inside"
        )
    if rig.calibration is not None:
        lines.append(f"  {rig.calibration.summary}")
    others = rig.candidates[1:]
    same_model = [c for c in others[1:] if rig.asked_for and c.recipe.model == chosen.recipe.model]
    validated = [c for c in others if c not in (*others[:1], *same_model) and _is_validated_better(chosen, c)]
    best_validated = sorted(validated, key=lambda c: c.validation.median())[:1]
    for other in others if verbose else [*others[:1], *same_model, *best_validated]:
        is_better = rig.asked_for and other.cross_validated.median() < chosen.cross_validated.median()
        is_next = other not in (*same_model, *best_validated)
        label = "smaller error" if is_better else "next best" if is_next else "compared"
        lines.append(
            f"  {'compared' if verbose else label}: {other.title}, {other.damper.parameter_count} parameters, "
            f"{_errors('cross-validation', other.cross_validated)}{_why_not(rig, other)}{_validated(chosen, other)}"
        )
    if verbose:
        lines += [f"  {row['name']} = {row['written']}" for row in table(rig.damper)]
    entries = [
        text for texts in limitations(chosen, rig.loops, rig.dataset, rig.comparison_notes).values() for text in texts
    ]
    listed = entries if verbose else entries[:shown]
    if listed:
        more = len(entries) - len(listed)
        lines.append(f"  limitations{f' ({more} more with --verbose)' if more else ''}:")
        lines += [f"  - {text}" for text in listed]
    return lines, len(listed)


def _why_not(rig: RigStudy, other: RecipeResult) -> str:
    """State why a model with a smaller cross-validation error over conditions is not the selected one."""
    chosen = rig.chosen
    is_open = not rig.asked_for or other.recipe.model == chosen.recipe.model
    if not is_open or not other.cross_validated.median() < chosen.cross_validated.median():
        return ""
    if other.recipe.name in rig.refused:
        return f"; not eligible: {rig.refused[other.recipe.name]}"
    if other.damper.parameter_count > chosen.damper.parameter_count:
        return "; in cross-validation over all kinds not better by a standard error"
    return "; in cross-validation over all kinds worse by a standard error"


def _is_validated_better(chosen: RecipeResult, other: RecipeResult) -> bool:
    return other.validation.median() < _MUCH_SMALLER * chosen.validation.median()


def _validated(chosen: RecipeResult, other: RecipeResult) -> str:
    """State a much smaller error of the validation runs, which have no part in the selection."""
    if not _is_validated_better(chosen, other):
        return ""
    smaller, larger = (f"{100 * each.validation.median():.2f} %" for each in (other, chosen))
    name = other.recipe.name
    return f"; validation error {smaller} instead of {larger}, without effect on the selection: --model {name} takes it"


def _errors(kind: str, scores: Validation) -> str:
    if not scores.runs:
        return f"no {kind} runs"
    return f"{kind} {100 * scores.median():.2f} %, {100 * scores.worst_error():.1f} %"
