"""Head of a report and limits: specimen, rig, customer, force limits.

Both come from small TOML files a user writes. Nothing is required and nothing is invented.
"""

from __future__ import annotations

import base64
import io
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from mrdamper.data.strict_text import read_toml_file
from mrdamper.errors import InputError
from mrdamper.rig_files.limits_file import FORCE_LIMITS, require_known_keys

_LARGEST_LOGO = 500_000  # bytes; it stands in every page
_LONGEST = 5_000  # letters of a field
_LONGEST_SIDE = 5_000  # points of a logo
_PICTURES = {b"\x89PNG": "image/png", b"\xff\xd8\xff": "image/jpeg"}


class AboutError(InputError):
    """A file about the tests, or of limits, cannot be used."""

    code = "E_ABOUT"


@dataclass(frozen=True)
class About:
    """The head of a report; what was not given is empty."""

    title: str = ""
    customer: str = ""
    maker: str = ""
    type: str = ""
    serial: str = ""
    rig: str = ""
    operator: str = ""
    date: str = ""
    temperature_C: str = ""
    standard: str = ""
    notes: str = ""
    logo: str = ""  # the picture as a data address

    @property
    def rows(self) -> list[tuple[str, str]]:
        """Fields that were given, with their names on the page."""
        named = {"temperature_C": "temperature", "type": "type", "rig": "test rig"}
        given = [(f.name, getattr(self, f.name)) for f in fields(self) if f.name not in ("title", "logo")]
        return [(named.get(n, n), f"{v} °C" if n == "temperature_C" else v) for n, v in given if v]


@dataclass(frozen=True)
class Limit:
    """A band the damping force must lie in."""

    current_A: float
    velocity_m_s: float
    side: str  # "rebound" or "compression"
    # lower_N and upper_N: of the force with the gas force taken away, positive
    lower_N: float
    upper_N: float


def load_about(path: str | Path) -> About:
    """Read the head of a report from a TOML file.

    Raises `AboutError` if it cannot be read, holds an unknown field or a field that is no text or number, or names a
    logo that is no PNG or JPEG or is too large.
    """
    path = Path(path)
    table = dict(_toml(path))
    logo = table.get("logo")
    if isinstance(logo, str) and logo.strip():
        table["logo"] = _picture(*_logo_file(path.parent / logo.strip()))
    return about_of(table, str(path))


def about_of(table: Mapping[str, Any], where: str) -> About:
    """Return the head of a report from its fields; the logo is a data address already.

    Raises `AboutError` if a field is unknown, or no text or number.
    """
    names = [f.name for f in fields(About)]
    for name, value in table.items():
        if name not in names:
            near = get_close_matches(name, names, n=1)
            remedy = f"did you mean {near[0]}?" if near else f"the fields are {', '.join(names)}"
            raise AboutError(f"unknown field {name!r}", where=where, remedy=remedy)
        if isinstance(value, (dict, list, bool)):
            raise AboutError(f"{name} is no text", where=where, remedy=f'write {name} = "..."')
        if len(str(value)) > (_LONGEST if name != "logo" else 2 * _LARGEST_LOGO):
            raise AboutError(f"{name} has {len(str(value)):,} letters", where=where, remedy=f"at most {_LONGEST:,}")
    return About(**{name: str(value).strip() for name, value in table.items()})


def logo_of(text: str) -> str:
    """Return a picture, given as base64, as the data address a page holds.

    Raises `AboutError` if it is no base64, no PNG or JPEG, or too large.
    """
    try:
        data = base64.b64decode(text, validate=True)
    except ValueError as error:
        raise AboutError("is no base64", where="logo", remedy="choose the picture again") from error
    return _picture(data, "logo")


def load_limits(path: str | Path) -> tuple[Limit, ...]:
    """Read the force limits of a limits file: one `[[limit]]` table per limit.

    Raises `AboutError` if it cannot be read, a key is unknown, a limit is incomplete, no number, of no side, or its
    lower force above the upper, or two limits at one point exclude each other.
    """
    path = Path(path)
    table = _toml(path)
    require_known_keys(table, AboutError, str(path))
    entries = table.get(FORCE_LIMITS)
    if not isinstance(entries, list) or not entries:
        remedy = f"write one [[limit]] table per limit with {_FIELDS} (mrdamper init limits)"
        raise AboutError("no [[limit]] tables", where=str(path), remedy=remedy)
    limits = tuple(_limit(entry, f"{path}, limit {number}") for number, entry in enumerate(entries, 1))
    _refuse_exclusion(limits, str(path))
    return limits


def _refuse_exclusion(limits: Sequence[Limit], where: str) -> None:
    """Refuse two limits at the same point that no force meets."""
    points: dict[tuple[float, float, str], list[tuple[int, Limit]]] = {}
    for number, limit in enumerate(limits, 1):
        others = points.setdefault((limit.current_A, limit.velocity_m_s, limit.side), [])
        for before, other in others:
            if max(limit.lower_N, other.lower_N) > min(limit.upper_N, other.upper_N):
                raise AboutError(
                    f"no force meets limit {before} ({other.lower_N:g} to {other.upper_N:g} N) and limit {number} "
                    f"({limit.lower_N:g} to {limit.upper_N:g} N), both at {limit.current_A:g} A, "
                    f"{limit.velocity_m_s:g} m/s, {limit.side}",
                    where=where,
                    remedy="remove one of them",
                )
        others.append((number, limit))


_FIELDS = "current_A, velocity_m_s, side, lower_N, upper_N"


def _limit(entry: Any, where: str) -> Limit:
    if not isinstance(entry, dict) or set(entry) != set(_FIELDS.split(", ")):
        raise AboutError(f"fields {', '.join(sorted(map(str, entry)))}", where=where, remedy=f"give just {_FIELDS}")
    if entry["side"] not in ("rebound", "compression"):
        raise AboutError(f"side is {entry['side']!r}", where=where, remedy="write rebound or compression")
    numbers = {name: value for name, value in entry.items() if name != "side"}
    for name, value in numbers.items():
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value) or value < 0:
            raise AboutError(f"{name} is {value!r}", where=where, remedy="give a number, zero or more")
    if entry["lower_N"] > entry["upper_N"]:
        raise AboutError(
            f"lower_N {entry['lower_N']:g} lies above upper_N {entry['upper_N']:g}", where=where, remedy="exchange them"
        )
    return Limit(side=entry["side"], **{name: float(value) for name, value in numbers.items()})


def _toml(path: Path) -> Mapping[str, Any]:
    try:
        return read_toml_file(path)
    except OSError as error:
        raise AboutError(
            error.strerror or str(error), where=str(path), remedy="give a TOML file that exists"
        ) from error
    except tomllib.TOMLDecodeError as error:
        remedy = 'write one `name = "text"` a line, in UTF-8'
        raise AboutError(f"is no TOML: {str(error).splitlines()[0]}", where=str(path), remedy=remedy) from error


def _logo_file(path: Path) -> tuple[bytes, str]:
    where = f"logo {path.name}"
    try:
        with path.open("rb") as file:
            data = file.read(_LARGEST_LOGO + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise AboutError(reason, where=where, remedy="correct its path") from error
    return data, where


def _picture(data: bytes, where: str) -> str:
    from PIL import Image

    if len(data) > _LARGEST_LOGO:
        limit = _LARGEST_LOGO // 1000
        raise AboutError(f"is over {limit} kB", where=where, remedy=f"give a picture under {limit} kB")
    kind = next((kind for start, kind in _PICTURES.items() if data.startswith(start)), None)
    if kind is None:
        raise AboutError("neither PNG nor JPEG", where=where, remedy="save it as PNG")
    try:
        with Image.open(io.BytesIO(data)) as picture:
            size = picture.size
            if max(size) <= _LONGEST_SIDE:
                picture.load()
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise AboutError("is damaged", where=where, remedy="save it as PNG again") from error
    if max(size) > _LONGEST_SIDE:
        raise AboutError(f"has {size[0]} x {size[1]} points", where=where, remedy=f"make it {_LONGEST_SIDE} at most")
    return f"data:{kind};base64,{base64.b64encode(data).decode('ascii')}"


def parse_ladder(text: str) -> tuple[float, ...]:
    """Velocities [m/s] of a table of forces from "0.05, 0.1, 0.2"; empty for the default.

    Raises `AboutError` if one is no positive number, or over 20 are given.
    """
    words = [word for word in text.replace(",", " ").split() if word]
    try:
        steps = [float(word) for word in words]
    except ValueError:
        steps = [math.nan]
    if any(not (0 < step < math.inf) for step in steps) or len(steps) > 20:
        raise AboutError(f"velocities {text!r}", where="--velocities", remedy="give up to 20 positive numbers in m/s")
    return tuple(sorted(set(steps)))
