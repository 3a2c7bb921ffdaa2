"""Words, keys and units as laboratories write them, from `words.toml`."""

from __future__ import annotations

import tomllib
import unicodedata
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

TABLES: Mapping[str, Any] = tomllib.loads(files("mrdamper.rig_files").joinpath("words.toml").read_text("utf-8"))
KEYS: Mapping[str, Sequence[str]] = TABLES["keys"]

_LETTERS = str.maketrans("łøıđß", "loids")
_FEWEST_LETTERS = 4  # of a word that is known without its accents: cas is another word than čas


def words(kind: str) -> frozenset[str]:
    """Return the words of a kind: coil, computed, run, ..."""
    return frozenset(TABLES["words"][kind])


def meanings(table: str) -> dict[str, str]:
    """Return what each word of a table stands for, also where it is written without its accents: prad, forta."""
    own = {word: meaning for meaning, of in TABLES[table].items() for word in of}
    plain = {_without_accents(word): meaning for word, meaning in own.items()}
    return {word: meaning for word, meaning in plain.items() if len(word) >= _FEWEST_LETTERS} | own


def _without_accents(word: str) -> str:
    return "".join(sign for sign in unicodedata.normalize("NFKD", word.translate(_LETTERS)) if sign.isascii())
