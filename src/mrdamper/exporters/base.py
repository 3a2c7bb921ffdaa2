"""Base class of export formats: files by name, written whole or not at all."""

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
    notes: tuple[str, ...] = field(default=())  # what the user should know: limits, platforms left out


class Exporter(ABC):
    """An export format. Subclasses are final and found by their file."""

    name: ClassVar[str]
    title: ClassVar[str]
    suffix: ClassVar[str] = ""  # of the one file it makes; empty: a folder of files

    @abstractmethod
    def export(self, damper: Damper | Model, name: str) -> Written:
        """Make the files; their names and symbols begin with `name`, an identifier in C."""


def write_export(written: Written, out: str | Path, suffix: str) -> list[Path]:
    """Write what an export made, whole or not at all: one file at `out`, or several into the folder `out`.

    Raises `OutputError` if it cannot be written.
    """
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
    """Make a name for files and symbols of any text; raises `InputError` (E_EXPORT_NAME) if nothing is left."""
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
