"""The rig profile: what a rig's files do not say by themselves, once for a whole folder, in TOML."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, field_validator, model_validator

from mrdamper.errors import InputError
from mrdamper.rig_files.column_names import DIMENSION, TABLES, parse_unit
from mrdamper.rig_files.conditions import amperes, currents_in
from mrdamper.rig_files.record import OPTIONAL, REQUIRED
from mrdamper.rig_files.strict_toml import load_toml, parse_toml

_HELP = "mrdamper init profile shows the keys"
NAME = Annotated[str, StringConstraints(min_length=1, max_length=200)]


class ProfileError(InputError):
    """A rig profile cannot be read, or says what cannot be."""

    code = "E_PROFILE"


class Table(BaseModel):
    """A table of a profile: no other keys, and never changed."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, use_attribute_docstrings=True)


class FileForm(Table):
    """[file]: the form of the files: what readers take for granted instead of sniffing it; lines count from one."""

    separator: Literal[",", ";", "\t", "|", " "] | None = None
    """Of delimited text; one space stands for any run of spaces."""
    decimal: Literal[".", ","] | None = None
    encoding: NAME | None = None
    header_line: int | None = Field(default=None, ge=0, le=10_000)
    """0 if there is none."""
    units_line: int | None = Field(default=None, ge=1, le=10_000)
    data_line: int | None = Field(default=None, ge=1, le=10_000)
    names: tuple[str, ...] = Field(default=(), max_length=1000, strict=False)
    """Names of all columns in order, where the files have none."""
    sheet: NAME | None = None
    run_column: NAME | Annotated[int, Field(ge=1, le=1000)] | None = None
    """Column that says which test a row belongs to: its name, or its number counted from one."""
    blocks: Literal["join", "split"] | None = None
    """If what looks like several tests (repeated headers, groups of columns, a time that starts again) is one."""
    leave_out: tuple[NAME, ...] = Field(default=(), max_length=100, strict=False)
    """Patterns with * of files, and tables, tests or columns within them, to leave out: `warmup*`, `*/calibration`."""
    sample_rate_Hz: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    """Of files without time stamps."""

    @model_validator(mode="after")
    def _separator_is_not_the_mark(self) -> FileForm:
        if self.separator == "," and self.decimal == ",":
            raise ValueError("separator and decimal are both a comma")
        return self


class Channel(Table):
    """[channels.NAME]: where a channel is and what its numbers mean."""

    column: NAME | Annotated[int, Field(ge=1, le=1000)] | None = None
    """Name of the column, or its number counted from one."""
    add: tuple[NAME | Annotated[int, Field(ge=1, le=1000)], ...] = Field(default=(), max_length=20, strict=False)
    """Further columns that are added to it, as the load cells of two rods are; none where a column is the sum."""
    unit: NAME | None = None
    """Of the numbers, or of the numbers times `scale`."""
    sign: Literal[1, -1] = 1
    """-1 where the file counts compression positive; the displacement's holds for velocity and acceleration, too."""
    scale: float | None = Field(default=None, allow_inf_nan=False)
    """With `offset` a calibration: value in `unit` = scale * number + offset."""
    offset: float = Field(default=0.0, allow_inf_nan=False)
    """Not for zeroing: the zero of force and displacement is data."""
    delay_ms: float = Field(default=0.0, ge=-1e4, le=1e4, allow_inf_nan=False)
    """Delay of the channel behind the others, if known [ms]."""
    file: NAME | None = None
    """Files that hold it, {run} for what names the test, * for anything: `C1--*--{run}.csv`, `{run}/force.csv`."""
    integrate: bool = False
    """The displacement's column holds the velocity, of which the displacement is the integral, from zero on."""

    @model_validator(mode="after")
    def _keys_fit_together(self) -> Channel:
        if self.file is not None and (self.file.count("{run}") != 1 or self.file.count("*") > 3):
            raise ValueError("file needs {run} once, and at most three *")
        if self.scale == 0:
            raise ValueError("a scale of zero leaves nothing")
        if self.scale is not None and self.unit is None:
            raise ValueError("scale needs the unit it leads to")
        if self.offset and self.scale is None:
            raise ValueError("offset belongs to a calibration and needs scale")
        return self


class CurrentSource(Table):
    """[current]: the coil current where no column holds it."""

    value: float | None = Field(default=None, allow_inf_nan=False, ge=-1000, le=1000)
    """[A], for every file."""
    pattern: NAME | None = None
    """Name of the file, of the table within it, or of both with their folders: `*_{current}A_*`, `*/I_{current}A/*`.

    * stands for anything; {run}, {frequency} and {amplitude} for what tells the tests apart otherwise.
    """
    values: dict[NAME, Annotated[float, Field(allow_inf_nan=False, ge=-1000, le=1000)]] = Field(
        default_factory=dict, max_length=1000
    )
    """[A], by patterns with * of file or test names, with their folders where the pattern has a slash; by a folder."""
    unit: Literal["A", "mA"] = "A"
    """Of the number in the file name."""

    @model_validator(mode="after")
    def _says_one_thing(self) -> CurrentSource:
        if (self.value is not None) + (self.pattern is not None) + bool(self.values) != 1:
            raise ValueError("give either value or pattern or values")
        unknown = set(re.findall(r"\{(.*?)\}", self.pattern or "")) - {"current", "run", "frequency", "amplitude"}
        if unknown:
            raise ValueError(f"no placeholder is called {{{unknown.pop()}}}; known: current, run, frequency, amplitude")
        if self.pattern is not None and (self.pattern.count("{current}") != 1 or self.pattern.count("*") > 3):
            raise ValueError("the pattern needs {current} once, and at most three *")
        return self

    def fitting(self, path: Path, test: str) -> list[str]:
        """Return the patterns of `values` that match a file or a test of it, else its folder, whatever the case."""
        names, whole = (path.name, path.stem, test), (f"/{path.as_posix()}", f"/{path.as_posix()}/{test}")
        texts = {p: [f"/{text}".casefold() for text in (whole if "/" in p else names)] for p in self.values}
        named = [p for p, of in texts.items() if any(fnmatchcase(text, f"*/{p.casefold()}") for text in of)]
        return named or [pattern for pattern in self.values if pattern.casefold() == path.parent.name.casefold()]


class Correction(Table):
    """[correction]: what the load cell measures beside the damper's force; the raw force is kept, too."""

    moving_mass_kg: float = Field(default=0.0, ge=0, le=1e4, allow_inf_nan=False)
    """Between load cell and damper; its inertia, by an accelerometer or the displacement's curvature, is subtracted."""
    gas_force_N: float = Field(default=0.0, ge=-1e6, le=1e6, allow_inf_nan=False)
    """Force with which gas or a spring pushes the rod out, added so that it no longer counts."""


class Profile(Table):
    """Information that the files of a rig do not contain; rig, excitation and split as for `Run`."""

    rig: str = Field(default="", max_length=200)
    excitation: NAME = "sine"
    split: Literal["train", "validate"] = "train"
    file: FileForm = FileForm()
    channels: dict[str, Channel] = Field(default_factory=dict)
    """By time, displacement, force, velocity, acceleration, current, voltage, temperature and pressure."""
    current: CurrentSource | None = None
    correction: Correction | None = None

    @field_validator("channels")
    @classmethod
    def _channels_exist(cls, channels: dict[str, Channel]) -> dict[str, Channel]:
        roles = (*REQUIRED, *OPTIONAL)
        for name, channel in channels.items():
            if name not in roles:
                raise ValueError(f"no channel is called {name!r}; known: {', '.join(roles)}")
            if channel.integrate and name != "displacement":
                raise ValueError(f"only the displacement is integrated, not the {name}")
            unit, dimension = parse_unit(channel.unit or ""), "velocity" if channel.integrate else DIMENSION[name]
            if channel.unit and (unit is None or unit.dimension != dimension):
                units = ", ".join(TABLES["units"].get(dimension, ()))
                raise ValueError(f"{channel.unit!r} is no unit of {dimension} ({name}); known are {units}")
        return channels

    def of_file(self, path: Path) -> tuple[str, Profile]:
        """Return the test that a file of some channels belongs to, and its profile; an empty name for other files.

        A pattern with folders is compared with as many of the path's.
        """
        stated = {role: channel for role, channel in self.channels.items() if channel.file is not None}
        patterns = {role: c.file or "" for role, c in stated.items()}
        names = {role: "/".join(path.parts[-1 - pattern.count("/") :]) for role, pattern in patterns.items()}
        matches = {role: re.fullmatch(_as_expression(p), names[role][:255]) for role, p in patterns.items()}
        runs = {match["run"] for match in matches.values() if match}
        channels = {role: c for role, c in self.channels.items() if role not in stated or matches[role]}
        own = self.model_copy(update={"channels": channels}) if stated else self
        return runs.pop() if len(runs) == 1 else "", own

    def require_matches(self, tests: Sequence[tuple[Path, str]]) -> None:
        """Refuse patterns of the table of currents and of the channels' files that match no file and no test."""
        for role, channel in ((role, self.channels[role]) for role in REQUIRED if role in self.channels):
            only = Profile(channels={role: channel})
            if channel.file is not None and not any(only.of_file(path)[0] for path, _ in tests):
                remedy = "write the files' name, with folders where it has slashes, and {run} for what names the test"
                raise ProfileError(f"no file is called {channel.file!r}", where=f"[channels.{role}]", remedy=remedy)
        source = self.current or CurrentSource(value=0.0)
        absent = set(source.values).difference(*(source.fitting(path, test) for path, test in tests))
        if absent:
            problem = f"no file, test or folder is called {', '.join(repr(pattern) for pattern in sorted(absent))}"
            remedy = "write names of files or tests, with * for anything, or of folders of tests"
            raise ProfileError(problem, where="[current.values]", remedy=remedy)

    def leaves_out(self, *parts: str) -> bool:
        """Tell if a file or table of this name, behind those of its folders, or a test behind its file, is omitted."""
        names = {p: "/".join(parts[-1 - p.count("/") :]) for p in self.file.leave_out}
        texts = [(name.casefold(), pattern.casefold()) for pattern, name in names.items()]
        return any(name == pattern or fnmatchcase(name, pattern) for name, pattern in texts)  # current [A] as it stands

    def channel(self, name: str) -> Channel:
        """Return the settings of a channel."""
        return self.channels.get(name, Channel())


def load_profile(path: str | Path) -> Profile:
    """Read a rig profile.

    Raises `ProfileError` if it is no TOML, or a key or value is not known.
    """
    return load_toml(Path(path), Profile, ProfileError, _HELP)


def profile_of(profile: Profile | str | Path | None) -> Profile:
    """Return the profile given, read from its file where a path is given; an empty one for None."""
    if profile is None:
        return Profile()
    return profile if isinstance(profile, Profile) else load_profile(profile)


def parse_profile(text: str, where: str = "profile") -> Profile:
    """Return a profile from TOML text; raises as `load_profile`."""
    return parse_toml(text, Profile, ProfileError, _HELP, where)


def profile_text(profile: Profile, unset: Mapping[str, Sequence[str]] = MappingProxyType({})) -> str:
    """Return the profile as TOML that reads back equal, with keys that are unset as comments, by section."""
    lines = [f"{key} = {toml(getattr(profile, key))}" for key in ("rig", "excitation", "split")]
    sections = {"file": profile.file.model_dump(exclude_none=True, exclude_defaults=True)}
    for name, channel in profile.channels.items():
        says = channel.model_dump(exclude_none=True, exclude_defaults=True)
        stated = {key: getattr(channel, key) for key in ("sign", "add") if key in channel.model_fields_set}
        sections[f"channels.{name}"] = says | stated
    for name in ("current", "correction"):
        table = getattr(profile, name)
        sections[name] = {} if table is None else table.model_dump(exclude_none=True, exclude_unset=True)
    sections["current.values"] = sections["current"].pop("values", {})
    for name, section in sections.items():
        if section or name in unset or name.startswith("channels."):
            keys = [key if re.fullmatch(r"[A-Za-z0-9_]+", key) else toml(key) for key in section]
            lines += ["", f"[{name}]", *map("{} = {}".format, keys, map(toml, section.values()))]
            lines += [f"#{line}" for line in unset.get(name, ()) if line.partition(" ")[0] not in section]
    return "\n".join(lines) + "\n"


def profile_hash(profile: Profile) -> str:
    """SHA-256 of what the profile says, whatever its layout."""
    return hashlib.sha256(profile_text(profile).encode("utf-8")).hexdigest()


def current_in_name(name: str, profile: Profile) -> float | None:
    """Coil current [A] a file name states, None if it states none or several; by the pattern of a profile that has one.

    `A5_-0.3A-_1.csv`, `2Hz_0x25A.txt`, `run_500mA.csv`; an x or p may stand for the point.

    Raises `ProfileError`: E_AMBIGUOUS if the number that the pattern finds has another unit behind it, or none while
    the profile states none.
    """
    source = profile.current
    if source is None or source.pattern is None:
        currents = currents_in(name)
        return currents[0] if len(currents) == 1 else None
    match = re.fullmatch(_as_expression(source.pattern), name[:255])
    if match is None:
        return None
    behind = re.match(r"[ _]?([A-Za-z°]+)", name[match.end("current") :])
    unit = parse_unit(behind[1]) if behind else None
    suffix = re.fullmatch(r"\.[A-Za-z0-9]{1,6}", name[match.end("current") :]) is not None
    other = unit is not None and unit.dimension != "current" and not suffix
    if other or ("unit" not in source.model_fields_set and (unit is None or unit.dimension != "current")):
        what = f"is followed by {behind[1]!r}" if behind and other else "has no unit behind it"
        problem = f"the pattern {source.pattern!r} finds {match['current']}, which {what}: is it a current?"
        remedy = 'correct the pattern, or set [current] unit = "A"' if not other else "correct the pattern"
        raise ProfileError(problem, where=name, remedy=remedy, code="E_AMBIGUOUS")
    stated = "unit" not in source.model_fields_set and unit is not None
    milli = unit.factor < 1 if stated and unit is not None else source.unit == "mA"
    return amperes(match["current"], "mA" if milli else "A")


def current_pattern(name: str) -> CurrentSource | None:
    """Return the pattern by which a file name states its current, None if it states none."""
    stated = current_in_name(name, Profile())
    if stated is None:
        return None
    match = re.search(r"(?<![0-9A-Za-z.,])([0-9]{1,4}(?:[.,xp][0-9]{1,4})?)([ _]?)(mA|A)(?![a-z0-9])", name[:255])
    if match is None:
        return None
    before = name[max(0, match.start() - 1) : match.start()]
    star = "*" if match.start() else ""
    source = CurrentSource(pattern=f"{star}{before}{{current}}{match[2]}{match[3]}*", unit=match[3])  # type: ignore[arg-type]
    return source if current_in_name(name, Profile(current=source)) == stated else None


def _as_expression(pattern: str) -> str:
    parts = re.split(r"(^\*/|\{(?:current|run|frequency|amplitude)\}|\*)", pattern)
    number = r"(?P<current>[+-]?[0-9]{1,4}(?:[.,xp][0-9]{1,4})?)"
    other = r"[+-]?[0-9]{1,6}(?:[.,xp][0-9]{1,4})?"
    meant = {"{current}": number, "*": ".*?", "{run}": "(?P<run>.+?)", "{frequency}": other, "{amplitude}": other}
    meant["*/"] = "(?:.*?/)?"  # the folders of */lvl{current}/* may be all there are
    inner = "".join(meant.get(part, re.escape(part)) for part in parts)
    return inner if re.search(r"\.[A-Za-z0-9]{1,5}$|\*$", pattern) else inner + r"(?:\..*)?"


def toml(value: Any) -> str:
    """Return a value as TOML."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(toml(item) for item in value) + "]"
    return repr(value)
