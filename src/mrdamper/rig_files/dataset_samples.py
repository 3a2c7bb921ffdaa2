"""The samples of a dataset: one table of all runs, read under bounds of size, ratio and memory.

A Parquet file may crash its library, or hold far more than it weighs. It is read by the process
that reads rig files of that kind, and only the columns a dataset knows ever leave it.
"""

from __future__ import annotations

import csv
import io
import re
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import ColumnError, DatasetError, UnitError
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.archive import opened
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RawTable, RigFileError, Source
from mrdamper.rig_files.readers.parquet import Parquet, words_in
from mrdamper.rig_files.sandbox import guarded_tables

if TYPE_CHECKING:
    import polars as pl

SAMPLE_FILES = ("samples.parquet", "samples.csv.gz", "samples.csv")
REQUIRED = ("time_s", "displacement_m", "force_N")
OPTIONAL = ("current_A", "velocity_m_s")
_RATIO, _UNPACKED = 20, 2**28  # all columns together: so many times their file, or so many bytes
_HEADER = 2**20  # bytes a line of names may have
_UNIT = re.compile(r"^(time|displacement|force|current|velocity)[ _\[(]", re.IGNORECASE)
Channels = dict[str, Floats]


def read_samples(folder: Path, *, trusted: bool = False) -> dict[str, Channels]:
    """Read the samples of every run by its name: (N,) arrays by channel, NaN where a cell is empty.

    Raises `DatasetError` or `ColumnError` or `UnitError` if the file is missing, damaged or larger than a test can
    be, or lacks a column.
    No process guards the reading of a `trusted` file, which is our own.
    """
    path = next((folder / name for name in SAMPLE_FILES if (folder / name).is_file()), None)
    if path is None:
        raise DatasetError(f"none of {', '.join(SAMPLE_FILES)} is there", where=str(folder), remedy="add the samples")
    try:
        with opened(path) as source:
            if path.suffix != ".parquet":
                return _of_text(source, path)
            if trusted:
                return _of_parquet(Parquet().tables(source, FileForm())[0], path)
            with guarded_tables(source, Parquet(), FileForm()) as tables:
                return _of_parquet(tables[0], path)
    except RigFileError as error:
        raise DatasetError(error.found, where=str(path), remedy=error.remedy, code=error.code) from error


def _of_parquet(table: RawTable, path: Path) -> dict[str, Channels]:
    names = list(table.names)
    _require(names, path)
    ids = table.words(names.index("run_id"))
    channels: Channels = {}
    for at, name in enumerate(names):
        if name == "run_id" or (name not in (*REQUIRED, *OPTIONAL) and table.units[at]):
            continue  # the last are dates
        try:
            channels[name] = table.read([at]).values[at]
        except RigFileError as error:
            if error.code not in ("E_NUMBER", "E_UNSAFE"):
                raise
            refuse_text(name, path)
        packed = path.stat().st_size
        most = max(_UNPACKED, _RATIO * packed)
        if 8 * ids.codes.size * (len(channels) + 1) > most:
            problem = f"{packed:,} bytes unpack to over {most:,}"
            remedy = "a test does not compress like that; write the samples again"
            raise DatasetError(problem, where=str(path), remedy=remedy, code="E_ARCHIVE_RATIO")
    return _by_run(ids.codes, ids.labels, channels)


def _of_text(source: Source, path: Path) -> dict[str, Channels]:
    import polars as pl

    try:
        head = source.head(_HEADER)
        if len(head) == _HEADER and b"\n" not in head:
            problem = "no end of the first line"
            raise source.refuse("E_TOO_MANY_COLUMNS", problem, remedy="begin with a line of names")
        names = next(csv.reader(io.StringIO(head.split(b"\n", 1)[0].decode("utf-8-sig"))), [])
        if len(names) > MOST_COLUMNS:
            raise source.refuse("E_TOO_MANY_COLUMNS", f"{len(names)} columns", remedy="keep only the channels needed")
        _require(names, path)
        kinds = {c: pl.Float64 for c in (*REQUIRED, *OPTIONAL) if c in names}
        table = pl.read_csv(source.file, schema_overrides={"run_id": pl.String, **kinds})
    except (pl.exceptions.PolarsError, OSError, UnicodeDecodeError, csv.Error) as error:
        raise DatasetError(first_line(error), where=str(path), remedy="write the file again") from error
    ids = words_in(table["run_id"])
    names = [name for name in table.columns if name != "run_id"]
    names = [name for name in names if table.schema[name].is_numeric() or refuse_text(name, path)]
    channels = {name: table[name].cast(pl.Float64).fill_null(float("nan")).to_numpy() for name in names}
    return _by_run(ids.codes, ids.labels, channels)


def _require(names: list[str], path: Path) -> None:
    for column in ("run_id", *REQUIRED):
        if column not in names:
            raise missing_column(column, names, path)


def refuse_text(name: str, path: Path) -> bool:
    """Further columns may hold text, and are left out."""
    if name in (*REQUIRED, *OPTIONAL):
        remedy = "write plain numbers with a decimal point"
        raise ColumnError(f"column {name} holds text", where=str(path), remedy=remedy)
    return False


def _by_run(codes: np.ndarray, labels: tuple[str, ...], channels: Channels) -> dict[str, Channels]:
    """Rows of a run need not stand together; their order stays."""
    order = np.argsort(codes, kind="stable")
    if np.any(np.diff(order) != 1):  # else nothing is copied
        channels = {name: values[order] for name, values in channels.items()}
    bounds = pairwise([0, *np.cumsum(np.bincount(codes, minlength=len(labels)))])
    runs = zip(labels, bounds, strict=True)
    return {label: {name: of[start:stop] for name, of in channels.items()} for label, (start, stop) in runs}


def missing_column(column: str, present: list[str], path: Path) -> ColumnError | UnitError:
    """Make the error for a table without a column; it names the one that holds it in another unit."""
    quantity = column.split("_")[0]
    for other in present:
        if other.lower().startswith(quantity) and _UNIT.match(other):
            problem = f"column {other!r} where {column!r} is expected"
            return UnitError(problem, where=str(path), remedy="convert it to SI and rename it")
    shown = ", ".join(name[:40] for name in present[:20])
    return ColumnError(f"column {column} is missing (found {shown})", where=str(path), remedy="add it")


def first_line(error: Exception) -> str:
    """Return the message of a library in one line."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


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
