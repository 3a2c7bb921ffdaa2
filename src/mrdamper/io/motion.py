"""A motion from a CSV file: time_s, displacement_m, optionally current_A."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrdamper.data import Run
from mrdamper.errors import ColumnError, DatasetError, RunError, UnitError

_NAMES = ("time_s", "displacement_m")


def load_motion(path: str | Path, current: float | None = None) -> Run:
    """Read a motion as a run without force.

    Parameters
    ----------
    path : path
        CSV with the columns time_s [s], displacement_m [m], optionally current_A [A].
    current : float, optional
        Coil current [A] for the whole motion; wins over the column.

    Raises
    ------
    DatasetError, ColumnError, UnitError, RunError
        If the file cannot be read, lacks a column, or its samples do not make a motion.
    """
    import polars as pl

    path = Path(path)
    if not path.is_file():
        raise DatasetError("no such file", where=str(path), mend="give a CSV with time_s and displacement_m")
    try:
        table = pl.read_csv(path, infer_schema_length=10_000)
    except (pl.exceptions.PolarsError, OSError) as error:
        raise DatasetError(
            str(error).splitlines()[0], where=str(path), mend="write it as comma-separated UTF-8"
        ) from error
    for name in _NAMES:
        if name not in table.columns:
            near = [c for c in table.columns if c.lower().startswith(name.split("_")[0])]
            if near:
                raise UnitError(
                    f"column {near[0]!r} where {name!r} is expected",
                    where=str(path),
                    mend="convert it to SI and rename it",
                )
            raise ColumnError(
                f"column {name} is missing (found {', '.join(table.columns)})", where=str(path), mend="add it"
            )
    wanted = [*_NAMES, *(["current_A"] if current is None and "current_A" in table.columns else [])]
    for name in wanted:
        if not table.schema[name].is_numeric():
            raise ColumnError(
                f"column {name} holds text", where=str(path), mend="write plain numbers with a decimal point"
            )
        if table[name].null_count():
            raise ColumnError(
                f"column {name} has {table[name].null_count()} empty cells", where=str(path), mend="remove those rows"
            )
    columns = {name: table[name].cast(pl.Float64).to_numpy() for name in wanted}
    if current is None and "current_A" not in columns:
        raise ColumnError("no current", where=str(path), mend="give --current A, or a column current_A")
    steps = np.diff(columns["time_s"])
    if steps.size and np.any(steps > 5 * np.median(steps)):
        at = int(np.argmax(steps > 5 * np.median(steps)))
        raise RunError(
            f"a gap of {steps[at]:.4g} s after {columns['time_s'][at]:.6g} s",
            where=str(path),
            mend="predict the parts one by one: the damper's state is unknown after a gap",
            code="E_TIME_GAP",
        )
    return Run(
        id=path.stem,
        time=columns["time_s"],
        displacement=columns["displacement_m"],
        force=np.zeros(table.height),
        current=columns.get("current_A", np.array(current)),
        excitation="motion",
    )
