"""Quality checks of a record in their order: findings are added, or the record is refused.

A check is a function of a `View` that yields findings or raises `QualityError`. The order
matters: a check relies on those before it. A further module of this folder with a function
`check` is run last. A record that does not fit into memory is checked part by part.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from itertools import islice

import numpy as np

from mrdamper.data.arrays import drop_pages
from mrdamper.discovery import ExtensionPart, modules_with, skip
from mrdamper.errors import InputError, shown
from mrdamper.rig_files.quality import disturbance, flat, lag, loop, motion, samples, sentinel, unsteady
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding, Record, part_of_record

Check = Callable[[View], Iterable[Finding] | None]
PART = 2**19  # samples: a minute of a test at 10 kHz, some megabytes a channel
_AT_ONCE = 2  # parts: their checks are sums and sorts of long arrays, which need no turn of the interpreter
_MAY_REST = ("E_NO_EXCITATION",)  # a long test may pause; it may not be one long pause
_OF_THE_WHOLE = ("W_SHORT", "W_DRIFT")
_ONCE = ("W_CURRENT_VARIES",)  # checked over the whole record: parts may each hold another current
CHECKS: tuple[Check, ...] = (
    samples.long_enough,
    samples.finite,
    sentinel.missing_value_codes,
    samples.missing,
    samples.order_of_time,
    samples.gaps_in_time,
    motion.moves,
    motion.exchanged_or_out_of_range,
    sentinel.spikes,
    sentinel.wraps,
    loop.dissipates,
    loop.motion_is_told,
    lag.velocity_channel,
    flat.clipped,
    flat.frozen,
    loop.keeps_its_sign,
    loop.force_follows,
    motion.unusual,
    motion.is_a_sine,
    motion.drifts,
    motion.agrees_with_its_name,
    samples.changes_at_every_sample,
    samples.is_not_stored_on_change,
    disturbance.motion_is_one,
    disturbance.force_lines,
    disturbance.force_is_fine,
    samples.no_bit_is_stuck,
    flat.cut_off_before_noise,
    flat.rests_at_its_ends,
    samples.lost_or_doubled,
    samples.copied,
    unsteady.stroke_steps,
    unsteady.cycles_are_steady,
    lag.force_channel,
    disturbance.channels_are_unfiltered,
    loop.repeats,
    motion.changes,
)
_OF_A_FORCE = (  # what a force does that stands still is no finding
    disturbance.force_lines,
    disturbance.force_is_fine,
    unsteady.cycles_are_steady,
    lag.force_channel,
    loop.repeats,
)


@cache
def _dropped_in() -> tuple[Check, ...]:
    checks = modules_with("mrdamper.checks", "check")
    return tuple(module.check if part.own else _skipped_if_raising(part, module.check) for part, module in checks)


def _skipped_if_raising(part: ExtensionPart, check: Check) -> Check:
    """Return the check of an outside package, which is left aside once it raises something but a refusal."""
    raising = False

    def run(view: View) -> list[Finding]:
        nonlocal raising
        try:
            findings = [] if raising else list(check(view) or ())
            if odd := next((one for one in findings if not isinstance(one, Finding)), None):
                raise TypeError(f"check gives {shown(odd)}, which is no Finding")
        except InputError:
            raise
        except Exception as error:  # whatever the code of a package raises
            raising, findings = True, []
            skip(part, error)
        return findings

    return run


def check_record(record: Record, without: Collection[Check] = ()) -> Record:
    """Run every check but some on a record as a reader left it: SI units, NaN where a sample is missing.

    Returns it with the findings of the checks and its segments (sample ranges without a gap in time).

    Raises `QualityError` if the record cannot be used; the code says why: E_NO_DATA, E_NONFINITE, E_SENTINEL,
    E_MISSING, E_TIME_ORDER, E_TIME_DUPLICATE, E_RANGE, E_NO_EXCITATION, E_SPIKE, E_LEAP, E_NOISE, E_UNRESOLVED,
    E_DISSIPATION_SIGN, E_RECTIFIED, E_NO_ENERGY, E_UNRELATED, E_CHANNEL_LAG, E_DISTURBED, E_SAMPLES_LOST, E_COPIED.
    """
    return checked(View(record), without)


def checked(view: View, without: Collection[Check] = ()) -> Record:
    """Run every check on a view of a record, which goes on to hold what they have analysed; else `check_record`."""
    record = view.record
    for check in (*CHECKS, *_dropped_in()):
        if check not in without and not (check in _OF_A_FORCE and flat.force_stops(view)):
            view.found.extend(check(view) or ())
    findings = (*record.findings, *view.found)
    return replace(record, findings=findings, segments=view.segments, steady=loop.steady_part(view))


def check_long_record(record: Record) -> Record:
    """Check a record, whose channels may be memory-mapped, in parts; one of a few parts' length as a whole.

    Raises as `check_record`; that nothing moves, only if nothing moves in any part.
    """
    if record.time.size <= 2 * PART:
        return check_record(record)
    by_code: dict[str, list[Finding]] = {}
    segments: list[tuple[int, int]] = []
    resting: list[InputError | None] = []
    for start, part, error in _checked_parts(record):
        resting.append(error)
        for finding in part.findings:
            by_code.setdefault(finding.code, []).append(finding)
        for begin, end in part.segments or ((0, part.time.size),):
            goes_on = segments and segments[-1][1] == start + begin + 1
            first = segments.pop()[0] if goes_on else start + begin
            segments.append((first, start + end))
    if all(resting) and resting[0] is not None:
        raise resting[0]
    findings = (*record.findings, *_summed(by_code, len(resting), resting.count(None)), *motion.change_of(record, None))
    return replace(record, findings=findings, segments=tuple(segments))


def _checked_parts(record: Record) -> Iterator[tuple[int, Record, InputError | None]]:
    """Start of every part, the part and why it rests, if it does, in order, two checked at once."""

    def one(place: tuple[int, Record]) -> tuple[int, Record, InputError | None]:
        try:
            with np.errstate(all="ignore"):  # each thread has its own
                return place[0], check_record(place[1]), None
        except InputError as error:
            if error.code not in _MAY_REST:
                raise
            return *place, error

    parts = _parts(record)
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        while together := list(islice(parts, _AT_ONCE)):
            yield from pool.map(one, together)


def _parts(record: Record) -> Iterator[tuple[int, Record]]:
    """Parts that share one sample, so that steps of time between them are seen."""
    for at in range(0, record.time.size - 1, PART):
        part = part_of_record(record, slice(at, min(at + PART, record.time.size - 1) + 1))
        channels = {name: np.array(values) for name, values in part.channels.items()}
        for values in record.channels.values():
            drop_pages(values)
        yield at, replace(part, findings=(), segments=(), **channels)


def _summed(by_code: dict[str, list[Finding]], parts: int, moving: int) -> Iterator[Finding]:
    """Yield the first finding of every code, with the number of parts that have it, some only if all parts have it."""
    for code, findings in by_code.items():
        times = len(findings)
        if code not in _ONCE and (code not in _OF_THE_WHOLE or times >= moving):
            more = f" (first of {times} parts out of {parts})" if times > 1 else ""
            yield Finding(code, findings[0].text + more)
