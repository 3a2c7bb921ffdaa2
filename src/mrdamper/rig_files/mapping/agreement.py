"""Tests of one set beside each other: equal conditions have equal forces, and other currents other samples."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np

from mrdamper.data import Floats, held_current
from mrdamper.data.arrays import take
from mrdamper.errors import QualityError
from mrdamper.rig_files.quality.view import find_strokes
from mrdamper.rig_files.record import Record

_ALIKE = 0.1  # relative difference of frequency and amplitude within which two motions are one
_ALIKE_A = 0.03  # difference of the current within which two tests have the same [A]
_SEVERAL = 2.0  # ratio of peak-to-peak forces at equal conditions that no repetition explains
_ROUNDING = 1e-3  # of the largest value: two exports of one test differ by less, two tests by more
_ROUNDING_A = 5.5e-3  # [A] so much a current of two decimals differs from one of more
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
    """Group the tests whose force and displacement, or current too, differ by rounding at most, by their places."""
    groups: list[list[int]] = []
    peaks = [float(np.nanmax(np.abs(_sampled(record.force, record.time.size)))) for record in records]
    for i, record in enumerate(records):
        near = (group for group in groups if abs(peaks[group[0]] - peaks[i]) <= _ROUNDING * peaks[i])
        own = next((group for group in near if _same(records[group[0]], record, with_current)), None)
        if own is None:
            groups.append([i])
        else:
            own.append(i)
    return groups


def _same(one: Record, other: Record, with_current: bool) -> bool:
    size = min(one.time.size, other.time.size)  # the last row may be cut off

    def alike(a: Floats, b: Floats, limit: float | None = None) -> bool:
        a, b = _sampled(a, size), _sampled(b, size)
        return np.allclose(a, b, rtol=0, atol=limit or _ROUNDING * np.nanmax(np.abs(a)), equal_nan=True)

    same = max(one.time.size, other.time.size) <= size + 1
    same = same and alike(one.force, other.force) and alike(one.displacement, other.displacement)
    currents = (one.current, other.current) if with_current else ()
    return same and (not currents or alike(*currents, limit=_ROUNDING_A))  # type: ignore[arg-type]


def _sampled(channel: Floats, size: int) -> Floats:
    return take(channel, np.arange(0, size, max(1, size // _MOST_SAMPLES)))


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
    channels = (record.time, record.displacement, record.force, record.current)
    channels = [_sampled(channel, record.time.size) for channel in channels]
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
