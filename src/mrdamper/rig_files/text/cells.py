"""Rows of text to numbers: cell by cell, the reference, and blocks of plain rows at the speed of the disk; as columns
that grow, in memory while small, in unnamed temporary files once they are large.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import CombinedError
from mrdamper.rig_files.column_names import parse_unit
from mrdamper.rig_files.readers.base import RigFileError, scratch
from mrdamper.rig_files.text.layout import Layout, is_footer
from mrdamper.rig_files.text.row_samples import QUANTITY, SPACES, is_comment, split, split_strictly
from mrdamper.rig_files.text.stream import LONGEST_LINE, TextStream, too_long
from mrdamper.rig_files.text.tokens import MISSING, NUMBER, THOUSANDS, looks_numeric, number, stamp

_MOST_SHOWN = 10  # wrong cells and rows of a file
_MOST_STRAY = 0.05  # above this share, reading the whole block cell by cell is no slower
_ALLOWED = bytes(range(256))
_COMMA_MARK = _ALLOWED.replace(b",", b"\0").replace(b".", b"\x01").replace(b"\0", b".")
LARGE = 16 * 2**20  # bytes
LINES = -1  # stands for a column of the numbers of lines


@dataclass(eq=False, slots=True)
class RowFormat:
    """Settings to read rows: the text, its layout, the columns wanted; and the errors so far."""

    stream: TextStream
    layout: Layout
    wanted: tuple[int, ...]
    first: tuple[int, bool] | None = None  # time stamp, from which the others count
    wrong: dict[tuple[int | None, int | None], RigFileError] = field(default_factory=dict)
    more: int = 0  # beyond those that are shown
    messages: dict[int, str] = field(default_factory=dict)  # lines of words among the rows, left out

    def note(self, error: RigFileError) -> None:
        """Keep a refusal, so that all of a file are told at once."""
        if len(self.wrong) < _MOST_SHOWN:
            self.wrong.setdefault((error.line, error.column), error)
        else:
            self.more += 1

    def refuse_wrong(self) -> None:
        """Raise what was kept."""
        errors = [self.wrong[place] for place in sorted(self.wrong, key=lambda place: (place[0] or 0, place[1] or 0))]
        if self.more:
            errors.append(self.stream.source.refuse(errors[-1].code, f"{self.more} more like these", errors[-1].remedy))
        CombinedError.raise_from(errors)


def read_cells(block: bytes, line: int, form: RowFormat, *, final: bool = False) -> dict[int, Floats]:
    """Read the columns of a block of whole lines, which starts at a line and may be the text's final one.

    Raises at E_LINE_TOO_LONG, E_QUOTE and E_AMBIGUOUS; wrong cells and rows are kept by the form.
    """
    raw = block.split(b"\n")
    if max(map(len, raw)) > LONGEST_LINE:
        raise too_long(form.stream.source, line + next(i for i, r in enumerate(raw) if len(r) > LONGEST_LINE))
    rows, lines = split_rows(form.stream.decode(block).split("\n"), line, form, final)
    values = {LINES: np.array(lines, dtype=float)}
    for column in form.wanted:
        cells = [row[column] for row in rows]
        read = _stamps if form.layout.kinds[column] == "stamp" else _numbers
        values[column] = read(cells, column, lines, form)
    return values


def field_count(form: RowFormat, fields: int, line: int, final: bool, text: str = "") -> RigFileError:
    """Return the refusal of a row with another number of cells than the others."""
    width = form.layout.width
    if final and fields < width:
        problem = f"the file ends inside a row: {fields} of {width} fields"
        remedy = "copy or export the file again, or remove the last line"
        return form.stream.source.refuse("E_TRUNCATED", problem, remedy, line=line)
    problem, remedy = f"{fields} fields where the other rows have {width}", "correct or remove this line"
    problem += f": {text.strip()[:40]!r}" if text else ""
    if fields > width and form.layout.separator == ",":
        remedy = "correct this line; numbers with decimal commas need semicolons between the fields"
    return form.stream.source.refuse("E_FIELD_COUNT", problem, remedy, line=line)


def split_rows(texts: Sequence[str], line: int, form: RowFormat, final: bool) -> tuple[list[list[str]], list[int]]:
    """Return the cells of every row among lines of text, and the lines they stand in.

    Raises at E_QUOTE; rows of another width are left out and kept by the form, as are messages.
    """
    separator, width = form.layout.separator, form.layout.width + form.layout.trailing
    rows, lines, wrong = list[list[str]](), list[int](), list[tuple[int, int, str]]()
    last = 0
    for at, text in enumerate(texts, line):
        stripped = text.strip(" \t\r")
        if not stripped or is_comment(stripped):
            continue
        last = at
        cells = split_strictly(text.rstrip("\r"), separator, form.stream.source, at)
        if len(cells) != width and (len(cells) != form.layout.width):
            wrong.append((at, len(cells), text))
        elif any(cells):
            rows.append(cells)
            lines.append(at)
    # Where rows name their values (`added`), a line that is no such row is a damaged one.
    goes_on = bool(wrong) and not form.stream.source.added and _goes_on([row[0] for row in rows], form)
    for at, count, text in wrong:
        words = goes_on and count < width and is_footer(text, form.layout)
        if words and not any(map(looks_numeric, split(text, separator))):
            form.messages[at] = text.strip()
        else:
            form.note(field_count(form, count, at, final and at == last, text))
    return rows, lines


def _goes_on(cells: Sequence[str], form: RowFormat) -> bool:
    """Tell if the cells of a column always increase, as those of a clock do: no row is missing where a line is none."""
    is_stamp, mark = form.layout.kinds[0] == "stamp", form.layout.decimal
    values = [(stamp(cell) or (math.nan,))[0] if is_stamp else number(cell, mark) for cell in cells]
    return len(values) > 1 and all(a is not None and b is not None and a < b for a, b in pairwise(values))


def _numbers(cells: Sequence[str], column: int, lines: Sequence[int], form: RowFormat) -> Floats:
    mark = form.layout.decimal
    matches, comma = NUMBER[mark].fullmatch, mark == ","
    for sign, meant in form.layout.writes:
        cells = [cell.replace(sign, meant) for cell in cells]
    factors: dict[int, float] = {}
    if form.layout.behind[column]:
        cells, factors = _without_unit(cells, form.layout.behind[column])
    values = np.empty(len(cells))
    for i, cell in enumerate(cells):
        value = float(cell.replace(",", ".") if comma else cell) if matches(cell) else number(cell, mark)
        if value is None and form.layout.groups and THOUSANDS.fullmatch(cell):
            value = float(re.sub("[.,]", "", cell))
        if value is None:
            form.note(_no_number(cell, column, lines[i], form))
        elif math.isinf(value):
            problem = f"{_shown(cell)} in {_named(form, column)} is beyond every number"
            remedy = "export the channel again: an amplifier in overload is no measurement"
            form.note(form.stream.source.refuse("E_NONFINITE", problem, remedy, line=lines[i], column=column + 1))
        values[i] = math.nan if value is None else value * factors.get(i, 1.0)
    return values


def _without_unit(cells: Sequence[str], unit: str) -> tuple[list[str], dict[int, float]]:
    """Return cells without the units behind their numbers, and the factors of those in another one: 1.2 kN, 850 N."""
    bare, factors, usual = list(cells), {}, parse_unit(unit)
    for i, cell in enumerate(cells):
        match = QUANTITY.fullmatch(cell)
        own = parse_unit(match[2]) if match else None
        if match and own and usual and (own.dimension, own.offset) == (usual.dimension, usual.offset):
            bare[i], factors[i] = match[1], 1.0 if own == usual else own.factor / usual.factor
    return bare, factors


def _stamps(cells: Sequence[str], column: int, lines: Sequence[int], form: RowFormat) -> Floats:
    values = np.full(len(cells), math.nan)
    for i, cell in enumerate(cells):
        read = stamp(cell)
        if read is None:
            if cell.lower() not in MISSING:
                form.note(_no_number(cell, column, lines[i], form))
            continue
        form.first = form.first or read
        if read[1] != form.first[1]:
            problem = "time stamps with and without a time zone"
            remedy = "export all stamps with their offset, or none"
            raise form.stream.source.refuse("E_AMBIGUOUS", problem, remedy, line=lines[i], column=column + 1)
        values[i] = (read[0] - form.first[0]) / 1e9
    return values


def _no_number(cell: str, column: int, line: int, form: RowFormat) -> RigFileError:
    strange = any("\udc80" <= c <= "\udcff" or c == "\ufffd" for c in cell)
    strange |= not cell.isascii() and form.stream.encoding != "utf-8"
    code, problem = "E_ENCODING" if strange else "E_NUMBER", f"{_shown(cell)} in {_named(form, column)} is no number"
    mark = "comma" if form.layout.decimal == "," else "point"
    remedy = f"write digits with a decimal {mark}, without separators of thousands"
    return form.stream.source.refuse(code, problem, remedy, line=line, column=column + 1)


def _shown(cell: str) -> str:
    return ascii(cell[:40]) + ("..." if len(cell) > 40 else "")


def _named(form: RowFormat, column: int) -> str:
    return f"column {form.layout.names[column][:40]!r}" if form.layout.names[column] else f"column {column + 1}"


def read_bulk(block: bytes, line: int, form: RowFormat) -> dict[int, Floats] | None:
    """Read the columns of a block of whole lines; None if it is not plain enough."""
    layout = form.layout
    slow = any(layout.kinds[c] == "stamp" or layout.behind[c] for c in form.wanted)
    if slow or layout.separator == SPACES or b'"' in block:
        return None
    ends = _even_lines(block, ord(layout.separator), layout.width - 1 + layout.trailing)
    if ends is None:
        return None
    values = _columns(_cleaned(block, form), form)
    stray = np.flatnonzero(~np.logical_and.reduce([np.isfinite(v) for v in values]))
    if stray.size > _MOST_STRAY * ends.size:
        return None
    for row in stray:
        start = int(ends[row - 1]) + 1 if row else 0
        cells = read_cells(block[start : int(ends[row])], line + int(row), form)
        if not cells[LINES].size:
            return None
        for value, column in zip(values, form.wanted, strict=True):
            value[row] = cells[column][0]
    return {LINES: np.arange(line, line + ends.size, dtype=float), **dict(zip(form.wanted, values, strict=True))}


def _even_lines(block: bytes, separator: int, count: int) -> np.ndarray | None:
    """Places of the line feeds, if every line holds `count` separators and is short enough."""
    data = np.frombuffer(block, dtype=np.uint8)
    ends = np.flatnonzero(data == 10)
    if count < 1 or not ends.size or ends[-1] != data.size - 1:
        return None
    starts = np.concatenate(([0], ends[:-1] + 1))
    if int(np.max(ends - starts)) > LONGEST_LINE:
        return None
    places = np.flatnonzero(data == separator)
    if places.size != count * ends.size:
        return None
    places = places.reshape(ends.size, count)
    even = np.all(places[:, 0] >= starts) and np.all(places[:, -1] < ends)
    return ends if even else None


def _cleaned(block: bytes, form: RowFormat) -> bytes:
    """Return the block in UTF-8, with decimal points and plain line feeds."""
    if not block.isascii():
        block = block.decode(form.stream.encoding, "replace").encode("utf-8")
    if form.layout.decimal == ",":
        block = block.translate(_COMMA_MARK)
    for sign, meant in form.layout.writes:
        block = block.replace(sign.encode(), meant.encode())
    return block.replace(b"\r\n", b"\n") if b"\r" in block else block


def _columns(block: bytes, form: RowFormat) -> list[np.ndarray]:
    """Return the wanted columns; NaN where polars finds no number, which is at least where we find none."""
    import polars as pl

    width = form.layout.width + form.layout.trailing
    table = pl.read_csv(
        block,
        has_header=False,
        separator=form.layout.separator,
        quote_char=None,
        schema={f"c{i}": pl.Float64 if i in form.wanted else pl.String for i in range(width)},
        columns=list(form.wanted),
        ignore_errors=True,
    )
    return [table[f"c{i}"].to_numpy(writable=True) for i in form.wanted]


class Spool:
    """Columns of numbers written piece by piece and given back as arrays."""

    def __init__(self, columns: Sequence[int], keep: ExitStack):
        self._files = {column: scratch(keep, LARGE // len(columns)) for column in columns}

    def add(self, values: dict[int, Floats]) -> None:
        """Append one piece of every column."""
        for column, file in self._files.items():
            file.write(np.ascontiguousarray(values[column]).data)

    def arrays(self) -> dict[int, Floats]:
        """Every column, whole; memory-mapped where it is large."""
        arrays: dict[int, Floats] = {}
        for column, file in self._files.items():
            large = file.tell() > LARGE // len(self._files)
            file.seek(0)
            arrays[column] = np.memmap(file, np.float64, "r+") if large else np.frombuffer(bytearray(file.read()))
            file.close()  # a mapping holds it
        return arrays
