"""Saved project of the app: data, dampers and state of the page in one file.

The file is a zip of plain parts (CSV, Parquet, JSON) that anybody may have written: only the names
used here are read, each up to a size, and every part passes the checks of its kind.
"""

from __future__ import annotations

import base64
import io
import shutil
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from pydantic import BaseModel, Field

from mrdamper.dampers.base import Damper
from mrdamper.dampers.model_file import dump_model, parse_model
from mrdamper.data import Dataset
from mrdamper.data.strict_text import parse_json
from mrdamper.data.temporary import temporary_folder
from mrdamper.errors import InputError
from mrdamper.report.about import logo_of
from mrdamper.rig_files.dataset_folder import SAMPLE_FILES, load_dataset, save_dataset
from mrdamper.web.imported_data import RUNS_FILE, bundled
from mrdamper.web.sessions import MAX_DAMPERS, Session
from mrdamper.web.uploads import FILE_LIMIT, ImportedData

CONTENTS, STATE, LOGO, DATA = "project.json", "state.json", "logo", "dataset"
_PART_LIMIT = 100_000_000  # bytes of one part, unpacked
_TEXT_LIMIT = 5_000_000  # bytes of a part that is text


class SavedProjectError(InputError):
    """Saved project that cannot be read or written."""

    code = "E_PROJECT"

    def __init__(self, problem: str, where: str = "the saved project", remedy: str = "save it again"):
        super().__init__(problem, where=where, remedy=remedy)


@dataclass(frozen=True)
class SavedProject:
    """Content of a saved project."""

    imported: ImportedData | None  # None where no data were loaded
    dampers: list[tuple[Damper, str, str]]  # with origin and note
    current: int | None  # index of the damper of the Model view
    state: str  # of the page, which checks it
    logo: str  # of the report, as base64; empty where there is none


class _Damper(BaseModel, extra="forbid", strict=True):
    file: str = Field(pattern=r"^dampers/\d{1,3}\.json$")
    origin: str = Field(max_length=40)
    note: str = Field(max_length=500)


class _Contents(BaseModel, extra="forbid", strict=True):
    format: str = Field(pattern="^mrdamper-project$")
    version: int = Field(ge=1, le=1)
    source: str = Field(pattern="^(bundled|upload|)$")
    name: str = Field(max_length=300)
    dampers: list[_Damper] = Field(max_length=MAX_DAMPERS)
    current: int | None = Field(default=None, ge=0)


def save_project(session: Session, state: str, shown: str | None, logo: str = "") -> bytes:
    """Return a session as a file, `shown` the damper of the Model view; raises `SavedProjectError` if too large."""
    picture = _picture(logo)
    imported, dampers = session.imported, list(session.dampers.values())
    files = [f"dampers/{i}.json" for i in range(len(dampers))]
    contents = _Contents(
        format="mrdamper-project", version=1,
        source=imported.source if imported else "", name=imported.dataset.name if imported else "",
        dampers=[_Damper(file=f, origin=d.origin, note=d.note[:500]) for f, d in zip(files, dampers, strict=True)],
        current=next((i for i, damper in enumerate(dampers) if damper.key == shown), None),
    )  # fmt: skip
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(CONTENTS, contents.model_dump_json(indent=1))  # first: the page recognises the file by it
        archive.writestr(STATE, state)
        if picture:
            archive.writestr(LOGO, picture)
        for name, damper in zip(files, dampers, strict=True):
            archive.writestr(name, dump_model(damper.damper))
        if imported and imported.source != "bundled":
            with temporary_folder() as folder:
                save_dataset(imported.dataset, folder / DATA)
                for path in sorted((folder / DATA).iterdir()):
                    archive.write(path, f"{DATA}/{path.name}")
    if packed.tell() > FILE_LIMIT:
        problem = f"{packed.tell() / 1e6:.0f} MB, over the {FILE_LIMIT / 1e6:.0f} MB that the app opens"
        raise SavedProjectError(problem, remedy="keep the dataset folder and save the state alone")
    return packed.getvalue()


def open_saved_project(path: Path, place: Path) -> SavedProject:
    """Read a saved project, whose data are unpacked in `place`; raises `SavedProjectError`, or another `InputError`."""
    try:
        with zipfile.ZipFile(path) as archive:
            return _read(archive, place / "project")
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, OSError, zlib.error) as error:
        raise SavedProjectError(f"is damaged: {error}", remedy="copy it again") from error


def _read(archive: zipfile.ZipFile, place: Path) -> SavedProject:
    names = archive.namelist()
    try:
        contents = _Contents.model_validate(parse_json(_part(archive, CONTENTS).decode("utf-8")))
    except ValueError as error:
        raise SavedProjectError("has another version", CONTENTS, "update mrdamper, or save it again") from error
    data = [f"{DATA}/{name}" for name in (RUNS_FILE, *SAMPLE_FILES)]
    expected = {CONTENTS, STATE, LOGO, *(d.file for d in contents.dampers), *data}
    if len(set(names)) != len(names) or not set(names) <= expected:
        unknown = next((n for n in names if n not in expected), "one name twice")
        raise SavedProjectError(f"contains {PurePosixPath(unknown).name!r:.60}")
    if contents.current is not None and contents.current >= len(contents.dampers):
        raise SavedProjectError("names a damper that is missing", CONTENTS)
    dampers = [
        (parse_model(_part(archive, d.file).decode("utf-8", "replace"), where=d.file), d.origin, d.note)
        for d in contents.dampers
    ]
    state = _part(archive, STATE).decode("utf-8", "replace")
    try:
        parse_json(state)
    except ValueError as error:
        raise SavedProjectError(str(error), STATE) from error
    logo = base64.b64encode(_part(archive, LOGO)).decode("ascii") if LOGO in names else ""
    _picture(logo)
    imported = _read_data(archive, contents, [n for n in data if n in names], place)
    return SavedProject(imported, dampers, contents.current, state, logo)


def _picture(logo: str) -> bytes:
    """Return the bytes of a logo that a report can show; empty where there is none."""
    if logo:
        logo_of(logo)
    return base64.b64decode(logo)


def _read_data(archive: zipfile.ZipFile, contents: _Contents, parts: list[str], place: Path) -> ImportedData | None:
    if contents.source == "bundled":
        return bundled()
    if not contents.source:
        return None
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    for name in parts:
        (place / PurePosixPath(name).name).write_bytes(_part(archive, name, _PART_LIMIT))
    try:
        return ImportedData(Dataset(load_dataset(place).runs, contents.name), "upload")
    except InputError as error:  # name the parts, not the folder they were unpacked in
        error.where, error.found = (text.replace(str(place), DATA) for text in (error.where, error.found))
        raise


def _part(archive: zipfile.ZipFile, name: str, limit: int = _TEXT_LIMIT) -> bytes:
    try:
        with archive.open(name) as part:
            content = part.read(limit + 1)
    except KeyError as error:
        raise SavedProjectError(f"has no {name}") from error
    if len(content) > limit:
        raise SavedProjectError(f"{name} is over {limit / 1e6:.0f} MB")
    return content
