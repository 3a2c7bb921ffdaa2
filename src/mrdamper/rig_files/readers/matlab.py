"""MATLAB files up to 7.2, by SciPy."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrdamper.rig_files.column_names import split_name
from mrdamper.rig_files.file_form import FileForm
from mrdamper.rig_files.readers.arrays import (
    array_table,
    check_unpacked,
    expand,
    pick,
    refusing_damage,
    titles_of,
    twice,
)
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RawTable, Reader, Source
from mrdamper.rig_files.readers.hdf5 import HDF5_MARK, MOST_STRUCTS, hdf5_tables
from mrdamper.rig_files.units import is_unit

_NUMERIC = ("double", "single", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64")
_OBJECTS = ("object", "opaque", "function", "unknown")
_DEEPEST = 4


class Matlab(Reader):
    """Variables and fields of structs as columns; 7.3 is handed on."""

    name = "mat"
    title = "MATLAB file"
    suffixes = (".mat", ".mat73")
    library = "scipy.io"

    def recognises(self, source: Source) -> bool:
        """By the text at the start; version 4 has none, so the name must say it."""
        head = source.head(520)
        return (
            head.startswith(b"MATLAB") or head[512:] == HDF5_MARK or (source.suffix == ".mat" and _is_version_4(head))
        )

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """The variables as one table, and one more a struct."""
        if source.head(520)[512:] == HDF5_MARK:
            return hdf5_tables(source, self.title)
        with refusing_damage(source, self.title):
            from scipy.io import loadmat, whosmat

            source.file.seek(0)
            variables = whosmat(source.file)
            names = [name for name, _, _ in variables]
            if len(set(names)) < len(names):
                raise twice(source, next(name for name in names if names.count(name) > 1))
            check_unpacked(source, 8 * sum(int(np.prod(shape, dtype=object)) for _, shape, _ in variables))
            wanted = [name for name, _, kind in variables if kind in (*_NUMERIC, "struct", "char", "cell")]
            source.file.seek(0)
            values = loadmat(
                source.file, variable_names=wanted, struct_as_record=True, verify_compressed_data_integrity=True
            )
        found = _Found()
        for name in wanted:
            if name in values:
                _gather(values[name], name, "", found)
        others = [name for name, _, kind in variables if kind in _OBJECTS]
        if not found.columns:
            code, what = ("E_UNSAFE", f"only objects ({others[0]})") if others else ("E_NO_DATA", "no array of numbers")
            raise source.refuse(code, what, "save the channels as arrays of numbers")
        for name in others:
            found.columns[""][name] = np.empty(2, dtype=object)  # refused if it is asked for
        return [_table(source, columns, label, self.title, found) for label, columns in found.columns.items()]


@dataclass
class _Found:
    """By the label of a table its columns, single numbers, texts, and lists of words."""

    columns: dict[str, dict[str, np.ndarray]] = field(default_factory=lambda: defaultdict(dict))
    single: dict[str, dict[str, float]] = field(default_factory=lambda: defaultdict(dict))
    remarks: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    lists: dict[str, list[list[str]]] = field(default_factory=lambda: defaultdict(list))

    def above(self, label: str) -> Iterator[str]:
        """Labels of the structs a table lies in, from the file down to its own."""
        return (at for at in ("", *self.single, *self.remarks) if at in ("", label) or label.startswith(f"{at}_"))


def _table(source: Source, columns: dict[str, np.ndarray], label: str, title: str, found: _Found) -> RawTable:
    parts: list[tuple[str, np.ndarray, int | None]] = []
    units: list[str] = []
    for key, array in columns.items():
        across = expand(key, array.shape)
        titles = titles_of(len(across), found.lists.get(label, ())) if len(across) > 1 else None
        names, its_units = titles or ([name for name, _ in across], [""] * len(across))
        parts += [(name, array, part) for name, (_, part) in zip(names, across, strict=True)]
        units += its_units
    above = list(dict.fromkeys(found.above(label)))
    return array_table(
        source,
        [name for name, _, _ in parts],
        units,
        lambda column: pick(parts[column][1], parts[column][2]),
        label=label,
        title=title,
        constants={name: value for known in above for name, value in found.single.get(known, {}).items()},
        remarks=[line for known in above for line in found.remarks.get(known, [])],
    )


def _gather(value: Any, name: str, label: str, found: _Found, depth: int = 0) -> None:
    """Collect arrays, single numbers and texts by name; a struct is a table of its own, and so is each of an array."""
    array = np.asarray(value)
    kind, size = array.dtype.kind, array.size
    if array.dtype.names and size and depth < _DEEPEST:
        items = array.reshape(-1)[:MOST_STRUCTS]
        for number, item in enumerate(items, 1):
            own = f"{name}_{number}" if size > 1 else name
            inner = f"{label}_{own}" if label else own
            if _named(item, label, found):
                continue
            for part in array.dtype.names:
                _gather(item[part], part, inner, found, depth + 1)
    elif kind == "O" and size and depth < _DEEPEST and all(np.asarray(item).dtype.names for item in array.flat):
        for number, item in enumerate(array.reshape(-1)[:MOST_STRUCTS], 1):
            _gather(item, f"{name}_{number}", label, found, depth + 1)
    elif size > 1 and split_name(name).role is None and (words := _words(array)):
        found.lists[label].append(words)
    elif kind in "iufcO" and size > 1:
        found.columns[label][name] = array  # objects and complex numbers are refused if asked for
    elif kind in "iuf" and size == 1 and len(found.single[label]) < MOST_COLUMNS:
        found.single[label][name] = float(array.reshape(-1)[0])
    elif kind in "US" and size == 1:
        found.remarks[label].append(f"{name}: {array.reshape(-1)[0]}"[:200])


def _named(item: np.void, label: str, found: _Found) -> bool:
    """Take a struct that holds a channel's name, unit and data, as dSPACE and others write them; whether it is one."""
    says = {part.lower(): np.asarray(item[part]) for part in item.dtype.names or ()}
    name, data, unit = (says.get(key, np.empty(0)) for key in ("name", "data", "unit"))
    if name.dtype.kind != "U" or name.size != 1 or data.dtype.kind not in "iuf" or data.size < 2:
        return False
    title = str(name.reshape(-1)[0]).rpartition("/")[2]  # of a path in a model
    stated = str(unit.reshape(-1)[0]) if unit.dtype.kind == "U" and unit.size == 1 else ""
    found.columns[label][f"{title} [{stated}]" if is_unit(stated) else title] = data
    return True


def _words(array: np.ndarray) -> list[str]:
    """A cell array of texts, or the rows of a matrix of characters; empty if it is neither."""
    if array.dtype.kind == "U" and array.size <= MOST_COLUMNS:
        return [str(item).strip() for item in array.reshape(-1)]
    if array.dtype.kind != "O" or array.size > MOST_COLUMNS:
        return []
    cells = [np.asarray(item) for item in array.reshape(-1)]
    if any(cell.dtype.kind != "U" or cell.size > 1 for cell in cells):
        return []
    return [str(cell.reshape(-1)[0]).strip() if cell.size else "" for cell in cells]


def _is_version_4(head: bytes) -> bool:
    if len(head) < 21:
        return False
    for order in "<>":
        kind, rows, columns, imaginary, length = np.frombuffer(head[:20], dtype=f"{order}i4").tolist()
        if 0 <= kind < 5000 and rows > 0 and columns > 0 and imaginary in (0, 1) and 1 < length < 200:
            return head[20 : 20 + length][:-1].isascii()
    return False
