"""NumPy files: one array, or an archive of arrays; those of Python objects are refused, as loading them runs code."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.archive import checked_zip, is_arrays, is_zip_of
from mrdamper.rig_files.readers.arrays import check_unpacked, refuse_twice, refusing_damage, stated_array, value_of
from mrdamper.rig_files.readers.base import RawTable, Reader, Source
from mrdamper.rig_files.readers.nested import nested_tables
from mrdamper.rig_files.readers.several_tests import tests_of_array


class Npy(Reader):
    """A single array: a structured one, whose fields are channels, or a matrix whose columns a profile names."""

    name = "npy"
    title = "NumPy array"
    suffixes = (".npy",)
    marks = (b"\x93NUMPY",)

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return the one table, or that of each test of an array of more dimensions."""
        with refusing_damage(source, self.title):
            source.file.seek(0)
            shape, dtype = stated_array(source, source.file, "the array", source.size)
            check_unpacked(source, math.prod(shape) * dtype.itemsize)
            source.file.seek(0)
            array = np.lib.format.read_array(source.file, allow_pickle=False)
        if dtype.names:
            tree = {name: array[name] for name in dtype.names}
        elif array.squeeze().ndim > 2 and dtype.kind in "iuf":
            tree = {f"test_{i}": {"": test} for i, test in enumerate(tests_of_array(array), 1)}
        else:
            tree = {"": array}
        return nested_tables(source, tree, self.title)


class Npz(Reader):
    """Arrays by name."""

    name = "npz"
    title = "NumPy archive"
    suffixes = (".npz",)

    def recognises(self, source: Source) -> bool:
        """Recognise a zip of arrays, or a damaged zip of that name."""
        return is_zip_of(source, is_arrays, self.suffixes)

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return the arrays as columns of one table; a matrix gives numbered ones, a structured array its fields."""
        with refusing_damage(source, self.title):
            fields = _check_headers(source)
            source.file.seek(0)
            with np.load(source.file, allow_pickle=False) as archive:
                tree: dict[str, Any] = {n: value_of(archive[n]) for n in archive.files if n not in fields}
                tree |= {field: archive[name][field] for name, inner in fields.items() for field in inner}
        return nested_tables(source, tree, self.title)


def _check_headers(source: Source) -> dict[str, tuple[str, ...]]:
    """Return the fields of structured arrays by name, after a look at the headers of all arrays alone."""
    fields: dict[str, tuple[str, ...]] = {}
    with checked_zip(source, Npz.title) as archive:
        names = [member.filename.removesuffix(".npy") for member in archive.infolist()]
        refuse_twice(source, names)
        for member, name in zip(archive.infolist(), names, strict=True):
            with archive.open(member) as stream:
                _, dtype = stated_array(source, stream, f"array {name!r}", member.file_size)
            if dtype.names:
                fields[name] = dtype.names
    return fields
