"""XML and HTML: trees of elements with samples in them, workbooks of Excel 2003, and tables of pages saved as .xls."""

from __future__ import annotations

import re
from collections.abc import Mapping
from html.parser import HTMLParser
from typing import Any
from xml.etree import ElementTree

import numpy as np

from mrdamper.rig_files.column_names import KEYS, is_unit
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import refusing_damage, whole
from mrdamper.rig_files.readers.base import MOST_COLUMNS, NoTableError, RawTable, Reader, RigFileError, Source
from mrdamper.rig_files.readers.nested import document_tables
from mrdamper.rig_files.readers.several_tests import FEWEST_SAMPLES
from mrdamper.rig_files.readers.workbook import as_text, tables_of_sheets

_BEGINS = re.compile(rb"\s*<[?!A-Za-z]")
_PAGE = re.compile(rb"\s*(?:<!--.*?-->\s*)?<(?:!doctype\s+html|html|head|body|table|meta)\b", re.IGNORECASE | re.DOTALL)
_SHEETS = "{urn:schemas-microsoft-com:office:spreadsheet}"
_BETWEEN = re.compile(r"[\s;,]+")
_APART = re.compile(r"[\s;]+(?:,[\s;]*)?|,[\s;]+")  # between numbers with decimal commas
_DECIMAL = re.compile(r"[+-]?(?:0|[1-9][0-9]*)(?:,[0-9]+)?(?:[eE][+-]?[0-9]+)?")
_PADDED = re.compile(r"0[0-9]+(?:[eE].*)?")  # digits behind a decimal comma, no number of their own
_MOST_LEVELS = 100
Sheets = list[tuple[str, list[list[str]]]]  # rows of cells by the name of the sheet


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


class Elements:
    """A target of the parser that keeps the value of every element, and the cells of workbooks of Excel 2003."""

    def __init__(self) -> None:
        self.root: dict[str, Any] = {}
        self.sheets: Sheets = []
        self._levels: list[tuple[dict[str, Any], dict[str, list[Any]], list[str]]] = [({}, {}, [])]

    def read(self, content: bytes | str) -> None:
        """Read a text; raises `RigFileError` if it may be hostile, `SyntaxError` if it is no XML."""
        parser = ElementTree.XMLParser(target=self)
        parser.feed(content)
        parser.close()

    def doctype(self, name: str, public: str | None, system: str | None) -> None:
        """Refuse a document type: it defines entities."""
        raise RigFileError("E_UNSAFE", f"XML with a document type ({name})", remedy="export it without one")

    def start(self, tag: str, attributes: Mapping[str, str]) -> None:
        """Begin an element, or a sheet or row of a workbook."""
        if len(self._levels) > _MOST_LEVELS:
            raise RigFileError("E_FORMAT", "XML nested too deeply", remedy="export it as CSV")
        own = {_local(key): numbers_in(text) for key, text in attributes.items()}
        self._levels.append((own, {}, []))
        if tag == f"{_SHEETS}Worksheet":
            self.sheets.append((str(own.get("Name", "")), []))
        elif tag == f"{_SHEETS}Row" and self.sheets:
            rows = self.sheets[-1][1]
            rows += [[] for _ in range(min(_place(own) - len(rows), MOST_COLUMNS))] or [[]]

    def data(self, text: str) -> None:
        """Add to the text of the element."""
        self._levels[-1][2].append(text)

    def end(self, tag: str) -> None:
        """Hand the value of the element to the one around it."""
        own, within, texts = self._levels.pop()
        if self.sheets and tag.startswith(_SHEETS):
            rows = self.sheets[-1][1]
            if tag == f"{_SHEETS}Cell" and rows:
                rows[-1] += [""] * min(_place(own) - len(rows[-1]) - 1, MOST_COLUMNS)
                rows[-1].append(str(within.get("Data", [""])[0]))
            elif tag == f"{_SHEETS}Data":
                self._levels[-1][1]["Data"] = ["".join(texts).strip()]
            return
        value = numbers_in("".join(texts).strip())
        inner = {name: _together(values) for name, values in within.items()}
        name = _local(tag)
        units = [u for key, u in own.items() if key.casefold() in KEYS["unit"] and isinstance(u, str) and is_unit(u)]
        if isinstance(value, float) and len(units) == len(own) == 1 and not inner:
            name = f"{name} [{units[0]}]"
        elif own or inner:
            text = {"data" if isinstance(value, np.ndarray) else "value": value}
            value = {**own, **inner, **({} if isinstance(value, str) and not value else text)}
        self._levels[-1][1].setdefault(name, []).append(value)

    def close(self) -> None:
        """Take what the outermost element holds."""
        self.root = {name: _together(values) for name, values in self._levels[0][1].items()}
        self.root = next((value for value in self.root.values() if isinstance(value, dict)), self.root)


def _place(attributes: Mapping[str, Any]) -> int:
    """Return the number of a row or cell, where the workbook states it because others before it are empty."""
    stated = attributes.get("Index", 0)
    return int(stated) if isinstance(stated, float) else 0


def _local(name: str) -> str:
    return name.rpartition("}")[2]


def _number(text: str) -> float | None:
    try:
        return None if "_" in text else float(text)  # 0_5 is a code
    except ValueError:
        return None


def numbers_in(text: str) -> Any:
    """Return a text as the number or numbers that it lists, or as it is; 1,5 2,5 may be two numbers or four."""
    number = _number(text)
    if number is not None:
        return number
    if not text[:1].isdigit() and text[:1] not in ("+", "-", "."):
        return text
    parts, apart = _BETWEEN.split(text), _APART.split(text)
    if 1 < len(apart) < len(parts) and all(map(_DECIMAL.fullmatch, apart)):
        parts = [part.replace(",", ".") for part in apart] if any(map(_PADDED.fullmatch, parts)) else [text]
    listed = [_number(part) for part in parts]
    return np.array(listed) if len(listed) >= FEWEST_SAMPLES and None not in listed else text


def _together(values: list[Any]) -> Any:
    """Return the values of elements of one name: an array of numbers, rows of numbers as a matrix, else a list."""
    if len(values) == 1:
        return values[0]
    if all(isinstance(value, float) for value in values):
        return np.array(values)
    rows = [next(iter(value.values())) if isinstance(value, dict) and len(value) == 1 else value for value in values]
    same = len({row.shape if isinstance(row, np.ndarray) else None for row in rows}) == 1
    return np.array(rows) if same and isinstance(rows[0], np.ndarray) else values
