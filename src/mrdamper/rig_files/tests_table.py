"""`tests.csv`: what a laboratory knows of its tests beside the files: current, temperature, split, session, notes."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePath
from statistics import median

import numpy as np

from mrdamper.data import held_current
from mrdamper.data.strict_text import content_of
from mrdamper.data.wording import counted
from mrdamper.errors import CombinedError, InputError, listed
from mrdamper.rig_files.coil_current import with_decided_current
from mrdamper.rig_files.column_names import split_name, words
from mrdamper.rig_files.conditions import CELL, LARGEST_STATED, quantity_in_cell
from mrdamper.rig_files.quality.view import View, strokes_of
from mrdamper.rig_files.record import Record
from mrdamper.rig_files.text.stream import decoded

NAME = "tests.csv"
COLUMNS = ("file", "run", "current_A", "temperature_C", "split", "session", "specimen", "notes")
_NOTED = ("file", "temperature_C", "session", "specimen")
_LARGEST = 4 * 2**20  # bytes
_MOST_ROWS = 10_000  # tests of one import
_FILE, _RUN = words("table_file"), words("table_run")
_Wrong = Callable[[int, str, str], None]


class TestsTableError(InputError):
    """A table of tests cannot be used."""

    code = "E_TESTS"
    __test__ = False


@dataclass(frozen=True, slots=True)
class StatedTest:
    """Entry of the table of tests; None where a cell is empty."""

    line: int
    file: str
    run: str
    current: float | None = None
    split: str | None = None
    rig: str | None = None
    notes: Mapping[str, str] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """The names of its file and run."""
        return " ".join(filter(None, (self.file, self.run)))

    def names(self, path: Path, run: str) -> bool:
        """Tell if the entry is that of a run of a file, or of all runs of the file."""
        return _is_file(self.file, path) and self.run in ("", run)


@dataclass(frozen=True, slots=True)
class TestsTable:
    """A table of tests, and where it stands."""

    path: Path
    rows: tuple[StatedTest, ...]
    __test__ = False

    def of(self, path: Path, run: str) -> StatedTest | None:
        """Return the row of a test: of its run, else of its file."""
        own = [row for row in self.rows if row.names(path, run)]
        return min(own, key=lambda row: row.run == "", default=None)

    def of_file(self, path: Path) -> tuple[StatedTest, ...]:
        """Return the rows of a file's tests."""
        return tuple(row for row in self.rows if _is_file(row.file, path))

    def require_found(self, tests: Iterable[tuple[Path, str]], unread: Collection[Path]) -> None:
        """Refuse rows of files or runs that are not there, and rows of one name that several files have.

        The runs in files that are refused, the `unread`, may be there.

        Raises `TestsTableError`, naming every one of them.
        """
        tests = list(tests)
        for row in self.rows:
            fitting = {path for path, run in tests if run and row.names(path, run)}
            if len(fitting) > 1:
                shown = ", ".join(sorted("/".join(path.parts[-2:]) for path in fitting)[:4])
                problem = f"{row.label!r} names tests of {counted(len(fitting), 'file')}: {shown}"
                remedy = "write the file with its folder, and one row for each"
                raise TestsTableError(problem, where=f"{self.path.name}, line {row.line}", remedy=remedy)
        absent = [row for row in self.rows if not any(row.names(path, run) for path, run in tests)]
        absent = [row for row in absent if not (row.file and any(_is_file(row.file, path) for path in unread))]
        absent = [row for row in absent if row.run or not row.file or not (self.path.parent / row.file).is_file()]
        if absent:
            shown = listed([f"{row.label!r} (line {row.line})" for row in absent], 10)
            remedy = "correct the names, or remove the rows"
            raise TestsTableError(f"no such test: {shown}", where=self.path.name, remedy=remedy)


def _is_file(name: str, path: Path) -> bool:
    if not name:
        return True
    parts = PurePath(name.replace("\\", "/").casefold()).parts  # as file systems of Windows tell them apart
    normalised = PurePath(str(path).casefold())
    return normalised.parts[-len(parts) :] == parts or (len(parts) == 1 and normalised.stem == parts[0])


def names_tests(path: Path, files: Collection[str]) -> bool:
    """Tell if a table names files, runs or splits, or cannot be read; a laboratory's own list may have none of them.

    Nor does one whose only names are numbers, of which not all are stems of files.
    """
    try:
        (_, names), *rows = _cells(path)
    except TestsTableError:
        return True
    keys = [_key(name.strip()) for name in names]
    runs = {cells[keys.index("run")].strip() for _, cells in rows if "run" in keys and len(cells) > keys.index("run")}
    numbers = "file" not in keys and bool(runs) and all(map(str.isdecimal, runs)) and not runs <= {*files}
    return len({*keys}) < 2 or (bool({*keys} & {"file", "run", "split"}) and not numbers)


def load_tests(path: str | Path) -> TestsTable:
    """Read a table of tests.

    Columns: file or run, or both; current and temperature with their unit in the name or the
    cell; split (train, validate), session, specimen, rig; further columns become notes.

    Raises `TestsTableError`: E_TESTS, with everything that is wrong.
    """
    path = Path(path)
    rows = _cells(path)
    names = [name.strip() for name in rows[0][1]]
    keys = [_key(name) for name in names]
    problems: list[InputError] = []

    def wrong(line: int, problem: str, remedy: str) -> None:
        problems.append(TestsTableError(problem, where=f"{path.name}, line {line}", remedy=remedy))

    if "file" not in keys and "run" not in keys:
        wrong(1, "neither a column file nor a column run", f"name one of {', '.join(COLUMNS)}")
    stated = [_row(line, cells, names, keys, wrong) for line, cells in rows[1:]]
    lines_of: dict[tuple[str, str], int] = {}
    for row in stated:
        if not row.label:
            wrong(row.line, "names neither file nor run", "fill the cell or remove the row")
        elif (row.file, row.run) in lines_of:
            wrong(row.line, f"{row.label!r} stands in line {lines_of[row.file, row.run]} already", "remove one row")
        lines_of.setdefault((row.file, row.run), row.line)
    CombinedError.raise_from(problems)
    return TestsTable(path, tuple(stated))


def applied(record: Record, path: Path, table: TestsTable | None) -> Record:
    """Apply the row of a test of a file to its record; that its channel has another current is its doubt."""
    row = table.of(path, record.id) if table else None
    if row is None or table is None:
        return record
    if row.current is not None:
        record = with_decided_current(record, row.current, table.path.name, row.line)
    changes = {name: value for name, value in (("split", row.split), ("rig", row.rig)) if value}
    return replace(record, provenance={**record.provenance, **row.notes}, **changes)  # type: ignore[arg-type]


def tests_text(records: Sequence[Record]) -> str:
    """The table of tests that were read, to be completed and used with the same files."""
    rows: list[tuple[str, ...]] = [COLUMNS]
    for record in records:
        current = None
        if record.current is not None and record.doubt is None:
            mean, change = held_current(record.current[record.present])
            current = None if change else mean
        notes = record.provenance
        stated = "" if current is None else f"{current:g}"
        file, temperature, session, specimen = (notes.get(key, "") for key in _NOTED)
        rows.append((file, record.id, stated, temperature, record.split, session, specimen, _description(record)))
    target = io.StringIO()
    csv.writer(target, lineterminator="\n").writerows(rows)
    return target.getvalue()


def _description(record: Record) -> str:
    """Return the name of a test's block and its measured motion, by which a reader tells the tests apart."""
    strokes, name = strokes_of(record), record.provenance.get("block", "")
    motion = (1 / strokes.period, median(strokes.lengths) / 2) if strokes.period else None
    with suppress(InputError), np.errstate(all="ignore"):  # the record was not checked
        analysis = View(record).motion
        motion = (analysis.condition.frequency_Hz, analysis.condition.amplitude_m) if analysis else motion
    return ", ".join(filter(None, (name, f"{motion[0]:.3g} Hz, {1e3 * motion[1]:.3g} mm" if motion else "")))


def _cells(path: Path) -> list[tuple[int, list[str]]]:
    """Line and cells of every row that holds something."""
    text = decoded(content_of(path, _LARGEST, TestsTableError, "a CSV file with one row a test"))
    first = text.split("\n", 1)[0]
    separator = max(";\t,", key=first.count)
    try:
        reader = csv.reader(io.StringIO(text), delimiter=separator, strict=True)
        rows = [(reader.line_num, cells) for cells in reader if any(cell.strip() for cell in cells)]
    except csv.Error as error:
        raise TestsTableError(str(error), where=path.name, remedy="save it as CSV again") from error
    if len(rows) > _MOST_ROWS + 1:
        problem = f"{len(rows) - 1} rows; a table of tests has at most {_MOST_ROWS}"
        remedy = "is this a table of tests, or of samples? Import in parts"
        raise TestsTableError(problem, where=path.name, remedy=remedy)
    if len(rows) < 2:
        raise TestsTableError("no rows", where=path.name, remedy=f"write one row a test: {', '.join(COLUMNS)}")
    return rows


def _key(name: str) -> str:
    header = split_name(name)
    bare = header.name.casefold()
    if bare in _FILE:
        return "file"
    if bare in _RUN:
        return "run"
    return header.role if header.role in ("current", "temperature") else bare


def _row(line: int, cells: list[str], names: list[str], keys: list[str], wrong: _Wrong) -> StatedTest:
    if len(cells) > len(names) and any(cell.strip() for cell in cells[len(names) :]):
        wrong(line, f"{counted(len(cells), 'cell')} under {len(names)} names", "quote cells with commas")
    says = {}
    notes = {}
    for name, key, cell in zip(names, keys, cells, strict=False):
        cell = cell.strip()
        if not cell:
            continue
        if key in ("current", "temperature"):
            value = _quantity(line, key, name, cell, wrong)
            if value is not None:
                says[key] = value
        elif key in ("file", "run", "split", "rig"):
            says[key] = cell
        else:
            notes[name if name not in ("file", "sha256") else f"{name}_stated"] = cell
    split = says.get("split")
    if split not in (None, "train", "validate"):
        wrong(line, f"split is {split!r}", "write train or validate")
    if "temperature" in says:
        notes["temperature_C"] = f"{says['temperature']:g}"
    file, run = says.get("file", ""), says.get("run", "")
    return StatedTest(line, file, run, says.get("current"), split, says.get("rig"), notes)


def _quantity(line: int, key: str, name: str, cell: str, wrong: _Wrong) -> float | None:
    value, unit = quantity_in_cell(cell, split_name(name).unit) or (0.0, None)
    if CELL.fullmatch(cell) is None:
        wrong(line, f"{name} is {cell!r}", "write a number")
    elif unit is None or unit.dimension != key:
        example = "current_A or current_mA" if key == "current" else "temperature_C"
        wrong(line, f"{name} {cell} has no unit of {key}", f"name the column {example}")
    elif key != "current" or abs(value) <= LARGEST_STATED:
        return value
    else:
        wrong(line, f"{name} is {value:g} A", "no damper's coil takes that: mA?")
    return None
