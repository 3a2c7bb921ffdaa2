"""The coil current where laboratories keep it beside the columns: header lines, titles, attributes, file names.

A number counts only with a unit behind it or in its name; two writings that contradict each
other are refused, not chosen from.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from mrdamper.rig_files.column_names import names_condition, split_name
from mrdamper.rig_files.units import parse_unit

LARGEST_STATED = 15.0  # [A]: more is no coil current of a damper but another number
_AGREE_A, _AGREE = 0.05, 0.15  # a nominal and a measured current may differ by so much: [A], and of it
_IN_NAME = re.compile(r"(?<![0-9A-Za-z.,])([0-9]{1,4}(?:[.,xp][0-9]{1,4})?)[ _]?(mA|A)(?:mp(?:ere)?s?)?(?![A-Za-z0-9])")
_LINE = re.compile(
    r"^[\s#%/\"]*(?P<key>[^:=;\t]{1,60}?)[\s\"]*[:=;,\t][\s:=;,\t\"]*(?P<number>[+-]?[0-9]+(?:[.,][0-9]+)?)"
    r"[\s;,\t\"]*[\[(]?(?P<unit>[A-Za-z]{0,8})[\])]?[\s;,\t\"]*$"
)
_SPACED = re.compile(
    r"^[\s#%/\"]*(?P<key>[^\d:=;,\t]{1,60}?)\s+(?P<number>[+-]?[0-9]+(?:[.,][0-9]+)?)\s*(?P<unit>[A-Za-z]{1,8})\s*$"
)


@dataclass(frozen=True, slots=True)
class Statement:
    """A current [A] that something beside the columns states, and where."""

    amperes: float
    whence: str


def currents_in(text: str) -> tuple[float, ...]:
    """Coil currents [A] in a title, a sheet's or a file's name: every distinct one.

    `1200mA`, `1.2 A`, `0p4A`, `0x25A`, `-0.3A-`; 0_5A may be five or half an ampere and states none.
    """
    text = text[:255]
    if re.search(r"(?<![0-9])[0-9]_[0-9]+ ?m?A(?![A-Za-z0-9])", text):
        return ()
    found = [amperes(match[1], match[2]) for match in _IN_NAME.finditer(text)]
    return tuple(dict.fromkeys(found))


def amperes(number: str, unit: str) -> float:
    """A number with decimal point, comma, x or p, in A or mA."""
    value = float(re.sub("[,xp]", ".", number))
    return value / 1000 if unit == "mA" else value


def stated_by_lines(lines: Iterable[str], decimal: str | None = None) -> list[Statement]:
    """Currents that lines of the form "Spulenstrom:; 0,40 A", "Current [mA] = 400" state.

    Parameters
    ----------
    lines : iterable of str
    decimal : "." or ",", optional
        The file's, where a number may have a decimal or a thousands mark.
    """
    found = []
    for line in lines:
        match = _LINE.match(line[:300]) or _SPACED.match(line[:300])
        if match is None:
            continue
        key, unit = split_name(match["key"].strip().strip('"'))
        unit = match["unit"] or unit
        known = parse_unit(unit) if unit else None
        value = _value(match["number"], decimal)
        if known is None or known.dimension != "current" or value is None or not names_condition(key, "current"):
            continue
        found.append(Statement(known.factor * value, f"the line {line.strip()[:60]!r}"))
    return found


def _value(number: str, decimal: str | None) -> float | None:
    grouped = re.fullmatch(r"[+-]?[1-9][0-9]{0,2}[.,][0-9]{3}", number)
    if grouped and decimal is None:
        return None
    if grouped and decimal is not None and decimal not in number:
        return float(re.sub("[.,]", "", number))
    return float(number.replace(",", "."))


def agreed(statements: Sequence[Statement]) -> Statement | None:
    """The first of statements that agree; None if there is none.

    Raises
    ------
    ValueError
        With what was found, if two contradict each other or one is no coil current.
    """
    for statement in statements:
        if abs(statement.amperes) > LARGEST_STATED:
            raise ValueError(f"{statement.whence} gives {statement.amperes:g} A, which is no coil current of a damper")
    for other in statements[1:]:
        if contradicts(other.amperes, statements[0].amperes):
            raise ValueError(
                f"{statements[0].whence} gives {statements[0].amperes:g} A, {other.whence} {other.amperes:g} A"
            )
    return statements[0] if statements else None


def contradicts(one: float, other: float) -> bool:
    """Whether two currents [A] cannot be one, nominal and measured; a dash before a number may be a sign or none."""
    return abs(abs(one) - abs(other)) > _AGREE_A + _AGREE * min(abs(one), abs(other))
