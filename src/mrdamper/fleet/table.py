"""Table of a fleet: rows of the journal as one Parquet file, one row per damper, in constant memory."""

import shutil
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import polars as pl

from mrdamper.data.atomic import write_file
from mrdamper.fleet.plan import Plan

_ROWS_IN_MEMORY, _ROWS_PER_GROUP = 1_000, 10_000  # rows held in memory, and rows of a group in the file
TIMES = ("wall_time_s", "cpu_time_s", "finished_time_utc", "host_name")  # differ from run to run; nothing else does
_TEXT = (
    "serial", "session", "batch", "date", "golden", "rig", "status", "code", "reason", "findings", "lane", "model",
    "at_bounds", "study",
)  # fmt: skip
_NUMBERS = (
    "cost", "nrmse_pp", "nrmse_pp_worst", "study_cv_nrmse_pp", "gas_force_N", "friction_N",
    "loop_deviation", "shape_deviation",
)  # fmt: skip


def write_table(rows: Iterable[dict[str, Any]], parameters: Iterable[str], plan: Plan | None, path: Path) -> None:
    """Write rows as Parquet, atomically.

    Each of the model's parameters becomes a column `p_NAME`, its standard error `se_NAME`; the plan's velocities become
    columns `rebound_N_0.1m_s_1A` and `compression_N_...`. Raises `OutputError` or `ResourceError` (E_DISK_FULL) if the
    file cannot be written.
    """
    forces = () if plan is None else force_columns(plan)
    schema = _schema(tuple(parameters), forces)
    with write_file(path) as target:
        parts = target.parent / "parts"
        parts.mkdir()
        for number, some in enumerate(_chunks(rows)):
            part = pl.DataFrame([_flat(row, forces) for row in some], schema=schema)
            part.write_parquet(parts / f"{number:06}.parquet", compression="zstd")
        pl.scan_parquet(parts / "*.parquet").sink_parquet(target, compression="zstd", row_group_size=_ROWS_PER_GROUP)
        shutil.rmtree(parts)


def _chunks(rows: Iterable[dict[str, Any]]) -> Iterator[list[dict[str, Any]]]:
    left = iter(rows)
    while some := list(islice(left, _ROWS_IN_MEMORY)):
        yield some


def force_columns(plan: Plan) -> tuple[str, ...]:
    """Names of the forces of a velocity ladder, in its order."""
    return tuple(
        f"{way}_N_{speed:g}m_s_{current:g}A"
        for current in plan.currents
        for speed in plan.speeds
        for way in ("rebound", "compression")
    )


def _schema(parameters: tuple[str, ...], forces: tuple[str, ...]) -> dict[str, pl.DataType]:
    kinds: dict[str, Any] = dict.fromkeys(_TEXT, pl.String)
    kinds["golden"] = pl.Boolean
    kinds |= dict.fromkeys(("runs", "tests_missing"), pl.Int64)
    kinds |= dict.fromkeys(
        (*_NUMBERS, *(f"{what}_{name}" for name in parameters for what in ("p", "se")), *forces), pl.Float64
    )
    kinds["loops"] = pl.List(pl.List(pl.Float64))
    kinds |= {name: pl.Float64 if name.endswith("_s") else pl.String for name in TIMES}
    return kinds


def _flat(row: dict[str, Any], forces: tuple[str, ...]) -> dict[str, Any]:
    parameters = {f"p_{name}": value for name, value in (row.get("parameters") or {}).items()}
    parameters |= {f"se_{name}": value for name, value in (row.get("standard_errors") or {}).items()}
    return {**row, **parameters, **dict(zip(forces, row.get("ladder") or (), strict=False))}
