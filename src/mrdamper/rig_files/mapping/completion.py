"""Names, units and scales of columns that a file states elsewhere than in its row of names."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from itertools import accumulate, pairwise
from pathlib import Path

import numpy as np

from mrdamper.rig_files import column_names, conditions
from mrdamper.rig_files.column_names import (
    DIMENSION,
    SI,
    Header,
    find_name,
    is_unit,
    role_of,
    sentences,
    split_name,
    words,
)
from mrdamper.rig_files.conditions import LONGEST_LINE, PADDED, currents_in, damper_in, without_currents
from mrdamper.rig_files.mapping import scales
from mrdamper.rig_files.mapping.clocks import with_axis_as_time, with_epoch
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import Finding
from mrdamper.rig_files.text.layout import LISTED, X_VALUE
from mrdamper.rig_files.text.row_samples import cells_of, cells_of_list
from mrdamper.rig_files.text.tokens import looks_numeric, number

_SEPARATORS = ("\t", ";", ",", "|")
_CLOCKS, _WEIGHTS = column_names.meanings("clocks") | {"time since start": ""}, column_names.meanings("weights")
(_TIME_UNIT,) = sentences("time_unit")
(_ABSCISSA,) = sentences("abscissa")
_KEY = re.compile(r"[\s#%;\"]*([^=:]{1,60}?)\s*[=:]\s*(\S+)\s*")  # CoilCurrent=0.5, CoilCurrentUnit=A
_PAIR = re.compile(  # of an object as JSON or Python writes it: {'I': 0.35, 'f': 1.0}
    r"""[{,]\s*(?P<mark>["'])([A-Za-z]\w{0,40})(?P=mark)\s*:\s*([+-]?[0-9]+(?:\.[0-9]*)?(?:[eE][+-]?[0-9]+)?)\s*(?=[,}])"""
)
_UNIT_KEY = re.compile(rf"(?i)(?:{'|'.join(column_names.UNIT_KEYS)})$")  # HUnit, X-Einheit
_UNITS_KEY = re.compile(r"(?:vertical|channel|y|signal|data)?[ _-]*units?", re.IGNORECASE)
_TITLES = words("label") | words("notes")
_UNITS_IN = rf"(?i:{'|'.join(sorted(column_names.UNIT_KEYS, key=len, reverse=True))}|unités|unidades|units)"
_SI_UNITS = re.compile(rf"\bSI[- ](?:base[- ])?{_UNITS_IN}|{_UNITS_IN}\W*(?:(?:in|du|del|do)\W+)?SI\b")
(_ALL_VOLTS,) = sentences("all_volts")
_EXCEPT = re.compile(r"(?i)\b(?:except|but|not|no|non|außer|nicht|kein\w*|sauf|salvo|excepto|tranne)\b")
_AT = re.compile(r"\s(?:at|for|bei|mit|à|pour|con|com|en|vs\.?)\s")  # of a condition: force (N) at coil current
_SYMBOL = re.compile(r"^[A-Za-z](?=[ _.0-9])")  # before the number of a test
_LABVIEW = ("Delta_X", "X_Dimension")
_BEHIND_NAME = re.compile(r"\s*[:=|,]\s*|\s[-–—]\s|$")  # in front of what a name means: t - time
_OTHER_FORCE = re.compile("(?i)" + "|".join(words("other_force")))  # than the damper's
_FIGURE = re.compile("(?i)" + "|".join(words("figure")))  # in a line that is not about the columns
_SIGNS = "|".join(map(re.escape, words("positive_stems") | words("negative_stems")))
_ASIDE = re.compile(rf"(?i)\s*(?:\([^()]*\)|,\s(?:{_SIGNS})[^,;|\t]*)$")  # (tension positive); , positive in tension
_CELLS_OF_NAME = re.compile(r"[,;|\t=:]|(?<=\w)\s[-–—]\s(?=[^\W\d_])")  # PT07;Stroke;mm; ai0 - stroke
_MARK = re.compile(r"^(?:[\s#>•*|–-]|[0-9]{1,2}[.)]\s)+|[\s.|]+$")  # of a list or a table
_COLON = re.compile(r"^([^:=]+)(?::\s+|\s*=\s*)([^\s:=]{1,12})$")  # force: N; force=N
_PLAIN = re.compile(r"[+-]?[0-9]+(?:[.,][0-9]+)?")
_INDEXED = re.compile(
    r"^\s*(?:(?P<what>desc|name|label|units?|scale)[A-Za-z]*[._ ]*)?(?:chan(?:nel)?|ch)[._ ]*(?P<number>[0-9]{1,3})"
    r"[._ ]*(?(what)|(?P<after>desc|name|label|units?|scale)[A-Za-z]*)\s*[=:]\s*(?P<value>.+?)\s*$",
    re.IGNORECASE,
)
_NUMBERS = rf"(?:{'|'.join(words('numbered'))})"
NUMBERED = re.compile(rf"(?i)(?:{_NUMBERS}?[ ._]?|[a-z]\w*\[)([0-9]{{1,3}})\]?")
_CHANNEL_IS = re.compile(
    rf"(?i)(?<!\w)(?:{_NUMBERS}[ ._]?|[a-z]\w*[\[(](?::, ?)?)"
    r"(?P<number>[0-9]{1,3})(?:(?:, ?:)?[\])])?(?:\s*[:=]\s*|\s+[-–]\s+|\s{2,}|(?<=[\])])\s)"
    r"(?P<what>(?:(?!, )[^;|\t]){2,60})"
)
_FILE_IS = re.compile(r"\W*(?P<part>[A-Za-z][0-9A-Za-z]{0,20})\s*[:=]\s*(?P<what>[^\W\d_](?:(?!, )[^;|\t]){2,60})")
_OF_FILE = re.compile(r"[\s>*|`\"-]*(?P<name>[/\w.#<>-]{1,60}?)[`\"]?\s*[:=|]\s*(?P<rest>\S.*)")
_COLUMN_IS = re.compile(rf"(?i)(?<!\w){_NUMBERS}\s?(?P<number>[0-9]{{1,3}})[\s:=]+(?P<what>(?:(?!, )[^;|\t])+)")
_FULL_SCALE = re.compile(  # sections of a header: Name=Stroke, FullScale=75, Unit=mm
    r"(?im)^name *= *(?P<name>[^=\n]{1,60})\n(?:[^=\n]*=[^\n]*\n){0,4}?full[ _]?scale *= *(?P<full>[0-9.]{1,12})\n"
    r"(?:[^=\n]*=[^\n]*\n){0,4}?unit *= *(?P<unit>\S{1,12})$"
)
_LONGEST_CONDITIONS = 4000  # characters


def completed(table: RawTable) -> RawTable:
    """Add the names, units and scales that the file states above, below or beside its row of names."""
    pairs = {match[2]: float(match[3]) for line in table.lines for match in _PAIR.finditer(line)}
    table = replace(table, constants={**pairs, **table.constants})
    table = _with_x_values(_with_values_for_all(table))
    if not any(name.strip("0123456789") for name in table.names):
        table = _with_listed_names(table)
    if table.names == ("",):  # a channel a file: force_N.txt
        header, unit = split_name(Path(table.source.name).stem), table.headers[0]
        own = unit.unit if header.role and unit.dimension == DIMENSION[header.role] else header.unit
        table = table.named({0: (header.name, own)}) if header.role else table
    table = _with_numbered_channels(_with_lines_of_file(_without_shared_path(table)))
    table = _with_keyed_lines(_with_explained_names(table))
    table = _with_titles(_with_currents_of_columns(_with_heading_of_currents(table)))
    table = _with_name_by_file(_with_listed_units(with_axis_as_time(table)))
    table = scales.with_stated_signs(_with_si_units(with_epoch(_with_clocks_and_weights(table))))
    return scales.with_sense(scales.with_scales(scales.with_counts(table)))


def _without_shared_path(table: RawTable) -> RawTable:
    """Names without the path that all signals of a model have in common: Platform()://Rig/Model Root/."""
    paths = {i: name.split("/") for i, name in enumerate(table.names) if name.count("/") > 1}
    differ = (n for n, level in enumerate(zip(*paths.values(), strict=False)) if len(set(level)) > 1)
    shared = next(differ, 0) if len(paths) > 2 else 0  # two may agree by chance
    return table.named({i: ("/".join(path[shared:]), table.units[i]) for i, path in paths.items()}) if shared else table


def states_si(line: str) -> bool:
    """Tell if a line states that all units are those of the SI: All quantities in SI units."""
    if len(line) > LONGEST_LINE or not _SI_UNITS.search(line) or _EXCEPT.search(line):
        return False
    words_of_line = re.split(r"[\s,;:()\[\]=]+", line)
    named = [column_names.parse_unit(word) for word in words_of_line if word != "in" and is_unit(word)]
    return all(unit is None or unit.factor == 1 for unit in named)


def states_volts(line: str) -> bool:
    """Tell if a line states that all channels are in volts: All channels in volts as acquired."""
    return len(line) <= LONGEST_LINE and _ALL_VOLTS.search(line) is not None and not _EXCEPT.search(line)


def _keyed_cells(table: RawTable, longest: int = LONGEST_LINE) -> Iterator[tuple[str, list[str]]]:
    """Yield the first cell of every line beside the columns and the cells behind it, by every separator."""
    for line in table.remarks:
        for separator in filter(line.__contains__, _SEPARATORS):
            key, *cells = [cell.strip('"') for cell in cells_of(line[:longest], separator)]
            yield key, cells


def _with_values_for_all(table: RawTable) -> RawTable:
    """Lines of a key whose unit another states, with one value, or one for all columns: HResolution, 1, 1; HUnit, s, s.

    The steps of LabVIEW and of the format RPC are in seconds.
    """
    width, keyed = len(table.names), dict[str, str]()
    for key, cells in _keyed_cells(table):
        stated = {cell for cell in cells if cell}
        cells = cells[:-1] if len(cells) == width and not cells[-1] else cells  # a separator ends the line
        if key and len(stated) == 1 and (len(cells) == width - 1 > 1 or key in _LABVIEW):
            keyed[key] = stated.pop()
    units = {_UNIT_KEY.sub("", key): unit for key, unit in keyed.items() if _UNIT_KEY.search(key) and is_unit(unit)}
    units |= {"Delta_X": "s"} if keyed.get("X_Dimension") == "Time" else {}
    numbers = {key: cell for key, cell in keyed.items() if looks_numeric(cell)}
    lines = [f"{key}: {cell}" for key, cell in numbers.items() if split_name(key).unit]
    for start, unit in units.items():
        lines += [f"{key}: {cell} {unit}" for key, cell in numbers.items() if start and key.startswith(start)]
    sections = _FULL_SCALE.finditer("\n".join(table.remarks))
    lines += [f"{m['name']}: 100 % = {m['full']} {m['unit']}" for m in sections]
    plain = {key: f"{value:g}" for key, value in table.constants.items()}
    plain |= {match[1]: match[2] for line in table.lines if (match := _KEY.fullmatch(line))}
    numbers = {key: cell for key, cell in plain.items() if looks_numeric(cell)}
    for end in ("Unit", "Units", "_unit", "_units", " unit"):
        lines += [f"{key}: {cell} {plain[key + end]}" for key, cell in numbers.items() if key + end in plain]
    lines += [f"DELTA_T: {m['step']} {m['unit']}" for m in map(_ABSCISSA.match, table.remarks) if m]
    lines += [f"DELTA_T: {line[8:].strip()} s" for line in table.remarks if line.startswith("DELTA_T=")]
    return replace(table, remarks=(*table.remarks, *lines)) if lines else table


def _with_x_values(table: RawTable) -> RawTable:
    """Clocks and units of measurement files of LabVIEW: X_Value is a time unless X_Dimension says otherwise."""
    keyed = dict(_keyed_cells(table))
    units = ["", *(cell.strip() for cell in keyed.get("Y_Unit_Label", ())), *[""] * len(table.names)]
    if ("Y_Unit_Label" not in keyed and X_VALUE not in table.names) or keyed.get("X_Dimension", ["Time"])[0] != "Time":
        return table
    own = enumerate(zip(table.names, table.units, strict=True))
    return table.named({i: ("Time", "s") if n == X_VALUE else (n, u or units[i]) for i, (n, u) in own})


def _with_keyed_lines(table: RawTable) -> RawTable:
    """Titles and units of lines that begin with what they hold, before a cell for each of the other columns.

    Label, LVDT 10 mm/V, Load 1 kN/V; Vertical Units, V, V; current (A), 0, , 0.5, , one for a column or a group.
    """
    width = len(table.names)
    for key, cells in _keyed_cells(table, _LONGEST_CONDITIONS) if width > 2 else ():
        header, stated = split_name(key), [cell for cell in cells if cell and (key or not is_unit(cell))]
        one_time = not key and len(cells) < width and len(table.columns("time")) < 2  # of groups with none of their own
        if one_time and len(stated) > 1 and all(map(damper_in, stated)):  # merged over groups
            short = width - 1 - len(cells)
            cells = list(accumulate(cells + [""] * short, lambda before, cell: cell or before))
        merged = not all(table.names) and len(stated) > 1
        titled = {key.casefold(), key.casefold().rstrip("s")} & _TITLES or (not key and (merged or all(cells)))
        if titled and len(cells) == width - 1 and (*cells,) != table.names[1:]:
            roles = {split_name(cell).role for cell in cells} - {None}
            forces = [cells[i - 1] for i in table.columns("force") if i]  # beside a comment on the motion
            forces = forces if len(forces) > 1 else stated
            tests = all(damper_in(of) or conditions.states_motion(of) or conditions.numbers_test(of) for of in forces)
            tests |= all(map(currents_in, forces))
            if (key and len(roles) > 1) or (forces and tests):
                names = [*table.names]
                for i, cell in enumerate(cells, 1):
                    names[i] = names[i] or (names[i - 1] if cell and cells[i - 2] else "")  # merged over the currents
                table = replace(table, over=("", *cells), names=tuple(names))
        elif _UNITS_KEY.fullmatch(key.rstrip(" :")) and not any(table.units) and all(map(is_unit, cells[: width - 1])):
            units = tuple(cells if len(cells) == width and cells[-1] else ("", *cells[: width - 1]))  # one a column
            table = replace(table, units=units) if len(cells) >= width - 1 else table
        elif header.dimension == "current" and column_names.names_condition(header.name, "current") and len(stated) > 1:
            if not width - 2 <= len(cells) <= width or not all(map(_PLAIN.fullmatch, stated)):
                continue
            titles, last = [""], ""
            for cell in [*cells, ""][: width - 1]:
                last = f"{cell.replace(',', '.')} {header.unit}" if cell else last
                titles.append(last)
            over = zip(table.over or ("",) * width, titles, strict=True)
            return replace(table, over=tuple(f"{a} {b}".strip() for a, b in over))
    return table


def _with_listed_names(table: RawTable) -> RawTable:
    """Names, units and scales of columns without any that numbered lines state: 1=Time;min, or UNITS.CHAN_1=mm."""
    texts: dict[str, dict[int, str]] = {"name": {}, "unit": {}, "scal": {}}
    for line in table.lines:
        if match := LISTED.match(line):
            texts["name"][int(match["number"])] = match["name"].strip()
            texts["unit"][int(match["number"])] = match["unit"].strip()
        elif match := _INDEXED.match(line):
            what = (match["what"] or match["after"]).casefold()[:4].replace("desc", "name").replace("labe", "name")
            texts[what][int(match["number"])] = match["value"]
    width = range(1, len(table.names) + 1)
    if any(i not in texts["name"] or not is_unit(texts["unit"].get(i, "")) for i in width):
        lists = [_listed_cells(line) for line in table.lines]
        units = {(*cells,) for cells in lists if len(cells) == len(width) > 1 and all(map(is_unit, cells))}
        rows = {row for line in table.lines if (row := _row_of_names(line, len(width), units))}
        return table.named(dict(enumerate(rows.pop()))) if len(rows) == 1 else table
    table = table.named({i - 1: (texts["name"][i], texts["unit"][i]) for i in width})
    for i, text in texts["scal"].items():
        scale = number(text.strip(), ".")
        if i in width and scale is not None and np.isfinite(scale) and scale not in (0.0, 1.0):
            note = f"column {table.names[i - 1]!r} is scaled by {scale:g} as the file states"
            table = scales.scaled(table, i - 1, table.names[i - 1], table.units[i - 1], scale, note)
    return table


def _listed_cells(line: str) -> list[str]:
    """Return what a line lists, behind a colon or as a whole."""
    return re.split(r"[,;|\t]\s*|\s(?:and|und|et|y|e)\s", line.rpartition(": ")[2].strip(" |"))


def _row_of_names(line: str, width: int, units: Collection[Sequence[str]]) -> tuple[Header, ...]:
    """Return the names and units of as many columns that a line lists, columns: time (s), stroke (mm), load (N).

    Where it lists no unit, they are those of the only other line that lists nothing else.
    """
    if column_names.RATING.search(line.rpartition(": ")[0]) or _FIGURE.search(line):
        return ()
    row = tuple(item_of(cell.removeprefix(f"{number} ")) for number, cell in enumerate(_listed_cells(line), 1))
    if len(units) == 1 and len(row) == width and not any(header.unit for header in row):
        row = tuple(Header(header.name, unit) for header, unit in zip(row, *units, strict=True))
    roles = {header.role for header in row if header.role and header.dimension == DIMENSION[header.role]}
    named = len(row) == width == len(roles) and not any(header.name[:1].isdigit() for header in row)  # in their order
    return row if named and {"displacement", "force"} <= roles else ()


def _with_numbered_channels(table: RawTable) -> RawTable:
    """Names of columns that are called by their numbers, where a line says what each channel is: channel 2: LVDT."""
    called = table.names if any(table.names) else map(str, range(1, len(table.names) + 1))
    numbers = [match[1] if (match := NUMBERED.fullmatch(name.strip())) else "" for name in called]
    says: dict[str, set[str]] = {}
    for line in table.lines if any(numbers) else ():
        for match in _CHANNEL_IS.finditer(line):
            says.setdefault(str(int(match["number"])), set()).add(match["what"].strip())
    meant = [says.get(str(int(number)), set()) if number else set() for number in numbers]
    unclear = any(number and len(what) != 1 for number, what in zip(numbers, meant, strict=True))
    if unclear or sum(map(bool, numbers)) < min(2, len(list(filter(None, table.names))) - 1):
        return table
    names = tuple(next(iter(what), name) for name, what in zip(table.names, meant, strict=True))
    return replace(table, names=names)


def said_of_file(line: str, name: str) -> str:
    """Return what a line states of files of a name, behind that: Tn_disp.out: column 2 = x (mm); /rig/lvdt | x | mm."""
    match = _OF_FILE.match(line[:LONGEST_LINE])
    return match["rest"] if match and _name_key(match["name"]) == _name_key(name) else ""


def _name_key(name: str) -> list[str]:
    """Return the words of a file's name, or of a topic's, with one sign for all numbers."""
    bare = re.sub(r"(?i)[0-9]+|#+|<[^<>]*>", "n", re.sub(r"\.[A-Za-z]\w{0,4}$", "", name))
    return [word.casefold() for word in re.split(r"[\W_]+", bare) if word not in ("", "slash")]


def _with_lines_of_file(table: RawTable) -> RawTable:
    """Names and units of columns that a line states of the files of such a name: of numbered, of named, of the only."""
    rests = {rest for line in table.lines if (rest := said_of_file(line, table.source.name))}
    rest = rests.pop() if len(rests) == 1 else ""
    stated = {int(m["number"]) - 1: item_of(m["what"]) for m in _COLUMN_IS.finditer(rest)}
    stated = {} if any(table.names) else stated
    for i, name in enumerate(table.names if rest else ()):
        parts = name.split(".")
        tails = "|".join(re.escape(".".join(parts[n:])) for n in range(len(parts)) if name)
        match = re.search(rf"(?<![\w.])(?:{tails})(?:(?P<unit>\s*[\[(][^\[\]()]+[\])])|\s*=\s*(?P<what>[^,;]+))", rest)
        if match and name:
            stated[i] = split_name(f"{name}{match['unit']}") if match["unit"] else item_of(match["what"])
    data = [i for i, name in enumerate(table.names) if name.rpartition(".")[2] == "data"]
    cells = [cell.strip() for cell in re.split(r"[,;|\t]", rest)]
    what, units = [cell for cell in cells if role_of(cell)], [cell for cell in cells if is_unit(cell)]
    if not stated and len(data) == len(what) == len(units) == 1:
        stated = {data[0]: Header(what[0], units[0])}
    return table.named(stated) if any(header.unit for header in stated.values()) else table


def _with_name_by_file(table: RawTable) -> RawTable:
    """Name of the only column beside a time, where a line says what files of such a name hold: C2 = load cell."""
    others = [i for i, header in enumerate(table.headers) if header.role != "time"]
    if len(others) != 1 or len(table.names) != 2 or table.headers[others[0]].role:
        return table
    parts = {*re.split(r"[^0-9a-z]+", table.source.name.casefold())}
    called = filter(None, map(_FILE_IS.match, table.lines))
    meant = {match["what"].strip() for match in called if match["part"].casefold() in parts}
    return table.named({others[0]: (meant.pop(), table.headers[others[0]].unit)}) if len(meant) == 1 else table


def _with_explained_names(table: RawTable) -> RawTable:
    """Names of columns that say nothing, with what a line that begins with each says: PT07;Stroke;mm; y0 = load, N."""
    lines = [[cell.strip(' "') for cell in _CELLS_OF_NAME.split(line.strip(" |"))] for line in table.lines]
    parts = {cells[0] for cells in lines if len(cells) > 1 and re.search(r"[^\W\d_].*[0-9]", cells[0])}
    names_of = {part: [i for i, name in enumerate(table.names) if find_name(name, part)] for part in parts}
    headings = {}
    for i, (name, header) in enumerate(zip(table.names, table.headers, strict=True)):
        voltage = header.role == "voltage"
        called = {name.casefold(), header.name.casefold()} - {""}
        called |= {part.casefold() for part, of in names_of.items() if voltage and of == [i]}  # ai0 of Voltage - ai0
        own = [cells[1:] for cells in lines if (header.role is None or voltage) and cells[0].casefold() in called]
        cells = own[0] if own and own.count(own[0]) == len(own) else []
        scaled = [cell for cell in cells if scales.scales_in(cell)]
        named = [c for c in cells if split_name(c).role and not (c in scaled or is_unit(c) or scales.senses_in(c))]
        units = ["V"] * voltage if scaled else [cell for cell in cells if is_unit(cell.strip("[]()"))]
        if len({split_name(cell).role for cell in named}) == 1 and len(units) < 2:
            headings[i] = named[0], (header.unit, *units, "")[0 if header.unit else 1].strip("[]()")
    return table.named(headings) if len(headings) > 1 else table


def _with_heading_of_currents(table: RawTable) -> RawTable:
    """Return columns named 0 A, 0.5 A, ... with the only heading of a force above them, cut off from theirs, as title.

    Of a line with a number or another channel the force may be that of something else, as preload (N): 200 is.
    """
    columns = conditions.named_after_currents(table.names)
    if not columns or table.over or table.columns("force"):
        return table
    own = [line for line in table.lines if not (column_names.RATING.search(line) or _OTHER_FORCE.search(line))]
    lines = {line.strip(' ,;\t|#%/"*') for line in own}
    lines = [line for line in lines if {*map(role_of, column_names.words_of(line))} <= {"force", "current", None}]
    headings = [_AT.split(line)[0].strip() for line in lines if not re.search("[0-9;|\t]", line)]
    headings = [head for head in headings if (header := split_name(head)).role == header.dimension == "force"]
    if len(headings) != 1:
        return table
    return replace(table, over=tuple(headings[0] if i in columns else "" for i in range(len(table.names))))


def _with_currents_of_columns(table: RawTable) -> RawTable:
    """Return forces with the current as title that lines state behind the name of each: F0 at 0 A, F1 at 0.5 A."""
    columns, stated = table.columns("force"), dict[int, set[tuple[float, ...]]]()
    if len(columns) < 2 or table.over:
        return table
    for line in table.lines:
        names = {i: find_name(line, table.names[i]) or find_name(line, table.headers[i].name) for i in columns}
        places = sorted((match.start(), i) for i, match in names.items() if match)
        parts = [line[a:b] for (a, _), (b, _) in pairwise([*places, (len(line), 0)])]
        before = line[: places[0][0]] if places else line  # 0 A: F0, 0.5 A: F1
        for (_, i), part in zip(places, parts, strict=True) if not currents_in(before) else ():
            stated.setdefault(i, set()).update({currents_in(part)} - {()})
    currents = [of for i in columns for of in stated.get(i, ())]
    if len({*currents}) != len(columns) or any(len(of) != 1 for of in (*currents, *stated.values())):
        return table
    titles = {i: f"{next(iter(of))[0]:g} A" for i, of in stated.items()}
    return replace(table, over=tuple(titles.get(i, "") for i in range(len(table.names))))


def _with_titles(table: RawTable) -> RawTable:
    """Names joined with the titles above them where only both together name a channel; conditions become titles."""
    over = list(table.over or ("",) * len(table.names))
    names, units = list(table.names), list(table.units)
    for i, (name, title) in enumerate(zip(names, over, strict=True)):
        header = split_name(name, units[i]) if without_currents(name) else Header(name, units[i])  # 0.5 A: no unit
        if header.dimension == "time" and header.role not in ("time", None) and len(header.name) <= 2:
            names[i] = f"{split_name(title).name} time" if title else "time"
            units[i] = units[i] or header.unit
        elif title and header.role is None and (bare := split_name(without_currents(title))).role is not None:
            if header.dimension == "time" and bare.role != "time":
                names[i], units[i] = f"{bare.name} time", units[i] or header.unit  # an x column of its own
            elif header.dimension in (None, DIMENSION[bare.role]) and (
                column_names.says_nothing(header.name) or currents_in(name)
            ):
                names[i] = bare.name
                units[i] = units[i] or header.unit or bare.unit
                over[i] = f"{title} {name}".strip()
        bare_name = without_currents(names[i]) if len(currents_in(names[i])) == 1 else PADDED.sub("", names[i])
        rest = bare_name.strip(" ,;:@-_/") if bare_name != names[i] else ""
        if rest and split_name(rest, units[i]).role in ("force", "displacement", "time", "velocity"):
            over[i] = over[i] if currents_in(over[i]) else f"{over[i]} {names[i]}".strip()
            names[i] = rest
    if names == list(table.names) and units == list(table.units):
        return table
    return replace(table, names=tuple(names), units=tuple(units), over=tuple(over) if any(over) else ())


def _with_listed_units(table: RawTable) -> RawTable:
    """Units that lines above the columns state: Weg in mm, Kraft in N; X-Unit: ms; a channel and its unit in cells."""
    bare = [i for i, header in enumerate(table.headers) if header.name and not header.unit]
    names = {i: name for i, name in enumerate((*table.names, *table.constants)) if i in bare or i >= len(table.names)}
    wanted, times = {table.headers[i].name.casefold(): i for i in bare}, table.columns("time")
    wanted |= {name.strip().casefold(): i for i, name in names.items()}
    wanted |= {name.strip(): i for i, name in names.items()}  # t is no T
    behind: dict[int, set[str]] = {}
    listed: dict[int, set[str]] = {}
    doubtful: dict[int, set[str]] = {}  # of a range, a figure or a numbered device: may contradict the others
    for line in table.lines if names else ():
        cells = cells_of_list(line.lstrip("#%/ "))
        behind_colon = [cell.partition(": ")[2] for cell in (*cells, line)]  # rig 7, columns: time [s], load [N]
        for text, whole in zip((*cells, *behind_colon, line), (*cells, *cells, line, line), strict=True):
            header = item_of(text)
            name, meaning = (part.strip("`* ") for part in _BEHIND_NAME.split(header.name, maxsplit=1))
            first, _, rest = name.partition(" ")
            if name not in wanted and first in wanted and role_of(rest):  # x piston displacement
                name, meaning = first, rest
            both = {*map(role_of, name.split())} == {role_of(name)} - {None}  # time t
            own = name.rpartition(" ")[2] if both else name
            i = wanted.get(own, wanted.get(own.casefold()))
            number = NUMBERED.fullmatch(name) if i is None and role_of(meaning) else None
            i = int(number[1]) - 1 if number else i
            role = (role_of(names[i]) or header.role or "") if i in names else ""
            fits = role_of(meaning) in (role, None) and header.dimension == DIMENSION.get(role, "voltage")
            fits |= i in names and line == f"{names[i]}: {header.unit}"  # P: kN, of a structure
            row = "," in meaning and i in names and role_of(names[i]) is None  # Step, Type, Current [A]
            value = re.search(rf"[0-9]\s*(?:[|;\t]\s*|,)?{re.escape(header.unit)}\W*$", text)  # load cell, 25 kN
            if i is None or row or not fits or value:
                continue
            headings = " ".join(part.partition(": ")[0] for part in (line, whole))
            doubt = _FIGURE.search(line) or re.search("[0-9]", meaning)
            doubt = doubt or column_names.RATING.search(f"{headings} {meaning}")
            (doubtful if doubt else behind).setdefault(i, set()).add(header.unit)
            units = {unit for cell in cells if is_unit(unit := _ASIDE.sub("", cell))}  # kN (until 2020), N (since 2021)
            doubtful.setdefault(i, set()).update(u for u in units if split_name("", u).dimension == header.dimension)
        match = _TIME_UNIT.match(line)
        if match and len(times) == 1 and times[0] in bare and split_name("", match["unit"]).dimension == "time":
            behind.setdefault(times[0], set()).add(match["unit"])
        named = [wanted.get(cell, wanted[cell.casefold()]) for cell in cells if cell.casefold() in wanted]
        if len(named) == 1 and not any(map(scales.scales_in, cells)):
            role = role_of(names[named[0]])
            units = [bare_cell for cell in cells if is_unit(bare_cell := cell.strip("[]()"))]
            units = [unit for unit in units if role is None or split_name("", unit).dimension == DIMENSION[role]]
            listed.setdefault(named[0], set()).update(units[:1])
    stated = {**(listed if sum(map(bool, listed.values())) > 1 else {}), **behind}
    units = {i: own.pop() for i, own in stated.items() if len(own | doubtful.get(i, set())) == 1}
    of_name = {names[i]: unit for i, unit in units.items()}
    constants = {f"{name} [{of_name[name]}]" if name in of_name else name: v for name, v in table.constants.items()}
    alike = {i: (names[i], of_name[names[i]]) for i in bare if names[i] in of_name}  # also the force at another current
    return replace(table, constants=constants).named(alike)


def item_of(text: str) -> Header:
    """Name and unit in a part of a line, with what the name means behind it: t: s; `x` - stroke in mm; F = load, N."""
    text = _MARK.sub("", text)
    match = _COLON.match(text)
    header = Header(match[1], match[2]) if match and column_names.parse_unit(match[2]) else split_name(text)
    return header if header.unit else split_name(_ASIDE.sub("", text))


def _with_si_units(table: RawTable) -> RawTable:
    """Units of channels without a unit, where a line states that all units are those of the SI, or that all are V."""
    si, volts = any(map(states_si, table.remarks)), any(map(states_volts, table.remarks))
    bare = {i: h.role for i, h in enumerate(table.headers) if not h.unit and h.role in SI and si != volts}
    return table.named({i: (table.names[i], SI[role] if si else "V") for i, role in bare.items() if role})


def _with_clocks_and_weights(table: RawTable) -> RawTable:
    """Names of clocks of microcontrollers as times, and loads that a scale shows in kg or g as forces."""
    headings, notes = {}, []
    clocks = table.columns(dimension="time")
    if not table.columns("time") and len(clocks) == len(table.columns("displacement", "length")) > 1:  # x_Run1 in s
        headings = {i: (_SYMBOL.sub("time", table.names[i]), table.units[i]) for i in clocks}
    for i, header in enumerate(table.headers):
        weighed = column_names.holds(header.name, column_names.WEIGHT)
        key = re.sub(r"[\s_()]+", " ", header.name.strip().casefold()).strip()
        if not header.unit and key in _CLOCKS and not (table.columns("time") and is_unit(key)):  # ms of a stamp
            headings[i] = "time", _CLOCKS[key]
        elif weighed and header.role == "force" and header.unit in _WEIGHTS:
            headings[i] = header.name, _WEIGHTS[header.unit]
            notes.append(Finding("W_UNITS", f"{header.name!r} in {header.unit} is the force of that weight"))
    return table.named(headings).noted(*notes)
