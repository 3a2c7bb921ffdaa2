"""Several tests in one table, or several channels in one column, taken apart."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache, lru_cache, partial
from itertools import pairwise, permutations

import numpy as np

from mrdamper.data.arrays import odd_steps
from mrdamper.errors import InputError, listed
from mrdamper.rig_files.column_names import DIMENSION, RATING, UNIT_KEYS, is_unit, role_of, split_name, words, words_of
from mrdamper.rig_files.columns import column_called
from mrdamper.rig_files.conditions import PADDED, currents_in, damper_in, numbers_test, states_motion
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.base import Content, RawTable, Words
from mrdamper.rig_files.record import OPTIONAL, REQUIRED, Finding

MOST_RUNS = 2000
IDLE = re.compile("(?i)(?:^|_)(?:0|idle|pause|rest)$")  # of what a column numbers beside tests
_FEWEST_ROWS = 5  # of a test, on average
_MOST_LEVELS = 200  # currents of a column of texts that are looked at
_SMALL = 32 * 2**20  # bytes of a file whose columns are kept together
_RUN_WORDS = words("run")
_VALUE, _CHANNEL, _UNIT, _NUMBER = words("value"), words("channel"), UNIT_KEYS, words("run_number")
_MOST_CHANNELS = 60
_FEWEST_SAMPLES = 50  # of channels whose names say nothing
_PAIR = ("displacement", "force")
_ONE_MOTION, _TWO_SENSORS = 0.02, 0.25  # relative RMS difference of two columns that hold the same
_Groups = dict[str, dict[str, int]]  # columns by channel, by group
_Channel = tuple[str, str, np.ndarray]  # label, unit and rows


def tests_of(table: RawTable, form: FileForm, stated: Mapping[str, str | int]) -> list[RawTable]:
    """The table of every test that a table holds; the table itself where it is one.

    Of tests beside each other only those that have the columns which a profile has `stated`, by channel.
    """
    if form.blocks == "join" and form.run_column is None:
        return [table]
    for column in _run_columns(table, form):
        if parts := _by_run(table, column, stated=form.run_column is not None):
            return parts
    return _with_stated(table, _groups(table, form) or _shared_motion(table, form), stated) or [table]


def _with_stated(table: RawTable, tests: list[RawTable], stated: Mapping[str, str | int]) -> list[RawTable]:
    """Return those of tests beside each other that have the columns stated for the motion and the force, with a note.

    A name that several columns have is that of a column of each test.
    """
    own = {role: column for role, column in stated.items() if role in _PAIR}
    own = {role: c for role, c in own.items() if isinstance(c, int) or table.names.count(c) == 1}
    numbers = {table.number(column_called(table, column, role)) for role, column in own.items()}
    chosen = [test for test in tests if numbers <= {*test.numbers}]
    others = [test.label for test in tests if test not in chosen]
    text = f"the profile states its columns: tests of other columns are not taken: {listed(others, 5)}"
    return [test.noted(Finding("W_COLUMN", text)) for test in chosen] if others else chosen


def _run_columns(table: RawTable, form: FileForm) -> list[int]:
    """Return the columns that may tell the tests of a table apart, the surest first, or that of a profile."""
    if form.run_column is not None:
        return [column_called(table, form.run_column, "runs", "run_column under [file]")]
    words = [[word.casefold().rstrip("0123456789") for word in words_of(name[:60])] for name in table.names]
    named = [i for i, of in enumerate(words) if _RUN_WORDS & {*of} and {*of} <= _RUN_WORDS | _NUMBER]
    if named:
        return named
    stated = [(i, table.words(i).labels[:_MOST_LEVELS]) for i, cell in enumerate(table.odd) if currents_in(cell)]
    stated = [i for i, labels in stated if all(len(currents_in(label)) == 1 for label in labels)]
    return stated or [i for i in _texts(table) if _changes_with_time(table, i)]


def _texts(table: RawTable) -> list[int]:
    """Return the columns that hold texts, by a cell of each where there is one."""
    bare = [i for i, header in enumerate(table.headers) if header.role is None and not header.unit]
    return [i for i in bare if (table.odd[i] if table.odd else table.try_read(i) is None)]


def _changes_with_time(table: RawTable, column: int) -> bool:
    """Tell if a column of texts changes where the time starts again, and only there, and never to an earlier text."""
    times = table.columns("time")
    values = table.try_read(*times) if len(times) == 1 else None
    if values is None:
        return False
    words, starts = table.words(column), np.flatnonzero(np.diff(values[times[0]]) < 0)
    return 0 < starts.size == len(words.labels) - 1 and np.array_equal(starts, np.flatnonzero(np.diff(words.codes)))


def _by_run(table: RawTable, column: int, *, stated: bool) -> list[RawTable]:
    table = replace(table, words=cache(table.words))  # every test asks
    words = table.words(column)
    codes, labels = words.codes, list(words.labels)
    merged = "" in labels and labels[0] != ""  # named in its first row only
    if merged:
        blank = labels.index("")
        at = np.maximum.accumulate(np.where(codes == blank, 0, np.arange(codes.size)))
        codes = codes[at]
    runs = list(dict.fromkeys(codes.tolist())) if codes.size else []
    if not stated and (len(runs) < 2 or _FEWEST_ROWS * len(runs) > codes.size):
        return []
    if len(runs) > MOST_RUNS:
        problem = f"{len(runs)} runs in column {table.names[column]!r}"
        raise table.source.refuse("E_BLOCKS", problem, f"at most {MOST_RUNS} a file")
    tidy = [re.sub(r"^([0-9]+)[.,]0+$", r"\1", label.strip()) or "unnamed" for label in labels]
    stretches = np.bincount(codes[np.diff(codes, prepend=-1) != 0], minlength=len(labels))
    between = [
        c for c in runs if IDLE.search(tidy[c]) and stretches[c] > 1 and max(np.delete(stretches, c), default=0) == 1
    ]
    if between and len(runs) > 1:
        text = f"the rows of {tidy[between[0]]!r} in {table.names[column]!r}, before and after the tests, are omitted"
        table, runs = table.noted(Finding("W_TABLE", text)), [code for code in runs if code not in between]
    read = _remembered(table)
    others = [i for i in range(len(table.names)) if i != column]
    return [_part(table, read, others, partial(_rows_of, codes, code), tidy[code], merged=merged) for code in runs]


def _rows_of(codes: np.ndarray, code: int) -> slice | np.ndarray:
    rows = np.flatnonzero(codes == code)
    return slice(int(rows[0]), int(rows[-1]) + 1) if rows[-1] - rows[0] + 1 == rows.size else rows


def _remembered(table: RawTable) -> Callable[[tuple[int, ...]], Content]:
    """Keep the table's columns while its tests are taken out one by one; of a small file all are read in one pass."""
    read = lru_cache(maxsize=2)(table.read)

    @cache
    def every() -> Content | None:
        with suppress(InputError):  # one of them cannot be read, which matters only if it is asked for
            return table.read([i for i, h in enumerate(table.headers) if h.role is not None or h.dimension])
        return None

    def remembered(columns: tuple[int, ...]) -> Content:
        whole = every() if table.source.size <= _SMALL else None
        return whole if whole is not None and {*columns} <= {*whole.values} else read(columns)

    return remembered


def _part(
    table: RawTable,
    read: Callable[[tuple[int, ...]], Content],
    columns: Sequence[int],
    rows: Callable[[], slice | np.ndarray],
    label: str,
    *,
    merged: bool = False,
) -> RawTable:
    """Return some of a table's columns in the rows of one test, which are asked for when they are needed.

    Where the test is named in a cell merged over its rows, other cells may be merged, too.
    """

    def part(wanted: Sequence[int]) -> Content:
        content, inside = read(tuple(columns[i] for i in wanted)), rows()
        values = {i: np.array(content.values[columns[i]][inside]) for i in wanted}
        for own in values.values() if merged else ():
            own[:] = own if np.isfinite(own[1:]).any() else own[0]
        return Content(values, None if content.lines is None else content.lines[inside], content.findings)

    def words(column: int) -> Words:
        whole = table.words(columns[column])
        codes, places = np.unique(whole.codes[rows()], return_inverse=True)
        return Words(places, tuple(whole.labels[code] for code in codes))

    cells = {line: _title_cells(line) for line in table.remarks}
    several = tuple(line for line, own in cells.items() if len({value for c in own for value in currents_in(c)}) > 1)
    name = "_".join(part for part in (table.label, label) if part)
    return replace(table.picked(columns, part), titles=several, label=name, words=words)


def _title_cells(line: str) -> list[str]:
    """Return the cells of a line over columns; a comma parts them where nothing else does: I = 0,5 A has a decimal."""
    return re.split(r"[\t;|]" if re.search(r"[\t;|]", line) else ",", line)


def _groups(table: RawTable, form: FileForm) -> list[RawTable]:
    """Return groups of columns beside each other, each a test; empty if the table has none.

    A group has its own displacement and force. What tells a test from a second sensor is a time of its own, a title
    that states a current, or names as `_name_tests` knows them.
    """
    members = _members(table, by_order=form.blocks == "split")
    if len(members) < 2:
        return []
    own_time = all("time" in roles for roles in members.values())
    over = {key: table.over[min(roles.values())] if table.over else "" for key, roles in members.items()}
    over = dict.fromkeys(members, "") if len({*over.values()}) == 1 else over  # a line on all of them
    titles = {key: over[key] or _as_written(table.names[roles["force"]], key) for key, roles in members.items()}
    if not any(over.values()):  # titles whose cells stand askew, by a comma in them: as many as groups, in their order
        places = sorted(members, key=lambda key: min(members[key].values()))
        for line in table.remarks:
            cells = [cell.strip(' "#%/') for cell in _title_cells(line)]
            own = [cell for cell in cells if currents_in(cell)]
            if len(own) > len(members) and len(cells) == len(table.names):  # over several columns of each group, alike
                distinct = [{cells[i] for i in members[key].values() if currents_in(cells[i])} for key in places]
                own = [next(iter(cells)) for cells in distinct if len(cells) == 1]
            if len(own) == len(members) and not RATING.search(line):
                titles |= dict(zip(places, own, strict=True))
                break
    stated = all(currents_in(title) or PADDED.search(title) for title in titles.values())
    if not (own_time or stated or form.blocks == "split" or _name_tests(table, members, titles)):
        return []
    grouped = {i for roles in members.values() for i in roles.values()}
    alone = [columns[0] for role in ("time", "current") if len(columns := table.columns(role)) == 1]
    shared = [column for column in alone if column not in grouped]  # belong to every group
    return _beside(table, [(titles[key], roles, [*roles.values(), *shared]) for key, roles in members.items()])


def _as_written(name: str, key: str) -> str:
    """Return the damper that a part of a column's name names, as it is written there; else the part."""
    at = name.casefold().find(key)
    return name[at : at + len(key)] if at >= 0 and damper_in(key) else key


def _name_tests(table: RawTable, members: _Groups, titles: Mapping[str, str]) -> bool:
    """Tell if groups are named after dampers, after motions, or by numbers of tests, and are no sensors.

    Every sensor of one test has another with nearly the same motion and force, numbered tests have not.
    """
    headings = {(*table.names[i : i + 1], *table.over[i : i + 1]) for i in (m["force"] for m in members.values())}
    dampers = {*map(damper_in, titles.values())}
    if all(dampers) and len(dampers) == len(titles):
        return True
    motions = all(map(states_motion, titles.values()))
    if len(headings) == 1 or not (motions or all(title.isdigit() or numbers_test(title) for title in titles.values())):
        return False
    values = table.peek(*(roles[role] for roles in members.values() for role in _PAIR))
    if values is None:
        return False
    groups = [[values[roles[role]] for role in _PAIR] for roles in members.values()]
    limit = _ONE_MOTION if motions else _TWO_SENSORS
    alike = [all(map(partial(_alike, limit=limit), *pair)) for pair in permutations(groups, 2)]
    return not np.reshape(alike, (len(groups), -1)).any(axis=1).all()


def _alike(one: np.ndarray, other: np.ndarray, limit: float) -> bool:
    difference = one - other
    there = np.isfinite(difference)
    return bool(np.std(difference[there]) <= limit * max(np.std(one[there]), np.std(other[there])))


def _shared_motion(table: RawTable, form: FileForm) -> list[RawTable]:
    """One motion with several forces, a test each, if a title of each states its current, or the profile splits it."""
    forces = [i for i in table.columns("force") if table.headers[i].dimension in (None, "force")]
    titles = [table.over[i] if table.over else "" for i in forces]
    stated = [currents_in(title) for title in titles]
    if len(forces) < 2 or len(table.columns("displacement")) != 1:
        return []
    if form.blocks == "split" and not any(titles):
        titles = [table.headers[i].name for i in forces]
    elif any(len(currents) != 1 for currents in stated) or len({*stated}) < len(stated):
        return []
    others = [i for i in range(len(table.names)) if i not in forces]
    tests = zip(titles, forces, strict=True)
    return _beside(table, [(title, {"force": i, "displacement": i}, [*others, i]) for title, i in tests])


def _beside(table: RawTable, tests: Sequence[tuple[str, dict[str, int], list[int]]]) -> list[RawTable]:
    """Return the table of each test, of its title, its columns by channel, and all that it is given."""
    read = _remembered(table)
    rows = [cache(partial(_filled, table, read, roles, title)) for title, roles, _ in tests]
    every = zip(tests, rows, strict=True)
    parts = [(title, _part(table, read, sorted({*columns}), own, title)) for (title, _, columns), own in every]
    return [replace(part, damper=damper_in(title)) for title, part in parts]


def _members(table: RawTable, *, by_order: bool) -> _Groups:
    """By group its columns by channel, where displacement and force come as often as each other.

    Columns of one name, and where a profile wants it those whose names do not pair them, are paired by their order.
    """
    by_role: dict[str, list[int]] = {}
    for i, header in enumerate(table.headers):
        role = header.channel
        if role is not None and header.dimension in (None, DIMENSION[role]):
            by_role.setdefault(role, []).append(i)
    keys = {role: _keys(table, columns, role) for role, columns in by_role.items()}
    count = len(keys.get("displacement", ()))
    if count < 2 or count != len(keys.get("force", ())):
        return {}
    by_order &= {*keys["displacement"]} != {*keys["force"]}
    members: dict[str, dict[str, int]] = {}
    for role, columns in by_role.items():
        own = keys[role]
        if len(columns) == count and (len({*own}) == 1 or by_order):
            own = [f"{n}" for n in range(1, count + 1)]
        for key, i in zip(own, columns, strict=True) if len({*own}) == len(own) else ():
            members.setdefault(key, {})[role] = i
    members = {key: roles for key, roles in members.items() if {*_PAIR} <= {*roles}}
    return members if len(members) == count else {}


def _keys(table: RawTable, columns: Sequence[int], role: str) -> list[str]:
    """Return the parts of names beside their channel, with the currents in titles where only these tell them apart."""
    keys = [_key(table.headers[i].name, role) for i in columns]
    stated = [currents_in(table.over[i]) for i in columns] if table.over and len({*keys}) < len(keys) else ()
    both = [f"{key} {current}" for key, current in zip(keys, stated, strict=False) if current]
    return both if len({*both}) == len(keys) else keys


def _key(name: str, role: str) -> str:
    """Return the part of a name beside its channel: the number or condition of the group."""
    words = [w for w in re.split(r"[\s_:;/|()\[\]-]+", name) if w]
    rest = [w for w in words if role_of(w) != role or w.rstrip("0123456789") != w]
    rest = [re.sub(r"^[^\W\d]+(?=[0-9]+$)", "", w) if role_of(w) == role else w for w in rest]
    return " ".join(rest).casefold()


def _filled(table: RawTable, read: Callable[[tuple[int, ...]], Content], roles: dict[str, int], label: str) -> slice:
    """Return the rows of a group, down to its last: shorter groups end in empty cells."""
    both = tuple(sorted((roles["displacement"], roles["force"])))
    values = read(both).values
    there = np.flatnonzero(np.isfinite(values[both[0]]) | np.isfinite(values[both[1]]))
    if not there.size:
        raise table.source.refuse("E_NO_DATA", f"no numbers in the columns of {label!r}", "leave them out")
    return slice(0, int(there[-1]) + 1)


def stretches_of_time(time: np.ndarray) -> list[slice]:
    """Return the stretches between restarts of a time that repeatedly starts from its first value: a test each.

    One stretch where it does not. A clock that wraps, midnight, a change of daylight time or
    swapped rows are no new test: they do not come back to the first value, or they leave from
    a count's end.
    """
    whole = [slice(0, time.size)]
    if next(odd_steps(time, lambda steps: steps < 0), None) is None:
        return whole
    finite = np.flatnonzero(np.isfinite(time))
    if finite.size < 2 * _FEWEST_ROWS:
        return whole
    stamps = time[finite]
    steps = np.diff(stamps)
    back = np.flatnonzero(steps < 0)
    if back.size > MOST_RUNS:
        return whole
    step = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    bounds = np.concatenate([[0], back + 1, [stamps.size]])
    again = np.abs(stamps[back + 1] - stamps[0]) <= 5 * step
    if not again.all() or np.diff(bounds).min() < 4 * _FEWEST_ROWS:
        return whole
    if any(np.max(steps[i + 1 : i + 4], initial=0.0) > 10 * step for i in back):  # a stray stamp: it goes on as before
        return whole
    if any(_wraps(float(stamps[i]) + step - float(stamps[0]), step) for i in back):
        return whole
    at = [0, *(int(finite[i + 1]) for i in back), time.size]
    return [slice(a, b) for a, b in pairwise(at)]


def _wraps(end: float, step: float) -> bool:
    """Tell if a time ends where a counter does: at a power of two, wherever the decimal point is."""
    if end <= 0:
        return False
    for bits in (8, 12, 15, 16, 24, 31, 32):
        scale = end / 2.0**bits
        decade = 10.0 ** np.round(np.log10(scale))
        if abs(scale / decade - 1) * 2.0**bits * decade <= 1.5 * step:
            return True
    return False


def with_channels_as_columns(table: RawTable) -> RawTable:
    """Return a long table with a column for each of its channels; any other table as it is.

    Raises `RigFileError`: E_RASTER if channels of several tests have other times than the force.
    """
    parts = [[word.casefold() for word in words_of(name)] for name in table.names]
    names = [  # channel of channel_id, too
        {name.strip(" _").casefold(), "_".join(part for part in own if part not in _NUMBER)}
        for name, own in zip(table.names, parts, strict=True)
    ]
    value = [i for i, either in enumerate(names) if either & _VALUE]
    channel = [i for i, either in enumerate(names) if either & _CHANNEL]
    unit = [i for i, either in enumerate(names) if either & _UNIT][:1]
    if len(value) != 1 or len(channel) != 1:
        value, channel, unit = _by_content(table)
    if len(value) != 1 or len(channel) != 1:
        return table
    words = table.words(channel[0])
    roles = {split_name(label).role: code for code, label in enumerate(words.labels)}
    sizes = np.bincount(words.codes, minlength=len(words.labels))
    whole = {"displacement", "force"} <= set(roles) or sizes.min() >= _FEWEST_SAMPLES  # a list beside may name them
    if not whole or not 1 < len(words.labels) <= _MOST_CHANNELS:
        return table
    units = _units(table, words, unit)
    if units is None:
        return table
    others = [i for i in range(len(names)) if i not in (value[0], channel[0], *unit)]
    others.sort(key=lambda i: table.headers[i].role != "time")
    rows = [np.flatnonzero(words.codes == code) for code in range(len(words.labels))]
    rows = [own[: sizes.min()] for own in rows] if np.ptp(sizes) == 1 else rows  # the last sample is cut
    channels = [*zip(words.labels, units, rows, strict=True)]
    return _pivoted(table, value[0], others, channels, rows[roles.get("force", int(sizes.argmax()))])


def _by_content(table: RawTable) -> tuple[list[int], list[int], list[int]]:
    """Return the columns of values, channels and units by what stands in them, where no name of a column tells."""
    texts = [i for i, text in enumerate(table.odd) if text]
    if not texts or {"displacement", "force"} & {header.channel for header in table.headers}:
        return [], [], []
    labels = {i: table.words(i).labels[: _MOST_CHANNELS + 1] for i in texts}
    channels = [i for i in texts if len({split_name(label).role for label in labels[i]} & {*REQUIRED, *OPTIONAL}) > 1]
    units = [i for i in texts if all(is_unit(label.strip("[]() ")) for label in labels[i])]
    bare = [i for i, h in enumerate(table.headers) if i not in texts and not h.unit and h.role is None]
    return bare, channels, units[:1]


def _pivoted(table: RawTable, value: int, others: list[int], channels: list[_Channel], base: np.ndarray) -> RawTable:
    """Return the channels as columns, those with other times than the force behind their own clock."""
    column = cache(lambda i: table.read([i]).values[i])
    clocks = [i for i in others if table.headers[i].role == "time"]
    rows = [own for *_, own in channels]
    even = [own.size == base.size and all(np.allclose(column(i)[own], column(i)[base]) for i in clocks) for own in rows]
    apart = [channel for channel, same in zip(channels, even, strict=True) if not same]
    tests = [i for i in others if i not in clocks and len(np.unique(table.words(i).codes[base])) > 1]
    if apart and (len(clocks) != 1 or tests):
        problem = f"{apart[0][0]!r} has other times than the force"
        raise table.source.refuse("E_RASTER", problem, "export one column a channel")
    places = [(i, base, table.names[i], table.units[i]) for i in others]
    places += [(value, own, label, unit) for (label, unit, own), same in zip(channels, even, strict=True) if same]
    for label, unit, own in apart:
        places += [(clocks[0], own, *places[0][2:]), (value, own, label, unit)]

    def words(i: int) -> Words:
        layout = table.words(places[i][0])
        return Words(layout.codes[places[i][1]], layout.labels)

    def read(columns: Sequence[int]) -> Content:
        return Content({i: column(places[i][0])[places[i][1]] for i in columns})

    names, own = tuple(name for *_, name, _ in places), tuple(unit for *_, unit in places)
    return replace(table, names=names, units=own, read=read, words=words, odd=(), over=())


def _units(table: RawTable, words: Words, column: list[int]) -> list[str] | None:
    """Return the unit of every channel; None if a channel has two."""
    if not column:
        return [""] * len(words.labels)
    stated = table.words(column[0])
    pairs = np.unique(np.column_stack([words.codes, stated.codes]), axis=0)
    return [stated.labels[unit].strip("[]() ") for _, unit in pairs] if len(pairs) == len(words.labels) else None
