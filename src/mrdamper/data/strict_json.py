"""JSON from anybody: what the format leaves to the reader is refused instead of guessed."""

from __future__ import annotations

import json
import math
from typing import Any, NoReturn

_MAX_DEPTH = 64  # objects and arrays inside each other
_MAX_DIGITS = 40  # characters of a whole number


def parse_json(text: str) -> Any:
    """Values of a JSON text.

    Raises `ValueError`, also for a key that stands twice, NaN and infinity, numbers beyond a double, whole numbers of
    more than forty digits, and nesting beyond 64.
    """
    try:
        value = json.loads(
            text, object_pairs_hook=_object, parse_constant=_refuse, parse_float=_number, parse_int=_whole
        )
    except json.JSONDecodeError as error:
        raise ValueError(f"not JSON at line {error.lineno}: {error.msg}") from error
    except RecursionError:
        raise ValueError(f"nested deeper than {_MAX_DEPTH}") from None
    if _depth(value) > _MAX_DEPTH:
        raise ValueError(f"nested deeper than {_MAX_DEPTH}")
    return value


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members = dict(pairs)
    if len(members) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"{next(n for n in names if names.count(n) > 1)!r:.60} stands twice")
    return members


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is no number")


def _number(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text:.20} is too large a number")
    return value


def _whole(text: str) -> int:
    if len(text) > _MAX_DIGITS:
        raise ValueError(f"a whole number of {len(text)} digits")
    return int(text)


def _depth(value: Any) -> int:
    """Level by level, so that depth costs no stack."""
    depth, level = 0, [value]
    while level:
        depth += 1
        inner = [v for v in level if isinstance(v, dict | list)]
        level = [part for v in inner for part in (v.values() if isinstance(v, dict) else v)]
    return depth
