"""
A line of dampers
=================

A line of dampers that was never made, tested, identified and watched: who stands out, what drifts."""

import tempfile
from pathlib import Path

from mrdamper.fleet.generator import Population, write_fleet
from mrdamper.fleet.line import run_fleet
from mrdamper.fleet.page import write_page
from mrdamper.fleet.profile import ColumnLimits

line = Population(dampers=8, sessions=3, golden=1, rig_drift=0.03, faults={"low gas": 1}, seed=4)
with tempfile.TemporaryDirectory() as folder:
    write_fleet(line, Path(folder) / "records")
    found = run_fleet(Path(folder) / "records", Path(folder) / "line", workers=2)
    said = write_page(
        found.table, found.plan, {"gas_force_N": ColumnLimits(lower=100)}, found.table.with_name("fleet.html")
    )

print(f"{found.done} of {found.dampers} identified; planted: {[d.serial for d in line if d.fault]} with low gas")
print("\n".join(said))
