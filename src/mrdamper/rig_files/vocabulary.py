"""Words, keys and units as laboratories write them, from `words.toml`; only here is a unit interpreted.

The field's units stand in a table, as a library of all units takes longer to import than
most files take to read; pint knows the rest.
"""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from types import MappingProxyType
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


@dataclass(frozen=True, slots=True)
class Unit:
    """Unit: SI value = factor * number + offset."""

    dimension: str  # "time", "length", "force", "velocity", ...
    factor: float
    offset: float = 0.0  # of temperatures [°C]


_UNITS = {
    name: Unit(dimension, *(factor if isinstance(factor, list) else [factor]))
    for dimension, units in TABLES["units"].items()
    for name, factor in units.items()
}


_WORDS = meanings("unit_names")


SI = MappingProxyType(
    {
        "time": "s", "displacement": "m", "force": "N", "velocity": "m/s", "acceleration": "m/s²", "current": "A",
        "voltage": "V", "temperature": "°C", "pressure": "Pa",
    }
)  # fmt: skip


DIMENSION = MappingProxyType({name: "length" if name == "displacement" else name for name in SI})  # of a channel


_PINT = {
    "[time]": "time", "[length]": "length", "[mass] * [length] / [time] ** 2": "force",
    "[length] / [time]": "velocity", "[length] / [time] ** 2": "acceleration", "[current]": "current",
    "[mass] * [length] ** 2 / [current] / [time] ** 3": "voltage",
}  # fmt: skip


_PLAIN = re.compile(r"[A-Za-zµμΩ°]{1,20}(?:\^?-?[1-4])?(?:[*/·⋅ ][A-Za-zµμΩ°]{1,20}(?:\^?-?[1-4])?){0,3}")


def parse_unit(text: str) -> Unit | None:
    """Return the unit a text states, None if it states none that is known."""
    return _parse(text) if len(text) <= 40 else None


def is_unit(text: str) -> bool:
    """Tell if a text is nothing but one of the field's units."""
    return len(text) <= 40 and _from_table(text) is not None


@lru_cache(maxsize=512)
def _parse(text: str) -> Unit | None:
    return _from_table(text) or _from_pint(text)


@lru_cache(maxsize=512)
def _from_table(text: str) -> Unit | None:
    text = _normal(text)
    text = _WORDS.get(text.lower(), text)
    if text in _UNITS:
        return _UNITS[text]
    if text.isupper() and text.isascii():  # some programs write all of a header in capitals
        same = [unit for name, unit in _UNITS.items() if name.upper() == text]
        return same[0] if same and all(unit == same[0] for unit in same) else None
    return None


def _normal(text: str) -> str:
    """One writing for the many of m/s²: m/s^2, m s-2, m_s2, m/s**2, m·s⁻²."""
    text = " ".join(text.strip().rstrip(".").split())
    for old, new in (("µ", "u"), ("μ", "u"), ("²", "2"), ("³", "3"), ("⁻¹", "-1"), ("⁻", "-"), ("**", "^"), ("º", "°")):
        text = text.replace(old, new)
    text = text.replace("^", "").replace("_per_", "/").replace(" per ", "/").replace("° ", "°")
    if "/" not in text:
        text = re.sub(r"^([A-Za-z]{1,2})[ ·⋅*.]?s-([12])$", lambda m: f"{m[1]}/s{m[2].replace('1', '')}", text)
        text = re.sub(r"^([a-z]{1,2})_s([2]?)$", r"\1/s\2", text)
    return re.sub(r"/s/s$", "/s2", re.sub(r"(?i)/sec", "/s", re.sub(r"\s*/\s*", "/", text)))


def _from_pint(text: str) -> Unit | None:
    if not _PLAIN.fullmatch(text) or len(text) < 2:
        return None
    import pint

    try:
        quantity = _registry().Quantity(1.0, text).to_base_units()
    except (pint.errors.PintError, ValueError, TypeError, KeyError, AttributeError, ArithmeticError, SyntaxError):
        return None
    dimension = _PINT.get(str(quantity.dimensionality), str(quantity.dimensionality))
    return Unit(dimension, float(quantity.magnitude))


@lru_cache(maxsize=1)
def _registry():
    import pint

    return pint.UnitRegistry(cache_folder=None)
