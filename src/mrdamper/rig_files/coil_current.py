"""The coil current of a test: of its channel, or of what stands beside the columns, the surest place first."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

import numpy as np

from mrdamper.data import Floats, held_current
from mrdamper.data.arrays import chunks
from mrdamper.data.wording import number
from mrdamper.errors import ColumnError, InputError, listed, printable
from mrdamper.rig_files import conditions
from mrdamper.rig_files.column_names import COIL, RATING, holds, names_coil, names_condition, split_name
from mrdamper.rig_files.columns import coil_currents
from mrdamper.rig_files.conditions import LARGEST_STATED, Statement, contradicts, currents_in, stated_by_lines
from mrdamper.rig_files.profile import Profile, current_in_name, toml
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import Finding, Record

_FEWEST_SLOW = 5  # samples of a current that is recorded more rarely than the force
NO_CHANNEL = "the current channel is "  # beginning of the finding on a column of no current
_NOT_TAKEN = "not taken for it: "  # beginning of the finding on other currents
_NONE = "no coil current in a column, or in the name of the file or of its folder"
_USE = re.compile(": (?=if so, |if it is the coil's, )")  # within a finding, before the answer that uses what it names
CURRENT_TOO = "and give the current of each test"  # within the remedy of a refusal of units or columns
_CALIBRATION = 'give its calibration, [channels.current] unit = "A" and scale (A per its unit), in a profile'
_PROFILE = "profile"  # where a current stands
OF_NAME = "file name", "the title"  # beginnings of where it stands in a name
_DECIDE = "write the right one into tests.csv (--write-tests), or correct the one that is wrong"
CHANNEL_RIGHT = (
    "if the channel is right, write its current into tests.csv (--write-tests) or [current.values] of a profile"
)
_OF_ANOTHER = re.compile("(?i)shunt|bridge|brücke")  # resistance or voltage
_LARGEST_MARKED, _MOST_MARKS = 64 * 2**20, 500  # bytes of a file in whose rows marks are looked for, and marks
_FOLDERS = 3  # above a file, whose names may state its current
_FOLDER = "the folder "  # beginning of where it stands there


def current_of(
    table: RawTable, profile: Profile, path: Path, channel: Floats | None, rows: slice, force: int | None = None
) -> tuple[float | None, dict[str, str]]:
    """Return the current [A] that a test states beside its columns, and where; None if the channel has it, or neither.

    Of a table of several tests one after the other, this one has the given rows, and its force in the given column.

    Raises `InputError`: E_AMBIGUOUS if two statements contradict each other, E_CURRENT_CONTRADICTS if one contradicts
    the channel, E_RANGE if one is no coil current.
    """
    where, source = printable(table.source.name), profile.current
    statements = _statements(table, path, profile, force)
    stated_by_profile = source is not None and not source.values
    if source is not None and source.value is not None:
        statements.insert(0, Statement(source.value, _PROFILE))
    elif source is not None and source.pattern is not None:
        places = [path.name, table.label, f"{path.name}/{table.label}", f"{path.as_posix()}/{table.label}".rstrip("/")]
        current = next((v for place in places if place and (v := current_in_name(place, profile)) is not None), None)
        if current is None and channel is None:
            problem = printable(f"the pattern {source.pattern!r} does not match {places[2].rstrip('/')!r}")
            remedy = "correct [current] pattern of the profile"
            raise ColumnError(problem, where=where, remedy=remedy, code="E_CURRENT_MISSING")
        statements = [] if current is None else [Statement(current, "name by the profile's pattern")]
    elif not statements and channel is None:
        lines = [line for line in table.remarks if line not in table.titles]
        statements = _set_points(table, rows) or conditions.stated_in_titles(lines) or _folders(table, path)
    names = [profile.channel("current").column, *(table.names[i] for i in table.columns("current"))]
    stated = _agreed(statements, channel, where, str(next(filter(None, names), "its name")))
    if stated is not None and channel is None and all(s.whence.startswith("the line ") for s in statements):
        _refuse_contradicted_line(table, stated, rows, where)
    if stated is None or (channel is not None and not stated_by_profile):
        return None, {}
    return stated.amperes, {"current_from": as_data(stated.whence)}


def _refuse_contradicted_line(table: RawTable, stated: Statement, rows: slice, where: str) -> None:
    """Refuse what a line states where columns in A are not taken for the coil's current, and none of them has it."""
    read = {i: own[i][rows] for i in coil_currents(table) if (own := table.try_read(i)) is not None}
    values = {i: table.headers[i].factor * of[np.isfinite(of)] for i, of in read.items()}
    values = {i: of for i, of in values.items() if of.size >= 3 and np.max(np.abs(of)) <= LARGEST_STATED}
    held = {i: held_current(of) for i, of in values.items()}
    if not held or any(not change and not contradicts(mean, stated.amperes) for mean, change in held.values()):
        return
    first = min(held)
    name, low, high = table.names[first], np.min(values[first]), np.max(values[first])
    line = f"[channels.current] column = {toml(name)}"
    problem = f"{stated.whence} gives {stated.amperes:g} A, the column {name!r} {number(low, 3)} to {high:.3g} A"
    remedy = f"{_DECIDE}: if the line, set {line} in a profile"
    raise ColumnError(printable(problem), where=where, remedy=remedy, code="E_CURRENT_CONTRADICTS")


def _channel_wrong(column: str) -> str:
    """Return what to do where a channel, by the name of its column, is not the coil's current."""
    return (
        'if the channel is wrong, set [channels.current] unit = "A" and scale in a profile, or leave its column out '
        f"there: [file] leave_out = [{toml(column)}]"
    )


def _agreed(statements: list[Statement], channel: Floats | None, where: str, column: str) -> Statement | None:
    """Return the first of statements that agree, also with the channel of a column; None if there is none."""
    if not statements:
        return None
    current, whence, others = statements[0].amperes, statements[0].whence, statements[1:]
    against = [f"{other.whence} gives {other.amperes:g} A" for other in others if contradicts(other.amperes, current)]
    has = "" if channel is None else contradicted(channel, current, varying=whence == _PROFILE)
    measured = [f"the current channel gives {has}"] if has else []
    over = [statement for statement in statements if abs(statement.amperes) > LARGEST_STATED]
    if whence == _PROFILE:
        code, whence, against = "E_CURRENT_CONTRADICTS", "the profile", [*measured, *against]
        remedy = "leave [current] out of the profile; if the file is wrong, correct it, or rename it"
    elif over or against:
        code, remedy = "E_RANGE" if over else "E_AMBIGUOUS", _DECIDE
        if over:
            current, whence, against = over[0].amperes, over[0].whence, ["which is no coil current of a damper"]
    else:
        code, against = "E_CURRENT_CONTRADICTS", measured
        remedy = f"{CHANNEL_RIGHT}; {_channel_wrong(column)}"
    if not against:
        return statements[0]
    problem = f"{whence} gives {current:g} A, {against[0]}"
    raise ColumnError(printable(problem), where=where, remedy=remedy, code=code)


def with_value_of_name(record: Record, path: Path, profile: Profile) -> Record:
    """Return the record with the current that the profile's table of values gives a file or test of its name.

    Raises `ColumnError`: E_AMBIGUOUS if two patterns give it different currents, E_CURRENT_CONTRADICTS if the file
    states another.
    """
    patterns = profile.current.fitting(path, record.id) if profile.current is not None else []
    if profile.current is None or not patterns:
        return record
    values, where = profile.current.values, printable(path.name)
    value = values[patterns[0]]
    other = next((pattern for pattern in patterns if values[pattern] != value), None)
    if other is not None:
        problem = printable(f"{patterns[0]!r} and {other!r} give {record.id} {value:g} and {values[other]:g} A")
        remedy = "correct [current.values] of the profile"
        raise ColumnError(problem, where=where, remedy=remedy, code="E_AMBIGUOUS")
    own = record.current
    if own is not None and record.provenance.get("current_from", "").startswith(OF_NAME):
        own = None if np.allclose(own, 10 * value) else own  # 10A beside 05A
    return with_stated_current(replace(record, current=own, doubt=None), value, "profile", where)


def _places(record: Record, path: Path) -> tuple[str, ...]:
    """Return the names of a test, its file and the folders above that may state its current."""
    return record.id, *path.parts[: -2 - _FOLDERS : -1]


def require_current(record: Record, path: Path = Path()) -> Record:
    """Return the record of a test of a file; `ColumnError`, E_CURRENT_MISSING, if it has no current; its doubt."""
    if record.doubt is not None:
        raise record.doubt
    if record.current is not None:
        return record
    places = _places(record, path)
    match = next(filter(None, map(conditions.behind_digits, places)), None)
    reasons = [f.text for f in record.findings if f.text.startswith(NO_CHANNEL)]
    near = [f"{_NONE}; {f.text}" for f in record.findings if f.text.startswith(_NOT_TAKEN)]
    value, first = '"test1*" = 0.5', ""
    if match and not reasons:
        reasons = [f"{match[0]!r} in its name can be read as {match[2]} A or as {match[1]}.{match[2]} A"]
        stars = ("*", "*") if match.string in places[:2] else ("*/*", "*/*")
        value = f'"{stars[0]}[0-9]{match[0][1:]}{stars[1]}" = {match[2]}'
    reason, *use = _USE.split((*reasons, *near, _NONE)[0], maxsplit=1)
    if use or (reason.startswith(NO_CHANNEL) and "may both" not in reason):
        first = f"{(use or [_CALIBRATION])[0]}; else "
    last = "" if first else '; or [channels.current] column = "..."'
    raise ColumnError(
        reason,
        where=Path(record.provenance.get("file", record.id)).name,
        remedy=f"{first}write the currents into tests.csv (--write-tests), or set one of these in a profile: [current] "
        f'value = 0.5 of all tests, values = {{{value}}}, pattern = "*_{{current}}A_*" and unit = "A"{last}',
        code="E_CURRENT_MISSING",
    )


def not_taken(table: RawTable) -> tuple[Finding, ...]:
    """Tell which columns, numbers and lines hold a current, where none is taken for that of the test, and why."""
    shown = {f"column {table.names[i]!r}": table.names[i] for i in table.columns(dimension="current")}
    shown |= {f"number {name!r}": name for name in table.constants if split_name(name).dimension == "current"}
    other = "of a limit, a supply or another device"
    near = [f"{text} ({other if RATING.search(n) else 'a command, or one of several'})" for text, n in shown.items()]
    whys = {line.strip()[:60]: conditions.why_not_taken(line) for line in table.lines}
    near += [f"{line!r} ({why})" for line, why in whys.items() if why]
    line = f"[channels.current] column = {toml(next(iter(shown.values()), ''))}"
    use = f": if it is the coil's, set {line} in a profile" * (len(shown) == 1)
    return (Finding("W_COLUMN", printable(f"{_NOT_TAKEN}{listed(near, 2)}{use}")),) if near else ()


def ask_current_too(error: InputError, table: RawTable, profile: Profile, path: Path) -> None:
    """Add to a refusal of units or columns that the file states no current either: one answer gives both."""
    last = getattr(error, "errors", (error,))[-1]
    channel = table.columns("current") or table.columns(dimension="current")
    codes = ("E_UNITS", "E_AMBIGUOUS", "E_DUPLICATE_COLUMN", "E_COLUMN")
    if channel or profile.current or not last.code.startswith(codes):
        return
    with contextlib.suppress(InputError):
        if current_of(table, profile, path, None, slice(None))[0] is None:
            last.remedy += f"; {CURRENT_TOO}, set [current.values], where no other column or file has them"


def current_by_resistance(table: RawTable, record_id: str) -> tuple[Finding, ...]:
    """Tell which current the coil's voltage and resistance give; it is that of the test only while the voltage is held.

    The inductance of the coil delays the current behind a voltage that varies.
    """
    stated = [q for q in table.quantities if q.value > 0 or q.unit.dimension == "voltage"]
    stated = [q for q in stated if not RATING.search(q.key) and not _OF_ANOTHER.search(q.key)]
    coils = [q for q in stated if holds(q.key, COIL) or q.key.strip() == "R"]
    ohms = {q.value for q in coils if q.unit.dimension == "resistance"}
    volts = {q.value for q in stated if q.unit.dimension == "voltage" and names_condition(q.key, "voltage")}
    columns = [i for i in table.columns("voltage", "voltage") if not _OF_ANOTHER.search(table.headers[i].name)]
    if len(ohms) != 1 or len(columns or volts) != 1:
        return ()
    (ohm,) = ohms
    if columns:
        name, scale = table.names[columns[0]], table.headers[columns[0]].factor / ohm
        what = f"the coil's voltage {name!r} over {ohm:g} ohm"
        line = f'[channels.current] column = {toml(name)}, unit = "A" and scale = {scale:.6g}'
    else:
        (volt,) = volts
        if abs(volt / ohm) > LARGEST_STATED:
            return ()
        what = f"the coil's {volt:g} V over {ohm:g} ohm = {volt / ohm:.4g} A"
        line = f"[current] values = {{{toml(record_id)} = {volt / ohm:.4g}}}"
    text = f"{NO_CHANNEL}missing: {what} is the current only at constant voltage: if so, set {line} in a profile"
    return (Finding("W_COLUMN", printable(text)),)


def with_current_behind_label(record: Record, path: Path, names: Collection[str]) -> Record:
    """Return the record with the current behind a label in one of its names, where the other names show that it is one.

    The first of its names that states a current at all counts.
    """
    unclear = (conditions.behind_digits, conditions.LETTER_AS_MARK.search)
    place = next((name for name in _places(record, path) if any(of(name) for of in unclear)), "")
    current = conditions.current_behind_label(place, names)
    if current is None:
        return record
    why = "the digit before it is part of a label" if conditions.behind_digits(place) else "A is its decimal mark"
    note = f"{place!r} is read as {current:g} A: by the other names, {why}"
    return with_stated_current(record, current, f"the name {place!r}", place, note)


def with_stated_current(record: Record, current: float, whence: str, where: str, note: str = "") -> Record:
    """Return the record with the current [A] that is stated beside it, and a note on it; a channel that agrees stays.

    Raises `ColumnError`: E_CURRENT_CONTRADICTS if the channel, name or heading of the file states another.
    """
    own = record.provenance.get("current_from", "")
    if record.current is not None and (has := contradicted(record.current, current)):
        raise _two_statements(record, has, current, whence, where)
    if record.current is not None and not own:
        return record
    findings = tuple(f for f in record.findings if not f.text.startswith((NO_CHANNEL, _NOT_TAKEN)))
    findings += (Finding("W_CHOSEN", printable(note)),) if note else ()
    provenance = {**record.provenance, "current_from": as_data(whence)}
    doubt = None if own else record.doubt  # of two statements, one of the user's table among them, this one agrees
    channel = constant(current, record.time)
    return replace(record, current=channel, findings=findings, provenance=provenance, doubt=doubt)


def other_statement(record: Record, current: float, whence: str, where: str) -> ColumnError | None:
    """Return the error for a stated current [A] that is another number than the one stated for the record, or None."""
    own = record.provenance.get("current_from", "")
    mean = float(np.mean(record.current)) if own and record.current is not None else current
    other = contradicts(mean, current, conditions.WRITTEN)
    return _two_statements(record, f"{mean:g} A", current, whence, where) if other else None


def _two_statements(record: Record, has: str, current: float, whence: str, where: str) -> ColumnError:
    """Return the error for a stated current [A] where the record has another, told with its unit."""
    own = record.provenance.get("current_from", "")
    problem = printable(f"{whence} gives {current:g} A, {record.id} has {has} ({own or 'current channel'})")
    column = re.search(r"\bcurrent = (.+?) in m?A\b", record.provenance.get("columns", ""))
    remedy = _DECIDE if own else f"correct {whence}; {_channel_wrong(column[1] if column else 'its name')}"
    return ColumnError(problem, where=printable(where), remedy=remedy, code="E_CURRENT_CONTRADICTS")


def with_decided_current(record: Record, current: float, table: str, line: int) -> Record:
    """Return the record with the current [A] that the user's table states: it decides where others contradict.

    That the channel has another is the record's doubt; that it contradicts the only other statement, until a plan of
    tests agrees with it.
    """
    where = f"{table}, line {line}"
    try:
        note = f"{table} decides: {record.doubt.found}" if record.doubt else ""
        return with_stated_current(replace(record, doubt=None), current, table, where, note)
    except ColumnError as error:
        if "current_from" not in record.provenance:
            return replace(record, doubt=error)
        error.remedy = f"correct the one that is wrong, leave the cell of {table} empty, or rename the file"
        return replace(with_stated_current(replace(record, current=None), current, table, where), doubt=error)


def _statements(table: RawTable, path: Path, profile: Profile, force: int | None) -> list[Statement]:
    """Every current that stands beside the columns, the surest place first."""
    channel = profile.channel("current")
    called = (v for name, v in table.constants.items() if channel.column in (name, split_name(name).name))
    number = next(called, None)
    named = {} if number is None else {f"current [{channel.unit or 'A'}]": (channel.scale or 1.0) * number}
    held = held_current_of(replace(table, constants=named) if named else table, channel.unit or "")
    statements = [] if held is None else [Statement(held, table.stated_in or "a number in the file")]
    lines = [line for line in _without_channels(table) if line not in table.titles]
    statements += stated_by_lines(lines, table.decimal)
    member = table.source.name.removeprefix(f"{path.name}:").removeprefix(f"{path.name}, sheet ")
    for text, whence in ((table.label, "the title"), (path.name, "file name"), (member, "file name")):
        stated = currents_in(text)
        if len(stated) == 1:
            statements.append(Statement(stated[0], whence if whence == "file name" else f"{whence} {text!r}"))
    if force in conditions.named_after_currents(table.names):  # a name such as U9C 5A is of a load cell
        text = table.names[force]
        statements.append(Statement(currents_in(text)[0], f"the column {text!r}"))
    return statements


def _without_channels(table: RawTable) -> list[str]:
    """Return the lines that do not list channels, exported or not, with gain and unit: CH2-1, Coil current, 1.0, A."""
    columns = {*table.names, *(header.name for header in table.headers)}
    cells = {line: [cell.strip(' "') for cell in re.split("[,;\t]", line)] for line in table.remarks}
    forms = {line: (len(own), re.sub("[0-9]+", "0", own[0])) for line, own in cells.items()}
    listing = {forms[line] for line, own in cells.items() if len(own) > 3 and own[1] in columns}
    return [line for line in table.remarks if forms[line] not in listing]


def _set_points(table: RawTable, rows: slice) -> list[Statement]:
    """Return the statements of columns of the commanded current that hold a single value, if it is one in all."""
    statements = []
    for column, header in enumerate(table.headers):
        unit = header.known
        named = names_coil(header) or names_condition(header.name, "current")
        if unit is None or unit.dimension != "current" or not named:
            continue
        values = table.try_read(column)
        if values is not None and (low := np.nanmin(values[column][rows])) == np.nanmax(values[column][rows]):
            statements.append(Statement(unit.factor * float(low), f"the column {table.names[column]!r}"))
    return statements if len({statement.amperes for statement in statements}) == 1 else []


def with_marks(records: Sequence[Record], table: RawTable, tests: Sequence[slice]) -> Sequence[Record]:
    """Return records with the currents of a column of marks, where each has one, and none but its folder's so far."""
    bare = [i for i, header in enumerate(table.headers) if header.role is None and not header.unit]
    searched = table.source.size <= _LARGEST_MARKED
    of_folder = [r.provenance.get("current_from", "").startswith(_FOLDER) for r in records]
    bare_records = [replace(r, current=None) if own else r for r, own in zip(records, of_folder, strict=True)]
    for column in bare if searched and all(r.current is None and not r.doubt for r in bare_records) else ():
        words = table.words(column)
        labels = ["" if RATING.search(label) else label for label in words.labels[: _MOST_MARKS + 1]]
        stated = [of[0] if len(of := currents_in(label)) == 1 else None for label in labels]
        if len(labels) > _MOST_MARKS:
            continue
        codes = [[code for code in np.unique(words.codes[rows]) if stated[code] is not None] for rows in tests]
        if all(len(own) == 1 for own in codes):
            marks = [(stated[own[0]] or 0.0, f"the mark {labels[own[0]]!r}") for own in codes]
            return [with_stated_current(r, *mark, r.id) for r, mark in zip(bare_records, marks, strict=True)]
    return records


def _folders(table: RawTable, path: Path) -> list[Statement]:
    """Return the nearest folder, of a file or within an archive, whose name states a current."""
    inner = PurePosixPath(table.source.name.removeprefix(f"{path.name}:")).parent.parts
    for name in (*reversed(inner), *(folder.name for folder in list(path.parents)[:_FOLDERS])):
        stated = currents_in(name) or tuple(s.amperes for s in stated_by_lines([name]))
        if stated:
            return [Statement(stated[0], f"{_FOLDER}{name!r}")] if len(stated) == 1 else []
    return []


def held_current_of(table: RawTable, unit: str = "") -> float | None:
    """Coil current [A] that a file holds as one number beside its columns, `current_A = 0.5`; None if it does not.

    A number without a unit counts in the one that a profile gives it.
    """
    headers = {name: own if (own := split_name(name)).unit else split_name(name, unit) for name in table.constants}
    named = [(headers[name], value) for name, value in table.constants.items() if np.isfinite(value)]
    named = [
        (header, value) for header, value in named if names_coil(header) or names_condition(header.name, "current")
    ]
    measured = [(header, value) for header, value in named if header.role == "current"]
    stated = measured or named  # a set point, I_set_A = 0.5, where nothing else names a current
    held = {h.known.factor * value for h, value in stated if h.known and h.dimension == "current"}
    return held.pop() if len(held) == 1 else None


def as_data(text: str) -> str:
    """Text of a file as a cell that no spreadsheet takes for a formula."""
    text = printable(text)[:1000]
    return f"'{text}" if text.startswith(("=", "+", "-", "@")) else text


def without_gaps(current: Floats) -> tuple[Floats, tuple[Finding, ...]]:
    """Return a current that is recorded at every n-th sample only, by its mean, or in the first row of the test.

    A zero in the first row only may be that of a logger that stopped.
    """
    count = sum(int(np.count_nonzero(np.isfinite(piece))) for _, piece in chunks(current))
    if count == 1 and abs(current[0]) > 0:  # a cell merged over the rows, or not filled down
        text = f"the current stands in the first row only: {float(current[0]):g} A is taken for the whole test"
        return constant(float(current[0]), current), (Finding("W_DECIMATED", text),)
    if count < _FEWEST_SLOW or count > 0.6 * current.size:
        return current, ()
    there = np.flatnonzero(np.isfinite(current))
    steps = np.diff(there)
    usual = int(np.median(steps))
    whole = there[0] <= usual and current.size - there[-1] <= usual and steps.max() <= 2 * usual
    mean, change = held_current(current[there])
    if not whole or change:
        return current, ()
    text = f"the current is recorded at every {usual}th sample only: its mean {mean:g} A is taken"
    return constant(mean, current), (Finding("W_DECIMATED", text),)


def constant(value: float, like: Floats) -> Floats:
    """One number as a channel that takes no memory."""
    return np.broadcast_to(np.float64(value), like.shape)


def contradicted(channel: Floats, stated: float, varying: bool = False) -> str:
    """Tell what a current channel has that contradicts what is stated [A]; empty where it does not.

    A channel that varies does so where it never reaches what is stated or, if so told, always.
    """
    finite = channel[np.isfinite(channel)]
    if finite.size < 3:
        return ""
    mean, change = held_current(finite)
    nearest = float(finite[np.argmin(np.abs(np.abs(finite) - abs(stated)))])
    if change and (varying or contradicts(nearest, stated)):
        return f"{number(float(finite.min()), 3)} to {finite.max():.3g} A"
    return "" if change or not contradicts(mean, stated) else f"{mean:g} A"
