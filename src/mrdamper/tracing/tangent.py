"""Forward tangents: derivatives of a traced program along some of its parameters, in the same pass.

Every operation on the tape is followed by its derivative, and every memory that depends on a parameter has a
derivative that is remembered beside it. Where a function has a corner the derivative is that of the branch taken.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mrdamper.tracing.expression import Expression, TraceError
from mrdamper.tracing.program import postorder
from mrdamper.tracing.tape import Tape, TracedLoop

# Derivative by the argument a, given the value y of the operation.
_BY_ARGUMENT: Mapping[str, Callable[[Any, Any], Any]] = {
    "negative": lambda a, y: -1.0,
    "sqrt": lambda a, y: 0.5 / y,
    "exp": lambda a, y: y,
    "expm1": lambda a, y: y + 1.0,
    "log": lambda a, y: 1.0 / a,
    "log1p": lambda a, y: 1.0 / (1.0 + a),
    "tan": lambda a, y: 1.0 + y * y,
    "arctan": lambda a, y: 1.0 / (1.0 + a * a),
    "tanh": lambda a, y: 1.0 - y * y,
    "arctanh": lambda a, y: 1.0 / (1.0 - a * a),
}
_FLAT = frozenset({"sign", "input"})


def with_tangents(tape: Tape, output: Any, along: Sequence[str]) -> dict[str, Any]:
    """Write the derivatives of an output by parameters on its tape; all of them by name, the output first.

    Raises
    ------
    TraceError
        If an operation has no derivative here: loops and tables.
    """
    every = postorder([output, *tape.updates.values()])
    if any(isinstance(node, TracedLoop) for node in every):
        raise TraceError("a loop has no derivative here")
    nodes = [node for node in every if not node.logical]
    updates = dict(tape.updates)
    outputs = {"value": output}
    for name in along:
        moving = _moving(nodes, updates, name)
        slopes: dict[int, Any] = {id(tape.parameters[name]): 1.0}
        held = {m: tape.remember(f"{m}_by_{name}") for m, value in updates.items() if id(value) in moving}
        slopes |= {id(tape.memory[m]): slope for m, slope in held.items()}
        for node in nodes:
            if id(node) in moving and id(node) not in slopes:
                slopes[id(node)] = _slope(tape, node, slopes)
        for memory, slope in held.items():
            tape.update(slope, slopes[id(updates[memory])])
        outputs[name] = slopes.get(id(output), 0.0)
    return outputs


def _moving(nodes: Sequence[Expression], updates: Mapping[str, Any], name: str) -> set[int]:
    """Expressions that depend on a parameter, through memory too."""
    moving: set[int] = set()
    remembered: set[str] = set()
    while True:
        for node in nodes:
            depends = node.name == name if node.op == "parameter" else node.op == "memory" and node.name in remembered
            if depends or (node.op not in _FLAT and any(id(part) in moving for part in node.args)):
                moving.add(id(node))
        now = {memory for memory, value in updates.items() if id(value) in moving}
        if now == remembered:
            return moving
        remembered = now


def _slope(tape: Tape, node: Expression, slopes: Mapping[int, Any]) -> Any:
    """Differentiate an operation, given the derivatives of its arguments; zeros are left out."""
    parts = [slopes.get(id(part), 0.0) for part in node.args]
    if node.op == "select":
        return tape.select(node.args[0], parts[1], parts[2])
    if node.op in _BY_ARGUMENT:
        return _times(parts[0], _BY_ARGUMENT[node.op](node.args[0], node))
    if node.op == "absolute":
        return tape.select(node.args[0] < 0.0, _times(parts[0], -1.0), parts[0])
    if len(parts) != 2:
        raise TraceError(f"{node.op} has no derivative here")
    (a, b), (da, db) = node.args, parts
    if node.op == "add":
        return _plus(da, db)
    if node.op == "subtract":
        return _minus(da, db)
    if node.op == "multiply":
        return _plus(_times(da, b), _times(db, a))
    if node.op == "divide":
        return _minus(da, _times(db, node)) * (1.0 / b)  # one division for all that is differentiated by it
    if node.op == "minimum":
        return tape.select(a < b, da, db)
    if node.op == "maximum":
        return tape.select(a > b, da, db)
    if node.op == "power":
        by_exponent = _times(db, node * np.log(a)) if isinstance(b, Expression) else 0.0
        return _plus(_times(da, node * b / a), by_exponent)
    raise TraceError(f"{node.op} has no derivative here")


def _plus(a: Any, b: Any) -> Any:
    zero = [isinstance(value, float) and value == 0.0 for value in (a, b)]
    return b if zero[0] else a if zero[1] else a + b


def _minus(a: Any, b: Any) -> Any:
    zero = [isinstance(value, float) and value == 0.0 for value in (a, b)]
    return a if zero[1] else -b if zero[0] else a - b


def _times(a: Any, b: Any) -> Any:
    return 0.0 if isinstance(a, float) and a == 0.0 else a * b
