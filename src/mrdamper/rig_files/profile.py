"""The rig profile: what a rig's files do not say by themselves, once for a whole folder.

A TOML file. Every key may be left out where the files say it.
"""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError, field_validator, model_validator

from mrdamper.errors import InputError
from mrdamper.rig_files.readers.base import Hints
from mrdamper.rig_files.record import OPTIONAL, REQUIRED
from mrdamper.rig_files.units import DIMENSION, parse_unit

_LARGEST = 64 * 1024  # bytes; a profile is a page
_NAME = Annotated[str, StringConstraints(min_length=1, max_length=200)]
_FILE_CURRENT = re.compile(r"(?<![0-9A-Za-z.,])([0-9]{1,3}(?:[.,xp][0-9]{1,4})?) ?(mA|A)(?:mps?)?(?![A-Za-z0-9])")


class ProfileError(InputError):
    """A rig profile cannot be read, or says what cannot be."""

    code = "E_PROFILE"


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class FileForm(_Table):
    """[file]: the form of the files.

    Attributes
    ----------
    separator, decimal, encoding : str, optional
        Of delimited text; a separator of one space stands for any run of spaces.
    header_line, units_line, data_line : int, optional
        Counted from one; a header_line of 0 says that there is none.
    names : tuple of str
        Names of all columns in order, where the files have none.
    sheet : str, optional
        Of workbooks.
    blocks : "join" or "split", optional
        Whether repeated acquisition blocks are one test or several.
    sample_rate_Hz : float, optional
        Of files without time stamps.
    """

    separator: Literal[",", ";", "\t", "|", " "] | None = None
    decimal: Literal[".", ","] | None = None
    encoding: _NAME | None = None
    header_line: int | None = Field(default=None, ge=0, le=10_000)
    units_line: int | None = Field(default=None, ge=1, le=10_000)
    data_line: int | None = Field(default=None, ge=1, le=10_000)
    names: tuple[str, ...] = Field(default=(), max_length=1000, strict=False)
    sheet: _NAME | None = None
    blocks: Literal["join", "split"] | None = None
    sample_rate_Hz: float | None = Field(default=None, gt=0, allow_inf_nan=False)

    @model_validator(mode="after")
    def _separator_is_not_the_mark(self) -> FileForm:
        if self.separator == "," and self.decimal == ",":
            raise ValueError("separator and decimal are both a comma")
        return self


class Channel(_Table):
    """[channels.NAME]: where a channel is and what its numbers mean.

    Attributes
    ----------
    column : str or int, optional
        Name of the column, or its number counted from one.
    unit : str, optional
        Of the numbers, or of the numbers times `scale`.
    sign : 1 or -1
        -1 where the file counts compression positive.
    scale, offset : float
        A calibration: value in `unit` = scale * number + offset. Not for zeroing: the zero
        of force and displacement is data.
    delay_ms : float
        How late the channel is, where it is known [ms].
    """

    column: _NAME | Annotated[int, Field(ge=1, le=1000)] | None = None
    unit: _NAME | None = None
    sign: Literal[1, -1] = 1
    scale: float | None = Field(default=None, allow_inf_nan=False)
    offset: float = Field(default=0.0, allow_inf_nan=False)
    delay_ms: float = Field(default=0.0, ge=-1e4, le=1e4, allow_inf_nan=False)

    @field_validator("scale")
    @classmethod
    def _scale_is_not_zero(cls, scale: float | None) -> float | None:
        if scale == 0:
            raise ValueError("a scale of zero leaves nothing")
        return scale

    @model_validator(mode="after")
    def _calibration_is_whole(self) -> Channel:
        if self.scale is not None and self.unit is None:
            raise ValueError("scale needs the unit it leads to")
        if self.offset and self.scale is None:
            raise ValueError("offset belongs to a calibration and needs scale")
        return self


class CurrentSource(_Table):
    """[current]: the coil current where no column holds it.

    Attributes
    ----------
    value : float, optional
        [A], for every file.
    pattern : str, optional
        File name with {current} where the number stands and * for anything: `*_{current}A_*`.
    unit : "A" or "mA"
        Of the number in the file name.
    """

    value: float | None = Field(default=None, allow_inf_nan=False, ge=-1000, le=1000)
    pattern: _NAME | None = None
    unit: Literal["A", "mA"] = "A"

    @model_validator(mode="after")
    def _says_one_thing(self) -> CurrentSource:
        if (self.value is None) == (self.pattern is None):
            raise ValueError("give either value or pattern")
        if self.pattern is not None and (self.pattern.count("{current}") != 1 or self.pattern.count("*") > 3):
            raise ValueError("the pattern needs {current} once, and at most three *")
        return self


class Profile(_Table):
    """What a rig's files do not say.

    Attributes
    ----------
    rig, excitation, split : str
        As for `Run`.
    file : FileForm
    channels : mapping of str to Channel
        By "time", "displacement", "force", "velocity", "acceleration", "current", "voltage",
        "temperature".
    current : CurrentSource, optional
    """

    rig: str = Field(default="", max_length=200)
    excitation: _NAME = "sine"
    split: Literal["train", "validate"] = "train"
    file: FileForm = FileForm()
    channels: dict[str, Channel] = Field(default_factory=dict)
    current: CurrentSource | None = None

    @field_validator("channels")
    @classmethod
    def _channels_exist(cls, channels: dict[str, Channel]) -> dict[str, Channel]:
        known = (*REQUIRED, *OPTIONAL)
        for name, channel in channels.items():
            if name not in known:
                raise ValueError(f"no channel is called {name!r}; known: {', '.join(known)}")
            unit = parse_unit(channel.unit) if channel.unit else None
            if channel.unit and (unit is None or unit.dimension != DIMENSION[name]):
                raise ValueError(f"{channel.unit!r} is no unit of {DIMENSION[name]} ({name})")
        return channels

    @property
    def current_is_given(self) -> bool:
        """Whether the current comes from here rather than from a column."""
        return self.current is not None

    @property
    def hints(self) -> Hints:
        """What readers need of it."""
        form = self.file
        return Hints(
            form.separator, form.decimal, form.encoding, form.header_line, form.units_line, form.data_line,
            form.names, form.sheet, form.blocks, form.sample_rate_Hz,
        )  # fmt: skip


def load_profile(path: str | Path) -> Profile:
    """Read a rig profile.

    Raises
    ------
    ProfileError
        If it is no TOML, or a key or value is not known.
    """
    path = Path(path)
    try:
        if path.stat().st_size > _LARGEST:
            raise ProfileError("over 64 KiB", where=path.name, mend="is this a rig profile?")
        return parse_profile(path.read_bytes().decode("utf-8-sig"), path.name)
    except OSError as error:
        raise ProfileError(error.strerror or str(error), where=str(path), mend="give a TOML file") from error
    except UnicodeDecodeError as error:
        raise ProfileError("is no UTF-8 text", where=path.name, mend="save it as UTF-8") from error


def parse_profile(text: str, where: str = "profile") -> Profile:
    """A profile from TOML text.

    Raises
    ------
    ProfileError
        If it is no TOML, or a key or value is not known.
    """
    try:
        return Profile.model_validate(tomllib.loads(text))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ProfileError(str(error) or "nested too deeply", where=where, mend="correct the TOML") from error
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
        unknown = first["type"] == "extra_forbidden"
        found = f"unknown key {place}" if unknown else f"{place}: {first['msg'].removeprefix('Value error, ')}"
        raise ProfileError(
            found + more, where=where, mend="mrdamper import FILE --write-profile - shows a profile with its keys"
        ) from error


def profile_text(profile: Profile) -> str:
    """The profile as TOML that reads back equal."""
    values = profile.model_dump(exclude_none=True)
    default = Profile().model_dump(exclude_none=True)
    lines = [f"{key} = {_toml(values[key])}" for key in ("rig", "excitation", "split")]
    form = {key: value for key, value in values["file"].items() if value != default["file"].get(key)}
    sections = {"file": form}
    for name, channel in values["channels"].items():
        plain = Channel().model_dump(exclude_none=True)
        sections[f"channels.{name}"] = {k: v for k, v in channel.items() if v != plain.get(k) or k == "sign"}
    if "current" in values:
        sections["current"] = values["current"]
    for name, section in sections.items():
        if section or name.startswith("channels."):
            lines += ["", f"[{name}]", *(f"{key} = {_toml(value)}" for key, value in section.items())]
    return "\n".join(lines) + "\n"


def profile_hash(profile: Profile) -> str:
    """SHA-256 of what the profile says, whatever its layout."""
    return hashlib.sha256(profile_text(profile).encode("utf-8")).hexdigest()


def current_in_name(name: str, profile: Profile) -> float | None:
    """Coil current [A] a file name states, None if it states none or several.

    Parameters
    ----------
    name : str
        `A5_-0.3A-_1.csv`, `2Hz_0x25A.txt`, `run_500mA.csv`; an x or p may stand for the point.
    profile : Profile
        Its pattern is the only way where it has one.
    """
    source = profile.current
    if source is not None and source.pattern is not None:
        match = re.fullmatch(_as_expression(source.pattern), name[:255])
        return None if match is None else _amperes(match["current"], source.unit)
    name = name[:255]
    found = {_amperes(match[1], match[2]) for match in _FILE_CURRENT.finditer(name)}
    # 0_5A may be five or half an ampere.
    doubtful = re.search(r"(?<![0-9])[0-9]_[0-9]+ ?m?A(?![A-Za-z0-9])", name)
    return found.pop() if len(found) == 1 and not doubtful else None


def current_pattern(name: str) -> CurrentSource | None:
    """The pattern by which a file name states its current, None if it states none."""
    amperes = current_in_name(name, Profile())
    if amperes is None:
        return None
    match = next(_FILE_CURRENT.finditer(name[:255]))
    before = name[max(0, match.start() - 1) : match.start()]
    source = CurrentSource(pattern=f"{'*' if match.start() else ''}{before}{{current}}{match[2]}*", unit=match[2])  # type: ignore[arg-type]
    return source if current_in_name(name, Profile(current=source)) == amperes else None


def _as_expression(pattern: str) -> str:
    parts = re.split(r"(\{current\}|\*)", pattern)
    number = r"(?P<current>[+-]?[0-9]{1,4}(?:[.,xp][0-9]{1,4})?)"
    inner = "".join({"{current}": number, "*": ".*?"}.get(part, re.escape(part)) for part in parts)
    return inner if re.search(r"\.[A-Za-z0-9]{1,5}$|\*$", pattern) else inner + r"(?:\..*)?"


def _amperes(number: str, unit: str) -> float:
    value = float(re.sub("[,xp]", ".", number))
    return value / 1000 if unit == "mA" else value


def _toml(value: Any) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    return repr(value)
