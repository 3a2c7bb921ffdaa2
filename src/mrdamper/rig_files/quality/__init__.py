"""Quality checks of a record in their order: findings are added, or the record is refused.

A check is a function of a `View` that yields findings or raises `QualityError`. The order
matters: a check relies on those before it. A further module of this folder with a function
`check` is run last.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from functools import cache

from mrdamper.discovery import modules_with
from mrdamper.errors import QualityError
from mrdamper.rig_files.quality import (
    converter,
    disturbance,
    flat,
    flattened,
    lag,
    loop,
    motion,
    presence,
    ranges,
    sentinel,
    unsteady,
)
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding, Record

__all__ = ["CHECKS", "QualityError", "View", "check_record"]

Check = Callable[[View], Iterable[Finding] | None]

CHECKS: tuple[Check, ...] = (
    presence.long_enough,
    presence.finite,
    sentinel.missing_value_codes,
    presence.missing,
    presence.order_of_time,
    presence.gaps_in_time,
    motion.moves,
    ranges.exchanged_or_out_of_range,
    sentinel.spikes,
    sentinel.wraps,
    loop.dissipates,
    loop.motion_is_told,
    lag.velocity_channel,
    flat.clipped,
    flat.frozen,
    loop.keeps_its_sign,
    loop.force_follows,
    ranges.unusual,
    motion.enough_cycles,
    motion.is_a_sine,
    motion.drifts,
    ranges.agrees_with_its_name,
    converter.changes_at_every_sample,
    converter.is_not_stored_on_change,
    disturbance.motion_is_one,
    disturbance.force_lines,
    disturbance.force_is_fine,
    converter.no_bit_is_stuck,
    flattened.cut_off_before_noise,
    flattened.rests_at_its_ends,
    converter.lost_or_doubled,
    converter.copied,
    unsteady.stroke_steps,
    unsteady.motion_is_steady,
    unsteady.force_is_steady,
    lag.force_channel,
    disturbance.channels_are_unfiltered,
    loop.repeats,
    motion.changes,
)


@cache
def _dropped_in() -> tuple[Check, ...]:
    return tuple(module.check for _, module in modules_with("mrdamper.checks", "check"))


def check_record(record: Record, without: Collection[Check] = ()) -> Record:
    """Run every check on a record.

    Parameters
    ----------
    record : Record
        As a reader left it: SI units, NaN where a sample is missing.
    without : collection of checks
        That are left out.

    Returns
    -------
    Record
        With the findings of the checks and its segments (sample ranges without a gap in
        time). The channels are not changed.

    Raises `QualityError` if the record cannot be used; the code says why: E_NO_DATA, E_NONFINITE, E_SENTINEL,
    E_MISSING, E_TIME_ORDER, E_TIME_DUPLICATE, E_RANGE, E_NO_EXCITATION, E_SPIKE, E_LEAP, E_NOISE, E_UNRESOLVED,
    E_DISSIPATION_SIGN, E_RECTIFIED, E_NO_ENERGY, E_UNRELATED, E_CHANNEL_LAG, E_DISTURBED, E_SAMPLES_LOST, E_COPIED.
    """
    return checked(View(record), without)


def checked(view: View, without: Collection[Check] = ()) -> Record:
    """Run every check on a view of a record, which goes on to hold what they have analysed; else `check_record`."""
    record = view.record
    for check in (*CHECKS, *_dropped_in()):
        view.found.extend((check(view) if check not in without else None) or ())
    findings = (*record.findings, *view.found)
    return replace(record, findings=findings, segments=view.segments, steady=loop.steady_part(view))
