"""`make bench-check`: processor seconds of this tree against those of a stored commit, in turns, in one run.

Not part of the tests, because the load of a machine changes times by more than a change of the code. Both trees run the
same work in turns, under the same load; the ratio of the medians is compared.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median

ROOT = Path(__file__).resolve().parent.parent
STORED = ROOT / "benchmarks" / "baseline.txt"  # the commit that is compared with
_SLOWER = 1.15  # ratio of processor seconds from which a change has made something slower
_MOTION = (
    "from mrdamper.data import Condition; from mrdamper.physics.motion import sine;"
    "m = sine(Condition(0.5, 1.0, 0.01), 20, 1000);"
)
WORK = {
    "import": "import mrdamper",
    "identify every run": (
        "from mrdamper import identify, load_dataset\n"
        "for run in load_dataset():\n"
        "    if run.excitation == 'sine': identify(run, 'bouc-wen')"
    ),
    "Spencer along a record": _MOTION
    + (
        "from mrdamper.models.spencer import Spencer;"
        "s = Spencer(c1=1e4, c0_ratio=0.1, k0_rate=1.0, creep=0.01, yield_displacement=1e-4);"
        "[s.state(m) for _ in range(60)]"
    ),
    "play and bypass along a record": _MOTION
    + (
        "from mrdamper.models.play_bypass import PlayBypass;"
        "make = lambda T: PlayBypass(f0=1.0, k=1e3, c0=800.0, c1=200.0, fy0=150.0, fy1=600.0, d=2e-4, e=5e-5, cb=3e4,"
        " h0=0.4, h1=0.1, vh=0.01, T=T);"
        "[make(0.005 + 1e-6 * i).state(m) for i in range(600)]"
    ),
    "simulate dyke1996": (
        "from mrdamper import load_input, load_system, simulate_system;"
        "f = load_system('dyke1996');"
        "simulate_system(f.system, load_input('elcentro', time_scale=5), f.dampers)"
    ),
}


def processor_seconds(source: Path, code: str) -> float:
    """Processor seconds of one process that runs some code with the package of a source tree."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, **threads, "PYTHONPATH": str(source)}, check=True, cwd=ROOT
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def compared(ours: Path, stored: Path, code: str, turns: int) -> tuple[float, float]:
    """Median processor seconds of both trees, in turns after one of each that does not count."""
    times: list[tuple[float, float]] = []
    for _ in range(turns + 1):
        times.append((processor_seconds(ours, code), processor_seconds(stored, code)))
    return median(own for own, _ in times[1:]), median(other for _, other in times[1:])


def report(rows: Sequence[tuple[str, float, float]]) -> tuple[str, bool]:
    """The table, and whether nothing has become slower by more than the limit."""
    lines, good = [f"{'ratio':>6}  {'now':>7}  {'stored':>7}  work"], True
    for name, own, other in rows:
        ratio = own / other
        good &= ratio <= _SLOWER
        lines.append(f"{ratio:6.2f}  {own:6.2f}s  {other:6.2f}s  {name}{'  SLOWER' if ratio > _SLOWER else ''}")
    return "\n".join(lines), good


def main() -> int:
    """Compare; 1 if something has become slower."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--against", default=STORED.read_text(encoding="utf-8").strip(), help="commit")
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--only", default="", help="part of a work's name")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "stored"
        subprocess.run(
            ["git", "worktree", "add", "--quiet", "--detach", str(tree), given.against], cwd=ROOT, check=True
        )
        try:
            rows = [
                (name, *compared(ROOT / "src", tree / "src", code, given.turns))
                for name, code in WORK.items()
                if given.only in name
            ]
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", str(tree)], cwd=ROOT, check=True)
    text, good = report(rows)
    print(text)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
