"""TDMS of LabVIEW, by npTDMS: scaled channels, one table a group."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrdamper.rig_files.column_names import holds, words
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import Stored, check_unpacked, damaged, load, refusing_damage, unit_in
from mrdamper.rig_files.readers.base import RawTable, Reader, Source
from mrdamper.rig_files.readers.nested import nested_tables

# pyright: reportMissingImports=false

_SCALES = words("scale")


class Tdms(Reader):
    """Groups of channels with their unit_string; a waveform's step makes the time."""

    name = "tdms"
    title = "TDMS"
    suffixes = (".tdms",)
    library = "nptdms"
    marks = (b"TDSm",)

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """One table a group; raw volts are refused later, by their unit."""
        nptdms = load("nptdms", self.title)
        with refusing_damage(source, self.title):
            source.file.seek(0)
            file = nptdms.TdmsFile.read_metadata(source.file)
            total = sum(len(channel) for group in file.groups() for channel in group.channels())
            if total > source.size:
                raise damaged(source, self.title, "truncated: fewer samples than its header states")
            check_unpacked(source, 8 * total)
            source.file.seek(0)
            file = nptdms.TdmsFile.read(source.file)
            if getattr(file, "file_status", None) is not None and file.file_status.incomplete_final_segment:
                raise damaged(source, self.title, "the last segment is incomplete")
        tree = {group.name: _group(group, {**file.properties, **group.properties}) for group in file.groups()}
        return nested_tables(source, {name: node for name, node in tree.items() if node["channels"]}, self.title)


def _group(group: Any, properties: dict[str, Any]) -> dict[str, Any]:
    """Return the channels of a group, waveforms with their clock if no channel is one, and the texts beside them."""
    channels = [channel for channel in group.channels() if len(channel) > 1]
    timed = any(channel.name.casefold().startswith(("time", "zeit")) for channel in channels)
    starts = {c.properties["wf_start_time"] for c in channels if "wf_start_time" in c.properties}
    begin = min(starts, default=None)
    texts = {name: f"{value}" for name, value in properties.items() if isinstance(value, (str, int, float))}
    scales = ((c.name, name, c.properties[name]) for c in channels for name in c.properties if holds(name, _SCALES))
    texts |= {f"{channel} {name}": f"{value}" for channel, name, value in scales}
    return {**texts, "channels": [_channel(channel, {} if timed else _clock(channel, begin)) for channel in channels]}


def _channel(channel: Any, clock: dict[str, float]) -> dict[str, Any]:
    kind = getattr(channel.dtype, "kind", "")
    dtype = channel.dtype if kind in "iufMm" else np.dtype("U1")
    unit = "s" if kind in "Mm" else unit_in(channel.properties)

    def load() -> np.ndarray:
        return np.asarray(channel[:]) if kind in "iufMm" else np.empty(len(channel), dtype)

    return {"name": channel.name, "unit": unit, "data": Stored((len(channel),), dtype, load), **clock}


def _clock(channel: Any, begin: Any) -> dict[str, float]:
    """Step and start of a waveform [s]; empty for a step of a second without a start, as LabVIEW writes it unset."""
    properties = channel.properties
    step, offset = properties.get("wf_increment"), float(properties.get("wf_start_offset") or 0.0)
    if not isinstance(step, (int, float)) or not step > 0 or (step == 1.0 and "wf_xname" not in properties):
        return {}
    later = (properties["wf_start_time"] - begin) / np.timedelta64(1, "s") if "wf_start_time" in properties else 0.0
    return {"dt [s]": float(step), "t0 [s]": offset + float(later)}
