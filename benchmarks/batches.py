"""Many parameter sets, many conditions: samples per second, and the growth of the cost."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from benchmarks import conditions
from benchmarks.timing import growth, race
from mrdamper.data import Floats, Run
from mrdamper.identification import Problem, identify
from mrdamper.identification.methods.projection import Projection
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.hysteresis import Shape
from mrdamper.physics.hysteresis.response import follow_alike
from mrdamper.physics.motion import Path
from mrdamper.statistics.linear import FixedColumns

SETS = 1000
_MAX_STATES = 2**17  # states held at a time


@dataclass(frozen=True)
class Growth:
    """Exponent p of time ∝ size^p."""

    name: str
    sizes: str
    exponent: float


@dataclass(frozen=True)
class BatchRow:
    """Time of a batch, and for one sample of it."""

    name: str
    seconds: float
    nanoseconds: float


def batch_rows(quick: bool) -> list[BatchRow]:
    """The grid of a search, a thousand shapes: on one loop of 1,000 samples, and on a record of ten cycles."""
    rows = []
    for cycles in (1, 10):
        path, fixed = loop(cycles * 1000, cycles)
        seconds = race({"": lambda p=path, f=fixed: batch_cost(p, f, shapes(SETS))}, 0.2 if quick else 1.0)[""]
        work = SETS * cycles * 1000
        rows.append(BatchRow(f"{SETS:,} shapes × {cycles * 1000:,} samples", seconds, 1e9 * seconds / work))
    return rows


@dataclass(frozen=True)
class ManyRow:
    """Time of many conditions."""

    name: str
    seconds: float


def many_rows(quick: bool) -> list[ManyRow]:
    """The 48 conditions of the synthetic matrix."""
    runs = [conditions.run(condition) for condition in conditions.MATRIX]
    problems = [prepared(run) for run in runs]
    sharp = [prepared(run, ("n",)) for run in runs]
    method = Projection()
    times = race(
        {
            "search": lambda: [method.solve(problem) for problem in problems],
            "n free, search": lambda: [method.solve(problem) for problem in sharp],
            "motion analysis alone: frequency, harmonics, smoothing, strokes": lambda: [
                prepared(replace(r)) for r in runs
            ],
            "identify(): motion analysis, errors and scores too": lambda: [identify(replace(r)) for r in runs],
        },
        0.4 if quick else 3.0,
    )
    return [ManyRow(f"{len(runs)} conditions, {name}", t) for name, t in times.items()]


def growth_rows(quick: bool) -> list[Growth]:
    """Samples, conditions, parameter sets."""
    share, rows = (0.1, []) if quick else (0.4, [])
    samples = (1000, 3000, 10_000, 30_000)
    found = [
        race({"": lambda p=prepared(conditions.run(samples=n)): Projection().solve(p)}, share)[""] for n in samples
    ]
    rows.append(Growth("search over samples", "1,000 … 30,000", growth(samples, found)))
    many = [prepared(conditions.run(c)) for c in conditions.MATRIX]
    counts = (6, 12, 24, 48)
    found = [race({"": lambda n=n: [Projection().solve(p) for p in many[:n]]}, share)[""] for n in counts]
    rows.append(Growth("search over conditions", "6 … 48", growth(counts, found)))
    sets = (30, 100, 300, 1000)
    path, fixed = loop(1000, 1)
    found = [race({"": lambda n=n: batch_cost(path, fixed, shapes(n))}, share)[""] for n in sets]
    rows.append(Growth("grid over shapes", "30 … 1,000", growth(sets, found)))
    return rows


@dataclass(frozen=True, eq=False)
class Products:
    """Sums over the samples for P shapes."""

    along: Floats  # (P, L) zeta · basis
    force: Floats  # (P,) zeta · rest of the force [N]
    square: Floats  # (P,) zeta · zeta


def batch_cost(path: Path, fixed: FixedColumns, shapes: Shape) -> Floats:
    """(P,) sums of squared force errors [N²] of P shapes, by their best coefficients, that of zeta not below zero.

    No array of shapes × samples is kept. The columns are those of the last M samples of the path; earlier samples only
    determine the state.
    """
    sums = products(path, fixed, shapes)
    left = sums.square - np.sum(sums.along**2, axis=1)  # squared zeta that no column explains
    gain = np.maximum(sums.force, 0.0) ** 2 / np.maximum(left, 1e-12 * sums.square + np.finfo(float).tiny)
    return float(fixed.rest @ fixed.rest) - gain


def products(path: Path, fixed: FixedColumns, shapes: Shape) -> Products:
    """Calculate sums of zeta times each column, the rest of the force and itself; arguments as `batch_cost`."""
    kappa, rho = (np.array(a, dtype=float) for a in np.broadcast_arrays(shapes.kappa, shapes.rho))
    first = len(path) - fixed.rest.size
    sums = np.empty((kappa.size, fixed.basis.shape[1] + 2))
    for value in dict.fromkeys(rho.tolist()):
        alike = np.flatnonzero(rho == value)
        few = max(1, _MAX_STATES // len(path))
        for part in (alike[i : i + few] for i in range(0, alike.size, few)):
            zeta = follow_alike(shapes.n, value, kappa[part], path)[:, first:]
            sums[part, :-2] = zeta @ fixed.basis
            sums[part, -2] = zeta @ fixed.rest
            sums[part, -1] = np.einsum("pn,pn->p", zeta, zeta)
    return Products(sums[:, :-2], sums[:, -2], sums[:, -1])


def loop(samples: int, cycles: int) -> tuple[Path, FixedColumns]:
    """A sine of some cycles, three columns, and a force that they and a state describe in part."""
    x, v = motion(samples, cycles), motion(samples, cycles, np.pi / 2)
    force = np.tanh(50 * v) + v + 0.1 * x
    return Path.of(x), FixedColumns.of(np.column_stack([v, x, np.ones(samples)]), force)


def motion(samples: int, cycles: int, ahead: float = 0.0) -> Floats:
    """A sine of 20 mm [m], by some angle ahead [rad]."""
    return 0.02 * np.sin(2 * np.pi * cycles * np.arange(samples) / samples + 0.3 + ahead)


def shapes(count: int) -> Shape:
    """Shapes from nearly elastic to nearly rigid."""
    return Shape(np.geomspace(2.0, 200.0, count) / 0.02, 0.0, 2.0)


def prepared(run: Run, free: tuple[str, ...] = ()) -> Problem:
    """A problem whose motion is analysed."""
    problem = Problem.of(run, BoucWen, free=free)
    _ = problem.motion.path, problem.seen, problem.force, problem.analysis
    return problem
