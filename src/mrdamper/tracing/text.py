"""Parts of writing a program that all languages share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from mrdamper.tracing.expression import Expression
from mrdamper.tracing.program import Program
from mrdamper.tracing.tape import TracedLoop

FUNCTIONS = {name: name for name in ("sqrt", "exp", "expm1", "log", "log1p", "tan", "tanh")}
FUNCTIONS |= {"arctan": "atan", "arctanh": "atanh"}  # as C, JavaScript and Python call them
_MARKS = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"}
_MARKS |= {"less": "<", "less_equal": "<=", "greater": ">", "greater_equal": ">=", "equal": "==", "not_equal": "!="}


class Writer(ABC):
    """Writes expressions of a program; a language says how operations and numbers look."""

    formats: ClassVar[Mapping[str, str]] = {  # what C, JavaScript and Python write alike
        **{op: f"({{}} {mark} {{}})" for op, mark in _MARKS.items()},
        "negative": "(-{})",
    }

    def __init__(self, program: Program):
        self.program = program
        self._loops: dict[int, int] = {}

    @abstractmethod
    def number(self, value: float) -> str:
        """Write a number, all its digits."""

    def name(self, expression: Expression) -> str:
        """Name of an expression that has one."""
        if expression.op in ("carry", "result"):
            loop, index = expression.args
            return self.carry(loop, index)
        return self.program.names[id(expression)]

    def carry(self, loop: TracedLoop, index: int) -> str:
        """Name of a value that a loop carries."""
        return f"loop{self._loops.setdefault(id(loop), len(self._loops))}_{index}"

    def text(self, value: Any) -> str:
        """Write an expression where it is used: its name, or its formula."""
        if not isinstance(value, Expression):
            return self.number(value)
        if value.op in ("carry", "result") or id(value) in self.program.names:
            return self.name(value)
        return self.formula(value)

    def formula(self, expression: Expression) -> str:
        """Write the operation of an expression on its arguments."""
        if expression.op == "lookup":
            return f"lookup{expression.args[0]}({self.text(expression.args[1])})"
        return self.formats[expression.op].format(*(self.text(arg) for arg in expression.args))
