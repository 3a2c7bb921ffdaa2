"""Base of the readers of rig files: the file, the table read from it, and refusals.

A reader is a class found by discovery: it says by the first bytes whether a file is its
own, and gives named columns without deciding what they mean.
"""

from __future__ import annotations

import tempfile
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import IO, ClassVar

import numpy as np

from mrdamper.data.arrays import Floats
from mrdamper.errors import InputError, printable
from mrdamper.rig_files.column_names import Header, headers_of
from mrdamper.rig_files.conditions import LONGEST_LINE, Quantity, stated_quantities
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.record import Finding

MOST_COLUMNS = 1000
MOST_UNPACKED = 10**9  # bytes
MOST_RATIO = 100  # unpacked over packed
RATIO_MATTERS_FROM = 24 * 2**20  # bytes a column of numbers may always unpack to: three copies fit a small file's share
_IN_MEMORY = 32 * 2**20  # bytes
_LARGEST_LOOKED_AT = 64 * 2**20  # bytes of a file whose samples are tried


def scratch(keep: ExitStack, most: int = _IN_MEMORY) -> IO[bytes]:
    """Room for bytes that are unpacked or rewritten: in memory, and in an unnamed file once they are more than most."""
    return keep.enter_context(tempfile.SpooledTemporaryFile(most, prefix="mrdamper-"))


class RigFileError(InputError):
    """A rig's file cannot be read, or cannot be read in one way only; line and column count from one."""

    code = "E_FILE"

    def __init__(
        self,
        code: str,
        found: str,
        *,
        file: str = "",
        line: int | None = None,
        column: int | None = None,
        remedy: str = "",
    ):
        file, found = printable(file), printable(found)
        self.file, self.line, self.column = file, line, column
        parts = [file, f"line {line}" if line is not None else "", f"column {column}" if column is not None else ""]
        super().__init__(found, where=", ".join(part for part in parts if part), remedy=remedy, code=code)


class NoTableError(RigFileError):
    """A text that holds no table at all: notes, a letter."""


@dataclass(frozen=True, eq=False)
class Source:
    """An opened file, unpacked where it was packed."""

    path: Path  # as the user gave it
    name: str  # shown in messages; names the member of an archive too
    suffix: str  # lower case, of the unpacked file
    file: IO[bytes]  # seekable, at its start
    size: int  # bytes after unpacking
    keep: ExitStack = field(default_factory=ExitStack)  # closes what readers opened when the file is closed
    added: int = 0  # lines of names that were written above the rows
    before: int = 0  # empty columns of a sheet in front of the first one

    def head(self, size: int = 4096) -> bytes:
        """Return the first bytes; the file stands at its start afterwards."""
        self.file.seek(0)
        start = self.file.read(size)
        self.file.seek(0)
        return start

    def rewritten(self, lines: Iterable[bytes], added: int = 0) -> Source:
        """Return the file with other lines, the first so many of which it did not have."""
        file = scratch(self.keep)
        for line in lines:
            file.write(line)
        return replace(self, file=file, size=file.tell(), added=added)

    def refuse(
        self, code: str, problem: str, remedy: str = "", *, line: int | None = None, column: int | None = None
    ) -> RigFileError:
        """Return a refusal that names this file."""
        line = None if line is None else max(line - self.added, 1)
        column = None if column is None else column + self.before
        return RigFileError(code, problem, file=self.name, line=line, column=column, remedy=remedy)


@dataclass(frozen=True, eq=False)
class Content:
    """Columns that were asked for."""

    values: Mapping[int, Floats]  # (N,) by position of the column, NaN where a cell is missing
    lines: np.ndarray | None = None  # (N,) of every row, counted from one, for text
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True, eq=False)
class Words:
    """A column of words, each distinct one kept once."""

    codes: np.ndarray  # (N,) int, position in `labels` of every row's word
    labels: tuple[str, ...]  # in the order they appear


@dataclass(frozen=True, eq=False)
class RawTable:
    """Named columns of a file, read when they are asked for; tuples hold one entry a column."""

    source: Source
    names: tuple[str, ...]  # as the file has them; empty strings where it has none
    units: tuple[str, ...]  # from a row or property of their own; empty where there is none
    read: Callable[[Sequence[int]], Content]  # takes the positions of columns
    words: Callable[[int], Words]  # takes the position of a column
    line: int | None = None  # of the header
    label: str = ""  # tells apart several tables of one file
    form: Mapping[str, str | int] = field(default_factory=dict)  # what was sniffed, in the words of `FileForm`
    constants: Mapping[str, float] = field(default_factory=dict)  # single numbers the file holds beside the columns
    odd: tuple[str, ...] = ()  # where it is known, what stands in a column instead of numbers, else empty
    remarks: tuple[str, ...] = ()  # what the file says beside the columns: lines above them, attributes, properties
    over: tuple[str, ...] = ()  # where a row of titles stands above the names of columns
    titles: tuple[str, ...] = ()  # of `remarks` those that are titles of several tests
    findings: tuple[Finding, ...] = ()  # what was decided on the way from the file to this table
    # of displacement and force where a text states them: 1, -1 if compression is positive, 0 if the text is unclear
    senses: Mapping[str, int] = field(default_factory=dict)
    chosen: Mapping[str, int] = field(default_factory=dict)  # columns by channel that the samples decide on
    calibrated: frozenset[str] = frozenset()  # channels whose scale the profile states
    stated_in: str = ""  # where a constant that was added on that way stands
    repeated: frozenset[str] = frozenset()  # names that several columns of the file have, of which a test may have one
    damper: str = ""  # where columns of several dampers stand beside each other, its name
    numbers: tuple[int, ...] = ()  # of the columns in their file, where the test has not all of them

    @cached_property
    def headers(self) -> tuple[Header, ...]:
        """Header of every column."""
        return headers_of(self.names, self.units)

    @property
    def decimal(self) -> str | None:
        """The decimal mark, where the form of the text has one."""
        mark = self.form.get("decimal")
        return mark if isinstance(mark, str) else None

    @cached_property
    def lines(self) -> tuple[str, ...]:
        """The lines beside the columns, cut where they are long: to match them all could take long."""
        return tuple(line[:LONGEST_LINE] for line in self.remarks)

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities that lines and single numbers beside the columns state."""
        return tuple(stated_quantities(self.remarks, self.constants, self.decimal))

    def number(self, column: int) -> int:
        """Return the number of a column in the file, counted from one."""
        return self.numbers[column] if self.numbers else column + 1

    def title(self, column: int) -> str:
        """Return the name of a column, with its number where that alone tells it from others."""
        name, number = self.names[column], f"column {self.number(column)}"
        if name and (name in self.repeated or self.names.count(name) > 1):
            return f"{name} ({number})"
        return name or number

    def columns(self, role: str | None = None, dimension: str | None = None) -> list[int]:
        """Return the columns whose name stands for a channel, whose unit is of a dimension, or both."""
        headers = enumerate(self.headers)
        return [i for i, h in headers if role in (None, h.role) and (dimension is None or h.dimension == dimension)]

    def try_read(self, *columns: int) -> Mapping[int, Floats] | None:
        """Return columns; None where one of them cannot be read."""
        try:
            return self.read(columns).values
        except InputError:
            return None

    def peek(self, *columns: int) -> Mapping[int, Floats] | None:
        """Return columns as `try_read`; None also where the file is too large to be looked at."""
        return self.try_read(*columns) if self.source.size <= _LARGEST_LOOKED_AT else None

    def noted(self, *findings: Finding) -> RawTable:
        """Return the table with further findings."""
        return replace(self, findings=(*self.findings, *findings))

    def named(self, headings: Mapping[int, tuple[str, str]]) -> RawTable:
        """Return the table with other names and units of some columns."""
        both = [headings.get(i, own) for i, own in enumerate(zip(self.names, self.units, strict=True))]
        return replace(self, names=tuple(name for name, _ in both), units=tuple(unit for _, unit in both))

    def picked(self, columns: Sequence[int], read: Callable[[Sequence[int]], Content]) -> RawTable:
        """Return some of the columns, in this order, with another way to read them, without titles."""

        def pick(entries: tuple[str, ...]) -> tuple[str, ...]:
            return tuple(entries[i] for i in columns) if entries else ()

        odd, numbers = pick(self.odd), tuple(map(self.number, columns))
        repeated = self.repeated | {name for name, count in Counter(self.names).items() if count > 1}
        own = {"names": pick(self.names), "units": pick(self.units), "odd": odd, "over": (), "numbers": numbers}
        return replace(self, words=lambda i: self.words(columns[i]), read=read, repeated=repeated, **own)

    def computed(self, column: int, needs: Sequence[int], make: Callable[[Mapping[int, Floats]], Floats]) -> RawTable:
        """Return the table with a column made of the values of others, of its own among them; the next one is added."""
        inner = self.read

        def read(columns: Sequence[int]) -> Content:
            if column not in columns:
                return inner(columns)
            content = inner(list(dict.fromkeys([*needs, *(i for i in columns if i != column)])))
            values = {i: make(content.values) if i == column else content.values[i] for i in columns}
            return replace(content, values=values)

        if column < len(self.names):
            return replace(self, read=read)
        wider = {key: (*old, "") for key in ("names", "units", "odd", "over") if (old := getattr(self, key))}
        numbers = (*self.numbers, 0) if self.numbers else ()  # that no profile gives
        return replace(self, read=read, numbers=numbers, **wider)


class Reader(ABC):
    """A format of rig files. Put a subclass into a module of `readers` and it is found."""

    name: ClassVar[str]
    title: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]]
    marks: ClassVar[tuple[bytes, ...]] = ()  # with which files of the format begin
    binary: ClassVar[bool] = True
    library: ClassVar[str] = ""  # that damaged files can crash or hang: read in a process of its own
    seconds_per_byte: ClassVar[float] = 4e-7  # it may take there

    def warm_up(self) -> None:
        """Start what the library starts once, such as threads, before a file's share of memory is counted."""
        return

    def recognises(self, source: Source) -> bool:
        """Tell if the content, not the name, is of this format: by its mark, unless a reader knows more."""
        return source.head(16).startswith(self.marks)

    @abstractmethod
    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return the tables of the file.

        Raises `RigFileError` if it is damaged, or can be read in more than one way.
        """
