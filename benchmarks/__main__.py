"""`make bench`: comparison of mrdamper with each installed peer, in one run.

`python -m benchmarks --quick` takes about a minute on an idle machine; `--write docs/benchmarks.md` stores the page.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

# Small matrices, few cores: threads of the linear algebra would wait for each other, and change the last bits.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")


def main() -> None:
    arguments = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    arguments.add_argument("--quick", action="store_true", help="few repetitions, about a minute")
    arguments.add_argument("--write", type=Path, metavar="FILE", help="keep the page there")
    chosen = arguments.parse_args()
    text = run(chosen.quick)
    print(text)
    if chosen.write:
        chosen.write.write_text(text, encoding="utf-8")


def run(quick: bool) -> str:
    """Run every section and return the page."""
    from benchmarks import accuracy, batches, commands, identification, page, real, simulation, streams, study

    results = page.Results(quick)
    sections = {
        "processes": lambda: commands.process_rows(quick),  # first, while this process is small
        "accuracy": accuracy.largest_errors,
        "simulation": lambda: simulation.simulation_rows(quick),
        "streams": lambda: streams.stream_rows(quick),
        "identification": lambda: identification.identification_rows(quick),
        "batches": lambda: batches.batch_rows(quick),
        "many": lambda: batches.many_rows(quick),
        "growth": lambda: batches.growth_rows(quick),
        "real": real.real_rows,
    }
    if not quick:
        sections["study"] = study.part_rows
    for name, section in sections.items():
        begin = time.perf_counter()
        setattr(results, name, section())
        print(f"{name}: {time.perf_counter() - begin:.0f} s", file=sys.stderr, flush=True)
    return page.page(results)


if __name__ == "__main__":
    main()
