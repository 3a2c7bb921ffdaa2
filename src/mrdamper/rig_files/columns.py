"""Which column is time, displacement, force, ...: by its name and unit, or by the profile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import ColumnError, CombinedError, InputError, UnitError, printable
from mrdamper.rig_files.column_names import (
    WORDS,
    names_coil,
    names_compression,
    role_of,
    says_nothing,
    split_name,
    unknown_unit,
)
from mrdamper.rig_files.conditions import stated_rate
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import OPTIONAL, REQUIRED
from mrdamper.rig_files.units import DIMENSION, Unit, parse_unit

if TYPE_CHECKING:
    from mrdamper.rig_files.profile import Channel, Profile

ROLES = (*REQUIRED, *OPTIONAL)
_INDEX = frozenset(("sample", "samples", "sample no", "sample number", "index", "scan", "point", "n", "no", "nr"))


@dataclass(frozen=True, slots=True)
class Assigned:
    """Where a channel comes from and how its numbers become SI: factor * number + offset."""

    column: int  # position in the table
    name: str  # as the file has it, without the unit
    unit: str  # as the file or the profile has it
    factor: float
    offset: float = 0.0
    delay: float = 0.0  # how late the channel is [s]


def assign(table: RawTable, profile: Profile) -> dict[str, Assigned]:
    """Find the channels of a table.

    Parameters
    ----------
    table : RawTable
    profile : Profile
        Wins over what the names say.

    Returns
    -------
    dict
        `Assigned` by channel; the required ones are all there.

    Raises
    ------
    ColumnError
        E_COLUMN if a channel is not there or two may be it.
    UnitError
        E_UNITS_MISSING, E_UNITS_DIMENSION.
    RigFileError
        E_DUPLICATE_COLUMN if columns of one name differ.
    """
    headers = [split_name(name, unit) for name, unit in zip(table.names, table.units, strict=True)]
    found: dict[str, int] = {}
    problems: list[InputError] = []
    for role in ROLES:
        channel = profile.channels.get(role)
        if channel is not None and channel.column is not None:
            try:
                found[role] = _named(table, headers, channel.column, role)
            except ColumnError as error:
                if role in REQUIRED:
                    problems.append(error)
    taken = set(found.values())
    for role in ROLES:
        if role in found or (role == "time" and profile.file.sample_rate_Hz):
            continue
        if role == "current" and profile.current_is_given:
            continue
        try:
            choice = _choose(table, headers, role, taken)
        except InputError as error:
            problems.append(error)
            continue
        if choice is not None:
            found[role] = choice
            taken.add(choice)
    if not problems:
        problems += _missing(table, headers, found, profile)
    assigned = {}
    for role, column in found.items():
        channel = profile.channels.get(role)
        try:
            if role in REQUIRED and not isinstance(channel.column if channel else None, int):
                _refuse_two_values(table, headers, column)
            entry = _convert(table, headers, role, column, channel)
        except InputError as error:
            problems.append(error)
            continue
        if entry is not None:
            assigned[role] = entry
    if not problems and "time" in assigned and (profile.channels.get("time") is None):
        problems += _second_clock(table, headers, assigned["time"])
    CombinedError.raise_from(problems)
    return assigned


def rate_of(table: RawTable, profile: Profile) -> float | None:
    """Sampling rate [Hz] of a table without time stamps, by the profile or by what stands beside the columns.

    Raises
    ------
    RigFileError
        E_AMBIGUOUS if the file states two.
    """
    if profile.file.sample_rate_Hz:
        return profile.file.sample_rate_Hz
    decimal = table.form.get("decimal")
    try:
        return stated_rate(table.remarks, table.constants, decimal if isinstance(decimal, str) else None)
    except ValueError as error:
        raise table.source.refuse(
            "E_AMBIGUOUS", f"two sampling rates: {error}", "say [file] sample_rate_Hz = ... in a profile"
        ) from error


def index_of_samples(table: RawTable) -> int | None:
    """The column that counts samples, None if there is none or several may."""
    found = [i for i, name in enumerate(table.names) if name.strip(" .#").casefold() in _INDEX]
    return found[0] if len(found) == 1 else None


def left_out(table: RawTable, profile: Profile, found: Mapping[str, Assigned]) -> dict[str, str]:
    """Optional channels that a column is named after but that its unit forbids to use, and why.

    A column without a unit is only told of if it may be the coil current, which no test can do without.
    """
    headers = [split_name(name, unit) for name, unit in zip(table.names, table.units, strict=True)]
    taken = {entry.column for entry in found.values()}
    reasons = {}
    for role in OPTIONAL:
        if role in found or (role == "current" and profile.current_is_given):
            continue
        channel = profile.channels.get(role)
        try:
            stated = None if channel is None or channel.column is None else channel.column
            column = _choose(table, headers, role, taken) if stated is None else _named(table, headers, stated, role)
        except ColumnError as error:
            reasons[role] = error.found
            continue
        unit = "" if column is None else headers[column][1]
        if column is not None and (unit or role == "current"):
            problem = _unit_problem(table, role, column, unit, parse_unit(unit) if unit else None)
            if problem is not None:
                reasons[role] = problem.found
    return reasons


def propose(table: RawTable) -> dict[str, tuple[int | None, str]]:
    """Column and unit of every channel as far as the file says them, for a profile to be completed."""
    headers = [split_name(name, unit) for name, unit in zip(table.names, table.units, strict=True)]
    proposed: dict[str, tuple[int | None, str]] = {}
    taken: set[int] = set()
    for role in ROLES:
        try:
            choice = _choose(table, headers, role, taken)
        except InputError:
            choice = None
        if choice is not None:
            taken.add(choice)
            unit = headers[choice][1]
            proposed[role] = choice, unit if _dimension(unit) == DIMENSION[role] else ""
        elif role in REQUIRED:
            proposed[role] = None, ""
    return proposed


def _choose(table: RawTable, headers: Sequence[tuple[str, str]], role: str, taken: set[int]) -> int | None:
    named = [i for i, (name, _) in enumerate(headers) if i not in taken and role_of(name) == role]
    fitting = [i for i in named if _dimension(headers[i][1]) == DIMENSION[role]]
    if not named:
        if role not in (*REQUIRED, "current"):
            return None
        # Without a telling name the unit decides, if it is the only one of its kind.
        fitting = [i for i, (_, unit) in enumerate(headers) if _dimension(unit) == DIMENSION[role]]
        free = [i for i in fitting if i not in taken and says_nothing(headers[i][0])]
        return free[0] if len(free) == 1 == len(fitting) else None
    candidates = fitting or named
    if len({headers[i][0].casefold() for i in candidates}) > 1:
        exact = [i for i in candidates if headers[i][0].casefold() in WORDS[role]]
        if len({headers[i][0].casefold() for i in exact}) == 1 or (exact and role == "time"):
            return exact[0]
        coils = [i for i in candidates if role == "current" and names_coil(headers[i][0])]
        if len(coils) == 1:
            return coils[0]
        if role == "time" and fitting:
            return fitting[0]  # total and running time: refused if they run otherwise
        if role not in REQUIRED:
            return None
        raise _ambiguous(table, role, [table.names[i] for i in candidates])
    return candidates[0]


def _dimension(unit: str) -> str | None:
    parsed = parse_unit(unit) if unit else None
    return parsed.dimension if parsed else None


def _named(table: RawTable, headers: Sequence[tuple[str, str]], column: str | int, role: str) -> int:
    if isinstance(column, int):
        if not 1 <= column <= len(headers):
            raise _refusal(
                ColumnError, table, f"no column {column}: there are {len(headers)}", f"correct [channels.{role}]"
            )
        return column - 1
    wanted = column.strip()
    for names in (table.names, [name for name, _ in headers]):
        matches = [i for i, name in enumerate(names) if name == wanted]
        matches = matches or [i for i, name in enumerate(names) if name.casefold() == wanted.casefold()]
        if matches:
            return matches[0]
    shown = ", ".join(name for name in table.names if name)
    raise _refusal(
        ColumnError,
        table,
        f"no column {column!r} for {role} (found {shown})",
        f"correct [channels.{role}] of the profile",
    )


def _missing(
    table: RawTable, headers: Sequence[tuple[str, str]], found: Mapping[str, int], profile: Profile
) -> list[InputError]:
    """A refusal for every channel that no column is known to be."""
    missing = [r for r in REQUIRED if r not in found and not (r == "time" and rate_of(table, profile))]
    if missing and not any(table.names):
        return [
            _refusal(
                UnitError, table, f"{len(headers)} columns without names or units",
                "name them in a profile: [file] names = [...], [channels.force] unit = ...", "E_UNITS_MISSING",
            )
        ]  # fmt: skip
    shown = ", ".join(name or f"column {i}" for i, name in enumerate(table.names, 1))
    units = "" if any(unit for _, unit in headers) else ", without units"
    return [
        _refusal(
            ColumnError, table, f"no column is known to be {role} (found {shown}{units})",
            f'say [channels.{role}] column = "..."'
            + (" or, with a fixed rate, [file] sample_rate_Hz = ..." if role == "time" else "") + " in a profile",
        )
        for role in missing
    ]  # fmt: skip


def _ambiguous(table: RawTable, role: str, names: Sequence[str]) -> Exception:
    shown = " and ".join(repr(name) for name in names[:3])
    return table.source.refuse(
        "E_AMBIGUOUS",
        f"{shown} may both be the {role}",
        f'say [channels.{role}] column = "..." in a profile',
        line=table.line,
    )


def _convert(
    table: RawTable, headers: Sequence[tuple[str, str]], role: str, column: int, channel: Channel | None
) -> Assigned | None:
    name, stated = headers[column]
    unit = channel.unit if channel is not None and channel.unit else stated
    required = role in REQUIRED
    calibrated = channel is not None and channel.scale is not None
    uncalibrated = stated and not calibrated and _dimension(stated) == "voltage"  # no unit makes newtons of volts
    for text in (unit, stated if uncalibrated else unit):
        problem = _unit_problem(table, role, column, text, parse_unit(text) if text else None)
        if problem is not None:
            if required:
                raise problem
            return None
    if channel is None or not channel.unit:
        _refuse_two_units(table, role, column, unit)
    unsigned = channel is None or "sign" not in channel.model_fields_set
    if unsigned and role in ("displacement", "force") and names_compression(table.names[column]):
        raise _refusal(
            ColumnError, table, f"column {table.names[column]!r} may count compression positive",
            f"say [channels.{role}] sign = -1 in a profile, or sign = 1 if it counts extension positive",
            "E_SIGN_CONVENTION",
        )  # fmt: skip
    si = parse_unit(unit) or Unit("", 1.0)
    sign = channel.sign if channel is not None else 1
    scale, offset = (channel.scale or 1.0, channel.offset) if channel is not None else (1.0, 0.0)
    delay = 1e-3 * channel.delay_ms if channel is not None else 0.0
    shift = sign * (si.factor * offset + si.offset)
    return Assigned(column, name, unit, sign * scale * si.factor, shift + 0.0, delay)


def _unit_problem(table: RawTable, role: str, column: int, unit: str, parsed: Unit | None) -> UnitError | None:
    named = f"column {table.names[column] or column + 1!r}"
    if parsed is None and not unit and table.odd and table.odd[column]:
        stamps = ", or time stamps like 2024-03-31 01:59:59.123" if role == "time" else ""
        found = f"{named} holds no numbers but {table.odd[column][:40]!r}"
        return _refusal(UnitError, table, found, f"export it as numbers with a unit{stamps}", "E_NUMBER")
    if parsed is None:
        unit = unit or unknown_unit(table.names[column])
        found = f"{named} has no unit" if not unit else f"{named} has the unit {unit!r}, which is not known"
        mend = f'write it into the header, or say [channels.{role}] unit = "..." in a profile'
        return _refusal(UnitError, table, found, mend, "E_UNITS_MISSING")
    if parsed.dimension != DIMENSION[role]:
        mend = f'say [channels.{role}] unit = "..." in a profile, or name another column'
        if parsed.dimension == "mass" and role == "force":
            force = "kgf" if parsed.factor == 1 else "lbf"
            mend = f'if the force of that weight is meant, say [channels.force] unit = "{force}" in a profile'
        if parsed.dimension == "voltage":
            mend = f"give the calibration: [channels.{role}] unit and scale (unit per {unit}) in a profile"
        return _refusal(
            UnitError, table, f"{named} is in {unit}, which is no unit of {DIMENSION[role]}", mend, "E_UNITS_DIMENSION"
        )
    return None


def _refuse_two_units(table: RawTable, role: str, column: int, unit: str) -> None:
    """A name and a row of units must not say different things."""
    inner = split_name(table.names[column])[1] if table.units[column] else ""
    one, other = parse_unit(inner) if inner else None, parse_unit(unit)
    if one is None or other is None or one == other or one.dimension != DIMENSION[role]:
        return
    raise table.source.refuse(
        "E_AMBIGUOUS",
        f"column {table.names[column]!r} is in {inner} by its name and in {unit} by its row of units",
        f'say which: [channels.{role}] unit = "..." in a profile',
        line=table.line,
        column=column + 1,
    )


def _refuse_two_values(table: RawTable, headers: Sequence[tuple[str, str]], column: int) -> None:
    """Columns of one name must hold one thing, in whatever units."""
    name, unit = headers[column]
    same = [
        i
        for i, (other, its_unit) in enumerate(headers)
        if name and other.casefold() == name.casefold() and _dimension(its_unit) == _dimension(unit)
    ]
    if len(same) < 2:
        return
    try:
        values = table.read(same).values
        differ = any(not _agree(values[i], headers[i][1], values[column], unit) for i in same)
    except InputError:
        differ = True
    if differ:
        raise table.source.refuse(
            "E_DUPLICATE_COLUMN",
            f"{len(same)} columns are called {name!r} and differ",
            "rename one, or say which by its number: column = 2 in a profile",
            line=table.line,
            column=same[1] + 1,
        )


def _second_clock(table: RawTable, headers: Sequence[tuple[str, str]], time: Assigned) -> list[InputError]:
    """The refusal of a file with another time that runs otherwise."""
    others = [
        i for i, (name, unit) in enumerate(headers)
        if i != time.column and role_of(name) == "time" and _dimension(unit) == "time"
    ]  # fmt: skip
    for other in others[:3]:
        try:
            values = table.read([time.column, other]).values
        except InputError:
            continue
        unit = parse_unit(headers[other][1])
        one, two = time.factor * values[time.column], (unit.factor if unit else 1.0) * values[other]
        there = np.isfinite(one) & np.isfinite(two)
        if np.count_nonzero(there) < 3:
            continue
        one, two = one[there] - one[there][0], two[there] - two[there][0]
        coarse = float(np.max(np.abs(np.diff(two)), initial=0.0))  # a clock that shows whole seconds
        if np.ptp(two) > 0 and np.max(np.abs(one - two)) > 1.5 * coarse + 1e-3 * float(np.ptp(one)):
            return [_ambiguous(table, "time", [table.names[time.column], table.names[other]])]  # type: ignore[list-item]
    return []


def _agree(a: Floats, unit_a: str, b: Floats, unit_b: str) -> bool:
    if unit_a == unit_b:
        return np.array_equal(a, b, equal_nan=True)
    one, other = parse_unit(unit_a), parse_unit(unit_b)
    if one is None or other is None:
        return False
    spread = float(np.nanmax(np.abs(other.factor * b), initial=0.0))
    # Two roundings of one number: half a step of three digits each.
    return bool(np.allclose(one.factor * a, other.factor * b, rtol=0, atol=1e-3 * spread, equal_nan=True))


def _refusal(kind: type, table: RawTable, found: str, mend: str, code: str | None = None):
    where = table.source.name + (f", line {table.line}" if table.line else "")
    return kind(printable(found), where=printable(where), mend=mend, code=code)
