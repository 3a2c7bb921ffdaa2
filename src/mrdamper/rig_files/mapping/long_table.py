"""Long tables: one row a sample of one channel, with columns that name the channel, its value and its unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from mrdamper.data import held_current
from mrdamper.rig_files.column_names import split_name
from mrdamper.rig_files.readers.base import Content, RawTable, Words
from mrdamper.rig_files.vocabulary import words

_VALUE, _CHANNEL, _UNIT = words("value"), words("channel"), words("unit")
_MOST_CHANNELS = 60


def with_channels_as_columns(table: RawTable) -> RawTable:
    """Return a long table with a column for each of its channels; any other table as it is.

    Raises `RigFileError`: E_RASTER, when the table is read, if the channels have other times or other tests than the
    force.
    """
    names = [name.strip(" _").casefold() for name in table.names]
    value = [i for i, name in enumerate(names) if name in _VALUE]
    channel = [i for i, name in enumerate(names) if name in _CHANNEL]
    if table.words is None or len(value) != 1 or len(channel) != 1:
        return table
    words = table.words(channel[0])
    roles = {split_name(label).role: code for code, label in enumerate(words.labels)}
    if not {"displacement", "force"} <= set(roles) or len(words.labels) > _MOST_CHANNELS:
        return table
    unit = [i for i, name in enumerate(names) if name in _UNIT][:1]
    units = _units(table, words, unit)
    if units is None:
        return table
    others = [i for i in range(len(names)) if i not in (value[0], channel[0], *unit)]
    rows = [np.flatnonzero(words.codes == code) for code in range(len(words.labels))]
    base = rows[roles["force"]]
    return _pivoted(table, value[0], others, words.labels, units, rows, base)


def _pivoted(
    table: RawTable,
    value: int,
    others: list[int],
    labels: tuple[str, ...],
    units: list[str],
    rows: list[np.ndarray],
    base: np.ndarray,
) -> RawTable:
    of_table = table.words
    assert of_table is not None
    clocks = [i for i in others if table.headers[i].role == "time"]
    column = cache(lambda i: table.read([i]).values[i])

    def of_channel(number: int) -> np.ndarray:
        own = rows[number]
        same = own.size == base.size and all(np.allclose(column(i)[own], column(i)[base]) for i in clocks)
        if not same and len(clocks) == 1 and split_name(labels[number]).role == "current":
            return _on_clock(column(clocks[0])[base], column(clocks[0])[own], column(value)[own])
        if not same:
            raise table.source.refuse(
                "E_RASTER", f"{labels[number]!r} has other times than the force", "export one column a channel"
            )
        return column(value)[own]

    def read(columns: Sequence[int]) -> Content:
        size = len(others)
        return Content({i: column(others[i])[base] if i < size else of_channel(i - size) for i in columns})

    def words(i: int) -> Words:
        if i >= len(others):
            return Words(np.zeros(base.size, dtype=np.int32), ("",))
        layout = of_table(others[i])
        return Words(layout.codes[base], layout.labels)

    names = (*(table.names[i] for i in others), *labels)
    own = (*(table.units[i] for i in others), *units)
    return replace(table, names=names, units=own, read=read, words=words, odd=(), over=(), remarks=())


def _on_clock(clock: np.ndarray, own: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return a current recorded more rarely: the one that is held, else interpolated onto the force's clock."""
    there = np.isfinite(own) & np.isfinite(values)
    held, change = held_current(values[there])
    if not change:
        return np.full(clock.shape, held)
    return np.interp(clock, own[there], values[there])


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
