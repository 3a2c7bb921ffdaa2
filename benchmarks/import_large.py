"""Importing a large CSV, or many small ones, into a dataset: seconds and peak memory of a fresh process.

    python -m benchmarks.import_large --megabytes 1000
    python -m benchmarks.import_large --files 1000

Goals: 1 GB within 30 s and 300 MB; 1,000 files within 60 s. Files are written to the temporary folder
and removed. Exit status 1 if a goal is missed.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

RATE = 2000.0
SECONDS, MEMORY, MANY_SECONDS = 30.0, 300.0, 60.0
CHILD = """
import resource, sys, time
begin = time.perf_counter()
from mrdamper.rig_files.rig_import import import_files, to_dataset
from mrdamper.rig_files.dataset_folder import save_dataset
result = import_files([sys.argv[1]])
read = time.perf_counter() - begin
save_dataset(to_dataset(result.records), sys.argv[2])
used = resource.getrusage(resource.RUSAGE_SELF)
taken, cpu = time.perf_counter() - begin, used.ru_utime + used.ru_stime
codes = " ".join(sorted({f.code for r in result.records for f in r.findings})) or "no findings"
samples = sum(record.time.size for record in result.records)
print(f"{len(result.records)} tests, {samples} samples, read {read:.1f} s, in all {taken:.1f} s "
      f"({cpu:.1f} s of processor), peak {used.ru_maxrss / 1024:.0f} MB, {codes}")
sys.exit(taken > float(sys.argv[3]) or used.ru_maxrss / 1024 > float(sys.argv[4]))
"""


def write_csv(path: Path, size: int, current: str = "0.50") -> None:
    """A sine test of a damper, four columns, until the file has that many bytes."""
    count = 100_000
    phase = 2 * np.pi * np.arange(count) / RATE
    v = np.cos(phase)
    force = 1000 * np.tanh(8 * v) + 200 * v + np.random.default_rng(0).normal(0, 5, count)
    tails = [f",{20 * x:.5f},{f:.3f},{current}\n" for x, f in zip(np.sin(phase), force, strict=True)]
    with path.open("w", encoding="ascii") as file:
        file.write("time_s,displacement_mm,force_N,current_A\n")
        start = 0
        while file.tell() < size:
            rows = tails if size > 10**6 else tails[: max(2000, size // 40)]
            file.write("".join(f"{(start + i) / RATE:.4f}{tail}" for i, tail in enumerate(rows)))
            start += len(rows)


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
                write_csv(files / f"t{i:04}.csv", 70_000, f"{0.1 * (i % 12):.2f}")
            goals = (MANY_SECONDS, float("inf"))
        else:
            write_csv(files / "large.csv", arguments.megabytes * 10**6)
            goals = (SECONDS, MEMORY)
        size = sum(file.stat().st_size for file in files.iterdir())
        print(f"{size / 1e6:.0f} MB of CSV in {max(1, arguments.files)} files:", flush=True)
        command = [sys.executable, "-c", CHILD, str(files), str(dataset), *map(str, goals)]
        return subprocess.run(command, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
