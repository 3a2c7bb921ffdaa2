"""Synthetic rig files: one clean test in many formats."""

from __future__ import annotations

import io
import json
from contextlib import closing
from pathlib import Path

import numpy as np

RATE, FREQUENCY, AMPLITUDE = 200.0, 1.0, 0.02  # [Hz], [Hz], [m]
NAMES = ("time_s", "displacement_mm", "force_N")


def channels(samples: int = 600, seed: int = 1) -> dict[str, np.ndarray]:
    """SI channels of a sine test with 5 N of noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples) / RATE
    phase = 2 * np.pi * FREQUENCY * t
    v = 2 * np.pi * FREQUENCY * AMPLITUDE * np.cos(phase)
    force = 800 * np.tanh(v / 0.01) + 1500 * v + rng.normal(0, 5, samples)
    return {"time": t, "displacement": AMPLITUDE * np.sin(phase), "force": force, "velocity": v}


def rows(samples: int = 600, seed: int = 1) -> np.ndarray:
    """Time [s], displacement [mm], force [N]."""
    c = channels(samples, seed)
    return np.column_stack([c["time"], 1e3 * c["displacement"], c["force"]])


def text(
    table: np.ndarray | None = None,
    header: tuple[str, ...] = (",".join(NAMES),),
    separator: str = ",",
    decimal: str = ".",
    end: str = "\n",
    closed: bool = True,
) -> str:
    """A delimited text."""
    table = rows() if table is None else table
    lines = [separator.join(f"{cell:.6f}".replace(".", decimal) for cell in row) for row in table]
    return end.join([*header, *lines]) + (end if closed else "")


def lines_of(edit: dict[int, str] | None = None, **kwargs) -> str:
    """A text whose given lines (from one) are replaced."""
    lines = text(**kwargs).split("\n")
    for number, line in (edit or {}).items():
        lines[number - 1] = line
    return "\n".join(lines)


def write(folder: Path, name: str, content: str | bytes, encoding: str = "utf-8") -> Path:
    """Put a file into a folder."""
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode(encoding))
    return path


def columns(seed: int = 1) -> dict[str, np.ndarray]:
    """The columns of `NAMES`."""
    return dict(zip(NAMES, rows(seed=seed).T, strict=True))


def npz_bytes(**arrays) -> bytes:
    target = io.BytesIO()
    np.savez(target, **arrays)
    return target.getvalue()


def xlsx_bytes(table: list[list], sheets: dict[str, list[list]] | None = None) -> bytes:
    from openpyxl import Workbook

    book = Workbook()
    assert book.active is not None
    book.active.title = "Data"
    for row in table:
        book.active.append(row)
    for title, other in (sheets or {}).items():
        sheet = book.create_sheet(title)
        for row in other:
            sheet.append(row)
    target = io.BytesIO()
    book.save(target)
    return target.getvalue()


def parquet_bytes(table: dict[str, np.ndarray]) -> bytes:
    import polars as pl

    target = io.BytesIO()
    pl.DataFrame(table).write_parquet(target)
    return target.getvalue()


def feather_bytes(table: dict[str, np.ndarray]) -> bytes:
    import polars as pl

    target = io.BytesIO()
    pl.DataFrame(table).write_ipc(target)
    return target.getvalue()


def cdf_bytes(table: dict[str, np.ndarray]) -> bytes:
    from scipy.io import netcdf_file

    target = io.BytesIO()
    file = netcdf_file(target, "w")
    file.createDimension("row", len(next(iter(table.values()))))
    for name, values in table.items():
        file.createVariable(name, "d", ("row",))[:] = values
    file.flush()
    return target.getvalue()


def sqlite_bytes(**tables: dict[str, np.ndarray]) -> bytes:
    import sqlite3

    with closing(sqlite3.connect(":memory:")) as database:
        for name, table in tables.items():
            database.execute(f'CREATE TABLE "{name}" ({", ".join(map(json.dumps, table))})')
            marks = ", ".join("?" * len(table))
            database.executemany(f'INSERT INTO "{name}" VALUES ({marks})', np.column_stack([*table.values()]).tolist())
        database.commit()
        return database.serialize()


def mat_bytes(table: dict, **kwargs) -> bytes:
    from scipy.io import savemat

    target = io.BytesIO()
    savemat(target, table, **kwargs)
    return target.getvalue()


def hdf5_bytes(
    table: dict[str, np.ndarray], units: dict[str, str] | None = None, group: str = "", packed: bool = False
) -> bytes:
    import h5py

    target = io.BytesIO()
    with h5py.File(target, "w") as file:
        for name, values in table.items():
            dataset = file.create_dataset(f"{group}/{name}", data=values, compression="gzip" if packed else None)
            if units and name in units:
                dataset.attrs["units"] = units[name]
    return target.getvalue()


def mat73_bytes(table: dict[str, np.ndarray]) -> bytes:
    """A file as from MATLAB 7.3: header in the user block, matrices transposed, classes as attributes."""
    import tempfile

    import h5py

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.mat"
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, values in table.items():
                dataset = file.create_dataset(name, data=np.asarray(values)[None, :])
                dataset.attrs["MATLAB_class"] = np.bytes_("double")
        content = bytearray(path.read_bytes())
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Jan  1 00:00:00 2024 HDF5 schema 1.00 ."
    content[:128] = head.ljust(124) + b"\x00\x02IM"
    return bytes(content)


def tdms_bytes(table: dict[str, np.ndarray], units: dict[str, str], wave: bool = False) -> bytes:
    from nptdms import ChannelObject, RootObject, TdmsWriter

    target = io.BytesIO()
    objects = []
    for name, values in table.items():
        properties: dict = {"unit_string": units.get(name, "")}
        if wave:
            properties |= {"wf_increment": 1 / RATE, "wf_start_offset": 0.0, "wf_samples": len(values)}
        objects.append(ChannelObject("Test", name, values, properties=properties))
    with TdmsWriter(target) as writer:
        writer.write_segment([RootObject(), *objects])
    return target.getvalue()


def mf4_bytes(groups: list[tuple[np.ndarray, dict[str, np.ndarray]]], units: dict[str, str]) -> bytes:
    import tempfile

    from asammdf import MDF, Signal

    with tempfile.TemporaryDirectory() as folder:
        file = MDF(version="4.10")
        for stamps, table in groups:
            file.append([Signal(v, stamps, unit=units.get(n, ""), name=n) for n, v in table.items()])
        path = Path(folder) / "a.mf4"
        file.save(path, overwrite=True)
        file.close()
        return path.read_bytes()
