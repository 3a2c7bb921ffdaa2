"""Channels with clocks of their own, brought onto the clock of the force by linear interpolation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache
from types import MappingProxyType

import numpy as np

from mrdamper.data import Floats, held_current
from mrdamper.data.wording import number, span
from mrdamper.rig_files.column_names import role_of, split_name
from mrdamper.rig_files.readers.arrays import array_table
from mrdamper.rig_files.readers.base import Content, RawTable, Words
from mrdamper.rig_files.record import COARSE_CLOCK, OPTIONAL, REQUIRED, Finding

_FEWEST_OVERLAP = 0.5  # of the force's time that every needed channel must cover
_SAME = 1e-9  # [s]: clocks that differ by less are one
_TWO_STARTS = 1.0  # [s] between two clocks of all channels: more is a clock with another zero, as the time of day


def with_one_clock(table: RawTable, stated: Mapping[str, str | int] = MappingProxyType({})) -> RawTable:
    """Return the table with every channel on the force's clock, where groups of columns have times of their own.

    The profile may state the columns of channels, by name or number.

    Raises `RigFileError`: E_RASTER, when the table is read, if a channel covers less than half of the force's time.
    """
    groups = _clocks(table)
    if len(groups) < 2:
        return _with_clocks_compared(table)
    owner = {column: clock for clock, columns in groups.items() for column in columns}
    called = {i: (table.names[i], table.headers[i].name, table.number(i)) for i in owner}
    roles = {
        role: [i for i in owner if stated.get(role) in called[i]]
        or [i for i in owner if table.headers[i].channel == role]
        for role in (*REQUIRED[1:], *OPTIONAL)
    }
    if not roles["force"] or not roles["displacement"]:
        return table
    with_channel = {i for i, header in enumerate(table.headers) if header.role or header.dimension}
    if len({owner[i] for i in owner if i in with_channel or {*called[i]} & {*stated.values()}}) < 2:
        return _with_clocks_compared(table)  # nothing but counters and texts follows the others
    together = [c for c in groups if all(any(owner[i] == c for i in roles[r]) for r in ("displacement", "force"))]
    if len(together) > 1:
        return table  # groups that are tests
    clock = together[0] if together else owner[roles["force"][0]]
    kept = [clock, *(i for i in owner if owner[i] == clock), *(i for i in owner if owner[i] != clock)]
    return _resampled(table, clock, kept, owner, roles)


def with_joined_rasters(tables: list[RawTable]) -> list[RawTable]:
    """Tables of a file, those that hold channels of one test with clocks of their own joined to one table.

    Beside each other in one group lie a table of each channel, or of each sampling rate. They are joined
    where none of them is a whole test, or where the one that is has no current and another holds it. Where no more
    than one has a time, all of its length follow it.
    """
    groups: dict[str, list[RawTable]] = {}
    for table in tables:
        groups.setdefault(table.label.rpartition("/")[0], []).append(table)
    joined: dict[int, RawTable] = {}
    dropped: set[int] = set()
    for label, members in [*groups.items(), ("", tables)]:  # at last those that lie in groups of different depth
        of = {table: {header.channel for header in _named(table).headers} - {None} for table in members}
        timed = [table for table in of if table.columns("time")]
        parts = timed if len(timed) > 1 else [*timed, *(t for t in of if of[t] and t not in timed)]
        roles = [of[table] for table in parts]
        whole = [i for i, roles_of in enumerate(roles) if {"displacement", "force"} <= roles_of]
        every = [role for roles_of in roles for role in roles_of if role != "time"]
        needed = {"displacement", "force"} <= set(every) and len(set(every)) == len(every)
        lacks = not whole or ("current" in every and "current" not in roles[whole[0]] and len(timed) > 1)
        if len(parts) < 2 or len(whole) > 1 or not needed or not lacks or not joined.keys().isdisjoint(map(id, parts)):
            continue
        rows = [*map(_rows, parts)]
        currents = {v for t in parts for name, v in t.constants.items() if split_name(name).role == "current"}
        if len(timed) < 2 and (2 * min(rows) < max(rows) or len(currents) > 1):
            continue  # a list of something else, or of another test
        joined[id(parts[0])] = _joined(label, parts, one_clock=len(timed) < 2)
        dropped |= {id(table) for table in parts[1:]}
    return [joined.get(id(table), table) for table in tables if id(table) not in dropped]


def _rows(table: RawTable) -> int:
    column = next((i for i, header in enumerate(table.headers) if header.channel), 0)
    values = table.try_read(column)
    return values[column].size if values else 0


def _named(table: RawTable) -> RawTable:
    """Return a table of one channel with the name of its group, where its own name names nothing."""
    title = table.label.rpartition("/")[2]
    named = split_name(title).role is not None
    names = [title if named and split_name(name).role is None else name for name in table.names]
    return replace(table, names=tuple(names)) if len(table.names) <= 2 else table


def _joined(label: str, tables: Sequence[RawTable], *, one_clock: bool) -> RawTable:
    """Return one table of several, the time of each before its channels; channels of one clock have one length."""
    clocks = [table.columns("time")[:1] for table in tables]
    pairs = zip(tables, clocks, strict=True)
    orders = [sorted(range(len(table.names)), key=lambda i, of=of: i not in of) for table, of in pairs]
    places = [(_named(table), i) for table, order in zip(tables, orders, strict=True) for i in order]

    def load(column: int) -> Floats:
        table, i = places[column]
        return table.read([i]).values[i]

    def apart(columns: Sequence[int]) -> Content:
        return Content({column: load(column) for column in columns})

    def words(column: int) -> Words:
        table, i = places[column]
        return table.words(i)

    names, units = (tuple(getattr(table, key)[i] for table, i in places) for key in ("names", "units"))
    read = array_table(tables[0].source, names, units, load).read if one_clock else apart
    constants = {name: value for table in reversed(tables) for name, value in table.constants.items()}
    remarks = tuple(dict.fromkeys(line for table in tables for line in table.remarks))
    own = {"names": names, "units": units, "label": label, "constants": constants, "remarks": remarks}
    return replace(tables[0], odd=(), over=(), read=read, words=words, **own)


def _clocks(table: RawTable) -> dict[int, list[int]]:
    """By the column of each time the channels that follow it."""
    groups: dict[int, list[int]] = {}
    clock = None
    for i, header in enumerate(table.headers):
        if header.role == "time" and header.dimension in (None, "time"):
            clock = i
            groups[i] = []
        elif clock is not None:
            groups[clock].append(i)
    groups = groups if all(groups.values()) else _by_length(table, groups)
    return {clock: columns for clock, columns in groups.items() if columns}


def _by_length(table: RawTable, groups: dict[int, list[int]]) -> dict[int, list[int]]:
    """Return the channels of clocks that stand beside each other: those with as many samples, where that is unique."""
    channels = [i for i, h in enumerate(table.headers) if i not in groups and (h.role or h.dimension)]
    values = table.try_read(*groups, *channels) if len(groups) > 1 else None
    sizes = {i: _filled(column).size for i, column in (values or {}).items()}
    if values is None or len({sizes[clock] for clock in groups}) < len(groups):
        return groups
    return {clock: [i for i in channels if sizes[i] == sizes[clock]] for clock in groups}


def _resampled(
    table: RawTable, clock: int, kept: Sequence[int], owner: Mapping[int, int], roles: Mapping[str, Sequence[int]]
) -> RawTable:
    read = lru_cache(maxsize=4)(lambda column: table.read([column]).values[column])

    def stamps(column: int) -> Floats:
        return read(column) * table.headers[column].factor

    @cache
    def common() -> tuple[slice, Floats]:
        """Rows of the force that lie within the displacement's time, if most do, and their times."""
        target = _filled(stamps(clock))
        other = _filled(stamps(owner[roles["displacement"][0]]))
        inside = np.flatnonzero(_covered(target, other[np.isfinite(other)]))
        rows = slice(inside[0], inside[-1] + 1) if inside.size >= _FEWEST_OVERLAP * target.size else slice(target.size)
        return rows, target[rows]

    def on_clock(column: int) -> Floats:
        own = owner.get(column, column)
        rows, target = common()
        if own == clock:
            return read(column)[rows]
        return _interpolated(table, column, target, stamps(own), read(column))

    def columns_of(columns: Sequence[int]) -> Content:
        return Content({i: on_clock(kept[i]) for i in columns})

    def words(column: int) -> Words:
        own, whole = owner.get(kept[column], kept[column]), table.words(kept[column])
        rows, target = common()
        latest = np.searchsorted(_filled(stamps(own)), target, side="right") - 1
        return Words(whole.codes[rows if own == clock else np.maximum(latest, 0)], whole.labels)

    gaps = _apart(table, clock, [*{*owner.values()} - {clock}])
    apart = {other: gap for other, gap in gaps.items() if gap > _SAME}
    names = sorted({table.headers[i].name for own in roles.values() for i in own if owner[i] in apart})
    own, text = "on clocks of their own", f"interpolated onto the force's: {', '.join(names[:6])}"
    if max(apart.values(), default=np.inf) < np.inf:
        own += f", up to {number(1e3 * max(apart.values()))} ms apart"
    columns_on_clock = replace(table.picked(kept, columns_of), words=words)
    resampled_table = columns_on_clock.named({0: ("time", table.headers[clock].unit)})
    return resampled_table.noted(Finding("W_RASTER", f"{own}, {text}")) if names else resampled_table


def _apart(table: RawTable, clock: int, others: Sequence[int]) -> dict[int, float]:
    """Largest difference of the stamps of a row from those of other clocks [s]; infinite without common rows."""
    every, gaps = table.try_read(clock, *others), {}
    for other in others:
        values = every or table.try_read(clock, other)  # those of several lengths cannot be read together
        one, two = (_filled(values[i]) * table.headers[i].factor if values else np.empty(0) for i in (clock, other))
        gaps[other] = float(np.nanmax(np.abs(two - one))) if two.size == one.size > 0 else np.inf
    return gaps


def _with_clocks_compared(table: RawTable) -> RawTable:
    """Note a second clock of a table that starts a little earlier or later than the one that all channels follow."""
    clocks = table.columns("time", "time")
    apart = max(_apart(table, clocks[0], clocks[1:]).values()) if len(clocks) == 2 else 0.0
    if not _SAME < apart < _TWO_STARTS or any(
        np.mean(np.diff(table.read([i]).values[i]) == 0) > COARSE_CLOCK for i in clocks
    ):
        return table
    one, two = (table.headers[i].name for i in clocks)
    text = (
        f"the clocks {one!r} and {two!r} are up to {number(1e3 * apart)} ms apart and all channels are taken by one "
        "of them: if the force follows the other, set delay_ms in [channels.force] of a profile"
    )
    return table.noted(Finding("W_RASTER", text))


def _filled(values: Floats) -> Floats:
    """Return the values down to the last: shorter columns end in empty cells."""
    there = np.flatnonzero(np.isfinite(values))
    return values[: there[-1] + 1] if there.size else values


def _covered(target: Floats, time: Floats) -> np.ndarray:
    """(N,) mask of the times that lie within another clock, or within one and a half of its steps of its ends.

    Of a clock that is the beginning of this one, the times behind its end are not.
    """
    beginning = time.size < target.size and np.allclose(target[: time.size], time, rtol=0, atol=_SAME)
    near = 1.5 * float(np.median(np.diff(time))) if time.size > 1 and not beginning else _SAME
    return (target >= time[0] - near) & (target <= time[-1] + near) if time.size else np.zeros(target.size, dtype=bool)


def _interpolated(table: RawTable, column: int, target: Floats, time: Floats, values: Floats) -> Floats:
    """Return a channel on another clock [s], by linear interpolation; its ends are held for one of its own steps.

    Raises `RigFileError`: E_RASTER or E_TIME_ORDER if the clock covers less than half of the other or runs backwards.
    """
    size, name = min(time.size, values.size), table.headers[column].name
    there = np.flatnonzero(np.isfinite(time[:size]) & np.isfinite(values[:size]))
    if there.size < 2:
        raise table.source.refuse("E_NO_DATA", f"no samples in the column of {name!r}", "export the channel again")
    time, values = time[there], values[there]
    if np.any(np.diff(time) <= 0):
        raise table.source.refuse("E_TIME_ORDER", f"the clock of {name!r} stands or runs backwards", "export it again")
    if name and role_of(name) == "current" and time.size < target.size and not held_current(values)[1]:
        return np.full(target.shape, held_current(values)[0])  # between its samples there is nothing but noise
    begin, end = float(np.nanmin(target)), float(np.nanmax(target))
    inside = _covered(target, time)
    if np.mean(inside) < _FEWEST_OVERLAP:
        own, of_force = (span(first, last, "s", 4, " to ") for first, last in ((time[0], time[-1]), (begin, end)))
        problem = f"{name!r} is recorded from {own}, the force from {of_force}"
        raise table.source.refuse("E_RASTER", problem, "export the channels with one clock")
    on_target = np.interp(target, time, values)
    on_target[~inside] = np.nan
    return on_target
