"""Rows of a delimited text: separator, decimal mark, first row of numbers, and the kinds of its cells."""

from __future__ import annotations

import csv
import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import islice
from typing import Literal

from mrdamper.rig_files.column_names import holds, is_unit, parse_unit, words
from mrdamper.rig_files.readers.base import NoTableError, RigFileError, Source
from mrdamper.rig_files.text.tokens import FORTRAN, looks_numeric, stamp

Kind = Literal["number", "stamp", "text"]
SPACES = " "  # stands for any run of spaces
SEPARATORS = (";", "\t", ",", "|", SPACES)
COMMENT = re.compile(  # a sheet's errors are cells, and so is what semicolons separate
    r"^\s*(?:(?:#(?!N/A|REF!|VALUE!|DIV/0|NAME\?|NULL!|NUM!)|%|//)+|;(?=\s+[^\W\d_]{4}[^;]*$))"
)
_MARKS, _DIGITS = frozenset("#%/;"), frozenset("0123456789+-.")
_FEWEST_LINES = 20  # of a text: fewer, with words among the numbers, are notes
SAMPLE = 60  # rows looked at
_STRAY = 0.1  # of the sampled numbers: fewer with the other decimal mark are single bad cells
TELLING = 2  # columns whose names tell what they are
_LONGEST_HEADING = 6  # words
WORD = re.compile(r"(?:[^\W\d_][- ])?[^\W\d_]{3,}")  # also x-axis, X start
QUANTITY = re.compile(r"([+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?)[ \u00a0]?([^\W\d_]\S{0,6}|°\S)")
_DATE = re.compile(r"[0-9]{1,2}\.[0-9]{1,2}\.[0-9]{2,4}|[0-9]{4}\.[0-9]{1,2}\.[0-9]{1,2}")
_GROUPED = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:,[0-9]{3})+")
_ALONE = re.compile(r"[+-]?[0-9]+,[0-9]{2,}\s*")  # may be one number or two
_NO_INTEGERS = re.compile(r"(?:-0,[0-9]{2,}|[+-]?[0-9]+,0[0-9]+)\s*")  # one with a decimal comma: -0,12, 3,05
_SCALES = words("scale") | {"offset"}


def counts(cells: Iterable[str]) -> bool:
    """Tell if cells count the rows, from one or zero on."""
    numbers = [int(bare) if (bare := cell.strip('"')).isascii() and bare.isdigit() else -1 for cell in cells]
    numbers = numbers[:SAMPLE]
    return len(numbers) > 1 and numbers[0] in (0, 1) and numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def numbers_columns(rows: Sequence[Sequence[str]]) -> bool:
    """Tell if the first row numbers three columns or more, 0, 1, 2, and others do not."""
    return bool(rows) and len(rows[0]) > TELLING and counts(rows[0]) and "." in "".join(rows[-1])


def without_units(lines: Sequence[str]) -> Sequence[str]:
    """Return the lines without the units behind their numbers, where no line is a row of plain numbers."""
    last = list(islice((line for line in reversed(lines) if line.strip()), SAMPLE))
    if any(is_row(cells_of(line, mark)) for line in last for mark in SEPARATORS):
        return lines
    return [next(filter(None, (_bare_row(line, mark) for mark in SEPARATORS[:-1])), line) for line in lines]


def _bare_row(line: str, separator: str) -> str:
    """Return a row of which at least two cells are numbers with units, without the units; empty if it is none."""
    cells = cells_of(line, separator)
    matches = [match if (match := QUANTITY.fullmatch(cell)) and is_unit(match[2]) else None for cell in cells]
    others = [cell for cell, match in zip(cells, matches, strict=True) if cell and not match]
    if len(cells) - cells.count("") - len(others) < 2 or any(stamp(cell) is None for cell in others):
        return ""
    return separator.join(match[1] if match else cell for cell, match in zip(cells, matches, strict=True))


def unit_behind(cells: Sequence[str]) -> str:
    """Return the first unit behind the numbers of a column, as it is written, where all are of its kind: N and kN."""
    matches = [QUANTITY.fullmatch(cell) for cell in cells if cell]
    units = list(dict.fromkeys(match[2] if match else "" for match in matches))
    kinds = {(unit.dimension, unit.offset) if (unit := parse_unit(text)) else () for text in units}
    return units[0] if len(kinds) == 1 and all(map(is_unit, units)) else ""


def exchanged_signs(rows: Sequence[Sequence[str]]) -> tuple[tuple[str, str], ...]:
    """Return signs used throughout and their meaning: D for E, a typographic minus."""
    cells = [cell for row in rows for cell in row if cell]
    exchanges: tuple[tuple[str, str], ...] = ()
    if 2 * sum(FORTRAN.fullmatch(cell) is not None for cell in cells) > len(cells):
        exchanges = (("D", "E"), ("d", "e"))
    negative = [cell[0] for cell in cells if cell[0] in "-−" and looks_numeric(cell) and len(cell) > 1]
    return (*exchanges, ("−", "-")) if len(negative) > 1 and set(negative) == {"−"} else exchanges


def split(line: str, separator: str) -> list[str]:
    """Return the stripped cells of a line; csv.Error if a quote is not closed."""
    if separator == SPACES:
        return line.split()
    if '"' in line:
        cells = next(csv.reader([line], delimiter=separator, strict=True, skipinitialspace=True))
    else:
        cells = line.split(separator)
    return [cell.strip(" \t") for cell in cells]


def split_strictly(
    text: str, separator: str, source: Source, line: int, remedy: str = "close it or remove it"
) -> list[str]:
    """Return the cells of a line of a file; E_QUOTE if a quote is not closed."""
    try:
        return split(text, separator)
    except csv.Error as error:
        raise source.refuse("E_QUOTE", "a quote is not closed, or text follows it", remedy, line=line) from error


def is_comment(line: str) -> bool:
    """Tell if a line is marked as a remark."""
    return line.lstrip()[:1] in _MARKS and COMMENT.match(line) is not None


def cells_of(line: str, separator: str) -> list[str]:
    """Return the stripped cells of a line, quotes or no quotes."""
    try:
        return split(line, separator)
    except csv.Error:
        return line.split(separator)


def cells_of_list(line: str) -> list[str]:
    """Return the bare cells of a line of a list: between commas, bars or the like, or between columns of spaces."""
    by_marks = re.split(r"[,;|\t]", line)
    return [cell.strip(' "') for cell in (by_marks if len(by_marks) > 1 else re.split(" {2,}", line))]


def content_of(lines: Sequence[str]) -> list[tuple[int, str]]:
    """Return the lines that are no remarks, with their places."""
    return [row for row in enumerate(lines) if row[1][:1] in _DIGITS or (row[1].strip() and not is_comment(row[1]))]


def separator_of(lines: Sequence[str], content: Sequence[tuple[int, str]], source: Source) -> str:
    """Return the one under which the last lines at hand split into most numbers, evenly."""
    last = [line for _, line in content[-SAMPLE:]]
    if not last:
        problem = f"only remarks in the first {len(lines)} lines"
        raise source.refuse("E_NO_DATA", problem, "remove them, or export the data again")
    evenness = {separator: round(_evenness(last, separator), 9) for separator in SEPARATORS}
    best = max(SEPARATORS, key=evenness.__getitem__)
    if best == "," and all(map(_ALONE.fullmatch, last)) and any(_NO_INTEGERS.fullmatch(line) for _, line in content):
        return ";"
    if evenness[best]:
        return best
    # One column, or only a header: the separator does not matter, or the header shows it.
    counts = {s: last[-1].count(s) for s in SEPARATORS[:-1]}
    return max(counts, key=lambda s: counts[s]) if any(counts.values()) else ","


def _evenness(lines: Sequence[str], separator: str) -> float:
    rows = [cells for cells in (cells_of(line, separator) for line in lines) if len(cells) > 1]
    numeric = [sum(bool(cell) and looks_numeric(cell) for cell in row) for row in rows]
    data = [len(row) for row, count in zip(rows, numeric, strict=True) if count >= 2 or 2 * count > len(row)]
    if not data:
        return 0.0
    width, agreeing = Counter(data).most_common(1)[0]
    filled = [sum(map(bool, row)) for row in rows if len(row) == width]
    values = [count for row, count in zip(rows, numeric, strict=True) if len(row) == width]
    return agreeing / len(lines) * sum(values) / max(1, sum(filled))


def is_row(cells: Sequence[str]) -> bool:
    """Tell if the cells of a line are those of a row of numbers, some of which may be missing."""
    filled = [cell for cell in cells if cell]
    numeric = sum(looks_numeric(cell) and cell.lower() not in ("-", "--") for cell in filled)
    return numeric >= 1 and (numeric >= 2 or len(filled) <= 2) and 3 * numeric >= len(filled)


def first_row(content: Sequence[tuple[int, str]], above: int, separator: str, source: Source) -> tuple[int, int, bool]:
    """Index of the first row of data from an index on, number of columns, whether rows end with a separator."""
    start = bisect_left(content, above, key=lambda entry: entry[0])
    before, content = content[:start], content[start:]
    sample = [cells_of(line, separator) for _, line in content[-SAMPLE:]]
    rows = [cells for cells in sample if is_row(cells)]
    prose = all(sum(WORD.match(cell) is not None for cell in cells) >= 2 for cells in rows)
    if separator == SPACES and len(content) < _FEWEST_LINES and prose:
        raise NoTableError("E_NO_DATA", "text with numbers in it, but no rows of numbers", file=source.name)
    few = not rows or (len(rows) == 1 and len(content) > 1 and not is_row(sample[-1]))
    named = few and any(names_columns(line, mark) for _, line in content[-SAMPLE:] for mark in SEPARATORS[:-1])
    width = Counter(map(len, rows)).most_common(1)[0][0] if rows else 0
    labelled = 2 * sum(not cells[0] or _is_key(cells[0].strip('"')) for cells in rows) > len(rows)  # or notes beside
    row = None if named or not rows else _first_of(content, width, separator, labelled=labelled)
    if row is None:
        what = "names of columns, but no row of numbers below them" if named else "no row of numbers"
        kind = RigFileError if named else NoTableError
        aside = f", or, if it is no test, set [file] leave_out = [{source.name!r}] in a profile" if named else ""
        raise kind("E_NO_DATA", what, file=source.name, remedy=f"export the file again, with its data{aside}")
    first, cells = row
    trailing = width > 1 and separator != SPACES and not cells[-1] and not any(r[-1] for r in rows if len(r) == width)
    if trailing:
        over = (cells_of(line, separator) for i, line in (*before, *content) if i < first)
        over = (cells[:-1] if len(cells) == width + 1 and not cells[-1] else cells for cells in over)
        header = [cells for cells in over if len(cells) in (width, width - 1)]
        header = header[:-1] if len(header) > 1 and all(is_unit(cell) for cell in header[-1] if cell) else header
        trailing = not header or len(header[-1]) == width - 1 or not header[-1][-1]
    return first, width - trailing, trailing


def _first_of(
    content: Sequence[tuple[int, str]], width: int, separator: str, *, labelled: bool
) -> tuple[int, list[str]] | None:
    """Index and cells of the first row; None if there is none.

    A key with numbers behind it is none, unless the rows are labelled. A key of its own is none above rows of one
    label, nor is one of scales: Scale,1,1,1; Data,0.0,1.2,3.4.
    """
    worded: tuple[int, list[str]] | None = None
    first: tuple[int, list[str]] | None = None
    rows = [cells_of(line, separator) for _, line in content] if labelled else []
    keys = Counter(cells[0].strip('"').casefold() for cells in rows if len(cells) == width and is_row(cells))
    label = next((key for key, count in keys.most_common(1) if count > 2 and 2 * count > len(keys)), "-")
    for i, line in content:
        cells = cells_of(line, separator)
        if not is_row(cells):
            first, worded = None, worded or (i, cells)
        elif len(cells) == width and not _is_key(cells[0].strip('"')):
            return first or (i, cells)
        elif len(cells) == width and labelled:
            alike = not label and width > TELLING and len({*filter(None, cells[1:])}) == 1  # Time, 10:31:22, 10:31:22
            alone = keys[key := cells[0].strip('"').casefold()] == 1 and (_is_key(label) or holds(key, _SCALES))
            first = None if alike else first or (None if alone else (i, cells))
    return first or worded


def _is_key(cell: str) -> bool:
    """Tell if the first cell of a line of numbers is a text, as X0 is: no number, nor a date."""
    return cell[:1].isalpha() and not looks_numeric(cell)


def rows_of(lines: Sequence[str], separator: str, width: int, trailing: bool) -> list[list[str]]:
    """Return the cells of the first and the last rows of that width among lines."""
    rows = [cells_of(line, separator) for _, line in content_of([*lines[:SAMPLE], *lines[SAMPLE:][-SAMPLE:]])]
    return [row[:width] for row in rows if len(row) == width + trailing]


def decimal_of(rows: Sequence[Sequence[str]], source: Source, first: int) -> str:
    """Return the decimal mark of rows, the first of which stands at a place; E_AMBIGUOUS if it may be either."""
    cells = [c for row in rows for c in row if ("," in c) != ("." in c) and ", " not in c]  # a list: 1, 2, 3
    cells = cells if any("," in c for c in cells) else []
    numbers = [c for c in cells if looks_numeric(c) and stamp(c) is None and not _DATE.fullmatch(c)]
    dots, commas = ([c for c in numbers if mark in c] for mark in ".,")
    few = _STRAY * (len(dots) + len(commas))
    if len(commas) <= few:
        return "."  # the strict reader refuses the few others, with their place
    if len(dots) > few:
        problem = f"{dots[0]!r} beside {commas[0]!r}: point or comma for decimals?"
        remedy = 'write one decimal mark throughout, or set [file] decimal = "." or decimal = "," in a profile'
        raise source.refuse("E_AMBIGUOUS", problem, remedy, line=first + 1)
    if all(_GROUPED.fullmatch(c) for c in commas):
        remedy = 'say decimal = "," or decimal = "." under [file] of a profile'
        raise source.refuse("E_AMBIGUOUS", f"{commas[0]!r} may be a decimal comma or thousands", remedy, line=first + 1)
    return ","


def names_columns(line: str, separator: str) -> bool:
    """Tell if a line heads columns: three names or more, no number and no sentence, and no list of what each means."""
    cells = [cell for cell in cells_of(line, separator) if cell]
    others = (looks_numeric(cell) or ": " in cell or len(cell.split()) > _LONGEST_HEADING for cell in cells)
    return len(cells) >= 3 and not any(others)


def kind_of(cells: Sequence[str]) -> Kind:
    """Return the kind of most cells of a column that are not empty."""
    filled = [cell for cell in cells if cell]
    stamps = sum(stamp(cell) is not None for cell in filled)
    if stamps and 2 * stamps >= len(filled):
        return "stamp"
    numbers = sum(looks_numeric(cell) for cell in filled)
    return "number" if not filled or 2 * numbers >= len(filled) else "text"
