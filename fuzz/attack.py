"""`make attack`: hostile names, models, tables and calls, killed and starved commands; counts a kind, tried and held.

All kinds together take a share of their numbers, and end within ten minutes whatever the machine;
kinds that are named are tried in full: `python -m fuzz.attack kills` (200 of them), `limits` (20
points of each command; `--of study compare` for some), `soak` (ten minutes), `names` (10,000).
`--share 0.1` takes a tenth. What did not hold is printed with what it came from, and the exit
status is 1.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from fuzz import counting
from fuzz.app_soak import SECONDS, attack_app
from fuzz.extremes import attack_extremes
from fuzz.hostile_input import attack_calls, attack_datasets, attack_models
from fuzz.hostile_names import attack_names
from fuzz.hostile_pages import attack_exports, attack_pages
from fuzz.hostile_requests import attack_requests
from fuzz.stops import COMMANDS, attack_kills, attack_limits

KINDS = {
    "names": attack_names,
    "exports": attack_exports,
    "pages": attack_pages,
    "models": attack_models,
    "datasets": attack_datasets,
    "calls": attack_calls,
    "requests": attack_requests,
    "extremes": attack_extremes,
    "kills": attack_kills,
    "limits": attack_limits,
    "soak": attack_app,
}
SHARES = {"kills": 0.4, "limits": 0.25, "extremes": 0.2, "pages": 0.2, "soak": 0.15}  # where all are tried
TIMED = "soak"  # by itself, at the end
_COMMAND = (sys.executable, "-m", "fuzz.attack")
_ALL_S = 9 * 60  # seconds in which a further one is begun


def main() -> None:
    """Attack, and print the counts."""
    arguments = argparse.ArgumentParser(prog="python -m fuzz.attack", description=__doc__)
    arguments.add_argument("kinds", nargs="*", help=f"of {', '.join(KINDS)}; default: all")
    arguments.add_argument("--share", type=float, default=1.0, help="of the usual number")
    arguments.add_argument("--seconds", type=float, default=math.inf, help="after which no further one is tried")
    arguments.add_argument("--of", nargs="+", default=[], help=f"commands that are stopped, of {', '.join(COMMANDS)}")
    chosen = arguments.parse_args()
    if len(chosen.kinds) > 1:  # each in a process of its own: a fork of one whose threads have begun may wait for ever
        rest = [word for word in sys.argv[1:] if word not in chosen.kinds]
        runs = [subprocess.run([*_COMMAND, kind, *rest], check=False) for kind in chosen.kinds]
        sys.exit(max(run.returncode != 0 for run in runs))
    if chosen.kinds:
        sys.exit(attack_one(*chosen.kinds, chosen.share, chosen.seconds, chosen.of))
    sys.exit(attack_all(chosen.share))


def attack_one(kind: str, share: float, seconds: float, of: list[str]) -> int:
    """One kind, in this process."""
    counting.CLOCK.stop_at = time.monotonic() + seconds
    counts = KINDS[kind](share, *([of] if of else []))
    for count in counts:
        print(count, flush=True)
    if counting.CLOCK.stopped:
        print(f"    {kind}: the time was up before all were tried", flush=True)
    for count in counts:
        if not count.tried:
            print(f"    broke: {count.kind}: nothing was tried", flush=True)
    return 1 if any(count.broke or not count.tried for count in counts) else 0


def attack_all(share: float) -> int:
    """Each in a process of its own: one kind's threads and memory are not the next one's."""
    aside = [kind for kind in sorted(KINDS, key=lambda kind: kind in SHARES) if kind != TIMED]  # the short ones first
    until = time.monotonic() + _ALL_S - SECONDS * SHARES[TIMED] * share

    def attack(kind: str) -> int:
        seconds = max(1.0, until - time.monotonic()) if kind != TIMED else math.inf
        command = [*_COMMAND, kind, "--seconds", str(seconds), "--share", str(share * SHARES.get(kind, 1.0))]
        return subprocess.run(command, check=False).returncode

    with ThreadPoolExecutor(2) as pool:
        codes = list(pool.map(attack, aside))
    return max(*codes, attack(TIMED))


if __name__ == "__main__":
    main()
