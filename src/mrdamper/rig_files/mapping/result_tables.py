"""Tables of results in lines of text: above the columns, on another sheet or in another file; lists of tests, logs."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache, lru_cache
from itertools import takewhile

from mrdamper.rig_files import column_names, conditions
from mrdamper.rig_files.column_names import COIL, holds, names_condition, split_name, words, words_of
from mrdamper.rig_files.conditions import currents_in, currents_in_order, quantity_in_cell
from mrdamper.rig_files.mapping.results import (
    COUNTED,
    LONGEST_LINE,
    MOST_LINES,
    NUMBER,
    SEPARATORS,
    Results,
    rows_below_heads,
)
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.text.layout import is_units
from mrdamper.rig_files.text.row_samples import cells_of
from mrdamper.rig_files.text.tokens import looks_numeric

_QUANTITY = re.compile(rf"({NUMBER.pattern})\s*(m?A)")
WITHIN = "table of results"  # within the file of its tests: beginning of where their currents stand
_LETTER = re.compile(r"[^\W\d_eE]")  # none in a line of samples
_RULE = re.compile(r"[-=+|:\s]{3,}")  # below the names of columns
_SUPPLY = re.compile(r"(?i)\b(?:power[ _-]?)?suppl(?:y|ied)\b|\bpsu\b")
_FEWEST_ROWS = 2  # of a table of results
_FEWEST_CHANNELS = 2  # of a table of samples
_MOST_ROWS, _MOST_COLUMNS = 2000, 60  # of a table of results
_TO = r"\s*(?:[-–]|\.{2,3}|\b(?:to|bis|do|à|au|a|al|até|se)\b)\s*"
_NUMBERS = re.compile(rf"([0-9]{{1,4}})(?:{_TO}([0-9]{{1,4}}))?")
_MARKS = "_.#-"  # between a name and its number
_LISTED_TEST = re.compile(  # Step 3: ...; tests 1 - 4: ...; files p01 to p04: ...; T1 se T4 tak: ...; 3. test: ...
    r"[\s#%*\"-]*(?:(?P<place>[0-9]{1,6})[.)]\s*(?P<word>[^\W\d_]{2,20})"
    rf"|(?P<name>[^\W\d_][^\d:=]{{0,30}}?)(?P<mark>[\s{_MARKS}]*)(?P<number>[0-9]{{1,6}})(?:"
    rf"{_TO}(?:[^\W\d_]{{1,30}}[\s_.#]*)?(?P<last>[0-9]{{1,6}})(?:\s+tak)?)?)\s*[:=;,\t)]"
)
_MEASURED = tuple(words("measured"))


def results_in(lines: Sequence[str]) -> Results | None:
    """Return the table of results among lines of text; None if there is none or several."""
    return _results_in(tuple(line[:LONGEST_LINE] for line in lines[:MOST_LINES]))


@lru_cache(16)  # the same heads and notes stand beside several tests
def _results_in(lines: tuple[str, ...]) -> Results | None:
    for separator in SEPARATORS:
        tables = {(table.current, table.cells): table for table in _tables(lines, separator)}
        if tables:
            return _with_row_a_test(*tables.values()) if len(tables) == 1 else None
    return numbered_tests(lines) or _log_by_clock(lines) or _matrix_of_tests(lines)


def _log_by_clock(lines: Sequence[str]) -> Results | None:
    """Return the lines of a log that begin with a time of day and state one current: 14:03 0.5 A."""
    timed = [(match[0], line[match.end() :].strip()) for line in lines if (match := conditions.TIME_OF_DAY.match(line))]
    rows = [(clock, of[0], text) for clock, text in timed if len(of := currents_in(text)) == 1]
    cells = tuple((clock, text) for clock, _, text in rows)
    table = Results(tuple(of for _, of, _ in rows), cells, "a line for each test", ("", "remark"))
    return table if len(rows) >= _FEWEST_ROWS else None


def _with_row_a_test(results: Results) -> Results:
    """Return a table with a row for each test where a row names several by their numbers: 1, 2, 3; 4 to 6."""
    for at in [i for i, key in enumerate(results.keys) if column_names.is_called(key, COUNTED)]:
        listed = [[*map(_NUMBERS.fullmatch, re.split(r"\s*[,;&+]\s*", cells[at]))] for cells in results.cells]
        ranges = [(row, int(m[1]), int(m[2] or m[1])) for row, of in enumerate(listed) for m in of if m]
        rows = [(row, str(n)) for row, first, last in ranges for n in range(first, last + 1)][:_MOST_ROWS]
        if all(map(all, listed)) and len(results.cells) < len({n for _, n in rows}) == len(rows):
            cells = tuple((*results.cells[row][:at], n, *results.cells[row][at + 1 :]) for row, n in rows)
            return replace(results, current=tuple(results.current[row] for row, _ in rows), cells=cells)
    return results


def _matrix_of_tests(lines: Sequence[str]) -> Results | None:
    """Return the tests whose names stand in columns headed by a current each: corner, 0 A, 0.5 A; FL, R41, R42."""
    for at in [at for at, line in enumerate(lines) if _LETTER.search(line) and len(currents_in(line)) > 1]:
        for heads, rows in rows_below_heads(lines[at:]):
            columns = conditions.named_after_currents(heads)
            body = takewhile(lambda row, own=columns: not any(row[i] and looks_numeric(row[i]) for i in own), rows)
            tests = [(row, i) for row in body for i in columns if row[i]]
            if len({row[i] for row, i in tests}) == len(tests) > 1:
                others = [i for i in range(len(heads)) if i not in columns]
                cells = tuple((row[i], *(row[k] for k in others)) for row, i in tests)
                currents = tuple(currents_in(heads[i])[0] for _, i in tests)
                return Results(currents, cells, "a matrix of tests", ("", *(heads[k] for k in others)))
    return None


def numbered_tests(lines: Sequence[str]) -> Results | None:
    """Return the tests that lines list by their numbers, with one current each: Step 3: sine, 2 Hz, coil at 0.4 A.

    Where none states the coil's, it is that of the supply: Step 3: sine, coil supply 0.4 A.
    """
    lines = [line[:LONGEST_LINE] for line in lines]
    return _numbered_tests(lines) or _numbered_tests([_SUPPLY.sub("", line) for line in lines], of_supply=True)


def _numbered_tests(lines: Iterable[str], *, of_supply: bool = False) -> Results | None:
    rows = list[tuple[str, str, float, str]]()
    for match in filter(None, map(_LISTED_TEST.match, lines)):
        text, name, first = match.string[match.end() :].strip(), match["name"], match["number"]
        if match["word"] and match["word"].casefold() in COUNTED:
            name, first = match["word"], match["place"]
        numbers = range(int(first or 0), int(match["last"] or first or -1) + 1)[:_MOST_ROWS]
        stated = currents_in_order(text) or currents_in(text) * len(numbers)
        if name and len(stated) == len(numbers) and not holds(name, COIL):
            numbered = [f"{(match['mark'] or '').strip()}{n:0{len(first)}d}" for n in numbers]  # _1 of scope_1
            rows += [(name.strip(), *of, text) for of in zip(numbered, stated, strict=True)]
    numbers = {(name.casefold(), int(number.lstrip(_MARKS))) for name, number, *_ in rows}
    if len(numbers) < _FEWEST_ROWS or len(numbers) < len(rows) or len({name for name, _ in numbers}) > 1:
        return None
    cells = tuple((f"{name.split()[-1]}{number}", number.lstrip(_MARKS), text) for name, number, _, text in rows)
    counts = any({word.casefold(), word.casefold().rstrip("s")} & COUNTED for word in words_of(rows[0][0]))
    currents, keys = tuple(row[2] for row in rows), ("", rows[0][0], "remark")
    return Results(currents, cells, "a line for each test", keys, of_supply, counts_tests=counts)


def form_of_tests(table: RawTable, form: FileForm) -> FileForm:
    """Return the form of a file, with the column that numbers its tests as a list of them above the columns does."""
    if form.run_column is not None or form.blocks == "join" or len(table.remarks) < _FEWEST_ROWS:
        return form
    results = results_in(table.remarks)
    column = results.column_of_tests(table) if results else None
    return form.model_copy(update={"run_column": column}) if column else form


def with_results(tables: list[RawTable]) -> list[RawTable]:
    """Tables of a file's tests with the currents that its table of results states."""
    results, tests = results_among(tables)
    if results is None or results.of_supply or not tests:
        return tables
    shared = set(tests[0].remarks).intersection(*(table.remarks for table in tests[1:])) if len(tests) > 1 else set()
    currents = results.by_test([[table.label, *_last_lines(table, shared)] for table in tests])
    note, with_current = f"{WITHIN}, {results.title}", list[RawTable]()
    for i, table in enumerate(tests if len(currents) == len(tests) else ()):
        rest = {key: v for key, v in table.constants.items() if not names_condition(split_name(key).name, "current")}
        with_current.append(replace(table, constants={**rest, "current [A]": currents[i]}, stated_in=note))
    return with_current or tables


def results_among(tables: Sequence[RawTable]) -> tuple[Results | None, Sequence[RawTable]]:
    """Return the table of results above tables, or the one among them, and those of tests: others list parameters."""
    above = results_in(list(dict.fromkeys(line for table in tables for line in table.remarks)))
    if above is not None:
        return above, tables
    stated, tests = list[Results](), list[RawTable]()
    for table in tables:
        may_be = (any(map(_is_current, table.names)) or not any(table.names)) and not table.columns("time")
        results = results_in(lines_of(table)) if may_be else None
        channels = {header.role or header.dimension for header in table.headers} - {None}
        if results is not None and not results.of_supply:
            stated.append(results)
        elif not any(table.names) or len(channels) >= _FEWEST_CHANNELS:
            tests.append(table)
    stated = [results for results in stated if len(stated) == 1 or len(results.current) == len(tests)]  # no means
    return stated[0] if len(stated) == 1 else None, tests


def lines_of(table: RawTable) -> list[str]:
    """Return a small table as lines of text."""
    if len(table.names) > _MOST_COLUMNS:
        return []
    columns = [table.words(i) for i in range(len(table.names))]
    sizes = {words.codes.size for words in columns}
    if len(sizes) > 1 or max(sizes, default=0) > _MOST_ROWS:  # channels of several rasters, or of a record
        return []
    rows = zip(*([words.labels[code] for code in words.codes] for words in columns), strict=True)
    units = (table.units,) if any(table.units) else ()
    return ["\t".join(cells) for cells in (table.names, *units, *rows)]


def _last_lines(table: RawTable, shared: set[str]) -> list[str]:
    """Return the lines right above the columns of a table that name its test."""
    own = [line for line in table.remarks if line not in shared or table.label.startswith("block")]
    filled = [len([cell for cell in re.split(r"[\t;,|]", line) if cell.strip(' "')]) for line in own]
    return [line for line, cells in zip(own[-4:], filled[-4:], strict=True) if cells <= 2]


def _tables(lines: Sequence[str], separator: str) -> Iterator[Results]:
    lines = [line for line in lines if not _RULE.fullmatch(line.replace(separator, ""))]

    @cache
    def row_at(at: int) -> list[str]:
        wide = separator == "  "
        cells = re.split(r" {2,}", lines[at].strip()) if wide else cells_of(lines[at], separator)
        return with_small_units([cell.strip('"').strip() for cell in cells])

    for at in (at for at, line in enumerate(lines) if separator in line and _LETTER.search(line)):  # no samples
        row = row_at(at)
        if sum(map(bool, row)) < 2:
            continue
        columns = [i for i, cell in enumerate(row) if cell and not NUMBER.fullmatch(cell) and _is_current(cell)]
        below = row_at(at + 1) if at + 1 < len(lines) else []
        supply = [] if columns else [i for i, cell in enumerate(row) if _is_of_supply(cell, *below[i : i + 1])]
        columns = columns or supply or [i for i, cell in enumerate(row) if holds(cell, COIL) and cell.isalpha()]
        if not columns:
            continue
        below = at + 1
        unit = ""
        second = row_at(below) if below < len(lines) else []
        if second and is_units(second) and not any(map(NUMBER.fullmatch, second)):
            unit = second[columns[0]].strip("[]()") if columns[0] < len(second) else ""
            below += 1
        body, pauses = [], []
        for cells in map(row_at, range(below, len(lines))):
            cell = cells[columns[0]] if len(cells) > columns[0] else ""
            cells = [*cells, *[""] * (len(row) - len(cells))][: len(row)]
            if not cell and any(cells) and not any(map(NUMBER.fullmatch, cells[1:])):
                pauses.append(cells)
                continue
            if not _QUANTITY.fullmatch(cell) and not NUMBER.fullmatch(cell):
                break
            body.append(cells)
        measured = [i for i in columns if row[i].casefold().startswith(_MEASURED) or holds(row[i], {*_MEASURED})]
        chosen = measured if len(measured) == 1 else columns  # Iststrom beside Sollstrom
        given = [[quantity_in_cell(cells[i], unit or split_name(row[i]).unit) for cells in body] for i in chosen]
        every = [[q[0] if q and q[1].dimension == "current" and abs(q[0]) <= 100 else None for q in of] for of in given]
        currents = every[0]
        if len(body) < _FEWEST_ROWS or any(value is None for value in currents):
            continue
        if supply and len({*currents}) == 1:  # of tests at different currents the coil's, else the supply's rating
            continue
        pairs = [pair for other in every[1:] for pair in zip(currents, other, strict=True)]
        if any(a is not None and b is not None and conditions.contradicts(a, b) for a, b in pairs):
            continue  # of two coils
        others = [i for i in range(len(row)) if i not in columns]
        yield Results(
            tuple(value for value in currents if value is not None),
            tuple(tuple(cells[i] for i in others) for cells in body),
            row[chosen[0]],
            tuple(row[i] for i in others),
            bool(supply),
            pauses=tuple(tuple(cells[i] for i in others) for cells in pauses),
        )


def with_small_units(row: list[str]) -> list[str]:
    """Return a row of names whose units in small letters are written as such: coil_current_a."""
    if not any(cell[-2:-1] == "_" for cell in row):  # of a record nearly every row, and looking up names takes long
        return row
    headers = column_names.headers_of(row, [""] * len(row))
    units = [header.unit if header != split_name(cell) else "" for cell, header in zip(row, headers, strict=True)]
    return [f"{cell[:-2]} [{unit}]" if unit else cell for cell, unit in zip(row, units, strict=True)]


def _is_current(cell: str) -> bool:
    header = split_name(cell)
    named = names_condition(header.name, "current") and header.dimension in (None, "current")
    named = named or (header.dimension == "current" and holds(header.name, COIL))  # coil_mA
    return named and not currents_in(cell)  # coil current 0.5 A heads no column


def _is_of_supply(cell: str, below: str = "") -> bool:
    """Tell if a cell heads currents of a supply, by its name or by the first of them: PSU set point, 0.5 A."""
    bare = _SUPPLY.sub("", cell)
    if bare != cell and _QUANTITY.fullmatch(below):
        return True
    return bare != cell and _is_current(bare) and conditions.names_only_currents(split_name(bare).name)
