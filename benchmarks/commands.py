"""Time and memory of whole processes, with empty and filled caches."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks import conditions

_IDENTIFY = """
import sys
import numpy as np
from mrdamper import Run, identify
records = np.load(sys.argv[1])
runs = [
    Run(f"{i}", t, x, f, I, window=(w, t[-1]))
    for i, (t, x, f, I, w) in enumerate(zip(*(records[k] for k in ("t", "x", "f", "I", "w")), strict=True))
]
found = [identify(run) for run in runs]
assert max(i.scores.nrmse_std for i in found) < 0.05
"""

# A small process starts the measured one: a child counts the memory of the process it was forked from.
_STARTER = """
import resource, subprocess, sys, time
begin = time.perf_counter()
done = subprocess.run([sys.executable, *sys.argv[1:]], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
wall = time.perf_counter() - begin
spent = resource.getrusage(resource.RUSAGE_CHILDREN)
print(wall, spent.ru_utime + spent.ru_stime, spent.ru_maxrss)
sys.stderr.buffer.write(done.stderr)
sys.exit(done.returncode)
"""


@dataclass(frozen=True)
class ProcessRow:
    """Wall time, processor time with that of its children, and peak memory of a fresh process."""

    name: str
    wall: float
    seconds: float
    megabytes: float


def process_rows(quick: bool) -> list[ProcessRow]:
    """Help, identification of 48 conditions, the whole study."""
    repeats = 1 if quick else 3
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        records = _records(folder / "records.npz")
        study = ["-m", "mrdamper", "study", "--out"]
        rows = [
            _fresh("mrdamper --help", ["-m", "mrdamper", "--help"], folder, repeats + 2),
            _fresh("Python and NumPy alone", ["-c", "import numpy"], folder, repeats + 2),
            _fresh("identify() of 48 conditions", ["-c", _IDENTIFY, str(records)], folder, repeats + 2),
            _fresh("mrdamper study, caches filled", [*study, str(folder / "warm")], folder, 1 if quick else 2),
        ]
        if not quick:
            rows.append(_cold("mrdamper study, caches empty", [*study, str(folder / "cold")]))
        return rows


def _records(path: Path) -> Path:
    runs = [conditions.run(condition) for condition in conditions.MATRIX]
    np.savez(
        path,
        t=[r.time for r in runs],
        x=[r.displacement for r in runs],
        f=[r.force for r in runs],
        I=[r.current_A for r in runs],
        w=[r.window[0] for r in runs if r.window],
    )
    return path


def _fresh(name: str, arguments: list[str], folder: Path, repeats: int) -> ProcessRow:
    """The least of some processes, after one that is not counted has filled the caches."""
    environment = _environment(folder / "caches")
    wall, seconds, megabytes = zip(*[_process(arguments, environment) for _ in range(repeats + 1)][1:], strict=True)
    return ProcessRow(name, min(wall), min(seconds), max(megabytes))


def _cold(name: str, arguments: list[str]) -> ProcessRow:
    """One process with no byte code, no compiled kernels and no font list kept from before."""
    with tempfile.TemporaryDirectory() as empty:
        return ProcessRow(name, *_process(arguments, _environment(Path(empty))))


def _environment(caches: Path) -> dict[str, str]:
    kept = {"MRDAMPER_CACHE": "compiled", "PYTHONPYCACHEPREFIX": "python", "MPLCONFIGDIR": "matplotlib"}
    for folder in kept.values():
        (caches / folder).mkdir(parents=True, exist_ok=True)
    inherited = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**inherited, **{name: str(caches / folder) for name, folder in kept.items()}}


def _process(arguments: list[str], environment: dict[str, str]) -> tuple[float, float, float]:
    """Wall and processor seconds and peak megabytes; the starter measures, so that its own start does not count."""
    done = subprocess.run(
        [sys.executable, "-S", "-c", _STARTER, *arguments], capture_output=True, text=True, env=environment, check=True
    )
    wall, seconds, kilobytes = done.stdout.split()
    return float(wall), float(seconds), int(kilobytes) / 1024
