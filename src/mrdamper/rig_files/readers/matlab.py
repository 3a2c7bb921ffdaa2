"""MATLAB files: up to 7.2 by SciPy; those from 7.3 on are HDF5 inside."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers import arrays
from mrdamper.rig_files.readers.base import RawTable, Reader, Source
from mrdamper.rig_files.readers.hdf5 import HDF5_MARK, MOST_STRUCTS, hdf5_tables
from mrdamper.rig_files.readers.nested import nested_tables

_NUMERIC = ("double", "single", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64")
_OBJECTS = ("object", "opaque", "function", "unknown")


class Matlab(Reader):
    """Variables and fields of structs as columns; 7.3 is handed on."""

    name = "mat"
    title = "MATLAB file"
    suffixes = (".mat", ".mat73")
    library = "scipy.io"

    def recognises(self, source: Source) -> bool:
        """By the text at the start; version 4 has none, so the name must say it."""
        head = source.head(520)
        old = source.suffix == ".mat" and _is_version_4(head)
        return head.startswith(b"MATLAB") or head[512:] == HDF5_MARK or old

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return the variables as one table, and one more a struct."""
        if source.head(520)[512:] == HDF5_MARK:
            return hdf5_tables(source, self.title)
        with arrays.refusing_damage(source, self.title):
            from scipy.io import loadmat, whosmat

            source.file.seek(0)
            variables = whosmat(source.file)
            names = [name for name, _, _ in variables]
            arrays.refuse_twice(source, names)
            arrays.check_unpacked(source, 8 * sum(int(np.prod(shape, dtype=object)) for _, shape, _ in variables))
            wanted = [name for name, _, kind in variables if kind in (*_NUMERIC, "struct", "char", "cell")]
            source.file.seek(0)
            values = loadmat(source.file, variable_names=wanted, simplify_cells=True)
        others = [name for name, _, kind in variables if kind in _OBJECTS]
        tree = {name: _tree(values[name]) for name in wanted if name in values}
        objects = {name: np.empty(2, dtype=object) for name in others}  # refused if one is asked for
        return nested_tables(source, {**tree, **objects}, self.title)


def _tree(value: Any) -> Any:
    """Return a variable as a nested structure: mappings for structs, lists for arrays of them and for cells."""
    if hasattr(value, "_fieldnames"):  # in arrays of several dimensions
        value = vars(value)
    if isinstance(value, dict):
        return {name: _tree(item) for name, item in value.items() if not name.startswith("_")}
    if isinstance(value, list):
        return [_tree(item) for item in value[:MOST_STRUCTS]]
    array = np.asarray(value)
    if array.dtype.kind == "O" and array.ndim > 1 and all(hasattr(item, "_fieldnames") for item in array.flat):
        array = array.reshape(-1)  # structs of tests by current and frequency
    if words := arrays.texts_in(array):
        return words
    if array.dtype.kind == "O" and 0 < array.size <= MOST_STRUCTS and array.ndim:
        if rows := arrays.with_headings(array.tolist() if array.ndim == 2 else []):
            return [_tree(row) for row in rows]
        cells = [_tree(cell) for cell in array]
        return array if any(isinstance(cell, (str, float)) for cell in cells) else cells
    return arrays.value_of(array) if array.size else ""


def _is_version_4(head: bytes) -> bool:
    if len(head) < 21:
        return False
    for order in "<>":
        kind, rows, columns, imaginary, length = np.frombuffer(head[:20], dtype=f"{order}i4").tolist()
        if 0 <= kind < 5000 and rows > 0 and columns > 0 and imaginary in (0, 1) and 1 < length < 200:
            return head[20 : 20 + length][:-1].isascii()
    return False
