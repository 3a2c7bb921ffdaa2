"""Time that a table holds otherwise than as one column: seconds and thousandths apart, the angle of a crank, a rate."""

from __future__ import annotations

import contextlib
import itertools
import re
from collections.abc import Mapping

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.wording import number
from mrdamper.rig_files.column_names import is_unit, parse_unit, sentences, split_name, words
from mrdamper.rig_files.conditions import stated_rate, stated_speed
from mrdamper.rig_files.mapping.proposals import frequency_of, stated_frequencies
from mrdamper.rig_files.profile import Profile
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import COARSE_CLOCK, Finding
from mrdamper.rig_files.text.tokens import stamp

_FRACTIONS = {"millisekunden": "ms", "millitm": "ms"}
_DATES = words("date")
_CYCLE = re.compile(r"(?i)(?:cycle|zyklus|ciclo|cykl|цикл|サイクル|循环)s?(?:[ ._]*(?:count|number|no|nr|#)\.?)?$")
(_AXIS_UNIT,) = sentences("axis_unit")
_SAMPLE_TIME = re.compile(r"(?i)^\s*\"?sample ?time ?\[(?P<unit>[mµun]?s)\]")  # of traces of controllers
_DAY_S = 86_400.0
_EPOCHS = (  # the years 2000 to 2100 by a clock: its first and last number, its unit, the factor to it, what it counts
    (9.4e17, 4.2e18, "ns", 1.0, "nanoseconds from the year 1970"),
    (9.4e8, 4.2e9, "s", 1.0, "seconds from the year 1970"),
    (3.65e10, 7.31e10, "days", 1e-6, "millionths of days from the year 1900"),  # Time_ms of process control systems
    (3.65e4, 7.31e4, "days", 1.0, "days from the year 1900"),
)
_FRACTION_S = 0.1  # [s] between samples: in a smaller unit no logger would be as fast
_COARSE_S = 2.0  # [s] between the durations of a clock and of one of whole seconds
_LONGEST = 5_000_000  # samples; a longer record lies in a file and is not read as a whole
_SAME_RATE, _SAME_FREQUENCY = 0.2, 0.1  # relative differences of what is stated from what is measured
_SAMPLES = 100_000  # looked at


def with_axis_as_time(table: RawTable) -> RawTable:
    """Take the x axis as time where a line gives it a unit of time: of keyed rows, or X and Y."""
    clock_of = {i: n for i, n in enumerate(table.names) if n.casefold() == "name"}
    steps = {m["unit"] for line in table.lines if (m := _SAMPLE_TIME.match(line))}
    if len(steps) == 1 and list(clock_of) == list(range(0, len(table.names), 2)):  # each before its channel
        return table.named(dict.fromkeys(clock_of, ("time", steps.pop())))
    axes = [m for line in table.lines if (m := _AXIS_UNIT.match(line)) and is_unit(m["unit"])]
    clocks = {m["unit"] for m in axes if m["axis"] in "xX" and split_name("", m["unit"]).dimension == "time"}
    if len(clocks) != 1 or not table.names:
        return table
    if (table.names[0].casefold(), table.units[0].casefold()) == ("name", "unit"):
        return table.named({0: ("time", clocks.pop())})
    others = {m["unit"] for m in axes if m["axis"] not in "xX"}
    role, last = split_name(table.source.name.partition(".")[0]).role, len(table.names) - 1  # Run1_Force.txt
    if len(others) != 1 or table.names[-2:-1] not in (("X",), ("x",)) or any(table.units) or role is None:
        return table
    return table.named({last - 1: ("time", clocks.pop()), last: (role, others.pop())})


def with_epoch(table: RawTable) -> RawTable:
    """Return the table with a time in the unit of its numbers, where they are of this century since 1970 or 1900.

    Nanoseconds without a unit, and seconds with a fraction; days without one, of a record shorter than half a day;
    millionths of days, also under another unit, whose duration a clock of dates has, too. No other clock counts so
    far: thousandths of nanoseconds may also be the nanoseconds since a start.
    """
    clocks = table.columns("time")
    unsure = [i for i in clocks if not table.headers[i].unit or (len(clocks) == 2 and table.headers[i].unit != "s")]
    values = table.peek(*clocks) if unsure and len(clocks) < 3 else None
    if values is None:
        return table
    for i, (begin, end, unit, factor, what) in itertools.product(unsure, _EPOCHS):
        first, last = np.nanmin(values[i]), np.nanmax(values[i])
        duration = _DAY_S * factor * (last - first) if unit == "days" else 0.0
        dated = [np.ptp(values[k]) for k in clocks if k != i and table.headers[k].unit == "s"]
        stated = table.headers[i].unit and not any(abs(duration - of_dates) <= _COARSE_S for of_dates in dated)
        whole = unit == "s" and values[i].size > 1 and np.nanmedian(np.diff(values[i])) > _FRACTION_S
        if begin < first <= last < end and duration < _DAY_S / 2 and not stated and not whole:
            note = Finding("W_UNITS", f"the unit of {table.names[i]!r} is {unit}: its numbers count {what}")
            scaled = table.computed(i, (i,), lambda values, i=i, factor=factor: factor * values[i])
            return scaled.named({i: (table.names[i] if len(clocks) == 1 else "time", unit)}).noted(note)
    return table


def refuse_two_rates(table: RawTable, profile: Profile, time: Floats, displacement: Floats) -> None:
    """Refuse a time column that contradicts the sampling rate beside the columns or of the profile.

    An export of every n-th sample has a lower rate than it was recorded at: it is taken where the frequency that
    is stated is that of the time column, or where the profile names this column and no frequency contradicts it.
    """
    rate = profile.file.sample_rate_Hz if profile.channel("time").column is not None else None
    stated = rate or _rate_beside(table)
    time, displacement = time[:_SAMPLES], displacement[:_SAMPLES]
    steps = np.diff(time[np.isfinite(time)])
    step = float(np.median(steps)) if steps.size else 0.0
    if not stated or step <= 0 or abs(stated * step - 1) <= _SAME_RATE or abs(1 / (stated * step) - 1) <= _SAME_RATE:
        return
    if rate:
        problem = (
            f"the profile gives sample_rate_Hz = {rate:g} and a time column that has {number(1 / step)} per second"
        )
        raise table.source.refuse("E_AMBIGUOUS", problem, "leave sample_rate_Hz or [channels.time] out of the profile")
    frequencies, measured = {*stated_frequencies(table)} - {stated}, frequency_of(time, displacement)
    near = [abs(measured / f - 1) <= _SAME_FREQUENCY for f in frequencies if f > 0] if measured else []
    if any(near) or (profile.channel("time").column is not None and not near):
        return
    beside = f", and the motion {measured:.3g} Hz where {min(frequencies):g} Hz are stated" if measured and near else ""
    problem = f"the file states {stated:g} samples per second, its time column has {number(1 / step)}{beside}"
    other = "correct the line that is wrong" if near else '[channels.time] column = "..." if the time column is right'
    remedy = f"set [file] sample_rate_Hz = ... in a profile, or {other}"
    raise table.source.refuse("E_AMBIGUOUS", f"{problem}: which is right?", remedy)


def _rate_beside(table: RawTable) -> float | None:
    """Return the sampling rate [Hz] that stands beside the columns; None if there is none, or those of channels."""
    with contextlib.suppress(ValueError):
        return stated_rate(table.quantities)
    return None


def past_midnight(time: Floats) -> Floats:
    """Return a time of day [s] that goes on past midnight, where it falls back by a day less one or two steps."""
    steps = np.diff(time) if time.size <= _LONGEST else np.empty(0)
    falls = steps < -_DAY_S / 2
    if not falls.any() or not np.all(np.abs(steps[falls] + _DAY_S) <= 2 * np.nanmedian(steps)):
        return time
    return time + _DAY_S * np.concatenate([[0], np.cumsum(falls)])


def with_time_stated(table: RawTable) -> RawTable:
    """Return the table with a column of time, where it stands in several columns, or a crank turns at a stated speed.

    Parts: a clock of whole seconds and thousandths; a clock of a day and its date.
    """
    times = table.columns("time") or [i for i in table.columns(dimension="time") if not table.names[i]]
    clocks = times or table.columns(dimension="time")
    joined = _with_cycles(table, clocks[0]) if len(clocks) == 1 else table
    if len(times) == 1 or joined is not table:
        clock = clocks[0]
        return _with_samples_counted(_with_date(_with_fractions(joined, clock), clock), clock)
    return table if times else _with_crank(table)


def _with_cycles(table: RawTable, clock: int) -> RawTable:
    """Join a clock that restarts in every cycle, where a column counts the cycles: no test begins there."""
    counters = [i for i, name in enumerate(table.names) if i != clock and _CYCLE.match(name.strip())]
    values = table.peek(clock, *counters[:1]) if len(counters) == 1 else None
    steps = {i: np.diff(column) for i, column in values.items()} if values else {}
    falls = steps[clock] < 0 if steps else np.zeros(0, dtype=bool)
    if not falls.any() or not np.array_equal(steps[counters[0]], falls.astype(float)):
        return table

    def joined(values: Mapping[int, Floats]) -> Floats:
        steps = np.diff(values[clock])
        return np.concatenate([[0.0], np.cumsum(np.where(steps < 0, np.median(steps), steps))])

    note = Finding("W_CHOSEN", f"{table.names[clock]!r} restarts in every cycle: the cycles are joined to one clock")
    return table.computed(clock, (clock,), joined).named({clock: ("time", table.headers[clock].unit)}).noted(note)


def _with_fractions(table: RawTable, clock: int) -> RawTable:
    """Stamps of whole seconds, repeated, with the milliseconds or microseconds beside them."""
    over = table.over or ("",) * len(table.names)
    names = [(name or title).strip(" ()[]").casefold() for name, title in zip(table.names, over, strict=True)]
    names = [_FRACTIONS.get(name, name) for name in names]
    units = {i: parse_unit(name) for i, name in enumerate(names) if is_unit(name) and i != clock}
    beside = [(i, u.factor) for i, u in units.items() if u is not None and u.dimension == "time" and u.factor < 0.01]
    part, factor = beside[0] if len(beside) == 1 and table.units[clock] == "s" else (clock, 0.0)
    values = table.try_read(clock, part) if part != clock else None
    if values is None:
        return table
    seconds, fractions = values[clock], factor * values[part]
    apart = np.all(seconds == np.floor(seconds)) and np.all((fractions >= 0) & (fractions < 1))
    if not apart or not np.any(np.diff(seconds) == 0):
        return table
    return table.computed(clock, (clock, part), lambda values: values[clock] + factor * values[part])


def _with_samples_counted(table: RawTable, clock: int) -> RawTable:
    """Return a clock whose steps are longer than the samples', counted at the rate that the file states."""
    rate = _rate_beside(table)
    values = table.peek(clock) if rate else None
    if values is None or not rate:
        return table
    factor, steps = table.headers[clock].factor, np.diff(values[clock])
    coarse = steps.size and np.mean(steps == 0) > COARSE_CLOCK and np.all(steps >= 0)
    if not coarse or abs(steps.size / rate - factor * np.sum(steps)) > factor * np.max(steps):
        return table
    note = Finding("W_CHOSEN", f"the clock repeats itself: time is counted at the {rate:g} Hz that the file states")
    return table.computed(clock, (clock,), lambda v: np.arange(v[clock].size) / (rate * factor)).noted(note)


def _with_date(table: RawTable, clock: int) -> RawTable:
    """Return a clock that goes back at midnight, with the dates beside it."""
    dates = [i for i, name in enumerate(table.names) if name.strip().casefold() in _DATES]
    values = table.try_read(clock) if len(dates) == 1 and table.units[clock] == "s" else None
    if values is None or not np.any(np.diff(values[clock]) < -_DAY_S / 2):
        return table
    words = table.words(dates[0])
    days = [entry[0] // 10**9 for label in words.labels if (entry := stamp(f"{label} 00:00:00")) is not None]
    if len(days) < len(words.labels):
        return table
    since = np.array([float(day - days[0]) for day in days])[words.codes]
    return table.computed(clock, (clock,), lambda values: values[clock] + since)


def _with_crank(table: RawTable) -> RawTable:
    """Return an angle of a crank as time, at the speed that a line or a number beside the columns states."""
    angles = table.columns(dimension="angle")
    if len(angles) != 1:
        return table
    try:
        speed = stated_speed(table.quantities)
    except ValueError as error:
        problem = f"two speeds of the crank: {error}"
        raise table.source.refuse("E_AMBIGUOUS", problem, "correct the line that is wrong") from error
    if speed is None:
        return table
    column, unit = angles[0], table.headers[angles[0]].known
    assert unit is not None

    def turned(values: Mapping[int, Floats]) -> Floats:
        angle = unit.factor * values[column]
        there = np.isfinite(angle)
        time = np.full(angle.shape, np.nan)
        time[there] = np.unwrap(angle[there]) / (2 * np.pi * speed)
        return time

    note = Finding("W_UNITS", f"time is the angle {table.names[column]!r} at {60 * speed:g} rpm")
    return table.computed(column, (column,), turned).named({column: ("time", "s")}).noted(note)
