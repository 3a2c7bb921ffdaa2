"""Candidates for what a file leaves open, tried on its data: physics chooses columns, never a sign or a scale."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.integrate import cumulative_trapezoid

from mrdamper.data import Floats
from mrdamper.errors import ExcitationError, InputError
from mrdamper.physics.motion.measured import smooth
from mrdamper.physics.motion.strokes import find_strokes
from mrdamper.rig_files.column_names import role_of, split_name
from mrdamper.rig_files.columns import candidates_of, column_called
from mrdamper.rig_files.conditions import BARE_RATE, CHOICE, motions_in, stated_rate
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import REQUIRED, Finding, Record

_KEYED = re.compile(r"[\s#%\"]*([^=:;,\t]{1,40}?)\"?\s*[=:;,\t]\s*\"?([0-9]{1,9}(?:\.[0-9]{1,9})?)[\s;,\"]*")
_LONGEST_LINE = 80
_CLOCK_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}
_LEAST_RATE = 1000.0  # [Hz], of which a number in a text is no frequency of a motion
_AGREE = 0.05  # of a frequency that is stated
_MOST_SAMPLES = 20_000
_MOST_TRIED = 24  # combinations of columns
_CLEAR, _POOR = 0.5, 0.2  # share of the force that velocity explains: of a damper's, and of another channel
_INTEGRAL = "the displacement is the integral of"  # beginning of the finding


def with_unit_of_time(table: RawTable) -> RawTable:
    """Return the table with the unit of its time, where only one agrees with the frequency or rate the file states.

    A table without a time has the sampling rate that is stated without its unit, if it is that in Hz.
    """
    times, moved = table.columns("time"), [i for i, h in enumerate(table.headers) if h.channel == "displacement"]
    if not times and len(moved) == 1:
        return _with_rate(table, moved[0])
    if len(times) != 1 or len(moved) != 1 or table.headers[times[0]].unit:
        return table
    rates = {rate for q in table.quantities if (rate := stated_rate([q]))}
    stated = set(stated_frequencies(table)) - rates or {*rates}
    values = table.peek(times[0], moved[0]) if len(stated) == 1 else None
    if values is None:
        return table
    steps, frequency = np.diff(values[times[0]]), stated.pop()
    measured = 1 / np.median(steps) if frequency in rates else frequency_of(values[times[0]], values[moved[0]])
    units = [u for u, f in _CLOCK_UNITS.items() if measured and abs(measured / f - frequency) < _AGREE * frequency]
    if len(units) != 1:
        return table
    what = "samples are taken at" if frequency in rates else "motion has"
    text = f"the unit of time is {units[0]}: so the {what} the {frequency:g} Hz that the file states"
    return table.named({times[0]: (table.names[times[0]], units[0])}).noted(Finding("W_UNITS", text))


def _with_rate(table: RawTable, moved: int) -> RawTable:
    """Add the sampling rate that a line or a number states without its unit, where the motion has the frequency so."""
    lines = (*table.remarks, *(f"{name}={number!r}" for name, number in table.constants.items()))
    keyed = filter(None, (_KEYED.fullmatch(line) for line in lines if len(line) < _LONGEST_LINE))
    rates = {float(match[2]) for match in keyed if BARE_RATE.fullmatch(match[1])}
    stated = {*stated_frequencies(table)}
    values = table.peek(moved) if len(rates) == len(stated) == 1 else None
    if values is None or not (rate := rates.pop()) or any(stated_rate([q]) for q in table.quantities):
        return table
    frequency, measured = stated.pop(), frequency_of(np.arange(values[moved].size) / rate, values[moved])
    if not measured or abs(measured - frequency) > _AGREE * frequency:
        return table
    text = f"the sampling rate {rate:g} is in Hz: so the motion has the {frequency:g} Hz that the file states"
    return replace(table, remarks=(*table.remarks, f"sampling rate: {rate!r} Hz")).noted(Finding("W_UNITS", text))


def with_channels_by_physics(table: RawTable, stated: Mapping[str, str | int]) -> RawTable:
    """Return the table with the columns chosen that alone make a damper's loop, where names leave open which they are.

    The columns that are `stated`, by channel, are not open, nor those that a line chooses.
    """
    table = _with_choices(table)
    try:
        own = {role: [column_called(table, column, role)] for role, column in stated.items() if role in REQUIRED}
        open_roles = {role: own.get(role) or candidates_of(table, role) for role in REQUIRED}
    except InputError:
        return table
    if all(len(columns) == 1 for columns in open_roles.values()) or not all(open_roles.values()):
        return table
    values = table.peek(*sorted({column for columns in open_roles.values() for column in columns}))
    choices = list(product(*open_roles.values()))[: _MOST_TRIED + 1]
    tried = [columns for columns in choices if len({*columns}) == len(columns)]
    if values is None or len(tried) > _MOST_TRIED:
        return table
    scores = {columns: damping_share(*(values[column] for column in columns)) for columns in tried}
    good = [columns for columns, score in scores.items() if score >= _CLEAR]
    if len(good) != 1 or any(_POOR <= score < _CLEAR for score in scores.values()):
        return table
    chosen = {role: own for own, (role, columns) in zip(good[0], open_roles.items(), strict=True) if len(columns) > 1}
    names = {role: table.names[own] or f"column {table.number(own)}" for role, own in chosen.items()}
    named = " and ".join(f"{name} as the {role}" for role, name in names.items())
    text = f"{named}: only so the force takes energy in phase with the velocity"
    return replace(table, chosen=chosen).noted(Finding("W_CHOSEN", text))


def _with_choices(table: RawTable) -> RawTable:
    """Return the table with the columns that lines choose for a channel: use LVDT 2 for damper stroke."""
    chosen: dict[str, set[int]] = {}
    for match in (match for line in table.lines for match in CHOICE.finditer(line)):
        role, name = role_of(match["channel"]), match["name"].casefold()
        own = [i for i in table.columns(role) if table.headers[i].name.casefold() == name] if role else []
        chosen.setdefault(role or "", set()).update(own)
    clear = {role: min(own) for role, own in chosen.items() if len(own) == 1}
    notes = [Finding("W_CHOSEN", f"{table.title(i)!r} is the {role} as a line states") for role, i in clear.items()]
    return replace(table, chosen={**table.chosen, **clear}).noted(*notes)


def damping_share(time: Floats, displacement: Floats, force: Floats) -> float:
    """Share of the force's variance beside a spring's that velocity explains, as a damper's does; 0 if it gives energy.

    Time, displacement and force may be in any units: the share does not depend on them.
    """
    there = np.flatnonzero(np.isfinite(time) & np.isfinite(displacement) & np.isfinite(force))
    if there.size < 50 or np.any(np.diff(time[there]) <= 0):
        return 0.0
    there = there[:: max(1, there.size // _MOST_SAMPLES)]
    time, x, force = time[there], displacement[there], force[there]
    spring = np.column_stack([np.ones_like(x), x, time])
    velocity, rest = (f - spring @ np.linalg.lstsq(spring, f, rcond=None)[0] for f in (smooth(time, x)[1], force))
    if not velocity.any() or np.std(rest) <= 0.1 * np.std(force):  # nothing but a spring, or another displacement
        return 0.0
    return max(float(np.corrcoef(velocity, rest)[0, 1]), 0.0) ** 2


def stated_frequencies(table: RawTable) -> Iterator[float]:
    """Frequencies [Hz] that the title, the file's name or a number beside the columns states."""
    for text in (table.label, table.source.name, *table.remarks[-20:]):
        yield from (frequency for frequency in motions_in(text[:255], "Hz") if frequency < _LEAST_RATE)
    for name, value in table.constants.items():
        header = split_name(name)
        if header.dimension == "frequency" and re.search(r"(?i)freq|^f$", header.name) and header.known:
            yield header.known.factor * value


def frequency_of(time: Floats, x: Floats) -> float | None:
    """Frequency of a motion, by the reversals of its sign about the middle."""
    there = np.isfinite(time) & np.isfinite(x)
    if np.count_nonzero(there) < 20 or np.any(np.diff(time[there]) <= 0):
        return None
    try:
        period = find_strokes(time[there], x[there]).period
    except (ExcitationError, ValueError):
        return None
    return 1 / period if period else None


def with_integrated_velocity(table: RawTable) -> RawTable:
    """Return a table of time, velocity and force with the displacement that the velocity states, about its middle.

    Only where no column may be a displacement and the motion repeats: the whole cycles give the
    transducer's zero, and the mean position, which a velocity does not state, is zero.
    """
    by_role = [table.columns(role) for role in ("time", "velocity", "force")]
    others = any("displacement" in (h.role, h.channel) or h.dimension == "length" for h in table.headers)
    if others or any(len(columns) != 1 for columns in by_role):
        return table
    clock, speed = by_role[0][0], by_role[1][0]
    units, values = (table.headers[clock].known, table.headers[speed].known), table.peek(clock, speed)
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
