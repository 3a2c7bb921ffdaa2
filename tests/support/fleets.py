"""Comparison of fleets, and a small fleet."""

import shutil
import sqlite3

import polars as pl

from benchmarks.synthetic_fleet import Population
from mrdamper.fleet.table import TIMES

LINE = Population(dampers=4, sessions=2, golden=1, faults={"wrong coil": 1}, seed=3)
ROWS = 6  # four dampers, and the master damper in two sessions


def same_bits(folder):
    """The part of the table that has to agree to the last bit: all columns without times and hosts."""
    return pl.read_parquet(folder / "dampers.parquet").drop(TIMES).rows()


def planned(identified, out):
    """A journal with the plan and the one full study, so that only fast searches remain."""
    out.mkdir()
    shutil.copyfile(identified.table.parent / "journal.sqlite", out / "journal.sqlite")
    with sqlite3.connect(out / "journal.sqlite") as base:
        base.execute("DELETE FROM results WHERE json_extract(row, '$.lane') = 'fast'")
    base.close()
    return out
