"""Displacement of a test that was recorded with a transducer of velocity: the integral, its drift subtracted."""

from __future__ import annotations

import numpy as np
from scipy.integrate import cumulative_trapezoid

from mrdamper.data import Floats
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import Finding, Record

_INTEGRAL = "the displacement is the integral of"  # beginning of the finding
_LARGEST = 64 * 2**20  # bytes of a file whose velocity is integrated


def with_integrated_velocity(table: RawTable) -> RawTable:
    """Return a table of time, velocity and force with the displacement that the velocity states, about its middle.

    Only where no column may be a displacement and the motion repeats: the whole cycles give the
    transducer's zero, and the mean position, which a velocity does not state, is zero.
    """
    by_role = [table.columns(role) for role in ("time", "velocity", "force")]
    others = any("displacement" in (h.role, h.channel) or h.dimension == "length" for h in table.headers)
    if others or any(len(columns) != 1 for columns in by_role) or table.source.size > _LARGEST:
        return table
    clock, speed = by_role[0][0], by_role[1][0]
    units, values = (table.headers[clock].known, table.headers[speed].known), table.try_read(clock, speed)
    if [unit and unit.dimension for unit in units] != ["time", "velocity"] or values is None:
        return table
    moved = displacement_of(*(unit.factor * values[i] for unit, i in zip(units, (clock, speed), strict=True) if unit))
    if moved is None:
        return table
    text = f"{_INTEGRAL} {table.names[speed]!r}, without drift and about its middle"
    last = len(table.names)
    table = table.computed(last, (speed,), lambda _: moved).named({last: ("displacement", "m")})
    return table.noted(Finding("W_CHOSEN", text))


def is_integrated(record: Record) -> bool:
    """Tell if the displacement of a record is the integral of a velocity."""
    return any(finding.code == "W_CHOSEN" and finding.text.startswith(_INTEGRAL) for finding in record.findings)


def integral(time: Floats, velocity: Floats) -> Floats:
    """Integral of a velocity [m/s] over time [s] by the trapezoidal rule [m]; NaN where a sample is missing."""
    there = np.isfinite(time) & np.isfinite(velocity)
    moved = np.full(time.shape, np.nan)
    moved[there] = cumulative_trapezoid(velocity[there], time[there], initial=0) if there.any() else ()
    return moved


def displacement_of(time: Floats, velocity: Floats) -> Floats | None:
    """Displacement [m] of a velocity [m/s] that repeats, about the middle of its whole cycles; None under one cycle.

    NaN where a sample is missing, as in what is returned.
    """
    there = np.isfinite(time) & np.isfinite(velocity)
    t, v = time[there], velocity[there]
    above = v >= np.mean(v) if v.size else there
    rising = np.flatnonzero(~above[:-1] & above[1:])
    if rising.size < 2 or np.any(np.diff(t) <= 0):
        return None
    moved, (first, *_, last) = integral(time, velocity), rising
    x = moved[there]
    x -= (x[last] - x[first]) / (t[last] - t[first]) * (t - t[first])
    whole = x[first : last + 1]
    moved[there] = x - (np.max(whole) + np.min(whole)) / 2
    return moved
