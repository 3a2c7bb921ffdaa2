"""The test list: file, run, motion, current and split of every dropped test, mended by a click."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field

from mrdamper.data import Run
from mrdamper.errors import InputError, UnknownNameError
from mrdamper.physics.motion import equivalent_sine
from mrdamper.rig_files.preview import preview
from mrdamper.rig_files.profile import Channel, Profile, parse_profile, profile_text
from mrdamper.study.split import hold_out
from mrdamper.web.api.data import overview
from mrdamper.web.imported_data import read_upload
from mrdamper.web.rig_upload import reasons, split_again
from mrdamper.web.sessions import Current, Session
from mrdamper.web.uploads import ImportedData, Upload

router = APIRouter(prefix="/sessions/{session}")
_LARGEST_A = 200.0


class Strict(BaseModel, extra="forbid"):
    """No other keys."""


class StatedCurrent(Strict):
    """The coil current of a test [A]; None takes back what was stated before."""

    file: int = Field(ge=0)
    run: str = Field(max_length=300)
    current_A: float | None = Field(default=None, ge=-_LARGEST_A, le=_LARGEST_A, allow_inf_nan=False)


class ChosenColumn(Strict):
    """Column of a channel, counted from zero, with unit and sign."""

    column: int = Field(ge=0, le=1000)
    unit: str = Field(default="", max_length=40)
    sign: Literal[1, -1] = 1


class Columns(Strict):
    """The columns of the channels, for all files; a channel that is left out is found by its name."""

    channels: dict[str, ChosenColumn]


class HeldOut(Strict):
    """Choice of validation runs as in `mrdamper split`; by default a stratified fifth."""

    runs: list[str] = Field(default=[], max_length=100_000)
    currents: list[float] = Field(default=[], max_length=1000)
    every: int | None = Field(default=None, ge=2)
    none: bool = False


@router.get("/tests")
def tests(session: Current) -> dict[str, Any]:
    """Every test that was dropped, the refused ones too, and how the first file begins."""
    upload = next(iter(session.uploads.values()), None)
    if upload is None or not (upload.taken or upload.refused):
        return {"tests": [_row(run) for run in session.dataset] if session.imported else [], "preview": None}
    return {"tests": _rows(upload, session), "preview": _preview(upload)}


@router.post("/tests/current")
def state_current(stated: StatedCurrent, session: Current) -> dict[str, Any]:
    """State the current of one test, and read its file again."""
    upload = _upload(session)
    path = _file(upload, stated.file)
    key = path, stated.run
    before = upload.currents.pop(key, None)
    if stated.current_A is not None:
        upload.currents[key] = stated.current_A
    try:
        session.put(read_upload(upload, upload.toml, only=path))
    except InputError as error:
        if error.code == "E_TESTS":  # no such test
            upload.currents.pop(key)
            upload.currents.update({} if before is None else {key: before})
        raise
    return overview(session)


@router.post("/tests/columns")
def choose_columns(columns: Columns, session: Current) -> dict[str, Any]:
    """Say which columns the channels are, and read all files again."""
    upload = _upload(session)
    profile = parse_profile(upload.toml) if upload.toml.strip() else Profile()
    chosen = {name: _channel(profile, name, column) for name, column in columns.channels.items()}
    text = profile_text(profile.model_copy(update={"channels": {**profile.channels, **chosen}}))
    parse_profile(text)  # units are checked here
    session.put(read_upload(upload, text))
    return overview(session)


@router.post("/tests/split")
def split(held: HeldOut, session: Current) -> dict[str, Any]:
    """Hold runs out, by the rules of `mrdamper split`."""
    imported = session.imported
    chosen = hold_out(
        session.dataset, runs=held.runs, currents=held.currents, every=held.every, none=held.none, replace=True
    )
    assert imported is not None  # session.dataset would have said so
    for upload in session.uploads.values():
        upload.held_out = chosen.held_out
    session.put(replace(imported, dataset=split_again(imported.dataset, chosen.held_out)))
    return {**overview(session), "reason": chosen.reason}


def _channel(profile: Profile, name: str, chosen: ChosenColumn) -> Channel:
    settings = profile.channel(name)
    says = settings.model_dump(exclude_unset=True, exclude_none=True)
    if settings.scale is None:
        says = {key: value for key, value in says.items() if key != "unit"}
        says |= {"unit": chosen.unit} if chosen.unit else {}
    return Channel(**{**says, "column": chosen.column + 1, "sign": chosen.sign})


def _upload(session: Session) -> Upload:
    upload = next(iter(session.uploads.values()), None)
    if upload is None:
        raise UnknownNameError("no files were dropped", remedy="drop the files of a rig")
    return upload


def _file(upload: Upload, number: int) -> Path:
    paths = list(upload.names)
    if number >= len(paths):
        raise UnknownNameError("no such file was dropped", remedy="choose one from the list")
    return paths[number]


def _rows(upload: Upload, session: Session) -> list[dict[str, Any]]:
    """Refused tests first, then those taken, in the order of the files."""
    imported: ImportedData | None = session.imported
    runs = iter(imported.dataset) if imported is not None and imported.source == "drop" else iter(())
    refused, taken = [], []
    for path in sorted(upload.names, key=lambda path: upload.names[path]):
        number, name = list(upload.names).index(path), upload.names[path]
        by_run: dict[str, list[Any]] = {}
        for refusal in upload.refused.get(path, ()):
            by_run.setdefault(refusal.run, []).append(refusal)
        for run_id, refusals in by_run.items():
            stated = upload.currents.get((path, run_id))
            refused.append({
                "file": number, "name": name, "test": run_id, "run": "", "current_A": stated, "motion": "", "split": "",
                "state": "refused", "findings": reasons(upload, path, refusals),
            })  # fmt: skip
        for record, run in zip(upload.taken.get(path, ()), runs):  # noqa: B905 (the runs of all files in a row)
            findings = [(finding.code, finding.text) for finding in record.findings]
            taken.append({**_row(run), "file": number, "name": name, "test": record.id, "findings": findings})
    return refused + taken


def _row(run: Run) -> dict[str, Any]:
    try:
        c = equivalent_sine(run).condition
        motion = f"{c.frequency_Hz:.3g} Hz, {1e3 * c.amplitude_m:.3g} mm"
    except InputError:
        motion = "no sine"
    return {
        "file": None, "name": run.notes.get("file", ""), "test": run.id, "run": run.id, "motion": motion,
        "current_A": None if run.current_changes else run.current_A, "split": run.split, "state": "taken",
        "findings": [(code, "") for code in run.findings],
    }  # fmt: skip


def _preview(upload: Upload) -> dict[str, Any] | None:
    profile = parse_profile(upload.toml) if upload.toml.strip() else None
    for path in sorted(upload.names, key=lambda path: (path not in upload.refused, upload.names[path])):
        try:
            shown = preview(path, profile)
        except InputError:
            continue
        names = [name or f"column {i}" for i, name in enumerate(shown["names"], 1)]
        return {**shown, "name": upload.names[path], "names": names}
    return None
