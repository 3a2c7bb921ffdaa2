"""Records that go on in time, as one test or one session; a session in one record is cut into its tests."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from mrdamper.data import Floats, held_current
from mrdamper.errors import ColumnError
from mrdamper.physics.motion.strokes import find_strokes, runs_of
from mrdamper.rig_files.coil_current import as_data, constant
from mrdamper.rig_files.column_names import is_called, words
from mrdamper.rig_files.conditions import currents_in, motions_in
from mrdamper.rig_files.profile import Profile
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import OPTIONAL, Finding, Record, part_of_record, unique_names

_NUMBERED = re.compile(r"(?i)(?P<name>.*?)[ _-]*(?:(?:part|teil|partie|parte|seq|buffer)[ _-]*)?(?<![\d.,])(?P<n>\d+)")
_BLOCK_NAME = re.compile(  # Data Acquisition: DAQ_02; no date
    r"[\s#%]*([^\W\d_][^:=\t;]{1,40}?)\s*[:=]\s*\"?(?![0-9]+[:/.-][0-9])([^\t;,\"]*[^\W\d_][^\t;,\"]*)"
)
_BLOCK_NUMBER = re.compile(  # Test no. 4; run 2 of 3
    r"[\s#%]*([^\W\d_][^\d:=\t;]{1,40}?)[\W_]*([0-9]+)(?: *(?:/|of|von|sur|de|di) *[0-9]+)?\W*"
)
_RUN = words("run")
_MOST_STEPS = 3.0  # between the last sample of a file and the first of the next
MOST_TESTS = 500  # of a record: more is a cut at noise
_BLOCK_S = 0.1  # [s] in which a motion at rest stays within a share of its range
_REST = 0.03  # of the motion's range
OFF_S, OFF_STEPS = 1.0, 20  # a gap in time that is longer than both is a rest: the recording was off [s], [steps]
_FEWEST_BLOCKS = 3  # of a rest
_FEWEST_REVERSALS = 3  # of a test
_FEWEST_REVERSALS_HELD = 5  # of a test at a current that steps to the next without a rest
_SETTLED_PERIODS = 0.25  # of the motion: time over whose means a step of the current is looked for
_LEAST_CHANGE_A, _STANDS_OUT = 0.01, 6.0  # of the current's mean from block to block [A]; times the median change
_LEAST_STEP_A, _ABOVE_NOISE = 0.03, 4.0  # between two levels of a current [A]; times their RMS noise
_SETTLED = 0.05  # of a step, within which a level is reached
_LONGEST_TRANSITION = 0.25  # of the shortest level
_ALIKE = 0.1  # relative difference of period and stroke of two tests at one condition
_ALIKE_A = 0.05  # difference of current of two tests at one condition [A]
_LONGEST = 5_000_000  # samples
_Condition = tuple[float, float, float, bool]


def joined(records: list[Record], profile: Profile, tables: list[RawTable]) -> list[Record]:
    """Blocks of a file whose time goes on are one test or one session, unless the profile says otherwise."""
    how = profile.file.blocks
    if len(records) < 2 or how == "split" or not all(t.label.startswith("block") for t in tables):
        return records
    if how == "join":
        return [_concatenated(records)]
    for values_in in (currents_in, lambda line: sorted(motions_in(line[:255], "Hz"))):
        stated = {tuple(value for line in table.remarks for value in values_in(line)) for table in tables} - {()}
        if len(stated) > 1:  # titles of different currents or frequencies: each block is a test
            return records
    chains: list[list[Record]] = []
    for record in records:
        if chains and _gap(chains[-1][-1], record) <= 1.0:
            chains[-1].append(record)
        else:
            chains.append([record])
    return [test for chain in chains for test in (_tests_of(chain) if len(chain) > 1 else chain)]


def names_of_blocks(tables: Sequence[RawTable]) -> tuple[list[str], list[str]]:
    """Return the names of a file's blocks by a word for a test, and by all keys above them that name each otherwise."""
    stated = [dict(filter(None, map(_name_in, table.remarks))) for table in tables]
    counts = {key: len({of.get(key) for of in stated}) for key in stated[0] if all(of.get(key) for of in stated)}
    keys = [key for key, count in counts.items() if count == len(stated) > 1]
    of_run = next((key for key in (*keys, *counts) if counts[key] > 1 and is_called(key, _RUN)), None)
    names = [re.sub(r"[^\w.+=-]+", "_", of[of_run])[:60] for of in stated] if of_run else []
    return unique_names(names), ["; ".join(of[key] for key in keys) for of in stated] if keys else []


def _name_in(line: str) -> tuple[str, str] | None:
    """Return key and value of a line that may name a block, by a number only behind a word for a test."""
    match, number = _BLOCK_NAME.match(line), _BLOCK_NUMBER.fullmatch(line)
    match = number if number and is_called(number[1], _RUN) else match
    return (match[1], match[2].strip()) if match else None


def goes_on(records: Sequence[Record]) -> bool:
    """Tell if the tests of a file are one after the other on one clock, without a gap between them."""
    return all(_continues(one, other) for one, other in pairwise(records))


def follows(last: Path, before: Sequence[Record], path: Path, records: Sequence[Record]) -> bool:
    """Tell if a file is the next part of a record: its number, its current, its clock and its motion go on."""
    one, other = before[-1], records[0]
    return is_next(last, path) and _stated(one) == _stated(other) and _continues(one, other)


def is_next(last: Path, path: Path) -> bool:
    """Tell if a file is called as the next part of a record."""
    old, new = _NUMBERED.fullmatch(last.stem), _NUMBERED.fullmatch(path.stem)
    named = old and new and (last.parent, old["name"]) == (path.parent, new["name"])
    return bool(old and new and named and int(new["n"]) == int(old["n"]) + 1)


def clock_goes_on(time: Floats, other: Floats) -> bool:
    """Tell if a clock [s] begins where another ends."""
    return 0 < _steps_between(time, other) <= _MOST_STEPS


def _continues(one: Record, other: Record) -> bool:
    """Tell if the clock and the motion of a record go on in another, of the same channels."""
    if one.channels.keys() != other.channels.keys() or not clock_goes_on(one.time, other.time):
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
    cut = Finding("W_CUT", f"cut at rests or steps of the current into {len(stretches)} tests")
    return [part_of_record(record, s, f"{record.id}_{n}").noticed(cut) for n, s in enumerate(stretches, 1)]


def _concatenated(records: Sequence[Record]) -> Record:
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
    doubt = next((record.doubt for record in records if record.doubt), None)
    return replace(records[0], findings=tuple(findings), lines=lines, further=further, doubt=doubt, **channels)  # type: ignore[arg-type]


def _steps_between(time: Floats, other: Floats) -> float:
    """Return the time from the last stamp of a clock to the first of another, in steps of the first."""
    time, start = time[np.isfinite(time)], other[np.isfinite(other)][:1]
    step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    return float(start[0] - time[-1]) / step if start.size and step > 0 else 0.0


def _gap(one: Record, other: Record) -> float:
    """Return the time between two blocks as a share of that in which a recorder is off; infinite if time goes back."""
    steps = _steps_between(one.time, other.time)
    seconds = float(np.nanmin(other.time) - np.nanmax(one.time)) if steps > 0 else np.inf
    return min(seconds / OFF_S, steps / OFF_STEPS) if steps > 0 else np.inf


def stretches_of_session(time: Floats, displacement: Floats, current: Floats | None) -> list[slice]:
    """Return the tests of a record that rests between them, with half of each rest; one stretch where it is one test.

    A record is cut only if every part between two rests is a motion of several strokes at a constant
    current, or at currents that step from one to the next, and not all parts are of one condition: a
    pause within a test, the dwell of a trapezoidal motion, and a slow stretch of a random one at one
    current do not separate tests. Time in which nothing was recorded is a rest.

    Raises `ColumnError`: E_BLOCKS if there are more than 500 tests.
    """
    whole = [slice(0, time.size)]
    if not 400 <= time.size <= _LONGEST:  # a longer record lies in a file and is not read as a whole
        return whole
    there = np.isfinite(time) & np.isfinite(displacement)
    current = np.zeros(time.size) if current is None else current
    if not there.all() or np.any(np.diff(time) <= 0):
        return whole
    ends = [0, *_boundaries(time, displacement), time.size]
    parts = [slice(a, b) for a, b in pairwise(ends) if _moves(displacement[a:b], displacement)]
    parts = _with_soft_ends(parts, time, displacement)
    parts = [piece for part in parts for piece in _pieces(part, time, displacement, current)]
    if len(parts) < 2:
        return whole
    motions: list[_Condition] = []
    for part in parts:
        condition = _condition(time[part], displacement[part], current[part])
        if condition is None:
            return whole
        motions.append(condition)
    held = np.ptp([current_A for *_, current_A, _ in motions]) <= _ALIKE_A
    if all(_same(motions[0], other) for other in motions) or (held and not all(regular for *_, regular in motions)):
        return whole
    if len(parts) > MOST_TESTS:
        problem = f"rests cut the record into {len(parts)} tests of several conditions, more than {MOST_TESTS}"
        remedy = 'export it in parts, or set blocks = "join" under [file] of a profile to keep it whole'
        raise ColumnError(problem, remedy=remedy, code="E_BLOCKS")
    return parts


def _with_soft_ends(parts: list[slice], time: Floats, x: Floats) -> list[slice]:
    """Join parts of fewer strokes than a test has with the part they lead to or come from without a gap."""
    joined: list[slice] = []
    short = False
    for part in parts:
        few = find_strokes(time[part], x[part]).reversals.size < _FEWEST_REVERSALS
        near = bool(joined) and joined[-1].stop == part.start and time[part.start] - time[part.start - 1] <= OFF_S
        if near and (short or (few and part is parts[-1])):
            joined[-1], short = slice(joined[-1].start, part.stop), short and few
        else:
            joined.append(part)
            short = few
    return joined


def _pieces(part: slice, time: Floats, displacement: Floats, current: Floats) -> list[slice]:
    """Split a part where the current goes from one level that holds to another while the motion goes on.

    At a level the motion turns back several times: a shorter stretch is a test of the coil's response.
    Transitions and pieces without motion at the ends are omitted; a part whose current changes otherwise is whole.
    """
    t, x, i = time[part], displacement[part], current[part]
    if i.size < 3 or not np.isfinite(i).all() or not held_current(i)[1]:
        return [part]
    strokes = find_strokes(t, x)
    if strokes.period is None:
        return [part]
    levels = _levels(i, round(max(_BLOCK_S, _SETTLED_PERIODS * strokes.period) / float(np.median(np.diff(t)))))
    pieces = [level for level in levels if _moves(x[level], x)]
    turns = [np.count_nonzero((strokes.reversals >= s.start) & (strokes.reversals < s.stop)) for s in pieces]
    if len(levels) < 2 or min(turns, default=0) < _FEWEST_REVERSALS_HELD:
        return [part]
    longest = max(after.start - before.stop for before, after in pairwise(levels))
    if longest > _LONGEST_TRANSITION * min(piece.stop - piece.start for piece in pieces):
        return [part]
    return [slice(part.start + piece.start, part.start + piece.stop) for piece in pieces]


def _levels(current: Floats, size: int) -> list[slice]:
    """Return the stretches between steps of a current, where the means of blocks change more than they usually do."""
    count = current.size // max(1, size)
    if count < 3:
        return []
    blocks = current[: count * size].reshape(count, size)
    changes = np.abs(np.diff(np.mean(blocks, axis=1)))
    steps = runs_of(changes > max(_LEAST_CHANGE_A, _STANDS_OUT * float(np.median(changes))))
    ends = zip([0, *steps[1]], [*(steps[0] + 1), count], strict=True)
    low, middle, high = np.transpose([np.quantile(blocks[a:b], (0.16, 0.5, 0.84)) for a, b in ends])
    levels = [slice(0, current.size)]
    for k, (first, last) in enumerate(zip(*steps, strict=True)):
        step, noise = abs(middle[k + 1] - middle[k]), max(high[k : k + 2] - low[k : k + 2]) / 2
        if step < max(_LEAST_STEP_A, _ABOVE_NOISE * noise):
            continue
        near = max(_SETTLED * step, 3 * noise)
        gap = current[first * size : (last + 1) * size]
        stop = first * size + int(np.argmax(np.abs(gap - middle[k]) > near))
        start = (last + 1) * size - int(np.argmax(np.abs(gap - middle[k + 1])[::-1] > near))
        levels[-1:] = [slice(levels[-1].start, stop), slice(max(start, stop), current.size)]
    return levels


def _boundaries(time: Floats, x: Floats) -> list[int]:
    """Middles of the rests of a motion, and the gaps in its time."""
    steps = np.diff(time)
    step = float(np.median(steps))
    off = np.flatnonzero(steps > max(OFF_S, OFF_STEPS * step)) + 1
    size = max(2, round(_BLOCK_S / step))
    count = x.size // size
    blocks = x[: count * size].reshape(count, size)
    still = np.ptp(blocks, axis=1) < _REST * np.ptp(x)
    rests = [(a, b) for a, b in zip(*runs_of(still), strict=True) if b - a >= _FEWEST_BLOCKS]
    return sorted({*off.tolist(), *(int((a + b) * size // 2) for a, b in rests if a > 0 and b < count)})


def _moves(part: Floats, x: Floats) -> bool:
    return part.size > 0 and float(np.ptp(part)) > 2 * _REST * float(np.ptp(x))


def _condition(time: Floats, x: Floats, current: Floats) -> _Condition | None:
    """Period [s], stroke [m] and current [A] of a part, and if its strokes are regular; None at no constant current."""
    strokes = find_strokes(time, x)
    if strokes.reversals.size < _FEWEST_REVERSALS or strokes.period is None:
        return None
    inside = slice(int(strokes.reversals[0]), int(strokes.reversals[-1]) + 1)
    finite = current[inside][np.isfinite(current[inside])]
    mean, change = held_current(finite) if finite.size >= 3 else (0.0, "no samples")
    return None if change else (strokes.period, float(np.median(strokes.lengths)), mean, strokes.steady is not None)


def _same(one: _Condition, other: _Condition) -> bool:
    near = all(abs(a - b) <= _ALIKE * max(a, b) for a, b in zip(one[:2], other[:2], strict=True))
    return near and abs(one[2] - other[2]) <= _ALIKE_A
