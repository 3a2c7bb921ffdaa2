"""Packed files: gz, and zip with one member; unpacked within bounds, never onto a path of its own."""

from __future__ import annotations

import contextlib
import stat
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import IO

from mrdamper.rig_files.readers.base import MOST_RATIO, MOST_UNPACKED, RigFileError, Source, scratch

_PIECE = 2**20
_GZIP = b"\x1f\x8b"
_PACKED = (_GZIP, b"BZh", b"\xfd7zXZ", b"7z\xbc\xaf", b"Rar!", b"\x28\xb5\x2f\xfd")
_TAR = slice(257, 262)
# What zipfile raises for a zip it cannot read; NotImplementedError for a packing method it does not know.
UNREADABLE_ZIP = (zipfile.BadZipFile, OSError, ValueError, NotImplementedError)


@contextlib.contextmanager
def opened(path: Path, *, folder: bool = False) -> Iterator[Source]:
    """Open a file and unpack it if it is packed; of an archive of a folder, to the archive of its files.

    Raises `RigFileError`, its code E_FILE, E_EMPTY, E_TRUNCATED, E_FORMAT or E_ARCHIVE with or without an ending.
    """
    with as_it_is(path) as source:
        if source.size == 0:
            raise source.refuse("E_EMPTY", "0 bytes", "copy or export the file again")
        head = source.head()
        packed = head.startswith(_GZIP) or is_plain_zip(source)
        if source.suffix in (".gz", ".zip") and not packed:
            code, problem = "E_TRUNCATED" if source.size < 4 else "E_FORMAT", f"no {source.suffix[1:]} archive"
            raise source.refuse(code, f"the content is {problem}", "copy the file again, or correct its name")
        if folder:
            source = _gunzip(source) if head.startswith(_GZIP) else source
            source.file.seek(0)
            yield source
            return
        if packed and source.suffix not in (".gz", ".zip", ".gzip", ""):
            remedy = "rename it to .zip or .gz"
            if source.suffix == ".fmu":
                remedy = "an FMU is a model: mrdamper check reads it"
            raise source.refuse("E_FORMAT", f"the name says {source.suffix}, the content is a packed file", remedy)
        if packed:
            source = _unzip(source) if head.startswith(b"PK") else _gunzip(source)
            if source.size == 0:
                raise source.refuse("E_EMPTY", "0 bytes", "copy or export the file again")
            head = source.head()
            if head.startswith(_PACKED) or head[_TAR] == b"ustar" or is_plain_zip(source):
                raise source.refuse("E_ARCHIVE", "an archive inside an archive", "unpack it first")
        yield source


@contextlib.contextmanager
def as_it_is(path: Path) -> Iterator[Source]:
    """Open a file, whatever it holds."""
    try:
        problem = "is a folder" if path.is_dir() else "no such file"
        file = path.open("rb") if path.is_file() else None
    except (OSError, ValueError) as error:
        problem, file = getattr(error, "strerror", None) or str(error), None
    if file is None:
        raise RigFileError("E_FILE", problem, file=str(path), remedy="give the path of a rig's file")
    with contextlib.ExitStack() as stack:
        stack.enter_context(file)
        yield Source(path, path.name, path.suffix.lower(), file, path.stat().st_size, stack)


def is_plain_zip(source: Source) -> bool:
    """Tell if the content is a zip that is not itself a document or a NumPy file."""
    kinds = ((is_workbook, (".xlsx", ".xlsm", ".xlsb", ".ods")), (is_arrays, (".npz",)))
    is_zip = source.head().startswith((b"PK\x03\x04", b"PK\x05\x06"))
    return is_zip and not any(is_zip_of(source, *kind) for kind in kinds)


def is_workbook(names: list[str]) -> bool:
    """Tell if a zip of these members is a workbook."""
    excel = "[Content_Types].xml" in names and any(name.startswith("xl/") for name in names)
    return excel or {"mimetype", "content.xml", "META-INF/manifest.xml"} <= set(names)


def is_arrays(names: list[str]) -> bool:
    """Tell if a zip of these members holds NumPy arrays."""
    return bool(names) and all(name.endswith(".npy") for name in names)


def is_zip_of(source: Source, holds: Callable[[list[str]], bool], suffixes: Sequence[str]) -> bool:
    """Tell if the content is a zip of such members, or a damaged zip of such a name."""
    if source.head(2) != b"PK":
        return False
    try:
        with zipfile.ZipFile(source.file) as archive:
            return holds(archive.namelist())
    except UNREADABLE_ZIP:
        return source.suffix in suffixes
    finally:
        source.file.seek(0)


@contextlib.contextmanager
def checked_zip(source: Source, title: str) -> Iterator[zipfile.ZipFile]:
    """Yield a zip once the sizes of its members are checked; E_TRUNCATED if it cannot be read."""
    try:
        archive = zipfile.ZipFile(source.file)
    except UNREADABLE_ZIP as error:
        problem = f"damaged {title} (end of file not found)"
        raise source.refuse("E_TRUNCATED", problem, "copy or export the file again") from error
    with archive:
        _check_sizes(source, archive.infolist())
        yield archive


def _check_sizes(source: Source, members: list[zipfile.ZipInfo]) -> None:
    """Refuse what would unpack to far more than it is: E_ARCHIVE_RATIO."""
    unpacked = sum(member.file_size for member in members)
    packed = max(1, sum(member.compress_size for member in members))
    if unpacked > MOST_UNPACKED or unpacked > MOST_RATIO * min(packed, source.size):
        raise bomb(source)


def bomb(source: Source) -> RigFileError:
    """Return the refusal of a file that unpacks to too much."""
    problem = f"unpacks to over {MOST_RATIO} times its size, or over {MOST_UNPACKED // 10**9} GB"
    return source.refuse("E_ARCHIVE_RATIO", problem, "give the unpacked file")


def _unzip(source: Source) -> Source:
    with zip_members(source) as (archive, members):
        if len(members) != 1:
            remedy = "read it as a folder: mrdamper import, or unpack it first"
            raise source.refuse("E_ARCHIVE", f"{len(members)} members", remedy)
        inner, packed = members[0].filename, max(1, members[0].compress_size)
        with archive.open(members[0]) as stream:
            file = _unpacked(source, iter(lambda: stream.read(_PIECE), b""), packed)
    suffix = PurePosixPath(inner).suffix.lower()
    return replace(source, name=f"{source.name}:{inner}", suffix=suffix, file=file, size=file.tell())


@contextlib.contextmanager
def zip_members(source: Source) -> Iterator[tuple[zipfile.ZipFile, list[zipfile.ZipInfo]]]:
    """Yield a zip and the files in it, once their names and sizes are checked; refuse what cannot be read of them."""
    try:
        with zipfile.ZipFile(source.file) as archive:
            for member in archive.infolist():
                check_member(source, member.filename, link=stat.S_ISLNK(member.external_attr >> 16))
            members = files_among(archive.infolist())
            if any(member.flag_bits & 1 for member in members):
                raise source.refuse("E_ARCHIVE", "a member is encrypted", "unpack it first")
            _check_sizes(source, members)
            yield archive, members
    except RigFileError:
        raise
    except EOFError as error:
        raise _cut(source) from error
    except (*UNREADABLE_ZIP, zlib.error, RuntimeError, struct.error) as error:
        source.file.seek(max(0, source.size - 70_000))
        directory = b"PK\x05\x06"  # stands at the end of a zip
        if isinstance(error, zipfile.BadZipFile) and directory not in source.file.read(70_000):
            raise _cut(source) from error
        raise source.refuse("E_ARCHIVE", f"damaged or unusual archive ({error})", "pack it again") from error


def files_among(members: Iterable[zipfile.ZipInfo]) -> list[zipfile.ZipInfo]:
    """Return the members of a zip that are files, without those that systems add."""
    return [member for member in members if not member.is_dir() and not is_junk(member.filename)]


def is_junk(name: str) -> bool:
    """Tell if a file is one that systems leave in folders: .DS_Store, __MACOSX/._run1.csv, Thumbs.db."""
    parts = PurePosixPath(name).parts
    return not parts or "__MACOSX" in parts or parts[-1].startswith((".", "~$")) or parts[-1] == "Thumbs.db"


def check_member(source: Source, name: str, *, link: bool) -> None:
    """Refuse a member without a name, one whose name leads out of the archive, and a link."""
    if not name:
        raise source.refuse("E_ARCHIVE", "a member without a name", "pack it again")
    parts = [*PurePosixPath(name).parts, *PureWindowsPath(name).parts]
    if ".." in parts or name.startswith(("/", "\\")) or PureWindowsPath(name).drive or "\0" in name:
        raise source.refuse("E_ARCHIVE_PATH", f"member {name!a} leads out of the archive", "pack it again")
    if link:
        raise source.refuse("E_ARCHIVE", f"member {name!a} is a link", "pack the file itself")


def _gunzip(source: Source) -> Source:
    try:
        file = _unpacked(source, _inflated(source), source.size)
    except EOFError as error:
        raise _cut(source) from error
    except zlib.error as error:
        raise source.refuse("E_ARCHIVE", f"damaged archive ({error})", "pack it again") from error
    inner = source.path.stem if source.suffix in (".gz", ".gzip") else source.path.name
    return replace(source, suffix=Path(inner).suffix.lower(), file=file, size=file.tell())


def _inflated(source: Source) -> Iterator[bytes]:
    """Yield the content of a gz, block by block; one member only, as several may be several files."""
    decoder = zlib.decompressobj(wbits=31)
    while not decoder.eof:
        packed = decoder.unconsumed_tail or source.file.read(_PIECE)
        if not packed:
            raise EOFError
        yield decoder.decompress(packed, _PIECE)
    rest = (decoder.unused_data + source.file.read(_PIECE)).lstrip(b"\0")
    if rest:
        problem = "more than one member" if rest.startswith(_GZIP) else "bytes behind the archive's end"
        raise source.refuse("E_ARCHIVE", problem, "unpack it first")


def _unpacked(source: Source, pieces: Iterable[bytes], packed: int) -> IO[bytes]:
    target = scratch(source.keep)
    for piece in pieces:
        target.write(piece)
        if target.tell() > min(MOST_UNPACKED, MOST_RATIO * packed):
            raise bomb(source)
    return target


def _cut(source: Source) -> RigFileError:
    return source.refuse("E_TRUNCATED", "the archive ends early", "copy the file again")
