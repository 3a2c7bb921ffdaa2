"""Parquet files with many dampers, one row per sample."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from mrdamper.data import Dataset, Run
from mrdamper.errors import ColumnError, InputError, UnitError
from mrdamper.fleet.item import FleetError, Item, make_item
from mrdamper.fleet.profile import FACTS, FleetProfile
from mrdamper.rig_files.dataset_folder import run_of
from mrdamper.rig_files.dataset_samples import OPTIONAL, REQUIRED


def is_parquet_folder(paths: Sequence[Path], profile: FleetProfile) -> bool:
    """Tell if the first readable of these files has a column for the serial number."""
    readable = (names for path in paths if (names := _columns(path)) is not None)
    return profile.column_of("serial", next(readable, ())) is not None


def parquet_items(paths: Sequence[Path], profile: FleetProfile) -> list[Item]:
    """Find the dampers of Parquet files and their rows in each; a file that cannot be used is an item with an error."""
    places_of: dict[Item, list[tuple[str, tuple[int, int]]]] = {}
    refused = []
    for path in paths:
        names = _columns(path)
        error = _refusal(path, names, profile)
        if names is None or error is not None:
            refused.append((path, error))
            continue
        columns = {fact: c for fact in FACTS if (c := profile.column_of(fact, names))}
        keys = [pl.col(column).cast(pl.String).alias(fact) for fact, column in columns.items()]
        table = pl.scan_parquet(path, hive_partitioning=False).select(keys).with_row_index("row")
        table = table.group_by(list(columns)).agg(pl.min("row").alias("first"), pl.max("row").alias("last"))
        try:
            with _refusing_damage(path):
                table = table.collect()
        except FleetError as damaged:
            refused.append((path, damaged))
            continue
        for row in table.sort(list(columns)).iter_rows(named=True):
            first, last = row.pop("first"), row.pop("last")
            if row["serial"] is None:
                error = FleetError(
                    "rows without a serial number", where=str(path), remedy="fill it in", code="E_FLEET_NAME"
                )
                refused.append((path, error))
                continue
            picks = tuple((columns[f], row[f] or "") for f in ("serial", "session", "date") if f in columns)
            item = make_item(row, profile, kind="lake", picks=picks)
            places_of.setdefault(item, []).append((str(path), (int(first), int(last - first + 1))))
    items = [Item(path.stem, kind="lake", paths=(str(path),), error=error) for path, error in refused]
    for item, places in places_of.items():
        items.append(replace(item, paths=tuple(p for p, _ in places), rows=tuple(r for _, r in places)))
    return items


def parquet_dataset(item: Item) -> Dataset:
    """Read the records of one damper from Parquet files; raises `InputError` if the channels of a run do not match."""
    parts = []
    for path, (first, count) in zip(item.paths, item.rows, strict=True):
        with _refusing_damage(Path(path)):
            part = pl.scan_parquet(path, hive_partitioning=False).slice(first, count)
            own = [pl.col(column).cast(pl.String).fill_null("") == cell for column, cell in item.picks]
            parts.append(part.filter(own).collect())
    table = pl.concat(parts, how="diagonal_relaxed")
    runs = [_run(rows, Path(item.paths[0])) for rows in table.partition_by("run_id", maintain_order=True)]
    return Dataset(tuple(runs), item.serial)


def _run(rows: pl.DataFrame, path: Path) -> Run:
    channels = {}
    for name in {*REQUIRED, *OPTIONAL} & set(rows.columns):
        if not rows[name].dtype.is_numeric():
            where = f"{path}, run {rows['run_id'][0]}"
            raise ColumnError(f"column {name} holds text", where=where, remedy="write plain numbers")
        channels[name] = np.array(rows[name].cast(float).fill_null(float("nan")).to_numpy())
    facts = {name: None if cell is None else str(cell) for name, cell in rows.row(0, named=True).items()}
    return run_of({name: cell for name, cell in facts.items() if name not in channels}, channels, path)


@contextmanager
def _refusing_damage(path: Path) -> Iterator[None]:
    """Convert any exception of the library on a damaged file to a refusal; its panics are no `Exception`."""
    try:
        yield
    except (InputError, KeyboardInterrupt, SystemExit, MemoryError):
        raise
    except BaseException as error:
        reason = (str(error).strip().splitlines() or ["unreadable"])[0][:120]
        raise FleetError(
            f"damaged Parquet ({reason})", where=str(path), remedy="write it again", code="E_FORMAT"
        ) from error


def _columns(path: Path) -> list[str] | None:
    try:
        with _refusing_damage(path):
            return [*pl.read_parquet_schema(path)]
    except FleetError:
        return None


def _refusal(path: Path, names: Sequence[str] | None, profile: FleetProfile) -> FleetError | ColumnError | None:
    if names is None:
        return FleetError("no Parquet file", where=str(path), remedy="write it again", code="E_FORMAT")
    if profile.column_of("serial", names) is None:
        return ColumnError("no column for the serial number", where=str(path), remedy="add a column serial")
    missing = [name for name in ("run_id", *REQUIRED, "current_A") if name not in names]
    if not missing:
        return None
    quantity = missing[0].split("_")[0]
    for other in names:
        if other.lower().startswith(quantity + "_"):
            return UnitError(  # type: ignore[return-value]
                f"column {other!r} where {missing[0]!r} is expected", where=str(path), remedy="convert it to SI"
            )
    return ColumnError(f"column {missing[0]} is missing", where=str(path), remedy="add it to this file")
