"""`make attack`: hostile names, models, tables and calls, killed and starved commands; counts a kind, tried and held.

Each kind is bounded, so that all end within ten minutes; `--share 0.1` takes a tenth. What did
not hold is printed with what it came from, and the exit status is 1.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from fuzz.bench_soak import attack_bench
from fuzz.hostile_input import attack_calls, attack_datasets, attack_models
from fuzz.hostile_names import attack_exports, attack_names
from fuzz.stops import COMMANDS, attack_kills, attack_limits

KINDS = {
    "names": attack_names,
    "exports": attack_exports,
    "models": attack_models,
    "datasets": attack_datasets,
    "calls": attack_calls,
    "kills": attack_kills,
    "limits": attack_limits,
    "soak": attack_bench,
}
TIMED = "soak"  # by itself, at the end


def main() -> None:
    """Attack, and print the counts."""
    arguments = argparse.ArgumentParser(prog="python -m fuzz.attack", description=__doc__)
    arguments.add_argument("kinds", nargs="*", help=f"of {', '.join(KINDS)}; default: all")
    arguments.add_argument("--share", type=float, default=1.0, help="of the usual number")
    arguments.add_argument("--of", nargs="+", default=[], help=f"commands that are stopped, of {', '.join(COMMANDS)}")
    chosen = arguments.parse_args()
    kinds = chosen.kinds or list(KINDS)
    if len(kinds) > 1:  # each in a process of its own: one kind's threads and memory are not the next one's
        one = [sys.executable, "-m", "fuzz.attack", "--share", str(chosen.share)]
        with ThreadPoolExecutor(2) as pool:
            aside = [kind for kind in kinds if kind != TIMED]
            codes = list(pool.map(lambda kind: subprocess.run([*one, kind], check=False).returncode, aside))
        codes += [subprocess.run([*one, kind], check=False).returncode for kind in kinds if kind == TIMED]
        sys.exit(max(codes))
    counts = KINDS[kinds[0]](chosen.share, *([chosen.of] if chosen.of else []))
    for count in counts:
        print(count, flush=True)
    sys.exit(1 if any(count.broke for count in counts) else 0)


if __name__ == "__main__":
    main()
