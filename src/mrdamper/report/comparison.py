"""A comparison as files: comparison.html, comparison.csv, runs.csv, comparison.json, models and figures."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mrdamper.dampers.model_file import dump_model
from mrdamper.data import Run
from mrdamper.data.atomic import ResultRecord, publish
from mrdamper.data.encoding import csv_text, file_names, finite
from mrdamper.data.progress import Progress, silent
from mrdamper.data.wording import counted, number
from mrdamper.report.page import made_from, render_page
from mrdamper.report.plots.comparison import overlaid_loops, ranking
from mrdamper.report.plots.cycle import spread_out
from mrdamper.report.plots.style import Picture, picture_files, picture_of
from mrdamper.report.summary import omission_lines
from mrdamper.report.tables import score_rows
from mrdamper.study.comparison import RANKING, Comparison, RigComparison
from mrdamper.study.recipe import RecipeResult

_LOOPS, _OVERLAID = 3, 5


def write_comparison(
    comparison: Comparison, folder: str | Path, progress: Progress = silent, *, png: bool = False
) -> list[Path]:
    """Write the comparison atomically, its figures with `png` also as PNG; return the files, the page first."""
    chapters, parts = [], file_names(rig.rig for rig in comparison.rigs)
    models, figures = {}, {}
    for place, rig in enumerate(comparison.rigs):
        progress(f"{rig.rig or 'rig'}: figures", place / len(comparison.rigs))
        suffix = f"-{parts[rig.rig]}" if len(comparison.rigs) > 1 else ""
        pictures = _pictures(rig, ("png",) if png else ())
        figures |= picture_files(pictures, suffix)
        chapters.append(_chapter(rig, pictures))
        for entry in rig.entries:
            models[f"models/{entry.recipe.name.replace(':', '-')}{suffix}.json"] = dump_model(entry.damper)
    footer = f"{made_from(comparison.dataset)}."
    title = f"MR damper models compared: {', '.join(r.rig for r in comparison.rigs) or comparison.dataset.name}"
    rows = [{k: v for k, v in row.items() if k != "seconds"} for row in summary_rows(comparison)]
    files = {
        "comparison.html": render_page("comparison.html.j2", title, footer, chapters=chapters, ranking=RANKING),
        "comparison.csv": csv_text(rows),
        "runs.csv": csv_text(run_rows(comparison)),
        "comparison.json": json.dumps(rows, indent=1, ensure_ascii=False) + "\n",
    }
    took = {rig.dataset.name: {entry.recipe.name: entry.seconds for entry in rig.entries} for rig in comparison.rigs}
    record = ResultRecord("compare", seconds={"in all": comparison.seconds, **took}, processes=comparison.jobs)
    written = publish(folder, {**files, **models, **figures}, record)
    progress("written", 1.0)
    return written


def summary_rows(comparison: Comparison) -> list[dict[str, Any]]:
    """One row per rig and model, best first: scores as fractions, counts, seconds, reason."""
    return [row for rig in comparison.rigs for row in _rows(rig)]


def run_rows(comparison: Comparison) -> list[dict[str, Any]]:
    """One row per model, set and run, scores as fractions; "per run" rows are individual fits."""
    rows = []
    for rig in comparison.rigs:
        for entry in rig.entries:
            head = {"rig": rig.dataset.name, "model": entry.recipe.name, "set": "per run"}
            fits = [{"run_id": one.run_id, "nrmse_pp": one.scores.nrmse_pp} for one in entry.identifications]
            rows += [head | fit for fit in fits]
            rows += score_rows(rig.dataset.name, entry, "train", "cross-validation", "validation")
    return rows


def _rows(rig: RigComparison) -> list[dict[str, Any]]:
    return [
        {
            "rig": rig.dataset.name,
            "rank": rank,
            "model": entry.recipe.name,
            "title": entry.title,
            **entry.errors,
            "validation_energy_error": finite(entry.validation.median("energy_error")),
            "parameters_per_run": entry.parameters_per_run,
            "parameters": entry.damper.parameter_count,
            "conditions_needed": entry.conditions_needed,
            "forces_computed_per_run": (
                int(np.median([one.evaluations for one in entry.identifications])) if entry.identifications else None
            ),
            "seconds": entry.seconds,
            "limits": entry.recipe.limits,
            "source": entry.recipe.source,
            "reason": _reason(entry, rig.entries),
        }
        for rank, entry in enumerate(rig.entries, start=1)
    ]


def _reason(entry: RecipeResult, entries: Sequence[RecipeResult]) -> str:
    own, best = entry.cross_validated.median(), entries[0]
    text = f"{100 * own:.1f} % in cross-validation with {entry.damper.parameter_count} parameters"
    if entry is best:
        text += ": the lowest error"
    else:
        ratio = own / best.cross_validated.median()
        text += f", {number(ratio, 2)} times" if ratio >= 2 else f", {100 * (ratio - 1):.0f} % above"
        text += " the lowest"
    better = [e for e in entries if e.cross_validated.median() <= own]
    leaner = [e for e in better if e.damper.parameter_count < entry.damper.parameter_count]
    if leaner and entry is not best:
        fewest = min(leaner, key=lambda e: e.damper.parameter_count)
        error = 100 * fewest.cross_validated.median()
        text += f"; {fewest.title} has {error:.1f} % with {fewest.damper.parameter_count}"
    if math.isfinite(entry.per_run) and own > 1.5 * entry.per_run:
        text += f"; best possible fit of a single run: {100 * entry.per_run:.1f} %"
    return text


def _pictures(rig: RigComparison, also: Sequence[str]) -> dict[str, Picture]:
    scores = {e.title: (e.train.median(), e.cross_validated.median(), e.validation.median()) for e in rig.entries}
    best = {entry.title: entry.damper for entry in rig.entries[:_OVERLAID]}
    figures = {"ranking": ranking(scores), "loops": overlaid_loops(_shown(rig), best)}
    return {name: picture_of(figure, also) for name, figure in figures.items()}


def _chapter(rig: RigComparison, pictures: Mapping[str, Picture]) -> dict[str, Any]:
    first = rig.entries[0]
    return {
        "rig": rig.dataset.name,
        "rows": _rows(rig),
        "refused": rig.refused,
        "omissions": omission_lines(rig.entries, rig.not_identified, len(rig.not_identified)),
        "verdict": (
            f"{first.title} has the least cross-validated error: "
            f"{100 * first.cross_validated.median():.1f} % of the "
            f"peak-to-peak force, among {counted(len(rig.entries), 'model')}."
        ),
        "loops_caption": (
            f"Last cycle of the {'validation' if _shown(rig)[0].split == 'validate' else 'identification'} runs; "
            f"the best {counted(len(rig.entries[:_OVERLAID]), 'model')}."
        ),
        "figures": {name: picture["svg"] for name, picture in pictures.items()},
    }


def _shown(rig: RigComparison) -> list[Run]:
    entry = rig.entries[0]
    scored = entry.validation.only(rig.sines).runs or entry.train.runs
    ordered = sorted(scored, key=lambda run: (run.condition.current_A, run.condition.peak_velocity))
    return [rig.dataset[run.run_id] for run in spread_out(ordered, _LOOPS)]
