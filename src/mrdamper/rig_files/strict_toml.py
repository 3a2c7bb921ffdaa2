"""TOML that people write: short, and no name of many parts, for which the standard reader takes minutes."""

from __future__ import annotations

import re
import tomllib
from typing import Any

_LONGEST = 200_000  # characters; the profiles of the documentation have under 3,000
_DOTTED = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++\s*+\.\s*+){17}""")  # ours have two parts


def read_toml(text: str) -> dict[str, Any]:
    r"""A TOML document.

    Raises
    ------
    tomllib.TOMLDecodeError
        If it is none, too long or nested too deeply.

    Examples
    --------
    >>> read_toml("[channels.force]\nsign = -1")
    {'channels': {'force': {'sign': -1}}}
    """
    if len(text) > _LONGEST:
        raise tomllib.TOMLDecodeError(f"{len(text):,} characters; at most {_LONGEST:,}")
    if _DOTTED.search(text):
        raise tomllib.TOMLDecodeError("a name of more than 16 parts between dots")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise tomllib.TOMLDecodeError("nested too deeply") from None
    except ValueError as error:  # an integer of thousands of digits
        raise tomllib.TOMLDecodeError(str(error)) from error
