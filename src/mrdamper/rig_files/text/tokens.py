"""Cells of text: numbers, missing values, time stamps, or none of them; and notes in those that rows leave free.

Strict on purpose: what only some programs take for a number (1_000.5, 0x1F, other
scripts' digits) is refused, so that no two programs read different values from one file.
Points and commas as marks of thousands are read only in numbers that have a decimal mark, too:
1.017,56, or where a profile states the decimal mark; apostrophes and spaces always: 1'017.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections import Counter
from collections.abc import Sequence
from datetime import datetime
from functools import lru_cache

from mrdamper.rig_files.column_names import TABLES, is_unit, words

NUMBER = {
    mark: re.compile(rf"[+-]?(?:[0-9]+(?:{re.escape(mark)}[0-9]*)?|{re.escape(mark)}[0-9]+)(?:[eE][+-]?[0-9]+)?")
    for mark in ".,"
}
_APART = "'’ \u00a0\u202f\u2009"  # marks of thousands that are no decimal mark anywhere
_GROUPED = {
    mark: re.compile(
        rf"[+-]?[1-9][0-9]{{0,2}}(?:(?:{re.escape(other)}[0-9]{{3}})+{re.escape(mark)}[0-9]+"
        rf"|([{_APART}])[0-9]{{3}}(?:\1[0-9]{{3}})*(?:{re.escape(mark)}[0-9]*)?)"
    )
    for mark, other in (".,", ",.")
}
THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:,[0-9]{3})+|[+-]?[1-9][0-9]{0,2}(?:\.[0-9]{3})+")
_LONGEST = 40  # characters of a number
_CELLS_APART = re.compile(r"\S\s{2,}\S|[0-9]\s[+-]")  # what another separator would split
_SIGN_APART = re.compile(r"([+-]) +(?=[0-9.,])")  # - 0.328
MISSING = words("missing")
_INFINITE = re.compile(r"[+-]?(?:inf(?:inity)?|1\.#inf|∞)", re.IGNORECASE)
_STAMP = re.compile(
    r"(?:(?:([0-9]{4})([-/])([0-9]{2})\2([0-9]{2})|([0-9]{2})\.([0-9]{2})\.([0-9]{4})"
    r"|([0-9]{1,2})[- ]([a-zä]{3})[- ]([0-9]{4})|[0-9]{1,2}[-/][0-9]{1,2}[-/][0-9]{4})(?:T| +))?"
    r"(?:([0-9]{1,2}):(?=[0-9]{2}:))?([0-9]{1,2}):([0-9]{2})(?:[.,]([0-9]{1,9})|:([0-9]{3}))?"
    r"(?: ?([AP]M))?(Z|[+-][0-9]{2}:?[0-9]{2})?",
    re.IGNORECASE,
)
MONTHS = {name: i for names in TABLES["months"]["names"] for i, name in enumerate(names.split(), 1)}
FORTRAN = re.compile(r"[+-]?[0-9]*[.,]?[0-9]+[dD][+-]?[0-9]{1,3}")  # 1.25D-03; taken where a file writes so throughout
_ROWS = 60  # looked at


def number(token: str, mark: str) -> float | None:
    """Value of a stripped cell: NaN if it is missing, None if it is no number.

    Infinity and numbers beyond the range of a double come back as infinity.
    """
    token = _SIGN_APART.sub(r"\1", token, count=1) if token[1:2] == " " else token
    if _GROUPED[mark].fullmatch(token):
        token = "".join(c for c in token if c not in _APART and c != ("," if mark == "." else "."))
    if NUMBER[mark].fullmatch(token):
        return float(token if mark == "." else token.replace(",", "."))
    if token.lower() in MISSING:
        return math.nan
    return math.inf if _INFINITE.fullmatch(token) else None


def looks_numeric(token: str) -> bool:
    """Tell if a cell is meant as a value, in any notation: separates rows of data from headers."""
    token = token.strip(" \t")
    return _looks_numeric(token) if len(token) <= _LONGEST else _looks_numeric.__wrapped__(token)


@lru_cache(maxsize=4096)  # a cell of a file's head is asked about several times
def _looks_numeric(token: str) -> bool:
    token = _SIGN_APART.sub(r"\1", token, count=1)
    if (
        NUMBER["."].fullmatch(token)
        or token.lower() in MISSING
        or stamp(token) is not None
        or _INFINITE.fullmatch(token)
        or FORTRAN.fullmatch(token)
    ):
        return True
    if (
        len(token) > _LONGEST
        or token[0] in "eExX"  # X0
        or _CELLS_APART.search(token)
        or not any(unicodedata.decimal(c, None) is not None for c in token)
    ):
        return False
    return all(unicodedata.decimal(c, None) is not None or c in "+-.,eE_'’ \u00a0\u202f−xX\ufffd" for c in token)


def stamp(token: str) -> tuple[int, bool] | None:
    """Nanoseconds of an ISO-8601 time stamp or a clock time, and whether it states its zone.

    Dates also as 2024/03/31, 31.03.2024 and 31-Mar-2024, which mean one thing everywhere. 03/04/2024 and 03-04-2024
    do not: they are not looked at, and a record that passes midnight runs backwards. Minutes and seconds need a
    fraction. Integers, as doubles would round the nanoseconds of a date. A zone's offset is taken
    off, so that the change to summer time does not bend a record.
    """
    match = _STAMP.fullmatch(token) if ":" in token else None
    if match is None:
        return None
    year, _, month, day, *dotted, hour, minute, second, fraction, thousandths, half, zone = match.groups()
    if dotted[0]:
        day, month, year = dotted[:3]
    if dotted[3]:
        day, month, year = dotted[3], str(MONTHS.get(dotted[4].lower(), 0)), dotted[5]
    if hour is None:
        if fraction is None or year is not None:
            return None  # 12:30 may be hours and minutes
        hour = "0"
    if half is not None:
        if not 1 <= int(hour) <= 12:
            return None
        hour = int(hour) % 12 + 12 * (half.upper() == "PM")
    try:
        moment = datetime(int(year or 1), int(month or 1), int(day or 1), int(hour), int(minute), int(second))
    except ValueError:
        return None
    days = moment.toordinal() if year else 0
    seconds = ((days * 24 + moment.hour) * 60 + moment.minute) * 60 + moment.second
    if zone and zone not in "Zz":
        digits = zone[1:].replace(":", "")
        if int(digits[:2]) > 23 or int(digits[2:]) > 59:
            return None
        offset = 3600 * int(digits[:2]) + 60 * int(digits[2:])
        seconds -= offset if zone[0] == "+" else -offset
    return seconds * 10**9 + int((fraction or thousandths or "0").ljust(9, "0")), zone is not None


def with_notes_beside(
    rows: Sequence[Sequence[str]], names: tuple[str, ...], units: tuple[str, ...]
) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Return names and units of columns, and the notes beside the rows as lines: names with a number or a text.

    The notes of an oscilloscope state names and units of the two full columns beside them; texts count only there.
    """
    notes = _notes(rows, texts=not any(names))
    says = {key.casefold(): text for key, _, text in (note.partition(": ") for note in notes)}
    headings = [("time", says.get("horizontal units", "")), (says.get("source", ""), says.get("vertical units", ""))]
    full = [i for i in range(len(names)) if all(len(row) > i and row[i] for row in rows)]
    if any(names) or len(full) != len(headings) or not all(is_unit(unit) for _, unit in headings):
        return names, units, notes
    own = dict(zip(full, headings, strict=True))
    names, units = zip(*(own.get(i, ("", unit)) for i, unit in enumerate(units)), strict=True)
    return names, units, notes


def _notes(rows: Sequence[Sequence[str]], *, texts: bool) -> tuple[str, ...]:
    filled = Counter(i for row in rows for i, cell in enumerate(row) if cell)
    columns = {i for i, count in filled.items() if 2 * count > len(rows) > _ROWS}  # channels and labels, no notes
    stated = [
        (key, number, unit if is_unit(unit) and looks_numeric(number) else "")
        for row in rows[:_ROWS]
        for i, (key, number, unit) in enumerate(zip(row, row[1:], [*row[2:], ""], strict=False))
        if key and number and not {i, i + 1} & columns and not looks_numeric(key) and (texts or looks_numeric(number))
        and not (is_unit(number) and i and row[i - 1])  # Source, CH1, Second: seconds are those of the time
    ]  # fmt: skip
    return tuple(f"{key}: {number} {unit}".rstrip() for key, number, unit in stated)[:_ROWS]
