"""Files beside tests: channels of one test in several files, also by a profile, lists, and helper tables."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.arrays import rescale
from mrdamper.errors import InputError
from mrdamper.rig_files.coil_current import as_data, current_of, with_value_of_name
from mrdamper.rig_files.column_names import SI, is_unit, role_of, split_name, words_of
from mrdamper.rig_files.columns import partly_assigned
from mrdamper.rig_files.file_records import Heading, digest_of, headings_of
from mrdamper.rig_files.mapping.completion import completed, item_of
from mrdamper.rig_files.mapping.description import SHORT_TEXTS, short_lines, with_notes
from mrdamper.rig_files.mapping.rasters import with_joined_rasters, with_one_clock
from mrdamper.rig_files.parts import tests_of
from mrdamper.rig_files.profile import Channel, FileForm, Profile
from mrdamper.rig_files.readers import ask_tables, raw_tables
from mrdamper.rig_files.readers.arrays import array_table
from mrdamper.rig_files.readers.base import RawTable, Source
from mrdamper.rig_files.record import REQUIRED, Finding, Record
from mrdamper.rig_files.rig_record import records_of

_FEWEST_ROWS = 50  # of a record
_CHANNEL = re.compile("(?i)ch(?:annel|an)?[0-9]{1,2}")  # number of a channel in the name of a file
_ROLES = (*REQUIRED[1:], "current")
_MOST_KINDS = 12
_SAME_START = 0.02  # of a record: clocks of two loggers that are one


@dataclass(frozen=True, eq=False)
class Part:
    """Channels of a test that lie in a file of their own."""

    path: Path
    table: RawTable  # in memory, its columns named by their channels, in SI
    key: tuple[str, ...]  # by which parts of one test belong together
    test: Path  # of which the name is that of the test, where this part has its force
    columns: str  # what was taken for its channels


def holds_channels(path: Path, form: FileForm) -> bool:
    """Tell if a table of a file has columns of a displacement and a force."""
    channels = ask_tables(path, lambda tables: [{header.channel for header in t.headers} for t in tables], [], form)
    return any({"displacement", "force"} <= of_table for of_table in channels)


def part_of(path: Path, profile: Profile, run: str = "") -> Part | None:
    """Return the channels of a file that is no whole test: several with a time, or the only one, which its name tells.

    None if it has none, or several tables or tests. Parts of one test have one `run`, or the same numbers in their
    names; files of one column lie in one folder and have one name beside the channel's: run7_force_N.txt, run7_t_s.txt.

    Raises `InputError` if the file of a `run` lacks a channel that the profile says is in it, or a time.
    """
    form = profile.file.model_copy(update={"separator": None, "decimal": None})  # it may be that of another file
    others = {role: channel for role, channel in profile.channels.items() if role != "time"}
    other_logger = profile.model_copy(update={"file": form, "channels": others})
    try:
        with raw_tables(path, profile.file) as tables:
            if len(tables) != 1 or not (run or len(tests_of(tables[0], profile.file, {})) == 1):
                return None
            table, alone = completed(with_notes(tables[0], path, profile)), len(tables[0].names) == 1
            called = {w.casefold() for name in tables[0].names * alone for w in words_of(name) if w.isalpha()}
            stated = [role for role, channel in profile.channels.items() if channel.file]
            assigned = partly_assigned(table, profile, [*["time"] * (not alone), *stated] if run else ())
            raw = table.read([entry.column for entry in assigned.values()])
            channels = {role: rescale(raw.values[e.column], e.factor, e.offset) for role, e in assigned.items()}
            current = None if alone else current_of(table, profile, path, channels.get("current"), slice(None))[0]
    except InputError:
        if run and other_logger != profile:
            return part_of(path, other_logger, run)
        if run:
            raise
        return None
    if not alone and "time" in channels:
        there = np.isfinite(channels["time"])
        channels = {role: values[there] for role, values in channels.items()}
    time = channels.get("time", np.empty(0))
    timed = len(channels) > 1 and time.size > 1 and bool(np.all(np.diff(time) > 0))
    if not channels or not (alone or timed):
        return part_of(path, other_logger, run) if run and other_logger != profile else None
    words = [word for word in words_of(split_name(path.stem).name) if role_of(word) not in assigned]
    words = [word for word in words if word.casefold() not in called and not _CHANNEL.fullmatch(word)]
    test = path.with_name(run or path.name) if run or not alone else path.parent / "_".join(words)
    remarks = list(table.remarks) if alone else [] if current is None else [f"current: {current!r} A"]
    columns = ", ".join(f"{role} = {e.name} in {e.unit}" for role, e in assigned.items())
    values = _table_of(table.source, channels, remarks)
    key = (run,) if run else ("column", str(test)) if alone else number_of(path)
    return Part(path, values.noted(*table.findings, *raw.findings), key, test, columns)


def _table_of(source: Source, channels: Mapping[str, Floats], remarks: Sequence[str]) -> RawTable:
    units = [SI[role] for role in channels]
    table = array_table(source, list(channels), units, list(channels.values()).__getitem__)
    return replace(table, remarks=tuple(remarks))


def number_of(path: Path) -> tuple[str, ...]:
    """Return the numbers in a file's name, by which files of one test belong together: not those of its channel."""
    stem = re.sub(r"(?i)(?<![a-z])ch[ _]?[0-9]$|^c[0-9](?=--)|(?<![0-9a-z])[23]d(?![0-9a-z])", "", path.stem)
    return str(path.parent), *(str(int(number)) for number in re.findall(r"[0-9]+", stem))


def joined_files(parts: Sequence[Part], profile: Profile) -> Iterator[tuple[list[Part], list[Record] | InputError]]:
    """Yield the parts that together are a test, and its records or why it cannot be used."""
    groups: dict[tuple[str, ...], list[Part]] = defaultdict(list)
    for part in parts:
        groups[part.key].append(part)
    delays = {role: Channel(delay_ms=c.delay_ms) for role, c in profile.channels.items() if c.delay_ms}
    own = profile.model_copy(update={"channels": delays})  # all else is done
    for group in groups.values():
        group.sort(key=lambda part: "force" not in part.table.names)
        names = [part.path.name for part in group]
        columns = "; ".join(part.columns for part in group)
        files = {"file": group[0].test.name, "files": ", ".join(names), "columns": columns}
        try:
            table = _together(group)
            records = [] if table is None else records_of(table, own, group[0].test)
            records = [with_value_of_name(record, group[0].test, profile) for record in records]
        except InputError as error:
            yield group, error
            continue
        if records:
            remarks = {key: as_data(text) for key, text in files.items()} | {"sha256": digest_of(group[0].path)}
            yield group, [replace(record, provenance={**record.provenance, **remarks}) for record in records]


def _together(parts: Sequence[Part]) -> RawTable | None:
    """Return the table of a test of which each part holds other channels; None if it is not whole."""
    tables = [part.table for part in parts]
    columns = {role: values for table in tables for role, values in zip(table.names, _arrays(table), strict=True)}
    if all(len(table.names) == 1 for table in tables):
        whole = {"displacement", "force"} <= set(columns) and len(columns) == len(tables)
        if not whole or len({values.size for values in columns.values()}) > 1:
            return None
        folder = parts[0].test
        texts = sorted({*folder.iterdir()} - {part.path for part in parts}) if folder.is_dir() else []
        lines = [line for path in texts if path.suffix.lower() in SHORT_TEXTS for line in short_lines(path)]
        own = dict.fromkeys(line for table in tables for line in table.remarks)
        return _table_of(tables[0].source, columns, [*own, *lines[:_FEWEST_ROWS]])
    if any("time" not in table.names for table in tables):
        return None
    clocks = [_arrays(table)[table.names.index("time")] for table in tables]
    moving = [time for time, table in zip(clocks, tables, strict=True) if {"displacement", "force"} & {*table.names}]
    span = clocks[0][-1] - clocks[0][0]
    if any(abs(time[i] - clocks[0][i]) > _SAME_START * span for time in moving for i in (0, -1)):
        return None
    joined = with_joined_rasters(tables) if len(tables) > 1 else []
    if len(joined) != 1:
        return None
    names = " and ".join(part.path.name for part in parts)
    findings = [finding for table in tables for finding in table.findings]
    table = with_one_clock(replace(joined[0], findings=tuple(findings)))
    return table.noted(Finding("W_RASTER", f"joined from {names}, on the force's clock"))


def _arrays(table: RawTable) -> list[Floats]:
    return list(table.read(range(len(table.names))).values.values())


def is_list(path: Path) -> bool:
    """Tell if a file holds only short tables without a time, or a displacement and a force: a plan, peak values."""

    def short(table: RawTable) -> bool:
        rows = table.words(0).codes.size
        roles = {header.role for header in table.headers}
        record = "time" in roles or {"displacement", "force"} <= roles
        return any(table.names) and rows < _FEWEST_ROWS and not record

    return ask_tables(path, lambda tables: all(map(short, tables)), False)


def is_helper(path: Path, files: Collection[Path]) -> bool:
    """Tell if a short text is no damaged test: no other file is called alike, or has its first line.

    Nor does a line of it head two of the columns that a record has.
    """
    others = [other for other in files if other != path]
    lines = short_lines(path) if path.suffix.lower() in SHORT_TEXTS else []
    alike = re.sub("[0-9]+", "0", path.stem) in {re.sub("[0-9]+", "0", other.stem) for other in others}
    if not others or alike or not 0 < len(lines) < _FEWEST_ROWS or not re.search(r"[^\W\d_]", "".join(lines)):
        return False
    cells = [[cell.strip() for cell in re.split(r"[,;\t|]", line)] for line in lines]
    roles = [{item_of(cell).role for cell in of if not is_unit(cell)} for of in cells]
    heads = any(len(of & {*REQUIRED}) > 1 for of in roles)
    return not heads and _first_line(path) not in map(_first_line, others)


def _first_line(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.readline(4096).strip()


def files_by_kind(files: Sequence[Path], profile: Profile) -> dict[str, Path]:
    """Return the first file of each kind by what a profile calls it, {run}/force.csv or force_{run}.csv.

    Empty unless two tests or more have a file of every kind; kinds of the same columns hold no whole tests.
    """
    for in_folders in (True, False):
        kinds = _kinds(files, in_folders)
        if 1 < len(kinds) <= _MOST_KINDS and len(set.intersection(*map(set, kinds.values()))) > 1:
            first = {pattern: next(iter(of.values())) for pattern, of in kinds.items()}
            headings = {tuple(headings_of(path, profile).values()) for path in first.values()}
            channels = [header for of in headings for _, header in of if header.role != "time"]
            return {} if len(headings) == 1 < len(channels) else first
    return {}


def _kinds(files: Sequence[Path], in_folders: bool) -> dict[str, dict[str, Path]]:
    """Return files by what a profile calls their kind, and by their test: its folder, or a number in their names."""
    kinds: dict[str, dict[str, Path]] = {}
    for path in [path for path in files if not re.search(r"[{}*]", path.name)]:
        number = re.search("[0-9]+", path.stem)
        if in_folders:
            kinds.setdefault(f"{{run}}/{path.name}", {})[str(path.parent)] = path
        elif number is not None:
            kind = f"{path.name[: number.start()]}{{run}}{path.name[number.end() :]}"
            kinds.setdefault(kind, {})[f"{path.parent}/{number[0]}"] = path
    return kinds


def with_files(guess: Profile, columns: Mapping[str, Mapping[int, Heading]]) -> Profile:
    """Return a profile with the file of each channel by the columns of each kind of file, as far as they tell it."""
    headings = {kind: [*of.values()] for kind, of in columns.items()}
    channels, free = dict(guess.channels), [*headings]
    for role in _ROLES:
        own = {kind: [name for name in of if name[1].role == role] for kind, of in headings.items()}
        stem = [kind for kind in free if role_of(Path(kind).stem.replace("{run}", "")) == role]
        kinds = [kind for kind in free if own[kind]] or stem
        if len(kinds) != 1:
            continue
        free.remove(kinds[0])
        channels[role] = _channel(kinds[0], own[kinds[0]] or headings[kinds[0]])
    open_roles = [role for role in _ROLES if not channels.get(role, Channel()).file]
    if len(free) == len(open_roles) == 1:
        channels[open_roles[0]] = _channel(free[0], headings[free[0]])
    time = channels.get("time", Channel()).column
    if not all(any(time in (name, header.name) for name, header in of) for of in headings.values()):
        channels.pop("time", None)
    return guess.model_copy(update={"channels": channels})


def _channel(kind: str, columns: Sequence[Heading]) -> Channel:
    """Return a channel of a file, with the only column of it that is no time."""
    others = [(name, header) for name, header in columns if header.role != "time"]
    if len(others) != 1:
        return Channel(file=kind)
    return Channel(file=kind, column=others[0][0], unit=others[0][1].unit or None)
