"""A motion to be predicted, from a file with the columns of a rig's file but without force."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrdamper.data import Floats, Run
from mrdamper.data.conditions import LONGEST
from mrdamper.data.wording import counted, number
from mrdamper.errors import ColumnError, InputError, RunError, UnitError
from mrdamper.rig_files.columns import Assigned, partly_assigned
from mrdamper.rig_files.file_records import test_tables
from mrdamper.rig_files.profile import Profile
from mrdamper.rig_files.readers import raw_tables
from mrdamper.rig_files.readers.base import Content, RawTable

_WIDE = 5.0  # step of time over the median step that is a gap
_REMEDY = "name the columns and their units, such as time_s, displacement_m or displacement_mm, current_A"


def load_motion(path: str | Path, current: float | None = None) -> Run:
    """Read a motion as a run without force: time, displacement and optionally current, each with its unit.

    The columns are read as those of a rig's file: `displacement_m`, `Displacement [mm]`, a row of units. A coil
    current [A] that is given for the whole motion wins over the column.

    Raises `InputError` if the file cannot be read, `ColumnError` or `UnitError` if a column or its unit is missing or
    a sample is, and `RunError` if the samples do not make a motion.
    """
    path = Path(path)
    with raw_tables(path) as tables:
        table, *others = test_tables(tables, Profile())
        if others:
            raise RunError(f"{1 + len(others)} motions", where=str(path), remedy="give each in a file of its own")
        columns = _columns(table, path, current is None)
        replaced = "" if current is None or "current" not in columns else table.names[columns.pop("current").column]
        content = table.read([entry.column for entry in columns.values()])
    channels = {role: _numbers(content, role, entry, path) for role, entry in columns.items()}
    time, displacement = channels["time"], channels["displacement"]
    if np.ptp(displacement) > 2 * LONGEST:
        problem = f"column {columns['displacement'].name} moves {number(np.ptp(displacement), 3)} m peak to peak"
        raise UnitError(problem, where=str(path), remedy="correct the unit in its heading, such as displacement_mm")
    steps = np.diff(time)
    wide = steps > _WIDE * np.median(steps) if steps.size else np.zeros(0, dtype=bool)
    if wide.any():
        at = int(np.argmax(wide))
        problem = f"a gap of {number(steps[at])} s after {time[at]:.6g} s"
        remedy = "predict each part separately: the damper's state is unknown after a gap"
        raise RunError(problem, where=str(path), remedy=remedy, code="E_TIME_GAP")
    return Run(
        id=path.stem,
        time=time,
        displacement=displacement,
        force=np.zeros(time.size),
        current=channels["current"] if current is None else np.array(current),
        excitation="motion",
        notes={"replaced": f"the column {replaced}"} if replaced else {},
    )


def _columns(table: RawTable, path: Path, needs_current: bool) -> dict[str, Assigned]:
    """Return the columns of time, displacement and current; a refusal has a remedy without a profile."""
    try:
        columns = partly_assigned(table, Profile(), ("time", "displacement"))
    except InputError as error:
        raise ColumnError(error.found, where=str(path), remedy=_REMEDY, code=error.code) from error
    if needs_current and "current" not in columns:
        raise ColumnError("no current", where=str(path), remedy="give --current A, or a column current_A")
    return {role: columns[role] for role in ("time", "displacement", "current") if role in columns}


def _numbers(content: Content, role: str, entry: Assigned, path: Path) -> Floats:
    values = entry.factor * content.values[entry.column] + entry.offset
    missing = np.flatnonzero(~np.isfinite(values))
    if missing.size:
        first = int(missing[0])
        place = f"sample {first + 1}" if content.lines is None else f"line {int(content.lines[first])}"
        problem = f"the {role} of {missing.size} of {counted(values.size, 'sample')} is missing, the first in {place}"
        raise ColumnError(problem, where=str(path), remedy="remove these rows or fill them by interpolation")
    return values
