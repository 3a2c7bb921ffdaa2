"""Long tables: one row a sample of one channel, with columns that name the channel, its value and its unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from mrdamper.rig_files.column_names import split_name, words_of
from mrdamper.rig_files.readers.base import Content, RawTable, Words
from mrdamper.rig_files.record import OPTIONAL, REQUIRED
from mrdamper.rig_files.units import is_unit
from mrdamper.rig_files.vocabulary import words

_VALUE, _CHANNEL, _UNIT, _NUMBER = words("value"), words("channel"), words("unit"), words("run_number")
_MOST_CHANNELS = 60
_FEWEST_SAMPLES = 50  # of channels whose names say nothing


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
    if table.words is None or len(value) != 1 or len(channel) != 1:
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
    return _pivoted(table, value[0], others, words.labels, units, rows, rows[roles.get("force", int(sizes.argmax()))])


def _by_content(table: RawTable) -> tuple[list[int], list[int], list[int]]:
    """Return the columns of values, channels and units by what stands in them, where no name of a column tells."""
    texts = [i for i, text in enumerate(table.odd) if text]
    if table.words is None or not texts or {"displacement", "force"} & {header.channel for header in table.headers}:
        return [], [], []
    labels = {i: table.words(i).labels[: _MOST_CHANNELS + 1] for i in texts}
    channels = [i for i in texts if len({split_name(label).role for label in labels[i]} & {*REQUIRED, *OPTIONAL}) > 1]
    units = [i for i in texts if all(is_unit(label.strip("[]() ")) for label in labels[i])]
    bare = [i for i, h in enumerate(table.headers) if i not in texts and not h.unit and h.role is None]
    return bare, channels, units[:1]


def _pivoted(
    table: RawTable,
    value: int,
    others: list[int],
    labels: tuple[str, ...],
    units: list[str],
    rows: list[np.ndarray],
    base: np.ndarray,
) -> RawTable:
    """Return the channels as columns, those with other times than the force behind their own clock."""
    of_table = table.words
    assert of_table is not None
    column = cache(lambda i: table.read([i]).values[i])
    clocks = [i for i in others if table.headers[i].role == "time"]
    apart = [n for n, own in enumerate(rows) if not _alike(own, base, [column(i) for i in clocks])]
    tests = [i for i in others if i not in clocks and len(np.unique(of_table(i).codes[base])) > 1]
    if apart and (len(clocks) != 1 or tests):
        problem = f"{labels[apart[0]]!r} has other times than the force"
        raise table.source.refuse("E_RASTER", problem, "export one column a channel")
    places = [(i, base, table.names[i], table.units[i]) for i in others]
    places += [(value, own, labels[n], units[n]) for n, own in enumerate(rows) if n not in apart]
    for n in apart:
        places += [(clocks[0], rows[n], *places[0][2:]), (value, rows[n], labels[n], units[n])]

    def words(i: int) -> Words:
        layout = of_table(places[i][0])
        return Words(layout.codes[places[i][1]], layout.labels)

    def read(columns: Sequence[int]) -> Content:
        return Content({i: column(places[i][0])[places[i][1]] for i in columns})

    names, own = tuple(name for *_, name, _ in places), tuple(unit for *_, unit in places)
    return replace(table, names=names, units=own, read=read, words=words, odd=(), over=())


def _alike(own: np.ndarray, base: np.ndarray, clocks: Sequence[np.ndarray]) -> bool:
    return own.size == base.size and all(np.allclose(clock[own], clock[base]) for clock in clocks)


def _units(table: RawTable, words: Words, column: list[int]) -> list[str] | None:
    """Return the unit of every channel; None if a channel has two."""
    if not column or table.words is None:
        return [""] * len(words.labels)
    stated = table.words(column[0])
    units = []
    for code in range(len(words.labels)):
        codes = np.unique(stated.codes[words.codes == code])
        if codes.size != 1:
            return None
        units.append(stated.labels[codes[0]].strip("[]() "))
    return units
