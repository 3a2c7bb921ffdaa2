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
    streams: Sequence = ()
    real: Sequence = ()
    study: Sequence = ()
    processes: Sequence = ()


def page(results: Results) -> str:
    """All tables, goals first."""
    parts = [
        "# Benchmarks",
        f"`make bench` prints this page; `python -m benchmarks --write docs/benchmarks.md` keeps it. {machine()}. "
        "The rows of a table are measured in turns; the minimum of many calls counts. Times are processor time on one "
        "thread, which depends little on the load of the machine: the load average was "
        f"{os.getloadavg()[1]:.1f} on {os.cpu_count()} processors. Whole processes also have wall times. "
        + ("This was a quick run: few repetitions. " if results.quick else "")
        + "Figures marked * are extrapolated from a part that was measured.",
        "Separate commands: reading a large file, `python -m benchmarks.import_large --megabytes 1000`; "
        "detection by the importer, `python -m benchmarks.import_detection`; the app, `python -m benchmarks.web`. A "
        "peer that is not installed is omitted (`make bench` does not install `openseespy`, `jax` and `diffrax`).",
        "## Goals",
        _table(
            ("goal", "limit", "measured", "verdict", "why missed"),
            (
                (
                    g.name,
                    f"{'≥' if g.at_least else '≤'} {_number(g.limit)} {g.unit}",
                    _number(g.measured),
                    g.verdict,
                    g.why if g.met is False else "",
                )
                for g in goals(results)
            ),
        ),
        "## The state at 3,000 samples, n = 2",
        "The closed form between reversals is exact; the remaining error is caused by reversals between two samples, "
        "which a stream does not contain either.",
        _table(
            ("relative time", "method", "ns per sample", "largest error / z_max"),
            ((_number(r.ratio), r.name, _number(r.nanoseconds), f"{r.error:.0e}") for r in results.simulation),
        ),
        "## One sample per call",
        "From displacement, current and time step to force, in nanoseconds per step. C is what `mrdamper export --to "
        "c` writes, at -O3 -march=native; its step computes velocity and acceleration from the displacement, checks "
        "its input and flags extrapolation. Code and tables of its object at -Os.",
        _table(
            ("damper", "Python, one call per step", "compiled, a whole motion", "C", "bytes, double", "bytes, single"),
            (
                (
                    r.name,
                    _number(r.python),
                    _number(r.compiled),
                    _number(r.c),
                    *([f"{b:,}" for b in r.bytes] if r.bytes else "--"),
                )
                for r in results.streams
            ),
        ),
        "## Identification of one condition",
        "1,000 noisy samples (3 % of the standard deviation of the force), five parameters. Reached: within 1 % of the "
        "best known squared error, over the seeds tried.",
        _table(
            ("relative time", "method", "ms per condition", "reached"),
            (
                (_number(r.ratio), r.name + " *" * r.computed, _number(1e3 * r.seconds), r.reached)
                for r in results.identification
            ),
        ),
        "## A search over a population, beside a graphics processor",
        Path(__file__).with_name("accelerator.md").read_text(encoding="utf-8").strip(),
        "## Many conditions",
        _table(
            ("operation", "ms"),
            ((r.name, _number(1e3 * r.seconds)) for r in results.many),
        ),
        _table(
            ("grid of a search, the linear parameters eliminated", "ms", "ns per sample and shape"),
            ((r.name, _number(1e3 * r.seconds), _number(r.nanoseconds)) for r in results.batches),
        ),
        _table(
            ("cost grows as size^p", "sizes", "p"),
            ((r.name, r.sizes, f"{r.exponent:.2f}") for r in results.growth),
        ),
        "## The bundled rigs",
        _table(("operation", "s"), ((r.name, _number(r.seconds)) for r in results.real)),
        *(_study(results.study) if results.study else ()),
        "## Whole processes",
        _table(
            ("process", "wall s", "processor s, children included", "peak MB of one"),
            ((r.name, _number(r.wall), _number(r.seconds), f"{r.megabytes:.0f}") for r in results.processes),
        ),
    ]
    return "\n\n".join(parts) + "\n"


def _study(rows: Sequence) -> list[str]:
    return [
        "## A study of the bundled rigs, part by part",
        "Processor seconds, the parts in sequence in one process. `mrdamper study` uses one process per rig, so that "
        "the slower rig determines the time.",
        _table(
            ("part", "s", "rig by rig"),
            (
                (r.name, _number(sum(r.seconds)), " + ".join(map(_number, r.seconds)) if len(r.seconds) > 1 else "")
                for r in rows
            ),
        ),
    ]


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
