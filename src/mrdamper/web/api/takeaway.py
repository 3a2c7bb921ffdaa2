"""The Take-away view: report, models and tables as files; and models brought back."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fastapi import APIRouter
from fastapi.responses import FileResponse, Response
from pydantic import BaseModel, ConfigDict, Field

from mrdamper.errors import InputError
from mrdamper.export import all_exporters
from mrdamper.files.encoding import csv_text
from mrdamper.files.model_file import dump_model, parse_model
from mrdamper.report.tables import prediction_rows
from mrdamper.web.api.model import Ask
from mrdamper.web.bench_model import as_damper, predict_held
from mrdamper.web.sessions import Current, Session
from mrdamper.web.tasks import Exported, export_damper

router = APIRouter(prefix="/sessions/{session}")


class Document(BaseModel):
    """The text of a model.json."""

    model_config = ConfigDict(extra="forbid")

    text: str = Field(max_length=2_000_000)


class Held(BaseModel):
    """Parameters held by hand."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    held: dict[str, float] = Field(default_factory=dict, max_length=64)


@router.get("/files")
def files(session: Current) -> list[dict[str, Any]]:
    """What the last study wrote."""
    return [
        {"number": i, "name": path.name, "folder": path.parent.name == "figures", "bytes": path.stat().st_size}
        for i, path in enumerate(_written(session))
    ]


@router.get("/files/{number}")
def file(number: int, session: Current) -> FileResponse:
    """One of these files, always as a download: a report is a page and must not run as ours."""
    written = _written(session)
    if not 0 <= number < len(written):
        raise InputError("no such file", mend="load the page again", code="E_NAME")
    path = written[number]
    return FileResponse(path, filename=path.name, media_type="application/octet-stream")


@router.get("/files.zip")
def everything(session: Current) -> Response:
    """All of them in one archive."""
    written = _written(session)
    if not written:
        raise InputError("no study yet", mend="run one on the Identify page", code="E_NO_RESULT")
    top = written[0].parent
    content = {f"mrdamper-study/{path.relative_to(top).as_posix()}": path.read_bytes() for path in written}
    return _download(_packed(content), "mrdamper-study.zip", "application/zip")


@router.post("/dampers")
def bring(document: Document, session: Current) -> dict[str, Any]:
    """Put a saved model on the bench."""
    damper = parse_model(document.text, where="the model file")
    return {"damper": session.add(damper, "file").key}


@router.post("/dampers/{key}/document")
def document(key: str, held: Held, session: Current) -> dict[str, str]:
    """A damper as model.json, with held parameters made its own."""
    return {"text": dump_model(as_damper(session.damper(key).damper, held.held))}


@router.post("/dampers/{key}/csv")
def table(key: str, ask: Ask, session: Current) -> Response:
    """The loop at a condition as CSV."""
    prediction = predict_held(session.damper(key).damper, ask.condition, ask.held)
    text = csv_text(prediction_rows(prediction))
    return _download(text.encode(), "prediction.csv", "text/csv; charset=utf-8")


@router.get("/exports")
def exports(session: Current) -> list[dict[str, str]]:
    """Formats a damper can leave in."""
    return [{"name": name, "title": cls.title} for name, cls in all_exporters().items()]


@router.post("/dampers/{key}/export/{name}")
def start_export(key: str, name: str, held: Held, session: Current) -> dict[str, Any]:
    """Begin to make a damper in one of these formats: some compile, and take their time."""
    damper = as_damper(session.damper(key).damper, held.held)
    folder = session.folder / session.key("export")
    return session.start("export", export_damper, (damper, name, folder), lambda made: _conclude(session, folder, made))


@router.get("/exported/{key}")
def exported(key: str, session: Current) -> Response:
    """What an export made: the file, or an archive of several."""
    paths: list[Path] | None = session.results.get(f"exported.{key}")
    if not paths:
        raise InputError("no such export", mend="make it again", code="E_NAME")
    if len(paths) == 1:
        return FileResponse(paths[0], filename=paths[0].name, media_type="application/octet-stream")
    content = {path.name: path.read_bytes() for path in paths}
    return _download(_packed(content), f"{paths[0].parent.name}.zip", "application/zip")


def _conclude(session: Session, folder: Path, made: Exported) -> dict[str, Any]:
    session.results[f"exported.{folder.name}"] = made.paths
    return {"exported": folder.name, "notes": made.notes}


def _written(session: Session) -> list[Path]:
    return [path for path in session.results.get("study.files", []) if path.is_file()]


def _packed(files: Mapping[str, bytes]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return packed.getvalue()


def _download(content: bytes, name: str, kind: str) -> Response:
    return Response(content, media_type=kind, headers={"Content-Disposition": f'attachment; filename="{name}"'})
