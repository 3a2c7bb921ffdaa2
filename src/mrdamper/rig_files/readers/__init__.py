"""Formats of rig files: one module a format, found by discovery."""

from __future__ import annotations

import re
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeVar

from mrdamper.discovery import Registry
from mrdamper.errors import InputError
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.archive import opened
from mrdamper.rig_files.readers.base import RawTable, Reader, RigFileError, Source
from mrdamper.rig_files.sandbox import guarded_tables

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

T = TypeVar("T")
_FOREIGN = MappingProxyType(
    {
        b"%PDF": "PDF", b"\x89PNG": "PNG image", b"\xff\xd8\xff": "JPEG image", b"GIF8": "GIF image",
        b"\xd0\xcf\x11\xe0": "old Excel or Word", b"BZh": "bzip2", b"\xfd7zXZ": "xz", b"7z\xbc\xaf": "7-Zip",
        b"Rar!": "RAR", b"\x28\xb5\x2f\xfd": "Zstandard", b"\x7fELF": "program",
        b"{\\rtf": "RTF", b"<!DOCTYPE": "HTML", b"<!doctype": "HTML", b"<html": "HTML", b"<HTML": "HTML",
        b"<?xml": "XML", b"RIFF": "RIFF",
    }
)  # fmt: skip
_PICTURES = ("PNG image", "JPEG image", "GIF image")
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")  # no text has them
_PICKLE = tuple(bytes((0x80, protocol)) for protocol in range(2, 6))


@contextmanager
def raw_tables(path: str | Path, form: FileForm | None = None) -> Iterator[list[RawTable]]:
    """Open a rig's file, whatever its format, and give its tables, readable until the block ends.

    Raises `RigFileError` if the file is damaged, of no known format, of another format than its
    name says, or can be read in more than one way.
    """
    form = form or FileForm()
    with opened(Path(path)) as source, ExitStack() as stack:
        reader = reader_of(source)
        try:
            guarded = stack.enter_context(guarded_tables(source, reader, form)) if reader.library else None
            tables = reader.tables(source, form) if guarded is None else guarded
        except RigFileError as error:  # of an array, which knows no file
            raise error if error.file else source.refuse(error.code, error.found, error.remedy) from None
        names, width = form.names, len(form.names)  # that a profile gives the columns, whatever the format
        yield [replace(t, names=names) if len(t.names) == width and t.names != names else t for t in tables]


def ask_tables(path: str | Path, ask: Callable[[list[RawTable]], T], otherwise: T, form: FileForm | None = None) -> T:
    """Return what a question about the tables of a file gives, or something else where it cannot be read."""
    try:
        with raw_tables(path, form) as tables:
            return ask(tables)
    except InputError:
        return otherwise


def reader_of(source: Source) -> Reader:
    """Return the reader whose format the content is: E_FORMAT if none or not the suffix's, E_UNSAFE for pickles."""
    head = source.head()
    if head.startswith(_PICKLE) and (len(head) < 11 or head[2:3] in b"\x95(]}cX\x8c" or b"\n" not in head[:2]):
        raise source.refuse("E_UNSAFE", "pickled Python objects, which run code when loaded", "export plain numbers")
    readers = all_readers()
    named = next((r for r in readers.values() if source.suffix in r.suffixes), None)
    reader = next((r for r in readers.values() if r.binary and r().recognises(source)), None)
    foreign = next((title for magic, title in _FOREIGN.items() if head.lstrip().startswith(magic)), None)
    text = reader is None and foreign is None and _CONTROL.search(head) is None
    if reader is None and foreign is None and (text or named is None or not named.binary):
        listed = [r for r in readers.values() if not r.binary and r.name != "text"]  # formats of laboratories
        return next((r() for r in listed if r().recognises(source)), readers["text"]())
    if reader is None or (named is not None and source.suffix not in reader.suffixes):
        is_now = reader.title if reader is not None else foreign or "something else"
        remedy = f"rename it to {reader.suffixes[0]}" if reader else "export it as CSV"
        if foreign in _PICTURES:
            remedy = "give the numbers it was drawn from"
        problem = f"the name says {named.title if named else source.suffix or 'nothing'}, the content is {is_now}"
        raise source.refuse("E_FORMAT", problem, remedy)
    return reader()


_registry: Registry[Reader] = Registry("mrdamper.readers", Reader, "format")  # type: ignore[type-abstract]
all_readers = _registry.all


def suffixes() -> tuple[str, ...]:
    """Suffixes of files a folder is searched for."""
    return tuple(sorted({s for r in all_readers().values() for s in r.suffixes} | {".gz", ".zip"}))
