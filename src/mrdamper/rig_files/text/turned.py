"""Texts whose channels stand in rows: each begins with its name and unit, then the samples run to the right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from mrdamper.rig_files.column_names import split_name
from mrdamper.rig_files.readers.arrays import array_table
from mrdamper.rig_files.readers.base import RawTable, Source
from mrdamper.rig_files.text.layout import cells_of
from mrdamper.rig_files.text.tokens import looks_numeric, number
from mrdamper.rig_files.units import is_unit

_MOST_LINES, _FEWEST_SAMPLES = 60, 30
_TELLING = 2  # rows whose names tell what they are


def turned_table(source: Source, lines: Sequence[str]) -> RawTable | None:
    """Return the table of a text with its channels in rows; None if it is none.

    Raises `RigFileError`, its code E_NUMBER, if a cell of such a row is no number.
    """
    filled = list(islice((line for line in lines if line.strip()), _MOST_LINES + 1))
    for separator in ("\t", ";", ",") if 1 < len(filled) <= _MOST_LINES else ():
        cells = [[cell.strip('"') for cell in cells_of(line.rstrip(separator), separator)] for line in filled]
        width = max(map(len, cells))
        rows = [row for row in cells if len(row) == width and not looks_numeric(row[0]) and looks_numeric(row[-1])]
        roles = {split_name(row[0]).role for row in rows} - {None}
        if width <= _FEWEST_SAMPLES or len(roles) < _TELLING:
            continue
        united = all(is_unit(row[1].strip("[]()")) for row in rows)
        headers = [split_name(row[0], row[1].strip("[]()") if united else "") for row in rows]
        remarks = [line for line, row in zip(filled, cells, strict=True) if row not in rows]
        rows = [[row[0], *row[2:]] for row in rows] if united else rows
        commas = separator != "," and any("," in cell for row in rows for cell in row[1:])
        mark = "," if commas and not any("." in cell for row in rows for cell in row[1:]) else "."

        def load(column: int, rows: list[list[str]] = rows, mark: str = mark, shift: int = 2 + united) -> np.ndarray:
            values = [number(cell, mark) for cell in rows[column][1:]]
            if None in values:
                at = values.index(None)
                problem = f"{rows[column][at + 1][:40]!a} in row {rows[column][0]!r} is no number"
                raise source.refuse("E_NUMBER", problem, "correct the cell", column=at + shift)
            return np.array(values, dtype=float)

        names, units = [header.name for header in headers], [header.unit for header in headers]
        return replace(array_table(source, names, units, load), remarks=tuple(remarks))
    return None
