"""XML and HTML: elements with samples in them, workbooks of Excel 2003, and tables of pages saved as .xls."""

from __future__ import annotations

import re
from html.parser import HTMLParser

import numpy as np

from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import refusing_damage, whole
from mrdamper.rig_files.readers.base import MOST_COLUMNS, NoTableError, RawTable, Reader, Source
from mrdamper.rig_files.readers.nested import nested_tables
from mrdamper.rig_files.readers.workbook import as_text, tables_of_sheets
from mrdamper.rig_files.text.elements import Sheets, numbers_in, root_of, sheets_of, tree_of

_BEGINS = re.compile(rb"\s*<[?!A-Za-z]")
_PAGE = re.compile(rb"\s*(?:<!--.*?-->\s*)?<(?:!doctype\s+html|html|head|body|table|meta)\b", re.IGNORECASE | re.DOTALL)


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
        with refusing_damage(source, self.title):
            root = root_of(content)
            sheets, tree = sheets_of(root), tree_of(root)
        if sheets:
            return _of_cells(source, sheets, form)
        return nested_tables(source, tree, self.title, may_be_notes=True)


def _plain(head: bytes) -> bytes:
    return head.replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe")


def _of_cells(source: Source, sheets: Sheets, form: FileForm) -> list[RawTable]:
    texts = [(name, as_text(source, name, rows)) for name, rows in sheets if any(map(any, rows))]
    if not texts:
        problem = "a page or workbook without a table"
        raise NoTableError("E_FORMAT", problem, file=source.name, remedy="export it as CSV")
    return tables_of_sheets(source, texts, form)


class _Page(HTMLParser):
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
