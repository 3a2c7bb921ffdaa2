"""The Data view: drop files, check them, see the test matrix and the loops."""

from __future__ import annotations

import shutil
from dataclasses import asdict
from typing import Any

from fastapi import APIRouter, Query, Request
from fastapi.responses import Response
from pydantic import BaseModel, Field

from mrdamper.errors import UnknownNameError
from mrdamper.rig_files.quality import Quality
from mrdamper.web.curves import measured_cycle, measured_window, raw_record
from mrdamper.web.imported_data import bundled, bundled_dampers, read_upload
from mrdamper.web.responses import frame
from mrdamper.web.rig_table import condition_on_screen, describe
from mrdamper.web.sessions import Current, Session
from mrdamper.web.uploads import FILE_LIMIT, UPLOAD_LIMIT, ImportedData, Upload, UploadError

router = APIRouter(prefix="/sessions/{session}")


class ProfileRequest(BaseModel, extra="forbid"):
    """A rig profile as TOML; empty to guess. It may be for the refused files alone."""

    toml: str = Field(default="", max_length=100_000)
    refused_only: bool = False


@router.post("/bundled")
def open_bundled(session: Current) -> dict[str, Any]:
    """Open the bundled tests with the models that a study selects for them."""
    session.put(bundled())
    if not any(bench.origin == "bundled" for bench in session.dampers.values()):
        for damper in bundled_dampers():
            session.add(damper, "bundled", selected=True)
    return overview(session)


@router.post("/drops")
def begin_drop(session: Current) -> dict[str, str]:
    """Make a place for files; an earlier place goes."""
    for old in session.uploads.values():
        shutil.rmtree(old.folder, ignore_errors=True)
    key = session.key("drop")
    folder = session.folder / key
    folder.mkdir(mode=0o700)
    session.uploads = {key: Upload(key, folder)}
    return {"drop": key}


@router.put("/drops/{key}/files")
async def take_file(
    key: str, session: Current, request: Request, name: str = Query(min_length=1, max_length=1000)
) -> dict[str, int]:
    """Take one file as it streams in; stops at the limit, whatever the length it announced."""
    upload = _upload(session, key)
    announced = request.headers.get("content-length", "0")
    if announced.isdecimal() and int(announced) > FILE_LIMIT:
        raise _too_large(name)
    path, size = upload.place(name), 0
    try:
        with path.open("xb") as file:
            async for piece in request.stream():
                size += len(piece)
                if size > FILE_LIMIT:
                    raise _too_large(name)
                if upload.size + size > UPLOAD_LIMIT:
                    raise UploadError(
                        "the files together exceed 1 GB", remedy="drop fewer at once, or use mrdamper import"
                    )
                file.write(piece)
    except BaseException:  # also a connection that breaks off: half a file is none
        path.unlink(missing_ok=True)
        upload.names.pop(path, None)
        raise
    upload.size += size
    return {"bytes": size}


@router.post("/drops/{key}/read")
def read(key: str, profile: ProfileRequest, session: Current) -> dict[str, Any]:
    """Read what was dropped and put it on the bench."""
    session.put(read_upload(_upload(session, key), profile.toml, profile.refused_only))
    return overview(session)


@router.get("/data")
def overview(session: Current) -> dict[str, Any]:
    """Describe the loaded data, rig by rig."""
    imported: ImportedData = session.imported or bundled()
    data = session.dataset
    return {
        "name": data.name,
        "source": imported.source,
        "rigs": [{"name": name, "runs": len(data.rig(name))} for name in data.rigs],
        "runs": len(data),
        "verdicts": [asdict(v) for v in imported.verdicts],
        "profile": imported.profile,
    }


@router.get("/data/rigs/{number}")
def rig(number: int, session: Current) -> dict[str, Any]:
    """Return the runs of a rig and its test matrix."""
    table = session.table(number)
    motions = table.motions()
    currents = sorted({round(row.condition.current_A, 3) for g in motions for row in g if row.condition})
    return {
        "rig": table.dataset.rigs[0],
        "runs": [describe(row) for row in table.rows],
        "matrix": {"currents_A": currents, "motions": [_motion(group, currents) for group in motions]},
    }


@router.get("/data/rigs/{number}/quality")
def quality(number: int, session: Current) -> dict[str, Any]:
    """Return the verdict on every run of a rig."""
    table = session.table(number)
    return {
        row.key: {"verdict": findings.verdict, "findings": _findings(findings)}
        for row, findings in zip(table.rows, table.quality, strict=True)
    }


@router.get("/data/rigs/{number}/runs/{key}/{part}")
def loop(number: int, key: str, part: str, session: Current) -> Response:
    """Return a run's last whole cycle ("cycle") or its steady window ("window")."""
    row = session.table(number).row(key)
    if row.condition is None:
        arrays = raw_record(row.run)
    elif part == "cycle" and row.loop is not None:
        arrays = measured_cycle(row.run)
    else:
        arrays = measured_window(row.run)
    return frame({"key": key, "id": row.run.id, "condition": condition_on_screen(row.condition)}, arrays)


def _findings(checked: Quality) -> list[dict[str, str]]:
    refusal = [] if checked.refusal is None else [{"code": checked.refusal.code, "text": checked.refusal.found}]
    return refusal + [{"code": finding.code, "text": finding.text} for finding in checked.findings]


def _motion(group: list[Any], currents: list[float]) -> dict[str, Any]:
    first = condition_on_screen(group[0].condition)
    assert first is not None  # only moving runs are grouped
    cells: list[list[str]] = [[] for _ in currents]
    for row in group:
        nearest = min(range(len(currents)), key=lambda i: abs(currents[i] - row.condition.current_A))
        cells[nearest].append(row.key)
    return {"frequency_Hz": first["frequency_Hz"], "amplitude_mm": first["amplitude_mm"], "cells": cells}


def _upload(session: Session, key: str) -> Upload:
    if key not in session.uploads:
        raise UnknownNameError("that drop is over", remedy="drop the files again")
    return session.uploads[key]


def _too_large(name: str) -> UploadError:
    return UploadError(
        f"the file is over {FILE_LIMIT // 1_000_000} MB",
        where=name,
        remedy="read it with mrdamper import, which has no such limit, and drop the dataset folder",
        code="E_DROP_SIZE",
    )
