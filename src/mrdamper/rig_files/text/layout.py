"""The form of a delimited text: separator, decimal mark, header, units, first row of data.

Nothing is guessed: what the first lines do not settle is refused, with the profile's line
that settles it.
"""

from __future__ import annotations

import csv
import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, islice
from string import ascii_uppercase
from typing import Literal

from mrdamper.rig_files.column_names import UNIT_KEYS, holds, is_unit, parse_unit, role_of, split_name, words
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.base import MOST_COLUMNS, NoTableError, RigFileError, Source
from mrdamper.rig_files.text.tokens import FORTRAN, MISSING, looks_numeric, stamp, with_notes_beside

Kind = Literal["number", "stamp", "text"]
SPACES = " "  # stands for any run of spaces
X_VALUE = "X_Value"  # the clock of LabVIEW, whose cells may be empty
_SIMULINK = "Block Path: "  # of signals exported by Simulink, whose time is in seconds
_SEPARATORS = (";", "\t", ",", "|", SPACES)
_COMMENT = re.compile(  # a sheet's errors are cells, and so is what semicolons separate
    r"^\s*(?:(?:#(?!N/A|REF!|VALUE!|DIV/0|NAME\?|NULL!|NUM!)|%|//)+|;(?=\s+[^\W\d_]{4}[^;]*$))"
)
_KEY_AND_VALUE = re.compile(  # Samples: 4850, Unit: V
    rf"(?i)[^:=]*[^\W\d_][^:=]*[:=]\s*[-+0-9.,]+\W*[^\W\d_]*|(?:{'|'.join(UNIT_KEYS)})\s*[:=].*"
)
_UNIT_OF_ALL = re.compile(  # ; Unit: V, above the only column
    rf"(?i)[\s#%;\"]*(?:(?:y|vertical|channel|signal|data)[ _-]*)?(?:{'|'.join(UNIT_KEYS)})\"?"
    r"\s*[:=,;\t]\s*\"?([^\s\",;]+)[\s\",;]*$"
)
_LISTING = re.compile(
    r"^\s*(?:columns?|channels?|fields?|spalten|kanäle|colonnes|header|names)\s*[:=]\s*", re.IGNORECASE
)
_MARKS, _DIGITS = frozenset("#%/;"), frozenset("0123456789+-.")
_FEWEST_LINES = 20  # of a text: fewer, with words among the numbers, are notes
_SAMPLE = 60  # rows looked at
_STRAY = 0.1  # of the sampled numbers: fewer with the other decimal mark are single bad cells
_UNIT_KEYS, _NOTES, _SCALES = UNIT_KEYS, words("notes"), words("scale") | {"offset"}
_MOST_LEVELS = 4  # lines of headings
_TELLING = 2  # columns whose names tell what they are
_LONGEST_HEADING = 6  # words
_TYPE = re.compile(r"[a-z]{1,6}[0-9]{1,2}")  # f8, int16
_WORD = re.compile(r"(?:[^\W\d_][- ])?[^\W\d_]{3,}")  # also x-axis, X start
_NAME_AND_UNIT = re.compile(r"[^\s\[(<{]+(?:\s*\[[^\[\]]*\]|\s*\([^()]*\))?")
QUANTITY = re.compile(r"([+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?)[ \u00a0]?([^\W\d_]\S{0,6}|°\S)")
LISTED = re.compile(  # a numbered line that names a column and its unit: 1=Time;min, COL 2 FORCE (LBF)
    rf"^[\s\"#%]*(?:{'|'.join(words('numbered'))})?[\s#._]*(?P<number>[0-9]{{1,3}})\"?(?:\s*[=:;,\t]\s*|\s+)\"?"
    r"(?P<name>[^\d\W][^;,\t\[\](){}=]*?)\"?\s*[;,\t\[({]\s*\"?(?P<unit>[^;,\t\[\](){}\"]{1,12})\"?[\])}]?[\s;,\"]*$",
    re.IGNORECASE,
)
_DECIMAL = re.compile(r"(?i)decimal[ _](?:separator|mark|sign|symbol)\"?\s*[:=;,\t]\s*\"?([.,])\"?;?")
_CURRENT = re.compile(r":\s*[0-9.,]+ ?m?A\b")
_ENTRY = re.compile(r"[0-9]{1,4}([-./])[0-9]{1,2}\1[0-9]{1,4}|\S+\.[A-Za-z][A-Za-z0-9]{1,3}")  # a date, a file: no name
_DATE = re.compile(r"[0-9]{1,2}\.[0-9]{1,2}\.[0-9]{2,4}|[0-9]{4}\.[0-9]{1,2}\.[0-9]{1,2}")
_GROUPED = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:,[0-9]{3})+")


@dataclass(frozen=True, slots=True)
class Layout:
    """Layout of a delimited text; lines count from one, tuples hold one entry per column."""

    separator: str  # a space stands for any run of spaces
    decimal: str
    names: tuple[str, ...]  # empty where there is none, like units
    units: tuple[str, ...]
    kinds: tuple[Kind, ...]  # what the sampled cells look like
    header_line: int | None
    data_line: int
    trailing: bool  # every row ends with a separator
    header: str = ""  # the line of names as it stands, to find it again where it is repeated
    odd: tuple[str, ...] = ()  # a sampled cell of a column of kind "text", else empty
    remarks: tuple[str, ...] = ()  # the lines above the names of columns
    over: tuple[str, ...] = ()  # where the line above the names holds titles of groups of columns
    writes: tuple[tuple[str, str], ...] = ()  # signs used throughout and their meaning: D for E, a typographic minus
    behind: tuple[str, ...] = ()  # where its numbers have a unit behind them: 12.3 mm
    groups: bool = False  # the other mark thousands, as a profile states the decimal one: 1,000

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.names)


def find_layout(lines: Sequence[str], source: Source, form: FileForm) -> Layout:
    """Sniff the layout from the first lines of a text, without line ends; what the form says wins.

    Raises `RigFileError`, its code E_NO_DATA, E_AMBIGUOUS, E_FIELD_COUNT, E_TOO_MANY_COLUMNS or E_QUOTE.
    """
    as_written, lines = lines, _without_units(lines)
    content = _content(lines)
    separator = form.separator or _separator(lines, content, source)
    above = form.data_line - 1 if form.data_line else form.header_line or 0
    first, width, trailing = _first_row(content, above, separator, source)
    unstated = form.header_line is None and form.data_line is None
    if unstated and (again := _below_preamble(lines, first, separator)):
        first, width, trailing = _first_row(content, again, separator, source)
    if width > MOST_COLUMNS:
        raise source.refuse("E_TOO_MANY_COLUMNS", f"{width} columns", "is one sample one line?", line=first + 1)
    rows = _rows(lines[first:], separator, width, trailing)
    if not any(map(str.strip, lines[:first])) and width > _TELLING and _counts(rows[0]) and "." in "".join(rows[-1]):
        first, rows = first + 1, rows[1:]  # 0, 1, 2: numbers of the columns
    stated = (match[1] for line in lines[:first] if (match := _DECIMAL.fullmatch(line.strip())))
    decimal = form.decimal or next(stated, None) or _decimal(rows, source, first)
    if _counts(row[0] for row in rows):
        lines = [*_with_name_of_numbers(lines[:first], separator, width), *lines[first:]]
    seconds = any(_SIMULINK in line for line in lines[:first])
    lines = [*_without_keys(lines[:first], separator), *lines[first:]]
    header, unit_row = _header_lines(lines, first, separator, width, source, form)
    if header is not None and not is_comment(lines[header]):
        split_strictly(lines[header], separator, source, header + 1)
    names, titles = form.names or ("",) * width, ()
    below = [] if header is None else [lines[i] for i in range(header + 1, min(first, len(lines))) if i != unit_row]
    if header is not None and not form.names:
        names, titles = _names_and_titles(lines, header, below, separator, width)
    trailing |= header is not None and separator != SPACES and _names_notes(cells_of(lines[header], separator), width)
    if len(names) != width:
        raise _mismatch(source, separator, len(names), width, first, lines)
    units = _cells(lines[unit_row], separator, width) if unit_row is not None else _unit_alone(lines[:first], width)
    units = ("" if units[0].casefold() in _UNIT_KEYS else units[0], *units[1:])
    columns = [[row[i] for row in rows if len(row) > i] for i in range(width)]
    names = tuple("" if n == X_VALUE and not any(c) else n for n, c in zip(names, columns, strict=True))
    written = rows if as_written is lines else _rows(as_written[first:], separator, width, trailing)
    behind = tuple(_unit_behind([row[i] for row in written if len(row) > i]) for i in range(width))
    clocks = ("s" if seconds and name == "time" else "" for name in names)
    units = tuple(own or its or clock for own, its, clock in zip(behind, units, clocks, strict=True))
    kinds = _kinds(columns, behind)
    above = lines[: min(first, len(lines)) if header is None else header]
    row = rows[0] if rows else []
    first -= next((n for n in range(len(below), 0, -1) if _lacks_numbers(lines[first - n], separator, row)), 0)
    names, units, notes = with_notes_beside(rows, names, units)
    return Layout(
        separator,
        decimal,
        tuple(name.strip() for name in names),
        tuple(_unbracket(unit) for unit in units),
        kinds,
        None if header is None else header + 1,
        first + 1,
        trailing,
        "" if header is None else lines[header],
        tuple(next(filter(None, c), "") if k == "text" else "" for c, k in zip(columns, kinds, strict=True)),
        (*(line for line in (*above, *below) if line.strip()), *notes),
        titles or _titles(above, separator, width),
        _writes(rows),
        behind,
        form.decimal is not None,
    )


def _kinds(columns: Sequence[Sequence[str]], behind: Sequence[str]) -> tuple[Kind, ...]:
    """Kinds of columns; one whose numbers have units behind them holds numbers."""
    return tuple("number" if unit else _kind(column) for column, unit in zip(columns, behind, strict=True))


def _unit_alone(above: Sequence[str], width: int) -> tuple[str, ...]:
    """Units of columns without a row of units: that of the only column may stand in a line above."""
    alone = [match[1] for line in above if width == 1 and (match := _UNIT_OF_ALL.match(line))]
    return tuple(alone) if len(alone) == 1 and is_unit(alone[0]) else ("",) * width


def _counts(cells: Iterable[str]) -> bool:
    """Tell if cells count the rows, from one or zero on."""
    numbers = [int(bare) if (bare := cell.strip('"')).isascii() and bare.isdigit() else -1 for cell in cells]
    numbers = numbers[:_SAMPLE]
    return len(numbers) > 1 and numbers[0] in (0, 1) and numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def _with_name_of_numbers(above: Sequence[str], separator: str, width: int) -> list[str]:
    """Lines above the rows, an empty name before the names if these are one too few: R names no row numbers."""
    plain = [i for i, line in enumerate(above) if line.strip() and not is_comment(line)]
    named = [i for i in plain if len(_roles(cells_of(above[i], separator))) >= _TELLING]
    if len(named) != 1 or len(cells_of(above[named[0]], separator)) != width - 1:
        return list(above)
    return [f'""{separator}{line}' if i == named[0] else line for i, line in enumerate(above)]


def _without_keys(above: Sequence[str], separator: str) -> Iterator[str]:
    """Yield lines above the rows, without a key that all cells of one have: units of Unit: mm, Unit: N, none of a path.

    A line of other properties is no heading.
    """
    for line in above:
        pairs = [cell.strip('"').partition(": ") for cell in cells_of(line, separator)]
        keys = {key.strip().casefold() for key, mark, _ in pairs if key or mark}
        keyed = [mark for key, mark, _ in pairs if key or mark]
        if len(keys) == 1 < len(keyed) and all(keyed):
            yield separator.join(cell for *_, cell in pairs) if keys <= _UNIT_KEYS else line * any(map(role_of, keys))
        else:
            yield line


def _names_and_titles(
    lines: Sequence[str], header: int, below: Sequence[str], separator: str, width: int
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of columns, of several levels of headings and of an index alone below them, and the titles."""
    names = _cells(lines[header], separator, width)
    alone = [cells[0] for line in below if len(cells := _cells(line, separator, width)) == width and not any(cells[1:])]
    if len(alone) == 1 and alone[0] and not _roles(names[:1]):  # pandas puts the name of the index there
        names = (alone[0], *names[1:])
    return _with_levels(names, _levels(lines[:header], separator, width))


def _levels(above: Sequence[str], separator: str, width: int) -> list[tuple[str, ...]]:
    """Return the lines of cells right above the names of columns, one cell a column."""
    levels: list[tuple[str, ...]] = []
    for line in reversed(above[-_MOST_LEVELS:]):
        if not line.strip() or is_comment(line) or separator == SPACES:
            break
        cells = cells_of(line, separator)
        if len(cells) != width or sum(map(bool, cells)) < 2:
            break
        levels.append(tuple(cell.strip('"') for cell in cells))
    return levels


def _with_levels(names: tuple[str, ...], levels: list[tuple[str, ...]]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of columns of a table with several levels of headings, and the titles of the other level.

    The last line names the index alone, a line above it the channels, another their conditions.
    """
    empty = [i for i, name in enumerate(names) if not name]
    if len(_roles(names)) >= _TELLING or len(empty) < _TELLING:
        return names, ()
    telling = [cells for cells in levels if len(_roles([cells[i] for i in empty])) >= _TELLING]
    if len(telling) != 1:
        return names, ()
    filled = tuple(name or cell for name, cell in zip(names, telling[0], strict=True))
    others = [cells for cells in levels if cells is not telling[0]]
    return filled, others[0] if others else ()


def _without_units(lines: Sequence[str]) -> Sequence[str]:
    """Return the lines without the units behind their numbers, where no line is a row of plain numbers."""
    last = list(islice((line for line in reversed(lines) if line.strip()), _SAMPLE))
    if any(is_row(cells_of(line, mark)) for line in last for mark in _SEPARATORS):
        return lines
    return [next(filter(None, (_bare_row(line, mark) for mark in _SEPARATORS[:-1])), line) for line in lines]


def _bare_row(line: str, separator: str) -> str:
    """Return a row of which at least two cells are numbers with units, without the units; empty if it is none."""
    cells = cells_of(line, separator)
    matches = [match if (match := QUANTITY.fullmatch(cell)) and is_unit(match[2]) else None for cell in cells]
    others = [cell for cell, match in zip(cells, matches, strict=True) if cell and not match]
    if len(cells) - cells.count("") - len(others) < 2 or any(stamp(cell) is None for cell in others):
        return ""
    return separator.join(match[1] if match else cell for cell, match in zip(cells, matches, strict=True))


def _unit_behind(cells: Sequence[str]) -> str:
    """Return the first unit behind the numbers of a column, as it is written, where all are of its kind: N and kN."""
    matches = [QUANTITY.fullmatch(cell) for cell in cells if cell]
    units = list(dict.fromkeys(match[2] if match else "" for match in matches))
    kinds = {(unit.dimension, unit.offset) if (unit := parse_unit(text)) else () for text in units}
    return units[0] if len(kinds) == 1 and all(map(is_unit, units)) else ""


def _writes(rows: Sequence[Sequence[str]]) -> tuple[tuple[str, str], ...]:
    cells = [cell for row in rows for cell in row if cell]
    exchanges: tuple[tuple[str, str], ...] = ()
    if 2 * sum(FORTRAN.fullmatch(cell) is not None for cell in cells) > len(cells):
        exchanges = (("D", "E"), ("d", "e"))
    negative = [cell[0] for cell in cells if cell[0] in "-−" and looks_numeric(cell) and len(cell) > 1]
    return (*exchanges, ("−", "-")) if len(negative) > 1 and set(negative) == {"−"} else exchanges


def _below_preamble(lines: Sequence[str], first: int, separator: str) -> int:
    """Index below the names of columns of the test, where a table of something else stands above it; else zero.

    Testing machines put a table of results above the record. It is one if other names of
    columns follow that hold displacement and force, and its own do not.
    """
    wanted = {"displacement", "force"}
    heads = (i for i, line in enumerate(lines[: first + _SAMPLE]) if wanted <= _roles(_fields(line, separator, 0)))
    head = next(heads, -1)
    return head + 1 if head >= first else 0


def _roles(cells: Sequence[str]) -> set[str | None]:
    """Return the channels that cells name; current: 0.5 A names none."""
    named = [cell.strip('"') for cell in cells[:MOST_COLUMNS] if cell and not _CURRENT.search(cell)]
    return {split_name(cell).role for cell in named} - {None}


def is_footer(line: str, layout: Layout) -> bool:
    """Tell if a line among the rows begins with a word in a column of numbers: Maximum; 12.5; 3.4."""
    cells = cells_of(line, layout.separator)
    if not any(cells):
        return False
    at = next(i for i, cell in enumerate(cells) if cell)
    first = cells[at].lstrip("[<(*=-'")
    worded = first[:1].isalpha() and _WORD.search(first) is not None and cells[at].lower() not in MISSING
    return worded and (at >= layout.width or layout.kinds[at] != "text")


def _titles(above: Sequence[str], separator: str, width: int) -> tuple[str, ...]:
    """Titles of groups of columns, one a column: each stands over its group's first column."""
    if not above or separator == SPACES or is_comment(above[-1]):
        return ()
    cells = cells_of(above[-1], separator)[:width]
    if sum(map(bool, cells)) < 2 or not cells[0] or len(cells) < width // 2:
        return ()
    return tuple(accumulate([*cells, *[""] * (width - len(cells))], lambda before, cell: cell or before))


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


def units_in(line: str, layout: Layout) -> tuple[str, ...]:
    """Return the units a line states, one a column; empty if it is no row of units."""
    cells = _cells(line, layout.separator, layout.width)
    return tuple(map(_unbracket, cells)) if len(cells) == layout.width and is_units(cells) else ()


def is_comment(line: str) -> bool:
    """Tell if a line is marked as a remark."""
    return line.lstrip()[:1] in _MARKS and _COMMENT.match(line) is not None


def cells_of(line: str, separator: str) -> list[str]:
    """Return the stripped cells of a line, quotes or no quotes."""
    try:
        return split(line, separator)
    except csv.Error:
        return line.split(separator)


def _content(lines: Sequence[str]) -> list[tuple[int, str]]:
    rows = enumerate(lines)
    return [row for row in rows if row[1][:1] in _DIGITS or (row[1].strip() and not is_comment(row[1]))]


def _separator(lines: Sequence[str], content: Sequence[tuple[int, str]], source: Source) -> str:
    """Return the one under which the last lines at hand split into most numbers, evenly."""
    last = [line for _, line in content[-_SAMPLE:]]
    if not last:
        problem = f"only remarks in the first {len(lines)} lines"
        raise source.refuse("E_NO_DATA", problem, "remove them, or export the data again")
    evenness = {separator: round(_evenness(last, separator), 9) for separator in _SEPARATORS}
    if any(evenness.values()):
        return max(_SEPARATORS, key=evenness.__getitem__)
    # One column, or only a header: the separator does not matter, or the header shows it.
    counts = {s: last[-1].count(s) for s in _SEPARATORS[:-1]}
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


def _first_row(content: Sequence[tuple[int, str]], above: int, separator: str, source: Source) -> tuple[int, int, bool]:
    """Index of the first row of data from an index on, number of columns, whether rows end with a separator."""
    start = bisect_left(content, above, key=lambda entry: entry[0])
    before, content = content[:start], content[start:]
    sample = [cells_of(line, separator) for _, line in content[-_SAMPLE:]]
    rows = [cells for cells in sample if is_row(cells)]
    prose = all(sum(_WORD.match(cell) is not None for cell in cells) >= 2 for cells in rows)
    if separator == SPACES and len(content) < _FEWEST_LINES and prose:
        raise NoTableError("E_NO_DATA", "text with numbers in it, but no rows of numbers", file=source.name)
    few = not rows or (len(rows) == 1 and len(content) > 1 and not is_row(sample[-1]))
    named = few and any(_names_columns(line, mark) for _, line in content[-_SAMPLE:] for mark in _SEPARATORS[:-1])
    if not rows or named:
        what = "names of columns, but no row of numbers below them" if named else "no row of numbers"
        kind = RigFileError if named else NoTableError
        aside = f", or, if it is no test, set [file] leave_out = [{source.name!r}] in a profile" if named else ""
        raise kind("E_NO_DATA", what, file=source.name, remedy=f"export the file again, with its data{aside}")
    width = Counter(len(cells) for cells in rows).most_common(1)[0][0]
    labelled = 2 * sum(not cells[0] or _is_key(cells[0].strip('"')) for cells in rows) > len(rows)  # or notes beside
    first, cells = _first_of(content, width, separator, labelled=labelled)
    trailing = width > 1 and separator != SPACES and not cells[-1] and not any(r[-1] for r in rows if len(r) == width)
    if trailing:
        over = (cells_of(line, separator) for i, line in (*before, *content) if i < first)
        over = (cells[:-1] if len(cells) == width + 1 and not cells[-1] else cells for cells in over)
        header = [cells for cells in over if len(cells) in (width, width - 1)]
        trailing = not header or len(header[-1]) == width - 1 or not header[-1][-1]
    return first, width - trailing, trailing


def _first_of(
    content: Sequence[tuple[int, str]], width: int, separator: str, *, labelled: bool
) -> tuple[int, list[str]]:
    """Index and cells of the first row; a key with numbers behind it is none, unless the rows are labelled.

    A key of its own is none above rows of one label, nor is one of scales: Scale,1,1,1; Data,0.0,1.2,3.4.
    """
    worded: tuple[int, list[str]] | None = None
    first: tuple[int, list[str]] | None = None
    rows = [cells_of(line, separator) for _, line in content] if labelled else []
    keys = Counter(cells[0].strip('"').casefold() for cells in rows if len(cells) == width and is_row(cells))
    label = next((key for key, count in keys.most_common(1) if count > 1), "-")  # of most rows; - if each has its own
    for i, line in content:
        cells = cells_of(line, separator)
        if not is_row(cells):
            first, worded = None, worded or (i, cells)
        elif len(cells) == width and not _is_key(cells[0].strip('"')):
            return first or (i, cells)
        elif len(cells) == width and labelled:
            alike = not label and width > _TELLING and len({*filter(None, cells[1:])}) == 1  # Time, 10:31:22, 10:31:22
            alone = keys[key := cells[0].strip('"').casefold()] == 1 and (_is_key(label) or holds(key, _SCALES))
            first = None if alike else first or (None if alone else (i, cells))
    row = first or worded
    assert row is not None
    return row


def _is_key(cell: str) -> bool:
    """Tell if the first cell of a line of numbers is a text, as X0 is: no number, nor a date."""
    return cell[:1].isalpha() and not looks_numeric(cell)


def _rows(lines: Sequence[str], separator: str, width: int, trailing: bool) -> list[list[str]]:
    content = [line for _, line in _content([*lines[:_SAMPLE], *lines[_SAMPLE:][-_SAMPLE:]])]
    rows = [cells_of(line, separator) for line in content]
    return [row[:width] for row in rows if len(row) == width + trailing]


def _decimal(rows: Sequence[Sequence[str]], source: Source, first: int) -> str:
    cells = [c for row in rows for c in row if ("," in c) != ("." in c)]
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


def _header_lines(
    lines: Sequence[str], first: int, separator: str, width: int, source: Source, form: FileForm
) -> tuple[int | None, int | None]:
    """Return indices of the line of names and of the line of units above the data."""
    if form.header_line is not None:
        header = form.header_line - 1 if form.header_line else None
        units = form.units_line - 1 if form.units_line else None
        for index in (header, units):
            if index is not None and not 0 <= index < len(lines):
                raise source.refuse("E_PROFILE", f"there is no line {index + 1}", "correct [file] of the profile")
        return header, units
    cells = {i: own for i, t in enumerate(lines[:first]) if len(own := _cells(t, separator, width)) == width}
    roles = {i: len(_roles(own)) for i, own in cells.items()}
    filled = [i for i, line in enumerate(lines[:first]) if line.strip()]
    marked = [i for i in filled if is_comment(lines[i])]
    numbers = {int(match["number"]) for line in lines[:first] if (match := LISTED.match(line))}
    listed = width > 1 and numbers == set(range(1, width + 1))  # lines name the columns by their numbers
    valued = [i for i in filled if width == 1 and _KEY_AND_VALUE.fullmatch(cells.get(i, ("",))[0])]
    plain = [] if listed else [i for i in filled if i not in (*marked, *valued)]
    keyed = _keyed_lines({i: cells[i] for i in plain if i in cells}, roles)
    if keyed:
        return keyed
    for candidates in (plain, [i for i in marked if i not in valued]):
        fitting = [i for i in candidates if i in cells][-2 if width == 1 else 0 :]
        entered = [i for i in fitting if any(map(_ENTRY.fullmatch, cells[i]))]  # not "Date","2022/07/05"
        entered = [i for i in entered if looks_numeric(cells[i][0]) or _ENTRY.fullmatch(cells[i][0])]
        fitting = [i for i in fitting if i not in entered] or fitting
        if not fitting:
            continue
        telling = [i for i in fitting if roles[i] >= _TELLING]
        entries = [i for i in fitting if roles[i] == 1 and sum(cell[:1].isdigit() for cell in cells[i]) > 1]
        fitting = [i for i in fitting if not telling or i not in entries]  # but Current (A), , 0, 0.5
        last = fitting[-1]
        if candidates is plain and last != plain[-1] and _names_columns(lines[plain[-1]], separator):
            break
        stated = [i for i in reversed(fitting) if is_units(cells[i])]
        units = next((i for i in stated if not _is_times(cells[i])), (*stated, None)[0])
        naming = [i for i in fitting if i != units and (units is None or i < units)]
        if units is not None and units != last:  # keys with one cell a column: TraceName, VUnit, HUnit
            named = [i for i in telling if i < units]
            if named and _WORD.match(cells[units][0]) and not is_unit(_unbracket(cells[units][0])):
                return named[-1], units
            if units == fitting[-2] and not naming:  # above the names
                return last, units
        varied = [i for i in naming if 2 * len({*cells[i]}) > width or not all(map(_TYPE.fullmatch, cells[i]))]
        naming = varied or naming
        if units is not None and (units == last or not roles[last]):
            return (naming[-1] if naming else None), units
        last = telling[-1] if telling and not roles[last] else last  # names of sensors or types below the names
        below = [i for i in marked if i > last and i in cells and is_units(cells[i])]  # #, deg, mm, N
        below = below if candidates is plain else []
        return last, (form.units_line - 1 if form.units_line else (*below, None)[0])
    naming = [i for i in plain if _names_columns(lines[i], separator)]
    naming = [i for i in naming if i == plain[-1] or len(_roles(_fields(lines[i], separator, 0))) >= _TELLING]
    if naming and not form.names:
        raise _mismatch(source, separator, len(_fields(lines[naming[-1]], separator, width)), width, first, lines)
    return None, (form.units_line - 1 if form.units_line else None)


def _keyed_lines(cells: Mapping[int, Sequence[str]], roles: Mapping[int, int]) -> tuple[int, int] | None:
    """Return the lines of names and of units, where lines begin with what they hold: descriptor, path, unit.

    A last line that begins with a time holds the names: Channel, Position, Force; Unit, mm, N; Time (s), C1, C2.
    """
    units = [i for i, row in cells.items() if row[0].casefold() in _UNIT_KEYS and is_units(row[1:])]
    others = {i: row for i, row in cells.items() if i not in units and row[0].casefold() not in _NOTES}
    last = [i for i in others if i == max(cells) and split_name(others[i][0]).role == "time" and units]
    if last and not any(not cell or looks_numeric(cell) or stamp(cell) is not None for cell in others[last[0]]):
        return last[0], units[-1]
    named = {i: (row[0].casefold() == "name", roles[i], i) for i, row in others.items()}
    return (max(named, key=lambda i: named[i]), units[-1]) if units and named else None


def _names_columns(line: str, separator: str) -> bool:
    """Tell if a line heads columns: three names or more, no number and no sentence."""
    cells = [cell for cell in cells_of(line, separator) if cell]
    return len(cells) >= 3 and not any(looks_numeric(cell) or len(cell.split()) > _LONGEST_HEADING for cell in cells)


def _fields(line: str, separator: str, width: int) -> list[str]:
    """Cells of a line of names; remark signs and one trailing separator are taken off."""
    listed = is_comment(line)
    if listed:
        line = _LISTING.sub("", _COMMENT.sub("", line, count=1))
    if separator == SPACES:
        wide = re.split(r"\s{2,}|\t", line.strip())
        narrow = line.split()
        with_units = _NAME_AND_UNIT.findall(line.strip()) if len(narrow) != width else narrow
        return next((cells for cells in (wide, with_units) if len(cells) == width), narrow)
    cells = cells_of(line, separator)
    if listed and len(cells) != width:  # a list of names has separators of its own: columns: time [s], load [N]
        others = [other for mark in _SEPARATORS[:-1] if len(other := cells_of(line, mark)) == width]
        cells = next((other for other in others if len(_roles(other)) >= _TELLING), cells)
    return cells[:-1] if len(cells) == width + 1 and (not cells[-1] or _names_notes(cells, width)) else cells


def _names_notes(cells: Sequence[str], width: int) -> bool:
    """Tell if one more name than there are columns is that of notes, which most rows leave out."""
    return len(cells) == width + 1 and cells[-1].strip('"').casefold() in _NOTES


def _cells(line: str, separator: str, width: int) -> tuple[str, ...]:
    return tuple(cell.strip().strip('"') for cell in _fields(line, separator, width))


def is_units(cells: Sequence[str]) -> bool:
    """Tell if at least half of the cells of a line are units."""
    filled = [cell for cell in cells if cell and cell not in ("-", "--", "[-]", "(-)")]
    count = sum(is_unit(_unbracket(cell)) for cell in filled)
    filled = [cell for cell in filled if not looks_numeric(cell)] if count > 1 else filled  # a start and a step
    letters = len(filled) > 2 and "".join(filled) == ascii_uppercase[: len(filled)]  # of the columns of a sheet
    return count >= 1 and 2 * count >= len(filled) and not letters


def _is_times(cells: Sequence[str]) -> bool:
    """Tell if a line of units gives the same unit of time to several columns."""
    units = [cell for cell in map(_unbracket, cells) if is_unit(cell)]
    return len(units) > 1 and {split_name("", unit).dimension for unit in units} == {"time"}


def _unbracket(unit: str) -> str:
    unit = unit.strip()
    if len(unit) > 2 and unit[0] + unit[-1] in ("[]", "()", "{}", "<>"):
        unit = unit[1:-1].strip()
    return "" if unit in ("-", "--") else unit


def _lacks_numbers(line: str, separator: str, row: Sequence[str]) -> bool:
    """Tell if a line has a date or a file where a row of a log has one, and no numbers: a test that was not run."""
    cells = _cells(line, separator, len(row))
    if len(cells) != len(row):
        return False
    others = [a for a, b in zip(cells, row, strict=True) if not (_ENTRY.fullmatch(a) and _ENTRY.fullmatch(b))]
    return len(others) < len(cells) and not any(map(looks_numeric, filter(None, others)))


def _kind(cells: Sequence[str]) -> Kind:
    filled = [cell for cell in cells if cell]
    stamps = sum(stamp(cell) is not None for cell in filled)
    if stamps and 2 * stamps >= len(filled):
        return "stamp"
    numbers = sum(looks_numeric(cell) for cell in filled)
    return "number" if not filled or 2 * numbers >= len(filled) else "text"


def _mismatch(
    source: Source, separator: str, names: int, fields: int, first: int, lines: Sequence[str]
) -> RigFileError:
    if fields < names and not any(line.strip() for line in lines[first + 1 :]):
        problem = f"the file ends inside its first row: {fields} of {names} fields"
        return source.refuse("E_TRUNCATED", problem, "copy or export the file again", line=first + 1)
    code, remedy = "E_FIELD_COUNT", "export the file again with one name a column"
    if separator == "," and fields > names:
        code = "E_FIELD_COUNT" if fields % names else "E_AMBIGUOUS"
        remedy = "decimal commas look like separating commas: export with semicolons or decimal points"
    return source.refuse(code, f"{fields} fields under {names} names", remedy, line=first + 1)
