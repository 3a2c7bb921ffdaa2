"""Base class of export formats: files by name, written atomically."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from mrdamper.dampers.base import Damper
from mrdamper.data.atomic import write_file, write_into
from mrdamper.errors import InputError
from mrdamper.models import Model

_NAME = re.compile(r"[a-z][a-z0-9_]{0,40}", re.IGNORECASE)
_RESERVED = re.compile(
    r"auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int"
    r"|long|register|return|short|signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile|while|main"
)


@dataclass(frozen=True)
class Written:
    """Files of an export."""

    files: Mapping[str, bytes]  # contents by file name
    notes: tuple[str, ...] = field(default=())  # notes for the user: limits, missing platforms


class Exporter(ABC):
    """An export format. Subclasses are final and found by discovery."""

    name: ClassVar[str]
    title: ClassVar[str]
    suffix: ClassVar[str] = ""  # suffix of its one file; empty: a folder of files

    @abstractmethod
    def export(self, damper: Damper | Model, name: str) -> Written:
        """Make the files; their names and symbols begin with `name`, an identifier in C."""


def write_export(written: Written, out: str | Path, suffix: str) -> list[Path]:
    """Write the files of an export atomically, one at `out` or several into that folder; raises `OutputError`."""
    out = Path(out)
    if suffix and not out.is_dir():
        with write_file(out) as target:
            target.write_bytes(next(iter(written.files.values())))
        return [out]
    with write_into(out) as folder:
        for name, content in written.files.items():
            (folder / name).write_bytes(content)
    return [out / name for name in written.files]


def identifier(text: str) -> str:
    """Convert any text to a name for files and symbols; raises `InputError` (E_EXPORT_NAME) if it is empty then."""
    word = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_").lower()
    if word and word[0].isdigit():
        word = f"damper_{word}"
    if not _NAME.fullmatch(word) or _RESERVED.fullmatch(word):
        raise InputError(
            f"{text!r} makes no name in C",
            remedy="give --name: a letter, then up to 40 letters, digits and underscores",
            code="E_EXPORT_NAME",
        )
    return word
