"""The test list: file, run, motion, current and split of every uploaded test, to be corrected by the user."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field

from mrdamper.data import Run
from mrdamper.errors import InputError, UnknownNameError
from mrdamper.physics.motion import equivalent_sine
from mrdamper.rig_files.preview import preview
from mrdamper.rig_files.profile import Channel, Profile, parse_profile, profile_text
from mrdamper.study.split import hold_out
from mrdamper.web.api.data import find_upload, overview
from mrdamper.web.imported_data import read_upload
from mrdamper.web.rig_upload import reasons, with_split
from mrdamper.web.sessions import OpenSession, Session
from mrdamper.web.uploads import Upload

router = APIRouter(prefix="/sessions/{session}")
_MAX_CURRENT_A = 200.0


class StatedCurrent(BaseModel, extra="forbid"):
    """The coil current of a test [A]; None withdraws the current stated before."""

    file: int = Field(ge=0)
    run: str = Field(max_length=300)
    current_A: float | None = Field(default=None, ge=-_MAX_CURRENT_A, le=_MAX_CURRENT_A, allow_inf_nan=False)


class ChosenColumn(BaseModel, extra="forbid"):
    """Column of a channel, counted from zero, with unit and sign."""

    column: int = Field(ge=0, le=1000)
    unit: str = Field(default="", max_length=40)
    sign: Literal[1, -1] = 1


class Columns(BaseModel, extra="forbid"):
    """Columns of the channels, for all files; other channels are found by their names."""

    channels: dict[str, ChosenColumn]


class ValidationRuns(BaseModel, extra="forbid"):
    """Choice of validation runs as in `mrdamper split`; by default a stratified fifth."""

    runs: list[str] = Field(default=[], max_length=100_000)
    currents: list[float] = Field(default=[], max_length=1000)
    every: int | None = Field(default=None, ge=2)
    none: bool = False


@router.get("/tests")
def tests(session: OpenSession) -> dict[str, Any]:
    """List every test, the refused ones too, and the first rows of a file."""
    upload = session.upload
    if upload is None or not (upload.taken or upload.refused):
        return {"tests": [_row(run) for run in session.dataset] if session.imported else [], "preview": None}
    return {"tests": _rows(upload, session), "preview": _preview(upload)}


@router.post("/tests/current")
def state_current(stated: StatedCurrent, session: OpenSession) -> dict[str, Any]:
    """State the current of one test, and read its file again."""
    upload = find_upload(session)
    paths = list(upload.names)
    if stated.file >= len(paths):
        raise UnknownNameError("no such file", remedy="choose one from the list")
    path = paths[stated.file]
    key, before = (path, stated.run), dict(upload.currents)
    upload.currents.pop(key, None)
    if stated.current_A is not None:
        upload.currents[key] = stated.current_A
    try:
        session.load(read_upload(upload, upload.toml, only=path))
    except InputError as error:
        if error.code == "E_TESTS":  # no such test
            upload.currents = before
        raise
    return overview(session)


@router.post("/tests/columns")
def choose_columns(columns: Columns, session: OpenSession) -> dict[str, Any]:
    """Choose the columns of the channels, and read all files again."""
    upload = find_upload(session)
    profile = _profile(upload) or Profile()
    chosen = {name: _channel(profile, name, column) for name, column in columns.channels.items()}
    text = profile_text(profile.model_copy(update={"channels": {**profile.channels, **chosen}}))
    parse_profile(text)  # checks the units
    session.load(read_upload(upload, text))
    return overview(session)


@router.post("/tests/split")
def split(choice: ValidationRuns, session: OpenSession) -> dict[str, Any]:
    """Choose the validation runs by the rules of `mrdamper split`."""
    chosen = hold_out(session.dataset, **choice.model_dump(), replace=True)
    imported = session.imported
    assert imported is not None  # session.dataset raises without data
    if session.upload is not None:
        session.upload.validation = chosen.held_out
    session.load(replace(imported, dataset=with_split(imported.dataset, chosen.held_out)))
    return {**overview(session), "reason": chosen.reason}


def _profile(upload: Upload) -> Profile | None:
    return parse_profile(upload.toml) if upload.toml.strip() else None


def _channel(profile: Profile, name: str, chosen: ChosenColumn) -> Channel:
    channel = profile.channel(name)
    settings = channel.model_dump(exclude_unset=True, exclude_none=True)
    if channel.scale is None:
        settings.pop("unit", None)
        settings |= {"unit": chosen.unit} if chosen.unit else {}
    return Channel(**{**settings, "column": chosen.column + 1, "sign": chosen.sign})


def _rows(upload: Upload, session: Session) -> list[dict[str, Any]]:
    imported = session.imported
    runs = iter(imported.dataset if imported is not None and imported.source == "upload" else ())
    refused, taken = [], []
    numbers = {path: number for number, path in enumerate(upload.names)}
    for path in upload.paths_by_name():
        file = {"file": numbers[path], "name": upload.names[path]}
        refusals = upload.refused.get(path, ())
        for test in dict.fromkeys(refusal.run for refusal in refusals):
            findings = reasons(upload, path, [refusal for refusal in refusals if refusal.run == test])
            current = upload.currents.get((path, test))
            refused.append({
                **file, "test": test, "run": "", "current_A": current, "motion": "", "split": "", "state": "refused",
                "findings": findings,
            })  # fmt: skip
        for record, run in zip(upload.taken.get(path, ()), runs):  # noqa: B905 (the runs of all files in a row)
            findings = [(finding.code, finding.text) for finding in record.findings]
            taken.append({**_row(run), **file, "test": record.id, "findings": findings})
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
    profile = _profile(upload)
    for path in sorted(upload.paths_by_name(), key=lambda path: path not in upload.refused):
        try:
            shown = preview(path, profile)
        except InputError:
            continue
        names = [name or f"column {i}" for i, name in enumerate(shown["names"], 1)]
        return {**shown, "name": upload.names[path], "names": names}
    return None
