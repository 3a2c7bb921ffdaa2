"""Importing a large CSV, or many small ones, into a dataset: seconds and peak memory of a fresh process.

    python -m benchmarks.import_large --megabytes 1000
    python -m benchmarks.import_large --files 1000

Goals, in seconds of processor: 1 GB within 30 s and 300 MB; 1,000 files of 123 KB within 25 s. Files are
written to the temporary folder and removed. Exit status 1 if a goal is missed or a file is refused.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from itertools import count
from pathlib import Path

import numpy as np

RATE = 2000.0
SECONDS, MEMORY, SECONDS_A_FILE = 30.0, 300.0, 0.025
CHILD = """
import resource, sys, time
begin = time.perf_counter()
from mrdamper.rig_files.rig_import import import_files, to_dataset
from mrdamper.rig_files.dataset_folder import save_dataset
result = import_files([sys.argv[1]])
read = time.perf_counter() - begin
save_dataset(to_dataset(result.records), sys.argv[2])
taken = time.perf_counter() - begin
own, children = (resource.getrusage(of) for of in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
cpu = own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime
peak = own.ru_maxrss / 1024
codes = " ".join(sorted({f.code for r in result.records for f in r.findings})) or "no findings"
samples = sum(record.time.size for record in result.records)
seconds, memory = map(float, sys.argv[3:])
print(f"{len(result.records)} tests, {samples} samples, {len(result.refusals)} refused, {codes}")
print(f"processor {cpu:.1f} s (goal {seconds:g} s), peak {peak:.0f} MB (goal {memory:g} MB), "
      f"by the clock {taken:.1f} s, {read:.1f} s of it reading and checking")
sys.exit(bool(cpu > seconds or peak > memory or result.refusals))
"""


def write_csv(path: Path, size: int, current: float = 0.5, seed: int = 0) -> None:
    """A sine test of a damper, four columns, cycle by cycle until the file has that many bytes."""
    rng, period = np.random.default_rng(seed), int(RATE)
    phase = 2 * np.pi * np.arange(period) / RATE
    force = (400 + 1200 * current) * np.tanh(8 * np.cos(phase)) + 200 * np.cos(phase)
    middles, tail = [f",{20 * x:.5f}," for x in np.sin(phase)], f",{current:.2f}\n"
    with path.open("w", encoding="ascii") as file:
        file.write("time_s,displacement_mm,force_N,current_A\n")
        for start in count(0, period):
            measured = (force + rng.normal(0, 5, period)).tolist()
            rows = zip(range(start, start + period), middles, measured, strict=True)
            file.write("".join(f"{i / RATE:.4f}{middle}{f:.3f}{tail}" for i, middle, f in rows))
            if file.tell() >= size:
                return


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--megabytes", type=int, default=1000)
    parser.add_argument("--files", type=int, default=0, help="so many small files instead of a large one")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        files, dataset = Path(folder) / "files", Path(folder) / "dataset"
        files.mkdir()
        if arguments.files:
            for i in range(arguments.files):
                write_csv(files / f"t{i:04}.csv", 70_000, 0.1 * (i % 12), seed=i)
            goals = (SECONDS_A_FILE * arguments.files, float("inf"))
        else:
            write_csv(files / "large.csv", arguments.megabytes * 10**6)
            goals = (SECONDS, MEMORY)
        size = sum(file.stat().st_size for file in files.iterdir())
        print(f"{size / 1e6:.0f} MB of CSV in {max(1, arguments.files)} files:", flush=True)
        command = [sys.executable, "-c", CHILD, str(files), str(dataset), *map(str, goals)]
        return subprocess.run(command, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
