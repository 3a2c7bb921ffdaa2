"""TDMS of LabVIEW, by npTDMS: scaled channels, one table a group."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrdamper.rig_files.file_form import FileForm
from mrdamper.rig_files.readers.arrays import array_table, check_unpacked, damaged, load, refusing_damage
from mrdamper.rig_files.readers.base import RawTable, Reader, Source

# pyright: reportMissingImports=false

_UNIT_NAMES = ("unit_string", "NI_UnitDescription", "unit", "units", "Unit", "Units")
_WAVE_TIME = "Time"


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
                raise damaged(source, self.title, "truncated: fewer samples than it says")
            check_unpacked(source, 8 * total)
            source.file.seek(0)
            file = nptdms.TdmsFile.read(source.file)
            if getattr(file, "file_status", None) is not None and file.file_status.incomplete_final_segment:
                raise damaged(source, self.title, "the last segment is incomplete")
        tables = [
            _table(source, group, {**file.properties, **group.properties}, self.title)
            for group in file.groups()
            if group.channels()
        ]
        if not tables:
            raise source.refuse("E_NO_DATA", "no channels", "export the file again")
        return tables


def _table(source: Source, group: Any, properties: dict[str, Any], title: str) -> RawTable:
    channels = list(group.channels())
    names = [channel.name for channel in channels]
    units = [_unit(channel) for channel in channels]
    steps = {_step(channel) for channel in channels} - {None}
    begins = {
        (float(channel.properties.get("wf_start_offset") or 0.0), str(channel.properties.get("wf_start_time", "")))
        for channel in channels
        if _step(channel)
    }
    sizes = {len(channel) for channel in channels if len(channel)}
    timed = any(name.casefold().startswith(("time", "zeit")) for name in names)
    if not timed and (len(steps) > 1 or len(begins) > 1):
        what = "steps" if len(steps) > 1 else "starts"
        problem = f"the channels of group {group.name!r} have different {what} of time"
        raise source.refuse("E_RASTER", problem, "export them with one clock")
    step = next(iter(steps), None)
    wave = step is not None and len(sizes) == 1 and not timed
    if wave:
        names, units = [*names, _WAVE_TIME], [*units, "s"]

    def column_of(column: int) -> np.ndarray:
        if column == len(channels):
            return np.arange(max(sizes)) * (step or 1.0)
        data = np.asarray(channels[column][:])
        return data if data.dtype.kind in "iufMm" else np.empty(data.shape, dtype="U1")

    remarks = [f"{name}: {value}"[:200] for name, value in properties.items() if isinstance(value, (str, int, float))]
    return array_table(source, names, units, column_of, label=group.name, title=title, remarks=remarks)


def _unit(channel: Any) -> str:
    if getattr(channel.dtype, "kind", "") in "Mm":
        return "s"
    return next((str(channel.properties[n]) for n in _UNIT_NAMES if channel.properties.get(n)), "")


def _step(channel: Any) -> float | None:
    """Step of a waveform [s]; one of exactly a second without a start is what LabVIEW writes where nobody set it."""
    step = channel.properties.get("wf_increment")
    if not isinstance(step, (int, float)) or not step > 0:
        return None
    return None if step == 1.0 and "wf_xname" not in channel.properties else float(step)
