"""A record from a file: a ground motion, or a road over time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.wording import counted, number
from mrdamper.errors import ColumnError, RecordError, UnitError
from mrdamper.rig_files.dataset_samples import read_table
from mrdamper.systems.inputs.base import Input

STANDARD_GRAVITY = 9.81  # m/s² per g in the bundled records, as in published tables
_COLUMNS = {"acceleration_m_s2": 1.0, "acceleration_g": STANDARD_GRAVITY, "height_m": 1.0}
_JITTER = 0.02  # share of a step by which rounding may shift a time stamp
_STRONGEST = 50.0  # m/s²: five times the strongest recorded ground motion; beyond, the unit is wrong


@dataclass(frozen=True, eq=False)
class RecordedInput(Input):
    """Samples at equal steps, linearly interpolated."""

    name: ClassVar[str] = "record"
    title: ClassVar[str] = "a record"

    times: Floats  # (N,) [s]
    values: Floats  # (N,) [m/s²] for the ground, [m] for a road
    kind: Literal["ground", "road"] = "ground"

    @property
    def duration(self) -> float:
        return float(self.times[-1])

    @property
    def step(self) -> float:
        return float(self.times[1])

    def value(self, time: Floats) -> Floats:
        return np.interp(time, self.times, self.values)

    def rate(self, time: Floats) -> Floats:
        slope = np.append(np.diff(self.values) / np.diff(self.times), 0.0)
        at = np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, slope.size - 1)
        return slope[at]


def load_record(path: str | Path, time_scale: float = 1.0) -> RecordedInput:
    """Read a CSV with time_s and acceleration_m_s2, acceleration_g (9.81 m/s²) or height_m; raises `InputError`."""
    path = Path(path)
    table = read_table(path, "give a CSV with time_s, and acceleration_m_s2 (ground) or height_m (road)")
    table = table.rename({column: column.strip().lstrip("\ufeff") for column in table.columns})
    present = [name for name in _COLUMNS if name in table.columns]
    if len(present) > 1:
        raise ColumnError(f"both {' and '.join(present)}", where=str(path), remedy="keep one")
    if "time_s" not in table.columns or not present:
        missing = f"no column {'time_s' if present else ' or '.join(_COLUMNS)} (found {', '.join(table.columns)})"
        likely = any(c.lower().startswith(("time", "t_", "acc", "a_", "height")) for c in table.columns)
        remedy = "state the unit in the name: time_s; acceleration_m_s2 or acceleration_g (ground), height_m (road)"
        raise (UnitError if likely else ColumnError)(missing, where=str(path), remedy=remedy)
    columns = {}
    for name in ("time_s", present[0]):
        if not table[name].dtype.is_numeric() or table[name].null_count():
            raise ColumnError(f"column {name} holds text or empty cells", where=str(path), remedy="write plain numbers")
        columns[name] = table[name].to_numpy().astype(np.float64)
    return record(columns["time_s"], columns[present[0]], present[0], time_scale, where=str(path))


def record(
    time: Floats, values: Floats, quantity: str, time_scale: float = 1.0, where: str = "record"
) -> RecordedInput:
    """Make a record from its samples; `quantity` is a column name of `load_record`, which raises the same."""
    if quantity not in _COLUMNS:
        raise UnitError(f"quantity {quantity!r}", where=where, remedy=f"one of {', '.join(_COLUMNS)}")
    if time.size < 3:
        raise RecordError(counted(time.size, "sample"), where=where, remedy="give at least three")
    if (missing := np.flatnonzero(~(np.isfinite(time) & np.isfinite(values)))).size:
        problem = f"no number in {counted(missing.size, 'sample')}, the first of them sample {missing[0] + 1}"
        raise RecordError(problem, where=where, remedy="fill them by interpolation: the steps have to be equal")
    if not (np.isfinite(time_scale) and time_scale > 0):
        raise RecordError(f"time scale {time_scale:g}", where=where, remedy="give a positive number")
    steps = np.diff(time)
    step = float(np.median(steps))
    worst = int(np.argmax(np.abs(steps - step)))
    if step <= 0 or abs(steps[worst] - step) > _JITTER * step + 1e-9 * abs(time[-1]):
        raise RecordError(
            f"step of {steps[worst]:.6g} s after {time[worst]:.6g} s where others are {step:.6g} s",
            where=where,
            remedy="give samples at equal steps, in order of time",
            code="E_RECORD_STEP",
        )
    scaled = values * _COLUMNS[quantity]
    if quantity != "height_m" and np.abs(scaled).max() > _STRONGEST:
        raise UnitError(
            f"a peak of {number(np.abs(values).max())} in {quantity} is {number(np.abs(scaled).max())} m/s²",
            where=where,
            remedy="no ground moves like that: is it in cm/s² (gal), or m/s² under the name of g?",
        )
    clock = np.arange(time.size) * ((time[-1] - time[0]) / (time.size - 1) / time_scale)
    return RecordedInput(clock, scaled, "road" if quantity == "height_m" else "ground")
