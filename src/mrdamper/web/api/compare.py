"""The Compare view: models on runs none of them has seen."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from fastapi import APIRouter
from fastapi.responses import Response
from pydantic import BaseModel, Field

from mrdamper.data import Dataset
from mrdamper.data.encoding import csv_text, finite
from mrdamper.report.comparison import summary_rows
from mrdamper.study.comparison import Comparison, RigComparison
from mrdamper.study.recipe import WHOLE_DAMPER, RecipeResult, recipes
from mrdamper.study.validation import RunScore, Validation
from mrdamper.study.workflow import STUDIED
from mrdamper.web.curves import measured_cycle, measured_window, predicted_on_run
from mrdamper.web.responses import archive, download, frame
from mrdamper.web.rig_table import condition_on_screen
from mrdamper.web.sessions import Current, Session
from mrdamper.web.tasks import compare_models, write_compared

router = APIRouter(prefix="/sessions/{session}/compare")
_NOTHING = ("nothing is compared yet", "start a comparison")


class CompareRequest(BaseModel, extra="forbid"):
    """Rig and models to compare."""

    rig: int = Field(ge=0)
    models: list[str] = Field(min_length=1, max_length=100)


@router.get("/choices")
def choices(session: Current) -> list[dict[str, Any]]:
    """Models that can be compared; those of a study are chosen at first."""
    return [
        {
            "name": c.name,
            "title": c.title,
            "source": c.source,
            "slow": bool(c.basis and c.basis.costly),
            "studied": c.model in (*STUDIED, *WHOLE_DAMPER),
        }
        for c in recipes()
    ]


@router.post("")
def start(choice: CompareRequest, session: Current) -> dict[str, Any]:
    """Begin a comparison on one rig."""
    table = session.table(choice.rig)
    jobs = max(1, (os.cpu_count() or 2) - 1)  # one processor is left to answer the page
    dataset: Dataset = table.dataset
    return session.start(
        "compare",
        compare_models,
        (dataset, choice.models, jobs),
        lambda comparison: _conclude(session, choice, comparison),
    )


@router.get("/rigs/{rig}/runs/{key}")
def overlaid(rig: int, key: str, session: Current) -> Response:
    """One run as measured, and as every compared model predicts it."""
    comparison: RigComparison = session.result(f"compared.{rig}", *_NOTHING)
    row = session.table(rig).row(key)
    measured = measured_cycle(row.run) if row.loop else measured_window(row.run)
    arrays = {f"measured.{k}": v for k, v in measured.items()}
    shown = []
    for number_, entry in enumerate(comparison.entries):
        curve, flags = predicted_on_run(entry.damper, row.run)
        arrays |= {f"model{number_}.{k}": v for k, v in curve.items()}
        shown.append({"title": entry.title, "extrapolation": flags})
    return frame({"id": row.run.id, "condition": condition_on_screen(row.condition), "models": shown}, arrays)


@router.get("/rigs/{rig}/comparison.csv")
def table(rig: int, session: Current) -> Response:
    """Return the ranking as CSV."""
    return download(csv_text(summary_rows(_whole(session, rig))).encode(), "comparison.csv", "text/csv; charset=utf-8")


@router.post("/rigs/{rig}/files")
def start_files(rig: int, session: Current) -> dict[str, Any]:
    """Begin to write the comparison as a page with tables, figures and models."""
    folder = session.folder / session.key("comparison")

    def conclude(written: list[Path]) -> dict[str, Any]:
        session.results[f"compared.files.{rig}"] = written
        return {"files": len(written)}

    return session.start("comparison files", write_compared, (_whole(session, rig), folder), conclude)


@router.get("/rigs/{rig}/files.zip")
def files(rig: int, session: Current) -> Response:
    """Return the written files in one archive."""
    missing = "the comparison is not written yet", "press “Page and tables” again"
    return archive(session.result(f"compared.files.{rig}", *missing), "mrdamper-comparison")


def _whole(session: Session, rig: int) -> Comparison:
    return session.result(f"compared.whole.{rig}", *_NOTHING)


def _conclude(session: Session, choice: CompareRequest, comparison: Comparison) -> dict[str, Any]:
    rig = comparison.rigs[0]
    table = session.table(choice.rig)
    session.results[f"compared.{choice.rig}"] = rig
    session.results[f"compared.whole.{choice.rig}"] = comparison
    keys = {row.run.id: row.key for row in table.rows}
    entries = []
    for entry in rig.entries:
        note = f"cross-validation {100 * entry.cross_validated.median():.1f} %"
        entries.append(_entry(rig, entry, session.scored(entry, "comparison", note).key, keys))
    return {
        "rig": rig.rig,
        "number": choice.rig,
        "entries": entries,
        "refused": dict(rig.refused),
        "held_out": [{"key": keys[run.id], "id": run.id} for run in rig.dataset.split("validate")],
        "train": [{"key": keys[run.id], "id": run.id} for run in rig.dataset.split("train")],
        "seconds": round(comparison.seconds, 1),
    }


def _entry(rig: RigComparison, entry: RecipeResult, key: str, keys: dict[str, str]) -> dict[str, Any]:
    return {
        "damper": key,
        "name": entry.recipe.name,
        "title": entry.title,
        "source": entry.recipe.source,
        "limits": entry.recipe.limits,
        "numbers": entry.damper.parameter_count,
        "runs_needed": entry.conditions_needed,
        "train": _median(entry.train),
        "left_out": _median(entry.cross_validated),
        "held_out": _median(entry.validation),
        "seconds": round(entry.seconds, 2),
        "scores": [_score(run, keys) for run in entry.validation.runs],
    }


def _median(validation: Validation) -> float | None:
    return finite(validation.median()) if validation.runs else None


def _score(run: RunScore, keys: dict[str, str]) -> dict[str, Any]:
    return {
        "key": keys[run.run_id],
        "nrmse_pp": finite(run.scores.nrmse_pp),
        "energy_error": finite(run.scores.energy_error),
        "peak_error": finite(run.scores.peak_error),
        "floor": finite(run.floor),
        "extrapolation": run.extrapolation,
    }
