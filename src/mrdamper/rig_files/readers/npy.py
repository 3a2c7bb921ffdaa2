"""One NumPy array: a structured one, whose fields are channels, or a matrix whose columns a profile names."""

from __future__ import annotations

import math

import numpy as np

from mrdamper.rig_files.file_form import FileForm
from mrdamper.rig_files.readers.arrays import array_table, check_unpacked, expand, pick, refusing_damage, stated_array
from mrdamper.rig_files.readers.base import RawTable, Reader, Source


class Npy(Reader):
    """A single array; one of Python objects is refused, as loading it runs code."""

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
            across = expand("", shape)
            names, parts = ["" for _ in across], [part for _, part in across]
        if not names:
            raise source.refuse("E_NO_DATA", f"an array of {shape}", "save the channels as columns of a matrix")

        def load(column: int) -> np.ndarray:
            part = parts[column]
            return array[part] if isinstance(part, str) else pick(array, part)

        units = ["s" if dtype.names and dtype[name].kind in "Mm" else "" for name in names]
        return [array_table(source, names, units, load, title=self.title)]
