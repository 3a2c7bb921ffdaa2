"""A program in machine code, for whole records that must be stepped. Importing this imports numba."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from mrdamper.tracing.expression import sign
from mrdamper.tracing.program import Program
from mrdamper.tracing.python import python_source
from mrdamper.tracing.tape import Table

_compile = njit(error_model="numpy")


def compiled_run(program: Program) -> Any:
    """`run(p, derived, memory, x, v, a, current, dt, force, flags)`: sample that failed, or −1.

    `memory` (M,), `force` and `flags` (N,) are written to.
    """
    step = compiled_step(program)
    size = len(program.tape.memory)

    @_compile
    def run(p, derived, memory, x, v, a, current, dt, force, flags):
        held = _as_tuple(memory)
        for i in range(x.size):
            status, out, held = step(p, derived, held, (x[i], v[i], a[i], current[i], dt[i]))
            if status != 0:
                return i
            force[i], flags[i] = out
        for j in range(size):
            memory[j] = held[j]
        return -1

    from numba.np.unsafe.ndarray import to_fixed_tuple

    @_compile
    def _as_tuple(memory):
        return to_fixed_tuple(memory, size)  # type: ignore[call-arg]

    return run


def compiled_step(program: Program) -> Any:
    """`step(p, derived, memory, inputs)`: (status, outputs, memory), all tuples."""
    room: dict[str, Any] = {"math": math, "sign": _compile(sign)}
    room |= {f"lookup{i}": _lookup(table) for i, table in enumerate(program.tape.tables)}
    exec(compile(python_source(program), "<traced model>", "exec"), room)  # our own words and numbers only
    return _compile(room["step"])


def _lookup(table: Table) -> Any:
    nodes, cells = np.array(table.nodes), np.array(table.cells)

    @_compile
    def at(x):
        cell = min(max(np.searchsorted(nodes, x, side="right") - 1, 0), cells.shape[0] - 1)
        t = (min(max(x, nodes[0]), nodes[-1]) - nodes[cell]) * cells[cell, 6]
        c = cells[cell]
        return c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))))

    return at
