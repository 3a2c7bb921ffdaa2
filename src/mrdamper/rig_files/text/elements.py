"""XML as nested structures: the value of every element, and the cells of workbooks of Excel 2003."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree

import numpy as np

from mrdamper.rig_files.column_names import KEYS, is_unit
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RigFileError
from mrdamper.rig_files.readers.several_tests import FEWEST_SAMPLES

_SHEETS = "{urn:schemas-microsoft-com:office:spreadsheet}"
_BETWEEN = re.compile(r"[\s;,]+")
_APART = re.compile(r"[\s;]+(?:,[\s;]*)?|,[\s;]+")  # between numbers with decimal commas
_DECIMAL = re.compile(r"[+-]?(?:0|[1-9][0-9]*)(?:,[0-9]+)?(?:[eE][+-]?[0-9]+)?")
_PADDED = re.compile(r"0[0-9]+(?:[eE].*)?")  # digits behind a decimal comma, no number of their own
_MOST_LEVELS = 100
Sheets = list[tuple[str, list[list[str]]]]  # rows of cells by the name of the sheet


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
