"""A motion from a CSV file: time_s, displacement_m, optionally current_A."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mrdamper.data import Floats, Run
from mrdamper.errors import ColumnError, DatasetError, RunError
from mrdamper.rig_files.dataset_samples import first_line, missing_column, refuse_text
from mrdamper.rig_files.readers.archive import opened
from mrdamper.rig_files.readers.base import RigFileError

if TYPE_CHECKING:
    import polars as pl

_NAMES = ("time_s", "displacement_m")


def load_motion(path: str | Path, current: float | None = None) -> Run:
    """Read a motion as a run without force.

    Raises `DatasetError` or `ColumnError` or `UnitError` or `RunError` if the file cannot be read, lacks a column, or
    its samples do not make a motion.

    Parameters
    ----------
    path : path
        CSV with the columns time_s [s], displacement_m [m], optionally current_A [A].
    current : float, optional
        Coil current [A] for the whole motion; wins over the column.
    """
    path = Path(path)
    table = read_table(path, "give a CSV with time_s and displacement_m")
    wanted = [*_NAMES, *(["current_A"] if current is None and "current_A" in table.columns else [])]
    columns = {name: _numbers(table, name, path) for name in wanted}
    if current is None and "current_A" not in columns:
        raise ColumnError("no current", where=str(path), remedy="give --current A, or a column current_A")
    _refuse_gap(columns["time_s"], path)
    return Run(
        id=path.stem,
        time=columns["time_s"],
        displacement=columns["displacement_m"],
        force=np.zeros(table.height),
        current=columns.get("current_A", np.array(current)),
        excitation="motion",
        notes={} if "current_A" in wanted or "current_A" not in table.columns else {"replaced": "the column current_A"},
    )


def read_table(path: Path, remedy: str) -> pl.DataFrame:
    """Read a small table from CSV, packed or not, within the bounds of a rig's file.

    Raises `DatasetError` if it is no such table.
    """
    import polars as pl

    try:
        with opened(path) as source:
            return pl.read_csv(source.file, infer_schema_length=10_000)
    except RigFileError as error:
        raise DatasetError(error.found, where=str(path), remedy=error.remedy if path.is_file() else remedy) from error
    except (pl.exceptions.PolarsError, OSError) as error:
        raise DatasetError(first_line(error), where=str(path), remedy="write it as comma-separated UTF-8") from error


def _numbers(table: pl.DataFrame, name: str, path: Path) -> Floats:
    """Return a column as doubles, none missing."""
    if name not in table.columns:
        raise missing_column(name, table.columns, path)
    values = table[name]
    if not values.dtype.is_numeric():
        refuse_text(name, path)
    if values.null_count():
        reason = f"column {name} has {values.null_count()} empty cells"
        raise ColumnError(reason, where=str(path), remedy="remove those rows")
    return values.to_numpy().astype(np.float64)


def _refuse_gap(time: Floats, path: Path) -> None:
    steps = np.diff(time)
    wide = steps > 5 * np.median(steps) if steps.size else np.zeros(0, dtype=bool)
    if wide.any():
        at = int(np.argmax(wide))
        problem = f"a gap of {steps[at]:.4g} s after {time[at]:.6g} s"
        remedy = "predict each part separately: the damper's state is unknown after a gap"
        raise RunError(problem, where=str(path), remedy=remedy, code="E_TIME_GAP")
