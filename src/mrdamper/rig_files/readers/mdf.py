"""MDF 3 and 4 of measuring systems in vehicles, by asammdf: channels of one raster."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrdamper.rig_files.file_form import FileForm
from mrdamper.rig_files.readers.arrays import array_table, check_unpacked, load, refusing_damage
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RawTable, Reader, Source

# pyright: reportMissingImports=false


class Mdf(Reader):
    """One table a channel group with its master; all together if no group holds a test."""

    name = "mdf"
    title = "MDF"
    suffixes = (".mf4", ".mdf", ".mf3")
    library = "asammdf"
    marks = (b"MDF     ", b"UnFinMF ")  # the second of a file that was not closed

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return the groups as tables."""
        if source.head(8) == b"UnFinMF ":
            raise source.refuse("E_TRUNCATED", "the measurement was not closed", "close it with its own program")
        asammdf = load("asammdf", self.title)
        with refusing_damage(source, self.title):
            file = asammdf.MDF(source.path)
            source.keep.callback(file.close)
            places = [_places(file, i) for i in range(len(file.groups))]
            rows = [int(group.channel_group.cycles_nr) for group in file.groups]
            check_unpacked(source, 8 * max(rows, default=0))
        tables = [_table(source, file, group, self.title) for group in places if len(group) > 1]
        if len(tables) > 1:
            masters = {group[0] for group in places[1:]}  # one master is enough: the others must agree with it
            every = [place for group in places for place in group if place not in masters]
            tables.append(_table(source, file, every, self.title, fallback=True))
        if not tables:
            raise source.refuse("E_NO_DATA", "no channels", "export the file again")
        return tables


def _places(file: Any, group: int) -> list[tuple[str, str, int, int]]:
    """Name, unit, group and index of every channel of a group, the master first."""
    channels = file.groups[group].channels[: MOST_COLUMNS + 1]
    master = file.masters_db.get(group)
    order = ([master] if master is not None else []) + [i for i in range(len(channels)) if i != master]
    return [(channels[i].name, _unit(channels[i]), group, i) for i in order]


def _unit(channel: Any) -> str:
    conversion = getattr(channel, "conversion", None)
    return str(getattr(channel, "unit", "") or getattr(conversion, "unit", "") or "")


def _table(source: Source, file: Any, places: list, title: str, *, fallback: bool = False) -> RawTable:
    stamps: dict[int, np.ndarray] = {}

    def column_of(column: int) -> np.ndarray:
        name, _, group, index = places[column]
        signal = file.get(name, group=group, index=index, ignore_invalidation_bits=True)
        if stamps and not any(np.array_equal(signal.timestamps, other) for other in stamps.values()):
            problem = f"channel {name!r} is recorded at other times than the others"
            raise source.refuse("E_RASTER", problem, "export the channels with one raster")
        stamps[group] = signal.timestamps
        samples = np.asarray(signal.samples)
        invalid = getattr(signal, "invalidation_bits", None)
        if samples.dtype.kind in "iuf" and invalid is not None:
            samples = np.where(np.asarray(invalid, dtype=bool), np.nan, samples)
        return samples if samples.dtype.kind in "iuf" else np.empty(samples.shape[:1], dtype="U1")

    return array_table(
        source, [p[0] for p in places], [p[1] for p in places], column_of, title=title, fallback=fallback,
        label="" if fallback else f"group_{places[0][2] + 1}",
    )  # fmt: skip
