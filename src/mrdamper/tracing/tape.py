"""Tape that records a traced model: inputs, parameters, memory, and every operation once.

`streamed` gives a function of whole arrays its form for one sample. With arrays the function runs unchanged; with
expressions it records its step on the tape: its memory from sample to sample, and how it changes. A model is thus
written once, for arrays, and exported from the same code.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from functools import reduce, wraps
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from mrdamper.tracing.expression import CONSTANT, OPERATIONS, PARAMETER, SAMPLE, Expression, Traced, TraceError, plain

Floats = NDArray[np.float64]
F = TypeVar("F", bound=Callable[..., Any])
_GROUP: type[Any] = tuple
_WITH_INFINITY = ("less", "less_equal", "greater", "greater_equal")
_NEUTRAL = {"add": (0, 0), "subtract": (None, 0), "multiply": (1, 1), "divide": (None, 1)}  # left and right operand
_UNROLLED = 6  # highest integer power written as products


class LookupTable(Protocol):
    """Piecewise polynomials of a traced lookup."""

    nodes: Floats  # (K,) ends of the pieces
    cells: Floats  # (K − 1, 7): six coefficients, lowest first, and one over the width
    points: Floats  # (K, 4): u, w, dw/du and the derivative of that with respect to w, at the nodes
    backwards: bool  # the table is u over w, not w over u

    def at_float(self, x: float) -> float:
        """Evaluate the table at x; constant beyond the ends."""
        ...


class TracedLoop:
    """A bounded loop: its variables change until the condition fails.

    The first `still` of them determine its step sizes and have no derivative: a step of given size is differentiated.
    """

    def __init__(self, start: Sequence[Any], most: int, still: int = 0):
        self.start, self.most, self.still = tuple(start), most, still
        self.going: Any = None
        self.updates: tuple[Any, ...] = ()


class Tape:
    """Record of the operations of traced code."""

    def __init__(self) -> None:
        # in the order they appeared
        self.parameters: dict[str, Expression] = {}
        self.inputs: dict[str, Expression] = {}
        self.memory: dict[str, Expression] = {}
        self.starts: dict[str, float] = {}
        self.updates: dict[str, Any] = {}  # value of each memory after the sample
        self.guards: list[tuple[Expression, bool]] = []  # conditions evaluated while tracing, and their values
        self.tables: list[LookupTable] = []
        self._known: dict[tuple[Any, ...], Expression] = {}
        self._previous: dict[int, Any] = {}

    def parameter(self, name: str, value: float) -> Expression:
        """Add a number that is set before the first sample."""
        self.parameters[name] = Expression(self, "parameter", (), PARAMETER, value, name)
        return self.parameters[name]

    def input(self, name: str, example: float | None = None) -> Expression:
        """Add an input of every sample; an example value is used for conditions on its range."""
        self.inputs[name] = Expression(self, "input", (), SAMPLE, example, name)
        return self.inputs[name]

    def remember(self, name: str, start: float = 0.0) -> Expression:
        """Add a memory value, kept from one sample to the next."""
        name = self._free(name)
        self.memory[name] = Expression(self, "memory", (), SAMPLE, None, name)
        self.starts[name] = start
        return self.memory[name]

    def update(self, memory: Expression, value: Any) -> None:
        """Set the value a memory takes after the sample."""
        self.updates[memory.name] = value

    @property
    def first(self) -> Expression:
        """True at the first sample."""
        if "started" not in self.memory:
            self.update(self.remember("started"), 1.0)
        return self.memory["started"] < 0.5

    def previous(self, value: Any, name: str) -> Any:
        """Return an expression's value at the sample before; at the first sample, its value there."""
        if not isinstance(value, Expression):
            return value
        if id(value) not in self._previous:
            held = self.remember(f"last_{name}")
            self.update(held, value)
            self._previous[id(value)] = self.select(self.first, value, held)
        return self._previous[id(value)]

    def assume(self, value: Any, example: float) -> Any:
        """Give an expression an example value for conditions on its range."""
        value.value = example
        return value

    def settle(self, question: Expression) -> bool:
        """Evaluate a condition with the present value, and keep the result."""
        answer = bool(question.value)
        if not any(guard is question for guard, _ in self.guards):
            self.guards.append((question, answer))
        return answer

    def require(self, question: Any) -> None:
        """Add a condition that must hold at every sample; the program reports violations."""
        if isinstance(question, Expression):
            self.guards.append((question, True))

    def apply(self, op: str, *args: Any) -> Any:
        """Record an operation once; small integer powers as products."""
        args = tuple(plain(a) for a in args)
        if op == "power" and isinstance(args[1], int | float) and args[1] in range(_UNROLLED + 1):
            return reduce(operator.mul, [args[0]] * int(args[1])) if args[1] else 1.0
        if (simple := _simplified(op, args)) is not None:
            return simple
        return self._note(op, args)

    def select(self, condition: Any, then: Any, otherwise: Any) -> Any:
        """Select one of two values; only the selected one is computed."""
        then, otherwise = plain(then), plain(otherwise)
        if not isinstance(condition, Expression):
            return then if condition else otherwise
        return self._note("select", (condition, then, otherwise))

    def lookup(self, table: LookupTable, x: Any) -> Expression:
        """Value of a table at an expression."""
        indices = [i for i, other in enumerate(self.tables) if other is table]
        if not indices:
            self.tables.append(table)
        return self._note("lookup", (indices[0] if indices else len(self.tables) - 1, x))

    def loop(
        self, start: Sequence[Any], body: Callable[..., tuple[Any, Sequence[Any]]], most: int, still: int = 0
    ) -> tuple[Expression, ...]:
        """Repeat `body(*carried) -> (whether to continue, new values)` with a largest number of repetitions."""
        loop = TracedLoop([plain(value) for value in start], most, still)
        loop.going, updates = body(*(Expression(self, "carry", (loop, i), SAMPLE) for i in range(len(loop.start))))
        loop.updates = tuple(plain(value) for value in updates)
        return tuple(Expression(self, "result", (loop, i), SAMPLE) for i in range(len(loop.start)))

    def _note(self, op: str, args: tuple[Any, ...]) -> Expression:
        for arg in args:
            if not isinstance(arg, Expression | float | int):
                raise TraceError(f"{type(arg).__name__} in {op}")
        key = (op, *(("#", float(a)) if not isinstance(a, Expression) else id(a) for a in args))
        if key not in self._known:
            stage = max((a.stage for a in args if isinstance(a, Expression)), default=CONSTANT)
            self._known[key] = Expression(self, op, args, stage, _value(op, args))
        return self._known[key]

    def _free(self, name: str) -> str:
        taken = self.memory.keys() | self.parameters.keys() | self.inputs.keys()
        if name not in taken:
            return name
        return next(f"{name}_{i}" for i in range(2, 1000) if f"{name}_{i}" not in taken)


def streamed(step: Callable[..., Any]) -> Callable[[F], F]:
    """Give a function of arrays its form for one sample.

    `step`, a function of (tape, *arguments), records memory and operations of a sample and returns the value there.
    """

    def decorate(of_arrays: F) -> F:
        @wraps(of_arrays)
        def either(*args: Any, **options: Any) -> Any:
            for arg in args:
                one = arg[0] if isinstance(arg, _GROUP) and arg else arg
                if isinstance(one, Traced):
                    return step(one.tape, *args, **options)
            return of_arrays(*args, **options)

        return either  # type: ignore[return-value]

    return decorate


def _simplified(op: str, args: tuple[Any, ...]) -> Any:
    """Neutral elements x + 0, x · 1, x / 1; comparisons with infinity, which are true for all finite numbers."""
    if op in _WITH_INFINITY and isinstance(args[1], float) and math.isinf(args[1]):
        return _value(op, (0.0, args[1]))
    if op == "logical_and" and not isinstance(args[0], Expression):
        return args[1] if args[0] else False
    left, right = _NEUTRAL.get(op, (None, None))
    if left is not None and isinstance(args[0], float | int) and args[0] == left:
        return args[1]
    if right is not None and isinstance(args[1], float | int) and args[1] == right:
        return args[0]
    return None


def _value(op: str, args: tuple[Any, ...]) -> Any:
    """Value for the present model, where every argument has one."""
    values = [a.value if isinstance(a, Expression) else a for a in args]
    if op == "select":
        return values[1 if values[0] else 2] if values[0] is not None else None
    if op == "lookup" or any(v is None for v in values):
        return None
    try:
        return OPERATIONS[op](*values)
    except (ValueError, OverflowError, ZeroDivisionError):
        return None
