"""The Compare view: errors of several models on the validation runs."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import Any

from fastapi import APIRouter
from fastapi.responses import Response
from pydantic import BaseModel, Field

from mrdamper.data.encoding import csv_text, finite
from mrdamper.report.comparison import summary_rows, write_comparison
from mrdamper.study.comparison import Comparison, compare
from mrdamper.study.recipe import INDIVIDUAL, STUDIED, WHOLE_DAMPER, Recipe, RecipeResult, recipes, recipes_of_models
from mrdamper.web.curves import measured_cycle, measured_window, predicted_on_run
from mrdamper.web.responses import archive, download, frame
from mrdamper.web.rig_table import screen_condition
from mrdamper.web.sessions import OpenSession, Session

router = APIRouter(prefix="/sessions/{session}/compare")


class CompareRequest(BaseModel, extra="forbid"):
    """Rig and models to compare."""

    rig: int = Field(ge=0)
    models: list[str] = Field(min_length=1, max_length=100)


@router.get("/choices")
def choices(session: OpenSession) -> list[dict[str, Any]]:
    """List the models that can be compared; those of a study are selected at first."""

    def name_of(recipe: Recipe) -> str:
        alone = recipes_of_models([recipe.name]) == [recipe.name]  # else the name stands for other ways, too
        return recipe.name if alone else f"{recipe.name}{INDIVIDUAL}"

    return [
        {
            "name": name_of(c), "title": ", ".join(filter(None, (c.title or c.source, c.way))), "source": c.source,
            "slow": bool(c.basis and c.basis.costly), "studied": c.model in (*STUDIED, *WHOLE_DAMPER),
        }
        for c in recipes()
    ]  # fmt: skip


@router.post("")
def start(choice: CompareRequest, session: OpenSession) -> dict[str, Any]:
    """Start a comparison on one rig."""
    jobs = max(1, (os.cpu_count() or 2) - 1)  # one processor remains for the page
    task = partial(compare, session.table(choice.rig).dataset, choice.models, jobs=jobs)
    return session.start("compare", task, lambda result: _conclude(session, choice.rig, result))


@router.get("/rigs/{rig}/runs/{key}")
def loops(rig: int, key: str, session: OpenSession) -> Response:
    """Return one run as measured, and as every compared model predicts it."""
    comparison = _comparison(session, rig).rigs[0]
    row = session.table(rig).row(key)
    measured = measured_cycle(row.run) if row.loop else measured_window(row.run)
    arrays = {f"measured.{axis}": values for axis, values in measured.items()}
    for i, entry in enumerate(comparison.entries):
        curve, _ = predicted_on_run(entry.damper, row.run)
        arrays |= {f"model{i}.{axis}": values for axis, values in curve.items()}
    return frame({"id": row.run.id, "condition": screen_condition(row.condition)}, arrays)


@router.get("/rigs/{rig}/comparison.csv")
def table(rig: int, session: OpenSession) -> Response:
    """Return the ranking as CSV."""
    text = csv_text(summary_rows(_comparison(session, rig)))
    return download(text.encode(), "comparison.csv", "text/csv; charset=utf-8")


@router.post("/rigs/{rig}/files")
def start_files(rig: int, session: OpenSession) -> dict[str, Any]:
    """Start to write the comparison as a page with tables, figures and models."""
    folder = session.folder / session.key("comparison")

    def conclude(written: list[Path]) -> dict[str, Any]:
        session.results[f"comparison.files.{rig}"] = written
        return {"files": len(written)}

    return session.start("comparison files", partial(write_comparison, _comparison(session, rig), folder), conclude)


@router.get("/rigs/{rig}/files.zip")
def files(rig: int, session: OpenSession) -> Response:
    """Return the written files in one archive."""
    missing = "the comparison is not written yet", "press “Page, tables and models as zip” again"
    written = session.result(f"comparison.files.{rig}", *missing)
    return archive(written, "mrdamper-comparison", "mrdamper-comparison/")


def _comparison(session: Session, rig: int) -> Comparison:
    return session.result(f"comparison.{rig}", "no comparison yet", "start a comparison")


def _conclude(session: Session, number: int, comparison: Comparison) -> dict[str, Any]:
    rig = comparison.rigs[0]
    session.results[f"comparison.{number}"] = comparison
    keys = {row.run.id: row.key for row in session.table(number).rows}
    entries = []
    for entry in rig.entries:
        note = f"cross-validation {100 * entry.cross_validated.median():.1f} %"
        entries.append(_entry(entry, session.add_scored(entry, "comparison", note).key, keys))
    runs = {
        split: [{"key": keys[run.id], "id": run.id} for run in rig.dataset.split(split)]
        for split in ("validate", "train")
    }
    return {
        "rig": rig.rig, "number": number, "entries": entries, "refused": dict(rig.refused),
        "validation_runs": runs["validate"], "identification_runs": runs["train"],
    }  # fmt: skip


def _entry(entry: RecipeResult, key: str, keys: dict[str, str]) -> dict[str, Any]:
    scores = [
        {"key": keys[run.run_id], "nrmse_pp": finite(run.scores.nrmse_pp), "extrapolation": run.extrapolation}
        for run in entry.validation.runs
    ]
    return {
        "damper": key, "title": entry.title, "source": entry.recipe.source, "seconds": round(entry.seconds, 2),
        "parameter_count": entry.damper.parameter_count, "runs_needed": entry.conditions_needed,
        "cross_validation": finite(entry.cross_validated.median()), "validation": finite(entry.validation.median()),
        "scores": scores,
    }  # fmt: skip
