"""`python -m mutants`: plant every fault, run the tests that answer for its module, say what survives.

Libraries are loaded once; a fault is tried in a fork of this process, in which its module is
loaded from the changed source. Ends with 0 where at most 5 % of the faults survive.
"""

from __future__ import annotations

import argparse
import importlib.abc
import importlib.util
import os
import signal
import sys
import time
from collections import Counter
from pathlib import Path

from mutants.faults import SOURCE, Fault, all_faults, path_of, planted

ROOT = Path(__file__).parent.parent
LIMIT = 240  # seconds for the tests of a fault
MOST = 0.05  # of the faults may survive
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"


class Changed(importlib.abc.MetaPathFinder, importlib.abc.SourceLoader):
    """Loads one module from changed source; all others as they stand."""

    def __init__(self, module: str, source: str):
        self.module, self.source = module, source

    def find_spec(self, fullname, path=None, target=None):
        if fullname != self.module:
            return None
        return importlib.util.spec_from_file_location(fullname, self.get_filename(fullname), loader=self)

    def get_filename(self, fullname):
        return str(path_of(fullname))

    def get_data(self, path):
        return self.source.encode()

    def path_stats(self, path):
        raise OSError("never taken from a cache")


def try_one(fault: Fault | None, tests: tuple[str, ...]) -> int:
    """Exit code of the tests with a fault planted; in a process of its own."""
    import pytest

    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    if fault is not None:
        sys.meta_path.insert(0, Changed(fault.module, planted(fault)))
    signal.alarm(LIMIT)
    return int(pytest.main(["-x", "-q", "-m", "not slow", "-p", "no:cacheprovider", "--no-header", *tests]))


def run(tasks: list[tuple[Fault | None, tuple[str, ...]]], jobs: int) -> list[int]:
    """Exit codes of all tasks, several at once, each in a fork."""
    waiting, codes = dict(enumerate(tasks)), [0] * len(tasks)
    running: dict[int, int] = {}
    begin = time.perf_counter()
    while waiting or running:
        while waiting and len(running) < jobs:
            number = min(waiting)
            fault, tests = waiting.pop(number)
            child = os.fork()
            if child == 0:
                code = 9
                try:
                    code = try_one(fault, tests)
                finally:
                    os._exit(code)
            running[child] = number
        child, status = os.wait()
        number = running.pop(child)
        codes[number] = os.waitstatus_to_exitcode(status)
        fault = tasks[number][0]
        if fault is not None and codes[number] == 0:
            print(f"\nsurvives: {fault.module}:{fault.line}: {fault.change}", file=sys.stderr)
        done = len(tasks) - len(waiting) - len(running)
        print(f"\r{done} of {len(tasks)}, {time.perf_counter() - begin:.0f} s ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return codes


def main() -> int:
    """Plant, run, print."""
    parser = argparse.ArgumentParser(prog="python -m mutants", description=__doc__)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", default="", help="Modules whose name holds this.")
    given = parser.parse_args()
    os.chdir(ROOT)
    sys.path.insert(0, str(SOURCE))
    sys.dont_write_bytecode = True
    for library in (
        "numpy",
        "scipy.optimize",
        "scipy.special",
        "scipy.signal",
        "polars",
        "matplotlib.figure",
        "pytest",
        "pydantic",
        "typer.testing",
        "jinja2",
    ):
        importlib.import_module(library)
    faults = [fault for fault in all_faults() if given.only in fault.module]
    sets = sorted({fault.tests for fault in faults})
    healthy = run([(None, tests) for tests in sets], given.jobs)
    for tests, code in zip(sets, healthy, strict=True):
        if code:
            print(f"{' '.join(tests)} fail without any fault (exit {code}): mend them first")
            return 1
    codes = run([(fault, fault.tests) for fault in faults], given.jobs)
    survivors = [fault for fault, code in zip(faults, codes, strict=True) if code == 0]
    planted_in, alive = Counter(f.module for f in faults), Counter(f.module for f in survivors)
    for module, count in planted_in.items():
        print(f"{module:45} {count:4} planted {alive[module]:4} survive")
    for fault in survivors:
        print(f"survives: {path_of(fault.module).relative_to(ROOT)}:{fault.line}: {fault.change}")
    print(f"{len(survivors)} of {len(faults)} survive")
    return 0 if len(survivors) <= MOST * len(faults) else 1


if __name__ == "__main__":
    sys.exit(main())
