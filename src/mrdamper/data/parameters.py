"""`param()`: a model parameter's unit, bounds, scale and meaning, defined once, on the field.

Fitting, the command line, reports, exports and the documentation use the field.
"""

from __future__ import annotations

import math
import numbers
import re
from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from functools import cache
from typing import Any, Literal, TypeVar

from mrdamper.errors import ParameterError

Scale = Literal["linear", "log"]
T = TypeVar("T")
_KEY = "mrdamper.parameter"


@dataclass(frozen=True, slots=True)
class ParameterInfo:
    """Description of one parameter."""

    # name, unit, meaning: field name, SI unit, one phrase
    name: str
    unit: str
    meaning: str
    bounds: tuple[float, float]  # physical limits [unit]; searches stay inside them
    scale: Scale  # "linear" or "log"; scale on which a search moves
    linear: bool  # the force is linear in it, so it is solved for instead of searched
    preset: bool  # held at its default unless the user frees it
    default: float | None  # value when none is given
    symbol: str  # letter in equations, as LaTeX


def param(
    unit: str,
    meaning: str,
    *,
    bounds: tuple[float, float] = (-math.inf, math.inf),
    scale: Scale = "linear",
    linear: bool = False,
    preset: bool = False,
    default: float | None = None,
    symbol: str = "",
) -> Any:
    """Declare a model parameter as a dataclass field (see `ParameterInfo`); its symbol is by default from the name."""
    facts = dict(unit=unit, meaning=meaning, bounds=bounds, scale=scale, linear=linear, preset=preset, symbol=symbol)
    metadata = {_KEY: facts}
    if default is None:
        return field(metadata=metadata)
    return field(default=default, metadata=metadata)


def is_number(value: object) -> bool:
    """Tell if a value is a single real number, or an expression while code is traced."""
    if isinstance(value, bool):
        return False
    return isinstance(value, numbers.Real) or hasattr(value, "tape")


@cache
def parameters_of(owner: type) -> tuple[ParameterInfo, ...]:
    """Parameters of a model class, in the order they were declared."""
    return tuple(_info(f) for f in fields(owner) if _KEY in f.metadata)


def with_values(kind: type[T], values: Mapping[str, float]) -> T:
    """Make an object with some parameters set; raises `ParameterError` for an unknown, missing or forbidden one."""
    infos = {info.name: info for info in parameters_of(kind)}
    for name, value in values.items():
        if name not in infos:
            raise ParameterError(
                f"no parameter {name!r}", where=kind.__name__, remedy=f"known: {', '.join(infos) or 'none'}"
            )
        low, high = infos[name].bounds
        if not low <= value <= high:
            raise ParameterError(
                f"{name} = {value:g} {infos[name].unit}", where=kind.__name__, remedy=f"give {low:g} to {high:g}"
            )
    missing = [name for name, info in infos.items() if info.default is None and name not in values]
    if missing:
        raise ParameterError(f"no {', '.join(missing)}", where=kind.__name__, remedy="give it")
    return kind(**values)


def _info(f: Field[Any]) -> ParameterInfo:
    default = None if f.default is MISSING else float(f.default)
    facts: dict[str, Any] = {**f.metadata[_KEY], "name": f.name, "default": default}
    facts["symbol"] = facts["symbol"] or latex_symbol(f.name)
    return ParameterInfo(**facts)


_GREEK = (
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "kappa", "lambda", "mu", "rho", "sigma", "tau", "phi",
    "omega",
)  # fmt: skip


_WORDS = {"yield_force": "Fz", "yield_displacement": "xz"}


def latex_symbol(name: str) -> str:
    r"""Write a name as a letter with an index: alpha, k1, kappa_x and fy0 as \alpha, k_1, \kappa_x and f_{y0}."""
    word = next((each for each in _WORDS if name.startswith(each)), "")
    head, _, tail = name.removeprefix(word).partition("_")
    if word:
        text, first = _WORDS[word][0], _WORDS[word][1] + head
    elif spelled := re.fullmatch(r"([a-z]{4,})(\d*)", head):
        greek = spelled[1] in _GREEK
        text, first = (rf"\{spelled[1]}" if greek else rf"\mathrm{{{spelled[1]}}}"), spelled[2]
    else:
        letter = next((greek for greek in _GREEK if head.startswith(greek)), "")
        text, first = rf"\{letter}" if letter else head[0], head[len(letter) or 1 :]
    parts = [rf"\mathrm{{{part}}}" if len(part) > 2 and part.isalpha() else part for part in (first, *tail.split("_"))]
    index = ",".join(part for part in parts if part)
    return text if not index else f"{text}_{index}" if len(index) == 1 else f"{text}_{{{index}}}"
