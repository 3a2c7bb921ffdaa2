"""Expressions, by which array code runs on symbols instead of arrays.

An `Expression` represents one number at one sample; Python's operators and NumPy's functions record their operations on
it. Where its value for the present model is known, an expression contains it, so that conditions on parameters ("is
this width positive?") can be evaluated while tracing; the result is kept as a guard, because the program is valid for
that result only. A condition on the motion has no value while tracing and is refused: it must be written as a choice
(`choose`, `numpy.where`).
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

CONSTANT, PARAMETER, SAMPLE = 0, 1, 2  # stage at which a value is known: always, with the parameters, at each sample


class TraceError(TypeError):
    """Code of a model that cannot be converted to a program: an internal error."""


class Traced:
    """Objects that replace arrays in a traced function."""

    tape: Any  # the `Tape` that made it


def sign(x: float) -> float:
    """−1, 0 or 1."""
    return 1.0 if x > 0 else (-1.0 if x < 0 else 0.0)


_Value = Callable[[Any], Any] | Callable[[Any, Any], Any]  # of an operation on floats
_LOGICAL: dict[str, _Value] = {
    "less": operator.lt,
    "less_equal": operator.le,
    "greater": operator.gt,
    "greater_equal": operator.ge,
    "equal": operator.eq,
    "not_equal": operator.ne,
    "logical_and": lambda a, b: bool(a) and bool(b),
    "logical_or": lambda a, b: bool(a) or bool(b),
    "logical_not": operator.not_,
    "isfinite": math.isfinite,
}
OPERATIONS: dict[str, _Value] = {
    "add": operator.add,
    "subtract": operator.sub,
    "multiply": operator.mul,
    "divide": lambda a, b: a / b,
    "power": math.pow,
    "negative": operator.neg,
    "absolute": abs,
    "sign": sign,
    **{name: getattr(math, name) for name in ("sqrt", "exp", "expm1", "log", "log1p", "tan", "tanh")},
    "arctan": math.atan,
    "arctanh": math.atanh,
    "minimum": lambda a, b: a if a < b else b,
    "maximum": lambda a, b: a if a > b else b,
    **_LOGICAL,
}
_NUMPY: tuple[type[Any], ...] = (np.ndarray, np.generic)
_ALIASES = {"true_divide": "divide", "bitwise_and": "logical_and", "bitwise_or": "logical_or", "invert": "logical_not"}


class Expression(NDArrayOperatorsMixin, Traced):
    """One number at one sample, made by a `Tape`. Its operators are NumPy's functions.

    `op` is an operation, or "parameter", "input", "memory", "select", "carry", "result"; `args` are expressions and
    floats. `stage` states when it is known: CONSTANT, PARAMETER or SAMPLE. `value` is that for the present model, where
    it is known while tracing.
    """

    __slots__ = ("args", "name", "op", "stage", "tape", "value")

    def __init__(self, tape: Any, op: str, args: tuple[Any, ...], stage: int, value: Any = None, name: str = ""):
        self.tape, self.op, self.args, self.stage, self.value, self.name = tape, op, args, stage, value, name

    def __repr__(self) -> str:
        def short(part: Any) -> str:
            return (part.name or f"{part.op}(...)") if isinstance(part, Expression) else repr(part)

        return self.name or f"{self.op}({', '.join(map(short, self.args))})"

    @property
    def logical(self) -> bool:
        """True if its value is true or false."""
        return self.op in _LOGICAL

    def __bool__(self) -> bool:
        if self.value is None:
            raise TraceError(f"{self!r} differs from sample to sample: write the branch with choose or numpy.where")
        return self.tape.settle(self)

    def __float__(self) -> float:
        raise TraceError(f"{self!r} is turned into a plain number; use NumPy's functions, not math's")

    __hash__ = object.__hash__  # type: ignore[assignment]

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        name = _ALIASES.get(ufunc.__name__, ufunc.__name__)
        if name == "clip":
            return _clip(*inputs)
        written = options.pop("out", inputs)[0]  # a *= b writes into a, and binds a to the result
        if method != "__call__" or options or written is not inputs[0] or name not in OPERATIONS:
            raise TraceError(f"numpy.{ufunc.__name__} has no scalar form here; add it to OPERATIONS")
        return self.tape.apply(name, *(plain(value) for value in inputs))

    def __array_function__(
        self, func: Callable[..., Any], types: Iterable[type], args: tuple[Any, ...], options: dict[str, Any]
    ) -> Any:
        if func is np.where and len(args) == 3:
            return self.tape.select(*args)
        if func is np.clip:
            return _clip(*args)
        if func is np.all:
            return args[0]
        raise TraceError(f"numpy.{func.__name__} has no scalar form here")


def plain(value: Any) -> Any:
    """Return the number in a NumPy scalar or in an array of one element."""
    return value.item() if isinstance(value, _NUMPY) and np.ndim(value) == 0 else value


def choose(condition: Any, then: Callable[[], Any], otherwise: Callable[[], Any]) -> Any:
    """`then()` if the condition holds, `otherwise()` if not: a branch for floats and for expressions alike."""
    if isinstance(condition, Expression):
        return condition.tape.select(condition, then(), otherwise())
    return then() if condition else otherwise()


def settled(value: Any) -> Any:
    """Return the present number: the program is valid for this value only."""
    if not isinstance(value, Expression):
        return value
    if value.value is None:
        raise TraceError(f"{value!r} differs from sample to sample")
    return value.value if value == value.value else None


def _clip(value: Any, low: Any, high: Any) -> Any:
    if not (isinstance(low, float | int) and low == -math.inf):
        value = np.maximum(value, low)
    if not (isinstance(high, float | int) and high == math.inf):
        value = np.minimum(value, high)
    return value
