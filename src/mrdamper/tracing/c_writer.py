"""A traced program as C99: structures for parameters, derived constants and memory, and functions on them.

JavaScript is written with the grammar of C and other keywords, and computes in the same order.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from mrdamper.tracing import Expression, Program
from mrdamper.tracing.expression import PARAMETER, SAMPLE
from mrdamper.tracing.program import FUNCTIONS, Branch, Repeat, Statement, Writer


class CWriter(Writer):
    """Writer of C. Library functions and constants are macros, so that one source serves both precisions.

    Names of memory in the common state begin with `memory_prefix`.
    """

    def __init__(self, program: Program, memory_prefix: str = ""):
        super().__init__(program)
        self.memory_prefix = memory_prefix

    member: ClassVar[str] = "->"  # between a structure and its member
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
            return self.memory(name)
        owner = {"parameter": "p", "input": "u"}.get(expression.op)
        if owner is None and any(expression is d for d in self.program.derived):
            owner = "d"
        return f"{owner}{self.member}{name}" if owner else name

    def setup(self) -> str:
        """Write the statements computed once, and the conditions on parameters."""
        return self._block(self.program.setup) + self._guards(PARAMETER)

    def sample(self) -> str:
        """Write the statements computed at a sample, and the conditions checked there."""
        return self._block(self.program.step) + self._guards(SAMPLE)

    def results(self) -> str:
        """Write outputs, then the new memory: all of it is computed before any of it is stored."""
        tape = self.program.tape
        outputs = enumerate(self.program.outputs.items())
        lines = [f"{self.output(i, name)} = {self.text(value)};" for i, (name, value) in outputs]
        lines += [f"{self.constant} next_{name} = {self.text(value)};" for name, value in tape.updates.items()]
        lines += [f"{self.memory(name)} = next_{name};" for name in tape.updates]
        return "".join(f"    {line}\n" for line in lines)

    def output(self, index: int, name: str) -> str:
        """Return the place of an output."""
        return f"out{self.member}{name}"

    def memory(self, name: str) -> str:
        """Return the place of a memory value."""
        return f"s{self.member}{self.memory_prefix}{name}"

    def _guards(self, stage: int) -> str:
        lines: list[str] = []
        for question, answer in self.program.guards(stage):
            text = self.text(question)
            lines.append(f"    if ({'!' if answer else ''}{text}) {{\n        return 0;\n    }}\n")
        return "".join(lines)

    def _block(self, statements: list[Statement]) -> str:
        return "".join(f"{line}\n" for line in self.lines(statements, 1))

    def let(self, expression: Expression) -> str:
        name = self.name(expression)
        kind = "" if self.member in name else f"{self.answer if expression.logical else self.constant} "
        return f"{kind}{name} = {self.formula(expression)};"

    def branch(self, statement: Branch) -> list[str]:
        text, name = self.text, self.name(statement.select)
        condition, then, otherwise = statement.select.args
        local = self.member not in name
        if not (statement.then or statement.otherwise):
            kind = f"{self.constant} " if local else ""
            return [f"{kind}{name} = {text(condition)} ? {text(then)} : {text(otherwise)};"]
        lines = [f"{self.variable} {name};"] if local else []
        lines += [f"if ({text(condition)}) {{", *self.lines(statement.then, 1), f"    {name} = {text(then)};"]
        return [*lines, "} else {", *self.lines(statement.otherwise, 1), f"    {name} = {text(otherwise)};", "}"]

    def repeat(self, statement: Repeat) -> list[str]:
        loop = statement.loop
        carried = [self.carry(loop, i) for i in range(len(loop.start))]
        counter = f"{carried[0]}_count"
        starts = zip(carried, loop.start, strict=True)
        lines = [f"{self.counter} {counter};", *(f"{self.variable} {n} = {self.text(value)};" for n, value in starts)]
        lines.append(f"for ({counter} = 0; {counter} < {loop.most}; {counter}++) {{")
        inside = [f"{self.answer} going = {self.text(loop.going)};"]
        inside += [f"{self.constant} next_{n} = {self.text(v)};" for n, v in zip(carried, loop.updates, strict=True)]
        inside += [f"{name} = next_{name};" for name in carried]
        inside += ["if (!going) {", "    break;", "}"]
        return [*lines, *self.lines(statement.body, 1), *(f"    {line}" for line in inside), "}"]


class JavaScriptWriter(CWriter):
    """Writer of JavaScript; its numbers are the doubles of C."""

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
