"""Runs of a rig with condition, characteristics of the loop and reason of a refusal."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from mrdamper.data import Condition, Dataset, Run, current_levels, same_motion
from mrdamper.data.encoding import finite
from mrdamper.errors import InputError
from mrdamper.identification.loop_analysis import LoopAnalysis, analyse_loop
from mrdamper.physics.motion import equivalent_sine
from mrdamper.rig_files.quality import Quality, quality_table, record_of
from mrdamper.study.usable_runs import usable_sines

MM = 1e3
_NEAREST = 3  # measured loops laid under a prediction
_TABLES: WeakKeyDictionary[Dataset, dict[str, RigTable]] = WeakKeyDictionary()
_MAKING = threading.Lock()
_FAR, _ALSO = 0.4, 0.2  # beyond, a run says nothing about the condition asked for; further ones must be nearer


@dataclass(frozen=True, eq=False)
class TableRow:
    """One run."""

    key: str  # made here
    run: Run
    condition: Condition | None  # measured; None where the run does not move
    loop: LoopAnalysis | None  # of steady sines
    refused: str  # why it is not identified from; empty where it can be


@dataclass(frozen=True, eq=False)
class RigTable:
    """The runs of one rig, in the order of the file."""

    dataset: Dataset
    rows: tuple[TableRow, ...]
    _judging: threading.Lock = field(default_factory=threading.Lock, repr=False)

    @classmethod
    def of(cls, dataset: Dataset) -> RigTable:
        """Analyse every run of a rig."""
        sines, refused = usable_sines(dataset)
        steady = {run.id for run in sines}
        rows = [
            TableRow(f"run{i}", run, _condition(run), _loop(run) if run.id in steady else None, refused.get(run.id, ""))
            for i, run in enumerate(dataset)
        ]
        return cls(dataset, tuple(rows))

    @property
    def quality(self) -> tuple[Quality, ...]:
        """The verdict on every run, in order: judged once, when first asked for."""
        with self._judging:
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
        """Levels of the steady sines [A], rising."""
        return sorted(set(current_levels([condition.current_A for _, condition in self.steady])))

    def row(self, key: str) -> TableRow:
        """Return the row of that key; raises `InputError` if there is none."""
        for row in self.rows:
            if row.key == key:
                return row
        raise InputError("no such run on the bench", remedy="choose one from the table", code="E_NAME")

    def nearest(self, condition: Condition, most: int = _NEAREST, anywhere: bool = False) -> list[TableRow]:
        """Steady sines measured nearest to a condition, the nearest first; the far ones only if `anywhere`."""
        reach = max((c.current_A for _, c in self.steady), default=0.0) or 1.0

        def distance(steady: tuple[TableRow, Condition]) -> float:
            _, c = steady
            return max(
                abs(c.current_A - condition.current_A) / reach,
                abs(np.log(c.frequency_Hz / condition.frequency_Hz)),
                abs(np.log(c.amplitude_m / condition.amplitude_m)),
            )

        ordered = sorted(self.steady, key=distance)[:most]
        return [one[0] for i, one in enumerate(ordered) if anywhere or distance(one) <= (_ALSO if i else _FAR)]

    def at_motion(self, condition: Condition) -> list[TableRow]:
        """Steady sines of the motion of a condition, at any current."""
        groups = same_motion([condition, *(c for _, c in self.steady)])
        return [self.steady[i - 1][0] for i in groups[0] if i > 0]

    def motions(self) -> list[list[TableRow]]:
        """Steady sines of one motion each, slow and small first: the lines of the test matrix."""
        rows, conditions = [row for row, _ in self.steady], [c for _, c in self.steady]
        groups = same_motion(conditions)
        firsts = [conditions[group[0]] for group in groups]
        order = sorted(range(len(groups)), key=lambda i: (round(firsts[i].frequency_Hz, 2), firsts[i].amplitude_m))
        return [[rows[i] for i in groups[place]] for place in order]


def rig_table(dataset: Dataset, rig: str) -> RigTable:
    """Return the table of a rig, made once for as long as the data live."""
    tables = _TABLES.setdefault(dataset, {})
    if rig not in tables:
        with _MAKING:  # one at a time; tables that are there are found without waiting
            if rig not in tables:
                tables[rig] = RigTable.of(dataset.rig(rig))
    return tables[rig]


def describe(row: TableRow) -> dict[str, Any]:
    """Return a row as the page shows it, in its units."""
    run, loop = row.run, row.loop
    return {
        "key": row.key,
        "id": run.id,
        "split": run.split,
        "excitation": run.excitation,
        "condition": condition_on_screen(row.condition),
        "samples": int(run.time.size),
        "duration_s": finite(float(run.time[-1] - run.time[0])),
        "cycles": finite(loop.motion.cycles) if loop else None,
        "peak_N": finite(loop.peak_force) if loop else None,
        "energy_J": finite(loop.dissipated_energy) if loop else None,
        "mean_N": finite(loop.mean_force) if loop else None,
        "damping_Ns_m": finite(loop.equivalent_damping) if loop else None,
        "repeatability": finite(run.repeatability),
        "refused": row.refused,
        "notes": {name: str(value) for name, value in run.notes.items()},
    }


def condition_on_screen(condition: Condition | None) -> dict[str, float] | None:
    """Return a condition in the units of the screen."""
    if condition is None:
        return None
    return {
        "current_A": condition.current_A,
        "frequency_Hz": condition.frequency_Hz,
        "amplitude_mm": MM * condition.amplitude_m,
    }


def _condition(run: Run) -> Condition | None:
    try:
        return equivalent_sine(run).condition
    except InputError:
        return None


def _loop(run: Run) -> LoopAnalysis | None:
    try:
        return analyse_loop(run)
    except InputError:
        return None
