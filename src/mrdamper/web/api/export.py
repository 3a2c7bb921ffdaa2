"""The Export view: report, models and tables as files, and saved models and projects to open."""

from __future__ import annotations

from functools import partial
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
from mrdamper.web.api.data import find_upload
from mrdamper.web.api.model import Held, PredictionRequest
from mrdamper.web.held_parameters import as_damper, predict_held
from mrdamper.web.responses import archive, download, in_units
from mrdamper.web.saved_project import open_saved_project, save_project
from mrdamper.web.sessions import OpenSession, Session
from mrdamper.web.tasks import export_damper

router = APIRouter(prefix="/sessions/{session}")


class Document(BaseModel, extra="forbid"):
    """The text of a model.json."""

    text: str = Field(max_length=2_000_000)


class Units(BaseModel, extra="forbid"):
    """Units of forces and lengths in a table."""

    force: Literal["N", "kN", "lbf"] = "N"
    length: Literal["m", "mm", "in"] = "m"


class TableRequest(PredictionRequest):
    """A condition, and the units of the table."""

    units: Units = Units()


class State(BaseModel, extra="forbid"):
    """State of the page, the damper of the Model view, and the logo of the report as base64."""

    state: str = Field(max_length=2_000_000)
    damper: str | None = Field(default=None, max_length=40)
    logo: str = Field(default="", max_length=1_000_000)


@router.get("/files")
def files(session: OpenSession) -> list[dict[str, Any]]:
    """List the files of the last study."""
    return [
        {"number": i, "name": path.name, "figure": path.parent.name == "figures", "bytes": path.stat().st_size}
        for i, path in enumerate(_written(session))
    ]


@router.get("/files/{number}")
def file(number: int, session: OpenSession) -> FileResponse:
    """Return one of these files, always as a download: a report is a page and must not run as the app's own."""
    written = _written(session)
    if not 0 <= number < len(written):
        raise InputError("no such file", remedy="load the page again", code="E_NAME")
    return _saved(written[number])


@router.get("/files.zip")
def all_files(session: OpenSession) -> Response:
    """Return all of them in one archive."""
    session.result("study.files", "no study yet", "run one on the Identify page")
    return archive(_written(session), "mrdamper-study", "mrdamper-study/")


@router.post("/dampers")
def open_model(document: Document, session: OpenSession) -> dict[str, Any]:
    """Add the damper of a saved model."""
    damper = parse_model(document.text, where="the model file")
    return {"damper": session.add(damper, "file").key}


@router.post("/dampers/{key}/document")
def document(key: str, held: Held, session: OpenSession) -> dict[str, str]:
    """Return a damper as model.json with the held parameters."""
    return {"text": dump_model(as_damper(session.damper(key).damper, held.held))}


@router.post("/dampers/{key}/csv")
def table(key: str, query: TableRequest, session: OpenSession) -> Response:
    """Return the loop at a condition as CSV."""
    prediction = predict_held(session.damper(key).damper, query.condition, query.held)
    text = csv_text(in_units(prediction_rows(prediction), query.units.force, query.units.length))
    return download(text.encode(), "prediction.csv", "text/csv; charset=utf-8")


@router.get("/exports")
def formats(session: OpenSession) -> list[dict[str, str]]:
    """List the export formats of dampers."""
    return [{"name": name, "title": cls.title} for name, cls in all_exporters().items()]


@router.post("/dampers/{key}/export/{name}")
def start_export(key: str, name: str, held: Held, session: OpenSession) -> dict[str, Any]:
    """Start to export a damper: some formats are compiled, which takes time."""
    damper = as_damper(session.damper(key).damper, held.held)
    folder = session.folder / session.key("export")

    def conclude(results: tuple[list[Path], tuple[str, ...]]) -> dict[str, Any]:
        session.results[f"exported.{folder.name}"], notes = results
        return {"exported": folder.name, "notes": notes}

    return session.start("export", partial(export_damper, damper, name, folder), conclude)


@router.get("/exported/{key}")
def exported(key: str, session: OpenSession) -> Response:
    """Return an exported file, or an archive of several."""
    paths: list[Path] = session.result(f"exported.{key}", "no such export", "export again")
    if len(paths) == 1:
        return _saved(paths[0])
    return archive(paths, paths[0].parent.name)


@router.post("/project.zip")
def project(shown: State, session: OpenSession) -> Response:
    """Return data, dampers, logo and state of this session in one file."""
    content = save_project(session, shown.state, shown.damper, shown.logo)
    return download(content, "mrdamper-project.zip", "application/zip")


@router.post("/uploads/{key}/open")
def open_project(key: str, session: OpenSession) -> dict[str, Any]:
    """Open a saved project."""
    upload = find_upload(session, key)
    if len(upload.names) != 1:
        raise InputError("no saved project was dropped", remedy="drop it again, alone", code="E_UPLOAD")
    project = open_saved_project(next(iter(upload.names)), upload.folder)
    if project.imported is not None:
        session.load(project.imported)
    keys = [session.add(damper, origin, note).key for damper, origin, note in project.dampers]
    damper = keys[project.current] if project.current is not None else None
    return {"data": project.imported is not None, "state": project.state, "logo": project.logo, "damper": damper}


def _written(session: Session) -> list[Path]:
    return [path for path in session.results.get("study.files", []) if path.is_file()]


def _saved(path: Path) -> FileResponse:
    return FileResponse(path, filename=path.name, media_type="application/octet-stream")
