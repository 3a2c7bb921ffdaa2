"""Detection rate of the checks on records with faults, and false alarms on clean ones.

    python -m benchmarks.import_detection

Goals: force sign and exchanged columns 100 of 100; clipping 95 %; freezing 99 %; the lag of a velocity channel within
one sample; false findings in at most 1 of 100 clean records, in no bundled run. Seeded: the same records every time.
Under two minutes on one core. Exit status 1 if a goal is missed.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from support import rig_detection as rig  # the records are those of the tests
from support.rig_records import wide_damper

from mrdamper.rig_files.dataset_folder import load_dataset

FRESH = 100_000  # seeds from here on are of no test


def rows():
    """Name, what came of it, goal as a share; no goal where there is none."""
    yield "clean records passed", rig.clean_passed(300), 0.99
    yield "clean records passed, fresh seeds", rig.clean_passed(300, FRESH), 0.99
    yield "clean records with wide hysteresis passed", rig.clean_passed(300, FRESH, wide_damper), 0.99
    yield "bundled runs passed", rig.bundled_passed(tuple(load_dataset())), 1.0
    yield "force of the wrong sign", rig.opposite_found(100), 1.0
    for unit in rig.EXCHANGED_UNITS:
        yield f"columns exchanged, 1 N read as {unit:g} m", rig.exchanged_found(100, unit), 1.0
    yield "clipped displacement or force", rig.clipping_found(300), 0.95
    yield "frozen displacement or force", rig.freezing_found(300), 0.99
    yield "late velocity, to one sample", rig.late_velocity_found(100), 1.0
    for lag in (0.03, 0.05, 0.08):
        yield f"late force, {100 * lag:.0f} % of the period", rig.late_force_found(100, lag, first=FRESH), None


def main() -> int:
    begin, fell_short = time.perf_counter(), False
    print(f"{'':45}  found   of      %   goal")
    for name, found, goal in rows():
        missed = goal is not None and found.share < goal
        fell_short |= missed
        told = "" if goal is None else f"{100 * goal:.0f} %{' MISSED' if missed else ''}"
        print(f"{name:45} {found.found:6d} {found.tried:4d} {100 * found.share:6.1f}   {told}", flush=True)
        if missed:
            print(f"    {found.missed[:5]}")
    print(f"{time.perf_counter() - begin:.0f} s")
    return int(fell_short)


if __name__ == "__main__":
    sys.exit(main())
