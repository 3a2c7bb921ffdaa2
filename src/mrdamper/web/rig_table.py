"""Runs of a rig with condition, properties of the loop and reason of a refusal."""

from __future__ import annotations

import threading
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from mrdamper.data import Condition, Dataset, Run, level_groups, same_motion
from mrdamper.data.encoding import finite
from mrdamper.errors import InputError
from mrdamper.identification.loop_analysis import LoopAnalysis, analyse_loop
from mrdamper.physics.motion import equivalent_sine
from mrdamper.rig_files.quality.table import Quality, quality_table, record_of
from mrdamper.study.usable_runs import usable_sines
from mrdamper.web.curves import MM

_MAX_NEAREST = 3  # measured loops shown with a prediction
_MAX_DISTANCE = 0.4  # of the nearest run from a condition; relative current, logarithms of frequency and amplitude
_MAX_DISTANCE_OF_OTHERS = 0.2
_LOOP_QUANTITIES = {"peak_N": "peak_force", "energy_J": "dissipated_energy", "mean_N": "mean_force"}
_LOOP_QUANTITIES["damping_Ns_m"] = "equivalent_damping"
_TABLES: WeakKeyDictionary[Dataset, dict[str, RigTable]] = WeakKeyDictionary()
_BUILDING = threading.Lock()


@dataclass(frozen=True, eq=False)
class TableRow:
    """One run."""

    key: str
    run: Run
    condition: Condition | None  # measured; None where the run does not move
    loop: LoopAnalysis | None  # of steady sines
    refused: str  # reason not to identify from it; empty for others


@dataclass(frozen=True, eq=False)
class RigTable:
    """The runs of one rig, in the order of the file."""

    dataset: Dataset
    rows: tuple[TableRow, ...]
    _checking: threading.Lock = field(default_factory=threading.Lock, repr=False)

    @classmethod
    def of(cls, dataset: Dataset) -> RigTable:
        """Analyse every run of a rig."""
        sines, refused = usable_sines(dataset)
        steady = {run.id for run in sines}
        rows = []
        for i, run in enumerate(dataset):
            condition = loop = None
            with suppress(InputError):
                condition = equivalent_sine(run).condition
            with suppress(InputError):
                loop = analyse_loop(run) if run.id in steady else None
            rows.append(TableRow(f"run{i}", run, condition, loop, refused.get(run.id, "")))
        return cls(dataset, tuple(rows))

    @property
    def quality(self) -> tuple[Quality, ...]:
        """Quality of every run, in order: checked once, when first needed."""
        with self._checking:
            return self._quality

    @cached_property
    def _quality(self) -> tuple[Quality, ...]:
        return quality_table(record_of(row.run) for row in self.rows)

    @cached_property
    def steady(self) -> list[tuple[TableRow, Condition]]:
        """Steady sines, each with its condition."""
        return [(row, row.condition) for row in self.rows if row.loop and row.condition]

    @property
    def currents(self) -> list[float]:
        """Levels of the steady sines [A], ascending."""
        return [*level_groups([condition.current_A for _, condition in self.steady])]

    def row(self, key: str) -> TableRow:
        """Return a row by its key; raises `InputError` if there is none."""
        for row in self.rows:
            if row.key == key:
                return row
        raise InputError("no such run in the data", remedy="choose one from the table", code="E_NAME")

    def nearest(self, condition: Condition, count: int = _MAX_NEAREST, any_distance: bool = False) -> list[TableRow]:
        """Return the steady sines measured nearest to a condition, the nearest first."""
        largest = max((c.current_A for _, c in self.steady), default=0.0) or 1.0

        def distance(steady: tuple[TableRow, Condition]) -> float:
            _, c = steady
            return max(
                abs(c.current_A - condition.current_A) / largest,
                abs(np.log(c.frequency_Hz / condition.frequency_Hz)),
                abs(np.log(c.amplitude_m / condition.amplitude_m)),
            )

        ordered = sorted(self.steady, key=distance)[:count]
        limits = [_MAX_DISTANCE, *([_MAX_DISTANCE_OF_OTHERS] * len(ordered))]
        return [one[0] for one, limit in zip(ordered, limits, strict=False) if any_distance or distance(one) <= limit]

    def at_motion(self, condition: Condition) -> list[TableRow]:
        """Return the steady sines with the motion of a condition, at any current."""
        groups = same_motion([condition, *(c for _, c in self.steady)])
        return [self.steady[i - 1][0] for i in groups[0] if i > 0]

    def motions(self) -> list[list[TableRow]]:
        """Return the steady sines by motion, in the order of frequency and amplitude: rows of the test matrix."""
        conditions = [c for _, c in self.steady]
        groups = [[self.steady[i] for i in group] for group in same_motion(conditions)]
        groups.sort(key=lambda group: (round(group[0][1].frequency_Hz, 2), group[0][1].amplitude_m))
        return [[row for row, _ in group] for group in groups]


def rig_table(dataset: Dataset, rig: str) -> RigTable:
    """Return the table of a rig, built once for as long as the data exist."""
    tables = _TABLES.setdefault(dataset, {})
    if rig not in tables:
        with _BUILDING:  # one at a time; a table that exists is returned without waiting
            if rig not in tables:
                tables[rig] = RigTable.of(dataset.rig(rig))
    return tables[rig]


def describe(row: TableRow) -> dict[str, Any]:
    """Return a row in the units of the page."""
    run, loop = row.run, row.loop
    return {
        "key": row.key, "id": run.id, "split": run.split, "refused": row.refused,
        "condition": screen_condition(row.condition),
        "samples": int(run.time.size),
        "duration_s": finite(float(run.time[-1] - run.time[0])),
        "cycles": finite(loop.motion.cycles) if loop else None,
        **{name: finite(getattr(loop, quantity)) if loop else None for name, quantity in _LOOP_QUANTITIES.items()},
        "repeatability": finite(run.repeatability),
    }  # fmt: skip


def screen_condition(condition: Condition | None) -> dict[str, float] | None:
    """Return a condition in the units of the page."""
    if condition is None:
        return None
    current_A, frequency_Hz, amplitude_mm = condition.current_A, condition.frequency_Hz, MM * condition.amplitude_m
    return {"current_A": current_A, "frequency_Hz": frequency_Hz, "amplitude_mm": amplitude_mm}
