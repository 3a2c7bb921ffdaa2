"""Files of measuring systems: TDMS of LabVIEW, by npTDMS, MDF, by asammdf, and universal files."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from mrdamper.rig_files.column_names import holds, words
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import Stored, check_unpacked, damaged, load, refusing_damage, whole
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RawTable, Reader, Source
from mrdamper.rig_files.readers.nested import nested_tables

# pyright: reportMissingImports=false

_SCALES = words("scale")
_UNIT_NAMES = ("unit_string", "NI_UnitDescription", "unit", "units", "Unit", "Units")
_DELIMITER = "-1"
# Kinds of data of the format, for axes without a label.
_KINDS = {8: "displacement", 11: "velocity", 12: "acceleration", 13: "force", 9: "force", 17: "time", 15: "pressure"}
_HEADER = 11  # lines of a data set above its values
_REAL = {2: 4, 4: 8}  # types of real numbers and their bytes


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

    def load() -> np.ndarray:
        return np.asarray(channel[:]) if kind in "iufMm" else np.empty(len(channel), dtype)

    return {"name": channel.name, "unit": _unit(channel), "data": Stored((len(channel),), dtype, load), **clock}


def _clock(channel: Any, begin: Any) -> dict[str, float]:
    """Step and start of a waveform [s]; empty for a step of a second without a start, as LabVIEW writes it unset."""
    properties = channel.properties
    step, offset = properties.get("wf_increment"), float(properties.get("wf_start_offset") or 0.0)
    if not isinstance(step, (int, float)) or not step > 0 or (step == 1.0 and "wf_xname" not in properties):
        return {}
    later = (properties["wf_start_time"] - begin) / np.timedelta64(1, "s") if "wf_start_time" in properties else 0.0
    return {"dt [s]": float(step), "t0 [s]": offset + float(later)}


def _unit(channel: Any) -> str:
    if getattr(channel.dtype, "kind", "") in "Mm":
        return "s"
    return next((str(channel.properties[n]) for n in _UNIT_NAMES if channel.properties.get(n)), "")


class Uff(Reader):
    """Functions of time, each a channel; texts of their headers stand beside them."""

    name = "uff"
    title = "universal file"
    suffixes = (".uff", ".unv", ".uf", ".58", ".ufb")
    library = "numpy"

    def recognises(self, source: Source) -> bool:
        """By the delimiter and the number of the first data set."""
        lines = source.head(200).split(b"\n")
        return len(lines) > 2 and lines[0].strip() == b"-1" and lines[1][:6].strip().isdigit()

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """One table of the functions that share a clock."""
        lines = whole(source, self.title).decode("latin-1").splitlines()
        marks = [i for i, line in enumerate(lines) if line.strip() == _DELIMITER]
        if len(marks) % 2:
            raise damaged(source, self.title, "truncated: a data set is not closed")
        trees: list[dict[str, object]] = [{}]
        with refusing_damage(source, self.title):
            for start, stop in zip(marks[::2], marks[1::2], strict=True):
                kind = lines[start + 1].split()[0]
                if kind.startswith("58b"):
                    raise source.refuse("E_FORMAT", "a binary data set", "export it as text (ASCII)")
                if kind == "58":
                    texts, channel = _function(lines[start + 2 : stop])
                    if channel["name"] in trees[-1]:  # the next test begins
                        trees.append({})
                    above = {f"{channel['name']} {key}": text for key, text in texts.items()}
                    trees[-1] |= {**above, str(channel["name"]): channel}
        inner = {f"test {i}": tree for i, tree in enumerate(trees, 1)} if len(trees) > 1 else trees[0]
        return nested_tables(source, inner, self.title)


def _function(lines: list[str]) -> tuple[dict[str, object], dict[str, object]]:
    """Return the texts above a function, and the function as a channel."""
    texts: dict[str, object] = {
        f"text {i}": line.strip() for i, line in enumerate(lines[:5], 1) if line.strip() not in ("", "NONE")
    }
    kind, count, even = (int(lines[6][at : at + 10]) for at in (0, 10, 20))
    begin, step = float(lines[6][30:43]), float(lines[6][43:56])
    (_, x_unit), (name, unit) = _axis(lines[7]), _axis(lines[8])
    numbers = np.array(" ".join(lines[_HEADER:]).split(), dtype=float)
    if kind not in _REAL or (not even and numbers.size < 2 * count) or numbers.size < count:
        raise ValueError("truncated: fewer values than its header states, or complex ones")
    values = numbers[:count] if even else numbers[1 : 2 * count : 2]
    time = begin + step * np.arange(count) if even else numbers[: 2 * count : 2]
    return texts, {"name": name, "unit": unit, "data": values, "time": time, "xunit": x_unit or "s"}


def _axis(line: str) -> tuple[str, str]:
    """Return the name of an axis and its unit."""
    name, unit = line[26:46].strip(), line[47:67].strip()
    kind = _KINDS.get(int(line[:10]), "")
    return kind if name in ("", "NONE") else name, "" if unit == "NONE" else unit


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
            groups = {f"group_{i + 1}": _channels(file, i) for i in range(len(file.groups))}
        check_unpacked(
            source, max((8 * channels[0]["data"].size for channels in groups.values() if channels), default=0)
        )
        tree = {name: {"channels": channels} for name, channels in groups.items() if len(channels) > 1}
        return nested_tables(source, tree, self.title, together=True)


def _channels(file: Any, group: int) -> list[dict[str, Any]]:
    """Return the channels of a group that has samples, the master first."""
    channels, rows = file.groups[group].channels[: MOST_COLUMNS + 1], int(file.groups[group].channel_group.cycles_nr)
    order = sorted(range(len(channels) if rows > 1 else 0), key=lambda i: i != file.masters_db.get(group))
    arrays = {i: Stored((rows,), np.dtype(float), partial(_samples, file, channels[i].name, group, i)) for i in order}
    return [{"name": channels[i].name, "unit": _unit_in_mdf(channels[i]), "data": arrays[i]} for i in order]


def _unit_in_mdf(channel: Any) -> str:
    conversion = getattr(channel, "conversion", None)
    return str(getattr(channel, "unit", "") or getattr(conversion, "unit", "") or "")


def _samples(file: Any, name: str, group: int, index: int) -> np.ndarray:
    signal = file.get(name, group=group, index=index, ignore_invalidation_bits=True)
    samples, invalid = np.asarray(signal.samples), getattr(signal, "invalidation_bits", None)
    if samples.dtype.kind in "iuf" and invalid is not None:
        samples = np.where(np.asarray(invalid, dtype=bool), np.nan, samples)
    return samples if samples.dtype.kind in "iuf" else np.empty(samples.shape[:1], dtype="U1")
