"""Assignment of columns to time, displacement, force, ..., by name and unit, or by the profile."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import ColumnError, CombinedError, InputError, UnitError, listed, printable
from mrdamper.rig_files import column_names
from mrdamper.rig_files.column_names import (
    COMPUTED,
    DIMENSION,
    find_name,
    holds,
    is_unit,
    parse_unit,
    split_name,
    words,
    words_of,
)
from mrdamper.rig_files.conditions import currents_in, named_after_currents, rate_in_name, stated_rate
from mrdamper.rig_files.profile import Profile, toml
from mrdamper.rig_files.readers.base import RawTable, RigFileError
from mrdamper.rig_files.record import OPTIONAL, REQUIRED, SIGNED, Finding

ROLES = (*REQUIRED, *OPTIONAL)
_DERIVED = ("velocity", "acceleration")  # of the displacement
_MOST_RESTARTS = 0.05  # of the samples of a clock that counts within steps
_TOTAL = re.compile(r"total|absolut|gesamt|cumulat|kumul", re.IGNORECASE)
_OF_SENSORS = ("voltage", "count", "ratio", "dimensionless")  # which a calibration leads from
_COUNTS = ("counts", *column_names.TABLES["unit_names"]["counts"])
_PHASES = (frozenset("UVW"), frozenset("RST"), frozenset(("L1", "L2", "L3")))  # of a motor, at the end of a name
_ENDS = (("low", "high"), ("lower", "upper"))  # of an interval, at the end of a name
_INDEX, _MEASURED = words("sample"), words("measured")
_TIMES = re.compile(r"(?i)(?<!\w)multipl(?:y|ie[ds]?|ier|iz|ic|ik)\w*")  # no multiple, no multiplexer
_CONVERTER = re.compile(r"(?i)(?<![a-z])(?:adc|counts?|raw|cnts?)(?![a-z])")  # of a converter
_FACTOR = re.compile(r"(?<![\w.,])[0-9]+(?:[.,][0-9]+)?(?!\w)")
_SUM = re.compile(r"(?i)(?<!\w)(?:sum|summe|somme|suma|somma|soma|toplam|сумма)(?!\w)|合[計计]|之和|总和")


@dataclass(frozen=True, slots=True)
class Assigned:
    """Column of a channel and its conversion to SI: factor * value + offset."""

    column: int  # position in the table
    name: str  # as the file has it, without the unit
    unit: str  # as the file or the profile has it
    factor: float
    offset: float = 0.0
    delay: float = 0.0  # how late the channel is [s]
    sign: int = 1  # of the factor, beside a scale


def assign(table: RawTable, profile: Profile) -> dict[str, Assigned]:
    """Find the channels of a table, all the required ones among them; the profile wins over what the names say.

    Raises `ColumnError` if a channel is not there or two may be it, `UnitError`, its code E_UNITS_MISSING or
    E_UNITS_DIMENSION, and `RigFileError`, E_DUPLICATE_COLUMN, if columns of one name differ.
    """
    columns, problems = _columns(table, profile)
    if not problems:
        problems += _missing(table, columns, profile)
    assigned: dict[str, Assigned] = {}
    stated = profile.current or currents_in(table.source.name)
    missing = bool(problems)  # then times of one name may be those of a channel each
    for role, column in columns.items():
        with _noted(problems):
            if role != "time" or not missing:
                _refuse_two_values(table, role, column, profile)
            _refuse_interval(table, role, column, profile)
            entry = _convert(table, role, column, profile, asks_current=bool(problems) and not stated)
            assigned |= {} if entry is None else {role: entry}
    if not problems and "time" in assigned and "time" not in profile.channels:
        problems += _second_clock(table, assigned["time"])
    CombinedError.raise_from(problems)
    return assigned


def _columns(table: RawTable, profile: Profile) -> tuple[dict[str, int], list[InputError]]:
    """Return the column of every channel, by the profile, else by name and unit, and why some cannot be known."""
    columns: dict[str, int] = {}
    problems: list[InputError] = []
    for role in ROLES:
        stated = profile.channel(role).column
        with _noted(problems if role in REQUIRED else []):
            columns |= {} if stated is None else {role: column_called(table, stated, role)}
    for role in ROLES:
        if role not in columns and not (role == "time" and profile.file.sample_rate_Hz):
            with _noted(problems):
                choice = _choose(table, role, columns.values())
                columns |= {} if choice is None else {role: choice}
    return columns, problems


@contextlib.contextmanager
def _noted(problems: list[InputError]) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        problems.append(error)


def partly_assigned(table: RawTable, profile: Profile, needed: Collection[str] = ()) -> dict[str, Assigned]:
    """Return the channels of a table that is no whole test, as far as they are known beyond doubt.

    Raises as `assign` where one that is needed is not known.
    """
    assigned: dict[str, Assigned] = {}
    for role in ROLES:
        with contextlib.nullcontext() if role in needed else contextlib.suppress(InputError):
            column = _stated_or_chosen(table, role, profile, [e.column for e in assigned.values()])
            if column is None and role in needed:
                CombinedError.raise_from(_missing(table, dict.fromkeys({*REQUIRED} - {role}, 0), profile))
            if column is not None and (entry := _convert(table, role, column, profile)) is not None:
                assigned[role] = entry
    return assigned


def _stated_or_chosen(table: RawTable, role: str, profile: Profile, taken: Collection[int]) -> int | None:
    """Return the column of a channel by the profile, else by its name and unit."""
    stated = profile.channel(role).column
    return _choose(table, role, taken) if stated is None else column_called(table, stated, role)


def rate_of(table: RawTable, profile: Profile) -> float | None:
    """Return sampling rate [Hz] of a table without time stamps, by the profile or by what stands beside the columns."""
    if profile.file.sample_rate_Hz:
        return profile.file.sample_rate_Hz
    try:
        return stated_rate(table.quantities) or rate_in_name(table.source.name)
    except ValueError as error:
        remedy = "set [file] sample_rate_Hz = ... in a profile"
        raise table.source.refuse("E_AMBIGUOUS", f"two sampling rates: {error}", remedy) from error


def index_of_samples(table: RawTable) -> int | None:
    """Return the column that counts samples, None if there is none or several may."""
    columns = [i for i, name in enumerate(table.names) if name.strip(" .#").casefold() in _INDEX]
    return columns[0] if len(columns) == 1 else None


def noted_columns(table: RawTable, profile: Profile, assigned: Mapping[str, Assigned]) -> Iterator[Finding]:
    """Yield what is to be told of columns: taken beside others like them, or not taken though they may be needed."""
    columns = {role: entry.column for role, entry in assigned.items()}
    for role, own in columns.items():
        alike = table.columns(role, table.headers[own].dimension)
        measured = [i for i in alike if holds(table.headers[i].name, _MEASURED)]
        open_role = profile.channel(role).column is None and role not in table.chosen
        if open_role and len(alike) > 1 and measured == [own]:
            other = next(table.title(i) for i in alike if i != own)
            text = f"{table.title(own)!r} is taken as the {role}, not {other!r}: its name says it was measured"
            yield Finding("W_CHOSEN", text)
    named = named_after_currents(table.names)
    others = [table.names[i] for i in named if i != columns["force"]]
    if columns["force"] in named and others:
        text = f"the tests of {len(others)} columns named after other currents are not taken: {', '.join(others)}; "
        yield Finding("W_COLUMN", f"{text}to take each, leave [channels.force] column out of the profile")
    both = [role for role in ("displacement", "force") if role in columns and profile.channel(role).column is not None]
    further = {of: table.columns(of, table.headers[columns[of]].dimension) for of in both}
    further = {of: [i for i in alike if i != columns[of]] for of, alike in further.items()}
    noted = not others and (all(further.values()) if len(both) > 1 else len(further.get("force", ())) > 1)
    if noted:
        text = " and ".join(listed([table.title(i) for i in own], 3) for own in further.values())
        yield Finding("W_COLUMN", f"{text} not taken; if they are further tests, import each with a profile of its own")
    for role in [role for role in SIGNED if role in assigned and not noted]:
        same = _differing(table, columns[role])
        numbers = ", ".join(str(table.number(i)) for i in same if i != columns[role])
        name = table.headers[columns[role]].name
        text = f"of {len(same)} columns called {name!r} one is taken as the {role}, not {numbers}; "
        if same:
            yield Finding("W_COLUMN", f"{text}if these are further tests, write the condition of each into its name")
    for role, reason in _left_out(table, profile, columns).items():
        yield Finding("W_COLUMN", f"the {role} channel is not used: {reason}")
    for role, own in columns.items():
        header, channel = table.headers[own], profile.channel(role)
        unit, title = parse_unit(channel.unit or ""), table.title(own)
        if unit and header.known and unit.dimension == header.dimension and unit != header.known:
            text = f"{title!r} is read in {channel.unit}, as the profile states, not in its own {header.unit}"
            yield Finding("W_CHOSEN", text)
        if channel.scale not in (None, 1.0) and header.dimension == DIMENSION[role]:
            text = (
                f"{title!r} has the unit {header.unit}, and is multiplied by {channel.scale:g}, as the profile states"
            )
            yield Finding("W_CHOSEN", text)


def _left_out(table: RawTable, profile: Profile, columns: Mapping[str, int]) -> dict[str, str]:
    """Return optional channels that a column is named after but that its unit forbids to use, and why.

    A column without a unit is only told of if it may be the coil current, which no test can do without.
    """
    reasons = {}
    for role in OPTIONAL:
        if role in columns or (role == "current" and profile.current and not profile.current.values):
            continue
        try:
            column = _stated_or_chosen(table, role, profile, columns.values())
        except ColumnError as error:
            reasons[role] = error.found
            continue
        if column is not None and (table.headers[column].unit or role == "current"):
            problem = _unit_problem(table, role, column, table.headers[column].unit)
            if problem is not None:
                reasons[role] = problem.found
    several = [table.names[i] for i in coil_currents(table) if i not in columns.values()]
    if len(several) > 1 and not {"current"} & {*columns, *reasons}:
        reasons["current"] = f"{several[0]!r} and {several[1]!r} may both be it"
    return reasons


def coil_currents(table: RawTable) -> list[int]:
    """Return the columns in A that may be measured currents of the coil: no commands, computed ones, other devices."""
    columns = [i for i in table.columns(dimension="current") if not column_names.RATING.search(table.names[i])]
    names = {i: table.headers[i].name for i in columns}
    ends = {i: ["", *words_of(name)][-1].upper() for i, name in names.items()}
    motors = frozenset().union(*(of for of in _PHASES if len(of & {*ends.values()}) > 1))
    named = [i for i, n in names.items() if column_names.role_of(n) == "current" or column_names.says_nothing(n)]
    return [i for i in named if ends[i] not in motors]


def propose(table: RawTable) -> dict[str, tuple[int | None, str]]:
    """Column and unit of every channel as far as the file says them, for a profile to be completed."""
    proposed: dict[str, tuple[int | None, str]] = dict.fromkeys(REQUIRED, (None, ""))
    for role, i in _columns(table, Profile())[0].items():
        header = table.headers[i]
        with contextlib.suppress(RigFileError):  # two columns of its name differ, or two units are stated
            _refuse_two_values(table, role, i, Profile())
            proposed[role] = i, ""
            _refuse_two_units(table, role, i, header.unit)
            proposed[role] = i, header.unit if header.dimension == DIMENSION[role] else ""
    return proposed


def candidates_of(table: RawTable, role: str) -> list[int]:
    """Return the columns that may be a channel: the one its name tells, else all of its unit that name nothing else."""
    with contextlib.suppress(InputError):
        if (choice := _choose(table, role, ())) is not None:
            return [choice]
    nameless = [i for i in table.columns(dimension=DIMENSION[role]) if column_names.says_nothing(table.headers[i].name)]
    return table.columns(role, DIMENSION[role]) or nameless


def _choose(table: RawTable, role: str, taken: Collection[int]) -> int | None:
    if role in table.chosen:
        return table.chosen[role]
    headers = table.headers
    named = [i for i, header in enumerate(headers) if i not in taken and header.role == role]
    fitting = [i for i in named if headers[i].dimension == DIMENSION[role]]
    if not named:
        if role not in (*REQUIRED, "current"):
            return None
        # Without a telling name the unit decides, if it is the only one of its kind.
        fitting = table.columns(dimension=DIMENSION[role])
        fitting = [i for i in fitting if not column_names.names_command(headers[i].name)]
        free = [i for i in fitting if i not in taken and column_names.says_nothing(headers[i].name)]
        return free[0] if len(free) == 1 == len(fitting) else None
    candidates = fitting or named
    names = [headers[i].name.casefold() for i in candidates]
    _refuse_sum(table, role, candidates if role in SIGNED else ())
    if len(set(names)) > 1:
        measured = [i for i in candidates if holds(headers[i].name, _MEASURED)]
        if len(measured) == 1:
            return measured[0]
        exact = [i for i, name in zip(candidates, names, strict=True) if name in column_names.WORDS[role]]
        if len({headers[i].name.casefold() for i in exact}) == 1 or (exact and role == "time"):
            return exact[0]
        coils = [i for i in candidates if role == "current" and holds(headers[i].name, column_names.COIL)]
        if len(coils) == 1:
            return coils[0]
        if role == "time" and fitting:  # total and running time: refused if they run otherwise
            return min(fitting, key=lambda i: _TOTAL.search(headers[i].name) is None)
        if role not in REQUIRED:
            return None
        if len({headers[i].unit for i in candidates}) < len(candidates) or not _are_alike(table, candidates):
            raise _ambiguous(table, role, candidates)
    return candidates[0]


def _refuse_sum(table: RawTable, role: str, columns: Collection[int]) -> None:
    """Refuse columns of a channel that a line beside them adds up: damper force = Load_1 + Load_2."""
    for line in table.lines if columns else ():
        places = {i: place for i in table.columns(role) if (place := find_name(line, table.headers[i].name))}
        totals = {i for i, place in places.items() if "=" in line[place.end() :]}
        terms = [i for i in places if i not in totals]
        inner = line[
            min((places[i].end() for i in terms), default=0) : max((places[i].start() for i in terms), default=0)
        ]
        added = len(terms) > 1 and ("+" in inner or _SUM.search(line))
        if added and not {*columns}.isdisjoint(terms) and totals.isdisjoint(columns):
            first, *others = (toml(table.names[i]) for i in terms)
            remedy = f"set [channels.{role}] column = {first} and add = [{', '.join(others)}] in a profile"
            remedy += f", or its column and add = [] if one of them is the whole {role}"
            problem = f"the {role} may be a sum by the line {line.strip()[:120]!r}"
            raise table.source.refuse("E_AMBIGUOUS", problem, remedy, line=table.line)


def with_sums(table: RawTable, profile: Profile) -> RawTable:
    """Return the table with the columns that a profile adds to those of channels added to them, each by its unit.

    Raises `ColumnError` for one that is not there, or has a unit of something else.
    """
    for role, channel in ((role, of) for role, of in profile.channels.items() if of.add and of.column is not None):
        try:
            own = column_called(table, channel.column or "", role)
        except ColumnError:  # as of another table of the file
            continue
        further = [column_called(table, column, role, f"add of [channels.{role}]") for column in channel.add]
        headers, shares = table.headers, {own: 1.0}
        for i in further:
            if headers[i].dimension != headers[own].dimension:
                problem = f"{table.names[i]!r} is not in a unit of {table.names[own]!r} and cannot be added to it"
                raise _refusal(UnitError, table, problem, f"correct add of [channels.{role}]", "E_UNITS_DIMENSION")
            shares[i] = headers[i].factor / headers[own].factor

        def added(values: Mapping[int, Floats], shares: Mapping[int, float] = shares) -> Floats:
            return np.sum([factor * values[i] for i, factor in shares.items()], axis=0)

        text = f"the {role} is the sum of {' and '.join(repr(table.names[i]) for i in shares)}, as the profile states"
        table = table.computed(own, [*shares], added).noted(Finding("W_CHOSEN", text))
    return table


def column_called(table: RawTable, column: str | int, what: str, key: str = "") -> int:
    """Return the column that a profile names, for a channel or by another key; `ColumnError` if there is none."""
    remedy = f"correct {key or f'[channels.{what}]'} of the profile"
    if isinstance(column, int):
        numbers = [*map(table.number, range(len(table.names)))]
        if column not in numbers:
            shown = f"of the test: {listed(list(map(str, numbers)), 12)}" if table.numbers else f"{len(numbers)}"
            raise _refusal(ColumnError, table, f"no column {column}: there are {shown}", remedy)
        return numbers.index(column)
    wanted, named = column.strip(), split_name(column)
    with_unit = [f"{header.name} {header.known}" if header.unit else "" for header in table.headers]
    headings = (table.names, [header.name for header in table.headers], with_unit)
    # The last finds disp [mm] where the file has disp (mm), disp_mm or a row of units.
    for names, name in zip(headings, (wanted, wanted, f"{named.name} {named.known}"), strict=True):
        matches = [i for i, own in enumerate(names) if own == name]
        matches = matches or [i for i, own in enumerate(names) if own.casefold() == name.casefold()]
        if matches:
            return matches[0]
    problem = f"no column {column!r} for {what} (found {', '.join(filter(None, table.names))})"
    raise _refusal(ColumnError, table, problem, remedy)


def _missing(table: RawTable, columns: Mapping[str, int], profile: Profile) -> list[InputError]:
    """Return a refusal for every channel that no column is known to be."""
    missing = [r for r in REQUIRED if r not in columns and not (r == "time" and rate_of(table, profile))]
    if missing and not columns and not any(table.names):
        what = f"{len(table.names)} columns without names or units"
        remedy = (
            'name them in a profile, with their units: [file] names = ["time [s]", "displacement [mm]", "force [N]"]; '
            "where each file has one channel, set column = 1 and unit under [channels.time], and column, unit and "
            'file = "...{run}..." under [channels.displacement] and [channels.force]'
        )
        return [_refusal(UnitError, table, what, remedy, "E_UNITS_MISSING")]
    shown = ", ".join(map(table.title, range(len(table.names))))
    shown += "" if any(header.unit for header in table.headers) else ", without units"
    remedy = 'set [channels.{}] column = "..."{} in a profile'
    fixed = {"time": " or, with a fixed rate, [file] sample_rate_Hz = ..."}
    signals = [i for i, h in enumerate(table.headers) if h.dimension == "voltage" or holds(h.unit, _COUNTS)]
    if signals:  # a column alone would not do
        shown += f"; {', '.join(table.names[i] for i in signals)} in volts or counts without a scale"
        per = " or ".join(dict.fromkeys(table.headers[i].unit or "count" for i in signals))
        fixed |= dict.fromkeys(SIGNED, f", unit and scale (unit per {per} of its column)")
    if (len(table.names) == 2 and len(missing) > 1) or {*columns} & {*SIGNED, "current"}:  # several files
        each = ', and file = "...{run}..." where each file has one channel,'
        fixed |= {role: fixed.get(role, "") + each for role in missing if role != "time"}
    if computed := [name for name in table.names if holds(name, COMPUTED)]:
        shown += f"; computed, not measured: {', '.join(computed)}"
    beside = f"(found {shown})"
    if "force" in missing and named_after_currents(table.names):
        fixed["force"] = '; or, if columns named after currents are the force at each, unit = "..." alone'
    bare = {r: ' and unit = "..."' for r in missing if not signals and not table.columns(dimension=DIMENSION[r])}
    remedies = {r: remedy.format(r, bare.get(r, "") + fixed.get(r, "")) for r in missing}
    return [_refusal(ColumnError, table, f"no column is known to be {r} {beside}", remedies[r]) for r in missing]


def _ambiguous(table: RawTable, role: str, columns: Sequence[int]) -> RigFileError:
    problem = f"{' and '.join(repr(table.names[i]) for i in columns[:6])} may {'both' if len(columns) < 3 else 'each'}"
    problem += f" be the {role}"
    about = [line.strip()[:120] for line in table.lines if any(find_name(line, table.headers[i].name) for i in columns)]
    problem += f"; beside them stands {' and '.join(map(repr, about[:2]))}" if about else ""
    remedy = f'set [channels.{role}] column = "..."{_or_split(table)} in a profile'
    return table.source.refuse("E_AMBIGUOUS", problem, remedy, line=table.line)


def _or_split(table: RawTable) -> str:
    motions, forces = (len(table.columns(role)) for role in ("displacement", "force"))
    if motions == forces > 1:
        return ', or [file] blocks = "split" if each displacement has its force and is a test,'
    return ', or [file] blocks = "split" if each force is a test,' if motions == 1 and forces > 2 else ""


def sign_of(table: RawTable, profile: Profile, role: str) -> int | None:
    """Return the sign of a channel by the profile, else by a line of the file; 0 if it is unclear, None if unstated.

    Velocity and acceleration count as the displacement does.
    """
    channel = profile.channel(role)
    if "sign" in channel.model_fields_set:
        return channel.sign
    return table.senses.get(role) if role not in _DERIVED else sign_of(table, profile, "displacement")


def _convert(table: RawTable, role: str, column: int, profile: Profile, asks_current: bool = False) -> Assigned | None:
    header, channel, sign = table.headers[column], profile.channel(role), sign_of(table, profile, role)
    unit = channel.unit or header.unit
    unit = "degF" if role == "temperature" and (unit or column_names.unknown_unit(table.names[column])) == "F" else unit
    held = "velocity" if channel.integrate else role
    other = header.dimension not in (None, DIMENSION[held], "mass") and not currents_in(table.names[column])  # 0.5 A
    uncalibrated = other and channel.scale is None  # volts are no newtons
    for text in (unit, header.unit) if uncalibrated else (unit,):
        problem = _unit_problem(table, held, column, text)
        if problem is not None:
            if role in REQUIRED or (role == "current" and asks_current):
                raise problem
            return None
    if not channel.unit:
        _refuse_two_units(table, role, column, unit)
    name = table.names[column]
    if not sign and role in SIGNED and (sign == 0 or column_names.names_compression(name)):
        problem = f"column {name!r} may count compression positive"
        remedy = f"set [channels.{role}] sign = -1 in a profile, or sign = 1 if it counts extension positive"
        raise _refusal(ColumnError, table, problem, remedy, "E_SIGN_CONVENTION")
    if role in SIGNED and channel.scale is None:
        _refuse_volts_beside(table, role, profile)
        _refuse_factor(table, role, unit)
        _refuse_sum(table, role, [column] if "add" not in channel.model_fields_set else ())
    si = parse_unit(unit) or column_names.Unit("", 1.0)
    sign = sign or 1
    shift = 0.0 if channel.integrate else sign * (si.factor * channel.offset + si.offset)
    factor = sign * (channel.scale or 1.0) * si.factor
    return Assigned(column, header.name, unit, factor, shift + 0.0, 1e-3 * channel.delay_ms, sign)


def _refuse_interval(table: RawTable, role: str, column: int, profile: Profile) -> None:
    """Refuse a force with the ends of its interval beside it, force_low_N and force_high_N: it was predicted."""
    name, names = table.headers[column].name, {header.name.casefold() for header in table.headers}
    ends = ({f"{name}_{low}".casefold(), f"{name}_{high}".casefold()} for low, high in _ENDS)
    if role == "force" and profile.channel(role).column is None and any(own <= names for own in ends):
        problem = f"column {table.names[column]!r} has the ends of an interval beside it: a prediction, not measured"
        remedy = f"omit the file, or if it was measured set [channels.force] column = {toml(table.names[column])}"
        raise _refusal(ColumnError, table, problem, f"{remedy} in a profile")


def _refuse_volts_beside(table: RawTable, role: str, profile: Profile) -> None:
    """Refuse a unit that only the profile states where a line beside the columns has cells in volts: Y units, V."""
    only_stated = (profile.file.names or profile.channel(role).unit) and not table.columns(dimension="voltage")
    for line in table.lines if only_stated else ():
        cells = [cell.strip(' []()#"') for cell in re.split(r"[,;:=|\t]", line)]
        if {split_name("", cell).dimension for cell in cells if is_unit(cell)} == {"voltage"}:
            problem = f"the line {line.strip()[:80]!r} is in volts, and the {role} in the unit of the profile"
            remedy = f"give the calibration: [channels.{role}] unit and scale (unit per V) in a profile, 1 if applied"
            raise _refusal(UnitError, table, problem, remedy, "E_UNITS_DIMENSION")


def _refuse_factor(table: RawTable, role: str, unit: str) -> None:
    """Refuse a channel that a line says to multiply, or to have been multiplied: multiply force by 2."""
    for line in table.lines:
        times = _TIMES.search(line)
        if times is None or role not in map(column_names.role_of, words_of(line)):
            continue
        behind, before = _FACTOR.findall(line[times.end() :]), _FACTOR.findall(line[: times.start()])
        factor = float((behind or before[::-1] or ["1"])[0].replace(",", "."))
        if factor not in (0.0, 1.0):
            problem = f"{line.strip()[:80]!r} may be meant for the {role}"
            remedy = f'set [channels.{role}] unit = "{unit}" and scale = {factor:g} in a profile, or 1 if applied'
            raise _refusal(ColumnError, table, problem, remedy, "E_AMBIGUOUS")


def _holds_whole_numbers(table: RawTable, column: int) -> bool:
    values = table.try_read(column)
    return values is not None and np.array_equal(values[column], np.round(values[column]), equal_nan=True)


def _unit_problem(table: RawTable, role: str, column: int, unit: str) -> UnitError | None:
    parsed = parse_unit(unit)
    named = f"column {table.names[column] or table.number(column)!r}"
    if parsed is None and not unit and table.odd and table.odd[column]:
        stamps = ", or time stamps like 2024-03-31 01:59:59.123" if role == "time" else ""
        problem = f"{named} holds no numbers but {table.odd[column][:40]!r}"
        return _refusal(UnitError, table, problem, f"export it as numbers with a unit{stamps}", "E_NUMBER")
    if parsed is None:
        unit = unit or column_names.unknown_unit(table.names[column])
        problem = f"{named} has no unit" if not unit else f"{named} has the unit {unit!r}, which is not known"
        multiple = ", with scale = ... where it is a multiple of that" if unit else ""
        remedy = f'write it into the header, or set [channels.{role}] unit = "..." in a profile{multiple}'
        if unit.casefold() == "tonf":  # also 2000 lbf
            remedy = f'set [channels.{role}] unit = "tf" in a profile (1000 kgf), or unit = "lbf" and scale = 2000'
        if _CONVERTER.search(table.names[column]) or (role != "time" and _holds_whole_numbers(table, column)):
            remedy += ", with scale = ... (unit per count) and offset = ... (value at zero counts) of a converter"
        return _refusal(UnitError, table, problem, remedy, "E_UNITS_MISSING")
    if parsed.dimension == DIMENSION[role]:
        return None
    remedy = f"give the calibration: [channels.{role}] unit and scale (unit per {unit}) in a profile"
    if parsed.dimension == "mass" and role == "force":
        force = "kgf" if parsed.factor == 1 else "lbf"
        remedy = f'if the force of that weight is meant, set [channels.force] unit = "{force}" in a profile'
    elif parsed.dimension not in _OF_SENSORS:
        remedy += ", scale = 1 if it is in that unit already, or name another column"
    problem = f"{named} is in {unit}, which is no unit of {DIMENSION[role]}"
    return _refusal(UnitError, table, problem, remedy, "E_UNITS_DIMENSION")


def _refuse_two_units(table: RawTable, role: str, column: int, unit: str) -> None:
    """Refuse a column whose name and row of units, or a line beside the columns, state different units."""
    inner = split_name(table.names[column]) if table.units[column] else None
    other = parse_unit(unit)
    names = {header.name.casefold() for header in table.headers}
    lines = {of: line.strip() for line in table.lines for its, of in column_names.units_in(line, names) if its == role}
    stated = {of: f"the line {line[:80]!r}" for of, line in lines.items()}
    same = any(parse_unit(of) == other for of in stated)  # what else is stated may be that of other files
    if inner is not None and inner.dimension == DIMENSION[role]:
        stated, same = {inner.unit: "its name"}, inner.known == other
    if not stated or same or other is None:
        return
    own, where = next(iter(stated.items()))
    heading = "heading" if inner is None else "row of units"
    problem = f"column {table.names[column]!r} is in {unit} by its {heading} and in {own} by {where}"
    remedy = f'set one: [channels.{role}] unit = "..." in a profile'
    raise table.source.refuse("E_AMBIGUOUS", problem, remedy, line=table.line, column=table.number(column))


def _refuse_two_values(table: RawTable, role: str, column: int, profile: Profile) -> None:
    """Columns of one name must hold one thing, in whatever units."""
    stated = profile.channel(role).column
    exact = isinstance(stated, int) or table.names.count(stated or "") == 1  # Force [2] beside Force [1]
    if role not in REQUIRED or role in table.chosen or exact:
        return
    if same := _differing(table, column):
        problem = f"{len(same)} columns are called {table.headers[column].name!r} and differ"
        numbers = " or ".join(str(table.number(i)) for i in same[:6])
        remedy = f"rename one, or set its number: [channels.{role}] column = {numbers}{_or_split(table)} in a profile"
        raise table.source.refuse("E_DUPLICATE_COLUMN", problem, remedy, line=table.line, column=table.number(same[1]))


def _differing(table: RawTable, column: int) -> list[int]:
    """Return the columns of one name, which is that of a column, where they hold different things; else none."""
    headers = zip(table.headers, table.names, strict=True)  # t is no T, and data[1] no data[2]
    keys = [((h.name if h.role else name).casefold(), h.role, h.dimension) for h, name in headers]
    same = [i for i, key in enumerate(keys) if keys[column][0] and key == keys[column]]
    return same if len(same) > 1 and not _are_alike(table, same) else []


def _second_clock(table: RawTable, time: Assigned) -> list[InputError]:
    """Return the refusal of a file with another time that runs otherwise."""
    for other in [i for i in table.columns("time", "time") if i != time.column][:3]:
        values = table.try_read(time.column, other)
        if values is None:
            continue
        one, two = time.factor * values[time.column], table.headers[other].factor * values[other]
        there = np.isfinite(one) & np.isfinite(two)
        if np.count_nonzero(there) < 3:
            continue
        one, two = one[there] - one[there][0], two[there] - two[there][0]
        restarts = np.diff(two) < 0
        if restarts.any() and np.mean(restarts) < _MOST_RESTARTS:  # the time within a step or a cycle
            steps = np.abs(np.diff(one) - np.diff(two))[~restarts]
            if np.median(steps) <= 1e-3 * float(np.median(np.diff(one))):
                continue
        coarse = float(np.max(np.abs(np.diff(two)), initial=0.0))  # a clock that shows whole seconds
        if np.ptp(two) > 0 and np.max(np.abs(one - two)) > 1.5 * coarse + 1e-3 * float(np.ptp(one)):
            return [_ambiguous(table, "time", [time.column, other])]
    return []


def _are_alike(table: RawTable, columns: Sequence[int]) -> bool:
    """Tell if columns hold the same, each in its unit: a load in kgf, and that in N."""
    values = table.try_read(*columns)
    channels = [(values[i], table.headers[i]) for i in columns] if values else []
    return bool(channels) and all(_agree(*other, *channels[0]) for other in channels[1:])


def _agree(a: Floats, one: column_names.Header, b: Floats, other: column_names.Header) -> bool:
    if one.unit == other.unit:
        return np.array_equal(a, b, equal_nan=True)
    if one.known is None or other.known is None:
        return False
    spread = float(np.nanmax(np.abs(other.known.factor * b), initial=0.0))
    # Two roundings of one number: half a step of three digits each.
    return bool(np.allclose(one.known.factor * a, other.known.factor * b, rtol=0, atol=1e-3 * spread, equal_nan=True))


def _refusal(kind: type, table: RawTable, problem: str, remedy: str, code: str | None = None):
    where = table.source.name + (f", line {table.line}" if table.line else "")
    return kind(printable(problem), where=printable(where), remedy=remedy, code=code)
