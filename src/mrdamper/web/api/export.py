"""The Take-away view: report, models and tables as files; and models brought back."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from fastapi import APIRouter
from fastapi.responses import FileResponse, Response
from pydantic import BaseModel, Field

from mrdamper.dampers.model_file import dump_model, parse_model
from mrdamper.data.encoding import csv_text
from mrdamper.errors import InputError
from mrdamper.exporters import all_exporters
from mrdamper.report.tables import prediction_rows
from mrdamper.web.api.model import PredictionRequest
from mrdamper.web.held_parameters import as_damper, predict_held
from mrdamper.web.responses import archive, download, in_units, zipped
from mrdamper.web.saved_project import SavedProject, open_saved_project, save_project
from mrdamper.web.sessions import Current, Session
from mrdamper.web.tasks import export_damper

router = APIRouter(prefix="/sessions/{session}")


class Document(BaseModel, extra="forbid"):
    """The text of a model.json."""

    text: str = Field(max_length=2_000_000)


class Held(BaseModel, extra="forbid", allow_inf_nan=False):
    """Parameters held by hand."""

    held: dict[str, float] = Field(default_factory=dict, max_length=64)


@router.get("/files")
def files(session: Current) -> list[dict[str, Any]]:
    """List the files that the last study wrote."""
    return [
        {"number": i, "name": path.name, "folder": path.parent.name == "figures", "bytes": path.stat().st_size}
        for i, path in enumerate(_written(session))
    ]


@router.get("/files/{number}")
def file(number: int, session: Current) -> FileResponse:
    """One of these files, always as a download: a report is a page and must not run as ours."""
    written = _written(session)
    if not 0 <= number < len(written):
        raise InputError("no such file", remedy="load the page again", code="E_NAME")
    path = written[number]
    return FileResponse(path, filename=path.name, media_type="application/octet-stream")


@router.get("/files.zip")
def everything(session: Current) -> Response:
    """All of them in one archive."""
    written = _written(session)
    if not written:
        raise InputError("no study yet", remedy="run one on the Identify page", code="E_NO_RESULT")
    return archive(written, "mrdamper-study")


@router.post("/dampers")
def bring(document: Document, session: Current) -> dict[str, Any]:
    """Put a saved model on the bench."""
    damper = parse_model(document.text, where="the model file")
    return {"damper": session.add(damper, "file").key}


@router.post("/dampers/{key}/document")
def document(key: str, held: Held, session: Current) -> dict[str, str]:
    """Return a damper as model.json, with held parameters made its own."""
    return {"text": dump_model(as_damper(session.damper(key).damper, held.held))}


class Units(BaseModel, extra="forbid"):
    """Units of forces and lengths in a table."""

    force: Literal["N", "kN", "lbf"] = "N"
    length: Literal["m", "mm", "in"] = "m"


class TableRequest(PredictionRequest):
    """A condition, and the units of the table."""

    units: Units = Units()


@router.post("/dampers/{key}/csv")
def table(key: str, ask: TableRequest, session: Current) -> Response:
    """Return the loop at a condition as CSV."""
    prediction = predict_held(session.damper(key).damper, ask.condition, ask.held)
    text = csv_text(in_units(prediction_rows(prediction), ask.units.force, ask.units.length))
    return download(text.encode(), "prediction.csv", "text/csv; charset=utf-8")


@router.get("/exports")
def exports(session: Current) -> list[dict[str, str]]:
    """Return formats a damper can leave in."""
    return [{"name": name, "title": cls.title} for name, cls in all_exporters().items()]


@router.post("/dampers/{key}/export/{name}")
def start_export(key: str, name: str, held: Held, session: Current) -> dict[str, Any]:
    """Begin to make a damper in one of these formats: some compile, and take their time."""
    damper = as_damper(session.damper(key).damper, held.held)
    folder = session.folder / session.key("export")
    return session.start(
        "export", export_damper, (damper, name, folder), lambda results: _conclude(session, folder, *results)
    )


@router.get("/exported/{key}")
def exported(key: str, session: Current) -> Response:
    """Return an exported file, or an archive of several."""
    paths: list[Path] | None = session.results.get(f"exported.{key}")
    if not paths:
        raise InputError("no such export", remedy="export again", code="E_NAME")
    if len(paths) == 1:
        return FileResponse(paths[0], filename=paths[0].name, media_type="application/octet-stream")
    return zipped({path.name: path.read_bytes() for path in paths}, f"{paths[0].parent.name}.zip")


class State(BaseModel, extra="forbid"):
    """State of the page, the damper shown, and the logo of the report as base64."""

    state: str = Field(max_length=2_000_000)
    damper: str | None = Field(default=None, max_length=40)
    logo: str = Field(default="", max_length=1_000_000)


@router.post("/bench.zip")
def keep_bench(shown: State, session: Current) -> Response:
    """Return data, dampers, logo and state of this bench in one file."""
    return download(
        save_project(session, shown.state, shown.damper, shown.logo), "mrdamper-bench.zip", "application/zip"
    )


@router.post("/drops/{key}/open")
def open_bench(key: str, session: Current) -> dict[str, Any]:
    """Bring back what such a file holds."""
    upload = session.uploads.get(key)
    if upload is None or len(upload.names) != 1:
        raise InputError("no saved project was dropped", remedy="drop it again, alone", code="E_DROP")
    kept: SavedProject = open_saved_project(next(iter(upload.names)), upload.folder)
    if kept.imported is not None:
        session.put(kept.imported)
    keys = [session.add(damper, origin, note).key for damper, origin, note in kept.dampers]
    return {
        "data": kept.imported is not None,
        "state": kept.state,
        "logo": kept.logo,
        "damper": keys[kept.current] if kept.current is not None else None,
    }


def _conclude(session: Session, folder: Path, paths: list[Path], notes: tuple[str, ...]) -> dict[str, Any]:
    session.results[f"exported.{folder.name}"] = paths
    return {"exported": folder.name, "notes": notes}


def _written(session: Session) -> list[Path]:
    return [path for path in session.results.get("study.files", []) if path.is_file()]
