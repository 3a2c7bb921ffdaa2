"""Plan of a population: start values, parameters that the tests do not determine, and reference loops."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mrdamper.data import Condition, Floats, same_condition
from mrdamper.fleet.item import hash_of
from mrdamper.fleet.loops import Test, by_test

_SPEED_STEPS = (0.25, 0.5, 0.75, 1.0)  # of the velocities, over the highest test speed
_CANDIDATES = 2  # start values that are tried
_MIN_COST_RISE = 0.02  # relative rise of the squared error by which a parameter counts as determined
_RIDGE = 1e-12  # keeps the curvature invertible along directions without effect


@dataclass(frozen=True)
class Plan:
    """Start values and reference values from the first dampers of a population.

    Made once from dampers that are selected by their serial numbers and kept in the journal, so that no result depends
    on the order in which dampers are finished.
    """

    axes: tuple[str, ...]  # free search axes of the dampers it was made from
    start: tuple[float, ...]  # median on each
    held: dict[str, float]  # parameters that the tests do not determine, at the population's value
    matrix: tuple[Test, ...]  # the line's tests
    loops: tuple[tuple[float, ...], ...]  # median measured loop of each [N]
    speeds: tuple[float, ...]  # velocity ladder [m/s]
    # median, and 1.48 times the median deviation from it, of the median nrmse_pp and of the distance of the measured
    # loops from the median loops
    error: float = 0.0
    error_spread: float = 0.0
    deviation: float = 0.0
    deviation_spread: float = 0.0
    rig: str = ""  # that most reference dampers were tested on; empty if there is none
    references: tuple[str, ...] = ()  # names of the dampers it was made from
    draft: bool = False  # a trial of start values: no damper is an outlier

    @cached_property
    def document(self) -> dict[str, Any]:
        """As JSON holds it."""
        return asdict(self)

    @cached_property
    def digest(self) -> str:
        """Hash of the document."""
        return hash_of(self.document)

    @property
    def currents(self) -> tuple[float, ...]:
        """The line's test currents [A]."""
        return tuple(sorted({round(test[0], 3) for test in self.matrix}))

    @property
    def amplitude(self) -> float:
        """Amplitude of the sines of the velocities [m]."""
        return float(np.median([test[2] for test in self.matrix]))


def drafts(rows: dict[str, dict[str, Any]]) -> list[Plan]:
    """Make plans from the rows of the reference dampers by name, one for each candidate of the start values.

    A search finds a local minimum near its start. The results of the dampers with the smallest errors are tried as
    starts, and the one with which most dampers have the lowest error is used. Dampers whose tests determine other
    search axes than most, such as one with a single test, are no references.
    """
    axes = [tuple(row["axes"]) for row in rows.values()]
    common = max(axes, key=lambda some: (axes.count(some), len(some)))
    rows = {name: row for name, row in rows.items() if tuple(row["axes"]) == common}
    tests = [[_as_test(t) for t in row["tests"]] for row in rows.values()]
    matrix = _matrix([test for some in tests for test in some], len(rows))
    loops_by_test: list[list[Floats]] = [[] for _ in matrix]
    for some, row in zip(tests, rows.values(), strict=True):
        for number, like in enumerate(by_test(some, matrix)):
            loops_by_test[number] += [np.array(row["loops"][i]) for i in like]
    top = max(Condition(*test).peak_velocity for test in matrix)
    rigs = [row["rig"] for row in rows.values()]
    rig = max(sorted(set(rigs)), key=rigs.count)
    best = sorted(rows.values(), key=lambda row: row["cost"])[:_CANDIDATES]
    return [
        Plan(
            axes=common,
            start=tuple(row["point"]),
            held={},
            matrix=matrix,
            loops=tuple(tuple(np.round(np.median(some, axis=0), 3).tolist()) for some in loops_by_test),
            speeds=tuple(float(f"{step * top:.2g}") for step in _SPEED_STEPS),
            rig=rig if 2 * rigs.count(rig) > len(rigs) else "",
            references=tuple(rows),
            draft=True,
        )
        for row in best
    ]


def holding(plan: Plan, rows: Sequence[dict[str, Any]]) -> Plan:
    """Fix, at the median of the population, the parameters that its tests do not determine.

    A few records do not determine all parameters of a model. A parameter that could change by a fifth (on an axis that
    is no logarithm, by a twentieth of its width) with the others refitted while the squared error rises by less than a
    fiftieth is held, the least determined first. A ratio of which a part is held is held, too: without tests of the
    free play, the share of the series spring in it is not determined. The other parameters have one minimum,
    independent of the start, and can be compared.
    """
    curvature = np.array([row["curvature"] for row in rows])
    names, parts = rows[0]["axes"], rows[0]["stands_for"]
    free = list(range(len(names)))
    while free:
        some = [c[np.ix_(free, free)] for c in curvature]
        inverse = [np.linalg.inv(c + _RIDGE * (1 + np.trace(c)) * np.eye(len(free))) for c in some]
        rises = np.median([1 / np.diag(i) for i in inverse], axis=0)
        rises = rises * np.array([rows[0]["changes"][i] for i in free]) ** 2
        rises[[len(parts[i]) > 1 for i in free]] = np.inf
        if rises.min() > _MIN_COST_RISE:
            break
        del free[int(np.argmin(rises))]
    held = {parts[i][0] for i in range(len(names)) if i not in free}
    free = [i for i in free if not held & set(parts[i])]
    held |= {part for i in range(len(names)) if i not in free for part in parts[i]}
    values = {name: float(np.median([row["parameters"][name] for row in rows])) for name in sorted(held)}
    points = np.array([row["point"] for row in rows])
    start = tuple(np.median(points[:, free], axis=0).tolist())
    return replace(plan, axes=tuple(names[i] for i in free), start=start, held=values)


def settled(plan: Plan, rows: Sequence[dict[str, Any]]) -> Plan:
    """Make the plan from the results of the reference dampers under its draft."""
    start = tuple(np.median([row["point"] for row in rows], axis=0).tolist())
    error, error_spread = _middle(np.array([row["nrmse_pp"] for row in rows]))
    away, away_spread = _middle(np.array([row["loop_deviation"] for row in rows]))
    middles = {"error": error, "error_spread": error_spread, "deviation": away, "deviation_spread": away_spread}
    return replace(plan, start=start, draft=False, **middles)


def _middle(values: Floats) -> tuple[float, float]:
    """Median, and 1.48 times the median deviation from it: robust estimates of mean and standard deviation."""
    middle = float(np.median(values))
    return middle, 1.4826 * float(np.median(np.abs(values - middle)))


def _matrix(tests: list[Test], dampers: int) -> tuple[Test, ...]:
    groups = same_condition([Condition(*test) for test in tests])
    common = [g for g in groups if 2 * len(g) >= dampers] or groups
    return tuple(sorted(_as_test(np.median([tests[i] for i in g], axis=0).tolist()) for g in common))


def _as_test(values: Sequence[float]) -> Test:
    current, frequency, amplitude = values
    return current, frequency, amplitude
