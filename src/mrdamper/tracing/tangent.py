"""Forward tangents: derivatives of a traced program along some of its parameters, in the same pass.

Every operation on the tape is followed by its derivative, and every memory and loop variable that depends on a
parameter has a derivative, except those that determine the step sizes of a loop. At a kink the derivative is that of
the branch taken.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mrdamper.tracing.expression import SAMPLE, Expression, TraceError
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
_TINY = 1e-300


def with_tangents(tape: Tape, output: Any, along: Sequence[str]) -> dict[str, Any]:
    """Write the derivatives of an output by parameters on its tape; all of them by name, the output first.

    Loops carry the derivatives of their variables. Raises `TraceError` if an operation has no derivative here: tables.
    """
    nodes = postorder([output, *tape.updates.values()])
    updates = dict(tape.updates)
    loops = {id(node): (node.start, node.updates) for node in nodes if isinstance(node, TracedLoop)}
    outputs = {"value": output}
    for name in along:
        moving = _moving(nodes, updates, loops, name)
        slopes: dict[int, Any] = {id(tape.parameters[name]): 1.0}
        held = {m: tape.remember(f"{m}_by_{name}") for m, value in updates.items() if id(value) in moving}
        slopes |= {id(tape.memory[m]): slope for m, slope in held.items()}
        opened: dict[int, dict[int, int]] = {}  # by loop: place of the derivative of each loop variable
        for node in nodes:
            if isinstance(node, TracedLoop):
                _, after = loops[id(node)]
                node.updates = (*node.updates, *(slopes.get(id(after[i]), 0.0) for i in opened.get(id(node), ())))
            elif id(node) not in moving or id(node) in slopes:
                continue
            elif node.op in ("carry", "result"):
                loop, place = node.args
                if id(loop) not in opened:
                    opened[id(loop)] = _open(loop, *loops[id(loop)], moving, slopes)
                slopes[id(node)] = Expression(tape, node.op, (loop, opened[id(loop)][place]), SAMPLE)
            else:
                slopes[id(node)] = _slope(tape, node, slopes)
        for memory, slope in held.items():
            tape.update(slope, slopes.get(id(updates[memory]), 0.0))
        outputs[name] = slopes.get(id(output), 0.0)
    return outputs


def derivatives(tape: Tape, values: Sequence[Any], by: Any) -> list[Any]:
    """Write the derivatives of values by one expression that they are computed from."""
    slopes: dict[int, Any] = {id(by): 1.0}
    for node in postorder(list(values)):
        differs = isinstance(node, Expression) and not node.logical and node.op not in _FLAT
        if differs and id(node) not in slopes and any(id(part) in slopes for part in node.args):
            slopes[id(node)] = _slope(tape, node, slopes)
    return [slopes.get(id(value), 0.0) for value in values]


def _moving(
    nodes: Sequence[Any],
    updates: Mapping[str, Any],
    loops: Mapping[int, tuple[Sequence[Any], Sequence[Any]]],
    name: str,
) -> set[int]:
    """Return expressions that depend on a parameter, also through memory and loops."""
    moving: set[int] = set()

    def depends(node: Expression) -> bool:
        if node.op == "parameter":
            return node.name == name
        if node.op == "memory":
            return id(updates.get(node.name)) in moving
        if node.op in ("carry", "result"):
            loop, place = node.args
            return place >= loop.still and any(id(values[place]) in moving for values in loops[id(loop)])
        return not node.logical and node.op not in _FLAT and any(id(part) in moving for part in node.args)

    before = -1
    while len(moving) > before:
        before = len(moving)
        for node in nodes:
            if id(node) not in moving and isinstance(node, Expression) and depends(node):
                moving.add(id(node))
    return moving


def _open(
    loop: TracedLoop, start: Sequence[Any], updates: Sequence[Any], moving: set[int], slopes: Mapping[int, Any]
) -> dict[int, int]:
    """Add derivatives to the variables of a loop, from those of its start; return their places."""
    moved = [i for i in range(loop.still, len(start)) if {id(start[i]), id(updates[i])} & moving]
    places = {place: len(loop.start) + k for k, place in enumerate(moved)}
    loop.start = (*loop.start, *(slopes.get(id(start[i]), 0.0) for i in moved))
    return places


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
        positive = np.maximum(a, _TINY)  # of a power of zero they are zero
        by_exponent = _times(db, node * np.log(positive)) if isinstance(b, Expression) else 0.0
        return _plus(_times(da, node * b / positive), by_exponent)
    raise TraceError(f"{node.op} has no derivative here")


def _plus(a: Any, b: Any) -> Any:
    zero = [isinstance(value, float) and value == 0.0 for value in (a, b)]
    return b if zero[0] else a if zero[1] else a + b


def _minus(a: Any, b: Any) -> Any:
    zero = [isinstance(value, float) and value == 0.0 for value in (a, b)]
    return a if zero[1] else -b if zero[0] else a - b


def _times(a: Any, b: Any) -> Any:
    return 0.0 if isinstance(a, float) and a == 0.0 else a * b
