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
from mrdamper.web.rig_table import condition_on_screen
from mrdamper.web.sessions import Current, Session
from mrdamper.web.tasks import ALL_AT_ONCE, RUN_BY_RUN, identify_rig, study

router = APIRouter(prefix="/sessions/{session}")


class IdentifyRequest(BaseModel, extra="forbid", allow_inf_nan=False):
    """Model, method and runs of an identification."""

    rig: int = Field(ge=0)
    model: str = Field(max_length=100)
    method: str = Field(max_length=100)
    over: str = Field(default=RUN_BY_RUN, pattern=f"^({RUN_BY_RUN}|{ALL_AT_ONCE})$")
    runs: list[str] = Field(default_factory=list, max_length=10_000)
    free: list[str] = Field(default_factory=list, max_length=64)
    fixed: dict[str, float] = Field(default_factory=dict, max_length=64)


class Head(BaseModel, extra="forbid"):
    """Head of the report; the logo as base64."""

    about: dict[str, str] = Field(default_factory=dict, max_length=20)
    logo: str = Field(default="", max_length=1_000_000)

    @property
    def given(self) -> About:
        """Checked, as the report takes it."""
        about = about_of(self.about, "head of the report")
        return about.model_copy(update={"logo": logo_of(self.logo)}) if self.logo else about


@router.get("/choices")
def choices(session: Current) -> dict[str, Any]:
    """Models and methods there are, and those taken unless others are asked for."""
    defaults = signature(identify).parameters
    return {
        "model": defaults["model"].default,
        "method": defaults["method"].default,
        "models": [
            {
                "name": name,
                "title": cls.title,
                "source": cls.source,
                "equation": cls.equation,
                "integrated": cls.integrated,
                "jointly": bool(cls.current_levels),
                "parameters": [
                    {"name": p.name, "unit": p.unit, "meaning": p.meaning, "preset": p.preset, "default": p.default}
                    for p in cls.parameters()
                ],
            }
            for name, cls in all_models().items()
        ],
        "methods": [
            {"name": name, "about": (method.__doc__ or "").strip().split("\n")[0]}
            for name, method in all_methods().items()
        ],
    }


_NO_HEAD = Head()


@router.post("/study")
def start_study(session: Current, request: Request, head: Head = _NO_HEAD) -> dict[str, Any]:
    """Begin the whole method on all data; of the bundled tests, a study that is there already is recalled."""
    folder, about = session.folder / session.key("study"), head.given
    shared: BundledStudies | None = request.app.state.sessions.studies if session.bundled else None
    key = head.model_dump_json()

    def conclude(results: tuple[Study, list[Path]]) -> dict[str, Any]:
        if shared is not None:
            shared.keep(key, results[0], folder, results[1])
        return _conclude_study(session, *results)

    recall = partial(shared.find, key, folder) if shared is not None else lambda: None
    return session.start("study", study, (session.dataset, folder, about), conclude, recall)


@router.post("/identify")
def start_identification(choice: IdentifyRequest, session: Current) -> dict[str, Any]:
    """Begin to identify one model of one rig."""
    table = session.table(choice.rig)
    names = [table.row(key).run.id for key in choice.runs]
    return session.start(
        "identify",
        identify_rig,
        (table.dataset, names, choice.model, choice.method, choice.over, choice.free, choice.fixed),
        lambda results: _conclude_identification(session, choice, *results),
    )


@router.get("/identified/runs/{number}")
def residual(number: int, session: Current) -> Response:
    """Measured and identified force of one identified run, and the residual."""
    table = session.result("identified.table", "nothing is identified yet", "start an identification")
    identifications, scored = session.results["identified"]
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
    return frame({"id": row.run.id, "condition": condition_on_screen(row.condition)}, arrays)


def _conclude_study(session: Session, study: Study, written: list[Path]) -> dict[str, Any]:
    session.results["study.files"] = written
    rigs = []
    for rig in study.rigs:
        listed = []
        for candidate in rig.candidates:
            errors = {"cross-validation": candidate.cross_validated, "validation": candidate.validation}
            note = ", ".join(f"{name} {_percent(scores)}" for name, scores in errors.items() if scores.runs)
            listed.append(_candidate(candidate, session.scored(candidate, "study", note, candidate is rig.chosen).key))
        rigs.append({"rig": rig.rig, "chosen": listed[0]["damper"], "candidates": listed})
    return {"rigs": rigs, "seconds": round(study.seconds, 1)}


def _candidate(candidate: RecipeResult, key: str) -> dict[str, Any]:
    return {
        "damper": key,
        "title": candidate.title,
        "numbers": candidate.damper.parameter_count,
        "per_run": finite(candidate.per_run),
        "left_out": finite(candidate.cross_validated.median()),
        "held_out": finite(candidate.validation.median()) if candidate.validation.runs else None,
        "seconds": round(candidate.seconds, 2),
    }


def _conclude_identification(
    session: Session,
    choice: IdentifyRequest,
    identifications: tuple[Identification, ...],
    scored: RecipeResult | str,
    refused: dict[str, str],
) -> dict[str, Any]:
    session.results["identified"] = identifications, scored
    session.results["identified.table"] = session.table(choice.rig)
    damper, held_out, bench = None, None, None
    if isinstance(scored, RecipeResult):
        damper, held_out = scored.damper, scored.validation
        bench = session.add(damper, "identification", f"validation {_percent(held_out)}" if held_out.runs else "")
    errors = [i.scores.nrmse_pp for i in identifications] or _joint_fit(scored).nrmse_pp.tolist()
    return {
        "rig": session.table(choice.rig).dataset.rigs[0],
        "damper": bench.key if bench else None,
        "title": damper.title if damper else None,
        "numbers": damper.parameter_count if damper else None,
        "no_damper": scored if isinstance(scored, str) else "",
        "held_out": finite(held_out.median()) if held_out else None,
        "median": finite(float(np.median(errors))),
        "runs": [_identified(i) for i in identifications],
        "joint": None if identifications else _joint(scored),
        "units": _units(identifications, scored),
        "refused": refused,
    }


def _identified(one: Identification) -> dict[str, Any]:
    return {
        "id": one.run_id,
        "condition": condition_on_screen(one.condition),
        "nrmse_pp": finite(one.scores.nrmse_pp),
        "floor": finite(one.floor),
        "values": {n: finite(v) for n, v in one.model.values().items()},
        "intervals": {name: ends for name in one.free if (ends := one.interval(name))},
        "states": dict(zip(one.table["parameter"], one.table["state"], strict=True)),
        "at_bounds": one.at_bounds,
        "free": one.free,
        "message": str(one.ending),
        "notes": (*one.notes, *one.doubts),
    }


def _joint_fit(scored: RecipeResult | str) -> JointFit:
    """Return the fit of a model of one set of parameters: without identifications there is always one."""
    assert isinstance(scored, RecipeResult)
    assert isinstance(scored.fit, JointFit)
    return scored.fit


def _joint(scored: RecipeResult | str) -> dict[str, Any]:
    fit = _joint_fit(scored)
    assert isinstance(scored, RecipeResult)
    return {
        "values": {n: finite(v) for n, v in fit.damper.model.values().items()},
        "intervals": {
            row["name"]: {"low": finite(row["low"]), "high": finite(row["high"]), "state": row["state"]}
            for row in intervals(scored.damper)
        },
        "at_bounds": fit.at_bounds,
        "runs": [
            {"id": run.run_id, "nrmse_pp": finite(error)}
            for run, error in zip(scored.train.runs, fit.nrmse_pp.tolist(), strict=True)
        ],
        "message": str(fit.ending),
    }


def _units(identifications: tuple[Identification, ...], scored: RecipeResult | str) -> list[dict[str, str]]:
    if identifications:
        infos, free = identifications[0].model.parameters(), identifications[0].free
    else:
        damper = _joint_fit(scored).damper
        infos, free = damper.model.parameters(), damper.free
    return [{"name": i.name, "unit": i.unit, "meaning": i.meaning} for i in infos if i.name in free]


def _percent(validation: Validation) -> str:
    return f"{100 * validation.median():.1f} %"
