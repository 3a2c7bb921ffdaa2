"""First test matrix of a damper without tests, with a reason for every row."""

from __future__ import annotations

import math

from mrdamper.data import Condition
from mrdamper.study.limits import Limits, set_value
from mrdamper.study.proposal import Proposal

_SESSIONS = 2  # whose repeats show how much they differ


def first_matrix(limits: Limits, hours: float) -> list[Proposal]:
    """Return a first test matrix, the most informative rows first.

    Raises `InputError` (E_LIMITS) if the hours hold no record, or nothing is allowed.
    """
    limits.candidates(hours)
    (i_low, i_high), (f_low, f_high), (a_low, a_high) = limits.current_A, limits.frequency_Hz, limits.amplitude_mm
    f_mid, a_mid = set_value(math.sqrt(f_low * f_high)), set_value(math.sqrt(a_low * a_high))
    i_quarter, i_mid = (set_value(i_low + share * (i_high - i_low)) for share in (0.25, 0.5))
    wanted = [
        (i_low, f_mid, a_mid, "passive: viscous damping, friction and gas without the field"),
        (i_high, f_mid, a_mid, "full field at the same motion: the range of the yield force"),
        (i_low, f_low, a_mid, "slow and passive: offset, gas spring and friction, hardly any viscous force"),
        (i_high, f_high, a_low, "short strokes, full field: free play and stiffness before yield"),
        (i_mid, f_mid, a_mid, "half the field: whether the yield force saturates"),
        (i_low, f_high, a_mid, "fast and passive: viscous damping and whether it thins"),
        (i_high, f_low, a_high, "long and slow, full field: the plateau of the yield force"),
        (i_high, f_high, a_mid, "fast, full field: damping that grows with current, and lag"),
        (i_quarter, f_mid, a_mid, "a quarter of the field: where the yield force begins"),
        (i_mid, f_low, a_low, "slow and short: rate dependence before yield, separated from amplitude"),
        (i_mid, f_high, a_low, "fast and short at half the field: frequency and amplitude apart"),
    ]
    repeat = (i_high, f_mid, a_mid, "a repeat in another session: how much sessions differ")

    def proposed(row: tuple[float, float, float, str], session: int) -> Proposal | None:
        current, frequency, amplitude, reason = row
        top = limits.velocity_m_s / (2 * math.pi * amplitude * 1e-3)
        if top < f_low:
            return None  # no frequency of the rig is slow enough for this stroke
        below = set_value(top) if set_value(top) <= top else set_value(0.98 * top)
        condition = Condition(current, min(frequency, max(below, f_low)), amplitude * 1e-3)
        return Proposal(session, condition, limits.minutes(condition), reason)

    tests, left = list[Proposal](), hours * 60 - limits.opening
    again = proposed(repeat, _SESSIONS) if limits.sessions >= _SESSIONS else None
    reserved = limits.opening + again.minutes if again else 0.0
    first = proposed(wanted[1], 1)
    if again is None or first is None or left < reserved + 2 * first.minutes:
        again, reserved = None, 0.0  # a repeat takes time of the first rows
    left -= reserved
    for item in filter(None, (proposed(row, 1) for row in wanted)):
        if item.minutes <= left:
            tests.append(item)
            left -= item.minutes
    return [*tests, again] if again else tests
