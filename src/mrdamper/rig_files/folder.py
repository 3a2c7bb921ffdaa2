"""The files of folders and archives that may hold tests; archives (zip, tar, tgz) are unpacked within bounds."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import tarfile
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath
from typing import IO

from mrdamper.data.temporary import temporary_folder
from mrdamper.rig_files.column_names import COMPUTED, holds, words_of
from mrdamper.rig_files.readers import ask_tables, suffixes
from mrdamper.rig_files.readers.archive import (
    UNREADABLE_ZIP,
    as_it_is,
    bomb,
    check_member,
    files_among,
    is_junk,
    opened,
    zip_members,
)
from mrdamper.rig_files.readers.base import MOST_RATIO, MOST_UNPACKED, RawTable, RigFileError, Source
from mrdamper.rig_files.tests_table import NAME as TESTS
from mrdamper.rig_files.vocabulary import words

_RAW = words("raw")
_MOST_MEMBERS = 10_000
_PIECE = 2**20
_NESTED = (".zip", ".gz", ".tgz", ".tar", ".bz2", ".xz", ".7z", ".rar")


@contextlib.contextmanager
def unpacked(paths: Iterable[str | Path]) -> Iterator[list[Path]]:
    """Yield the same paths, with a folder in the place of every archive of several files; raises as `opened`."""
    with contextlib.ExitStack() as stack:
        members = []
        for path in map(Path, paths):
            members += [_folder_of(path, stack)] if _is_packed_folder(path) else [path]
            inside = sorted(path.rglob("*")) if path.is_dir() else ()
            members += [_folder_of(archive, stack) for archive in inside if _is_packed_folder(archive)]
        yield members


def files_in(paths: Iterable[Path]) -> tuple[list[Path], list[Path]]:
    """Return the files to be read, and those of the folders that are of other kinds."""
    files: list[Path] = []
    others: list[Path] = []
    for path in paths:
        if not path.is_dir():
            files.append(path)
            continue
        inside = [
            Path(folder) / name
            for folder, _, names in os.walk(path)
            for name in names
            if not name.startswith((".", "~$")) and name != TESTS
        ]
        inside.sort(key=_by_number)
        inside = [file for file in inside if file.is_file() and not _is_packed_folder(file)]  # no pipes
        recognised = [file for file in inside if file.suffix.lower() in suffixes()]
        # Suffixes of a laboratory's own: run.001
        recognised = recognised or [file for file in inside if ask_tables(file, _are_named, False)]
        recognised = _measured(recognised, path)
        files += recognised
        read = set(recognised)
        others += [file for file in inside if file not in read]
    if not files:
        where = ", ".join(path.name for path in paths)
        problem = f"no rig's file in this folder (found {', '.join(file.name for file in others[:5]) or 'nothing'})"
        remedy = "export them as CSV, or give another folder" if others else "give another folder"
        raise RigFileError("E_NO_DATA", problem, file=where, remedy=remedy)
    return files, others


def _by_number(path: Path) -> list[list[int | str]]:
    """Return the key of an order in which test 2 comes before test 10."""
    return [[int(text) if i % 2 else text for i, text in enumerate(re.split(r"([0-9]+)", part))] for part in path.parts]


def _measured(files: list[Path], top: Path) -> list[Path]:
    """Return the files without those called filtered, or in such a folder, beside one that is called alike, or raw."""
    computed = {file for file in files if holds(str(file.relative_to(top)), COMPUTED)}
    names = {file: tuple(w for w in words_of(file.name) if w.casefold() not in COMPUTED | _RAW) for file in files}
    measured = {name for file, name in names.items() if file not in computed}
    return [file for file in files if file not in computed or names[file] not in measured]


def _are_named(tables: list[RawTable]) -> bool:
    return any(table.names for table in tables)


def _is_packed_folder(path: Path) -> bool:
    """Tell if a file is a tar, or a zip of several files."""
    name = path.name.lower()
    if name.startswith(".") or not path.is_file():
        return False
    if name.endswith((".tar", ".tgz", ".tar.gz")):
        return True
    if not name.endswith(".zip"):
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            return len(files_among(archive.infolist())) > 1
    except UNREADABLE_ZIP:
        return False


def _folder_of(path: Path, stack: contextlib.ExitStack) -> Path:
    top = stack.enter_context(temporary_folder()) / path.name
    top.mkdir()
    if path.suffix.lower() == ".zip":
        with as_it_is(path) as source:
            _unzip(source, top)
    else:
        with opened(path, folder=True) as source:
            _untar(source, top)
    inside = list(top.iterdir())
    return inside[0] if len(inside) == 1 and inside[0].is_dir() else top


def _unzip(source: Source, top: Path) -> None:
    with zip_members(source) as (archive, members):
        room = _Room(source, top)
        for member in members:
            with archive.open(member) as stream:
                room.write(member.filename, stream)


def _untar(source: Source, top: Path) -> None:
    try:
        with tarfile.open(fileobj=source.file, mode="r:") as archive:
            room = _Room(source, top)
            for member in archive:
                check_member(source, member.name, link=not (member.isfile() or member.isdir()))
                stream = archive.extractfile(member) if member.isfile() and not is_junk(member.name) else None
                if stream is not None:
                    room.write(member.name, stream)
    except RigFileError:
        raise
    except (tarfile.TarError, OSError, ValueError, EOFError) as error:
        code = "E_TRUNCATED" if "unexpected end" in str(error) else "E_ARCHIVE"
        raise source.refuse(code, f"damaged archive ({error})", "copy or pack it again") from error


class _Room:
    """The folder that is filled, and how much may still come into it."""

    def __init__(self, source: Source, top: Path):
        self._source, self._top = source, top
        packed = source.path.stat().st_size
        self._left = min(MOST_UNPACKED, MOST_RATIO * packed)
        self._count = 0

    def write(self, name: str, stream: IO[bytes]) -> None:
        """Store one member."""
        self._count += 1
        if self._count > _MOST_MEMBERS:
            raise self._source.refuse("E_ARCHIVE", f"over {_MOST_MEMBERS} members", "unpack it first")
        if name.lower().endswith(_NESTED):
            raise self._source.refuse("E_ARCHIVE", f"an archive inside an archive ({name!a})", "unpack it first")
        target = self._top.joinpath(*PurePosixPath(name).parts)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            if target.exists():
                raise self._source.refuse("E_ARCHIVE", f"two members are called {name!a}", "pack it again")
            with target.open("xb") as file:
                while piece := stream.read(_PIECE):
                    self._left -= len(piece)
                    if self._left < 0:
                        raise bomb(self._source)
                    file.write(piece)
        except OSError as error:
            if shutil.disk_usage(self._top).free < _PIECE:
                raise
            raise self._source.refuse("E_ARCHIVE", f"member {name!a}: {error.strerror}", "pack it again") from error
