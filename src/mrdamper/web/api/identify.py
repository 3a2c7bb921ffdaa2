"""The Identify view: the whole study, or one model and method."""

from __future__ import annotations

from functools import partial
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
from fastapi import APIRouter, Request
from fastapi.responses import Response
from pydantic import BaseModel, Field

from mrdamper.dampers.joint import JointFit
from mrdamper.dampers.uncertainty import table as intervals
from mrdamper.data.encoding import finite
from mrdamper.errors import InputError
from mrdamper.identification import Identification, all_methods, identify
from mrdamper.models import all_models
from mrdamper.report.about import About, about_of, logo_of
from mrdamper.study.recipe import RecipeResult
from mrdamper.study.validation import Validation
from mrdamper.study.workflow import Study
from mrdamper.web.bundled_studies import BundledStudies
from mrdamper.web.curves import measured_cycle, modelled_cycle, predicted_on_run
from mrdamper.web.responses import frame
from mrdamper.web.rig_table import screen_condition
from mrdamper.web.sessions import OpenSession, Session
from mrdamper.web.tasks import FUNCTIONS, JOINT, identify_rig, study

router = APIRouter(prefix="/sessions/{session}")


class IdentifyRequest(BaseModel, extra="forbid", allow_inf_nan=False):
    """Model, method and runs of an identification."""

    rig: int = Field(ge=0)
    model: str = Field(max_length=100)
    method: str = Field(max_length=100)
    over: str = Field(default=FUNCTIONS, pattern=f"^({FUNCTIONS}|{JOINT})$")
    runs: list[str] = Field(default_factory=list, max_length=10_000)
    free: list[str] = Field(default_factory=list, max_length=64)
    fixed: dict[str, float] = Field(default_factory=dict, max_length=64)


class Head(BaseModel, extra="forbid"):
    """Head of the report; the logo as base64."""

    about: dict[str, str] = Field(default_factory=dict, max_length=20)
    logo: str = Field(default="", max_length=1_000_000)

    @property
    def checked(self) -> About:
        """The head for the report, checked."""
        about = about_of(self.about, "head of the report")
        return about.model_copy(update={"logo": logo_of(self.logo)}) if self.logo else about


@router.get("/choices")
def choices(session: OpenSession) -> dict[str, Any]:
    """List models and methods, and the defaults."""
    defaults = signature(identify).parameters
    shown = ("name", "unit", "meaning", "preset", "default")
    return {
        "model": defaults["model"].default,
        "method": defaults["method"].default,
        "models": [
            {
                **{field: getattr(cls, field) for field in ("title", "source", "integrated")},
                "name": name,
                "whole_damper": bool(cls.current_levels),
                "parameters": [{field: getattr(p, field) for field in shown} for p in cls.parameters()],
            }
            for name, cls in all_models().items()
        ],
        "methods": [
            {"name": name, "about": (method.__doc__ or "").strip().split("\n")[0]}
            for name, method in all_methods().items()
        ],
    }


_EMPTY_HEAD = Head()


@router.post("/study")
def start_study(session: OpenSession, request: Request, head: Head = _EMPTY_HEAD) -> dict[str, Any]:
    """Start a study of all data; a finished study of the bundled tests with the same head is used again."""
    folder, about = session.folder / session.key("study"), head.checked
    shared: BundledStudies | None = request.app.state.sessions.studies if session.bundled else None
    key = head.model_dump_json()

    def conclude(results: tuple[Study, list[Path]]) -> dict[str, Any]:
        if shared is not None:
            shared.keep(key, results[0], folder, results[1])
        return _conclude_study(session, *results)

    stored = partial(shared.find, key, folder) if shared is not None else lambda: None
    return session.start("study", partial(study, session.dataset, folder, about), conclude, stored)


@router.post("/identify")
def start_identification(choice: IdentifyRequest, session: OpenSession) -> dict[str, Any]:
    """Start the identification of one model for one rig."""
    table = session.table(choice.rig)
    names = [table.row(key).run.id for key in choice.runs]
    settings = choice.model, choice.method, choice.over, choice.free, choice.fixed
    task = partial(identify_rig, table.dataset, names, *settings)
    return session.start("identify", task, lambda results: _conclude_identification(session, choice, *results))


@router.get("/identified/runs/{number}")
def residual(number: int, session: OpenSession) -> Response:
    """Return measured and identified force of one identified run, and the residual."""
    table, identifications, scored = session.result("identified", "no identification yet", "start an identification")
    ids = [i.run_id for i in identifications] or [run.run_id for run in scored.train.runs]
    if not 0 <= number < len(ids):
        raise InputError("no such run", remedy="choose one from the table", code="E_NAME")
    row = next(row for row in table.rows if row.run.id == ids[number])
    if identifications:
        modelled = modelled_cycle(identifications[number].model, row.run, identifications[number].delay)
    else:
        modelled = predicted_on_run(scored.damper, row.run)[0]
    measured = measured_cycle(row.run)
    arrays = {f"measured.{k}": v for k, v in measured.items()} | {f"model.{k}": v for k, v in modelled.items()}
    arrays["residual"] = modelled["F"] - measured["F"]
    return frame({"id": row.run.id, "condition": screen_condition(row.condition)}, arrays)


def _conclude_study(session: Session, study: Study, written: list[Path]) -> dict[str, Any]:
    session.results["study.files"] = written
    rigs = []
    for rig in study.rigs:
        candidates = []
        for candidate in rig.candidates:
            errors = {"cross-validation": candidate.cross_validated, "validation": candidate.validation}
            note = ", ".join(f"{name} {_percent(scores)}" for name, scores in errors.items() if scores.runs)
            damper = session.add_scored(candidate, "study", note, selected=candidate is rig.chosen)
            candidates.append(_candidate(candidate, damper.key))
        rigs.append({"rig": rig.rig, "chosen": candidates[0]["damper"], "candidates": candidates})
    return {"rigs": rigs, "seconds": round(study.seconds, 1)}


def _candidate(candidate: RecipeResult, key: str) -> dict[str, Any]:
    return {
        "damper": key, "title": candidate.title, "parameter_count": candidate.damper.parameter_count,
        "individual_fits": finite(candidate.per_run), "seconds": round(candidate.seconds, 2),
        "cross_validation": finite(candidate.cross_validated.median()),
        "validation": finite(candidate.validation.median()),
    }  # fmt: skip


def _conclude_identification(
    session: Session,
    choice: IdentifyRequest,
    identifications: tuple[Identification, ...],
    scored: RecipeResult | str,
    refused: dict[str, str],
) -> dict[str, Any]:
    table = session.table(choice.rig)
    session.results["identified"] = table, identifications, scored
    result: dict[str, Any] = dict.fromkeys(("damper", "title", "parameter_count", "validation", "joint"))
    if isinstance(scored, RecipeResult):
        note = f"validation {_percent(scored.validation)}" if scored.validation.runs else ""
        result["damper"] = session.add(scored.damper, "identification", note).key
        result |= {"title": scored.damper.title, "validation": finite(scored.validation.median())}
        result["parameter_count"] = scored.damper.parameter_count
    if identifications:
        errors, fitted = [i.scores.nrmse_pp for i in identifications], identifications[0]
    else:  # a model of one set of parameters
        assert isinstance(scored, RecipeResult)
        assert isinstance(scored.fit, JointFit)
        errors, fitted, result["joint"] = scored.fit.nrmse_pp.tolist(), scored.fit.damper, _joint(scored, scored.fit)
    parameters = [info for info in fitted.model.parameters() if info.name in fitted.free]
    return {
        **result,
        "rig": table.dataset.rigs[0],
        "no_damper": scored if isinstance(scored, str) else "",
        "median": finite(float(np.median(errors))),
        "runs": [_identified(i) for i in identifications],
        "parameters": [{"name": info.name, "unit": info.unit, "meaning": info.meaning} for info in parameters],
        "refused": refused,
    }


def _identified(one: Identification) -> dict[str, Any]:
    return {
        "id": one.run_id, "nrmse_pp": finite(one.scores.nrmse_pp), "floor": finite(one.floor),
        "values": {n: finite(v) for n, v in one.model.values().items()},
        "intervals": {name: ends for name in one.free if (ends := one.interval(name))},
        "states": dict(zip(one.table["parameter"], one.table["state"], strict=True)),
        "at_bounds": one.at_bounds, "notes": (*one.notes, *one.doubts),
    }  # fmt: skip


def _joint(scored: RecipeResult, fit: JointFit) -> dict[str, Any]:
    errors = zip(scored.train.runs, fit.nrmse_pp.tolist(), strict=True)
    return {
        "values": {n: finite(v) for n, v in fit.damper.model.values().items()},
        "intervals": {
            row["name"]: {"low": finite(row["low"]), "high": finite(row["high"]), "state": row["state"]}
            for row in intervals(scored.damper)
        },
        "at_bounds": fit.at_bounds,
        "runs": [{"id": run.run_id, "nrmse_pp": finite(error)} for run, error in errors],
    }


def _percent(validation: Validation) -> str:
    return f"{100 * validation.median():.1f} %"
