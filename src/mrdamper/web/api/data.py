"""The Data view: upload and check of files, test matrix and loops."""

from __future__ import annotations

import shutil
from dataclasses import asdict
from typing import Any

from fastapi import APIRouter, Query, Request
from fastapi.responses import Response
from pydantic import BaseModel, Field

from mrdamper.errors import UnknownNameError
from mrdamper.rig_files.quality.table import Quality
from mrdamper.web.curves import measured_cycle, measured_window, raw_record
from mrdamper.web.imported_data import bundled, bundled_dampers, read_upload
from mrdamper.web.responses import frame
from mrdamper.web.rig_table import describe, screen_condition
from mrdamper.web.sessions import OpenSession, Session
from mrdamper.web.uploads import FILE_LIMIT, UPLOAD_LIMIT, ImportedData, Upload, UploadError

router = APIRouter(prefix="/sessions/{session}")


class ProfileRequest(BaseModel, extra="forbid"):
    """A rig profile as TOML, for all files or the refused ones; empty to guess."""

    toml: str = Field(default="", max_length=100_000)
    refused_only: bool = False


@router.post("/bundled")
def open_bundled(session: OpenSession) -> dict[str, Any]:
    """Open the bundled tests with the models that a study selects for them."""
    session.load(bundled())
    if not any(damper.origin == "bundled" for damper in session.dampers.values()):
        for damper in bundled_dampers():
            session.add(damper, "bundled", selected=True)
    return overview(session)


@router.post("/uploads")
def begin_upload(session: OpenSession) -> dict[str, str]:
    """Make a folder for files; the one before is removed."""
    key, replaced = session.key("upload"), session.upload
    folder = session.folder / key
    folder.mkdir(mode=0o700)
    session.upload = Upload(key, folder)
    if replaced is not None:
        shutil.rmtree(replaced.folder, ignore_errors=True)
    return {"upload": key}


@router.put("/uploads/{key}/files")
async def receive_file(
    key: str, session: OpenSession, request: Request, name: str = Query(min_length=1, max_length=1000)
) -> dict[str, int]:
    """Receive one file as a stream; stops at the limit, whatever length was announced."""
    upload = find_upload(session, key)
    announced = request.headers.get("content-length", "0")
    if announced.isdecimal() and int(announced) > FILE_LIMIT:
        raise _too_large(name)
    try:
        size = await _store(upload, name, request)
    except FileNotFoundError:
        find_upload(session, key)  # raises if another upload has replaced this one meanwhile
        raise
    upload.size += size
    return {"bytes": size}


@router.post("/uploads/{key}/read")
def read(key: str, profile: ProfileRequest, session: OpenSession) -> dict[str, Any]:
    """Read the uploaded files, and load their data."""
    session.load(read_upload(find_upload(session, key), profile.toml, profile.refused_only))
    return overview(session)


@router.get("/data")
def overview(session: OpenSession) -> dict[str, Any]:
    """Describe the loaded data, rig by rig."""
    imported: ImportedData = session.imported or bundled()
    data = session.dataset
    return {
        "name": data.name, "source": imported.source, "runs": len(data), "profile": imported.profile,
        "rigs": [{"name": name, "runs": len(data.rig(name))} for name in data.rigs],
        "verdicts": [asdict(v) for v in imported.verdicts],
    }  # fmt: skip


@router.get("/data/rigs/{number}")
def rig(number: int, session: OpenSession) -> dict[str, Any]:
    """Return the runs of a rig and its test matrix."""
    table = session.table(number)
    motions = table.motions()
    currents = sorted({round(row.condition.current_A, 3) for g in motions for row in g if row.condition})
    return {
        "runs": [describe(row) for row in table.rows],
        "matrix": {"currents_A": currents, "motions": [_motion(group, currents) for group in motions]},
    }


@router.get("/data/rigs/{number}/quality")
def quality(number: int, session: OpenSession) -> dict[str, Any]:
    """Return the verdict on every run of a rig."""
    table = session.table(number)
    return {
        row.key: {"verdict": checked.verdict, "findings": _findings(checked)}
        for row, checked in zip(table.rows, table.quality, strict=True)
    }


@router.get("/data/rigs/{number}/runs/{key}/{part}")
def loop(number: int, key: str, part: str, session: OpenSession) -> Response:
    """Return the last whole cycle of a run ("cycle") or its steady window ("window")."""
    row = session.table(number).row(key)
    if row.condition is None:
        arrays = raw_record(row.run)
    elif part == "cycle" and row.loop is not None:
        arrays = measured_cycle(row.run)
    else:
        arrays = measured_window(row.run)
    return frame({"key": key, "id": row.run.id, "condition": screen_condition(row.condition)}, arrays)


def find_upload(session: Session, key: str | None = None) -> Upload:
    """Return the last upload; raises `UnknownNameError` if there is none, or its key is another."""
    if session.upload is None or key not in (None, session.upload.key):
        raise UnknownNameError("these files are no longer stored", remedy="drop the files again")
    return session.upload


async def _store(upload: Upload, name: str, request: Request) -> int:
    """Write one file of an upload; returns its size."""
    path, size = upload.place(name), 0
    try:
        with path.open("xb") as file:
            async for piece in request.stream():
                size += len(piece)
                if size > FILE_LIMIT:
                    raise _too_large(name)
                if upload.size + size > UPLOAD_LIMIT:
                    remedy = "drop fewer at once, or use mrdamper import"
                    raise UploadError("the files together exceed 1 GB", remedy=remedy)
                file.write(piece)
    except BaseException:  # also an interrupted connection: a part of a file is no file
        path.unlink(missing_ok=True)
        upload.names.pop(path, None)
        raise
    return size


def _findings(checked: Quality) -> list[dict[str, str]]:
    refusal = [] if checked.refusal is None else [{"code": checked.refusal.code, "text": checked.refusal.found}]
    return refusal + [{"code": finding.code, "text": finding.text} for finding in checked.findings]


def _motion(group: list[Any], currents: list[float]) -> dict[str, Any]:
    first = screen_condition(group[0].condition)
    assert first is not None  # only moving runs are grouped
    cells: list[list[str]] = [[] for _ in currents]
    for row in group:
        nearest = min(range(len(currents)), key=lambda i: abs(currents[i] - row.condition.current_A))
        cells[nearest].append(row.key)
    return {"frequency_Hz": first["frequency_Hz"], "amplitude_mm": first["amplitude_mm"], "cells": cells}


def _too_large(name: str) -> UploadError:
    remedy = "read it with mrdamper import, which has no such limit, and drop the dataset folder"
    problem = f"the file is over {FILE_LIMIT // 1_000_000} MB"
    return UploadError(problem, where=name, remedy=remedy, code="E_UPLOAD_SIZE")
