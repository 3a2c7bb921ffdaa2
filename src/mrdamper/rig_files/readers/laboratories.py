"""Formats of testing machines as lists of columns, where the words and units of columns do not tell them."""

from __future__ import annotations

import re
from typing import ClassVar

from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.base import RawTable, Source
from mrdamper.rig_files.readers.delimited import DelimitedText

_STATED = re.compile(r"(?P<name>.*?)\s*\((?P<unit>[^()]*)\)\s*")


class ColumnList(DelimitedText):
    """A format of text whose columns are listed; what the list leaves open is found as in any text.

    The asterisk in "Force (*)" is the unit that the file states; "Force (N)" states it here. A heading may end a
    path: Model/Load cell.
    """

    suffixes = ()
    mark: ClassVar[str]  # regular expression that the first 4 KiB of such a file match, and no other file's
    columns: ClassVar[tuple[tuple[str, str], ...]] = ()  # channel and heading, in every version there is
    form: ClassVar[FileForm] = FileForm()  # that the files always have; a profile overrules it

    def recognises(self, source: Source) -> bool:
        """By the mark in the first lines."""
        return re.search(self.mark, source.head().replace(b"\0", b"").decode("latin-1"), re.MULTILINE) is not None

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return the tables of the text with the listed columns named by their channels."""
        stated = {**self.form.model_dump(exclude_defaults=True), **form.model_dump(exclude_defaults=True)}
        return [self.special(self._named(table)) for table in super().tables(source, FileForm(**stated))]

    def special(self, table: RawTable) -> RawTable:
        """Return the table with what else is special about the format; to be overridden."""
        return table

    def _named(self, table: RawTable) -> RawTable:
        wanted: dict[str, tuple[str, str]] = {}
        for role, heading in self.columns:
            match = _STATED.fullmatch(heading)
            name, unit = (match["name"], match["unit"]) if match else (heading, "*")
            wanted[name.casefold()] = role, "" if unit == "*" else unit
        headings = {}
        for i, (name, header) in enumerate(zip(table.names, table.headers, strict=True)):
            bare = {text.casefold() for text in (name, header.name, header.name.rpartition("/")[2])}
            role, unit = next((wanted[text] for text in bare if text in wanted), ("", ""))
            if role and (header.role != role or unit):
                headings[i] = f"{header.name} {role}", unit or header.unit
        return table.named(headings)
