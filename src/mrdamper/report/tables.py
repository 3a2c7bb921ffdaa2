"""Results as rows of tables for the command line and the pages, without a plotting library."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from mrdamper.dampers.bands import Band
from mrdamper.dampers.prediction import Prediction
from mrdamper.data.encoding import rows_of
from mrdamper.identification import Identification
from mrdamper.study.validation import SCORES, RunScore

if TYPE_CHECKING:  # commands that write tables of predictions need no study
    from mrdamper.study.recipe import RecipeResult


def identification_rows(identifications: Sequence[Identification], dataset: str = "") -> list[dict[str, Any]]:
    """One row per identification: condition, parameters, scores, message; `dataset` if a run names no rig."""
    return [
        {
            "run_id": one.run_id,
            "rig": one.rig or dataset,
            "model": one.model.name,
            "method": one.method,
            **asdict(one.condition),
            "nrmse_pp": one.scores.nrmse_pp,
            "repeatability_nrmse_pp": one.floor,
            "wape": one.scores.wape,
            **{f"{info.name} [{info.unit}]": getattr(one.model, info.name) for info in one.model.parameters()},
            **{f"standard error {name}": value for name, value in one.standard_errors.items()},
            **_ends(one),
            **{f"effective samples {name}": value for name, value in one.uncertainty.effective.items()},
            "delay_s": one.delay,
            "at_bounds": " ".join(one.at_bounds),
            "evaluations": one.evaluations,
            "message": str(one.ending),
            "notes": "; ".join((*one.notes, *one.doubts)),
        }
        for one in identifications
    ]


def prediction_rows(prediction: Prediction, band: Band | None = None) -> list[dict[str, Any]]:
    """One row per sample, in the columns of the command-line contract, with prediction interval, if any, and flags."""
    ends = {} if band is None else {"force_low_N": band.low, "force_high_N": band.high}
    flag = {"extrapolation": " ".join(prediction.extrapolation)}
    return [row | flag for row in rows_of({**prediction.table, **ends})]


def score_row(run: RunScore) -> dict[str, Any]:
    """Return the columns of the command-line contract for one scored run."""
    return {
        "run_id": run.run_id,
        **{name: getattr(run.scores, name) for name in SCORES},
        "rest_nrmse_pp": run.rest,
        "session": run.session,
        "extrapolation": " ".join(run.extrapolation),
    }


def score_rows(rig: str, result: RecipeResult, *sets: str) -> list[dict[str, Any]]:
    """One row per scored run of some sets: "train", "cross-validation", "validation"."""
    scores = {"train": result.train, "cross-validation": result.cross_validated, "validation": result.validation}
    head = {"rig": rig, "model": result.recipe.name}
    return [{**head, "set": name, **score_row(run)} for name in sets for run in scores[name].runs]


def _ends(identification: Identification) -> dict[str, float | None]:
    columns: dict[str, float | None] = {}
    for name in (info.name for info in identification.model.parameters() if info.name in identification.free):
        columns[f"{name} low 95 %"], columns[f"{name} high 95 %"] = identification.interval(name) or (None, None)
    return columns
