"""XML as nested structures: the value of every element, and the cells of workbooks of Excel 2003."""

from __future__ import annotations

import re
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


class _Builder(ElementTree.TreeBuilder):
    """Builder of elements without a document type, which defines entities."""

    def doctype(self, name: str, public: str | None, system: str | None) -> None:
        """Refuse a document type."""
        raise RigFileError("E_UNSAFE", f"XML with a document type ({name})", remedy="export it without one")


def root_of(content: bytes | str) -> ElementTree.Element:
    """Return the outermost element; raises `RigFileError` if it may be hostile, `SyntaxError` if it is no XML."""
    parser = ElementTree.XMLParser(target=_Builder())
    parser.feed(content)
    return parser.close()


def tree_of(root: ElementTree.Element) -> dict[str, Any]:
    """Return the values of the outermost element by name."""
    name, value = _value(root)
    return value if isinstance(value, dict) else {name: value}


def _value(element: ElementTree.Element, depth: int = 0) -> tuple[str, Any]:
    """Return the name and the value of an element: what it lists, or its attributes and the elements within it."""
    if depth > _MOST_LEVELS:
        raise RigFileError("E_FORMAT", "XML nested too deeply", remedy="export it as CSV")
    own = {_local(key): numbers_in(text) for key, text in element.attrib.items()}
    within: dict[str, list[Any]] = {}
    for name, value in (_value(child, depth + 1) for child in element):
        within.setdefault(name, []).append(value)
    inner = {name: _together(values) for name, values in within.items()}
    name, texts = _local(element.tag), (element.text, *(child.tail for child in element))
    value = numbers_in("".join(filter(None, texts)).strip())
    units = [u for key, u in own.items() if key.casefold() in KEYS["unit"] and isinstance(u, str) and is_unit(u)]
    if isinstance(value, float) and len(units) == len(own) == 1 and not inner:
        name = f"{name} [{units[0]}]"
    elif own or inner:
        text = {"data" if isinstance(value, np.ndarray) else "value": value}
        value = {**own, **inner, **({} if isinstance(value, str) and not value else text)}
    return name, value


def sheets_of(root: ElementTree.Element) -> Sheets:
    """Return the cells of a workbook of Excel 2003; the place of some is stated because others before are empty."""
    sheets: Sheets = []
    for sheet in root.iter(f"{_SHEETS}Worksheet"):
        rows: list[list[str]] = []
        for row in sheet.iter(f"{_SHEETS}Row"):
            rows += [[] for _ in range(_omitted(row, rows))]
            cells: list[str] = []
            for cell in row.iter(f"{_SHEETS}Cell"):
                data = cell.find(f"{_SHEETS}Data")
                cells += [""] * _omitted(cell, cells)
                cells.append("" if data is None else "".join(data.itertext()).strip())
            rows.append(cells)
        sheets.append((sheet.get(f"{_SHEETS}Name", ""), rows))
    return sheets


def _omitted(element: ElementTree.Element, before: list[Any]) -> int:
    return min(max(int(float(element.get(f"{_SHEETS}Index", 0))) - len(before) - 1, 0), MOST_COLUMNS)


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
