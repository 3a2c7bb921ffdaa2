"""Documents: workbooks and pages, whose sheets are read as the text they show, XML and JSON, as nested structures."""

from __future__ import annotations

import datetime
import json
import math
import re
import zipfile
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any

import numpy as np

from mrdamper.errors import InputError
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.archive import UNREADABLE_ZIP, check_sizes, is_workbook, zipped_names
from mrdamper.rig_files.readers.arrays import damaged, load, refuse_twice, refusing_damage, whole
from mrdamper.rig_files.readers.base import MOST_COLUMNS, NoTableError, RawTable, Reader, RigFileError, Source, scratch
from mrdamper.rig_files.readers.delimited import DelimitedText
from mrdamper.rig_files.readers.nested import document_tables
from mrdamper.rig_files.text.elements import Elements, Sheets, numbers_in
from mrdamper.rig_files.text.tokens import stamp

_COMPOUND = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"  # Excel up to 2003
_FEWEST = 2  # columns of a test: a displacement and a force
_NOTES = 4096  # bytes of a sheet without a test in which conditions of the others may stand
_FLAT = str.maketrans({"\t": " ", "\n": " ", "\r": " ", '"': "''", "\0": " "})
_BEGINS = re.compile(rb"\s*<[?!A-Za-z]")
_PAGE = re.compile(rb"\s*(?:<!--.*?-->\s*)?<(?:!doctype\s+html|html|head|body|table|meta)\b", re.IGNORECASE | re.DOTALL)
_SAVED_MODEL = "mrdamper-model"
_FEWEST_ROWS = 8  # samples of a test


class Workbook(Reader):
    """Workbooks of Excel, LibreOffice and others; cached values of formulas, nothing is computed."""

    name = "xlsx"
    title = "workbook"
    suffixes = (".xlsx", ".xlsm", ".xlsb", ".xls", ".ods")
    library = "python_calamine"
    seconds_per_byte = 5e-6  # a sheet is slow to read: some microseconds a cell of some bytes

    def recognises(self, source: Source) -> bool:
        """Recognise a zip with sheets, or a damaged zip or an old compound file of that name."""
        if not source.head(4).startswith(b"PK"):
            return source.head(8) == _COMPOUND and source.suffix in self.suffixes
        names = zipped_names(source)
        return source.suffix in self.suffixes if names is None else is_workbook(names)

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """One table a sheet that holds one."""
        if source.head(4).startswith(b"PK"):
            try:
                with zipfile.ZipFile(source.file) as archive:
                    members = archive.infolist()
            except UNREADABLE_ZIP as error:
                raise damaged(source, self.title, "end of file not found") from error
            check_sizes(source, members)
        with refusing_damage(source, self.title):
            sheets = _sheets(source, form)
        return tables_of_sheets(source, sheets, form)


def tables_of_sheets(source: Source, sheets: Sequence[tuple[str, Source]], form: FileForm) -> list[RawTable]:
    """Return the tables of sheets that were written as text, with the notes of sheets without a test."""
    form = form.model_copy(update={"separator": "\t", "encoding": "utf-8"})
    all_tables: list[RawTable] = []
    lists: list[RawTable] = []
    beside: list[str] = []
    first: InputError | None = None
    for name, sheet in sheets:
        try:
            tables = DelimitedText().tables(sheet, form)
        except InputError as error:
            first = first or error
            tables = []
        tables = [replace(t, label=t.label or name, form={"sheet": name}) for t in tables if len(t.names) >= _FEWEST]
        named = [header.channel for table in tables for header in table.headers]
        noted = sheet.size <= _NOTES and all(any(table.odd[:1]) for table in tables) and not any(named)  # quantities
        beside += sheet.head(_NOTES).decode("utf-8", "replace").splitlines() if noted or not tables else ()
        (lists if noted else all_tables).extend(tables)
    all_tables = all_tables or lists
    if not all_tables:
        raise first or source.refuse("E_NO_DATA", "no sheet holds data", "export the file again")
    all_tables = [replace(table, remarks=(*table.remarks, *beside)) for table in all_tables]
    return all_tables if len(all_tables) > 1 else [replace(all_tables[0], label="")]


def _sheets(source: Source, form: FileForm) -> list[tuple[str, Source]]:
    source.file.seek(0)
    calamine = load("python_calamine", Workbook.title)
    book = calamine.load_workbook(source.file)
    names = [sheet.name for sheet in book.sheets_metadata if sheet.typ == calamine.SheetTypeEnum.WorkSheet]
    if form.sheet is not None and form.sheet not in names:
        raise source.refuse(
            "E_COLUMN", f"no sheet {form.sheet!r} (found {', '.join(names)})", "correct [file] sheet of the profile"
        )
    texts = []
    for name in names if form.sheet is None else [form.sheet]:
        text = as_text(source, name, book.get_sheet_by_name(name).iter_rows())
        if text.size:
            texts.append((name, text))
    if not texts:
        raise source.refuse("E_NO_DATA", "the sheets are empty", "export the file again")
    return texts


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
        return repr(cell) if math.isfinite(cell) else "inf"
    if isinstance(cell, (datetime.datetime, datetime.time)):
        return cell.isoformat()
    if isinstance(cell, datetime.timedelta):
        return f"{cell.total_seconds()!r}"
    text = str(cell).translate(_FLAT).strip()
    return f"({text})" if text.startswith("#") and text != "#N/A" else text


class Markup(Reader):
    """Elements that hold lists of numbers, or one sample each, as testing machines and databases write them."""

    name = "xml"
    title = "XML"
    suffixes = (".xml", ".xls")
    library = "xml.etree.ElementTree"

    def recognises(self, source: Source) -> bool:
        """By the first sign of its text, which may be UTF-16."""
        return _BEGINS.match(_plain(source.head(512))) is not None

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """One table an element that holds samples, or one a sheet or table of cells."""
        content = whole(source, self.title)
        if _PAGE.match(_plain(content[:4096])):
            page = _Page()
            page.feed(content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8", "replace"))
            return _of_cells(source, page.sheets, form)
        elements = Elements()
        try:
            with refusing_damage(source, self.title):
                elements.read(content)
        except RigFileError as error:
            raise error if error.file else source.refuse(error.code, error.found, error.remedy) from None
        if elements.sheets:
            return _of_cells(source, elements.sheets, form)
        return document_tables(source, elements.root, self.title)


def _plain(head: bytes) -> bytes:
    return head.replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe")


def _of_cells(source: Source, sheets: Sheets, form: FileForm) -> list[RawTable]:
    texts = [(name, as_text(source, name, rows)) for name, rows in sheets if any(map(any, rows))]
    if not texts:
        raise NoTableError(
            "E_FORMAT", "a page or workbook without a table", file=source.name, remedy="export it as CSV"
        )
    return tables_of_sheets(source, texts, form)


class _Page(HTMLParser):
    """The cells of the tables of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.sheets: Sheets = []
        self._open = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin a table, a row or a cell; a cell over several columns leaves the others empty."""
        if tag == "table":
            self.sheets.append((f"table {len(self.sheets) + 1}", [[]]))
        elif tag == "tr" and self.sheets:
            self.sheets[-1][1].append([])
        elif tag in ("td", "th") and self.sheets:
            row, across = self.sheets[-1][1][-1], numbers_in(dict(attrs).get("colspan") or "")
            self._at = len(row)
            row += [""] * (int(np.clip(across, 1, MOST_COLUMNS)) if isinstance(across, float) else 1)
        self._open = tag in ("td", "th") or (self._open and tag not in ("table", "tr"))

    def handle_data(self, data: str) -> None:
        """Add to the text of the cell."""
        if self._open and self.sheets:
            row = self.sheets[-1][1][-1]
            row[self._at] = " ".join([*row[self._at].split(), *data.split()])

    def handle_endtag(self, tag: str) -> None:
        """End a cell, and what stands around it."""
        self._open &= tag not in ("td", "th", "tr", "table")


class Json(Reader):
    """Objects of lists, lists of records, and these within each other; one record a line, too."""

    name = "json"
    title = "JSON"
    suffixes = (".json", ".jsonl", ".ndjson")
    library = "json"

    def recognises(self, source: Source) -> bool:
        """By the first signs; a list may begin a text of another kind, so that its second sign counts, too."""
        start = source.head(512).lstrip(b"\xef\xbb\xbf \t\r\n")
        return start[:1] == b"{" or (start[:1] == b"[" and start[1:].lstrip()[:1] in (b"{", b"[", b'"'))

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """One table a node that holds lists of numbers."""
        tree = _of_figure(_tree(_parsed(source, whole(source, self.title))))
        if isinstance(tree, Mapping) and _SAVED_MODEL in map(str, tree.values()):
            remedy = "give it to mrdamper predict, validate or export; tests are what import reads"
            raise NoTableError("E_FORMAT", "a saved model", file=source.name, remedy=remedy)
        return document_tables(source, tree if isinstance(tree, Mapping) else {"": tree}, self.title)


def _parsed(source: Source, content: bytes) -> Any:
    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        members = dict(pairs)
        if len(members) < len(pairs):
            refuse_twice(source, [name for name, _ in pairs])
        return members

    text = ""
    try:
        text = content.decode("utf-8-sig")
        try:
            return json.loads(text, object_pairs_hook=unique)
        except json.JSONDecodeError as error:
            if not error.msg.startswith("Extra data"):
                raise
            return _with_notes(
                [json.loads(line, object_pairs_hook=unique) for line in text.splitlines() if line.strip()]
            )
    except json.JSONDecodeError as error:
        early = error.pos >= len(text.rstrip()) - 1
        raise damaged(source, Json.title, "truncated" if early else f"{error.msg}, line {error.lineno}") from error
    except UnicodeDecodeError as error:
        raise source.refuse("E_ENCODING", "bytes that are no UTF-8", "save it as UTF-8") from error
    except (RecursionError, ValueError) as error:  # or a whole number of thousands of digits
        raise source.refuse(
            "E_FORMAT", "nested too deeply, or a number without end", "export the samples as lists"
        ) from error


def _of_figure(tree: Any) -> Any:
    """Return the curves of a figure of Plotly by their names, each called by the title of its axis; else the tree."""
    traces, layout = (tree.get("data"), tree.get("layout")) if isinstance(tree, Mapping) else (None, None)
    listed = isinstance(traces, list) and all(isinstance(trace, Mapping) for trace in traces)
    if not listed or not traces or not isinstance(layout, Mapping):
        return tree
    curves: dict[str, dict[str, Any]] = {}
    for trace in traces:
        for axis in "xy":
            own = layout.get(str(trace.get(f"{axis}axis", axis)).replace(axis, f"{axis}axis", 1))
            title = own.get("title", "") if isinstance(own, Mapping) else ""
            title = title.get("text", "") if isinstance(title, Mapping) else title
            curve, values = curves.setdefault(str(trace.get("name", "")), {}), trace.get(axis)
            if not title or not isinstance(values, np.ndarray) or not np.array_equal(curve.get(title, values), values):
                return tree  # no figure, or two curves of one name
            curve[title] = values
    return curves


def _with_notes(lines: list[Any]) -> Any:
    """Return the records of a text with one a line, under what its other lines state: of start and end, of an event.

    Between or below the records words count only: a current that stands there is not that of all records.
    """
    forms = Counter(frozenset(line) for line in lines if isinstance(line, dict))
    keys, count = forms.most_common(1)[0] if forms else (frozenset(), 0)
    others = [line for line in lines if not isinstance(line, dict) or line.keys() != keys]
    if not 0 < len(others) < count >= _FEWEST_ROWS or any(not isinstance(o, dict) or o.keys() & keys for o in others):
        return lines
    stated = {key: [other[key] for other in others if key in other] for other in others for key in other}
    records = [line for line in lines if line.keys() == keys]
    above = {key for other in lines[: lines.index(records[0])] for key in other}
    same = {key: values[0] for key, values in stated.items() if values.count(values[0]) == len(values)}
    words = {key for key, value in same.items() if isinstance(value, str) and not any(map(str.isdigit, value))}
    notes = {key: same[key] for key in same if key in above | words}
    return {**notes, **{key: [record[key] for record in records] for key in records[0]}}


def _tree(value: Any) -> Any:
    """Return the document with arrays for its lists of numbers; mappings from row numbers are lists."""
    if isinstance(value, dict):
        if len(value) >= _FEWEST_ROWS and all(key.isdigit() for key in value):
            return _tree(list(value.values()))
        return {key: _tree(item) for key, item in value.items()}
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, (int, float)):
        return float(value) if abs(value) < 1e308 else float("inf")
    if not isinstance(value, list):
        return "" if value is None else value
    if len(value) > 1 and all(isinstance(item, str) for item in value):
        stamps = [stamp(item) for item in value] if stamp(value[0]) is not None else [None]
        stamped = [entry[0] for entry in stamps if entry is not None]
        return (np.array(stamped) - stamped[0]) / 1e9 if len(stamped) == len(value) else value
    if value and all(item is None or isinstance(item, (int, float)) for item in value):
        return np.array([np.nan if item is None else item for item in value], dtype=float)
    rows = value and all(isinstance(item, list) and len(item) == len(value[0]) for item in value)
    if rows and all(isinstance(cell, (int, float)) or cell is None for row in value for cell in row):
        return np.array([[np.nan if cell is None else cell for cell in row] for row in value], dtype=float)
    items = [item for item in value if item is not None]
    records = len(items) >= _FEWEST_ROWS and all(isinstance(item, dict) for item in items)
    if records and all(v is None or isinstance(v, (int, float, str)) for item in items for v in item.values()):
        return items
    return [_tree(item) for item in items]
