"""The records of one file, not yet judged: its tables, those that hold a test, and their channels."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path

from mrdamper.errors import ColumnError, CombinedError, InputError, printable
from mrdamper.rig_files.coil_current import as_data, with_value_of_name
from mrdamper.rig_files.column_names import COMPUTED, holds
from mrdamper.rig_files.columns import assign, partly_assigned
from mrdamper.rig_files.mapping.clocks import with_time_stated
from mrdamper.rig_files.mapping.completion import completed
from mrdamper.rig_files.mapping.description import with_description, with_notes
from mrdamper.rig_files.mapping.proposals import with_channels_by_physics, with_integrated_velocity, with_unit_of_time
from mrdamper.rig_files.mapping.rasters import with_joined_rasters, with_one_clock
from mrdamper.rig_files.mapping.results import form_of_tests, with_results
from mrdamper.rig_files.parts import tests_of, with_channels_as_columns
from mrdamper.rig_files.profile import Profile, profile_hash
from mrdamper.rig_files.readers import raw_tables
from mrdamper.rig_files.readers.base import RawTable, RigFileError
from mrdamper.rig_files.record import REQUIRED, Finding, Record
from mrdamper.rig_files.rig_record import records_of
from mrdamper.rig_files.sequences import joined

_ROWS_OF_A_TEST = 0.25  # share of the rows of another test of the file that a test has at least


def records_of_file(path: Path, profile: Profile) -> tuple[list[Record], list[InputError]]:
    """Read the tests of a file, and why others of its tests cannot be used.

    Raises `InputError` if no test of the file can be used.
    """
    with raw_tables(path, profile.file) as every:
        if len(every) == 1:
            every = [with_description(every[0], path, profile)]
        every = [with_notes(table, path, profile) for table in every]
        tables, problems = tables_of_tests(test_tables(every, profile), profile)
        tables, computed = _without_computed(tables)
        records: list[Record] = []
        for table in tables:
            try:
                records += records_of(table, profile, path)
            except InputError as error:
                problems += getattr(error, "errors", (error,))
        if not records or any(table.label.startswith("block") for table in tables):
            CombinedError.raise_from(problems)
        digest = digest_of(path)
    records = joined(records, profile, tables)
    remarks = {"file": as_data(path.name), "sha256": digest}
    if profile != Profile():
        remarks["profile_sha256"] = profile_hash(profile)
    records = [replace(record, provenance={**remarks, **record.provenance}) for record in records]
    if computed:
        finding = Finding("W_TABLE", f"tables of filtered or computed values are left out: {', '.join(computed)}")
        records[0] = records[0].noticed(finding)
    if len({record.id for record in records}) < len(records):
        records = [replace(record, id=f"{record.id}_{i}") for i, record in enumerate(records, 1)]
    named = []
    for record in records:
        try:
            named.append(with_value_of_name(record, path, profile))
        except InputError as error:
            problems.append(error)
    if not named:
        CombinedError.raise_from(problems)
    return named, problems


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def test_tables(tables: list[RawTable], profile: Profile) -> list[RawTable]:
    """Split and complete the tables of a file until each holds one test, or none."""
    kept = [table for table in tables if not (table.label and profile.leaves_out(table.label))]
    if tables and not kept:
        raise tables[0].source.refuse("E_NO_DATA", "every table is left out", "correct [file] leave_out of the profile")
    tables = kept
    tables = with_joined_rasters([with_time_stated(completed(with_channels_as_columns(table))) for table in tables])
    tables = [with_one_clock(table) for table in tables]
    forms = [form_of_tests(table, profile.file) for table in tables]
    parts = [part for t, form in zip(tables, forms, strict=True) for part in ([t] if t.fallback else tests_of(t, form))]
    stated = {name: channel.column for name, channel in profile.channels.items() if channel.column is not None}
    timed = [with_integrated_velocity(with_unit_of_time(table)) for table in with_results(parts)]
    return [with_channels_by_physics(table, stated) for table in timed]


def tables_of_tests(tables: list[RawTable], profile: Profile) -> tuple[list[RawTable], list[InputError]]:
    """Select the tables that hold a whole test; refuse those that hold one without a channel it needs.

    Raises `InputError` if no table holds a test.
    """
    if len(tables) == 1:
        return tables, []
    first = None
    for fallback in (False, True):
        fitting: list[RawTable] = []
        others: list[tuple[RawTable, InputError]] = []
        for table in tables:
            if table.fallback is not fallback:
                continue
            try:
                assign(table, profile)
                fitting.append(table)
            except InputError as error:
                others.append((table, error))
        if fitting:
            return fitting, [_incomplete(t, error) for t, error in others if _resembles_a_test(t, fitting, profile)]
        first = first or next((error for _, error in others), None)
    raise first or RigFileError("E_NO_DATA", "no table in this file")


def _resembles_a_test(table: RawTable, tests: list[RawTable], profile: Profile) -> bool:
    """Return whether a table beside tests has as many columns, as many rows and two of their channels."""
    columns = [entry.column for role, entry in partly_assigned(table, profile).items() if role in REQUIRED]
    alike = next((test for test in tests if len(test.names) == len(table.names)), None)
    if alike is None or holds(table.label, COMPUTED) or len(columns) < len(REQUIRED) - 1:
        return False
    return _rows(table, columns[0]) >= _ROWS_OF_A_TEST * _rows(alike, assign(alike, profile)["force"].column)


def _rows(table: RawTable, column: int) -> int:
    return table.read([column]).values[column].size


def _incomplete(table: RawTable, error: InputError) -> InputError:
    """Return the refusal of one of a file's tests, with its table named."""
    label = json.dumps(table.label, ensure_ascii=False)
    return ColumnError(
        error.found,
        where=f"{printable(table.source.name)}, table {printable(table.label)}",
        remedy=f"give it the headings of the other tables, or set [file] leave_out = [{label}] in a profile",
        code=error.code,
    )


def _without_computed(tables: list[RawTable]) -> tuple[list[RawTable], list[str]]:
    """Leave out tables whose names say filtered or computed, beside one that was measured; and return their names."""
    measured = [table for table in tables if not holds(table.label, COMPUTED)]
    if not measured or len(measured) == len(tables):
        return tables, []
    return measured, [table.label for table in tables if holds(table.label, COMPUTED)]
