"""A program as Python source, for streaming in the interpreter."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from mrdamper.tracing.expression import PARAMETER, SAMPLE, Expression, sign
from mrdamper.tracing.program import FUNCTIONS, Branch, Program, Repeat, Writer


class PythonWriter(Writer):
    """Writer of Python."""

    formats: ClassVar[Mapping[str, str]] = {
        **Writer.formats,
        **{op: f"math.{function}({{}})" for op, function in FUNCTIONS.items()},
        **{"power": "math.pow({}, {})", "absolute": "abs({})", "sign": "sign({})", "isfinite": "math.isfinite({})"},
        **{"minimum": "min({}, {})", "maximum": "max({}, {})"},
        **{"logical_and": "({} and {})", "logical_or": "({} or {})", "logical_not": "(not {})"},
    }

    def number(self, value: float) -> str:
        return repr(float(value))

    def let(self, expression: Expression) -> str:
        return f"{self.name(expression)} = {self.formula(expression)}"

    def branch(self, statement: Branch) -> list[str]:
        condition, then, otherwise = statement.select.args
        target = self.name(statement.select)
        lines = [f"if {self.text(condition)}:", *self.lines(statement.then, 1), f"    {target} = {self.text(then)}"]
        return [*lines, "else:", *self.lines(statement.otherwise, 1), f"    {target} = {self.text(otherwise)}"]

    def repeat(self, statement: Repeat) -> list[str]:
        loop = statement.loop
        carried = [self.carry(loop, i) for i in range(len(loop.start))]
        lines = [f"{name} = {self.text(value)}" for name, value in zip(carried, loop.start, strict=True)]
        lines += [f"for _ in range({loop.most}):", *self.lines(statement.body, 1)]
        lines.append(f"    going = {self.text(loop.going)}")
        lines.append(f"    {', '.join(carried)} = {', '.join(self.text(value) for value in loop.updates)}")
        return [*lines, "    if not going:", "        break"]


def python_source(program: Program) -> str:
    """Two functions: `prepare(p)` gives (status, derived), `step(p, derived, memory, inputs)` the rest.

    The rest is (status, outputs, memory). The status is 0, or 1 where a guard has another value.
    """
    writer, tape = PythonWriter(program), program.tape
    derived = [writer.name(node) for node in program.derived]
    updates = [tape.updates.get(name, memory) for name, memory in tape.memory.items()]
    lines = ["def prepare(_p):", *_unpack("_p", list(tape.parameters))]
    lines += writer.lines(program.setup, 1)
    lines += _guards(writer, program, PARAMETER, f"(0.0,){f' * {len(derived)}' if derived else '[:0]'}")
    lines.append(f"    return 0, {_tuple(derived)}")
    lines += ["", "", "def step(_p, _d, _s, _u):"]
    for name, members in (("_p", tape.parameters), ("_d", derived), ("_s", tape.memory), ("_u", tape.inputs)):
        lines += _unpack(name, list(members))
    lines += writer.lines(program.step, 1)
    lines += _guards(writer, program, SAMPLE, f"(0.0,) * {len(program.outputs)}, _s")
    outputs = [writer.text(value) for value in program.outputs.values()]
    lines.append(f"    return 0, {_tuple(outputs)}, {_tuple([writer.text(value) for value in updates])}")
    return "\n".join(lines) + "\n"


def python_functions(program: Program) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """`prepare` and `step` as functions of the interpreter."""
    room: dict[str, Any] = {"math": math, "sign": sign}
    room |= {f"lookup{i}": table.at_float for i, table in enumerate(program.tape.tables)}
    exec(compile(python_source(program), "<traced model>", "exec"), room)  # generated text only
    return room["prepare"], room["step"]


def _guards(writer: Writer, program: Program, stage: int, rest: str) -> list[str]:
    lines: list[str] = []
    for question, answer in program.guards(stage):
        text = writer.text(question)
        lines += [f"    if {'not ' if answer else ''}{text}:", f"        return 1, {rest}"]
    return lines


def _unpack(name: str, members: list[str]) -> list[str]:
    return [f"    {', '.join(members)}{',' if len(members) == 1 else ''} = {name}"] if members else []


def _tuple(values: list[str]) -> str:
    return f"({', '.join(values)}{',' if len(values) == 1 else ''})"
