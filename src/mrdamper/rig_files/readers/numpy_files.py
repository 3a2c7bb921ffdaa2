"""NumPy files: one array, or an archive of arrays; those of Python objects are refused, as loading them runs code."""

from __future__ import annotations

import math
import zipfile
from typing import TYPE_CHECKING, Any

import numpy as np

from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.archive import UNREADABLE_ZIP, check_sizes, is_arrays, zipped_names
from mrdamper.rig_files.readers.arrays import (
    array_table,
    check_unpacked,
    damaged,
    expand,
    pick,
    refuse_twice,
    refusing_damage,
    stated_array,
    value_of,
)
from mrdamper.rig_files.readers.base import RawTable, Reader, Source
from mrdamper.rig_files.readers.nested import nested_tables

if TYPE_CHECKING:
    pass


class Npy(Reader):
    """A single array: a structured one, whose fields are channels, or a matrix whose columns a profile names."""

    name = "npy"
    title = "NumPy array"
    suffixes = (".npy",)
    marks = (b"\x93NUMPY",)

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return the one table."""
        with refusing_damage(source, self.title):
            source.file.seek(0)
            shape, dtype = stated_array(source, source.file, "the array", source.size)
        check_unpacked(source, math.prod(shape) * dtype.itemsize)
        with refusing_damage(source, self.title):
            source.file.seek(0)
            array = np.lib.format.read_array(source.file, allow_pickle=False)
        if dtype.names:
            names, parts = list(dtype.names), list(dtype.names)
        else:
            parts = [part for _, part in expand("", shape)]
            names = [""] * len(parts)
        if not names:
            raise source.refuse("E_NO_DATA", f"an array of {shape}", "save the channels as columns of a matrix")

        def load(column: int) -> np.ndarray:
            part = parts[column]
            return array[part] if isinstance(part, str) else pick(array, part)

        units = ["s" if dtype.names and dtype[name].kind in "Mm" else "" for name in names]
        return [array_table(source, names, units, load, self.title)]


class Npz(Reader):
    """Arrays by name."""

    name = "npz"
    title = "NumPy archive"
    suffixes = (".npz",)

    def recognises(self, source: Source) -> bool:
        """Recognise a zip of arrays, or a damaged zip of that name."""
        if not source.head(4).startswith(b"PK"):
            return False
        names = zipped_names(source)
        return source.suffix in self.suffixes if names is None else is_arrays(names)

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return the arrays as columns of one table; a matrix gives numbered ones, a structured array its fields."""
        with refusing_damage(source, self.title):
            fields = _check_headers(source)
            source.file.seek(0)
            with np.load(source.file, allow_pickle=False) as archive:
                arrays = {name: archive[name] for name in archive.files if name not in fields}
                tree: dict[str, Any] = {
                    name: {"unit": "s", "data": array} if array.dtype.kind in "Mm" else value_of(array)
                    for name, array in arrays.items()
                }
                tree |= {field: archive[name][field] for name, inner in fields.items() for field in inner}
        return nested_tables(source, tree, self.title)


def _check_headers(source: Source) -> dict[str, tuple[str, ...]]:
    """Return the fields of structured arrays by name, after a look at the headers of all arrays alone."""
    try:
        archive = zipfile.ZipFile(source.file)
    except UNREADABLE_ZIP as error:
        raise damaged(source, Npz.title, "end of file not found") from error
    fields: dict[str, tuple[str, ...]] = {}
    with archive:
        members = archive.infolist()
        check_sizes(source, members)
        names = [member.filename.removesuffix(".npy") for member in members]
        refuse_twice(source, names)
        for member, name in zip(members, names, strict=True):
            with archive.open(member) as stream:
                _, dtype = stated_array(source, stream, f"array {name!r}", member.file_size)
            if dtype.names:
                fields[name] = dtype.names
    return fields
