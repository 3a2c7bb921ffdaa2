"""Room for bytes that are unpacked or rewritten: in memory, and in an unnamed file once they are many."""

from __future__ import annotations

import io
import tempfile
from contextlib import ExitStack
from typing import BinaryIO

_IN_MEMORY = 32 * 2**20


class Scratch:
    """Bytes that grow.

    Attributes
    ----------
    file : binary file
        What was written so far.
    size : int
    """

    def __init__(self, keep: ExitStack):
        self._keep = keep
        self.file: BinaryIO = io.BytesIO()
        self.size = 0

    def write(self, piece: bytes) -> None:
        """Append."""
        self.size += len(piece)
        if self.size > _IN_MEMORY and isinstance(self.file, io.BytesIO):
            file = self._keep.enter_context(tempfile.TemporaryFile(prefix="mrdamper-"))  # noqa: SIM115
            file.write(self.file.getbuffer())
            self.file = file  # type: ignore[assignment]
        self.file.write(piece)
