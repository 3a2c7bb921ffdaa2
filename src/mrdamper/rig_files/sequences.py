"""Records that go on in time: pages of one file and files that a logger began anew are one test, or one session."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.coil_current import as_data, constant
from mrdamper.rig_files.conditions import currents_in
from mrdamper.rig_files.mapping.session import OFF_S, OFF_STEPS, stretches_of_session
from mrdamper.rig_files.profile import Profile
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import OPTIONAL, Finding, Record, part_of_record

_HZ = re.compile(r"(?<![\w.,])([0-9]{1,4}(?:[.,][0-9]{1,4})?) ?Hz(?![A-Za-z])")
_NUMBERED = re.compile(
    r"(?i)(?P<name>.*?)[ _-]*(?:(?:part|teil|partie|parte|seq|buffer)[ _-]*)?(?<![0-9.,])(?P<n>[0-9]+)"
)
_MOST_STEPS = 3.0  # between the last sample of a file and the first of the next


def joined(records: list[Record], profile: Profile, tables: list[RawTable]) -> list[Record]:
    """Blocks of a file whose time goes on are one test or one session, unless the profile says otherwise."""
    how = profile.file.blocks
    if len(records) < 2 or how == "split" or not all(t.label.startswith("block") for t in tables):
        return records
    if how == "join":
        return [_concatenated(records)]
    if _state_different_conditions(tables):
        return records
    chains: list[list[Record]] = []
    for record in records:
        if chains and _gap(chains[-1][-1], record) <= 1.0:
            chains[-1].append(record)
        else:
            chains.append([record])
    return [test for chain in chains for test in (_tests_of(chain) if len(chain) > 1 else chain)]


def goes_on(records: Sequence[Record]) -> bool:
    """Tell if the tests of a file are one after the other on one clock, without a gap between them."""
    return all(_continues(one, other) for one, other in pairwise(records))


def follows(last: Path, before: Sequence[Record], path: Path, records: Sequence[Record]) -> bool:
    """Tell if a file is the next part of a record: its number, its current, its clock and its motion go on."""
    one, other = before[-1], records[0]
    old, new = _NUMBERED.fullmatch(last.stem), _NUMBERED.fullmatch(path.stem)
    if not old or not new or last.parent != path.parent or int(new["n"]) != int(old["n"]) + 1:
        return False
    return old["name"] == new["name"] and _stated(one) == _stated(other) and _continues(one, other)


def _continues(one: Record, other: Record) -> bool:
    """Tell if the clock and the motion of a record go on in another, of the same channels."""
    if one.channels.keys() != other.channels.keys() or not 0 < _steps_between(one, other) <= _MOST_STEPS:
        return False
    leap = abs(other.displacement[0] - one.displacement[-1])
    return bool(leap <= 2 * _MOST_STEPS * max(np.nanmax(np.abs(np.diff(r.displacement))) for r in (one, other)))


def _stated(record: Record) -> float | None:
    """Return the current [A] that a name or heading gives a record; None where it has a channel, or none."""
    return float(record.current[0]) if record.current is not None and "current_from" in record.provenance else None


def tests_of_files(parts: Sequence[tuple[Path, Sequence[Record]]]) -> list[Record]:
    """Return the tests of files that are parts of one record, under the name that the parts have in common."""
    first, last = parts[0][0], parts[-1][0]
    name = _NUMBERED.fullmatch(first.stem)
    stem = re.sub(r"[^\w.+=-]+", "_", name["name"] if name and name["name"] else first.stem)
    note = Finding("W_PARTS", f"joined from {len(parts)} files whose time goes on: {first.name} to {last.name}")
    pieces = [replace(r, findings=tuple(f for f in r.findings if f.code != "W_CUT")) for _, of in parts for r in of]
    files = {"files": as_data(", ".join(path.name for path, _ in parts))}
    beginning = replace(pieces[0], id=stem, provenance={**pieces[0].provenance, **files}, lines=None)
    return _tests_of([beginning.noticed(note), *pieces[1:]])


def _tests_of(records: Sequence[Record]) -> list[Record]:
    """Return the tests of records that are one after the other, cut at rests and steps of the current as a session."""
    record = _concatenated(records)
    stretches = stretches_of_session(record.time, record.displacement, record.current)
    if len(stretches) == 1:
        return [record]
    text = f"cut at rests or steps of the current into {len(stretches)} tests"
    return [
        part_of_record(record, s, f"{record.id}_{n}").noticed(Finding("W_CUT", text))
        for n, s in enumerate(stretches, 1)
    ]


def _concatenated(records: Sequence[Record]) -> Record:
    """Return one record of several, with the channels that all of them have."""
    names = [n for n in ("time", "displacement", "force", *OPTIONAL) if all(getattr(r, n) is not None for r in records)]
    channels: dict[str, Floats | None] = dict.fromkeys(OPTIONAL)
    channels |= {name: np.concatenate([getattr(record, name) for record in records]) for name in names}
    numbers = [record.lines for record in records if record.lines is not None]
    lines = np.concatenate(numbers) if len(numbers) == len(records) else None
    if channels["current"] is None and "current_from" in records[0].provenance:  # a page's heading states it once
        stated = {float(r.current[0]) for r in records if r.current is not None}
        channels["current"] = constant(stated.pop(), channels["time"]) if len(stated) == 1 else None  # type: ignore[arg-type]
    alike = [name for name in records[0].further if all(name in record.further for record in records)]
    further = {name: np.concatenate([record.further[name] for record in records]) for name in alike}
    findings = dict.fromkeys(finding for record in records for finding in record.findings)
    return replace(records[0], findings=tuple(findings), lines=lines, further=further, **channels)  # type: ignore[arg-type]


def _steps_between(one: Record, other: Record) -> float:
    """Return the time from the last sample of a record to the first of another, in steps of the first."""
    time = one.time[np.isfinite(one.time)]
    start = other.time[np.isfinite(other.time)][:1]
    step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    return float(start[0] - time[-1]) / step if start.size and step > 0 else 0.0


def _gap(one: Record, other: Record) -> float:
    """Return the time between two blocks as a share of that in which a recorder is off; infinite if time goes back."""
    steps = _steps_between(one, other)
    seconds = float(np.nanmin(other.time) - np.nanmax(one.time)) if steps > 0 else np.inf
    return min(seconds / OFF_S, steps / OFF_STEPS) if steps > 0 else np.inf


def _state_different_conditions(tables: list[RawTable]) -> bool:
    """Return whether the titles of blocks state different currents or frequencies: each is a test."""
    for values_in in (currents_in, lambda line: tuple(_HZ.findall(line[:255]))):
        stated = {tuple(value for line in table.remarks for value in values_in(line)) for table in tables} - {()}
        if len(stated) > 1:
            return True
    return False
