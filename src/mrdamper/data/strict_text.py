"""Strict reading of files and texts from other sources.

JSON is unambiguous; TOML is short and has no name of many parts, for which the standard reader takes minutes. A file is
opened without waiting for a writer, and has an end.
"""

from __future__ import annotations

import errno
import json
import math
import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any, BinaryIO, NoReturn, TypeGuard

from mrdamper.errors import InputError

STRICT = {"extra": "forbid", "allow_inf_nan": False}  # of dataclasses that pydantic reads from a file
_MAX_DEPTH = 64  # objects and arrays inside each other
_MAX_DIGITS = 40  # characters of a whole number
_LONGEST = 200_000  # characters; the profiles of the documentation have under 3,000
_TABLE: type[Any] = dict
_NESTED: tuple[type[Any], ...] = (dict, list)
_DOTTED = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++\s*+\.\s*+){17}""")  # those of this package have two parts


def open_regular(path: Path) -> BinaryIO:
    """Open a file for reading bytes without waiting; raises `OSError` also for a pipe, a socket or a device."""
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise OSError(errno.EINVAL, "not a regular file", str(path))
    return os.fdopen(handle, "rb")


def content_of(path: Path, largest: int, refuse: type[InputError], kind: str) -> bytes:
    """Return the bytes of a file that should be `kind` ("a CSV file"); raises `refuse` if unreadable or too large."""
    try:
        with open_regular(path) as file:
            content = file.read(largest + 1)
    except (OSError, ValueError) as error:  # also a name that no file can have
        reason = getattr(error, "strerror", None) or str(error)
        raise refuse(reason, where=str(path), remedy=f"give {kind}") from error
    if len(content) > largest:
        raise refuse(f"over {largest // 1000:,} kB", where=str(path), remedy=f"give {kind}")
    return content


def parse_json(text: str) -> Any:
    """Values of a JSON text.

    Raises `ValueError`, also for a repeated key, NaN and infinity, numbers beyond a double, whole numbers of more than
    forty digits, and nesting beyond 64.
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
    """Level by level, without recursion."""
    depth, level = 0, [value]
    while level:
        depth += 1
        inner = [v for v in level if isinstance(v, _NESTED)]
        level = [part for v in inner for part in (v.values() if isinstance(v, _TABLE) else v)]
    return depth


def is_table(value: object) -> TypeGuard[dict[str, Any]]:
    """Tell if a value that was read is an object of JSON, or a table of TOML."""
    return isinstance(value, dict)


def read_toml(text: str) -> dict[str, Any]:
    """Return a TOML document; raises `tomllib.TOMLDecodeError` if it is none, too long or nested too deeply."""
    if len(text) > _LONGEST:
        raise tomllib.TOMLDecodeError(f"{len(text):,} characters; at most {_LONGEST:,}")
    if _DOTTED.search(text):
        raise tomllib.TOMLDecodeError("a name of more than 16 parts between dots")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise tomllib.TOMLDecodeError("nested too deeply") from None
    except ValueError as error:  # also an integer of thousands of digits
        raise tomllib.TOMLDecodeError(str(error)) from error
