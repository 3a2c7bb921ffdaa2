"""A dataset on disk: a folder with `runs.csv` and `samples.parquet` (or `samples.csv.gz`).

`load_dataset()` without a folder loads the bundled tests of two real dampers.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace as changed
from importlib.resources import as_file, files
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mrdamper.data import Condition, Dataset, Floats, Run
from mrdamper.data.arrays import chunks, drop_pages
from mrdamper.data.atomic import path_of, write_file, write_folder
from mrdamper.data.encoding import csv_text, csv_value
from mrdamper.data.wording import counted
from mrdamper.errors import ColumnError, DatasetError, OutputError, listed, shown, validate_arguments
from mrdamper.rig_files.coil_current import contradicted
from mrdamper.rig_files.dataset_samples import OPTIONAL, REQUIRED, SAMPLE_FILES, Channels, missing_column, read_samples
from mrdamper.rig_files.readers.base import MOST_COLUMNS
from mrdamper.rig_files.record import unique_names

if TYPE_CHECKING:
    import polars as pl

BUNDLED = "two_rigs"
_COLUMN = re.compile(r"(?:displacement|force) = .*?(?= in \S+(?:, [a-z]+ = |$))")  # in the note of a run's columns
_SAMPLES_PER_CHUNK = 2**17  # samples written at once; twice as many raise the peak of 1 GB of CSV by 50 MB
_MOST_RUNS, _RUNS_BYTES = 100_000, 2**26  # of a table of runs
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
    <dataset bundled tests of two dampers: 53 runs, 34 of rig labcontrol, 19 of rig utfsm; 12 validation runs>
    """
    if folder is None:
        with as_file(files("mrdamper.data.bundled") / BUNDLED) as bundled:
            return _load(Path(bundled), "bundled tests of two dampers", trusted=True)
    folder = path_of(folder)
    return _load(folder, folder.name or str(folder))


@validate_arguments("dataset")
def save_dataset(
    dataset: Dataset, folder: str | Path, *, extra_files: Mapping[str, str] | None = None, replace: bool = False
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
    dataset = dataset if isinstance(dataset, Dataset) else Dataset(dataset)
    with write_folder(folder, replace=replace) as target:
        (target / "runs.csv").write_text(csv_text([_row(run) for run in dataset]), encoding="utf-8")
        _write_samples(dataset, target)
        for name, text in (extra_files or {}).items():
            if Path(name).name != name:
                raise OutputError(f"{shown(name)} is no name of a file", remedy="leave folders out", code="E_PATH")
            (target / name).write_text(text, encoding="utf-8")


def store_split(folder: str | Path, held_out: Collection[str]) -> None:
    """Write into a dataset's runs.csv which runs are held out; nothing else changes.

    Raises `DatasetError` if runs.csv is missing or cannot be read.
    """
    folder = Path(folder)
    rows = runs_table(folder)
    for row in rows:
        row["split"] = "validate" if row["run_id"] in held_out else "train"
    with write_file(folder / "runs.csv") as path:
        path.write_text(csv_text(rows), encoding="utf-8")


def _load(folder: Path, name: str, *, trusted: bool = False) -> Dataset:
    table = runs_table(folder)
    samples = read_samples(folder, trusted=trusted)
    missing = [row["run_id"] for row in table if row["run_id"] not in samples]
    if missing:
        problem = f"run {missing[0]} has no samples" + (f" (and {len(missing) - 1} more)" if missing[1:] else "")
        raise DatasetError(problem, where=str(folder), remedy="add them, or remove the row from runs.csv")
    strangers = set(samples) - {row["run_id"] for row in table}
    if strangers:
        problem = f"samples name run {min(strangers)[:80]!r}, which runs.csv does not"
        raise DatasetError(problem, where=str(folder), remedy="add a row to runs.csv, or correct the run_id")
    path = folder / "runs.csv"
    return Dataset(tuple(run_of(row, samples[row["run_id"]], path) for row in table), name)


def runs_table(folder: Path) -> list[dict[str, Any]]:
    """Rows of a dataset's runs.csv by column; empty cells are None.

    Raises `DatasetError` or `ColumnError` if it is missing, cannot be read, or holds no run.
    """
    if folder.is_file():
        remedy = "give the folder that holds runs.csv; files of a rig become one with mrdamper import"
        raise DatasetError("a file, no dataset folder", where=str(folder), remedy=remedy)
    if not folder.is_dir():
        raise DatasetError("no such folder", where=str(folder), remedy="give a folder that holds runs.csv")
    path = folder / "runs.csv"
    if not path.is_file():
        hint = "write one row a run: run_id, current_A, ... (README, what a dataset is)"
        if any(p.is_file() and p.name not in SAMPLE_FILES for p in folder.iterdir()):
            hint = f"are these files of a rig? mrdamper import {folder} --out DATASET makes a dataset"
        if (folder / "identifications.csv").is_file() and any(folder.glob("model*.json")):
            hint = "this is the result of a study: give the dataset it was made from; load_model reads its model"
        raise DatasetError("runs.csv is missing", where=str(folder), remedy=hint)
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = _rows_of(csv.reader(file), path)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = str(error).splitlines()[0]
        raise DatasetError(reason, where=str(path), remedy="write it as comma-separated UTF-8") from error
    if not rows:
        raise DatasetError("no rows", where=str(path), remedy="add one row a run")
    return rows


def _rows_of(lines: Iterable[list[str]], path: Path) -> list[dict[str, Any]]:
    """Rows by column; empty cells are None."""

    def refuse(reason: str) -> DatasetError:
        return DatasetError(reason, where=str(path), remedy="write one row a run and one column a fact")

    if path.stat().st_size > _RUNS_BYTES:
        raise refuse(f"over {_RUNS_BYTES // 2**20} MB")
    lines = filter(None, lines)
    heads = next(lines, ["run_id"])
    if "run_id" not in heads:
        raise missing_column("run_id", heads, path)
    if len(set(heads)) < len(heads) or len(heads) > MOST_COLUMNS:
        raise refuse(f"{counted(len(heads), 'column')}, {len(set(heads))} of different names")
    rows = []
    for line in lines:
        if len(line) > len(heads):
            run = line[heads.index("run_id")][:80]
            raise refuse(f"{counted(len(line), 'cell')} under {counted(len(heads), 'column')} in the row of run {run}")
        if len(rows) == _MOST_RUNS:
            raise refuse(f"over {_MOST_RUNS:,} runs")
        rows.append({head: csv_value(cell) or None for head, cell in zip_longest(heads, line, fillvalue="")})
    return rows


def run_of(row: Mapping[str, str | None], samples: Channels, path: Path) -> Run:
    """Make a run from a row of a table and its channels.

    Raises `ColumnError` if a cell is no number, or nothing tells the current; `path` is where; `RunError` or
    `TimeOrderError` or `NonFiniteError` if the channels do not fit together.
    """
    where = f"{path}, run {row['run_id']}"

    def number(column: str) -> float | None:
        text = (row.get(column) or "").strip()
        if not text:
            return None
        try:
            value = float(text) if text.isascii() and "_" not in text else math.nan  # Python reads 1_0 as ten
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise ColumnError(f"{column} is {text!r}", where=where, remedy="give a number or leave the cell empty")
        return value

    channels = {n: values for n, values in samples.items() if n in REQUIRED or not np.isnan(values).all()}
    stated, current = number("current_A"), channels.get("current_A")
    if current is None:
        current = _driven(channels, number, where) if stated is None else stated
    elif stated is not None and (has := contradicted(current, stated)):
        raise ColumnError(
            f"current_A is {stated:g} A, and {has} in the samples", where=where, code="E_CURRENT_CONTRADICTS",
            remedy="if the samples are wrong, remove their current_A; else leave the cell of runs.csv empty",
        )  # fmt: skip
    start, end = number("steady_t0_s"), number("steady_t1_s")
    frequency, amplitude = number("nominal_frequency_Hz"), number("nominal_amplitude_m")
    nominal = None
    if frequency is not None and amplitude is not None:
        nominal = Condition(float(np.mean(current)), frequency, amplitude)
    return Run(
        id=row["run_id"] or "",
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
        further={name: values for name, values in channels.items() if name not in (*REQUIRED, *OPTIONAL)},
        notes={k: v for k, v in row.items() if k not in _KNOWN_RUN_COLUMNS and v},
    )


def _driven(channels: Channels, number: Callable[[str], float | None], where: str) -> Floats:
    """(N,) current [A] that a driver of stated gain makes of a command voltage."""
    from mrdamper.dampers.coil import Driver

    volts, gain = channels.get("voltage_V", number("voltage_V")), number("amperes_per_volt")
    if volts is None:
        raise ColumnError("no current_A", where=where, remedy="add the column current_A to runs.csv or to the samples")
    if gain is None:
        remedy = "add amperes_per_volt to runs.csv: the amplifier's, or one over the coil's resistance"
        raise ColumnError("voltage_V without a gain", where=where, remedy=remedy, code="E_DRIVER")
    driver = Driver(gain, number("resistance_ohm") or 0.0, number("inductance_H") or 0.0, number("limit_A"))
    return driver.current(channels["time_s"], np.broadcast_to(volts, channels["time_s"].shape))


def _row(run: Run) -> dict[str, Any]:
    window = run.window or (None, None)
    states = {name: v[run.in_window] for name, v in run.further.items() if name.endswith(("_C", "_Pa"))}  # of a damper
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
        **{name: f"{np.nanmean(v):.6g}" for name, v in states.items() if np.isfinite(v).any()},
        **run.notes,
    }


def _write_samples(dataset: Dataset, folder: Path) -> None:
    """All samples in one table; those of long records pass piece by piece, so that memory stays small."""
    import polars as pl

    path, tables, parts = folder / "samples.parquet", _samples(dataset), list[Path]()
    if sum(run.time.size for run in dataset) <= 16 * _SAMPLES_PER_CHUNK:
        pl.concat(tables, how="diagonal").write_parquet(path, compression="zstd", statistics=False)
        return
    while batch := _first_samples(tables, _SAMPLES_PER_CHUNK):
        parts.append(folder / f".part{len(parts)}.ipc")
        pl.concat(batch, how="diagonal").write_ipc(parts[-1], compression="uncompressed")
    pl.concat([pl.scan_ipc(part) for part in parts], how="diagonal").sink_parquet(
        path, compression="zstd", compression_level=2, statistics=False, row_group_size=_SAMPLES_PER_CHUNK
    )
    for part in parts:
        part.unlink()


def _first_samples(tables: Iterator[pl.DataFrame], fewest: int) -> list[pl.DataFrame]:
    """Take the next tables that together have at least so many samples, or all that are left."""
    taken: list[pl.DataFrame] = []
    while sum(table.height for table in taken) < fewest and (table := next(tables, None)) is not None:
        taken.append(table)
    return taken


def _samples(dataset: Dataset) -> Iterator[pl.DataFrame]:
    """Tables of at most some hundred thousand samples, in order, each of one run."""
    import polars as pl

    for run in dataset:
        channels = {"time_s": run.time, "displacement_m": run.displacement, "force_N": run.force}
        ends = [(float(np.min(piece)), float(np.max(piece))) for _, piece in chunks(run.current)]
        if min(low for low, _ in ends) != max(high for _, high in ends):  # a constant one can be corrected in runs.csv
            channels["current_A"] = run.current
        if run.velocity is not None:
            channels["velocity_m_s"] = run.velocity
        if taken := {*run.further} & {"run_id", *REQUIRED, *OPTIONAL}:
            problem = f"a further channel is called {min(taken)}, as a channel of every run is"
            raise OutputError(problem, where=f"run {run.id}", remedy="rename it")
        channels |= run.further
        for start in range(0, run.time.size, _SAMPLES_PER_CHUNK):
            inside = slice(start, start + _SAMPLES_PER_CHUNK)
            table = pl.DataFrame({name: np.array(values[inside]) for name, values in channels.items()})
            yield table.select(pl.lit(run.id).alias("run_id"), pl.all())
            for values in channels.values():
                drop_pages(values)


def with_tests(old: Dataset, new: Dataset) -> tuple[Dataset, list[str], list[str]]:
    """Return both datasets' runs, told apart by their names, and the names of two kinds of runs.

    First those of the old runs that new ones replace: of the same file and columns, read otherwise. Then those of the
    new runs that stay beside old ones of their file: of other columns, or of another rig.

    Raises `OutputError` if a test was read in the same way, or if its file gives another number of tests now.
    """
    files = {run.notes["sha256"] for run in old if run.notes.get("sha256")}
    again: dict[str, Run] = {}  # by the name of the run that it replaces
    fresh: list[Run] = []
    sources: dict[tuple[str, ...], list[Run]] = {}  # by file, its columns and the rig; those of no file each alone
    for run in new:
        digest = run.notes.get("sha256")
        sources.setdefault((digest, _columns(run), run.rig) if digest else (run.id,), []).append(run)
    for now in sources.values():
        digest = now[0].notes.get("sha256")
        before = [run for run in old if digest in files and run.notes.get("sha256") == digest]
        same = [run.id for run in before if any(_reads_alike(run, other) for other in now)]
        if same:
            raise OutputError(
                f"there already, read in the same way: {listed(same, 5)}",
                where=f"dataset {old.name}", remedy="give new files only, or a profile that reads these otherwise",
            )  # fmt: skip
        before = [run for run in before if run.rig == now[0].rig or not (run.rig and now[0].rig)]
        before = [run for run in before if _columns(run) == _columns(now[0])]
        if before and len(before) != len(now):
            raise OutputError(
                f"{listed([run.id for run in before], 5)} are of the same file, which gives {len(now)} tests now",
                where=f"dataset {old.name}", remedy="import into a new folder",
            )  # fmt: skip
        fresh += () if before else now
        again |= {one.id: other for one, other in zip(before, now, strict=False)}
    kept = [_replaced(run, again[run.id]) if run.id in again else run for run in old]
    names = unique_names((run.id for run in fresh), (run.id for run in old))
    added = [run if name == run.id else changed(run, id=name) for run, name in zip(fresh, names, strict=True)]
    return Dataset((*kept, *added), old.name), [*again], [run.id for run in added if run.notes.get("sha256") in files]


def _columns(run: Run) -> str:
    """Return the columns of the displacement and the force, whatever their units."""
    return " ".join(match[0] for match in _COLUMN.finditer(run.notes.get("columns", "")))


def _replaced(before: Run, now: Run) -> Run:
    """Return a run that was read again, with the name, split and further columns of runs.csv of the old one."""
    anew = ("columns", "sign_changed", "scaled", "time_from", "motion_stated", "findings")
    stated = {key: text for key, text in before.notes.items() if key not in anew}
    return changed(now, id=before.id, split=before.split, rig=now.rig or before.rig, notes={**now.notes, **stated})


def _reads_alike(one: Run, other: Run) -> bool:
    channels = ("time", "displacement", "force", "current")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in channels)
