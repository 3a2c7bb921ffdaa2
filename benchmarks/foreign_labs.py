"""Laboratories' exports of kinds that no reader was written for, imported by the first command.

    python -m benchmarks.foreign_labs

Correct: every true test is a run with its current, its stroke and its force. Silently wrong: imported, but not correct.
Goals: 75 % correct at the first command, none silently wrong. Seeded. Exit status 1 if a goal is missed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from support.foreign_labs import KINDS, Test, campaign

from mrdamper.errors import InputError
from mrdamper.rig_files.rig_import import import_files, to_dataset


def faults(tests: tuple[Test, ...], dataset) -> list[str]:
    """How a dataset differs from the tests it was made of; empty where each is there and right."""
    if len(dataset) != len(tests):
        return [f"{len(dataset)} runs of {len(tests)} tests"]
    left = list(dataset)
    wrong = []
    for test in tests:
        fitting = [run for run in left if _is(run, test)]
        if fitting:
            left.remove(fitting[0])
        else:
            wrong.append(f"no run is {test.current} A, {test.frequency} Hz, {test.amplitude} m")
    return wrong


def _is(run, test: Test) -> bool:
    begin, end = run.window or (run.time[0], run.time[-1])
    inside = (run.time >= begin) & (run.time <= end)
    time, x = run.time[inside] - begin, run.displacement[inside]
    current = float(np.mean(run.current[inside]))
    turns = np.count_nonzero(np.diff(np.sign(x - np.mean(x)))) / 2
    return (
        abs(current - test.current) < 0.015
        and abs(np.ptp(run.displacement) / np.ptp(test.x) - 1) < 0.02
        and abs(np.ptp(run.force) / np.ptp(test.f) - 1) < 0.05
        and abs(turns / time[-1] / test.frequency - 1) < 0.2
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kinds", nargs="*", help="only these")
    arguments = parser.parse_args()
    begin, right, refused, silent = time.process_time(), [], [], []
    tests = campaign()
    for kind in arguments.kinds or KINDS:
        with tempfile.TemporaryDirectory() as folder:
            KINDS[kind](tests, Path(folder))
            try:
                found = import_files([folder])
            except InputError as error:
                refused.append(f"{kind}: {error}")
                continue
            dataset = to_dataset(found.records) if found.records and not found.refusals else None
        if dataset is None:
            refused.append(f"{kind}: {found.refusals[0].error if found.refusals else 'no tests'}")
        elif wrong := faults(tests, dataset):
            silent.append(f"{kind}: {wrong[0]}")
        else:
            right.append(kind)
    tried = len(right) + len(refused) + len(silent)
    share = 100 * len(right) / tried
    print(f"{tried} kinds: {len(right)} right at the first command ({share:.0f} %), {len(refused)} refused, "
          f"{len(silent)} wrong in silence")  # fmt: skip
    for line in (*(f"wrong: {line}" for line in silent), *refused):
        print(f"    {line[:230]}")
    print(f"{time.process_time() - begin:.0f} s of processor")
    return int(share < 75 or bool(silent))


if __name__ == "__main__":
    sys.exit(main())
