"""Head of a report and limits: specimen, rig, customer, force limits.

Both are read from TOML files of the user. No field is required.
"""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, WithJsonSchema, model_validator

from mrdamper.data.strict_text import content_of
from mrdamper.errors import InputError
from mrdamper.rig_files.strict_toml import FORCE_LIMITS, checked_table, load_part, load_toml

_HELP = "mrdamper init about shows the fields"
_LARGEST_LOGO = 500_000  # bytes of the logo, which is part of every page
_LONGEST = 5_000  # characters of a field
_LONGEST_SIDE = 5_000  # pixels of a logo
_PICTURES = {b"\x89PNG": "image/png", b"\xff\xd8\xff": "image/jpeg"}


class AboutError(InputError):
    """A file about the tests, or of limits, cannot be used."""

    code = "E_ABOUT"


def _as_text(value: Any) -> Any:
    """Convert numbers and dates of a file to text as written."""
    return value if isinstance(value, (dict, list, bool)) else str(value)


_SCHEMA = WithJsonSchema({"type": ["string", "number"]})
_Text = Annotated[str, Field(max_length=_LONGEST), BeforeValidator(_as_text), _SCHEMA]
_Number = Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)]


class About(BaseModel, extra="forbid", frozen=True, str_strip_whitespace=True):
    """The head of a report; missing fields are empty."""

    title: _Text = ""
    customer: _Text = ""
    maker: _Text = ""
    type: _Text = ""
    serial: _Text = ""
    rig: _Text = ""
    operator: _Text = ""
    date: _Text = ""
    temperature_C: _Text = ""
    standard: _Text = ""
    notes: _Text = ""
    logo: Annotated[str, Field(max_length=2 * _LARGEST_LOGO), BeforeValidator(_as_text), _SCHEMA] = ""  # a data address

    @property
    def rows(self) -> list[tuple[str, str]]:
        """Fields that were given, with their names on the page."""
        named = {"temperature_C": "temperature", "rig": "test rig"}
        given = [(name, value) for name, value in self if name not in ("title", "logo")]
        return [(named.get(n, n), f"{v} °C" if n == "temperature_C" else v) for n, v in given if v]


class Limit(BaseModel, extra="forbid", frozen=True):
    """A range for the damping force."""

    current_A: _Number
    velocity_m_s: _Number
    side: Literal["rebound", "compression"]
    # lower_N and upper_N: of the force with the gas force subtracted, positive
    lower_N: _Number
    upper_N: _Number

    @model_validator(mode="after")
    def _lower_lies_below(self) -> Limit:
        if self.lower_N > self.upper_N:
            raise ValueError(f"lower_N {self.lower_N:g} lies above upper_N {self.upper_N:g}; exchange them")
        return self


def load_about(path: str | Path) -> About:
    """Read the head of a report from a TOML file; raises `AboutError` for an unknown field or an unusable logo."""
    path = Path(path)
    about = load_toml(path, About, AboutError, _HELP)
    if not about.logo:
        return about
    kind = f"the path of a PNG or JPEG under {_LARGEST_LOGO // 1000} kB"
    data = content_of(path.parent / about.logo, _LARGEST_LOGO, AboutError, kind)
    return about.model_copy(update={"logo": _picture(data, f"logo {about.logo}")})


def about_of(table: Mapping[str, Any], where: str) -> About:
    """Return the head of a report from its fields, the logo a data address; raises `AboutError` for a wrong field."""
    return checked_table(table, About, AboutError, _HELP, where)


def logo_of(text: str) -> str:
    """Convert a picture in base64 to a data address; raises `AboutError` if it is no PNG or JPEG, or too large."""
    try:
        data = base64.b64decode(text, validate=True)
    except ValueError as error:
        raise AboutError("is no base64", where="logo", remedy="choose the picture again") from error
    return _picture(data, "logo")


def load_limits(path: str | Path) -> tuple[Limit, ...]:
    """Read the `[[limit]]` tables of a limits file; raises `AboutError` for a wrong one, or two that conflict."""
    kind = Annotated[tuple[Limit, ...], AfterValidator(_without_exclusion)]
    return load_part(path, {FORCE_LIMITS: (kind, ...)}, AboutError)[FORCE_LIMITS]


def _without_exclusion(limits: tuple[Limit, ...]) -> tuple[Limit, ...]:
    """Refuse two limits at the same point that exclude each other, and an empty table."""
    if not limits:
        raise ValueError("no [[limit]] tables")
    points: dict[tuple[float, float, str], list[tuple[int, Limit]]] = {}
    for number, limit in enumerate(limits, 1):
        others = points.setdefault((limit.current_A, limit.velocity_m_s, limit.side), [])
        for before, other in others:
            if max(limit.lower_N, other.lower_N) > min(limit.upper_N, other.upper_N):
                raise ValueError(
                    f"no force meets limit {before} ({other.lower_N:g} to {other.upper_N:g} N) and limit {number} "
                    f"({limit.lower_N:g} to {limit.upper_N:g} N), both at {limit.current_A:g} A, "
                    f"{limit.velocity_m_s:g} m/s, {limit.side}; remove one of them"
                )
        others.append((number, limit))
    return limits


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
    """Velocities [m/s] from "0.05, 0.1", none for the default; raises `AboutError` unless up to 20 positive numbers."""
    words = [word for word in text.replace(",", " ").split() if word]
    try:
        steps = [float(word) for word in words]
    except ValueError:
        steps = [math.nan]
    if any(not (0 < step < math.inf) for step in steps) or len(steps) > 20:
        raise AboutError(f"velocities {text!r}", where="--velocities", remedy="give up to 20 positive numbers in m/s")
    return tuple(sorted(set(steps)))
