"""A traced program as C99: structures for parameters, derived constants and memory, and functions on them.

JavaScript is written with the grammar of C and other keywords, and computes in the same order. Programs that run along
records are C functions of plain arrays, with numbers by position.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from mrdamper.tracing import Expression, Program
from mrdamper.tracing.expression import PARAMETER, SAMPLE
from mrdamper.tracing.program import FUNCTIONS, Branch, Let, Repeat, Statement, Writer, postorder

_COMPILED = Path(__file__).with_name("compiled")
PREAMBLE = (_COMPILED / "preamble.c").read_text(encoding="utf-8")


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


class ArrayWriter(CWriter):
    """C whose parameters, derived numbers, memory, inputs and outputs are elements of arrays.

    With `keep`, results that depend on the time step or the current alone are kept until these change; step functions
    then take one more array.
    """

    member = "["

    def __init__(self, program: Program, keep: bool = False):
        super().__init__(program)
        tape = program.tape
        self._places = {id(e): f"p[{i}]" for i, e in enumerate(tape.parameters.values())}
        self._places |= {id(e): f"u[{i}]" for i, e in enumerate(tape.inputs.values())}
        self._places |= {id(e): f"s[{i}]" for i, e in enumerate(tape.memory.values())}
        self._places |= {id(e): f"d[{i}]" for i, e in enumerate(program.derived)}
        self.kept = 0  # numbers that are kept
        self._kept: set[int] = set()  # expressions of their values
        self.refresh = self._keep_slow() if keep else ""

    def _keep_slow(self) -> str:
        """Assign places to the largest expressions of the slow inputs alone; return the code that computes them."""
        groups: dict[frozenset[str], list[Expression]] = {}
        needs, users = _slow_needs(self.program)
        for node, named in needs.items():
            if named and _is_dear(node) and not all(needs.get(user) for user in users.get(node, [])):
                groups.setdefault(named, []).append(node)
        text = ""
        for named, nodes in groups.items():
            inputs = [self._places[id(e)] for name, e in self.program.tape.inputs.items() if name in named]
            held = [f"m[{self.kept + i}]" for i in range(len(inputs))]
            self.kept += len(inputs)
            lines = [f"        {place} = {value};" for place, value in zip(held, inputs, strict=True)]
            fresh = {}
            for node in nodes:
                fresh[id(node)] = f"m[{self.kept}]"
                lines.append(f"        m[{self.kept}] = {self._expanded(node)};")
                self.kept += 1
            changed = " || ".join(f"{place} != {value}" for place, value in zip(held, inputs, strict=True))
            text += f"    if ({changed}) {{\n" + "\n".join(lines) + "\n    }\n"
            self._places |= fresh
            self._kept |= fresh.keys()
        return text

    def lines(self, block: list[Statement], indent: int) -> list[str]:
        """Write statements except those of kept numbers, which `refresh` computes."""
        own = [s.expression if isinstance(s, Let) else s.select if isinstance(s, Branch) else None for s in block]
        return super().lines([s for s, e in zip(block, own, strict=True) if id(e) not in self._kept], indent)

    def _expanded(self, value: object) -> str:
        """Expand an expression down to what is available before any statement."""
        if not isinstance(value, Expression):
            return self.number(value)  # type: ignore[arg-type]
        if id(value) in self._places:
            return self._places[id(value)]
        parts = [self._expanded(part) for part in value.args]
        if value.op == "select":
            return f"({parts[0]} ? {parts[1]} : {parts[2]})"
        return self.formats[value.op].format(*parts)

    def text(self, value: object) -> str:
        place = self._places.get(id(value)) if isinstance(value, Expression) else None
        return place or super().text(value)

    def number(self, value: float) -> str:
        if math.isnan(value):
            return "NAN"
        if math.isinf(value):
            return "INFINITY" if value > 0 else "(-INFINITY)"
        return repr(float(value))

    def name(self, expression: Expression) -> str:
        return self._places.get(id(expression)) or super(CWriter, self).name(expression)

    def output(self, index: int, name: str) -> str:
        return f"out[{index}]"

    def memory(self, name: str) -> str:
        return self._places[id(self.program.tape.memory[name])]


# Inputs that are constant over most samples.
_SLOW_INPUTS = frozenset({"dt", "current", "frequency", "amplitude"})
_DEAR = frozenset({"divide", "power", "sqrt", "exp", "expm1", "log", "log1p", "tan", "arctan", "tanh", "arctanh"})


def _slow_needs(program: Program) -> tuple[dict[Expression, frozenset[str]], dict[Expression, list[Expression]]]:
    """Return the slow inputs of each expression that depends on these alone, and the users of each expression."""
    needs: dict[Expression, frozenset[str]] = {}
    users: dict[Expression, list[Expression]] = {}
    for node in postorder([*program.outputs.values(), *program.tape.updates.values()]):
        if not isinstance(node, Expression) or node.op in ("memory", "carry", "result", "lookup"):
            continue
        if node.op == "input":
            if node.name in _SLOW_INPUTS:
                needs[node] = frozenset({node.name})
            continue
        parts = [part for part in node.args if isinstance(part, Expression)]
        for part in parts:
            users.setdefault(part, []).append(node)
        if node.stage < SAMPLE:
            needs[node] = frozenset()
        elif all(part in needs for part in parts):
            needs[node] = frozenset().union(*(needs[part] for part in parts))
    return needs, users


def _is_dear(node: Expression) -> bool:
    return any(isinstance(part, Expression) and part.op in _DEAR and part.stage == SAMPLE for part in postorder([node]))


def functions(program: Program, index: int = 0, keep: bool = False) -> str:
    """C of `prepare_INDEX(p, d)` and `step_INDEX(p, d, s, u, out)`; both return 0 where the program is not valid."""
    writer = ArrayWriter(program, keep)
    setup, body = writer.setup(), writer.refresh + writer.sample() + writer.results()
    kept = f", real m[{max(1, writer.kept)}]" if keep else ""
    names = [re.sub(r"\W", "_", f"table_{index}_{i}") for i in range(len(program.tape.tables))]
    tables, defined = list[str](), list[str]()
    for i, (name, table) in enumerate(zip(names, program.tape.tables, strict=True)):
        nodes = ", ".join(map(writer.number, table.nodes.tolist()))
        rows = ",\n    ".join("{" + ", ".join(map(writer.number, row)) + "}" for row in table.cells.tolist())
        tables.append(f"static const real {name}[] = {{{nodes}}};\n")
        tables.append(f"static const real {name}_cells[][7] = {{\n    {rows}\n}};\n")
        defined.append(
            f"#undef lookup{i}\n#define lookup{i}(x) read_table({name}, {name}_cells, {len(table.nodes)}, x)\n"
        )
    return (
        f"\n{''.join(tables)}{''.join(defined)}"
        f"static int prepare_{index}(const real *restrict p, real *restrict d)\n{{\n"
        f"    (void)p;\n    (void)d;\n{setup}    return 1;\n}}\n\n"
        f"static inline int step_{index}(const real *restrict p, const real *restrict d, real *restrict s,\n"
        f"    const real *restrict u, real *restrict out{kept})\n{{\n"
        f"    (void)p;\n    (void)d;\n    (void)s;\n    (void)u;\n{body}    return 1;\n}}\n"
    )


def record_source(program: Program) -> str:
    """C of a library that prepares a program and runs it along a record."""
    tape = program.tape
    sizes = {"MEMORY": len(tape.memory), "INPUTS": len(tape.inputs), "OUTPUTS": len(program.outputs)}
    sizes["KEPT"] = ArrayWriter(program, keep=True).kept
    defined = "".join(f"#define {name} {max(1, size)}\n" for name, size in sizes.items())
    defined += f"#define REMEMBERS {int(bool(tape.memory))}\n"
    along = _COMPILED.joinpath("record.c").read_text(encoding="utf-8")
    return f"{PREAMBLE}{functions(program, keep=True)}\n{defined}\n{along}"
