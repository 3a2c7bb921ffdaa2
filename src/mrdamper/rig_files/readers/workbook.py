"""Workbooks, by calamine: a sheet is read as the text it shows, so that header and units are found as in text."""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from mrdamper.errors import InputError
from mrdamper.rig_files.conditions import CHOICE, LONGEST_LINE, stated_quantities, stated_rate
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.archive import checked_zip, is_workbook, is_zip_of
from mrdamper.rig_files.readers.arrays import load, refusing_damage
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RawTable, Reader, Source, scratch
from mrdamper.rig_files.readers.delimited import DelimitedText

_COMPOUND = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"  # Excel up to 2003
_FEWEST = 2  # columns of a test: a displacement and a force
_DITTO = frozenset(('"', "''", "″", "〃", '-"-', "do.", "ditto", "dto.", "idem"))  # as the cell above
_Range = tuple[tuple[int, int], tuple[int, int]]  # row and column of the first and of the last cell
_LARGEST_WHOLE = 1e15  # below, every whole number is a double
_NOTES = 4096  # bytes of a sheet without a test in which conditions of the others may stand
_FLAT = str.maketrans({"\t": " ", "\n": " ", "\r": " ", '"': "''", "\0": " "})


class Workbook(Reader):
    """Workbooks of Excel, LibreOffice and others; cached values of formulas, nothing is computed."""

    name = "xlsx"
    title = "workbook"
    suffixes = (".xlsx", ".xlsm", ".xlsb", ".xls", ".ods")
    library = "python_calamine"
    seconds_per_byte = 5e-6  # a sheet is slow to read: some microseconds a cell of some bytes

    def recognises(self, source: Source) -> bool:
        """Recognise a zip with sheets, or a damaged zip or an old compound file of that name."""
        old = source.head(8) == _COMPOUND and source.suffix in self.suffixes
        return old or is_zip_of(source, is_workbook, self.suffixes)

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """One table a sheet that holds one."""
        if source.head(4).startswith(b"PK"):
            with checked_zip(source, self.title):
                pass
        with refusing_damage(source, self.title):
            sheets = _sheets(source, form)
        return tables_of_sheets(source, sheets, form)


def tables_of_sheets(source: Source, sheets: Sequence[tuple[str, Source]], form: FileForm) -> list[RawTable]:
    """Return the tables of sheets that were written as text, with the notes of sheets without a test."""
    form = form.model_copy(update={"separator": "\t", "encoding": "utf-8"})
    all_tables, lists, beside = list[RawTable](), list[RawTable](), list[str]()
    first: InputError | None = None
    for name, sheet in sheets:
        try:
            tables = DelimitedText().tables(sheet, form)
        except InputError as error:
            first = first or error
            tables = []
        titles = (name,) if len(tables) > 1 else ()  # of each of its tables
        tables = [replace(t, label=t.label or name, remarks=(*titles, *t.remarks)) for t in tables]
        tables = [replace(t, form={"sheet": name}) for t in tables if len(t.names) >= _FEWEST]
        named = {of.channel for table in tables for of in table.headers if not of.name[:1].isdigit()} - {None}
        lines = [line for table in tables for line in table.remarks]
        beside += [line for line in lines if CHOICE.search(line[:LONGEST_LINE])]
        listing = [] if {"displacement", "force"} <= named else lines  # of the tests of other sheets
        beside += [line for line in listing if stated_rate(stated_quantities([line]))]
        noted = sheet.size <= _NOTES and all(any(table.odd[:1]) for table in tables) and not named  # quantities
        beside += sheet.head(_NOTES).decode("utf-8", "replace").splitlines() if noted or not tables else ()
        (lists if noted else all_tables).extend(tables)
    all_tables = all_tables or lists
    if not all_tables:
        raise first or source.refuse("E_NO_DATA", "no sheet or table holds data", "export the file again")
    all_tables = [replace(table, remarks=(*table.remarks, *beside)) for table in all_tables]
    return all_tables if len(all_tables) > 1 else [replace(all_tables[0], label="")]


def _sheets(source: Source, form: FileForm) -> list[tuple[str, Source]]:
    source.file.seek(0)
    calamine = load("python_calamine", Workbook.title)
    book = calamine.load_workbook(source.file)
    names = [sheet.name for sheet in book.sheets_metadata if sheet.typ == calamine.SheetTypeEnum.WorkSheet]
    texts = []
    for name in chosen_sheets(source, names, form):
        sheet = book.get_sheet_by_name(name)
        start = sheet.start or (0, 0)
        rows = _filled_down(sheet.iter_rows(), start, sheet.merged_cell_ranges or ())
        text = replace(as_text(source, name, rows), before=start[1])
        if text.size:
            texts.append((name, text))
    if not texts:
        raise source.refuse("E_NO_DATA", "the sheets are empty", "export the file again")
    return texts


def chosen_sheets(source: Source, names: Sequence[str], form: FileForm) -> Sequence[str]:
    """Return the sheet that a profile names, else all; E_COLUMN if there is none of that name."""
    if form.sheet is not None and form.sheet not in names:
        problem = f"no sheet {form.sheet!r} (found {', '.join(names)})"
        raise source.refuse("E_COLUMN", problem, "correct [file] sheet of the profile")
    return names if form.sheet is None else [form.sheet]


def _filled_down(rows: Iterable[list], start: tuple[int, int], merged: Iterable[_Range]) -> Iterator[list]:
    """Yield rows in which a cell merged with that above, or with a ditto mark, holds what that above holds."""
    spans = [(left, range(top + 1, bottom + 1)) for (top, left), (bottom, right) in merged if left == right]
    below = {(row, left) for left, inside in spans for row in inside}
    numbers, above = {row for row, _ in below}, list[Any]()
    for number, row in enumerate(rows, start[0]):
        if number in numbers or not _DITTO.isdisjoint(row):
            for i, cell in enumerate(row[: len(above)]):
                if (number, start[1] + i) in below or (isinstance(cell, str) and cell in _DITTO):
                    row[i] = above[i]
        above = row
        yield row


def as_text(source: Source, title: str, rows: Iterable[list]) -> Source:
    """Return the cells of a sheet as a text with tabs between them."""
    ragged = scratch(source.keep)
    width, blank = 0, 0
    for number, row in enumerate(rows, 1):
        cells = [_shown(cell) for cell in row]
        while cells and not cells[-1]:
            cells.pop()
        if len(cells) > MOST_COLUMNS:
            raise source.refuse("E_TOO_MANY_COLUMNS", f"{len(cells)} columns", "export fewer", line=number)
        if not cells:
            blank += 1
            continue
        width = max(width, len(cells))
        ragged.write(b"\n" * blank)
        blank = 0
        ragged.write(("\t".join(cells) + "\n").encode("utf-8", "replace"))
    file = scratch(source.keep)
    ragged.seek(0)
    for line in ragged:  # trailing empty cells are not stored in a sheet: rows differ in width
        cells = line.count(b"\t") + 1 if line.strip() else width
        file.write(line[:-1] + b"\t" * (width - cells) + b"\n")
    return Source(source.path, f"{source.name}, sheet {title}", ".txt", file, file.tell(), source.keep)


def _shown(cell: object) -> str:
    if isinstance(cell, bool):
        return str(cell).upper()
    if isinstance(cell, float):
        whole = cell.is_integer() and abs(cell) < _LARGEST_WHOLE
        return str(int(cell)) if whole else repr(cell) if math.isfinite(cell) else "inf"
    if isinstance(cell, (datetime.datetime, datetime.time)):
        return cell.isoformat()
    if isinstance(cell, datetime.timedelta):
        return f"{cell.total_seconds()!r}"
    text = str(cell).translate(_FLAT).strip()
    return f"({text})" if text.startswith("#") and text != "#N/A" else text
