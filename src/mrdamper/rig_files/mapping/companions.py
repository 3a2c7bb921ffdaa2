"""Tests whose channels lie in two files, joined by the numbers in their names; and tables of results beside them."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mrdamper.data import Floats, held_current
from mrdamper.errors import ColumnError, InputError, printable
from mrdamper.rig_files.coil_current import as_data, constant, current_of
from mrdamper.rig_files.column_names import Header, role_of, split_name, words_of
from mrdamper.rig_files.columns import partly_assigned
from mrdamper.rig_files.conditions import amperes, contradicts
from mrdamper.rig_files.file_records import records_of_file
from mrdamper.rig_files.mapping.completion import completed
from mrdamper.rig_files.mapping.results import Results, lines_of, results_in
from mrdamper.rig_files.profile import Profile
from mrdamper.rig_files.readers import raw_tables
from mrdamper.rig_files.readers.arrays import array_table
from mrdamper.rig_files.record import Finding, Record
from mrdamper.rig_files.rig_record import records_of
from mrdamper.rig_files.units import DIMENSION

_FEWEST_ROWS = 50  # of a record
_LARGEST_TEXT = 2**18  # bytes
_TEXTS = (".csv", ".txt", ".tsv", ".dat", ".md", ".log")
_CODE = re.compile(r"\s*([A-Za-z]{1,6}[0-9]{1,3})\s*(?:=|:|->)\s*([0-9]{1,4}(?:[.,][0-9]{1,4})?)\s*(m?A)\s*$")
_SAME_START = 0.02  # of a record: clocks of two loggers that are one


@dataclass(frozen=True, eq=False)
class Part:
    """The channels of a file that are no whole test."""

    path: Path
    time: Floats  # (N,) [s]
    channels: Mapping[str, Floats]  # by name, (N,) in SI
    current: float | None = None  # [A] that the file states beside its columns
    run: str = ""  # name of its test, where the profile says which files belong together

    @property
    def key(self) -> tuple[str, ...]:
        """By which parts of one test belong together."""
        return (self.run,) if self.run else number_of(self.path)


def part_of(path: Path, profile: Profile, run: str = "") -> Part | None:
    """Return the channels with a time of a file that is no whole test; None if it has none, or several tables."""
    try:
        with raw_tables(path, profile.file) as tables:
            if len(tables) != 1:
                return None
            table = completed(tables[0])
            assigned = partly_assigned(table, profile)
            if "time" not in assigned or len(assigned) < 2:
                return None
            raw = table.read([entry.column for entry in assigned.values()]).values
            channels = {role: e.factor * raw[e.column] + e.offset for role, e in assigned.items()}
            current, _ = current_of(table, profile, path, channels.get("current"), slice(None))
    except InputError:
        return None
    time = channels.pop("time")
    there = np.isfinite(time)
    if np.count_nonzero(there) < 2 or np.any(np.diff(time[there]) <= 0):
        return None
    return Part(path, time[there], {role: values[there] for role, values in channels.items()}, current, run)


def joined_columns(paths: Sequence[Path], profile: Profile) -> list[tuple[list[Record], tuple[Path, ...]]]:
    """Return tests of which every channel is a file of one column, named by its file or heading, and these files.

    Files of one test lie in one folder and have one name beside the channel's: force_N.txt and time_s.txt, or
    run7_force_N.txt and run7_time_s.txt. They hold as many samples as each other.
    """
    groups: dict[tuple[Path, str], dict[Path, tuple[str, str, Floats]]] = defaultdict(dict)
    for path in paths:
        column = _only_column(path, profile)
        if column is not None:
            header = column[0]
            rest = [word for word in words_of(split_name(path.stem).name) if role_of(word) != header.role]
            groups[path.parent, "_".join(rest)][path] = header.name, header.unit, column[1]
    tests = []
    for (folder, rest), columns in groups.items():
        names, units, values = zip(*columns.values(), strict=True)
        roles = [role_of(name) for name in names]
        whole = {"displacement", "force"} <= set(roles) and len(set(roles)) == len(roles)
        if not whole or len({v.size for v in values}) > 1:
            continue
        first, where = next(iter(columns)), folder / rest if rest else folder
        try:
            with raw_tables(first, profile.file) as tables:
                table = array_table(tables[0].source, names, units, lambda i, values=values: values[i])
                records = records_of(table, profile, where)
        except InputError:
            continue
        files = {"file": as_data(where.name), "files": as_data(", ".join(path.name for path in columns))}
        tests.append(([replace(r, provenance={**files, **r.provenance}) for r in records], tuple(columns)))
    return tests


def _only_column(path: Path, profile: Profile) -> tuple[Header, Floats] | None:
    """Return the heading and numbers of a file of one column that its heading or its name says to be a channel."""
    named = split_name(path.stem)
    try:
        with raw_tables(path, profile.file) as tables:
            if len(tables) != 1 or len(tables[0].names) != 1:
                return None
            header = tables[0].headers[0]
            header = header if header.name else named
            fits = header.role is not None and header.dimension == DIMENSION.get(header.role)
            return (header, tables[0].read([0]).values[0]) if fits else None
    except InputError:
        return None


def number_of(path: Path) -> tuple[str, ...]:
    """Return the numbers in a file's name, by which files of one test belong together."""
    return str(path.parent), *(str(int(number)) for number in re.findall(r"[0-9]+", path.stem))


def with_currents_of(pending: Sequence[tuple[Path, Record]], parts: Sequence[Part]) -> list[tuple[Record, Path]] | None:
    """Return the records with the current of the other file of their number, and that file; None if one has none."""
    holders = [part for part in parts if "current" in part.channels and "force" not in part.channels]
    by_number = {number_of(part.path): part for part in holders}
    numbers = [number_of(path) for path, _ in pending]
    if len(by_number) < len(holders) or len(set(numbers)) < len(numbers) or not set(numbers) <= set(by_number):
        return None
    return [
        (_joined(record, by_number[number]), by_number[number].path)
        for (_, record), number in zip(pending, numbers, strict=True)
    ]


def _joined(record: Record, part: Part) -> Record:
    current = part.channels["current"]
    there = np.isfinite(current)
    held, change = held_current(current[there])
    if change:
        values = np.interp(record.time, part.time[there], current[there])
        values[~np.isfinite(record.time)] = np.nan
    else:
        values = constant(held, record.time)
    how = "interpolated onto the force's clock" if change else f"its mean {held:g} A"
    text = f"the current is that of {part.path.name}, {how}"
    provenance = {**record.provenance, "current_file": as_data(part.path.name)}
    return replace(record, current=values, provenance=provenance).noticed(Finding("W_RASTER", text))


def joined_parts(parts: Sequence[Part], profile: Profile) -> list[tuple[Record, tuple[Path, ...]]]:
    """Return tests whose displacement and force lie in two files of one number and one clock, and these files."""
    by_number: dict[tuple[str, ...], list[Part]] = defaultdict(list)
    for part in parts:
        by_number[part.key].append(part)
    records = []
    for group in by_number.values():
        loads = [part for part in group if "force" in part.channels]
        names = [name for part in group for name in part.channels]
        if len(group) < 2 or len(loads) != 1 or "displacement" not in names or len(set(names)) < len(names):
            continue
        clock = loads[0].time
        span = clock[-1] - clock[0]
        far = [abs(part.time[i] - clock[i]) > _SAME_START * span for part in group for i in (0, -1)]
        if any(far):
            continue
        channels = {
            name: values if part is loads[0] else np.interp(clock, part.time, values)
            for part in group
            for name, values in part.channels.items()
        }
        stated = {part.current for part in group} - {None}
        if "current" not in channels and len(stated) == 1:
            channels["current"] = constant(stated.pop() or 0.0, clock)
        files = [part.path.name for part in group]
        stem = re.sub(r"[^\w.+=-]+", "_", loads[0].run or loads[0].path.stem)
        remarks = {"file": as_data(files[0]), "files": as_data(", ".join(files)), "columns": ", ".join(names)}
        note = Finding("W_RASTER", f"joined from {' and '.join(files)}, on the force's clock")
        record = Record(
            id=stem, time=clock, findings=(note,), provenance=remarks, rig=profile.rig, excitation=profile.excitation,
            split=profile.split, **channels,  # type: ignore[arg-type]
        )  # fmt: skip
        records.append((record, tuple(part.path for part in group)))
    return records


def results_of(path: Path) -> Results | None:
    """Return the table of results that a file holds; None if it holds none."""
    try:
        if path.suffix.lower() in _TEXTS:
            with path.open("rb") as file:
                content = file.read(_LARGEST_TEXT + 1)
            if len(content) > _LARGEST_TEXT:
                return None
            return results_in(_decoded(content).splitlines())
        with raw_tables(path) as tables:
            tables_of_results = [results for table in tables[:20] if (results := results_in(lines_of(table)))]
            return tables_of_results[0] if len(tables_of_results) == 1 else None
    except (InputError, OSError, UnicodeError):
        return None


def _decoded(content: bytes) -> str:
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252")


def with_results_of(pending: Sequence[tuple[Path, Record]], results: Results, path: Path) -> list[Record] | None:
    """Return the records with the currents that a table of results states; None unless it names every one of them."""
    currents = results.by_test(_called(pending))
    if len(currents) < len(pending):
        return None
    whence = f"{path.name}, {results.title}"
    return [_with_stated(record, currents[i], whence) for i, (_, record) in enumerate(pending)]


def _called(tests: Sequence[tuple[Path, Record]]) -> list[tuple[str, ...]]:
    """Names of each test: its own, that of its file, and its own without that of its file."""
    stems = [re.sub(r"[^\w.+=-]+", "_", file.stem) for file, _ in tests]
    return [
        (record.id, file.name, file.stem, record.id.removeprefix(stem).lstrip("_"))
        for (file, record), stem in zip(tests, stems, strict=True)
    ]


def tests_by(path: Path, results: Results, profile: Profile) -> list[Record]:
    """The tests of a file whose column numbers them as a table of results does; empty if it has no such column."""
    try:
        with raw_tables(path, profile.file) as tables:
            column = results.column_of_tests(tables[0]) if len(tables) == 1 else None
        if column is None:
            return []
        form = profile.file.model_copy(update={"run_column": column})
        return records_of_file(path, profile.model_copy(update={"file": form}))[0]
    except InputError:
        return []


def with_legend_of(pending: Sequence[tuple[Path, Record]], path: Path) -> list[Record] | None:
    """Return the records with the currents that the codes in their names stand for, by a legend: I1 = 0.3 A.

    None unless the name of every file holds one of the codes, between separators.
    """
    if path.suffix.lower() not in _TEXTS or path.stat().st_size > _LARGEST_TEXT:
        return None
    matches = [match for line in _decoded(path.read_bytes()).splitlines() if (match := _CODE.match(line))]
    codes = {match[1].casefold(): amperes(match[2], match[3]) for match in matches}
    if len(codes) < 2 or len(codes) < len(matches):
        return None
    words = [re.split(r"[^0-9A-Za-z]+", file.stem.casefold()) for file, _ in pending]
    stated = [[code for code in codes if code in parts] for parts in words]
    if any(len(own) != 1 for own in stated):
        return None
    return [
        _with_stated(record, codes[own[0]], f"{path.name}, {own[0].upper()}")
        for (_, record), own in zip(pending, stated, strict=True)
    ]


def _with_stated(record: Record, current: float, whence: str) -> Record:
    remarks = {**record.provenance, "current_from": as_data(whence)}
    return replace(record, current=constant(current, record.time), provenance=remarks)


def contradictions_with(
    tests: Sequence[tuple[Path, Record]], results: Results, path: Path
) -> dict[int, InputError] | None:
    """Refusals of tests whose current a table of results contradicts, by number; None unless it names every test."""
    currents = results.by_test(_called(tests))
    if len(currents) < len(tests):
        return None
    refused: dict[int, InputError] = {}
    for i, (file, record) in enumerate(tests):
        held, change = held_current(record.current) if record.current is not None else (currents[i], "")
        if not change and contradicts(held, currents[i]):
            refused[i] = ColumnError(
                printable(f"the test gives {held:g} A, {path.name} {currents[i]:g} A"), where=printable(file.name),
                remedy="correct the one that is wrong, or take the table out of the folder",
                code="E_CURRENT_CONTRADICTS",
            )  # fmt: skip
    return refused


def is_list(path: Path) -> bool:
    """Tell if a file holds only short tables without a time, or a displacement and a force: a plan, peak values."""
    try:
        with raw_tables(path) as tables:
            rows = [table.words(0).codes.size if table.words is not None else _FEWEST_ROWS for table in tables]
            named = all(any(table.names) for table in tables)
            roles = [{header.role for header in table.headers} for table in tables]
    except InputError:
        return False
    return named and max(rows) < _FEWEST_ROWS and not any("time" in r or {"displacement", "force"} <= r for r in roles)
