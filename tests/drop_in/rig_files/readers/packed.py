"""Files that begin with RIGX: time, displacement and force as doubles, one after the other."""

from __future__ import annotations

import numpy as np

from mrdamper.rig_files.readers.arrays import array_table
from mrdamper.rig_files.readers.base import RawTable, Reader, Source


class Packed(Reader):
    """Triples of doubles behind four letters."""

    name = "packed"
    title = "RIGX"
    suffixes = (".rigx",)

    def recognises(self, source: Source) -> bool:
        return source.head(4) == b"RIGX"

    def tables(self, source: Source, hints: object) -> list[RawTable]:
        source.file.seek(4)
        values = np.frombuffer(source.file.read(), "<f8").reshape(-1, 3)
        return [array_table(source, ["time", "displacement", "force"], ["s", "m", "N"], lambda i: values[:, i])]
