"""Time that a table holds otherwise than as one column: seconds and thousandths apart, the angle of a crank, a rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import InputError
from mrdamper.rig_files.conditions import stated_rate, stated_speed
from mrdamper.rig_files.mapping.proposals import frequency_of, stated_frequencies
from mrdamper.rig_files.profile import Profile
from mrdamper.rig_files.readers.base import Content, RawTable
from mrdamper.rig_files.record import Finding
from mrdamper.rig_files.text.tokens import stamp

_THOUSANDTHS = frozenset(("ms", "msec", "millisecond", "milliseconds", "millisekunden"))
_DATES = frozenset(
    ("date", "datum", "data", "fecha", "dato", "дата", "日期", "日付", "날짜", "tarih", "dátum", "päivä")
)
_DAY_S = 86_400.0
_SAME_RATE, _SAME_FREQUENCY = 0.2, 0.1  # relative differences of what is stated from what is measured
_SAMPLES = 100_000  # looked at


def refuse_two_rates(table: RawTable, profile: Profile, time: Floats, displacement: Floats) -> None:
    """Refuse a time column that contradicts the sampling rate that stands beside the columns.

    An export of every n-th sample has a lower rate than it was recorded at: it is taken where the frequency that
    is stated is that of the time column, or where the profile names this column and no frequency contradicts it.
    """
    decimal = table.form.get("decimal")
    try:
        stated = stated_rate(table.remarks, table.constants, decimal if isinstance(decimal, str) else None)
    except ValueError:
        return  # of several channels
    time, displacement = time[:_SAMPLES], displacement[:_SAMPLES]
    steps = np.diff(time[np.isfinite(time)])
    step = float(np.median(steps)) if steps.size else 0.0
    if not stated or step <= 0 or abs(stated * step - 1) <= _SAME_RATE or abs(1 / (stated * step) - 1) <= _SAME_RATE:
        return
    frequencies, measured = {*stated_frequencies(table)} - {stated}, frequency_of(time, displacement)
    near = [abs(measured / f - 1) <= _SAME_FREQUENCY for f in frequencies if f > 0] if measured else []
    if any(near) or (profile.channel("time").column is not None and not near):
        return
    beside = f", and the motion {measured:.3g} Hz where {min(frequencies):g} Hz are stated" if measured and near else ""
    raise table.source.refuse(
        "E_AMBIGUOUS",
        f"the file states {stated:g} samples per second, its time column has {1 / step:.4g}{beside}: which is right?",
        'set [file] sample_rate_Hz = ... in a profile, or [channels.time] column = "..." if the time column is right'
        if not near
        else "set [file] sample_rate_Hz = ... in a profile, or correct the line that is wrong",
    )


def with_time_stated(table: RawTable) -> RawTable:
    """Return the table with a column of time, where it stands in several columns, or a crank turns at a stated speed.

    Parts: a clock of whole seconds and thousandths; a clock of a day and its date.
    """
    times = [i for i, header in enumerate(table.headers) if header.role == "time"]
    if len(times) == 1:
        return _with_date(_with_thousandths(table, times[0]), times[0])
    return table if times else _with_crank(table)


def _with_thousandths(table: RawTable, clock: int) -> RawTable:
    """Stamps of whole seconds, repeated, with the milliseconds beside them."""
    beside = [i for i, name in enumerate(table.names) if name.strip().casefold() in _THOUSANDTHS]
    if len(beside) != 1 or table.units[clock] != "s":
        return table
    inner, part = table.read, beside[0]
    try:
        values = inner([clock, part]).values
    except InputError:
        return table
    seconds, thousandths = values[clock], values[part]
    apart = np.all(seconds == np.floor(seconds)) and np.all((thousandths >= 0) & (thousandths < 1000))
    if not apart or not np.any(np.diff(seconds) == 0):
        return table

    def read(columns: Sequence[int]) -> Content:
        content = inner(sorted({*columns, part} if clock in columns else {*columns}))
        completed = dict(content.values)
        if clock in completed:
            completed[clock] = completed[clock] + completed[part] / 1000
        return Content({i: completed[i] for i in columns}, content.lines, content.findings)

    return replace(table, read=read)


def _with_date(table: RawTable, clock: int) -> RawTable:
    """Return a clock that goes back at midnight, with the dates beside it."""
    beside = [i for i, name in enumerate(table.names) if name.strip().casefold() in _DATES]
    if len(beside) != 1 or table.units[clock] != "s" or table.words is None:
        return table
    inner = table.read
    try:
        if not np.any(np.diff(inner([clock]).values[clock]) < -_DAY_S / 2):
            return table
        words = table.words(beside[0])
    except InputError:
        return table
    stamps = [stamp(f"{label} 00:00:00") for label in words.labels]
    if any(entry is None for entry in stamps):
        return table
    days = [entry[0] // 10**9 for entry in stamps if entry is not None]
    since = np.array([float(day - days[0]) for day in days])[words.codes]

    def read(columns: Sequence[int]) -> Content:
        content = inner(columns)
        if clock not in content.values or content.values[clock].size != since.size:
            return content
        return Content({**content.values, clock: content.values[clock] + since}, content.lines, content.findings)

    return replace(table, read=read)


def _with_crank(table: RawTable) -> RawTable:
    """Return an angle of a crank as time, at the speed that a line or a number beside the columns states."""
    angles = [i for i, header in enumerate(table.headers) if header.dimension == "angle"]
    if len(angles) != 1:
        return table
    decimal = table.form.get("decimal")
    try:
        speed = stated_speed(table.remarks, table.constants, decimal if isinstance(decimal, str) else None)
    except ValueError as error:
        raise table.source.refuse(
            "E_AMBIGUOUS", f"two speeds of the crank: {error}", "correct the line that is wrong"
        ) from error
    if speed is None:
        return table
    inner, column, unit_of = table.read, angles[0], table.headers[angles[0]].known
    assert unit_of is not None

    def read(columns: Sequence[int]) -> Content:
        content = inner(columns)
        if column not in content.values:
            return content
        angle = unit_of.factor * content.values[column]
        there = np.isfinite(angle)
        turned = np.full(angle.shape, np.nan)
        turned[there] = np.unwrap(angle[there]) / (2 * np.pi * speed)
        return Content({**content.values, column: turned}, content.lines, content.findings)

    text = f"time is the angle {table.names[column]!r} at {60 * speed:g} rpm"
    names = tuple("time" if i == column else name for i, name in enumerate(table.names))
    units = tuple("s" if i == column else unit for i, unit in enumerate(table.units))
    return replace(table, names=names, units=units, read=read, findings=(*table.findings, Finding("W_UNITS", text)))
