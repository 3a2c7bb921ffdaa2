"""From a rig's files to records and datasets: `read_run`, `import_files`, `to_dataset`."""

from __future__ import annotations

import contextlib
import fnmatch
import hashlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mrdamper.data import Dataset
from mrdamper.errors import ColumnError, CombinedError, InputError
from mrdamper.rig_files.coil_current import as_data, held_current_of
from mrdamper.rig_files.column_names import names_compression, names_made
from mrdamper.rig_files.columns import assign, propose, rate_of
from mrdamper.rig_files.long_records import judge_long
from mrdamper.rig_files.mapping.agreement import contradictions
from mrdamper.rig_files.mapping.clocks import with_time_stated
from mrdamper.rig_files.mapping.companions import (
    joined_parts,
    part_of,
    results_of,
    with_currents_of,
    with_results_of,
)
from mrdamper.rig_files.mapping.completion import completed
from mrdamper.rig_files.mapping.long_table import with_channels_as_columns
from mrdamper.rig_files.mapping.proposals import with_channels_by_physics, with_unit_of_time
from mrdamper.rig_files.mapping.rasters import with_joined_rasters, with_one_clock
from mrdamper.rig_files.mapping.results import with_results
from mrdamper.rig_files.mapping.tree import FileTree, nodes_of, problem_of
from mrdamper.rig_files.packed_folder import is_packed_folder, unpacked
from mrdamper.rig_files.parts import tests_of
from mrdamper.rig_files.profile import Channel, Profile, current_pattern, load_profile, profile_hash
from mrdamper.rig_files.readers import raw_tables, suffixes
from mrdamper.rig_files.readers.base import NoTableError, RawTable, RigFileError
from mrdamper.rig_files.record import Finding, Record
from mrdamper.rig_files.rig_record import joined, records_of
from mrdamper.rig_files.tests_table import NAME as TESTS
from mrdamper.rig_files.tests_table import TestsTable, applied, load_tests

_MAY_BE_PARTS = ("E_COLUMN", "E_UNITS_MISSING", "E_UNITS_DIMENSION", "E_AMBIGUOUS", "E_NO_DATA", "E_NUMBER")
_ROWS_SHOWN, _MOST_SHOWN = 6, 30  # rows and columns of a preview


@dataclass(frozen=True, eq=False)
class Refusal:
    """A file or a test of it that cannot be used, and why."""

    file: str
    error: InputError
    run: str = ""  # of a test that could be read and not used, its name


@dataclass(frozen=True, eq=False)
class Preview:
    """How a file begins, and what its columns are taken for."""

    names: tuple[str, ...]  # one a column
    units: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]  # the first, cell by cell
    channels: Mapping[str, tuple[int | None, str, int]]  # by channel its column, unit and sign, as far as known


@dataclass(frozen=True, eq=False)
class ImportResult:
    """What came of a set of files."""

    records: tuple[Record, ...]  # accepted, with their findings, in the order of the files
    refusals: tuple[Refusal, ...] = ()
    left_out: tuple[str, ...] = ()  # files of the folders that are no rig's: of other kinds, or texts without a table


def read_run(path: str | Path, profile: Profile | str | Path | None = None) -> Record:
    """Read one test from a rig's file and judge it.

    Parameters
    ----------
    path : path
        Delimited text, workbook, Parquet, MAT, HDF5, TDMS, MDF or NPZ, also packed as gz or zip.
    profile : Profile or path, optional
        What the file does not say.

    Returns
    -------
    Record
        SI channels, NaN where a sample is missing, with findings. Its current is None where
        neither file, name nor profile states one.

    Raises
    ------
    InputError
        With a stable code, the file, the line and column where there is one, and the remedy.
    """
    records = read_runs(path, profile)
    if len(records) != 1:
        raise RigFileError(
            "E_BLOCKS",
            f"holds {len(records)} tests",
            file=Path(path).name,
            mend='use read_runs, or say blocks = "join" under [file] of a profile',
        )
    return records[0]


def read_runs(path: str | Path, profile: Profile | str | Path | None = None) -> tuple[Record, ...]:
    """Read every test of a rig's file and judge it: testing machines record several blocks; as `read_run`."""
    from mrdamper.rig_files.quality import judge

    with np.errstate(all="ignore"):  # numbers near the end of the range overflow in sums and are refused as such
        return tuple(judge_long(record, judge) for record in _unjudged(Path(path), _profile(profile)))


def guess_profile(path: str | Path, profile: Profile | str | Path | None = None) -> Profile:
    """How a file is read, as a profile that can be saved, completed and used for its folder.

    Reading with it gives the same record. What the file does not say is left out of it.

    Raises
    ------
    InputError
        If the form of the file cannot be found.
    """
    profile = _profile(profile)
    with raw_tables(path, profile.file) as tables:
        table, channels = _guess_channels(_parts(tables, profile), profile)
    form = {**table.form, **profile.file.model_dump(exclude_defaults=True)}
    if not any(table.names):
        form["names"] = tuple(f"column {i + 1}" for i in range(len(table.names)))
    stated = "current" in channels or held_current_of(table) is not None
    rate = rate_of(table, profile) if "time" not in channels or channels["time"].column is None else None
    if rate:
        form["sample_rate_Hz"] = rate
        channels.pop("time", None)
    pattern = None if stated else current_pattern(Path(path).name)
    update = {
        "file": type(profile.file)(**form),  # type: ignore[arg-type]
        "channels": {**profile.channels, **channels},
        "current": profile.current or pattern,
    }
    return profile.model_copy(update=update)


def preview(path: str | Path, profile: Profile | str | Path | None = None) -> Preview:
    """How a file begins, for columns to be chosen by eye.

    Raises
    ------
    InputError
        If the form of the file cannot be found.
    """
    profile = _profile(profile)
    with raw_tables(path, profile.file) as tables:
        table, channels = _guess_channels(_parts(tables, profile), profile)
        cells = [_first_cells(table, column) for column in range(min(len(table.names), _MOST_SHOWN))]
        places = {
            name: (_place(table, channel.column), channel.unit or "", channel.sign)
            for name, channel in channels.items()
        }
    rows = tuple(tuple(column[i] if i < len(column) else "" for column in cells) for i in range(_ROWS_SHOWN))
    return Preview(table.names[:_MOST_SHOWN], table.units[:_MOST_SHOWN], rows, places)


def _first_cells(table: RawTable, column: int) -> list[str]:
    try:
        return [f"{value:g}" for value in table.read([column]).values[column][:_ROWS_SHOWN]]
    except InputError:
        return [table.odd[column]] if table.odd else []


def _place(table: RawTable, column: str | int | None) -> int | None:
    if isinstance(column, str):
        return table.names.index(column) if column in table.names else None
    return None if column is None else column - 1


def _guess_channels(tables: list[RawTable], profile: Profile) -> tuple[RawTable, dict[str, Channel]]:
    try:
        table = _tables_with_channels(tables, profile)[0]
        places = {name: (entry.column, entry.unit) for name, entry in assign(table, profile).items()}
    except InputError:
        table = tables[0]
        places = {name: place for name, place in propose(table).items() if name not in profile.channels}
    channels = {}
    for name, (column, unit) in places.items():
        says: dict[str, Any] = {"column": None, "unit": unit or None}
        if column is not None:
            header = table.names[column]
            says["column"] = header if header and table.names.count(header) == 1 else column + 1
            if name in ("displacement", "force") and names_compression(header):
                says["sign"] = -1
        stated = profile.channel(name).model_dump(exclude_unset=True, exclude_none=True)
        channels[name] = Channel(**{**says, **stated})
    return table, channels


@contextlib.contextmanager
def first_file(paths: Sequence[str | Path]) -> Iterator[Path]:
    """The first file among files, folders and archives, for as long as the block goes."""
    with unpacked(paths) as given:
        yield _files(given)[0][0]


def import_files(
    paths: Iterable[str | Path],
    profile: Profile | str | Path | None = None,
    *,
    tests: str | Path | TestsTable | None = None,
    progress: Callable[[str, float], None] = lambda what, share: None,
) -> ImportResult:
    """Read and judge files and folders of files; a refused file or test does not stop the others.

    Parameters
    ----------
    paths : iterable of path
        Of a folder, every file with a suffix of a known format is read, in the order of names.
    profile : Profile or path, optional
        For all of them.
    tests : TestsTable or path, optional
        Table of tests; default: `tests.csv` of the folder, if it holds one.
    progress : callable
        Is told the file and the share done.

    Raises
    ------
    InputError
        If the profile or the table of tests cannot be read, or a folder holds no rig's file.

    Examples
    --------
    >>> import numpy as np
    >>> from mrdamper import import_files
    >>> t = np.arange(0.0, 4.0, 0.002)
    >>> table = np.column_stack([t, 10 * np.sin(2 * np.pi * t), 400 * np.cos(2 * np.pi * t)])
    >>> np.savetxt("test_0.5A.csv", table, delimiter=",", header="time_s,displacement_mm,force_N", comments="")
    >>> [record.id for record in import_files(["test_0.5A.csv"]).records]
    ['test_0.5A']
    """
    profile = _profile(profile)
    with unpacked(paths) as given:
        beside = [path / TESTS for path in given if (path / TESTS).is_file()]
        if tests is None and beside:
            tests = beside[0]
        table = tests if tests is None or isinstance(tests, TestsTable) else load_tests(tests)
        files, left_out = _files(given)
        left_out += [path for path in files if _is_left_out(path.name, profile)]
        files = [path for path in files if not _is_left_out(path.name, profile)]
        intake = _Intake(profile, table)
        for number, path in enumerate(files):
            progress(path.name, number / len(files))
            intake.read(path, given=path in given)
        intake.join()
        if table is not None:
            table.require_found(intake.met)
        refusals = intake.refusals
        if intake.records or refusals:
            left_out += [Path(note.file) for note in intake.notes]
        else:
            refusals = intake.notes
        return ImportResult(with_unique_ids(intake.records), tuple(refusals), tuple(path.name for path in left_out))


class _Intake:
    """The tests of a set of files: checked, refused, or still without a current that another file may state."""

    def __init__(self, profile: Profile, table: TestsTable | None):
        self._profile, self._table = profile, table
        self._order: dict[str, int] = {}
        self._pending: list[tuple[Path, Record]] = []
        self._found: list[tuple[int, Record]] = []
        self.refusals: list[Refusal] = []
        self.notes: list[Refusal] = []  # texts of a folder that hold no table
        self.met: list[tuple[Path, str]] = []

    @property
    def records(self) -> list[Record]:
        """The accepted tests, in the order of their files."""
        return [record for _, record in sorted(self._found, key=lambda entry: entry[0])]

    def read(self, path: Path, *, given: bool) -> None:
        """Read a file, and check the tests in it whose current is known."""
        self._order[str(path)] = len(self._order)
        try:
            with np.errstate(all="ignore"):  # numbers near the end of the range overflow in sums and are refused
                records = _unjudged(path, self._profile)
        except InputError as error:
            refusals = [Refusal(str(path), one) for one in getattr(error, "errors", (error,))]
            self.met.append((path, ""))
            if not given and [type(refusal.error) for refusal in refusals] == [NoTableError]:
                self.notes += refusals
            else:
                self.refusals += refusals
            return
        self.met += [(path, record.id) for record in records]
        for record in records:
            known, problems = record, []
            if self._table is not None:
                try:
                    known = applied(record, self._table.of(path, record.id), self._table)
                except InputError as error:
                    problems.append(error)
            if known.current is None and not problems:
                self._pending.append((path, known))
            else:
                self._check(path, known, problems, several=len(records) > 1)

    def _check(self, path: Path, record: Record, problems: list[InputError], *, several: bool) -> None:
        from mrdamper.rig_files.quality import judge

        judged = record
        for step in (_with_current, lambda record: judge_long(record, judge)):
            try:
                with np.errstate(all="ignore"):
                    judged = step(judged)
            except InputError as error:
                problems.append(error)
        where = f"{path}, {record.id}" if several else str(path)
        self.refusals += [Refusal(where, problem, record.id) for problem in problems]
        if not problems:
            self._found.append((self._order[str(path)], judged))

    def join(self) -> None:
        """Join tests with what other files state of them, and check what was waiting."""
        others = [Path(refusal.file) for refusal in self.refusals if refusal.error.code in _MAY_BE_PARTS]
        others = [path for path in dict.fromkeys(others) if path.is_file()]
        parts = [part for path in others if (part := part_of(path, self._profile))]
        used: set[Path] = set()
        for record, paths in joined_parts(parts, self._profile):
            used |= set(paths)
            if record.current is None:
                self._pending.append((paths[0], record))
            else:
                self._check(paths[0], record, [], several=False)
        pending = self._pending
        joined = with_currents_of(pending, parts) if pending and parts else None
        if joined:
            used |= {path for _, path in joined}
            pending = [(path, record) for (path, _), (record, _) in zip(pending, joined, strict=True)]
        elif pending:
            notes = [Path(note.file) for note in self.notes]
            for path in [path for path in (*others, *notes) if path not in used]:
                results = results_of(path)
                stated = with_results_of(pending, results, path) if results else None
                if stated:
                    pending = [(file, record) for (file, _), record in zip(pending, stated, strict=True)]
                    used.add(path)
                    break
        self.refusals = [refusal for refusal in self.refusals if Path(refusal.file) not in used]
        self.notes = [note for note in self.notes if Path(note.file) not in used]
        files = [path for path, _ in pending]
        for path, record in pending:
            self._check(path, record, [], several=files.count(path) > 1)
        self._refuse_contradictions()

    def _refuse_contradictions(self) -> None:
        """Refuse tests of equal conditions whose forces differ several-fold."""
        found = sorted(self._found, key=lambda entry: entry[0])
        refused = contradictions([record for _, record in found])
        names = {number: name for name, number in self._order.items()}
        for i, error in refused.items():
            number, record = found[i]
            self.refusals.append(Refusal(names[number], error, record.id))
        self._found = [entry for i, entry in enumerate(found) if i not in refused]


def scan(paths: Iterable[str | Path], profile: Profile | str | Path | None = None) -> tuple[FileTree, ...]:
    """What is in files and folders: of every file its tables, their columns, and what stands beside them."""
    profile = _profile(profile)
    trees = []
    with unpacked(paths) as given:
        for path in _files(given)[0]:
            try:
                with raw_tables(path, profile.file) as tables:
                    trees.append(FileTree(path.name, nodes_of(tables)))
            except InputError as error:
                trees.append(FileTree(path.name, (), problem_of(error)))
    return tuple(trees)


def columns_of(path: str | Path, profile: Profile | str | Path | None = None) -> tuple[str, ...]:
    """Names of the columns of a file's first table; empty if it cannot be opened."""
    profile = _profile(profile)
    try:
        with raw_tables(path, profile.file) as tables:
            return _parts(tables, profile)[0].names
    except InputError:
        return ()


def found_tests(
    paths: Iterable[str | Path], profile: Profile | str | Path | None = None
) -> tuple[tuple[Record, ...], tuple[Refusal, ...]]:
    """Every test that files hold, not judged, and the files that cannot be read: for a table of tests."""
    records: list[Record] = []
    refusals: list[Refusal] = []
    with unpacked(paths) as given:
        for path in _files(given)[0]:
            try:
                records += _unjudged(path, _profile(profile))
            except NoTableError as error:
                refusals += [Refusal(str(path), error)] if path in given else []
            except InputError as error:
                refusals.append(Refusal(str(path), error))
    return tuple(records), tuple(refusals)


def to_dataset(records: Sequence[Record], name: str = "dataset") -> Dataset:
    """The runs of judged records, with their provenance as notes.

    Raises
    ------
    InputError
        If a record has no current, or there is no record.
    """
    from mrdamper.rig_files.to_run import to_run

    return Dataset(tuple(to_run(_with_current(record)) for record in records), name)


def _profile(profile: Profile | str | Path | None) -> Profile:
    if profile is None:
        return Profile()
    return profile if isinstance(profile, Profile) else load_profile(profile)


def _unjudged(path: Path, profile: Profile) -> list[Record]:
    with raw_tables(path, profile.file) as tables:
        tables, made = _without_made(_tables_with_channels(_parts(tables, profile), profile))
        records: list[Record] = []
        problems: list[InputError] = []
        for table in tables:
            try:
                records += records_of(table, profile, path)
            except InputError as error:
                problems += getattr(error, "errors", (error,))
        CombinedError.raise_from(problems)
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    records = joined(records, profile, tables)
    remarks = {"file": as_data(path.name), "sha256": digest}
    if profile != Profile():
        remarks["profile_sha256"] = profile_hash(profile)
    records = [replace(record, provenance={**remarks, **record.provenance}) for record in records]
    if made:
        records[0] = records[0].noticed(Finding("W_TABLE", f"left out as made from the others: {', '.join(made)}"))
    if len({record.id for record in records}) < len(records):
        records = [replace(record, id=f"{record.id}_{i}") for i, record in enumerate(records, 1)]
    return records


def _parts(tables: list[RawTable], profile: Profile) -> list[RawTable]:
    kept = [table for table in tables if not (table.label and _is_left_out(table.label, profile))]
    if tables and not kept:
        raise tables[0].source.refuse("E_NO_DATA", "every table is left out", "correct [file] leave_out of the profile")
    tables = kept
    tables = with_joined_rasters([with_time_stated(completed(with_channels_as_columns(table))) for table in tables])
    tables = [with_one_clock(table) for table in tables]
    parts = [part for table in tables for part in ([table] if table.fallback else tests_of(table, profile.file))]
    parts = [with_channels_by_physics(with_unit_of_time(table), _said(profile)) for table in with_results(parts)]
    return parts


def _is_left_out(name: str, profile: Profile) -> bool:
    return any(fnmatch.fnmatch(name.casefold(), pattern.casefold()) for pattern in profile.file.leave_out)


def _said(profile: Profile) -> list[str]:
    """The channels whose column the profile names."""
    return [name for name, channel in profile.channels.items() if channel.column is not None]


def _tables_with_channels(tables: list[RawTable], profile: Profile) -> list[RawTable]:
    """Leave out the tables of a file that hold something else, if one or more hold a test."""
    if len(tables) == 1:
        return tables
    first = None
    for fallback in (False, True):
        fitting = []
        for table in tables:
            if table.fallback is not fallback:
                continue
            try:
                assign(table, profile)
                fitting.append(table)
            except InputError as error:
                first = first or error
        if fitting:
            return fitting
    raise first or RigFileError("E_NO_DATA", "no table in this file")


def _without_made(tables: list[RawTable]) -> tuple[list[RawTable], list[str]]:
    """Leave out tables that by their name are filtered or computed, beside one that is not; and their names."""
    measured = [table for table in tables if not names_made(table.label)]
    if not measured or len(measured) == len(tables):
        return tables, []
    return measured, [table.label for table in tables if names_made(table.label)]


def _files(paths: Iterable[Path]) -> tuple[list[Path], list[Path]]:
    """The files to be read, and those of the folders that are of other kinds."""
    files: list[Path] = []
    others: list[Path] = []
    for path in paths:
        if not path.is_dir():
            files.append(path)
            continue
        inside = sorted(
            Path(folder) / name
            for folder, _, names in os.walk(path)
            for name in names
            if not name.startswith((".", "~$")) and name != TESTS
        )
        inside = [file for file in inside if file.is_file() and not is_packed_folder(file)]  # no pipes
        known = [file for file in inside if file.suffix.lower() in suffixes()]
        known = known or [file for file in inside if _is_table(file)]  # suffixes of a laboratory's own: run.001
        files += known
        read = set(known)
        others += [file for file in inside if file not in read]
    if not files:
        where = ", ".join(path.name for path in paths)
        found = f"no rig's file in this folder (found {', '.join(file.name for file in others[:5]) or 'nothing'})"
        mend = "export them as CSV, or give another folder" if others else "give another folder"
        raise RigFileError("E_NO_DATA", found, file=where, mend=mend)
    return files, others


def _is_table(path: Path) -> bool:
    try:
        with raw_tables(path) as tables:
            return any(table.names for table in tables)
    except InputError:
        return False


def _with_current(record: Record) -> Record:
    """The record, if it has a current."""
    if record.current is not None:
        return record
    why = [f.text for f in record.findings if f.text.startswith("the current channel")]
    raise ColumnError(
        why[0] if why else "no coil current in a column or in the file name",
        where=Path(record.provenance.get("file", record.id)).name,
        mend='write the currents into tests.csv (--write-tests), or say [current] pattern = "*_{current}A_*", '
        '[channels.current] column = "..." or, if all tests have one, [current] value = 0.5 in a profile',
        code="E_CURRENT_MISSING",
    )


def with_unique_ids(records: Iterable[Record]) -> tuple[Record, ...]:
    """Records told apart by their names: files of different folders may share one."""
    found: dict[str, Record] = {}
    for record in records:
        name, count = record.id, 2
        while name in found:
            name, count = f"{record.id}_{count}", count + 1
        found[name] = record if name == record.id else replace(record, id=name)
    return tuple(found.values())
