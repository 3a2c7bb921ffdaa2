"""A traced program as JavaScript: C's grammar with other words, so it computes in C's order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from mrdamper.export.c_writer import CWriter
from mrdamper.tracing.text import FUNCTIONS


class JavaScriptWriter(CWriter):
    """JavaScript's words; its numbers are C's doubles."""

    member: ClassVar[str] = "."
    constant: ClassVar[str] = "const"
    answer: ClassVar[str] = "const"
    variable: ClassVar[str] = "let"
    counter: ClassVar[str] = "let"
    formats: ClassVar[Mapping[str, str]] = {
        **CWriter.formats,
        **{op: f"Math.{function}({{}})" for op, function in FUNCTIONS.items()},
        **{"power": "Math.pow({}, {})", "absolute": "Math.abs({})"},
        "equal": "({} === {})",
        "not_equal": "({} !== {})",
        "isfinite": "Number.isFinite({})",
    }

    def number(self, value: float) -> str:
        return repr(float(value))
