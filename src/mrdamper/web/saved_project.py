"""Saved project of the app: data, dampers and state of the page in one file.

The file is a zip of plain parts (CSV, Parquet, JSON). What comes back was written by anybody: only
the names written here are read, each up to a size, and every part passes the checks its kind has anyway.
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
from mrdamper.web.imported_data import bundled
from mrdamper.web.sessions import MOST_DAMPERS, Session
from mrdamper.web.uploads import FILE_LIMIT, ImportedData

LIST, STATE, LOGO, DATA = "bench.json", "bench-state.json", "logo", "dataset"
_PART_LIMIT = 100_000_000  # bytes of one part, unpacked
_SMALL_LIMIT = 5_000_000  # of a part that is text


class SavedProjectError(InputError):
    """Saved project that cannot be read."""

    code = "E_KEPT"


@dataclass(frozen=True)
class SavedProject:
    """Content of a saved project."""

    imported: ImportedData | None  # data; None where there were none
    dampers: list[tuple[Damper, str, str]]  # with how each came to the bench and its note
    current: int | None  # the damper under the sliders
    state: str  # what the page showed, which the page checks
    logo: str  # of the report's head, as base64; empty where there is none


class _Damper(BaseModel, extra="forbid", strict=True):
    file: str = Field(pattern=r"^dampers/\d{1,3}\.json$")
    origin: str = Field(max_length=40)
    note: str = Field(max_length=500)


class _List(BaseModel, extra="forbid", strict=True):
    format: str = Field(pattern="^mrdamper-bench$")
    version: int = Field(ge=1, le=1)
    source: str = Field(pattern="^(bundled|drop|)$")
    name: str = Field(max_length=300)
    dampers: list[_Damper] = Field(max_length=MOST_DAMPERS)
    current: int | None = Field(default=None, ge=0)


def save_project(session: Session, state: str, shown: str | None, logo: str = "") -> bytes:
    """Return a session as such a file.

    Raises `SavedProjectError` if it would be too large to be dropped on a bench again, and `AboutError` if the logo is
    no picture.
    """
    picture = _picture(logo)
    imported, dampers = session.imported, list(session.dampers.values())
    files = [f"dampers/{i}.json" for i in range(len(dampers))]
    about = _List(
        format="mrdamper-bench",
        version=1,
        source=imported.source if imported else "",
        name=imported.dataset.name if imported else "",
        dampers=[
            _Damper(file=f, origin=b.origin, note=b.note[:500]) for f, b in zip(files, dampers, strict=True)
        ],
        current=next((i for i, bench in enumerate(dampers) if bench.key == shown), None),
    )  # fmt: skip
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(LIST, about.model_dump_json(indent=1))  # first: the page knows the file by it
        archive.writestr(STATE, state)
        if picture:
            archive.writestr(LOGO, picture)
        for name, bench in zip(files, dampers, strict=True):
            archive.writestr(name, dump_model(bench.damper))
        if imported and imported.source != "bundled":
            _write_data(imported.dataset, archive)
    if packed.tell() > FILE_LIMIT:
        raise SavedProjectError(
            f"the bench is {packed.tell() / 1e6:.0f} MB, over the {FILE_LIMIT / 1e6:.0f} MB a bench takes back",
            remedy="keep its dataset folder and save the state alone",
        )
    return packed.getvalue()


def _write_data(dataset: Dataset, archive: zipfile.ZipFile) -> None:
    with temporary_folder() as place:
        folder = place / DATA
        save_dataset(dataset, folder)
        for path in sorted(folder.iterdir()):
            archive.write(path, f"{DATA}/{path.name}")


def open_saved_project(path: Path, place: Path) -> SavedProject:
    """Read such a file; `place` is a folder its data may be unpacked in.

    Raises `SavedProjectError` if it is no such file, is damaged, or holds what does not belong in it, and an
    `InputError` of a dataset or a model that cannot be read.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            return _read(archive, place / "kept")
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, OSError, zlib.error) as error:
        raise SavedProjectError(f"is damaged: {error}", where="the saved project", remedy="copy it again") from error


def _read(archive: zipfile.ZipFile, place: Path) -> SavedProject:
    names = archive.namelist()
    try:
        about = _List.model_validate(parse_json(_part(archive, LIST).decode("utf-8")))
    except ValueError as error:
        raise SavedProjectError(
            "has another version", where=LIST, remedy="update mrdamper, or save it again"
        ) from error
    data = [f"{DATA}/{name}" for name in ("runs.csv", *SAMPLE_FILES)]
    expected = {LIST, STATE, LOGO, *(d.file for d in about.dampers), *data}
    if len(set(names)) != len(names) or not set(names) <= expected:
        odd = next((n for n in names if n not in expected), "one name twice")
        raise SavedProjectError(
            f"holds {PurePosixPath(odd).name!r:.60}", where="the saved project", remedy="save it again"
        )
    if about.current is not None and about.current >= len(about.dampers):
        raise SavedProjectError("names a damper it does not hold", where=LIST, remedy="save it again")
    dampers = [
        (parse_model(_part(archive, d.file).decode("utf-8", "replace"), where=d.file), d.origin, d.note)
        for d in about.dampers
    ]
    state = _part(archive, STATE).decode("utf-8", "replace")
    try:
        parse_json(state)
    except ValueError as error:
        raise SavedProjectError(str(error), where=STATE, remedy="save it again") from error
    logo = base64.b64encode(_part(archive, LOGO)).decode("ascii") if LOGO in names else ""
    _picture(logo)
    imported = _data(archive, about, [n for n in data if n in names], place)
    return SavedProject(imported, dampers, about.current, state, logo)


def _picture(logo: str) -> bytes:
    """Return the bytes of a logo that a report can show; none where there is none."""
    if logo:
        logo_of(logo)
    return base64.b64decode(logo)


def _data(archive: zipfile.ZipFile, about: _List, parts: list[str], place: Path) -> ImportedData | None:
    if about.source == "bundled":
        return bundled()
    if not about.source:
        return None
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    for name in parts:
        (place / PurePosixPath(name).name).write_bytes(_part(archive, name, _PART_LIMIT))
    try:
        return ImportedData(Dataset(load_dataset(place).runs, about.name), "drop")
    except InputError as error:  # of the parts it names, not of the folder they were unpacked in
        error.where, error.found = (text.replace(str(place), DATA) for text in (error.where, error.found))
        raise


def _part(archive: zipfile.ZipFile, name: str, limit: int = _SMALL_LIMIT) -> bytes:
    """One part, up to a size whatever it claims to be."""
    try:
        with archive.open(name) as part:
            content = part.read(limit + 1)
    except KeyError as error:
        raise SavedProjectError(f"holds no {name}", where="the saved project", remedy="save it again") from error
    if len(content) > limit:
        raise SavedProjectError(
            f"{name} is over {limit / 1e6:.0f} MB", where="the saved project", remedy="save it again"
        )
    return content
