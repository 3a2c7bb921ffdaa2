"""Views of a file before it is imported: its tree, its rows, the profile that reads it, and what it leaves open."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from mrdamper.errors import InputError, listed
from mrdamper.rig_files.coil_current import held_current_of
from mrdamper.rig_files.column_names import DIMENSION, Header, names_compression, split_name
from mrdamper.rig_files.columns import assign, column_called, propose, rate_of, sign_of
from mrdamper.rig_files.file_records import described, files_in, headings_of, tables_of_tests, test_tables, unpacked
from mrdamper.rig_files.profile import Channel, FileForm, Profile, current_pattern, profile_of, toml
from mrdamper.rig_files.readers import raw_tables
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import SIGNED

_ROWS_SHOWN, _MOST_SHOWN = 6, 30  # rows and columns of a preview
_MOST_COLUMNS, _MOST_REMARKS, _MOST_NAMES = 40, 6, 3  # of a tree that is shown
_SECTIONS = re.compile(r"\[((?:channels\.\w+)|file)\]((?:(?!\[(?:channels|file|current)).)*)")
_KEYS = {
    "file": ("sample_rate_Hz", "leave_out", "blocks"),
    "channels": ("column", "unit", "scale", "offset", "sign", "file"),
}
_MEANT = {
    "sample_rate_Hz": "  # if the rows are samples at a fixed rate",
    "scale": "  # of 1 in the file, in that unit",
    "file": '  # "{run}_force.csv": what names the test, and the channel',
    "blocks": '"split"  # if each group is a test',
    "sign": "-1  # if it counts compression positive",
}
_ROLE = re.compile(r"\[channels\.(\w+)\]")
_UNITS = {
    "time": ("s", "ms", "us", "days"),
    "length": ("mm", "m", "in", "cm"),
    "force": ("N", "kN", "lbf", "kgf", "tf"),
    "current": ("A", "mA"),
    "velocity": ("m/s", "mm/s"),
}


def guess_profile(path: str | Path, profile: Profile | str | Path | None = None) -> Profile:
    """Return the form of a file as a profile that can be saved, completed and used for its folder.

    Reading with it gives the same record. What the file does not say is left out of it.

    Raises `InputError` if the form of the file cannot be found.
    """
    profile = profile_of(profile)
    with raw_tables(path, profile.file) as tables:
        (table, *others), channels = _guess_channels(tables, Path(path), profile)
    numbered = [{*other.names, *map(other.number, range(len(other.names)))} for other in others]
    for role, channel in channels.items():
        if channel.column is not None and any(channel.column not in own for own in numbered):  # x1, x2, one a test
            channels[role] = channel.model_copy(update={"column": profile.channel(role).column})
    of_file = {key: value for key, value in table.form.items() if key != "sheet" or len(tables) == 1}  # tests in others
    form = {**of_file, **profile.file.model_dump(exclude_defaults=True)}
    if not any(table.names):
        form["names"] = tuple(f"column {i + 1}" for i in range(len(table.names)))
    stated = "current" in channels or held_current_of(table) is not None
    rate = None
    with contextlib.suppress(InputError):  # of two that are stated neither is written: reading asks for one
        rate = rate_of(table, profile) if channels.get("time", Channel()).column is None else None
    if rate:
        form["sample_rate_Hz"] = rate
        channels.pop("time", None)
    pattern = None if stated else current_pattern(Path(path).name)
    update = {"channels": {**profile.channels, **channels}, "current": profile.current or pattern}
    return profile.model_copy(update={"file": FileForm(**form), **update})  # type: ignore[arg-type]


def preview(path: str | Path, profile: Profile | str | Path | None = None) -> dict[str, Any]:
    """Return the names and units of a file's columns, its first rows, and the column, unit and sign of each channel.

    Raises `InputError` if the form of the file cannot be found.
    """
    profile = profile_of(profile)
    with raw_tables(path, profile.file) as tables:
        (table, *_), channels = _guess_channels(tables, Path(path), profile)
        cells, places = list[list[str]](), dict[str, dict[str, Any]]()
        for column in range(min(len(table.names), _MOST_SHOWN)):
            values, odd = table.try_read(column), [*table.odd[column : column + 1]]
            cells.append([f"{value:g}" for value in values[column][:_ROWS_SHOWN]] if values else odd)
        for name, channel in channels.items():
            places[name] = {"column": None, "unit": channel.unit or "", "sign": channel.sign}
            with contextlib.suppress(InputError):
                if channel.column is not None:
                    places[name]["column"] = column_called(table, channel.column, "a channel")
        for name in SIGNED:
            if names_compression(str(channels[name].column)) and "sign" not in channels[name].model_fields_set:
                places[name]["sign"] = -1
    rows = [[column[i] if i < len(column) else "" for column in cells] for i in range(_ROWS_SHOWN)]
    names, units = table.names[:_MOST_SHOWN], table.units[:_MOST_SHOWN]
    numbers = [*map(table.number, range(len(names)))]
    return {"names": names, "units": units, "numbers": numbers, "rows": rows, "channels": places}


def _guess_channels(tables: list[RawTable], path: Path, profile: Profile) -> tuple[list[RawTable], dict[str, Channel]]:
    """Return the tables of the tests of a file, and the channels of the first."""
    tables = test_tables(described(tables, path, profile), profile)
    try:
        tables = tables_of_tests(tables, profile)[0]
        table = tables[0]
        places = {name: (entry.column, entry.unit) for name, entry in assign(table, profile).items()}
    except InputError:
        table, proposed = tables[0], propose(tables[0])
        tables = [table, *(other for other in tables[1:] if propose(other).keys() == proposed.keys())]
        places = {name: place for name, place in proposed.items() if name not in profile.channels}
    channels = {}
    for name, (column, unit) in places.items():
        says: dict[str, Any] = {"column": None, "unit": unit or None}
        if column is not None:
            header = table.names[column]
            says["column"] = header if header and table.names.count(header) == 1 else table.number(column)
            says |= {"sign": -1} if sign_of(table, profile, name) == -1 else {}
        stated = profile.channel(name).model_dump(exclude_unset=True, exclude_none=True)
        channels[name] = Channel(**{**says, **stated})
    return tables, channels


def tree_lines(paths: Iterable[str | Path], profile: Profile | str | Path | None = None) -> list[str]:
    """List the contents of files and folders as lines: tables, their columns, and the text beside them.

    Tables that hold the same columns are one entry with a count.
    """
    profile = profile_of(profile)
    alike: dict[tuple[tuple[int, Header], ...], tuple[list[str], list[str]]] = {}  # tables, lines beside one
    problems = []
    with unpacked(paths) as given:
        for path in files_in(given)[0]:
            try:
                with raw_tables(path, profile.file) as tables:
                    for table in tables:
                        beside = [*(f"{name} = {value:g}" for name, value in table.constants.items()), *table.remarks]
                        numbered = tuple((table.number(i), header) for i, header in enumerate(table.headers))
                        names, _ = alike.setdefault(numbered, ([], beside))
                        names.append(f"{path.name}: {table.label}" if table.label else path.name)
            except InputError as error:
                problems.append(f"{path.name}: {error.found} [{error.code}]")
    lines: list[str] = []
    for columns, (names, beside) in alike.items():
        shown = listed(names, _MOST_NAMES)
        lines.append(shown if len(names) == 1 else f"{len(names)} tables with the same columns: {shown}")
        called = {i: c.name or "(no name)" for i, c in columns}
        lines += [f"  {i}  {called[i]}{f' [{c.unit}]' if c.unit else ''}" for i, c in columns[:_MOST_COLUMNS]]
        if columns[_MOST_COLUMNS:]:
            lines.append(f"  ... and {len(columns) - _MOST_COLUMNS} more columns")
        lines += [f"  beside them: {text[:100]}" for text in beside[:_MOST_REMARKS]]
    return lines + problems


def columns_of(path: str | Path, profile: Profile | str | Path | None = None) -> dict[int, str]:
    """Names of the columns of a file's first table, by their numbers; empty if it cannot be opened."""
    return {number: name for number, (name, _) in headings_of(path, profile_of(profile)).items()}


def unset_keys(
    errors: Iterable[InputError], columns: Mapping[int, str] = MappingProxyType({}), taken: Collection[Any] = ()
) -> dict[str, list[str]]:
    """Return by section the lines of keys of a profile that refusals ask for, with values that each may have behind #.

    The columns are those of the refused file by their numbers; those that are taken are not offered.
    """
    keys: dict[str, dict[str, list[str]]] = {f"channels.{role}": {"sign": []} for role in SIGNED}
    for remedy in dict.fromkeys(error.remedy for error in errors):
        for section, text in _SECTIONS.findall(remedy):
            for key in _KEYS.get(section, _KEYS["channels"]):
                stated = re.findall(rf"\b{key} = \[([^\]]*)\]", text)
                if re.search(rf"\b{key}\b", text):
                    keys.setdefault(section, {}).setdefault(key, []).extend(stated)
    lines = {section: list[str]() for section in keys}
    names = [*columns.values()]
    places = [name if names.count(name) == 1 else number for number, name in columns.items()]
    for section, key, stated in ((section, *entry) for section, asked in keys.items() for entry in asked.items()):
        dimension = DIMENSION.get(section.removeprefix("channels."), "")
        free = [place for place in places if place not in taken]
        free.sort(key=lambda place, own=dimension: split_name(str(place)).dimension != own)
        values = {"column": free, "unit": _UNITS.get(dimension, ())}.get(key, ())
        value = f"[{', '.join(dict.fromkeys(stated))}]" if stated else _MEANT.get(key, "  # ")
        lines[section].append(f"{key} = {value}{' or '.join(map(toml, values))}")
    return lines


@dataclass(frozen=True, slots=True)
class Answer:
    """A possible answer: what a channel's key in the profile is then."""

    channel: str
    key: str
    value: str | int

    def applied(self, profile: Profile) -> Profile:
        """Return the profile with this answer."""
        settings = profile.channel(self.channel).model_dump(exclude_unset=True, exclude_none=True)
        channel = Channel(**{**settings, self.key: self.value})
        return profile.model_copy(update={"channels": {**profile.channels, self.channel: channel}})


@dataclass(frozen=True, slots=True)
class Question:
    """Question that a file leaves open, and its possible answers."""

    text: str
    answers: tuple[Answer, ...]


def question_of(error: InputError, columns: Mapping[int, str] = MappingProxyType({})) -> Question | None:
    """Return the question behind a refusal that a profile answers; None where the file itself must be corrected.

    The columns are the names of those of the refused file by their numbers, empty where there is none.
    """
    match = _ROLE.search(error.remedy or "")
    role = match[1] if match else ""
    if role not in DIMENSION or " scale = " in error.remedy:  # with its unit: two keys
        return None
    if error.code == "E_UNITS_MISSING" or (error.code == "E_AMBIGUOUS" and "] unit = " in error.remedy):
        units = _UNITS.get(DIMENSION[role], ())
        return Question(f"{error.found}. Unit of the {role}?", tuple(Answer(role, "unit", unit) for unit in units))
    if error.code in ("E_COLUMN", "E_AMBIGUOUS", "E_DUPLICATE_COLUMN"):
        names = [*columns.values()]
        named = [name for name in names if name and names.count(name) == 1]
        answers = [Answer(role, "column", name) for name in named]
        answers += [Answer(role, "column", i) for i, name in columns.items() if name not in named]
        return Question(f"{error.found}. Which column is the {role}?", tuple(answers)) if answers else None
    if error.code in ("E_SIGN_CONVENTION", "E_DISSIPATION_SIGN"):
        return Question(f"{error.found}. Sign of the {role}?", (Answer(role, "sign", 1), Answer(role, "sign", -1)))
    return None
