"""A traced program as C99: structures for parameters, derived numbers and memory, functions on them.

JavaScript is C's grammar with other words, so it computes in C's order.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from mrdamper.tracing import Expression, Program
from mrdamper.tracing.expression import PARAMETER, SAMPLE
from mrdamper.tracing.program import FUNCTIONS, Branch, Let, Repeat, Statement, Writer


class CWriter(Writer):
    """C's words. Library functions and constants go through macros, so that one source serves both precisions.

    Names of memory in the common state begin with `memory_prefix`.
    """

    def __init__(self, program: Program, memory_prefix: str = ""):
        super().__init__(program)
        self.memory_prefix = memory_prefix

    member: ClassVar[str] = "->"  # between a structure and what is in it
    constant: ClassVar[str] = "const real"
    answer: ClassVar[str] = "const int"  # yes or no
    variable: ClassVar[str] = "real"
    counter: ClassVar[str] = "int"
    formats: ClassVar[Mapping[str, str]] = {
        **Writer.formats,
        **{op: f"M({function})({{}})" for op, function in FUNCTIONS.items()},
        **{"power": "M(pow)({}, {})", "absolute": "M(fabs)({})", "isfinite": "(isfinite({}) != 0)"},
        **{"sign": "signum({})", "minimum": "lesser({}, {})", "maximum": "greater({}, {})"},
        **{"logical_and": "({} && {})", "logical_or": "({} || {})", "logical_not": "(!{})"},
    }

    def number(self, value: float) -> str:
        return f"R({float(value)!r})"

    def name(self, expression: Expression) -> str:
        name = super().name(expression)
        if expression.op == "memory":
            return f"s{self.member}{self.memory_prefix}{name}"
        owner = {"parameter": "p", "input": "u"}.get(expression.op)
        if owner is None and any(expression is d for d in self.program.derived):
            owner = "d"
        return f"{owner}{self.member}{name}" if owner else name

    def block(self, statements: list[Statement], indent: int = 1) -> str:
        """Text of a block."""
        return "".join(f"{line}\n" for line in self._lines(statements, indent))

    def setup(self) -> str:
        """Write the statements computed once, and the conditions on parameters."""
        return self.block(self.program.setup) + self._guards(PARAMETER)

    def sample(self) -> str:
        """Write the statements computed at a sample, and the conditions checked there."""
        return self.block(self.program.step) + self._guards(SAMPLE)

    def results(self) -> str:
        """Write outputs, then the new memory: all of it is computed before any of it is stored."""
        tape = self.program.tape
        lines = [f"out{self.member}{name} = {self.text(value)};" for name, value in self.program.outputs.items()]
        lines += [f"{self.constant} next_{name} = {self.text(value)};" for name, value in tape.updates.items()]
        lines += [f"s{self.member}{self.memory_prefix}{name} = next_{name};" for name in tape.updates]
        return "".join(f"    {line}\n" for line in lines)

    def _guards(self, stage: int) -> str:
        lines: list[str] = []
        for question, answer in self.program.guards(stage):
            text = self.text(question)
            lines.append(f"    if ({'!' if answer else ''}{text}) {{\n        return 0;\n    }}\n")
        return "".join(lines)

    def _lines(self, statements: list[Statement], indent: int) -> list[str]:
        pad, lines = "    " * indent, list[str]()
        for statement in statements:
            if isinstance(statement, Let):
                lines.append(f"{pad}{self._declared(statement.expression)} = {self.formula(statement.expression)};")
            elif isinstance(statement, Branch):
                lines += self._branch(statement, indent)
            else:
                lines += self._repeat(statement, indent)
        return lines

    def _declared(self, expression: Expression) -> str:
        name = self.name(expression)
        if self.member in name:
            return name
        return f"{self.answer if expression.logical else self.constant} {name}"

    def _branch(self, statement: Branch, indent: int) -> list[str]:
        pad, text = "    " * indent, self.text
        condition, then, otherwise = statement.select.args
        name = self.name(statement.select)
        local = self.member not in name
        if not (statement.then or statement.otherwise):
            kind = f"{self.constant} " if local else ""
            return [f"{pad}{kind}{name} = {text(condition)} ? {text(then)} : {text(otherwise)};"]
        lines = [f"{pad}{self.variable} {name};"] if local else []
        lines.append(f"{pad}if ({text(condition)}) {{")
        lines += [*self._lines(statement.then, indent + 1), f"{pad}    {name} = {text(then)};", f"{pad}}} else {{"]
        lines += [*self._lines(statement.otherwise, indent + 1), f"{pad}    {name} = {text(otherwise)};"]
        return [*lines, f"{pad}}}"]

    def _repeat(self, statement: Repeat, indent: int) -> list[str]:
        pad, loop = "    " * indent, statement.loop
        carried = [self.carry(loop, i) for i in range(len(loop.start))]
        counter = f"{carried[0]}_count"
        lines = [f"{pad}{self.counter} {counter};"]
        lines += [
            f"{pad}{self.variable} {n} = {self.text(value)};" for n, value in zip(carried, loop.start, strict=True)
        ]
        lines.append(f"{pad}for ({counter} = 0; {counter} < {loop.most}; {counter}++) {{")
        lines += self._lines(statement.body, indent + 1)
        inside = [f"{self.answer} going = {self.text(loop.going)};"]
        inside += [f"{self.constant} next_{n} = {self.text(v)};" for n, v in zip(carried, loop.updates, strict=True)]
        inside += [f"{name} = next_{name};" for name in carried]
        inside += ["if (!going) {", "    break;", "}"]
        return [*lines, *(f"{pad}    {line}" for line in inside), f"{pad}}}"]


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
