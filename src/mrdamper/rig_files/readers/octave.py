"""Texts in which Octave saves its variables: save -text, its default."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import damaged, whole
from mrdamper.rig_files.readers.base import RawTable, Reader, Source
from mrdamper.rig_files.readers.nested import nested_tables
from mrdamper.rig_files.text.stream import decoded

_MARKS = (b"# Created by Octave", b"# name: ")


class Octave(Reader):
    """Numbers, matrices and texts by their names; a field of a struct is a variable."""

    name = "octave"
    title = "Octave text"
    suffixes = (".octave",)
    binary = False

    def recognises(self, source: Source) -> bool:
        """By its first line, whatever it is called."""
        return source.head(32).startswith(_MARKS)

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return the variables as one table."""
        variables, lines = dict[str, Any](), decoded(whole(source, self.title)).splitlines()
        starts = [i for i, line in enumerate(lines) if line.startswith("# name: ")]
        for start, stop in zip(starts, [*starts[1:], len(lines)], strict=True):
            name, kind = lines[start][8:].strip(), next(iter(lines[start + 1 : stop]), "")
            try:
                value = _value(kind[8:].strip(), lines[start + 2 : stop]) if kind.startswith("# type: ") else None
            except ValueError as error:
                raise damaged(source, self.title, str(error)) from error
            variables |= {} if value is None else {name: value}
        return nested_tables(source, variables, self.title)


def _value(kind: str, lines: list[str]) -> Any:
    """Return a number, a matrix or a text; None of another type. ValueError if it is not whole."""
    keyed = (line.partition(":") for line in lines if line[:1] == "#")
    stated = {key[1:].strip(): number for key, colon, number in keyed if colon}
    body = [line for line in lines if line.strip() and not line.startswith("#")]
    if kind == "scalar":
        return float(body[0]) if body else None
    if kind in ("string", "sq_string"):
        return body[0].strip() if body else ""
    if kind != "matrix" or not {"rows", "columns"} <= set(stated):
        return None
    shape = int(stated["rows"]), int(stated["columns"])
    values = np.array([float(cell) for line in body for cell in line.split()])
    if values.size != shape[0] * shape[1]:
        raise ValueError(f"end of file after {values.size} of {shape[0] * shape[1]} values")
    return values.reshape(shape)
