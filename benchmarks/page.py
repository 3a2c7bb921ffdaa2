"""The tables of a run as one page of Markdown."""

from __future__ import annotations

import importlib.metadata
import os
import platform
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.goals import goals


@dataclass
class Results:
    """Rows of every table."""

    quick: bool
    accuracy: dict[str, float | None] = field(default_factory=dict)
    simulation: Sequence = ()
    identification: Sequence = ()
    batches: Sequence = ()
    many: Sequence = ()
    growth: Sequence = ()
    real: Sequence = ()
    processes: Sequence = ()


def page(results: Results) -> str:
    """All tables, goals first."""
    parts = [
        "# Benchmarks",
        f"`make bench` prints this page; `python -m benchmarks --write docs/benchmarks.md` keeps it. {machine()}. "
        "All ways of a table take turns in one run, and the least of many calls counts. Times are processor time on "
        "one thread, which a busy machine disturbs least, though it does: the load average was "
        f"{os.getloadavg()[1]:.1f} on {os.cpu_count()} processors. Whole processes in wall time too. "
        + ("This was a quick run: few repetitions. " if results.quick else "")
        + "Figures marked * are multiplied up from a part that was measured.",
        "## Goals",
        _table(
            ("goal", "limit", "measured", ""),
            (
                (g.name, f"{'≥' if g.at_least else '≤'} {_number(g.limit)} {g.unit}", _number(g.measured), g.verdict)
                for g in goals(results)
            ),
        ),
        "## The state at 3,000 samples, n = 2",
        "The closed form between reversals is exact; what is left of it is the reversal itself, which falls between "
        "two samples. A stream knows no peak between samples either.",
        _table(
            ("times ours", "way", "ns a sample", "largest error / z_max"),
            ((_number(r.ratio), r.name, _number(r.nanoseconds), f"{r.error:.0e}") for r in results.simulation),
        ),
        "## One condition identified",
        "1,000 noisy samples (3 % of the standard deviation of the force), five parameters. Reached: within 1 % of the "
        "best known squared error, over the seeds tried.",
        _table(
            ("times ours", "way", "ms a condition", "reached"),
            (
                (_number(r.ratio), r.name + " *" * r.computed, _number(1e3 * r.seconds), r.reached)
                for r in results.identification
            ),
        ),
        "## Many",
        _table(
            ("what", "ms"),
            ((r.name, _number(1e3 * r.seconds)) for r in results.many),
        ),
        _table(
            ("batch cost, four linear parameters eliminated", "ms", "ns a sample and set"),
            ((r.name, _number(1e3 * r.seconds), _number(r.nanoseconds)) for r in results.batches),
        ),
        _table(
            ("cost grows as size^p", "sizes", "p"),
            ((r.name, r.sizes, f"{r.exponent:.2f}") for r in results.growth),
        ),
        "## The bundled rigs",
        _table(("what", "s"), ((r.name, _number(r.seconds)) for r in results.real)),
        "## Whole processes",
        _table(
            ("process", "wall s", "processor s, children included", "peak MB of one"),
            ((r.name, _number(r.wall), _number(r.seconds), f"{r.megabytes:.0f}") for r in results.processes),
        ),
    ]
    return "\n\n".join(parts) + "\n"


def machine() -> str:
    """Processor and versions; no date, no name."""
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("numpy", "scipy", "numba"))
    return f"{_processor()}, Python {platform.python_version()}, {versions}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def _number(value: float | None) -> str:
    """Three digits, with commas from a thousand on."""
    if value is None:
        return "-"
    if value and (abs(value) < 1e-3 or abs(value) >= 1e7):
        return f"{value:.1e}"
    digits = 0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2 if abs(value) >= 1 else 3
    return f"{value:,.{digits}f}"
