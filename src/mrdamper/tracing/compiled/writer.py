"""Traced programs as C functions of plain arrays: the words of the export, numbers by their position."""

from __future__ import annotations

import math
import re

from mrdamper.tracing import Expression, Program
from mrdamper.tracing.c_writer import CWriter

PREAMBLE = """\
#include <math.h>
#include <string.h>

#if defined(_MSC_VER)
#define EXPORT __declspec(dllexport)
#define restrict __restrict
#else
#define EXPORT __attribute__((visibility("default")))
#endif
#define R(x) x
#define M(function) function
typedef double real;
typedef long long whole;

static inline real signum(real x)
{
    return x > 0.0 ? 1.0 : (x < 0.0 ? -1.0 : 0.0);
}

static inline real lesser(real a, real b)
{
    return b < a ? b : a;
}

static inline real greater(real a, real b)
{
    return b > a ? b : a;
}

/* Value at x of polynomials of degree five between nodes; constant beyond the ends. */
static inline real read_table(const real *nodes, const real (*cells)[7], int count, real x)
{
    int low = 0, high = count - 1;
    real t;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (nodes[middle] <= x) {
            low = middle;
        } else {
            high = middle;
        }
    }
    x = lesser(greater(x, nodes[0]), nodes[count - 1]);
    t = (x - nodes[low]) * cells[low][6];
    return cells[low][0] + t * (cells[low][1] + t * (cells[low][2] + t * (cells[low][3]
        + t * (cells[low][4] + t * cells[low][5]))));
}
"""

_RECORD = """
EXPORT whole along(const real *p, const real *d, real *memory, whole samples, const real *const *inputs,
    const whole *strides, real *const *outputs)
{{
    real s[{memory}], u[{inputs}], out[{outputs}];
    whole i, k;
    memcpy(s, memory, sizeof s);
    for (i = 0; i < samples; i++) {{
        for (k = 0; k < {inputs}; k++) {{
            u[k] = inputs[k][i * strides[k]];
        }}
        if (!step_0(p, d, s, u, out)) {{
            break;
        }}
        for (k = 0; k < {outputs}; k++) {{
            outputs[k][i] = out[k];
        }}
    }}
    memcpy(memory, s, sizeof s);
    return i < samples ? i : -1;
}}
"""


class ArrayWriter(CWriter):
    """C whose parameters, derived numbers, memory, inputs and outputs are elements of arrays."""

    member = "["

    def __init__(self, program: Program):
        super().__init__(program)
        tape = program.tape
        self._places = {id(e): f"p[{i}]" for i, e in enumerate(tape.parameters.values())}
        self._places |= {id(e): f"u[{i}]" for i, e in enumerate(tape.inputs.values())}
        self._places |= {id(e): f"s[{i}]" for i, e in enumerate(tape.memory.values())}
        self._places |= {id(e): f"d[{i}]" for i, e in enumerate(program.derived)}

    def number(self, value: float) -> str:
        if math.isnan(value):
            return "NAN"
        if math.isinf(value):
            return "INFINITY" if value > 0 else "(-INFINITY)"
        return repr(float(value))

    def name(self, expression: Expression) -> str:
        return self._places.get(id(expression)) or super(CWriter, self).name(expression)

    def results(self) -> str:
        """Outputs, then the new memory: all of it is computed before any of it is stored."""
        tape = self.program.tape
        places = {name: self._places[id(tape.memory[name])] for name in tape.updates}
        lines = [f"out[{i}] = {self.text(value)};" for i, value in enumerate(self.program.outputs.values())]
        lines += [f"{self.constant} next_{name} = {self.text(value)};" for name, value in tape.updates.items()]
        lines += [f"{place} = next_{name};" for name, place in places.items()]
        return "".join(f"    {line}\n" for line in lines)


def functions(program: Program, index: int = 0) -> str:
    """C of `prepare_INDEX(p, d)` and `step_INDEX(p, d, s, u, out)`; both return 0 where the program does not hold."""
    writer = ArrayWriter(program)
    setup, body = writer.setup(), writer.sample() + writer.results()
    names = [re.sub(r"\W", "_", f"table_{index}_{i}") for i in range(len(program.tape.tables))]
    tables, defined = [], []
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
        "    const real *restrict u, real *restrict out)\n{\n"
        f"    (void)p;\n    (void)d;\n    (void)s;\n    (void)u;\n{body}    return 1;\n}}\n"
    )


def record_source(program: Program) -> str:
    """C of a library that prepares a program and runs it along a record."""
    tape = program.tape
    sizes = {"memory": len(tape.memory), "inputs": len(tape.inputs), "outputs": len(program.outputs)}
    prepare = "\nEXPORT int prepare(const real *p, real *d)\n{\n    return prepare_0(p, d);\n}\n"
    along = _RECORD.format(**{name: max(1, size) for name, size in sizes.items()})
    return PREAMBLE + functions(program) + prepare + along
