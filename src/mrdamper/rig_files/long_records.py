"""Judging a record that does not fit into memory: part by part, by the checks every record passes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from mrdamper.data.arrays import drop_pages
from mrdamper.errors import InputError
from mrdamper.rig_files.quality.motion import change_of
from mrdamper.rig_files.record import Finding, Record, part_of_record

PART = 2**19  # samples: a minute of a test at 10 kHz, some megabytes a channel
_AT_ONCE = 2  # parts: their checks are sums and sorts of long arrays, which need no turn of the interpreter
_MAY_REST = ("E_NO_EXCITATION",)  # a long test may pause; it may not be one long pause
_OF_THE_WHOLE = ("W_SHORT", "W_DRIFT")
_ONCE = ("W_CURRENT_VARIES",)  # judged over the whole record: parts may each hold another current

_Verdict = tuple[tuple[Finding, ...], tuple[tuple[int, int], ...], InputError | None]


def check_long_record(record: Record, check: Callable[[Record], Record]) -> Record:
    """Judge a record, whose channels may be memory-mapped, part by part; one of a few parts' length as one.

    Raises as `check`; that nothing moves, only if nothing moves in any part.
    """
    if record.time.size <= 2 * PART:
        return check(record)
    finding_of: dict[str, tuple[Finding, int]] = {}
    segments: list[tuple[int, int]] = []
    moving, resting, count = 0, None, 0
    for start, (noticed, ranges, error) in _checked_parts(record, check):
        count += 1
        moving += error is None
        resting = resting or error
        for finding in noticed:
            first, times = finding_of.get(finding.code, (finding, 0))
            finding_of[finding.code] = first, times + 1
        _extend(segments, ranges, start)
    if resting is not None and not moving:
        raise resting
    findings = (*record.findings, *_summed(finding_of, count, moving), *change_of(record, None))
    return replace(record, findings=findings, segments=tuple(segments))


def _checked_parts(record: Record, check: Callable[[Record], Record]) -> Iterator[tuple[int, _Verdict]]:
    """Start of every part and what came of it, in order, two judged at once."""

    def one(part: Record) -> _Verdict:
        try:
            with np.errstate(all="ignore"):  # each thread has its own
                checked = check(part)
            return checked.findings, checked.segments, None
        except InputError as error:
            if error.code not in _MAY_REST:
                raise
            return (), ((0, part.time.size),), error

    waiting: deque[tuple[int, Future[_Verdict]]] = deque()
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        for start, part in _parts(record):
            waiting.append((start, pool.submit(one, part)))
            if len(waiting) >= _AT_ONCE:
                at, done = waiting.popleft()
                yield at, done.result()
        for at, done in waiting:
            yield at, done.result()


def _parts(record: Record) -> Iterator[tuple[int, Record]]:
    """Parts that share one sample, so that steps of time between them are seen."""
    for at in range(0, record.time.size - 1, PART):
        part = part_of_record(record, slice(at, min(at + PART, record.time.size - 1) + 1))
        channels = {name: np.array(values) for name, values in part.channels.items()}
        for values in record.channels.values():
            drop_pages(values)
        yield at, replace(part, findings=(), segments=(), **channels)


def _extend(segments: list[tuple[int, int]], new: tuple[tuple[int, int], ...], start: int) -> None:
    for a, b in new:
        if segments and segments[-1][1] == start + a + 1:
            segments[-1] = segments[-1][0], start + b
        else:
            segments.append((start + a, start + b))


def _summed(findings: dict[str, tuple[Finding, int]], parts: int, moving: int) -> Iterator[Finding]:
    for finding, times in findings.values():
        if finding.code in _ONCE or (finding.code in _OF_THE_WHOLE and times < moving):
            continue
        more = f" (first of {times} parts out of {parts})" if times > 1 else ""
        yield Finding(finding.code, finding.text + more)
