"""MATLAB files up to 7.2, by SciPy."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrdamper.rig_files.readers.arrays import array_table, check_unpacked, expand, pick, refusing_damage
from mrdamper.rig_files.readers.base import MOST_COLUMNS, Hints, RawTable, Reader, Source
from mrdamper.rig_files.readers.hdf5 import HDF5_MARK, hdf5_tables

_NUMERIC = ("double", "single", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64")
_OBJECTS = ("cell", "object", "opaque", "function", "unknown")
_DEEPEST = 4


class Matlab(Reader):
    """Variables and fields of structs as columns; 7.3 is handed on."""

    name = "mat"
    title = "MATLAB file"
    suffixes = (".mat",)
    library = "scipy.io"

    def recognises(self, source: Source) -> bool:
        """By the text at the start; version 4 has none, so the name must say it."""
        head = source.head(520)
        return (
            head.startswith(b"MATLAB") or head[512:] == HDF5_MARK or (source.suffix == ".mat" and _is_version_4(head))
        )

    def tables(self, source: Source, hints: Hints) -> list[RawTable]:
        """The variables as one table, and one more a struct."""
        if source.head(520)[512:] == HDF5_MARK:
            return hdf5_tables(source, self.title)
        with refusing_damage(source, self.title):
            from scipy.io import loadmat, whosmat

            source.file.seek(0)
            variables = whosmat(source.file)
            check_unpacked(source, 8 * sum(int(np.prod(shape, dtype=object)) for _, shape, _ in variables))
            wanted = [name for name, _, kind in variables if kind in (*_NUMERIC, "struct")]
            source.file.seek(0)
            values = loadmat(
                source.file, variable_names=wanted, struct_as_record=True, verify_compressed_data_integrity=True
            )
        tables: dict[str, dict[str, np.ndarray]] = {}
        single: dict[str, dict[str, float]] = {}
        for name in wanted:
            if name in values:
                _gather(values[name], name, "", tables, single)
        others = [name for name, _, kind in variables if kind in _OBJECTS]
        if not tables:
            code, found = (
                ("E_UNSAFE", f"only objects ({others[0]})") if others else ("E_NO_DATA", "no array of numbers")
            )
            raise source.refuse(code, found, mend="save the channels as arrays of numbers")
        for name in others:
            tables.setdefault("", {})[name] = np.empty(2, dtype=object)  # never loaded; refused if it is asked for
        return [
            _table(source, columns, label, self.title, {**single.get("", {}), **single.get(label, {})})
            for label, columns in tables.items()
        ]


def _table(
    source: Source, columns: dict[str, np.ndarray], label: str, title: str, constants: dict[str, float]
) -> RawTable:
    found = [(name, array, part) for key, array in columns.items() for name, part in expand(key, array.shape)]
    return array_table(
        source,
        [name for name, _, _ in found],
        [""] * len(found),
        lambda column: pick(found[column][1], found[column][2]),
        label=label,
        title=title,
        constants=constants,
    )


def _gather(
    value: Any,
    name: str,
    label: str,
    tables: dict[str, dict[str, np.ndarray]],
    single: dict[str, dict[str, float]],
    depth: int = 0,
) -> None:
    """Collect arrays and single numbers by name; the fields of a struct are a table of their own."""
    array = np.asarray(value)
    if array.dtype.names and array.size == 1 and depth < _DEEPEST:
        inner = f"{label}_{name}" if label else name
        for field in array.dtype.names:
            _gather(array.reshape(-1)[0][field], field, inner, tables, single, depth + 1)
    elif array.dtype.kind in "iufcO" and array.size > 1:
        tables.setdefault(label, {})[name] = array  # objects and complex numbers are refused if they are asked for
    elif array.dtype.kind in "iuf" and array.size == 1 and len(single) < MOST_COLUMNS:
        single.setdefault(label, {})[name] = float(array.reshape(-1)[0])


def _is_version_4(head: bytes) -> bool:
    if len(head) < 21:
        return False
    for order in "<>":
        kind, rows, columns, imaginary, length = np.frombuffer(head[:20], dtype=f"{order}i4").tolist()
        if 0 <= kind < 5000 and rows > 0 and columns > 0 and imaginary in (0, 1) and 1 < length < 200:
            return head[20 : 20 + length][:-1].isascii()
    return False
