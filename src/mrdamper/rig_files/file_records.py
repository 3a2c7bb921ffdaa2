"""The files of folders and archives that may hold tests, and the records of one file, not yet checked."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import tarfile
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import IO

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.temporary import temporary_folder
from mrdamper.errors import ColumnError, CombinedError, InputError, listed, printable
from mrdamper.rig_files.coil_current import as_data, ask_current_too, with_value_of_name
from mrdamper.rig_files.column_names import COMPUTED, Header, holds, words, words_of
from mrdamper.rig_files.columns import assign, partly_assigned, with_sums
from mrdamper.rig_files.mapping.clocks import with_time_stated
from mrdamper.rig_files.mapping.completion import completed
from mrdamper.rig_files.mapping.description import READ_FOLDERS, with_description, with_notes
from mrdamper.rig_files.mapping.proposals import with_channels_by_physics, with_integrated_velocity, with_unit_of_time
from mrdamper.rig_files.mapping.rasters import with_joined_rasters, with_one_clock
from mrdamper.rig_files.mapping.result_tables import form_of_tests, with_results
from mrdamper.rig_files.parts import tests_of, with_channels_as_columns
from mrdamper.rig_files.profile import Profile, profile_hash, toml
from mrdamper.rig_files.readers import archive, ask_tables, raw_tables, suffixes
from mrdamper.rig_files.readers.base import MOST_RATIO, MOST_UNPACKED, Content, RawTable, RigFileError, Source
from mrdamper.rig_files.record import REQUIRED, Finding, Record
from mrdamper.rig_files.rig_record import records_of
from mrdamper.rig_files.sequences import joined, names_of_blocks
from mrdamper.rig_files.tests_table import NAME as TESTS

_ROWS_OF_A_TEST = 0.25  # share of the rows of another test of the file that a test has at least
_RAW = words("raw")
Heading = tuple[str, Header]
_MOST_MEMBERS = 10_000
_PIECE = 2**20
_NESTED = (".zip", ".gz", ".tgz", ".tar", ".bz2", ".xz", ".7z", ".rar")


def records_of_file(path: Path, profile: Profile) -> tuple[list[Record], list[InputError]]:
    """Read the tests of a file, and why others of its tests cannot be used.

    Raises `InputError` if no test of the file can be used.
    """
    with raw_tables(path, profile.file) as every:
        tables, problems = tables_of_tests(test_tables(described(every, path, profile), profile), profile)
        measured = [table for table in tables if not holds(table.label, COMPUTED)] or tables
        computed = [table.label for table in tables if table not in measured]  # beside one that was measured
        tables = measured
        blocks = [n for n, table in enumerate(tables, 1) if table.label.startswith("block")]
        numbers = [n for n, t in enumerate(tables, 1) if n not in blocks or not profile.leaves_out(t.label)]
        count, tables = len(tables), [tables[n - 1] for n in numbers]
        records: list[Record] = []
        for table in tables:
            try:
                records += records_of(table, profile, path)
            except InputError as error:
                problems += getattr(error, "errors", (error,))
        if not records or blocks:
            CombinedError.raise_from(problems)
        digest = digest_of(path)
    records = joined(records, profile, tables)
    endings: Sequence[object] = numbers if len(records) == len(numbers) else range(1, len(records) + 1)
    if len(tables) == len(records) and all(table.label.startswith("block") for table in tables):
        names, every = names_of_blocks(tables)
        endings = names or endings
        named = zip(records, every, strict=False)
        records = [replace(r, provenance={**r.provenance, "block": as_data(name)}) for r, name in named] or records
    remarks = {"file": as_data(path.name), "sha256": digest}
    if profile != Profile():
        remarks["profile_sha256"] = profile_hash(profile)
    records = [replace(record, provenance={**remarks, **record.provenance}) for record in records]
    if computed:
        finding = Finding("W_TABLE", f"tables of filtered or computed values are left out: {', '.join(computed)}")
        records[0] = records[0].noticed(finding)
    if len({record.id for record in records}) < len(records) or len(records) == len(numbers) < count:
        records = [replace(record, id=f"{record.id}_{end}") for end, record in zip(endings, records, strict=True)]
    named = []
    for record in records:
        try:
            named.append(with_value_of_name(record, path, profile))
        except InputError as error:
            problems.append(error)
    if not named:
        CombinedError.raise_from(problems)
    return named, problems


def described(tables: list[RawTable], path: Path, profile: Profile) -> list[RawTable]:
    """Return the tables of a file with what the texts beside it state, without columns that a profile leaves out."""
    tables = [_without_left_out(table, profile) for table in tables]
    own = [with_description(tables[0], path, profile)] if len(tables) == 1 else tables
    return [with_notes(table, path, profile) for table in own]


def _without_left_out(table: RawTable, profile: Profile) -> RawTable:
    kept = [i for i, name in enumerate(table.names) if not (name and profile.leaves_out(name))]
    if not kept or len(kept) == len(table.names):
        return table

    def read(columns: Sequence[int]) -> Content:
        content = table.read([kept[i] for i in columns])
        return replace(content, values={i: content.values[kept[i]] for i in columns})

    return table.picked(kept, read)


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def test_tables(tables: list[RawTable], profile: Profile) -> list[RawTable]:
    """Split and complete the tables of a file until each holds one test, or none."""
    omitted = [table.label != "" and profile.leaves_out(table.label) for table in tables]
    if tables and all(omitted):
        raise tables[0].source.refuse("E_NO_DATA", "every table is left out", "correct [file] leave_out of the profile")
    tables = [t for t, out in zip(tables, omitted, strict=True) if not out or t.label.startswith("block")]  # numbered
    tables = with_joined_rasters([with_time_stated(completed(with_channels_as_columns(table))) for table in tables])
    stated = {name: channel.column for name, channel in profile.channels.items() if channel.column is not None}
    tables = [with_one_clock(with_sums(table, profile), stated) for table in tables]
    forms = [form_of_tests(table, profile.file) for table in tables]
    parts = [part for t, form in zip(tables, forms, strict=True) for part in tests_of(t, form, stated)]
    timed = [with_integrated_velocity(with_unit_of_time(table)) for table in with_results(parts)]
    return [with_channels_by_physics(table, stated) for table in timed]


def headings_of(path: str | Path, profile: Profile) -> dict[int, Heading]:
    """Return the columns of a file's first table by their numbers: the name as it stands, and apart from its unit."""

    def both(tables: list[RawTable]) -> dict[int, Heading]:
        table = test_tables(tables, profile)[0]
        return {table.number(i): of for i, of in enumerate(zip(table.names, table.headers, strict=True))}

    return ask_tables(path, both, {}, profile.file)


def clock_of(path: Path, profile: Profile) -> Floats:
    """Return the clock [s] of a file, which may be damaged elsewhere; empty where none can be read."""

    def clock(tables: list[RawTable]) -> Floats:
        table = test_tables(tables, profile)[0]
        time = partly_assigned(table, profile).get("time")
        return time.factor * table.read([time.column]).values[time.column] if time else np.empty(0)

    return ask_tables(path, clock, np.empty(0), profile.file)


def tables_of_tests(tables: list[RawTable], profile: Profile) -> tuple[list[RawTable], list[InputError]]:
    """Select the tables that hold a whole test; refuse those that hold one without a channel it needs.

    Raises `InputError` if no table holds a test.
    """
    if len(tables) == 1:
        return tables, []
    fitting, others = list[RawTable](), list[tuple[RawTable, InputError]]()
    for table in tables:
        try:
            assign(table, profile)
            fitting.append(table)
        except InputError as error:
            others.append((table, error))
    if not fitting:
        table, error = others[0] if others else (None, RigFileError("E_NO_DATA", "no table in this file"))
        if table is not None:
            ask_current_too(error, table, profile, table.source.path)
        raise error
    tests = [i for i, (table, _) in enumerate(others) if _resembles_a_test(table, fitting, profile)]
    apart = [table for i, (table, _) in enumerate(others) if table.label and i not in tests]
    parts = [table.label for table in apart if len({*REQUIRED} & {*partly_assigned(table, profile)}) > 1]
    if parts:
        text = printable(f"tables without all channels are not taken for tests: {listed(parts, 5)}")
        fitting[0] = fitting[0].noted(Finding("W_TABLE", text))
    incomplete = list[InputError]()
    for table, error in (others[i] for i in tests):
        where, label = f"{printable(table.source.name)}, table {printable(table.label)}", toml(table.label)
        remedy = f"give it the channels of the other tables, or set [file] leave_out = [{label}] in a profile"
        incomplete.append(ColumnError(error.found, where=where, remedy=remedy, code=error.code))
    return fitting, incomplete


def _resembles_a_test(table: RawTable, tests: list[RawTable], profile: Profile) -> bool:
    """Tell if a table beside tests has a label or number of columns like one, its rows and two of their channels."""
    columns = [entry.column for role, entry in partly_assigned(table, profile).items() if role in REQUIRED]
    forms = {re.sub("[0-9]+", "0", test.label): test for test in tests if test.label}
    alike = next((test for test in tests if len(test.names) == len(table.names)), None)
    alike = alike or forms.get(re.sub("[0-9]+", "0", table.label))
    if alike is None or holds(table.label, COMPUTED) or len(columns) < len(REQUIRED) - 1:
        return False
    force = assign(alike, profile)["force"].column
    rows, usual = (of.read([i]).values[i].size for of, i in ((table, columns[0]), (alike, force)))
    return rows >= _ROWS_OF_A_TEST * usual


@contextlib.contextmanager
def unpacked(paths: Iterable[str | Path]) -> Iterator[list[Path]]:
    """Yield the same paths, with a folder in the place of every archive of several files; raises as `opened`."""
    with contextlib.ExitStack() as stack:
        members = []
        for path in map(Path, paths):
            members += [_folder_of(path, stack)] if _is_packed_folder(path) else [path]
            inside = sorted(path.rglob("*")) if path.is_dir() else ()
            members += [_folder_of(file, stack) for file in inside if _is_packed_folder(file)]
        stack.callback(READ_FOLDERS.reset, READ_FOLDERS.set(members))
        yield members


def files_in(paths: Iterable[Path]) -> tuple[list[Path], list[Path]]:
    """Return the files to be read, and those of the folders that are of other kinds."""
    files, others = list[Path](), list[Path]()
    for path in paths:
        if not path.is_dir():
            files.append(path)
            continue
        every = (Path(folder) / name for folder, _, names in os.walk(path) for name in names)
        inside = [file for file in every if not file.name.startswith((".", "~$")) and file.name != TESTS]
        inside.sort(key=_by_number)
        inside = [file for file in inside if file.is_file() and not _is_packed_folder(file)]  # no pipes
        recognised = [file for file in inside if file.suffix.lower() in suffixes()]
        # Suffixes of a laboratory's own: run.001
        recognised = recognised or [f for f in inside if ask_tables(f, lambda ts: any(t.names for t in ts), False)]
        recognised = _measured(recognised, path)
        files += recognised
        read = set(recognised)
        others += [file for file in inside if file not in read]
    if not files:
        where = ", ".join(path.name for path in paths)
        problem = f"no rig's file in this folder (found {', '.join(file.name for file in others[:5]) or 'nothing'})"
        remedy = "export them as CSV, or give another folder" if others else "give another folder"
        raise RigFileError("E_NO_DATA", problem, file=where, remedy=remedy)
    return files, others


def _by_number(path: Path) -> list[list[int | str]]:
    """Return the key of an order in which test 2 comes before test 10."""
    return [[int(text) if i % 2 else text for i, text in enumerate(re.split(r"([0-9]+)", part))] for part in path.parts]


def _measured(files: list[Path], top: Path) -> list[Path]:
    """Return the files without those called filtered, or in such a folder, beside one that is called alike, or raw."""
    computed = {file for file in files if holds(str(file.relative_to(top)), COMPUTED)}
    names = {file: tuple(w for w in words_of(file.name) if w.casefold() not in COMPUTED | _RAW) for file in files}
    measured = {name for file, name in names.items() if file not in computed}
    return [file for file in files if file not in computed or names[file] not in measured]


def _is_packed_folder(path: Path) -> bool:
    """Tell if a file is a tar, or a zip of several files."""
    name = path.name.lower()
    if name.startswith(".") or not path.is_file():
        return False
    if name.endswith((".tar", ".tgz", ".tar.gz")):
        return True
    if not name.endswith(".zip"):
        return False
    try:
        with zipfile.ZipFile(path) as packed:
            return len(archive.files_among(packed.infolist())) > 1
    except archive.UNREADABLE_ZIP:
        return False


def _folder_of(path: Path, stack: contextlib.ExitStack) -> Path:
    top = stack.enter_context(temporary_folder()) / path.name
    top.mkdir()
    if path.suffix.lower() == ".zip":
        with archive.as_it_is(path) as source, archive.zip_members(source) as (packed, members):
            _fill(source, top, ((member.filename, packed.open(member)) for member in members))
    else:
        with archive.opened(path, folder=True) as source:
            _untar(source, top)
    inside = list(top.iterdir())
    return inside[0] if len(inside) == 1 and inside[0].is_dir() else top


def _untar(source: Source, top: Path) -> None:
    try:
        with tarfile.open(fileobj=source.file, mode="r:") as packed:
            _fill(source, top, _files_of(source, packed))
    except RigFileError:
        raise
    except (tarfile.TarError, OSError, ValueError, EOFError) as error:
        code = "E_TRUNCATED" if "unexpected end" in str(error) else "E_ARCHIVE"
        raise source.refuse(code, f"damaged archive ({error})", "copy or pack it again") from error


def _files_of(source: Source, packed: tarfile.TarFile) -> Iterator[tuple[str, IO[bytes]]]:
    """Yield the names and contents of the files in a tar; refuse links, and names that lead out of it."""
    for member in packed:
        archive.check_member(source, member.name, link=not (member.isfile() or member.isdir()))
        stream = packed.extractfile(member) if member.isfile() and not archive.is_junk(member.name) else None
        if stream is not None:
            yield member.name, stream


def _fill(source: Source, top: Path, members: Iterable[tuple[str, IO[bytes]]]) -> None:
    """Store the members of an archive in a folder, within bounds of their number and size."""
    left = min(MOST_UNPACKED, MOST_RATIO * source.path.stat().st_size)
    for count, (name, stream) in enumerate(members, 1):
        if count > _MOST_MEMBERS:
            raise source.refuse("E_ARCHIVE", f"over {_MOST_MEMBERS} members", "unpack it first")
        if name.lower().endswith(_NESTED):
            raise source.refuse("E_ARCHIVE", f"an archive inside an archive ({name!a})", "unpack it first")
        target = top.joinpath(*PurePosixPath(name).parts)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            if target.exists():
                raise source.refuse("E_ARCHIVE", f"two members are called {name!a}", "pack it again")
            with stream, target.open("xb") as file:
                while piece := stream.read(_PIECE):
                    left -= len(piece)
                    if left < 0:
                        raise archive.bomb(source)
                    file.write(piece)
        except OSError as error:
            if shutil.disk_usage(top).free < _PIECE:
                raise
            raise source.refuse("E_ARCHIVE", f"member {name!a}: {error.strerror}", "pack it again") from error
