"""Comparison of the tests of several files: contradictions, copies, and forces that grow with currents."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from itertools import chain, combinations

import numpy as np

from mrdamper.data import Floats, held_current
from mrdamper.data.arrays import take
from mrdamper.errors import QualityError
from mrdamper.physics.motion.strokes import find_strokes
from mrdamper.rig_files.coil_current import with_stated_current
from mrdamper.rig_files.column_names import COMPUTED, TABLES, words, words_of
from mrdamper.rig_files.profile import toml
from mrdamper.rig_files.quality.motion import stated_motion
from mrdamper.rig_files.record import Finding, Record

_ALIKE = 0.1  # relative difference of frequency and amplitude within which two motions are one
_ALIKE_A = 0.03  # difference of the current within which two tests have the same [A]
_FEWEST_AGREEING = 3  # tests of the amplitude that they state, for every test of another one
_SEVERAL = 2.0  # ratio of peak-to-peak forces at equal conditions that no repetition explains
_UNITS = {unit: TABLES["units"]["force"][unit] for unit in ("lbf", "kgf", "kN")}
_OF_VERSIONS = COMPUTED | words("raw") | words("processed")
_ROUNDING = 1e-3  # of the largest value: two exports of one test differ by less, two tests by more
_ROUNDING_A = 5.5e-3  # [A] so much a current of two decimals differs from one of more
MOST_SAMPLES = 20_000
_Point = tuple[float, float, float, float]


def forces_grow(stated: Sequence[tuple[Record, float]], *, repeated: bool = False) -> bool:
    """Tell if the forces of tests alike in motion grow as the currents [A] that are stated of them.

    All have to be alike, or where currents may be repeated, two of different currents.
    """
    points = [_point(with_stated_current(record, current, "", "")) for record, current in stated]
    rising = sorted((point for point in points if point), key=lambda point: point[2])
    pairs = list(combinations(rising, 2))
    alike = [(one, other) for one, other in pairs if _are_near(one, other) and other[2] - one[2] > repeated * _ALIKE_A]
    enough = bool(alike) if repeated else len(alike) == len(pairs)
    return len(rising) == len(points) and enough and all(one[3] < other[3] for one, other in alike)


def contradictions(records: Sequence[Record]) -> dict[int, QualityError]:
    """Return the tests that contradict each other, by their place, and the refusal of each.

    Equal conditions whose forces differ several-fold; the same samples under several currents; and raw and processed
    samples of one test.
    """
    points = {i: point for i, record in enumerate(records) if (point := _point(record)) is not None}
    refused = _copies(records, points)
    groups: dict[tuple[str, int], list[int]] = defaultdict(list)
    for i, point in points.items():
        groups[_owner(records[i]), round(point[2] / _ALIKE_A / 2)].append(i)
    for i, j in chain.from_iterable(combinations(members, 2) for members in groups.values()):
        (*_, current, force), (*_, other_current, other_force) = points[i], points[j]
        near = abs(current - other_current) <= _ALIKE_A and _are_near(points[i], points[j])
        if near and max(force, other_force) > _SEVERAL * min(force, other_force):
            refused.setdefault(i, _refusal(records[i], points[i], records[j], points[j]))
            refused.setdefault(j, _refusal(records[j], points[j], records[i], points[i]))
        elif near and _are_versions(records[i], records[j]):
            refused.setdefault(i, _refusal_of_version(records[i], records[j]))
            refused.setdefault(j, _refusal_of_version(records[j], records[i]))
    return refused


def stated_as_amplitudes(records: Sequence[Record]) -> dict[int, Finding]:
    """Return, by their place, tests of another amplitude than their name states, where most have the one of theirs.

    Half of it is compared with all tests, which may state strokes; any other with those of the same frequency.
    """
    stated = {i: length for i, record in enumerate(records) if (length := stated_motion(record, "mm")) is not None}
    points = {i: point for i in stated if (point := _point(records[i])) is not None}
    ratios = {i: 1e3 * point[1] / stated[i] for i, point in points.items()}
    named = {i for i, record in enumerate(records) if any(finding.code == "W_NAME" for finding in record.findings)}
    findings = dict[int, Finding]()
    for i in [i for i, ratio in ratios.items() if abs(ratio - 1) > 2 * _ALIKE and i not in named]:
        half = abs(2 * ratios[i] - 1) < _ALIKE
        beside = [r for j, r in ratios.items() if half or abs(points[j][0] - points[i][0]) <= _ALIKE * points[i][0]]
        agreeing, odd = (sum((abs(r - 1) < _ALIKE) == same for r in beside) for same in (True, False))
        if agreeing >= _FEWEST_AGREEING * odd:
            size = f"{stated[i]:g} mm and the record has an amplitude of {1e3 * points[i][1]:.3g} mm"
            rest = f"where {agreeing} other tests have what theirs state: check the unit of displacement, or the name"
            findings[i] = Finding("W_NAME", f"the name or heading states {size}, {rest}")
    return findings


def in_another_unit(records: Sequence[Record]) -> dict[int, Finding]:
    """Return, by their place, tests whose force is between those at lower and higher currents in another unit only."""
    points, findings = {i: of for i, record in enumerate(records) if (of := _point(record))}, dict[int, Finding]()
    for i, one in points.items():
        same = [of for j, of in points.items() if _are_near(one, of) and _owner(records[j]) == _owner(records[i])]
        low = max((of[3] for of in same if of[2] < one[2] - _ALIKE_A), default=0.0)
        high = min((of[3] for of in same if of[2] > one[2] + _ALIKE_A), default=0.0)
        fits = [(k, u) for u, factor in _UNITS.items() for k in (factor, 1 / factor) if low < k * one[3] < high]
        if len(fits) == 1 and low > 0 and not low / _SEVERAL < one[3] < _SEVERAL * high:
            factor, unit = fits[0]
            text = (
                f"its force of {one[3]:.4g} N from peak to peak fits those at lower and higher currents ({low:.4g} and "
                f"{high:.4g} N) times {factor:.4g} only, as of {unit}: state its unit in a profile of this file"
            )
            findings[i] = Finding("W_UNITS", text)
    return findings


def _owner(record: Record) -> str:
    return " ".join((record.rig, *(record.provenance.get(key, "") for key in ("specimen", "session"))))


def _copies(records: Sequence[Record], points: Mapping[int, _Point]) -> dict[int, QualityError]:
    """Return the tests that hold the samples of another test and have another current than it."""
    refused: dict[int, QualityError] = {}
    for members in _of_same_samples(records):
        currents = {i: points[i][2] for i in members if i in points}
        for i, current in currents.items():
            others = [records[j].id for j, its in currents.items() if abs(its - current) > _ALIKE_A]
            if not others:
                continue
            problem = f"has the same samples as {others[0]} and another current: {current:.3g} A"
            where = records[i].provenance.get("file", records[i].id)
            remedy = "one of them is a copy under a wrong name: leave it out, or export the test again"
            refused[i] = QualityError(problem, where=where, remedy=remedy, code="E_CONDITIONS")
    return refused


def repeated(records: Sequence[Record]) -> set[int]:
    """Return the tests that hold the samples, the current too, of one of a shorter name or before them: by place."""
    groups = _of_same_samples(records, with_current=True)
    return {i for group in groups for i in sorted(group, key=lambda i: len(records[i].id))[1:]}


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


def _are_versions(one: Record, other: Record) -> bool:
    """Tell if the names of two tests differ by words such as raw and processed only."""
    bare, others = ([w for w in words_of(r.id) if w.casefold() not in _OF_VERSIONS] for r in (one, other))
    return bare == others and words_of(one.id) != words_of(other.id)


def _refusal_of_version(record: Record, other: Record) -> QualityError:
    problem = f"has the condition of {other.id}, and by their names they are versions of one test"
    own = words_of(record.id)
    pattern = next((f"*{word}*" for word in words_of(other.id) if word not in own), other.id)
    remedy = f"keep one: [file] leave_out = {toml([pattern])} in a profile omits the other"
    where = record.provenance.get("file", record.id)
    return QualityError(problem, where=where, remedy=remedy, code="E_CONDITIONS")


def _sampled(channel: Floats, size: int) -> Floats:
    return take(channel, np.arange(0, size, max(1, size // MOST_SAMPLES)))


def _are_near(one: _Point, other: _Point) -> bool:
    return all(abs(a - b) <= _ALIKE * max(a, b) for a, b in zip(one[:2], other[:2], strict=True))


def _refusal(record: Record, one: _Point, beside: Record, other: _Point) -> QualityError:
    whence = record.provenance.get("current_from", "its channel")
    return QualityError(
        f"at {one[2]:.3g} A (from {whence}), {one[0]:.3g} Hz and {1e3 * one[1]:.3g} mm its force is {one[3]:.4g} N "
        f"from peak to peak, that of {beside.id} at the same condition {other[3]:.4g} N",
        where=record.provenance.get("file", record.id),
        remedy="one of them has another current or another unit of force: state the current of each in tests.csv "
        "(where a name or heading states a wrong one, correct that), their specimens if they differ, or leave one out",
        code="E_CONDITIONS",
    )


def _point(record: Record) -> _Point | None:
    """Frequency [Hz], amplitude [m], current [A] and peak-to-peak force [N] of a record; None without a period."""
    if record.current is None:
        return None
    there = np.arange(0, record.time.size, max(1, record.time.size // MOST_SAMPLES))
    there = there[record.present[there]]
    time, x, force, current = (take(c, there) for c in (record.time, record.displacement, record.force, record.current))
    if time.size < 20:
        return None
    strokes = find_strokes(time, x)
    mean, change = held_current(current)
    if strokes.period is None or strokes.steady is None or change:
        return None
    inside = slice(*strokes.steady)
    low, high = np.percentile(force[inside], [2, 98])
    return 1 / strokes.period, float(np.ptp(x[inside])) / 2, abs(mean), float(high - low)
