"""Reading and judging a large CSV: seconds and peak memory of a fresh process.

    python -m benchmarks.import_large --megabytes 1000

Goal: 1 GB within 30 s and 300 MB. The file is written to the temporary folder and removed.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

RATE = 2000.0
CHILD = """
import resource, sys, time
begin = time.perf_counter()
from mrdamper.rig_files.rig_import import read_run
ready = time.perf_counter()
record = read_run(sys.argv[1])
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
codes = " ".join(finding.code for finding in record.findings) or "no findings"
print(f"{record.time.size} samples, {time.perf_counter() - ready:.1f} s, peak {peak:.0f} MB, {codes}")
"""


def write_csv(path: Path, size: int) -> None:
    """A sine test of a damper, four columns, until the file has that many bytes."""
    count = 100_000
    phase = 2 * np.pi * np.arange(count) / RATE
    v = np.cos(phase)
    force = 1000 * np.tanh(8 * v) + 200 * v + np.random.default_rng(0).normal(0, 5, count)
    tails = [f",{20 * x:.5f},{f:.3f},0.50\n" for x, f in zip(np.sin(phase), force, strict=True)]
    with path.open("w", encoding="ascii") as file:
        file.write("time_s,displacement_mm,force_N,current_A\n")
        start = 0
        while file.tell() < size:
            file.write("".join(f"{(start + i) / RATE:.4f}{tail}" for i, tail in enumerate(tails)))
            start += count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--megabytes", type=int, default=1000)
    megabytes = parser.parse_args().megabytes
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.csv"
        write_csv(path, megabytes * 10**6)
        print(f"{path.stat().st_size / 1e6:.0f} MB of CSV:", flush=True)
        subprocess.run([sys.executable, "-c", CHILD, str(path)], check=True)


if __name__ == "__main__":
    main()
