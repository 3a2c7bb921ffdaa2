"""Tests of one set beside each other: equal conditions have equal forces, and other currents other samples."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np

from mrdamper.data import held_current
from mrdamper.data.arrays import take
from mrdamper.errors import QualityError
from mrdamper.rig_files.quality.strokes import find_strokes
from mrdamper.rig_files.record import Record

_ALIKE = 0.1  # relative difference of frequency and amplitude within which two motions are one
_ALIKE_A = 0.03  # difference of the current within which two tests have the same [A]
_SEVERAL = 2.0  # ratio of peak-to-peak forces at equal conditions that no repetition explains
_MOST_SAMPLES = 20_000

_Point = tuple[float, float, float, float]


def contradictions(records: Sequence[Record]) -> dict[int, QualityError]:
    """Return the tests that contradict each other, by their place, and the refusal of each.

    Equal conditions whose forces differ several-fold; and the same samples under several currents.
    """
    points = {i: point for i, record in enumerate(records) if (point := _point(record)) is not None}
    refused = _copies(records, points)
    groups: dict[tuple[str, int], list[int]] = defaultdict(list)
    for i, point in points.items():
        notes = records[i].provenance
        owner = " ".join((records[i].rig, notes.get("specimen", ""), notes.get("session", "")))
        groups[owner, round(point[2] / _ALIKE_A / 2)].append(i)
    for members in groups.values():
        for i in members:
            for j in members:
                if i < j and _contradict(points[i], points[j]):
                    refused.setdefault(i, _refusal(records[i], points[i], records[j], points[j]))
                    refused.setdefault(j, _refusal(records[j], points[j], records[i], points[i]))
    return refused


def _copies(records: Sequence[Record], points: Mapping[int, _Point]) -> dict[int, QualityError]:
    """Return the tests that hold the samples of another test and have another current than it."""
    refused: dict[int, QualityError] = {}
    for members in _of_same_samples(records):
        currents = {i: points[i][2] for i in members if i in points}
        for i, current in currents.items():
            others = [records[j].id for j, its in currents.items() if abs(its - current) > _ALIKE_A]
            if not others:
                continue
            refused[i] = QualityError(
                f"has the same samples as {others[0]} and another current: {current:.3g} A",
                where=records[i].provenance.get("file", records[i].id),
                remedy="one of them is a copy under a wrong name: leave it out, or export the test again",
                code="E_CONDITIONS",
            )
    return refused


def repeated(records: Sequence[Record]) -> set[int]:
    """Return the tests that hold the samples, the current too, of one before them: by their place."""
    return {i for members in _of_same_samples(records, with_current=True) for i in members[1:]}


def _of_same_samples(records: Sequence[Record], *, with_current: bool = False) -> list[list[int]]:
    """Group the tests of equal force and displacement, by their places."""
    groups: dict[tuple[int | bytes, ...], list[int]] = defaultdict(list)
    for i, record in enumerate(records):
        samples = np.arange(0, record.time.size, max(1, record.time.size // _MOST_SAMPLES))
        channels = [record.force, record.displacement, record.current if with_current else None]
        same = (take(channel, samples).tobytes() for channel in channels if channel is not None)
        groups[record.time.size, *same].append(i)
    return list(groups.values())


def _contradict(one: _Point, other: _Point) -> bool:
    near = abs(one[2] - other[2]) <= _ALIKE_A and all(
        abs(a - b) <= _ALIKE * max(a, b) for a, b in zip(one[:2], other[:2], strict=True)
    )
    return near and max(one[3], other[3]) > _SEVERAL * min(one[3], other[3])


def _refusal(record: Record, one: _Point, beside: Record, other: _Point) -> QualityError:
    whence = record.provenance.get("current_from", "its channel")
    return QualityError(
        f"at {one[2]:.3g} A (from {whence}), {one[0]:.3g} Hz and {1e3 * one[1]:.3g} mm its force is {one[3]:.4g} N "
        f"from peak to peak, that of {beside.id} at the same condition {other[3]:.4g} N",
        where=record.provenance.get("file", record.id),
        remedy="one of them has another current or another unit of force: state the current of each in tests.csv "
        "(where a name or heading states a wrong one, correct that), or leave one out",
        code="E_CONDITIONS",
    )


def _point(record: Record) -> _Point | None:
    """Frequency [Hz], amplitude [m], current [A] and peak-to-peak force [N] of a record; None without a period."""
    if record.current is None:
        return None
    samples = np.arange(0, record.time.size, max(1, record.time.size // _MOST_SAMPLES))
    channels = [take(c, samples) for c in (record.time, record.displacement, record.force, record.current)]
    there = np.all([np.isfinite(c) for c in channels], axis=0)
    time, x, force, current = (c[there] for c in channels)
    if time.size < 20:
        return None
    strokes = find_strokes(time, x)
    mean, change = held_current(current)
    if strokes.period is None or strokes.steady is None or change:
        return None
    inside = slice(*strokes.steady)
    low, high = np.percentile(force[inside], [2, 98])
    return 1 / strokes.period, float(np.ptp(x[inside])) / 2, abs(mean), float(high - low)
