"""From a table of a rig's file to a record: channels in SI, delays taken off, current found."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import ColumnError, printable
from mrdamper.rig_files.column_names import role_of, split_name
from mrdamper.rig_files.columns import Assigned, assign, left_out
from mrdamper.rig_files.profile import Profile, current_in_name
from mrdamper.rig_files.readers import RawTable, RigFileError, suffixes
from mrdamper.rig_files.record import OPTIONAL, Finding, Record
from mrdamper.rig_files.text.spool import rescale
from mrdamper.rig_files.units import parse_unit

_LENIENT = ("acceleration", "voltage", "temperature")  # a damaged cell there costs the channel, not the run


def record_of(table: RawTable, profile: Profile, path: Path) -> Record:
    """The record a table holds, not yet judged.

    Raises
    ------
    RigFileError, ColumnError, UnitError
        If a channel is missing, has no unit, or holds something else than numbers.
    """
    found = assign(table, profile)
    content = table.read([entry.column for name, entry in found.items() if name not in _LENIENT])
    raw = dict(content.values)
    findings = list(content.findings)
    for name in [name for name in found if name in _LENIENT]:
        try:
            raw[found[name].column] = table.read([found[name].column]).values[found[name].column]
        except RigFileError as error:
            code = "W_ENCODING" if error.code == "E_ENCODING" else "W_COLUMN"
            findings.append(Finding(code, f"the {name} channel is left out: {error.found}"))
            del found[name]
    channels = {name: _si(raw[entry.column], entry) for name, entry in found.items()}
    size = next(iter(raw.values())).size
    if "time" not in channels:
        channels["time"] = np.arange(size) / (profile.file.sample_rate_Hz or 1.0)
    channels, lines = _aligned(channels, found, content.lines)
    remarks = _remarks(table, found)
    if "current" not in channels:
        current, whence = _current(table, path, profile)
        if current is not None:
            channels["current"] = _constant(current, channels["time"])
            remarks["current_from"] = whence
    for name, why in left_out(table, profile, found).items():
        if name != "current" or "current" not in channels:
            findings.append(Finding("W_COLUMN", f"the {name} channel is left out: {why}"))
    return Record(
        id=_run_id(table, path), findings=tuple(_unique(findings)), provenance=remarks, rig=profile.rig,
        excitation=profile.excitation, split=profile.split, lines=lines, **channels,  # type: ignore[arg-type]
    )  # fmt: skip


def _si(values: Floats, entry: Assigned) -> Floats:
    return rescale(values, entry.factor, entry.offset)


def _aligned(channels: dict[str, Floats], found: dict[str, Assigned], lines):
    """Take known delays off, by linear interpolation; samples without a partner are left out."""
    delays = {name: entry.delay for name, entry in found.items() if entry.delay and name != "time"}
    if not delays:
        return channels, lines
    time = channels["time"]
    known = np.isfinite(time)
    shifted = {}
    for name, delay in delays.items():
        shifted[name] = np.interp(time + delay, time[known], channels[name][known], left=np.nan, right=np.nan)
    late, early = max(0.0, *delays.values()), min(0.0, *delays.values())
    if not known.any():
        return channels, lines
    keep = np.flatnonzero((time + late <= np.nanmax(time)) & (time + early >= np.nanmin(time)))
    if not keep.size:
        raise ColumnError("the delays of the profile are longer than the record", mend="correct delay_ms")
    inside = slice(int(keep[0]), int(keep[-1]) + 1)
    cut = {name: values[inside] for name, values in {**channels, **shifted}.items()}
    return cut, None if lines is None else lines.part(inside.start, inside.stop)


def _constant(value: float, like: Floats) -> Floats:
    """One number as a channel that takes no memory."""
    return np.broadcast_to(np.float64(value), like.shape)


def _current(table: RawTable, path: Path, profile: Profile) -> tuple[float | None, str]:
    if profile.current is not None and profile.current.value is not None:
        return profile.current.value, "profile"
    if profile.current is None and (held := held_current(table)) is not None:
        return held, "a number in the file"
    found = current_in_name(path.name, profile)
    if found is None and profile.current is None:
        found = current_in_name(table.source.name.removeprefix(f"{path.name}:"), profile)  # of an archive's member
    return found, "file name"


def held_current(table: RawTable) -> float | None:
    """Coil current [A] that a file holds as one number beside its columns, `current_A = 0.5`; None if it does not."""
    held = set()
    for name, value in table.constants.items():
        name, unit = split_name(name)
        known = parse_unit(unit) if unit else None
        if known is not None and known.dimension == "current" and role_of(name) == "current" and np.isfinite(value):
            held.add(known.factor * value)
    return held.pop() if len(held) == 1 else None


def _remarks(table: RawTable, found: dict[str, Assigned]) -> dict[str, str]:
    used = {entry.column for entry in found.values()}
    ignored = [name for i, name in enumerate(table.names) if i not in used and name]
    taken = [f"{role} = {table.names[e.column] or f'column {e.column + 1}'} in {e.unit}" for role, e in found.items()]
    remarks = {"columns": ", ".join(taken)}
    if ignored:
        remarks["ignored_columns"] = ", ".join(ignored[:20]) + (" ..." if len(ignored) > 20 else "")
    return {key: as_data(text) for key, text in remarks.items()}


def as_data(text: str) -> str:
    """Text of a file as a cell that no spreadsheet takes for a formula."""
    text = printable(text)[:1000]
    return f"'{text}" if text.startswith(("=", "+", "-", "@")) else text


def joined(records: list[Record], profile: Profile, tables: list[RawTable]) -> list[Record]:
    """Blocks whose time goes on are one test, unless the profile says otherwise."""
    if len(records) < 2 or profile.file.blocks == "split" or not all(t.label.startswith("block") for t in tables):
        return records
    names = [n for n in ("time", "displacement", "force", *OPTIONAL) if all(getattr(r, n) is not None for r in records)]
    time = np.concatenate([record.time for record in records])
    if profile.file.blocks != "join" and not np.all(np.diff(time[np.isfinite(time)]) > 0):
        return records
    lines = (
        np.concatenate([np.asarray(r.lines) for r in records]) if all(r.lines is not None for r in records) else None
    )
    channels = {name: np.concatenate([getattr(record, name) for record in records]) for name in names}
    findings = _unique(finding for record in records for finding in record.findings)
    return [replace(records[0], findings=tuple(findings), lines=lines, **channels)]


def _unique(findings: Iterable[Finding]) -> list[Finding]:
    return list(dict.fromkeys(findings))


def _run_id(table: RawTable, path: Path) -> str:
    stem = path.name
    while Path(stem).suffix.lower() in suffixes():
        stem = Path(stem).stem
    label = "" if not table.label or table.label.startswith("block") else f"_{table.label}"
    return re.sub(r"[^\w.+=-]+", "_", stem + label).lstrip("_=+-.").rstrip("_.")[:100] or "run"
