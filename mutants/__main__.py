"""`python -m mutants`: plant faults, run the tests that execute them, print the survivors.

Groups of tests run beside each other. The tests of a group are collected once and run once without a fault, which
records the functions that each executes. A fault is then tried in a fork of that process, in which the changed code
replaces that of the functions, by those tests alone, the fastest first, up to the first failure. First a fault that
every test detects is planted; if it survives, the exit status is 2. The exit status is 0 if at most 5 % of the faults
survive.
"""

from __future__ import annotations

import argparse
import importlib
import os
import signal
import sys
import time
from collections import Counter
from functools import partial
from pathlib import Path

from mutants.explained import reason
from mutants.faults import SOURCE, Fault, faults_of
from mutants.fork import in_fork, in_forks
from mutants.groups import CERTAIN, CERTAIN_FAULT, GROUPS, Group

ROOT = Path(__file__).parent.parent
MOST = 0.05  # share of the faults that may survive
PATIENCE = 2.0  # additional time of tests by a fault [s], beyond five times and the longest test
UNCOLLECTED = ([], "the tests could not be collected")
LIBRARIES = ("numpy", "scipy.optimize", "scipy.special", "scipy.signal", "scipy.stats", "polars", "matplotlib.figure",
             "pydantic", "typer.testing", "jinja2", "pytest")  # fmt: skip


def main() -> int:
    """Plant the faults, run the tests, print the survivors."""
    parser = argparse.ArgumentParser(prog="python -m mutants", description=__doc__)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", default="", help="Modules whose name holds this.")
    parser.add_argument(
        "--share", type=float, default=0.2, help="Of every module's faults, at equal distances; 1: all."
    )
    parser.add_argument(
        "--explained", action="store_true", help="Plant what explained.py excuses instead: no test may notice it."
    )
    given = parser.parse_args()
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"
    os.chdir(ROOT)
    sys.path.insert(0, str(SOURCE))
    sys.dont_write_bytecode = True
    for library in LIBRARIES:
        importlib.import_module(library)
    if why := _blind():
        print(why)
        return 2
    tried: list[tuple[Group, list[Fault]]] = []
    survivors: list[Fault] = []
    planted: list[Fault] = []
    begin = time.perf_counter()
    for group in GROUPS:
        modules = [module for module in group.modules if given.only in module]
        if faults := [fault for module in modules for fault in _share(module, given.share, given.explained)]:
            tried.append((group, faults))
    each = max(1, given.jobs // max(1, len(tried)))
    answers = in_forks([partial(_try_group, group, faults, each) for group, faults in tried], given.jobs)
    for (group, faults), answer in zip(tried, answers, strict=True):
        alive, why = answer or UNCOLLECTED
        if why:
            print(f"{' '.join(group.tests)}: {why}")
            return 1
        planted += faults
        survivors += alive
    if given.explained:
        return _wrongly_explained(planted, survivors)
    counts = Counter(fault.module for fault in planted)
    died = counts - Counter(fault.module for fault in survivors)
    for module, count in counts.items():
        print(f"{module:45} {count:4} planted {count - died[module]:4} survive")
    packages, left = (Counter(_package(m) for m in c.elements()) for c in (counts, counts - died))
    for package, count in packages.items():
        print(f"package {package:37} {count:4} planted {left[package]:4} survive")
    for fault in survivors:
        print(f"survives: {_line(fault)}")
    total = sum(counts.values())
    names = [module for group in GROUPS for module in group.modules if given.only in module]
    equal = sum(bool(reason(fault)) for module in names for fault in faults_of(module))
    print(
        f"{time.perf_counter() - begin:.0f} s; {equal} changes that change nothing are not tried: mutants/explained.py"
    )
    print(f"{len(survivors)} of {total} survive")
    return 0 if len(survivors) <= MOST * total else 1


def _wrongly_explained(planted: list[Fault], survivors: list[Fault]) -> int:
    """List the changes that a test detects although explained.py lists them."""
    noticed = [fault for fault in planted if fault not in survivors]
    for fault in noticed:
        print(f"noticed: {_line(fault)}: not true that {reason(fault)}")
    print(f"{len(noticed)} of {len(planted)} explained changes are noticed")
    return min(len(noticed), 1)


def _line(fault: Fault) -> str:
    return f"{fault.module}:{fault.line}: {fault.change} in {fault.of}: {fault.text}"


def _package(module: str) -> str:
    """Package of a module below the whole."""
    return module.split(".")[1] if module.count(".") > 1 else "mrdamper"


def _blind() -> str:
    """Reason why results are invalid, if the fault that must be detected was not; otherwise empty."""
    (fault,) = (f for f in faults_of(CERTAIN.modules[0]) if (f.text, f.change) == CERTAIN_FAULT)
    alive, why = in_fork(partial(_try_group, CERTAIN, [fault], 1)) or UNCOLLECTED
    if why:
        return f"{' '.join(CERTAIN.tests)}: {why}"
    if alive:
        return f"{fault.module}:{fault.line}: {fault.change} survives: faults are not planted, and no result counts"
    return ""


def _share(module: str, share: float, explained: bool) -> list[Fault]:
    faults = [fault for fault in faults_of(module) if bool(reason(fault)) == explained]
    count = max(min(len(faults), 4), round(share * len(faults)))
    return [faults[int(k * len(faults) / count)] for k in range(count)]


def _try_group(group: Group, faults: list[Fault], jobs: int) -> tuple[list[Fault], str]:
    """Survivors among the faults of a group, or why they could not be tried; in a separate process."""
    from mutants.trial import Trial

    trial = Trial(faults, jobs, PATIENCE, os.dup(2))
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    import pytest

    plain = ["-q", "-m", "not slow", "-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:benchmark", "--tb=no"]
    words = ["-k", " and ".join(f"not {word}" for word in group.without)] if group.without else []
    pytest.main([*plain, *words, *group.tests], plugins=[trial])
    return trial.survivors, trial.why


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    sys.exit(main())
