"""Tables of results: one row a test, with its current, above the columns, on another sheet or in another file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date
from itertools import pairwise
from pathlib import Path

import numpy as np

from mrdamper.data import held_current
from mrdamper.errors import listed
from mrdamper.rig_files import conditions
from mrdamper.rig_files.column_names import sentences, split_name, words, words_of
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import Record
from mrdamper.rig_files.text.row_samples import cells_of

SEPARATORS = ("\t", ";", ",", "|", "  ")  # the last: two spaces or more
NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:[.,][0-9]+)?|[.,][0-9]+)")
MOST_LINES, LONGEST_LINE = 4000, 2000
_LABELLED = re.compile(r"(?<![^\W\d_])([^\W\d_]+)[ _.-]?([0-9]+)")
_FEWEST_DURING, _DAY_S = 3, 86_400  # rows of a log during a test; of a day [s]
_STARTS, _ENDS, _ROWS = words("start"), words("end"), words("row")
COUNTED = words("run") | words("run_number") | words("table_file")  # what the number in a test's name may be
_NUMBERED = COUNTED | {"step", "schritt", "#"}
_OWN_KEYS = {"id", "nr", "nr.", "no", "no.", "#", "key", "index", "pk"}  # each table has its own
_CONDITION = re.compile(  # no number of a test: 0.5A, 0_5A, and of 01_0A the second
    r"(?<![A-Za-z0-9])(?:(?:0|[1-9][0-9]*)[.,_])?[0-9]+[ _]?(?:m?A|m?Hz|mm)(?![A-Za-z])"
)
(_SPECIMEN,) = sentences("before_name")


@dataclass(frozen=True, slots=True)
class Results:
    """Rows of a table of results: the current of every test, and the cells by which it is told."""

    current: tuple[float, ...]  # [A], one a row
    cells: tuple[tuple[str, ...], ...]  # of every row those beside the current, by column
    title: str  # heading of the column of currents
    keys: tuple[str, ...] = ()  # headings of the columns of `cells`
    of_supply: bool = False  # the coil's only if force grows with it
    counts_tests: bool = True  # so that a number in a test's name may be meant; Day 1: 0.5 A counts something else
    pauses: tuple[tuple[str, ...], ...] = ()  # cells of the rows that state no current and no other number

    def by_test(self, tests: Sequence[Iterable[str]], *, whole_names: bool = False) -> dict[int, float]:
        """Return the current [A] of each test by its number, where one column of the table tells all of them apart.

        Of each test all that it is called is given: its label, its file, the lines above it. With `whole_names` a cell
        is all of a name; otherwise a number in it, or that of the row, may tell the test as well.
        """
        names = [_names(texts) for texts in tests]
        one_of_several = len(tests) == 1 < len(self.current)  # a number in its name alone may count anything
        by_number = self.counts_tests and not one_of_several and not whole_names
        columns, of_row = self._columns_of_names(len(tests))
        for exact in (True,) if not by_number else (True, False):
            matches = [(column, match) for column in columns if (match := _match(column, names, exact))]
            texts = any(not all(map(NUMBER.fullmatch, column)) for column, _ in matches)  # surer than the row's number
            rows = () if (exact and texts) or whole_names else of_row
            matches += [(row, match) for row in rows if (match := _match(row, names, exact))]
            currents = [{i: self.current[row] for i, row in match.items()} for _, match in matches]
            if currents and all(other == currents[0] for other in currents):
                return currents[0]
            if currents:
                break
        return self._by_labels(tests) if self.counts_tests and not whole_names else {}

    def _by_labels(self, tests: Sequence[Iterable[str]]) -> dict[int, float]:
        """Return the current [A] of each test by the numbers in its name behind the beginnings of headings: S1_T02.

        Empty unless every test has one row, no row two tests but by a whole heading that counts no tests, as Level 2 of
        level2_1Hz and level2_3Hz, and no such beginning is that of two headings.
        """
        headers = map(split_name, self.keys)
        heads = ["" if header.unit not in ("", "%") else header.name.casefold() for header in headers]
        rows, whole = dict[int, int](), {head for head in heads if len(head) > 1} - COUNTED  # no f, A
        shared = True
        for test, texts in enumerate(tests):
            fitting, labels = {*range(len(self.cells))}, set[str]()
            pairs = {(label.casefold(), n, "\\" in text) for text in texts for label, n in _LABELLED.findall(text)}
            for label, number, of_path in pairs:
                columns = [i for i, of in enumerate(heads) if of == label or (of.startswith(label) and not of_path)]
                if len(columns) > 1:
                    return {}
                fitting = {row for row in fitting if all(_key(self.cells[row][i]) == _key(number) for i in columns)}
                labels |= {label} if columns else set()
            shared &= bool(labels) and labels <= whole
            if len(fitting) != 1:
                return {}
            rows[test] = fitting.pop()
        apart = len({*rows.values()}) == len(rows)
        return {i: self.current[row] for i, row in rows.items()} if apart or shared else {}

    def joined(self, lines: Sequence[str]) -> Results | None:
        """Return the rows of another table, each with the current of the row of this one whose key it states.

        The column of the key is called alike in both tables, and not as the key of any table; None unless it is the
        only one by which all rows fit.
        """
        tables = []
        for heads, rows in rows_below_heads(lines):
            common = {*map(_key, heads)} & {_key(key) for key in self.keys if key} - _OWN_KEYS
            for key in common:
                own = [_key(cells[[*map(_key, self.keys)].index(key)]) for cells in self.cells]
                theirs = [_key(row[[*map(_key, heads)].index(key)]) for row in rows]
                if len({*own}) == len(own) and {*theirs} <= {*own}:
                    current = tuple(self.current[own.index(cell)] for cell in theirs)
                    cells = tuple(map(tuple, rows))
                    tables.append(replace(self, current=current, cells=cells, keys=tuple(heads), pauses=()))
        return tables[0] if len(tables) == 1 else None

    def apart(self, groups: Sequence[str]) -> Iterator[list[tuple[Results, list[int]]]]:
        """Yield the rows of each group, a file or folder, and the places of its tests, by each column that names all.

        A column Day with 1 names the folder day1, and one with 14.3.2023 the folder 2023-03-14.
        """
        for key, column in zip(self.keys, zip(*self.cells, strict=True), strict=True):
            names, parts = [_group_names(cell) | _group_names(f"{key} {cell}") for cell in column], []
            for group in dict.fromkeys(groups):
                rows = [row for row, own in enumerate(names) if own & _group_names(group)]
                current, cells = (tuple(of[row] for row in rows) for of in (self.current, self.cells))
                own = [i for i, its in enumerate(groups) if its == group]
                parts += [(replace(self, current=current, cells=cells), own)]
            if all(rows.current for rows, _ in parts):
                yield parts

    def by_clock(self, tests: Sequence[tuple[str, float]]) -> dict[int, float]:
        """Return the current [A] of each test by its start, day and time, and its duration [s], and the rows' clock.

        It is that which a log with several rows during each test has held, or that of the row of the same minute or
        second, or of as many rows as tests of one day the nearest, where no second one is as near.
        """
        begins = [(*moment, duration) for start, duration in tests if (moment := _moment(start))]
        for column in zip(*self.cells, strict=True) if len(begins) == len(tests) else ():
            rows = [moment for cell in column if (moment := _moment(cell))]
            if not len(column) == len(rows) > 1:
                continue
            dated = all(day for day, _ in rows)
            clock = np.array([second + _DAY_S * day * dated for day, second in rows])
            starts = np.array([second + _DAY_S * day * dated for day, second, _ in begins])
            starts -= starts % 60 if not np.any(clock % 60) else 0
            ends = np.searchsorted(clock, starts + [duration for *_, duration in begins], side="right")
            during = [self.current[a:b] for a, b in zip(np.searchsorted(clock, starts), ends, strict=True)]
            if np.all(np.diff(clock) >= 0) and min(map(len, during)) >= _FEWEST_DURING:
                held = [held_current(np.array(of)) for of in during]
                return {} if any(change for _, change in held) else {i: mean for i, (mean, _) in enumerate(held)}
            apart = np.abs(clock[:, None] - starts)
            own, (first, second) = apart.argmin(axis=0), np.partition(apart, 1, axis=0)[:2]
            listed = len(rows) == len(tests) and (dated or len({day for day, *_ in begins}) == 1)
            if len({*own}) == len(tests) and np.all(2 * first < second) and (listed or not first.any()):
                return {i: self.current[row] for i, row in enumerate(own)}
        return {}

    def misfit(self, tests: Sequence[Iterable[str]]) -> str:
        """Tell what the column that names most tests, and more than half, has twice, or which of them it lacks."""
        tests = [list(texts) for texts in tests]
        named = [whole | numbers for whole, numbers in map(_names, tests)]
        fewest, text = 0.5 * len(tests), ""
        for key, column in zip(self.keys, zip(*self.cells, strict=True), strict=True):
            cells = [*map(_key, column)]
            absent = [own[0] for own, names in zip(tests, named, strict=True) if names.isdisjoint(cells)]
            twice = [i for i, cell in enumerate(cells) if cell and cell in cells[:i]]
            if key and len(absent) < fewest and (twice or absent) and not split_name(key).dimension:
                fewest = len(absent)
                lacks = f"names {len(tests) - fewest} of {len(tests)} tests and may lack {listed(absent, 3)}"
                for at in twice[:1]:
                    rows = f"rows {cells.index(cells[at]) + 1} and {at + 1}"
                    lacks = f"has {column[at]!r} twice under {key!r} ({rows}), which may be a mistake"
                text = lacks
        return text

    def _columns_of_names(self, tests: int) -> tuple[list[Sequence[str]], list[Sequence[str]]]:
        """Return the columns that may name as many tests, none of a quantity or of a log, and apart the rows' numbers.

        The number of a row may be that of a test if there are as many rows, and no column that numbers the tests.
        """
        headers = [split_name(key) for key in self.keys]
        columns = list[Sequence[str]](zip(*self.cells, strict=True))
        numeric = [all(map(NUMBER.fullmatch, column)) for column in columns]
        keys = [{word.casefold() for word in words_of(header.name)} for header in headers]
        numbered = any(key & _NUMBERED for key, numbers in zip(keys, numeric, strict=True) if numbers)
        labels = [of for key, of in zip(keys, columns, strict=True) if key & COUNTED]
        labels = [of for of in labels if all(map(_LABELLED.fullmatch, of))]
        numbered |= any(len({*of}) < len(of) for of in labels)  # R05 twice: it is not known which row is of R06
        every = zip(headers, columns, numeric, strict=True)
        timed = [column for header, column, numbers in every if numbers and header.role == "time"]
        times = [np.diff([float(cell.replace(",", ".")) for cell in column]) for column in timed]
        if any(steps.size and np.all(steps > 0) for steps in times) and not numbered:  # samples over time
            return [column for column, numbers in zip(columns, numeric, strict=True) if not numbers], []
        names = [column for header, column in zip(headers, columns, strict=True) if header.dimension is None]
        own = [*map(str, range(1, len(self.current) + 1))]
        return names, [] if numbered or tests != len(self.current) else [own]

    def rows_in_range(self, tests: Sequence[Record]) -> list[tuple[int, int, slice]]:
        """Return each test and row by their numbers, and the samples between the start and the end that the row states.

        Empty unless no row is that of two tests, and each test covers more than half of one row's range, or of several
        after each other; or each row has a test, and others have none.
        """
        windows, parts = self.ranges[1], list[tuple[int, int, slice]]()
        for test, clock in enumerate(self.clocks(tests) if windows else ()):
            inside = [slice(np.searchsorted(clock, a), np.searchsorted(clock, b, side="right")) for a, b in windows]
            covered = [clock[s.stop - 1] - clock[s.start] if s.stop > s.start else 0 for s in inside]
            own = [row for row, of in enumerate(covered) if of > 0.5 * (windows[row][1] - windows[row][0]) > 0]
            own.sort(key=windows.__getitem__)
            apart = all(windows[one][1] <= windows[other][0] for one, other in pairwise(own))
            parts += [(test, row, inside[row]) for row in own if apart]
        with_row, rows = {test for test, _, _ in parts}, {row for _, row, _ in parts}
        whole = len(rows) == len(parts) and (len(with_row) == len(tests) or len(rows) == len(self.cells))
        return parts if whole else []

    def on_clock(self, tests: Sequence[Record]) -> bool:
        """Tell if the rows state different ranges, one of them within a test or in another order than that of time."""
        windows = self.ranges[1]
        ends = [(clock[0], clock[-1]) for clock in self.clocks(tests) if clock.size]
        within = any(first < end and begin < last for first, last in ends for begin, end in windows)
        return len({*windows}) > 1 and (within or windows != sorted(windows))

    def clocks(self, tests: Sequence[Record]) -> list[np.ndarray]:
        """Return what the ranges count in, by test: its times, or the lines of its samples.

        They count the samples where these have no lines, or a range begins before the first of them.
        """
        by_rows, windows = self.ranges
        if not by_rows:
            return [record.time for record in tests]
        lines = [np.arange(1, r.time.size + 1) if r.lines is None else r.lines for r in tests]
        first = min((of[0] for of in lines if of.size), default=1)
        return [of - (first - 1) if min(windows)[0] < first else of for of in lines]

    @property
    def ranges(self) -> tuple[bool, list[tuple[float, float]]]:
        """Start and end of every row's test, in rows of a file or in time [s], where the rows state them."""
        for by_rows in (True, False):
            starts, ends = (self._bounds(of, by_rows) for of in (_STARTS, _ENDS))
            if starts and ends:
                return by_rows, list(zip(starts, ends, strict=True))
        return False, []

    def _bounds(self, words: frozenset[str], by_rows: bool) -> list[float]:
        """Return the times [s], or rows, of the one column of such a name; empty if there is none."""

        def is_bound(name: str) -> bool:
            own = {word.casefold() for word in words_of(name)}
            return bool(words & own) and bool(_ROWS & own) == by_rows

        return self.numbers(None if by_rows else "time", is_bound)

    def numbers(self, dimension: str | None, called: Callable[[str], object]) -> list[float]:
        """Return the numbers, in SI, of the one column of a dimension and such a name; empty if a cell is none."""
        headers = enumerate(map(split_name, self.keys))
        columns = [(i, header) for i, header in headers if header.dimension == dimension and called(header.name)]
        cells = [row[columns[0][0]].replace(",", ".") for row in self.cells] if len(columns) == 1 else []
        return [columns[0][1].factor * float(cell) for cell in cells] if all(map(NUMBER.fullmatch, cells)) else []

    def column_of_tests(self, table: RawTable, *, with_rests: bool = False) -> str | None:
        """Return the column of a record that numbers tests, or rests between them, as one of its name here does."""
        for i, name in enumerate(table.names):
            own = _key(split_name(name).name)
            at = [k for k, key in enumerate(self.keys) if key and _key(split_name(key).name) == own]
            if len(at) != 1 or table.headers[i].role == "time":
                continue
            numbers = {_key(label) for label in table.words(i).labels} - {""}
            rows = {_key(cells[at[0]]) for cells in (*self.cells, *self.pauses)}
            between = with_rests and rows <= numbers and len(numbers) <= 2 * len(rows) + 1
            if len(numbers) > 1 and (numbers <= rows or between):
                return name
        return None

    def lacks_current(self, path: Path, name: str) -> bool:
        """Tell if a row without a current or any other number is that of a test of a file: a pause, if it rests."""
        names = {_key(own) for own in (name, name.removeprefix(path.stem).lstrip("_"), path.name)} - {""}
        return any(not names.isdisjoint(map(_key, cells)) for cells in self.pauses)


def rows_below_heads(lines: Sequence[str]) -> Iterator[tuple[list[str], list[list[str]]]]:
    """Yield the cells of the first of lines, and of those below it with as many, by each separator."""
    for separator in SEPARATORS[:4]:
        rows = [[cell.strip('" ') for cell in cells_of(t[:LONGEST_LINE], separator)] for t in lines[:MOST_LINES]]
        below = [row for row in rows[1:] if len(row) == len(rows[0]) > 1]
        if len(below) > 1:
            yield rows[0], below


def _names(texts: Iterable[str]) -> tuple[set[str], set[str]]:
    """Return the full name of a test, and the numbers in it."""
    whole, numbers = set[str](), set[str]()
    for text in texts:
        bare = text.strip().strip('"').strip()
        if conditions.TIME_OF_DAY.fullmatch(bare):
            continue
        for part in (bare, *re.split(r"[:=;,\t/]", bare)):
            part = part.strip().strip('"').strip()
            whole |= {_key(part), _key(_SPECIMEN.sub("", part))} - {""}
        short = len(bare) < 60 and "\\" not in bare  # no path
        tail = re.search(r"([0-9]+)\D*$", _CONDITION.sub("", _SPECIMEN.sub("", bare))) if short else None
        if tail:
            numbers.add(str(int(tail[1])))
    return whole, numbers


def _key(text: str) -> str:
    """Return a name as it is compared: no case, spaces, leading zeros of a plain number; of a path its last parts."""
    text = text.removeprefix("./").replace("/", "\\")
    text = re.sub(r"\.(csv|txt|dat|asc|tra|mat|xlsx?|h5|tdms|json|parquet)$", "", text.casefold().strip())
    text = re.sub(r"(?<=[0-9])\.0+$", "", re.sub(r"[\s_]+", " ", text))
    return str(int(text)) if text.isascii() and text.isdigit() else text


def _moment(text: str) -> tuple[int, float] | None:
    """Return the day, 0 where none is stated, and the time of day [s]; None if there is none, or the day is unclear."""
    clock, (iso, _) = conditions.time_in(text), conditions.day_in(text) or ("", "")
    if clock is None or iso[:1] == "?":
        return None
    seconds = 3600 * clock.hour + 60 * clock.minute + clock.second + 1e-6 * clock.microsecond
    return date.fromisoformat(iso).toordinal() if iso else 0, seconds


def _group_names(text: str) -> set[str]:
    """Return names of a file or folder as they are compared: without marks and leading zeros, or as a date if it is."""
    iso, written = conditions.day_in(text) or ("", "")
    plain = re.sub(r"(?<![0-9.])0+(?=[0-9])", "", re.sub(r"[^\w.]|_", "", text.casefold()))
    day = iso.replace("-", "") if written == text.strip() else ""
    return {_key(text), _key(_SPECIMEN.sub("", text)), plain, day} - {""}


def _match(column: Sequence[str], names: Sequence[tuple[set[str], set[str]]], exact: bool) -> dict[int, int] | None:
    """Return the row of each test by one column; None unless every test has one row, and no row two."""
    keys = [_key(cell) for cell in column]
    if len(set(keys)) < len(keys) or "" in keys:
        return None
    matches = {}
    for test, (whole, numbers) in enumerate(names):
        candidates = [row for row, key in enumerate(keys) if key in (whole if exact else numbers | whole)]
        if len(candidates) != 1:
            return None
        matches[test] = candidates[0]
    return matches if matches and len(set(matches.values())) == len(matches) else None
