"""MDF 3 and 4 of measuring systems in vehicles, by asammdf."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import Stored, check_unpacked, load, refusing_damage
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RawTable, Reader, Source
from mrdamper.rig_files.readers.nested import nested_tables

# pyright: reportMissingImports=false


class Mdf(Reader):
    """One table a channel group with its master."""

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
            groups = {f"group_{i + 1}": _channels(file, i) for i in range(len(file.groups))}
        sizes = (8 * channels[0]["data"].size for channels in groups.values() if channels)
        check_unpacked(source, max(sizes, default=0))
        notes = [getattr(group.channel_group, "comment", "") for group in file.groups]
        texts = [{"comment": str(note)} if note else {} for note in notes]
        both = zip(groups.items(), texts, strict=True)
        tree = {name: {"channels": own, **text} for (name, own), text in both if len(own) > 1}
        return nested_tables(source, tree, self.title)


def _channels(file: Any, group: int) -> list[dict[str, Any]]:
    """Return the channels of a group that has samples, the master first."""
    channels, rows = file.groups[group].channels[: MOST_COLUMNS + 1], int(file.groups[group].channel_group.cycles_nr)
    order = sorted(range(len(channels) if rows > 1 else 0), key=lambda i: i != file.masters_db.get(group))
    arrays = {i: Stored((rows,), np.dtype(float), partial(_samples, file, channels[i].name, group, i)) for i in order}
    units = [getattr(c, "unit", "") or getattr(getattr(c, "conversion", None), "unit", "") or "" for c in channels]
    return [{"name": channels[i].name, "unit": str(units[i]), "data": arrays[i]} for i in order]


def _samples(file: Any, name: str, group: int, index: int) -> np.ndarray:
    signal = file.get(name, group=group, index=index, ignore_invalidation_bits=True)
    samples, invalid = np.asarray(signal.samples), getattr(signal, "invalidation_bits", None)
    if samples.dtype.kind in "iuf" and invalid is not None:
        samples = np.where(np.asarray(invalid, dtype=bool), np.nan, samples)
    return samples if samples.dtype.kind in "iuf" else np.empty(samples.shape[:1], dtype="U1")
