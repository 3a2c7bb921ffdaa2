"""The form of a delimited text: separator, decimal mark, header, units, first row of data.

Nothing is guessed: what the first lines do not settle is refused, with the profile's line
that settles it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from string import ascii_uppercase

from mrdamper.rig_files.column_names import UNIT_KEYS, is_unit, role_of, sentences, split_name, words
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RigFileError, Source
from mrdamper.rig_files.text import row_samples as sampling
from mrdamper.rig_files.text.row_samples import SPACES, TELLING, WORD, Kind, cells_of, is_comment
from mrdamper.rig_files.text.tokens import MISSING, looks_numeric, stamp, with_notes_beside

X_VALUE = "X_Value"  # the clock of LabVIEW, whose cells may be empty
_SIMULINK = "Block Path: "  # of signals exported by Simulink, whose time is in seconds
_KEY_AND_VALUE = re.compile(  # Samples: 4850, Unit: V
    rf"(?i)[^:=]*[^\W\d_][^:=]*[:=]\s*[-+.,]*[0-9][-+0-9.,:/ ]*\W*[^\W\d_]*|(?:{'|'.join(UNIT_KEYS)})\s*[:=].*"
)
_UNIT_OF_ALL = re.compile(  # ; Unit: V, above the only column
    rf"(?i)[\s#%;\"]*(?:(?:y|vertical|channel|signal|data)[ _-]*)?(?:{'|'.join(UNIT_KEYS)})\"?"
    r"\s*[:=,;\t]\s*\"?([^\s\",;]+)[\s\",;]*$"
)
(_LISTING,) = sentences("listing")
_NOTES = words("notes")
_MOST_LEVELS = 4  # lines of headings
_TYPE = re.compile(r"[a-z]{1,6}[0-9]{1,2}")  # f8, int16
_NAME_AND_UNIT = re.compile(r"[^\s\[(<{]+(?:\s*\[[^\[\]]*\]|\s*\([^()]*\))?")
LISTED = re.compile(  # a numbered line that names a column and its unit: 1=Time;min, COL 2 FORCE (LBF)
    rf"^[\s\"#%]*(?:{'|'.join(words('numbered'))})?[\s#._]*(?P<number>[0-9]{{1,3}})\"?(?:\s*[=:;,\t]\s*|\s+)\"?"
    r"(?P<name>[^\d\W][^;,\t\[\](){}=]*?)\"?\s*[;,\t\[({]\s*\"?(?P<unit>[^;,\t\[\](){}\"]{1,12})\"?[\])}]?[\s;,\"]*$",
    re.IGNORECASE,
)
_DECIMAL = re.compile(r"(?i)decimal[ _](?:separator|mark|sign|symbol)\"?\s*[:=;,\t]\s*\"?([.,])\"?;?")
_CURRENT = re.compile(r":\s*[0-9.,]+ ?m?A\b")
_ENTRY = re.compile(r"[0-9]{1,4}([-./])[0-9]{1,2}\1[0-9]{1,4}|\S+\.[A-Za-z][A-Za-z0-9]{1,3}")  # a date, a file: no name


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
    as_written, lines = lines, sampling.without_units(_behind_labels(lines))
    content = sampling.content_of(lines)
    separator = form.separator or sampling.separator_of(lines, content, source)
    above = form.data_line - 1 if form.data_line else form.header_line or 0
    first, width, trailing = sampling.first_row(content, above, separator, source)
    unstated = form.header_line is None and form.data_line is None
    if unstated and (again := _below_preamble(lines, first, separator)):
        first, width, trailing = sampling.first_row(content, again, separator, source)
    if width > MOST_COLUMNS:
        raise source.refuse("E_TOO_MANY_COLUMNS", f"{width} columns", "is one sample one line?", line=first + 1)
    rows = sampling.rows_of(lines[first:], separator, width, trailing)
    if sampling.numbers_columns(rows) and not any(map(str.strip, lines[:first])):
        first, rows = first + 1, rows[1:]
    stated = (match[1] for line in lines[:first] if (match := _DECIMAL.fullmatch(line.strip())))
    decimal = form.decimal or next(stated, None) or sampling.decimal_of(rows, source, first)
    if sampling.counts(row[0] for row in rows):
        lines = [*_with_name_of_numbers(lines[:first], separator, width), *lines[first:]]
    seconds = any(_SIMULINK in line for line in lines[:first])
    lines = [*_without_keys(_without_labels(lines[:first], separator, width), separator), *lines[first:]]
    header, unit_row = _header_lines(lines, first, separator, width, source, form)
    if header is not None and not is_comment(lines[header]):
        sampling.split_strictly(lines[header], separator, source, header + 1)
    names, titles = form.names or ("",) * width, ()
    below = [] if header is None else [lines[i] for i in range(header + 1, min(first, len(lines))) if i != unit_row]
    if header is not None and not form.names:
        names, titles = _names_and_titles(lines, header, below, separator, width)
    trailing |= header is not None and separator != SPACES and _names_notes(cells_of(lines[header], separator), width)
    if len(names) != width:
        raise _mismatch(source, separator, len(names), width, first, lines)
    units = _cells(lines[unit_row], separator, width) if unit_row is not None else _unit_alone(lines[:first], width)
    units = ("" if units[0].casefold() in UNIT_KEYS else units[0], *units[1:])
    columns = [[row[i] for row in rows if len(row) > i] for i in range(width)]
    names = tuple("" if n == X_VALUE and not any(c) else n for n, c in zip(names, columns, strict=True))
    written = sampling.rows_of(as_written[first:], separator, width, trailing)
    behind = tuple(sampling.unit_behind([row[i] for row in written if len(row) > i]) for i in range(width))
    clocks = ("s" if seconds and name == "time" else "" for name in names)
    units = tuple(own or its or clock for own, its, clock in zip(behind, units, clocks, strict=True))
    kinds = tuple[Kind, ...]("number" if u else sampling.kind_of(c) for c, u in zip(columns, behind, strict=True))
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
        sampling.exchanged_signs(rows),
        behind,
        form.decimal is not None,
    )


def _unit_alone(above: Sequence[str], width: int) -> tuple[str, ...]:
    """Units of columns without a row of units: that of the only column may stand in a line above."""
    alone = [match[1] for line in above if width == 1 and (match := _UNIT_OF_ALL.match(line))]
    return tuple(alone) if len(alone) == 1 and is_unit(alone[0]) else ("",) * width


def _with_name_of_numbers(above: Sequence[str], separator: str, width: int) -> list[str]:
    """Lines above the rows, an empty name before the names if these are one too few: R names no row numbers."""
    plain = [i for i, line in enumerate(above) if line.strip() and not is_comment(line)]
    named = [i for i in plain if len(_roles(cells_of(above[i], separator))) >= TELLING]
    if len(named) != 1 or len(cells_of(above[named[0]], separator)) != width - 1:
        return list(above)
    return [f'""{separator}{line}' if i == named[0] else line for i, line in enumerate(above)]


def _without_labels(above: Sequence[str], separator: str, width: int) -> list[str]:
    """Return lines above the rows without what begins each where the units have one cell too many: Unit, s, mm, kN."""
    rows = [[cell.strip(' "') for cell in cells_of(line, separator)] for line in above if separator != SPACES]
    rows = [row * (len(row) == width + 1) for row in rows] or [[]] * len(above)
    units = any(row and row[0].casefold() in UNIT_KEYS and all(map(is_unit, row[1:])) for row in rows)
    return [line.partition(separator)[2] if row and units else line for row, line in zip(rows, above, strict=True)]


def _behind_labels(lines: Sequence[str]) -> list[str]:
    """Return lines, the value of all columns behind the label alone above it: dt:, 0.002, 0.002, as LabVIEW in s."""
    lines = list(lines)
    for i, (label, line, below) in enumerate(zip(lines, lines[1:], lines[2:], strict=False)):
        if re.fullmatch(r"[^\t;|,]+:\s*", label):
            mark = next(filter(line.__contains__, "\t;|,"), SPACES)
            values = {cell for cell in cells_of(line, mark) if cell}
            if len(values) == 1 and looks_numeric(*values) and not sampling.is_row(cells_of(below, mark)):
                lines[i : i + 2] = f"{label.strip()} {values.pop()}{' s' * (label.strip() == 'dt:')}", ""
    return lines


def _without_keys(above: Sequence[str], separator: str) -> Iterator[str]:
    """Yield lines above the rows, without a key that all cells of one have: units of Unit: mm, Unit: N, none of a path.

    A line of other properties is no heading.
    """
    for line in above:
        pairs = [cell.strip('"').partition(": ") for cell in cells_of(line, separator)]
        keys = {key.strip().casefold() for key, mark, _ in pairs if key or mark}
        keyed = [mark for key, mark, _ in pairs if key or mark]
        if len(keys) == 1 < len(keyed) and all(keyed):
            yield separator.join(cell for *_, cell in pairs) if keys <= UNIT_KEYS else line * any(map(role_of, keys))
        else:
            yield line


def _names_and_titles(
    lines: Sequence[str], header: int, below: Sequence[str], separator: str, width: int
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of columns, of several levels of headings and of an index alone below them, and the titles.

    The last line of several levels names the index alone, a line above it the channels, another their conditions.
    """
    names = _cells(lines[header], separator, width)
    alone = [cells[0] for line in below if len(cells := _cells(line, separator, width)) == width and not any(cells[1:])]
    if len(alone) == 1 and alone[0] and not _roles(names[:1]):  # pandas puts the name of the index there
        names = (alone[0], *names[1:])
    empty = [i for i, name in enumerate(names) if not name]
    if len(_roles(names)) >= TELLING or len(empty) < TELLING:
        return names, ()
    levels: list[tuple[str, ...]] = []  # right above the names, one cell a column
    for line in reversed(lines[:header][-_MOST_LEVELS:]):
        if not line.strip() or is_comment(line) or separator == SPACES:
            break
        cells = cells_of(line, separator)
        if len(cells) != width or sum(map(bool, cells)) < 2:
            break
        levels.append(tuple(cell.strip('"') for cell in cells))
    telling = [cells for cells in levels if len(_roles([cells[i] for i in empty])) >= TELLING]
    if len(telling) != 1:
        return names, ()
    filled = tuple(name or cell for name, cell in zip(names, telling[0], strict=True))
    others = [cells for cells in levels if cells is not telling[0]]
    return filled, others[0] if others else ()


def _below_preamble(lines: Sequence[str], first: int, separator: str) -> int:
    """Index below the names of columns of the test, where a table of something else stands above it; else zero.

    Testing machines put a table of results above the record. It is one if other names of
    columns follow that hold displacement and force, and its own do not.
    """
    wanted = {"displacement", "force"}
    cells = (_fields(line, separator, 0) for line in lines[: first + sampling.SAMPLE])
    heads = (i for i, own in enumerate(cells) if wanted <= _roles(own))
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
    worded = first[:1].isalpha() and WORD.search(first) is not None and cells[at].lower() not in MISSING
    return worded and (at >= layout.width or layout.kinds[at] != "text")


def _titles(above: Sequence[str], separator: str, width: int) -> tuple[str, ...]:
    """Titles of groups of columns, one a column: each stands over its group's first column."""
    if not above or separator == SPACES or is_comment(above[-1]):
        return ()
    cells = cells_of(above[-1], separator)[:width]
    if sum(map(bool, cells)) < 2 or not cells[0] or len(cells) < width // 2:
        return ()
    return tuple(accumulate([*cells, *[""] * (width - len(cells))], lambda before, cell: cell or before))


def units_in(line: str, layout: Layout) -> tuple[str, ...]:
    """Return the units a line states, one a column; empty if it is no row of units."""
    cells = _cells(line, layout.separator, layout.width)
    return tuple(map(_unbracket, cells)) if len(cells) == layout.width and is_units(cells) else ()


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
        telling = [i for i in fitting if roles[i] >= TELLING]
        entries = [i for i in fitting if roles[i] == 1 and sum(cell[:1].isdigit() for cell in cells[i]) > 1]
        fitting = [i for i in fitting if not telling or i not in entries]  # but Current (A), , 0, 0.5
        last = fitting[-1]
        if candidates is plain and last != plain[-1] and sampling.names_columns(lines[plain[-1]], separator):
            break
        stated = [i for i in reversed(fitting) if is_units(cells[i])]
        units = next((i for i in stated if not _is_times(cells[i])), (*stated, None)[0])
        naming = [i for i in fitting if i != units and (units is None or i < units)]
        if units is not None and units != last:  # keys with one cell a column: TraceName, VUnit, HUnit
            named = [i for i in telling if i < units]
            if named and WORD.match(cells[units][0]) and not is_unit(_unbracket(cells[units][0])):
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
    naming = [i for i in plain if sampling.names_columns(lines[i], separator)]
    naming = [i for i in naming if i == plain[-1] or len(_roles(_fields(lines[i], separator, 0))) >= TELLING]
    if naming and not form.names:
        raise _mismatch(source, separator, len(_fields(lines[naming[-1]], separator, width)), width, first, lines)
    return None, (form.units_line - 1 if form.units_line else None)


def _keyed_lines(cells: Mapping[int, Sequence[str]], roles: Mapping[int, int]) -> tuple[int, int] | None:
    """Return the lines of names and of units, where lines begin with what they hold: descriptor, path, unit.

    A last line that begins with a time holds the names: Channel, Position, Force; Unit, mm, N; Time (s), C1, C2.
    """
    units = [i for i, row in cells.items() if row[0].casefold() in UNIT_KEYS and is_units(row[1:])]
    others = {i: row for i, row in cells.items() if i not in units and row[0].casefold() not in _NOTES}
    last = [i for i in others if i == max(cells) and split_name(others[i][0]).role == "time" and units]
    if last and not any(not cell or looks_numeric(cell) or stamp(cell) is not None for cell in others[last[0]]):
        return last[0], units[-1]
    named = {i: (row[0].casefold() == "name", roles[i], i) for i, row in others.items()}
    return (max(named, key=lambda i: named[i]), units[-1]) if units and named else None


def _fields(line: str, separator: str, width: int) -> list[str]:
    """Cells of a line of names; remark signs and one trailing separator are taken off."""
    listed = is_comment(line)
    line = _LISTING.sub("", sampling.COMMENT.sub("", line, count=1) if listed else line)
    if separator == SPACES:
        wide = re.split(r"\s{2,}|\t", line.strip())
        narrow = line.split()
        with_units = _NAME_AND_UNIT.findall(line.strip()) if len(narrow) != width else narrow
        return next((cells for cells in (wide, with_units) if len(cells) == width), narrow)
    cells = cells_of(line, separator)
    if listed and len(cells) != width:  # a list of names has separators of its own: columns: time [s], load [N]
        others = [other for mark in sampling.SEPARATORS[:-1] if len(other := cells_of(line, mark)) == width]
        cells = next((other for other in others if len(_roles(other)) >= TELLING), cells)
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
