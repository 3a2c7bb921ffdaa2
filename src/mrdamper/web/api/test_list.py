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
from mrdamper.web.drops import Drop, Intake
from mrdamper.web.intake import read_drop
from mrdamper.web.rig_drop import reasons, split_again
from mrdamper.web.sessions import Current, Session

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
    drop = next(iter(session.drops.values()), None)
    if drop is None or not (drop.taken or drop.refused):
        return {"tests": [_row(run) for run in session.dataset] if session.intake else [], "preview": None}
    return {"tests": _rows(drop, session), "preview": _preview(drop)}


@router.post("/tests/current")
def state_current(stated: StatedCurrent, session: Current) -> dict[str, Any]:
    """State the current of one test, and read its file again."""
    drop = _drop(session)
    path = _file(drop, stated.file)
    key = path, stated.run
    before = drop.currents.pop(key, None)
    if stated.current_A is not None:
        drop.currents[key] = stated.current_A
    try:
        session.put(read_drop(drop, drop.toml, only=path))
    except InputError as error:
        if error.code == "E_TESTS":  # no such test
            drop.currents.pop(key)
            drop.currents.update({} if before is None else {key: before})
        raise
    return overview(session)


@router.post("/tests/columns")
def choose_columns(columns: Columns, session: Current) -> dict[str, Any]:
    """Say which columns the channels are, and read all files again."""
    drop = _drop(session)
    profile = parse_profile(drop.toml) if drop.toml.strip() else Profile()
    chosen = {name: _channel(profile, name, column) for name, column in columns.channels.items()}
    text = profile_text(profile.model_copy(update={"channels": {**profile.channels, **chosen}}))
    parse_profile(text)  # units are checked here
    session.put(read_drop(drop, text))
    return overview(session)


@router.post("/tests/split")
def split(held: HeldOut, session: Current) -> dict[str, Any]:
    """Hold runs out, by the rules of `mrdamper split`."""
    intake = session.intake
    chosen = hold_out(
        session.dataset, runs=held.runs, currents=held.currents, every=held.every, none=held.none, replace=True
    )
    assert intake is not None  # session.dataset would have said so
    for drop in session.drops.values():
        drop.held_out = chosen.held_out
    session.put(replace(intake, dataset=split_again(intake.dataset, chosen.held_out)))
    return {**overview(session), "reason": chosen.reason}


def _channel(profile: Profile, name: str, chosen: ChosenColumn) -> Channel:
    settings = profile.channel(name)
    says = settings.model_dump(exclude_unset=True, exclude_none=True)
    if settings.scale is None:
        says = {key: value for key, value in says.items() if key != "unit"}
        says |= {"unit": chosen.unit} if chosen.unit else {}
    return Channel(**{**says, "column": chosen.column + 1, "sign": chosen.sign})


def _drop(session: Session) -> Drop:
    drop = next(iter(session.drops.values()), None)
    if drop is None:
        raise UnknownNameError("no files were dropped", remedy="drop the files of a rig")
    return drop


def _file(drop: Drop, number: int) -> Path:
    paths = list(drop.names)
    if number >= len(paths):
        raise UnknownNameError("no such file was dropped", remedy="choose one from the list")
    return paths[number]


def _rows(drop: Drop, session: Session) -> list[dict[str, Any]]:
    """Refused tests first, then those taken, in the order of the files."""
    intake: Intake | None = session.intake
    runs = iter(intake.dataset) if intake is not None and intake.source == "drop" else iter(())
    refused, taken = [], []
    for path in sorted(drop.names, key=lambda path: drop.names[path]):
        number, name = list(drop.names).index(path), drop.names[path]
        by_run: dict[str, list[Any]] = {}
        for refusal in drop.refused.get(path, ()):
            by_run.setdefault(refusal.run, []).append(refusal)
        for run_id, refusals in by_run.items():
            stated = drop.currents.get((path, run_id))
            refused.append({
                "file": number, "name": name, "test": run_id, "run": "", "current_A": stated, "motion": "", "split": "",
                "state": "refused", "findings": reasons(drop, path, refusals),
            })  # fmt: skip
        for record, run in zip(drop.taken.get(path, ()), runs):  # noqa: B905 (the runs of all files in a row)
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


def _preview(drop: Drop) -> dict[str, Any] | None:
    profile = parse_profile(drop.toml) if drop.toml.strip() else None
    for path in sorted(drop.names, key=lambda path: (path not in drop.refused, drop.names[path])):
        try:
            shown = preview(path, profile)
        except InputError:
            continue
        channels = {name: dict(zip(("column", "unit", "sign"), c, strict=True)) for name, c in shown.channels.items()}
        names = [name or f"column {i}" for i, name in enumerate(shown.names, 1)]
        head = {"name": drop.names[path], "names": names, "units": shown.units}
        return {**head, "rows": shown.rows, "channels": channels}
    return None
