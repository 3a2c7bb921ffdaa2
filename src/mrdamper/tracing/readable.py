"""Algebra that makes an equation short without changing its value, for tapes that are to be read.

Programs do without: there, the order of operations is the one the model was written in.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mrdamper.tracing.expression import Expression

Apply = Callable[..., Any]


def shorter(apply: Apply, op: str, args: tuple[Any, ...]) -> Any:
    """A shorter form of an operation, or None."""
    rule = _RULES.get(op)
    return rule(apply, *args) if rule else None


def _is(value: Any, number: float) -> bool:
    return not isinstance(value, Expression) and value == number


def _made_by(value: Any, op: str) -> bool:
    return isinstance(value, Expression) and value.op == op


def _inverse(value: Any) -> Any:
    """What 1 is divided by, if it is; else None."""
    return value.args[1] if _made_by(value, "divide") and _is(value.args[0], 1) else None


def _add(apply: Apply, a: Any, b: Any) -> Any:
    if a is b:
        return apply("multiply", 2.0, a)
    if not isinstance(b, Expression) and b < 0:
        return apply("subtract", a, -b)
    return None


def _subtract(apply: Apply, a: Any, b: Any) -> Any:
    return 0.0 if a is b else None


def _multiply(apply: Apply, a: Any, b: Any) -> Any:
    if _is(a, 0) or _is(b, 0):
        return 0.0
    if _is(a, -1):
        return apply("negative", b)
    if not isinstance(a, Expression) and _made_by(b, "multiply") and not isinstance(b.args[0], Expression):
        return apply("multiply", a * b.args[0], b.args[1])
    if isinstance(a, Expression) and a is b:
        return apply("power", a, 2.0)
    if _made_by(b, "power") and a is b.args[0] and not isinstance(b.args[1], Expression):
        return apply("power", a, b.args[1] + 1.0)
    if isinstance(a, Expression) and _made_by(b, "multiply") and a is b.args[0]:
        return apply("multiply", apply("power", a, 2.0), b.args[1])
    if _made_by(a, "divide") and _made_by(b, "multiply") and a.args[1] is b.args[0]:
        return apply("multiply", a.args[0], b.args[1])
    if (under := _inverse(a)) is not None:
        return apply("divide", b, under)
    if (under := _inverse(b)) is not None:
        return apply("divide", a, under)
    return None


def _divide(apply: Apply, a: Any, b: Any) -> Any:
    if _is(a, 0):
        return 0.0
    if (under := _inverse(b)) is not None:
        return apply("multiply", a, under)
    if _made_by(b, "power") and (under := _inverse(b.args[0])) is not None:
        return apply("multiply", a, apply("power", under, b.args[1]))
    return None


def _power(apply: Apply, base: Any, exponent: Any) -> Any:
    if _is(exponent, 1):
        return base
    if _is(exponent, 0):
        return 1.0
    if _is(exponent, 0.5):
        return apply("sqrt", base)
    return None


def _sqrt(apply: Apply, a: Any) -> Any:
    if _made_by(a, "divide") and _is(a.args[0], 1):
        return apply("divide", 1.0, apply("sqrt", a.args[1]))
    if _made_by(a, "power") and _is(a.args[1], 2) and isinstance(a.args[0].value, float) and a.args[0].value > 0:
        return a.args[0]
    return None


def _negative(apply: Apply, a: Any) -> Any:
    return apply("subtract", a.args[1], a.args[0]) if _made_by(a, "subtract") else None


def _expm1(apply: Apply, a: Any) -> Any:
    return apply("subtract", apply("exp", a), 1.0)


_RULES: dict[str, Callable[..., Any]] = {
    "add": _add,
    "subtract": _subtract,
    "multiply": _multiply,
    "divide": _divide,
    "power": _power,
    "sqrt": _sqrt,
    "negative": _negative,
    "expm1": _expm1,
}
