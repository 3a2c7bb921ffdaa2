"""A dataset on disk: a folder with `runs.csv` and `samples.parquet` (or `samples.csv.gz`).

`load_dataset()` without a folder loads the bundled tests of two real dampers.
"""

from __future__ import annotations

import math
import re
import zlib
from collections.abc import Collection, Iterable
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mrdamper.data import Condition, Dataset, Run
from mrdamper.errors import ColumnError, DatasetError, UnitError
from mrdamper.files.atomic import path_of, write_file, write_folder
from mrdamper.files.encoding import csv_text, csv_value

if TYPE_CHECKING:
    import polars as pl

BUNDLED = "two_rigs"
_RATIO, _UNPACKED = 100, 2**28  # samples may grow so many times, or to so many bytes, when unpacked
SAMPLE_FILES = ("samples.parquet", "samples.csv.gz", "samples.csv")
_PIECE = 2**20  # samples written at once
_REQUIRED = ("time_s", "displacement_m", "force_N")
_OPTIONAL = ("current_A", "velocity_m_s")
_UNIT = re.compile(r"^(time|displacement|force|current|velocity)[ _\[(]", re.IGNORECASE)
_KNOWN_RUN_COLUMNS = (
    "run_id", "rig", "excitation", "current_A", "nominal_frequency_Hz", "nominal_amplitude_m",
    "steady_t0_s", "steady_t1_s", "split", "repeatability_nrmse_pp",
)  # fmt: skip


def load_dataset(folder: str | Path | None = None) -> Dataset:
    """Load a dataset folder, or the bundled tests of two real dampers.

    Parameters
    ----------
    folder : path, optional
        Holds `runs.csv` (one row a run) and `samples.parquet`, `samples.csv.gz` or
        `samples.csv` (run_id, time_s, displacement_m, force_N, optional current_A,
        velocity_m_s). Default: the bundled data.

    Raises
    ------
    DatasetError, ColumnError, UnitError
        If a file, column or run is missing, or a unit is not SI.
    RunError, TimeOrderError, NonFiniteError
        If the channels of a run do not fit together.

    Examples
    --------
    >>> from mrdamper import load_dataset
    >>> load_dataset()
    <dataset bundled tests of two dampers: 53 runs, 34 of rig labcontrol, 19 of rig utfsm; 12 held out>
    """
    if folder is None:
        with as_file(files("mrdamper.files.bundled") / BUNDLED) as bundled:
            return _load(Path(bundled), "bundled tests of two dampers")
    folder = path_of(folder)
    return _load(folder, folder.name or str(folder))


def save_dataset(
    dataset: Dataset, folder: str | Path, *, extra_files: dict[str, str] | None = None, replace: bool = False
) -> None:
    """Write a dataset folder, whole or not at all.

    Parameters
    ----------
    dataset : Dataset
    folder : path
        Must not exist, or be an empty folder, unless a dataset there is to be replaced.
    extra_files : dict, optional
        Further text files by name, for example licences.
    replace : bool
        Put it in the place of the dataset there, whose other files stay.

    Raises
    ------
    OutputError
        If the folder is not empty or cannot be written.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> from mrdamper import load_dataset, save_dataset
    >>> folder = mkdtemp()
    >>> save_dataset(load_dataset().rig("labcontrol"), folder)
    >>> len(load_dataset(folder))
    34
    """
    with write_folder(folder, replace=replace) as target:
        (target / "runs.csv").write_text(csv_text([_row(run) for run in dataset]), encoding="utf-8")
        _write_samples(dataset, target)
        for name, text in (extra_files or {}).items():
            (target / name).write_text(text, encoding="utf-8")


def store_split(folder: str | Path, held_out: Collection[str]) -> None:
    """Write into a dataset's runs.csv which runs are held out; nothing else changes.

    Raises
    ------
    DatasetError
        If runs.csv is missing or cannot be read.
    """
    folder = Path(folder)
    rows = _runs_table(folder)
    for row in rows:
        row["split"] = "validate" if row["run_id"] in held_out else "train"
    with write_file(folder / "runs.csv") as path:
        path.write_text(csv_text(rows), encoding="utf-8")


def _load(folder: Path, name: str) -> Dataset:
    table = _runs_table(folder)
    samples = _samples_table(folder)
    missing = [row["run_id"] for row in table if row["run_id"] not in samples]
    if missing:
        raise DatasetError(
            f"run {missing[0]} has no samples" + (f" (and {len(missing) - 1} more)" if missing[1:] else ""),
            where=str(folder),
            mend="add them, or remove the row from runs.csv",
        )
    strangers = set(samples) - {row["run_id"] for row in table}
    if strangers:
        raise DatasetError(
            f"samples name run {min(strangers)!r}, which runs.csv does not",
            where=str(folder),
            mend="add a row to runs.csv, or correct the run_id",
        )
    return Dataset(tuple(_run(row, samples[row["run_id"]], folder) for row in table), name)


def _runs_table(folder: Path) -> list[dict[str, Any]]:
    import polars as pl

    if not folder.is_dir():
        raise DatasetError("no such folder", where=str(folder), mend="give a folder that holds runs.csv")
    path = folder / "runs.csv"
    if not path.is_file():
        hint = "write one row a run: run_id, current_A, ... (README, what a dataset is)"
        if _holds_rig_files(folder):
            hint = f"are these files of a rig? mrdamper import {folder.name or folder} --out DATASET makes a dataset"
        raise DatasetError("runs.csv is missing", where=str(folder), mend=hint)
    try:
        table = pl.read_csv(path, infer_schema_length=0)
    except (pl.exceptions.PolarsError, OSError) as error:
        raise DatasetError(_first_line(error), where=str(path), mend="write it as comma-separated UTF-8") from error
    if "run_id" not in table.columns:
        raise _missing_column("run_id", table.columns, path)
    if not table.height:
        raise DatasetError("no rows", where=str(path), mend="add one row a run")
    return [{k: v and csv_value(v) for k, v in row.items()} for row in table.to_dicts()]


def _holds_rig_files(folder: Path) -> bool:
    return any(p.is_file() and p.name not in SAMPLE_FILES for p in folder.iterdir())


def _samples_table(folder: Path) -> dict[str, pl.DataFrame]:
    import polars as pl

    for name in SAMPLE_FILES:
        path = folder / name
        if path.is_file():
            break
    else:
        raise DatasetError(f"none of {', '.join(SAMPLE_FILES)} is there", where=str(folder), mend="add the samples")
    try:
        _refuse_bomb(path)
        if path.suffix == ".parquet":
            table = pl.read_parquet(path)
        else:
            header = pl.read_csv(path, n_rows=0, infer_schema_length=0).columns
            numbers = {c: pl.Float64 for c in (*_REQUIRED, *_OPTIONAL) if c in header}
            table = pl.read_csv(path, schema_overrides={"run_id": pl.String, **numbers})
    except (pl.exceptions.PolarsError, OSError, EOFError, zlib.error) as error:
        raise DatasetError(_first_line(error), where=str(path), mend="write the file again") from error
    for column in ("run_id", *_REQUIRED):
        if column not in table.columns:
            raise _missing_column(column, table.columns, path)
    wanted = [c for c in (*_REQUIRED, *_OPTIONAL) if c in table.columns]
    further = [c for c in table.columns if c not in ("run_id", *wanted) and table.schema[c].is_numeric()]
    for column in wanted:
        if not table.schema[column].is_numeric():
            raise ColumnError(
                f"column {column} holds text",
                where=str(path),
                mend="write plain numbers with a decimal point",
            )
    table = table.select(pl.col("run_id").cast(pl.String), *(pl.col(c).cast(pl.Float64) for c in (*wanted, *further)))
    groups = table.partition_by("run_id", as_dict=True, maintain_order=True)
    return {str(key[0]): group for key, group in groups.items()}


def _refuse_bomb(path: Path) -> None:
    """Refuse samples that grow a hundredfold and beyond what a test could hold, before they are unpacked."""
    import gzip

    import polars as pl

    packed, unpacked = path.stat().st_size, 0
    most = max(_UNPACKED, _RATIO * packed)
    if path.suffix == ".parquet":
        lazy = pl.scan_parquet(path)
        unpacked = 8 * lazy.select(pl.len()).collect().item() * len(lazy.collect_schema())
    elif path.suffix == ".gz":
        with gzip.open(path) as file:
            while unpacked <= most and (piece := file.read(2**22)):
                unpacked += len(piece)
    if unpacked > most:
        raise DatasetError(
            f"{packed:,} bytes unpack to over {most:,}",
            where=str(path),
            mend="a test does not compress like that; write the samples again",
            code="E_ARCHIVE_RATIO",
        )


def _run(row: dict[str, Any], samples: pl.DataFrame, folder: Path) -> Run:
    where = f"{folder / 'runs.csv'}, run {row['run_id']}"

    def number(column: str) -> float | None:
        text = (row.get(column) or "").strip()
        if not text:
            return None
        try:
            value = float(text) if text.isascii() and "_" not in text else math.nan  # Python reads 1_0 as ten
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise ColumnError(f"{column} is {text!r}", where=where, mend="give a number or leave the cell empty")
        return value

    channels = {
        name: samples[name].to_numpy()
        for name in samples.columns
        if name != "run_id" and (name in _REQUIRED or samples[name].null_count() < samples.height)
    }
    current = channels.get("current_A", number("current_A"))
    if current is None:
        raise ColumnError("no current_A", where=where, mend="add the column current_A to runs.csv or to the samples")
    start, end = number("steady_t0_s"), number("steady_t1_s")
    frequency, amplitude = number("nominal_frequency_Hz"), number("nominal_amplitude_m")
    nominal = None
    if frequency is not None and amplitude is not None:
        nominal = Condition(float(np.mean(current)), frequency, amplitude)
    return Run(
        id=row["run_id"],
        time=channels["time_s"],
        displacement=channels["displacement_m"],
        force=channels["force_N"],
        current=np.asarray(current, dtype=float),
        velocity=channels.get("velocity_m_s"),
        rig=row.get("rig") or "",
        excitation=row.get("excitation") or "sine",
        split=(row.get("split") or "train").strip(),  # type: ignore[arg-type]
        nominal=nominal,
        window=None if start is None or end is None else (start, end),
        repeatability=number("repeatability_nrmse_pp"),
        further={name: values for name, values in channels.items() if name not in (*_REQUIRED, *_OPTIONAL)},
        notes={k: v for k, v in row.items() if k not in _KNOWN_RUN_COLUMNS and v},
    )


def _row(run: Run) -> dict[str, Any]:
    window = run.window or (None, None)
    return {
        "run_id": run.id,
        "rig": run.rig,
        "excitation": run.excitation,
        "current_A": None if run.current_changes else run.current_A,
        "nominal_frequency_Hz": run.nominal.frequency_Hz if run.nominal else None,
        "nominal_amplitude_m": run.nominal.amplitude_m if run.nominal else None,
        "steady_t0_s": window[0],
        "steady_t1_s": window[1],
        "split": run.split,
        "repeatability_nrmse_pp": run.repeatability,
        **{name: f"{np.nanmean(v[run.in_window]):.6g}" for name, v in run.further.items() if _summarised(name, v, run)},
        **run.notes,
    }


def _summarised(name: str, values: np.ndarray, run: Run) -> bool:
    """Whether a mean of a further channel says something: of a state of the damper, not of a motion or a force."""
    return name.endswith(("_C", "_Pa")) and bool(np.isfinite(values[run.in_window]).any())


def _write_samples(dataset: Dataset, folder: Path) -> None:
    """All samples in one table; those of long records pass piece by piece, so that memory stays small."""
    import polars as pl

    path = folder / "samples.parquet"
    if sum(run.time.size for run in dataset) <= 2 * _PIECE:
        pl.concat(_samples(dataset), how="diagonal").write_parquet(path, compression="zstd", statistics=False)
        return
    parts = []
    for number, table in enumerate(_samples(dataset)):
        parts.append(folder / f".part{number}.parquet")
        table.write_parquet(parts[-1], compression="zstd", compression_level=1, statistics=False)
    schemas = [pl.read_parquet_schema(part) for part in parts]
    names = list(dict.fromkeys(name for schema in schemas for name in schema))
    tables = [
        pl.scan_parquet(part).with_columns(pl.lit(None, pl.Float64).alias(n) for n in names if n not in schema)
        for part, schema in zip(parts, schemas, strict=True)
    ]
    pl.concat([table.select(names) for table in tables]).sink_parquet(
        path, compression="zstd", statistics=False, row_group_size=_PIECE // 4
    )
    for part in parts:
        part.unlink()


def _samples(dataset: Dataset) -> Iterable[pl.DataFrame]:
    """Tables of at most a million samples, in order."""
    import polars as pl

    varying = any(_varies(run.current) for run in dataset)
    for run in dataset:
        channels = {"time_s": run.time, "displacement_m": run.displacement, "force_N": run.force}
        if varying:
            channels["current_A"] = run.current
        if run.velocity is not None:
            channels["velocity_m_s"] = run.velocity
        channels |= run.further
        for start in range(0, run.time.size, _PIECE):
            inside = slice(start, min(start + _PIECE, run.time.size))
            size = inside.stop - inside.start
            columns = {name: np.array(values[inside]) for name, values in channels.items()}
            yield pl.DataFrame({"run_id": pl.repeat(run.id, size, eager=True), **columns})


def _varies(current: np.ndarray) -> bool:
    return float(np.min(current)) != float(np.max(current))


def _missing_column(column: str, present: list[str], path: Path) -> ColumnError | UnitError:
    quantity = column.split("_")[0]
    for other in present:
        if other.lower().startswith(quantity) and _UNIT.match(other):
            return UnitError(
                f"column {other!r} where {column!r} is expected",
                where=str(path),
                mend="convert it to SI and rename it",
            )
    return ColumnError(f"column {column} is missing (found {', '.join(present)})", where=str(path), mend="add it")


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0]
