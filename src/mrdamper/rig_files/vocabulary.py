"""Words, keys and units as laboratories write them, from `words.toml`."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

TABLES: Mapping[str, Any] = tomllib.loads(files("mrdamper.rig_files").joinpath("words.toml").read_text("utf-8"))
KEYS: Mapping[str, Sequence[str]] = TABLES["keys"]


def words(kind: str) -> frozenset[str]:
    """Return the words of a kind: coil, computed, run, ..."""
    return frozenset(TABLES["words"][kind])


def meanings(table: str) -> dict[str, str]:
    """Return what each word of a table stands for."""
    return {word: meaning for meaning, of in TABLES[table].items() for word in of}
