"""Traced programs as C functions of plain arrays, with numbers by position."""

from __future__ import annotations

import math
import re
from pathlib import Path

from mrdamper.tracing import Expression, Program
from mrdamper.tracing.c_writer import CWriter
from mrdamper.tracing.expression import SAMPLE
from mrdamper.tracing.program import Branch, Let, Statement, postorder

_HERE = Path(__file__)
PREAMBLE = _HERE.with_name("preamble.c").read_text(encoding="utf-8")


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
    along = _HERE.with_name("record.c").read_text(encoding="utf-8")
    return f"{PREAMBLE}{functions(program, keep=True)}\n{defined}\n{along}"
