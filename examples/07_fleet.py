"""
A fleet of dampers
==================

Ten synthetic dampers are identified and compared; the report states outliers and violated limits."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from mrdamper import Condition, Dataset, run_fleet, save_dataset, sine
from mrdamper.fleet.page import write_page
from mrdamper.fleet.profile import ColumnLimits
from mrdamper.paper.virtual_rig import VirtualRig

rng = np.random.default_rng(4)
with tempfile.TemporaryDirectory() as folder:
    for number in range(10):
        share = 0.6 if number == 5 else 1 + 0.01 * rng.standard_normal()  # of the gas pressure: one damper has lost gas
        rig = VirtualRig()
        rig = replace(rig, gas_pressure=share * rig.gas_pressure, offset_force=share * rig.offset_force)
        runs = []
        for current in (0.0, 1.0):
            for frequency in (1.0, 2.0):
                motion = sine(Condition(current, frequency, 0.020), 4, round(rig.sample_rate / frequency))
                name, window = f"{frequency:g}Hz-{current:g}A", (1 / frequency, float(motion.time[-1]))
                runs.append(rig.sense(motion, rig.force(motion), rng, id=name, window=window))
        save_dataset(Dataset(tuple(runs)), Path(folder) / "records" / f"D{number:03}")
    line = run_fleet(Path(folder) / "records", Path(folder) / "line", workers=2)
    limits = {"gas_force_N": ColumnLimits(lower=100)}
    findings = write_page(line.table, line.plan, limits, line.table.with_name("fleet.html"))

print(f"{line.done} of {line.dampers} identified; D005 has low gas")
print("\n".join(findings))
