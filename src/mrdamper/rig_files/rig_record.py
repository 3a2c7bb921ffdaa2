"""From a table of a rig's file to a record: channels in SI, delays subtracted, current and time of recording found."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.arrays import chunks, rescale
from mrdamper.data.wording import counted
from mrdamper.errors import ColumnError, CombinedError, InputError, listed, printable
from mrdamper.physics.motion.measured import smooth
from mrdamper.rig_files import coil_current
from mrdamper.rig_files.column_names import DIMENSION, KEYS, Unit, role_of, shown_unit, words
from mrdamper.rig_files.columns import Assigned, assign, index_of_samples, noted_columns, rate_of
from mrdamper.rig_files.conditions import day_in, stated_motion, stated_quantities, time_in
from mrdamper.rig_files.mapping.clocks import past_midnight, refuse_two_rates
from mrdamper.rig_files.mapping.proposals import integral
from mrdamper.rig_files.parts import stretches_of_time
from mrdamper.rig_files.profile import Correction, Profile
from mrdamper.rig_files.readers import suffixes
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import FURTHER, HEAD, OPTIONAL, Finding, Record
from mrdamper.rig_files.sequences import stretches_of_session

_KEPT = {**FURTHER, "length": "m", "force": "N"}
_RAW_FORCE = "force_raw_N"
_SCALES = words("scale")
_SCALE_CELL = re.compile(r"([+-]?[0-9]+(?:[.,][0-9]+)?)(?:\s*[A-Za-zµ]+/(?:digit|bit|count|cnt|lsb|inc)s?)?")
_SAMPLE = 10_000  # samples looked at
_LEAST_CURRENT = 0.02  # [A] largest of a record: less is no current of a coil
_MOST_FURTHER = 12  # channels
_MOST_HEAD_LINES = 20
_LENIENT = ("acceleration", "voltage", "temperature", "pressure")  # a damaged cell there costs the channel, not the run
_DATES, _TIMES = words("date_line"), words("time_of_day")
_KEYED = re.compile(r"^[\W_]*(?P<key>[^\W\d_][\w ./-]{0,40}?)[\"' ]*[:=;,\t]+[\"' ]*(?P<value>\S.{0,60})")


def _tests_of(channels: dict[str, Floats], profile: Profile) -> tuple[list[slice], list[Finding]]:
    """Return the tests of a table: between restarts of its time, or rests and steps of the current of a session."""
    time = channels["time"]
    if profile.file.blocks == "join":
        return [slice(0, time.size)], []
    stretches = stretches_of_time(time)
    if len(stretches) > 1:
        return stretches, []
    stretches = stretches_of_session(time, channels["displacement"], channels.get("current"))
    text = f'cut at its rests or steps of the current into {len(stretches)} tests (blocks = "join" keeps it)'
    return stretches, [Finding("W_CUT", text)] if len(stretches) > 1 else []


def records_of(table: RawTable, profile: Profile, path: Path) -> list[Record]:
    """Return the records a table of one test holds, not yet checked: several where its time starts again and again.

    Raises `InputError` if a channel is missing, has no unit, or holds something else than numbers, or if two places
    contradict each other about the current.
    """
    try:
        assigned = assign(table, profile)
    except InputError as error:
        coil_current.ask_current_too(error, table, profile, path)
        raise
    raw, findings, lines = _read(table, assigned, profile)
    channels = {name: rescale(raw[of.column], of.factor, of.offset) for name, of in assigned.items()}
    size, rate = next(iter(raw.values())).size, ""
    _refuse_tiny_currents(table, assigned, channels)
    if "time" not in channels:
        channels["time"], rate = _counted_time(table, profile, size)
    else:
        channels["time"] = past_midnight(channels["time"])
        refuse_two_rates(table, profile, channels["time"], channels["displacement"])
    if profile.channel("displacement").integrate:
        channels["displacement"] = integral(channels["time"], channels["displacement"])
        findings.append(Finding("W_SCALE", "the displacement is the integral of the velocity"))
    further = _further(table, assigned, size)
    stretches, cut = _tests_of(channels, profile)
    findings += [*cut, *noted_columns(table, profile, assigned)]
    remarks = {**_remarks(table, profile, assigned), "time_from": rate}
    if len(stretches) == 1:
        remarks["motion_stated"] = stated_motion(stated_quantities(table.remarks, decimal=table.decimal))
    remarks = {key: text for key, text in remarks.items() if text}
    rig = " ".join(name for name in (profile.rig, table.damper) if name) if table.damper != profile.rig else profile.rig
    records = []
    for number, stretch in enumerate(stretches, 1):
        part, others = ({name: values[stretch] for name, values in of.items()} for of in (channels, further))
        part, its_lines = _aligned(part, assigned, None if lines is None else lines[stretch])
        if its_lines is not None and len(its_lines) != stretch.stop - stretch.start:
            others = {}  # delays were subtracted: the samples are no longer those of the file
        if profile.correction is not None:
            others[_RAW_FORCE] = part["force"]
            part["force"], remarks["force_correction"] = corrected_force(part, profile.correction)
        noticed = findings
        if "current" in part:
            part["current"], slow = coil_current.without_gaps(part["current"])
            noticed = [*findings, *slow]
        doubt, channel, force = None, part.get("current"), assigned["force"].column
        try:
            current, whence = coil_current.current_of(table, profile, path, channel, stretch, force)
        except ColumnError as error:
            current, whence, doubt = None, dict[str, str](), error
        if current is not None:
            part["current"] = coil_current.constant(current, part["time"])
            noticed = [f for f in findings if not f.text.startswith(coil_current.NO_CHANNEL)]
        run = _run_id(table, path) + (f"_{number}" if len(stretches) > 1 else "")
        if "current" not in part:
            noticed = [*noticed, *coil_current.current_by_resistance(table, run), *coil_current.not_taken(table)]
        records.append(
            Record(
                id=run,
                findings=tuple(dict.fromkeys(noticed)), provenance={**remarks, **whence}, rig=rig,
                excitation=profile.excitation, split=profile.split, lines=its_lines, further=others,
                doubt=doubt, **part,  # type: ignore[arg-type]
            )
        )  # fmt: skip
    return [*coil_current.with_marks(records, table, stretches)]


def _read(table: RawTable, assigned: dict[str, Assigned], profile: Profile):
    """Return the columns' numbers, findings and lines; a damaged cell of a further channel costs that channel."""
    content = table.read([entry.column for name, entry in assigned.items() if name not in _LENIENT])
    raw = dict(content.values)
    for column, values in raw.items():
        if content.lines is not None and thousands_in(values):
            number = table.number(column)
            problem = f"column {table.names[column] or number!r} goes from hundreds to ones with three decimals"
            text, remedy = f"{problem}: points of thousands?", "export it without separators of thousands"
            raise table.source.refuse("E_AMBIGUOUS", text, remedy, column=number)
    _refuse_unscaled(table, assigned, raw, profile)
    findings = [*table.findings, *content.findings]
    for name in [name for name in assigned if name in _LENIENT]:
        try:
            values = table.read([assigned[name].column]).values[assigned[name].column]
            if values.size != (size := content.values[assigned["force"].column].size):
                raise table.source.refuse("E_FIELD_COUNT", f"it has {counted(values.size, 'sample')}, the force {size}")
            raw[assigned[name].column] = values
        except InputError as error:
            code = "W_ENCODING" if error.code == "E_ENCODING" else "W_COLUMN"
            findings.append(Finding(code, f"the {name} channel is not used: {error.found}"))
            del assigned[name]
    for name in [name for name in assigned if name in OPTIONAL]:
        if not any(np.isfinite(piece).any() for _, piece in chunks(raw[assigned[name].column])):
            findings.append(Finding("W_COLUMN", f"the {name} channel is not used: its column is empty"))
            del assigned[name]
    return raw, findings, content.lines


def _refuse_unscaled(table: RawTable, assigned: dict[str, Assigned], raw: dict[int, Floats], profile: Profile) -> None:
    """Refuse whole numbers beside which their scale stands: nobody says whether they were multiplied by it."""
    problems: dict[str, InputError] = {}
    for key, value in (*table.constants.items(), *_numbers_in_lines(table)):
        words = [word for word in re.split(r"[^A-Za-z]+", key.casefold()) if word]
        rest = " ".join(word for word in words if word not in _SCALES)
        role = role_of(rest) if len(rest.split()) < len(words) else None
        role = role if role in assigned else next((r for r, e in assigned.items() if e.name.casefold() in rest), None)
        if role is None or len(rest.split()) == len(words) or value in (0.0, 1.0):
            continue
        some = raw.get(assigned[role].column, np.empty(0))[:_SAMPLE]
        if profile.channel(role).scale is None and some.size and np.array_equal(some, np.round(some), equal_nan=True):
            problem = f"{role} is whole numbers, and {printable(key)} is {value:g}, which may be applied or not"
            remedy = f"set [channels.{role}] unit and scale in a profile, scale = 1 if it is applied"
            problems.setdefault(role, table.source.refuse("E_AMBIGUOUS", problem, remedy))
    CombinedError.raise_from([*problems.values()])


def _numbers_in_lines(table: RawTable) -> Iterator[tuple[str, float]]:
    """Yield what lines beside the columns call a number, or one a column: Load gain: 0.5; Gain; 1; 0.5."""
    marks = r"[:=;\t|]" if table.decimal == "," else r"[:=;,\t|]"
    for line in table.lines:
        key, *cells = (cell.strip(' "#%') for cell in re.split(marks, line))
        own = 0 <= len(table.names) - len(cells) <= 1 < len(cells)
        names = [header.name for header in table.headers][-len(cells) :] if own else [""]
        for name, cell in zip(names, cells if own or len(cells) == 1 else (), strict=False):
            if match := _SCALE_CELL.fullmatch(cell):
                yield f"{key} {name}".strip(), float(match[1].replace(",", "."))


def _refuse_tiny_currents(table: RawTable, assigned: dict[str, Assigned], channels: dict[str, Floats]) -> None:
    """Refuse currents in MA, written in capitals, that are amperes by their size."""
    if "current" not in assigned or assigned["current"].unit != "MA":
        return
    largest = max((float(np.max(np.abs(piece), initial=0.0, where=np.isfinite(piece)))
                   for _, piece in chunks(channels["current"])), default=0.0)  # fmt: skip
    if 0 < largest < _LEAST_CURRENT:
        problem = f"the current in MA is {1e3 * largest:.3g} at most: milliamperes would be no current of a coil"
        remedy = 'set [channels.current] unit = "A" or unit = "mA" in a profile'
        raise table.source.refuse("E_AMBIGUOUS", problem, remedy, column=table.number(assigned["current"].column))


def _counted_time(table: RawTable, profile: Profile, size: int) -> tuple[Floats, str]:
    """Time by the sampling rate, of a column that counts samples or of the rows, and how it was made."""
    rate = rate_of(table, profile) or 1.0
    column = index_of_samples(table)
    if column is not None:
        counted = table.read([column]).values[column]
        if counted.size == size and np.array_equal(counted, np.round(counted)):
            return (counted - counted[0]) / rate, f"{table.names[column]} at {rate:g} Hz"
    return np.arange(size) / rate, f"rows at {rate:g} Hz"


def corrected_force(channels: dict[str, Floats], correction: Correction) -> tuple[Floats, str]:
    """Force without the inertia of what moves with the load cell and without gas force [N], and how it was made."""
    acceleration, whence = channels.get("acceleration"), "the accelerometer"
    if acceleration is None:  # by local quadratics, NaN where a sample is missing
        time, displacement, whence = channels["time"], channels["displacement"], "the displacement"
        there = np.isfinite(time) & np.isfinite(displacement)
        acceleration = np.full(time.shape, np.nan)
        acceleration[there] = smooth(time[there], displacement[there])[2]
    mass, gas = correction.moving_mass_kg, correction.gas_force_N
    notes = [f"{mass:g} kg times acceleration by {whence} subtracted"] * bool(mass)
    notes += [f"{gas:g} N of gas force added"] * bool(gas)
    return channels["force"] - mass * acceleration + gas, ", ".join(notes) or "none"


def _further(table: RawTable, assigned: dict[str, Assigned], size: int) -> dict[str, Floats]:
    """Second sensors of a kind, in SI, by their name and unit: kept, never identified from.

    One that would be called as a channel or another sensor is has the number of its column in its name.
    """
    used = {entry.column for entry in assigned.values()}
    taken = {_RAW_FORCE, *(f"{role}_{_KEPT[DIMENSION[role]]}" for role in assigned if DIMENSION[role] in _KEPT)}
    wanted: dict[str, tuple[int, Unit]] = {}
    for column, header in enumerate(table.headers):
        unit_of = header.known
        if column in used or unit_of is None or unit_of.dimension not in _KEPT or len(wanted) >= _MOST_FURTHER:
            continue
        bare = re.sub(r"[^A-Za-z0-9]+", "_", header.name).strip("_")[:40].lower() or "column"
        si = _KEPT[unit_of.dimension]
        bare += f"_column_{table.number(column)}" if f"{bare}_{si}" in {*taken, *wanted} else ""
        wanted[f"{bare}_{si}"] = (column, unit_of)
    columns = [column for column, _ in wanted.values()]
    values = table.try_read(*columns) if columns else {}
    if values is None:  # one of them cannot be read
        values = {column: own[column] for column in columns if (own := table.try_read(column)) is not None}
    whole = {column: own for column, own in values.items() if own.size == size}
    return {key: rescale(whole[at], unit.factor, unit.offset) for key, (at, unit) in wanted.items() if at in whole}


def thousands_in(values: Floats) -> bool:
    """Tell if marks of thousands were read as decimal marks: 998, 1.003 for 1003, 1.012, ...

    Integers up to 999 beside numbers from 1 on with three decimals, and a fall from the one to the other.
    """
    some = np.asarray(values[:200_000])
    some = np.abs(some[np.isfinite(some)])
    whole = some == np.round(some)
    if not some.size or not 0.003 < np.mean(whole) < 0.999:
        return False
    broken = some[~whole]
    thousandths = 1e3 * broken
    if broken.min() < 1 or some[whole].max() > 999 or np.any(np.abs(thousandths - np.round(thousandths)) > 1e-6):
        return False
    if np.mean(np.round(thousandths) % 5 != 0) < 0.5:  # halves, fifths, eighths: a coarse channel's own
        return False
    falls = whole[:-1] & ~whole[1:] & (some[:-1] >= 100) & (some[1:] < 100) & (some[:-1] > 5 * some[1:])
    rises = whole[1:] & ~whole[:-1] & (some[1:] >= 100) & (some[:-1] < 100) & (some[1:] > 5 * some[:-1])
    return bool(np.any(falls | rises))


def _aligned(channels: dict[str, Floats], assigned: dict[str, Assigned], lines):
    """Take known delays off, by linear interpolation; samples without a partner are left out."""
    delays = {name: entry.delay for name, entry in assigned.items() if entry.delay and name != "time"}
    time = channels["time"]
    if not delays or not (finite := np.isfinite(time)).any():
        return channels, lines
    present, ends = {name: channels[name][finite] for name in delays}, {"left": np.nan, "right": np.nan}
    shifted = {name: np.interp(time + delay, time[finite], present[name], **ends) for name, delay in delays.items()}
    late, early = max(0.0, *delays.values()), min(0.0, *delays.values())
    keep = np.flatnonzero((time + late <= np.nanmax(time)) & (time + early >= np.nanmin(time)))
    if not keep.size:
        raise ColumnError("the delays of the profile are longer than the record", remedy="correct delay_ms")
    inside = slice(int(keep[0]), int(keep[-1]) + 1)
    cut = {name: values[inside] for name, values in {**channels, **shifted}.items()}
    return cut, None if lines is None else lines[inside]


def _remarks(table: RawTable, profile: Profile, assigned: dict[str, Assigned]) -> dict[str, str]:
    used = {entry.column for entry in assigned.values()}
    columns = [i for i, header in enumerate(table.headers) if header.dimension in _KEPT]
    sessions = [i for i, header in enumerate(table.headers) if header.name.casefold() == "session"]
    session = table.words(sessions[0]).labels if len(sessions) == 1 else ()
    columns += sessions if len(session) == 1 else []
    columns += [0] if table.names[0].casefold().endswith((*KEYS["name"],)) else []  # TraceName, before the names
    ignored = [name for i, name in enumerate(table.names) if name and i not in used and i not in columns]
    taken = [f"{role} = {table.title(e.column)} in {shown_unit(e.unit)}" for role, e in assigned.items()]
    remarks = {"columns": ", ".join(taken)} | ({"session": session[0]} if len(session) == 1 else {})
    remarks |= {"specimen": table.damper} if table.damper else {}
    if ignored:
        remarks["ignored_columns"] = listed(ignored, 20)
    keyed = [_KEYED.match(line) for line in table.remarks]
    return {
        **recording_time(table.remarks),
        HEAD: "; ".join([f"{m['key']}: {m['value']}" for m in keyed if m][:_MOST_HEAD_LINES]),
        **{key: coil_current.as_data(text) for key, text in remarks.items()},
        "sign_changed": ", ".join(role for role, entry in assigned.items() if entry.sign < 0),
        "scaled": ", ".join(f"{r} = {scale:g}" for r in assigned if (scale := profile.channel(r).scale)),
    }


def _run_id(table: RawTable, path: Path) -> str:
    stem = path.name
    while Path(stem).suffix.lower() in suffixes():
        stem = Path(stem).stem
    label = re.sub("(?<=[0-9]),(?=[0-9])", ".", table.label)  # 0,5 Hz
    label = "" if not label or label.startswith("block") else f"_{label}"
    return re.sub(r"[^\w.+=-]+", "_", stem + label).lstrip("_=+-.").rstrip("_.")[:100] or "run"


def recording_time(lines: Iterable[str]) -> dict[str, str]:
    """Return the note `recorded_at` (ISO 8601) of a test, or `session`, the date as written, where it is ambiguous.

    A line, or a part of one after a semicolon, that names a date and nothing else counts ("Test date: 2024-05-31
    14:05"), with the time of day in the same line or in one of its own. 03/04/2024 is a day, and the same day in all
    files of a rig, but not known to be of March
    or April. Lines that state different days (a report printed later) state none.
    """
    days, times = dict[str, str](), dict[str, None]()
    for fact in (fact for line in lines for fact in (line, *line.split("; ")[1:])):
        keyed = _KEYED.match(fact)
        if keyed is None:
            continue
        key, value = " ".join(keyed["key"].casefold().split()), keyed["value"]
        if key in _DATES and (day := day_in(value)):
            days[day[0]] = day[1]
        if key in _DATES or key in _TIMES:
            times |= {} if (moment := time_in(value)) is None else {moment.isoformat("seconds"): None}
    if len(days) != 1:
        return {}
    ((iso, written),) = days.items()
    if not iso[0].isdigit():
        return {"session": written}
    return {"recorded_at": f"{iso}T{next(iter(times))}" if len(times) == 1 else iso}
