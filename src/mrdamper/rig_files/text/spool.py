"""Columns that grow: in memory while small, in temporary files once they are large.

A gigabyte of text makes some hundred megabytes a column. These are memory-mapped from
unnamed temporary files, so that a reader that goes through them in pieces needs little
memory, and nothing stays behind.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from typing import IO

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.arrays import chunks

LARGE = 16 * 2**20  # bytes


class Spool:
    """Columns of numbers written piece by piece and given back as arrays."""

    def __init__(self, columns: Sequence[int]):
        self._columns = tuple(columns)
        self._pieces: dict[int, list[Floats]] = {c: [] for c in columns}
        self._files: dict[int, IO[bytes]] | None = None
        self._bytes = 0

    def add(self, values: dict[int, Floats]) -> None:
        """Append one piece of every column."""
        for column in self._columns:
            self._pieces[column].append(values[column])
            self._bytes += values[column].nbytes
        if self._bytes > LARGE:
            self._to_files()

    def arrays(self) -> dict[int, Floats]:
        """Every column, whole; memory-mapped where it is large."""
        if self._files is None:
            return {c: np.concatenate(p) if p else np.empty(0) for c, p in self._pieces.items()}
        self._to_files()
        arrays = {}
        for column, file in self._files.items():
            file.flush()
            arrays[column] = np.memmap(file, dtype=np.float64, mode="r+")
            file.close()  # the mapping holds it
        return arrays

    def _to_files(self) -> None:
        files = self._files or {c: tempfile.TemporaryFile(prefix="mrdamper-") for c in self._columns}  # noqa: SIM115
        self._files = files
        for column, waiting in self._pieces.items():
            for piece in waiting:
                files[column].write(np.ascontiguousarray(piece).data)
            waiting.clear()


def rescale(values: Floats, factor: float, offset: float = 0.0) -> Floats:
    """Values times a factor, plus an offset; a memory-mapped array is changed in place, piece by piece."""
    if factor == 1.0 and offset == 0.0:
        return values
    if not isinstance(values, np.memmap):
        return factor * values + offset if offset else factor * values
    for _, piece in chunks(values):
        piece[:] = factor * piece + offset
    return values
