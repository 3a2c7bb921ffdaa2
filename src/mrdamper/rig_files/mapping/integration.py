"""Displacement of a test that was recorded with a transducer of velocity: the integral, its drift subtracted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.integrate import cumulative_trapezoid

from mrdamper.data import Floats
from mrdamper.errors import InputError
from mrdamper.rig_files.readers.base import Content, RawTable
from mrdamper.rig_files.record import Finding

_LARGEST = 64 * 2**20  # bytes of a file whose velocity is integrated


def with_integrated_velocity(table: RawTable) -> RawTable:
    """Return a table of time, velocity and force with the displacement that the velocity states, about its middle.

    Only where no column may be a displacement and the motion repeats: the whole cycles give the
    transducer's zero, and the mean position, which a velocity does not state, is zero.
    """
    by_role = {
        role: [i for i, h in enumerate(table.headers) if h.role == role] for role in ("time", "velocity", "force")
    }
    others = any("displacement" in (h.role, h.channel) or h.dimension == "length" for h in table.headers)
    if others or any(len(columns) != 1 for columns in by_role.values()) or table.source.size > _LARGEST:
        return table
    clock, speed = by_role["time"][0], by_role["velocity"][0]
    units = table.headers[clock].known, table.headers[speed].known
    if units[0] is None or units[1] is None or (units[0].dimension, units[1].dimension) != ("time", "velocity"):
        return table
    inner, factors, last = table.read, (units[0].factor, units[1].factor), len(table.names)
    try:
        values = inner([clock, speed]).values
        moved = displacement_of(factors[0] * values[clock], factors[1] * values[speed])
    except InputError:
        return table
    if moved is None:
        return table

    def read(columns: Sequence[int]) -> Content:
        content = inner([i for i in columns if i != last] or [speed])
        return Content({**content.values, last: moved}, content.lines, content.findings)

    text = f"the displacement is the integral of {table.names[speed]!r}, without drift and about its middle"
    return replace(
        table, names=(*table.names, "displacement"), units=(*table.units, "m"), read=read, words=None,
        odd=(*table.odd, "") if table.odd else (), over=(*table.over, "") if table.over else (),
        findings=(*table.findings, Finding("W_CHOSEN", text)),
    )  # fmt: skip


def displacement_of(time: Floats, velocity: Floats) -> Floats | None:
    """Displacement [m] of a velocity that repeats, about the middle of its whole cycles; None under one cycle.

    Parameters
    ----------
    time, velocity : (N,) arrays
        In s and m/s; NaN where a sample is missing, as in what is returned.
    """
    there = np.isfinite(time) & np.isfinite(velocity)
    t, v = time[there], velocity[there]
    above = v >= np.mean(v) if v.size else there
    rising = np.flatnonzero(~above[:-1] & above[1:])
    if rising.size < 2 or np.any(np.diff(t) <= 0):
        return None
    x = cumulative_trapezoid(v, t, initial=0)
    first, last = rising[0], rising[-1]
    x -= (x[last] - x[first]) / (t[last] - t[first]) * (t - t[first])
    whole = x[first : last + 1]
    moved = np.full(time.shape, np.nan)
    moved[there] = x - (np.max(whole) + np.min(whole)) / 2
    return moved
