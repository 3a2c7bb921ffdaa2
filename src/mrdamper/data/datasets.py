"""Runs that belong together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mrdamper.data.displayable import Displayable
from mrdamper.data.runs import SPLITS, Run, Split
from mrdamper.data.wording import counted
from mrdamper.errors import RunError, UnknownNameError, check_fields, is_a, shown, validate_arguments


@dataclass(frozen=True, eq=False, repr=False)
class Dataset(Displayable):
    """Runs that belong together.

    Attributes
    ----------
    runs : tuple of Run
        In the order of the file.
    name : str
        Shown in reports.

    Raises
    ------
    RunError
        If there are no runs or two share an id.

    Examples
    --------
    >>> from mrdamper import load_dataset
    >>> tests = load_dataset()
    >>> tests.rigs
    ('labcontrol', 'utfsm')
    >>> len(tests.rig("utfsm").split("validate"))
    5
    >>> tests["utf_5mm4Hz_1A"].current_A  # [A]
    1.0
    """

    read_by: ClassVar = "mrdamper.load_dataset(folder)"
    runs: tuple[Run, ...]
    name: str = "dataset"

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "runs", tuple(self.runs) if np.iterable(self.runs) and not is_a(self.runs, str) else self.runs
        )
        check_fields(self, "runs", "name")
        if not self.runs:
            raise RunError("no runs", where=f"dataset {self.name}", remedy="give at least one")
        ids: set[str] = set()
        for run in self.runs:
            if run.id in ids:
                raise RunError(f"two runs are called {run.id}", where=f"dataset {self.name}", remedy="rename one")
            ids.add(run.id)

    def __eq__(self, other: object) -> bool:
        """Tell if two datasets have equal runs in the same order; the name, which a folder gives, does not count."""
        return self is other or (isinstance(other, Dataset) and self.runs == other.runs)

    def __hash__(self) -> int:
        return hash(self.runs)

    @property
    def headline(self) -> str:
        """Name, runs per rig and number of validation runs."""
        rigs = "".join(f", {len(self.rig(name))} of rig {name}" for name in self.rigs if name)
        runs = f"{counted(len(self), 'run')}"
        return f"dataset {self.name}: {runs}{rigs}; {len(self.split('validate')) or 'no'} validation runs"

    @property
    def table(self) -> Mapping[str, Sequence[Any]]:
        """One row per run."""
        runs = self.runs
        return {
            "run_id": [run.id for run in runs],
            "rig": [run.rig for run in runs],
            "excitation": [run.excitation for run in runs],
            "split": [run.split for run in runs],
            "samples": [run.time.size for run in runs],
            "duration_s": [float(run.time[-1] - run.time[0]) for run in runs],
            "mean_current_A": [float(np.mean(run.current)) for run in runs],
            "stroke_m": [float(np.ptp(run.displacement)) for run in runs],
            "peak_force_N": [float(np.max(np.abs(run.force))) for run in runs],
        }

    def __iter__(self) -> Iterator[Run]:
        return iter(self.runs)

    def __len__(self) -> int:
        return len(self.runs)

    @validate_arguments()
    def __getitem__(self, run_id: str | int) -> Run:
        """Return the run of an id, or at a position."""
        if isinstance(run_id, int):
            if not -len(self) <= run_id < len(self):
                raise UnknownNameError(f"no run at position {shown(run_id)}", remedy=f"there are {len(self)}, from 0")
            return self.runs[run_id]
        for run in self.runs:
            if run.id == run_id:
                return run
        raise UnknownNameError.of("run", run_id, (run.id for run in self.runs))

    @property
    def rigs(self) -> tuple[str, ...]:
        """Names of the rigs, in order of appearance."""
        return tuple(dict.fromkeys(run.rig for run in self.runs))

    @validate_arguments()
    def rig(self, name: str) -> Dataset:
        """Return the runs of one rig; a rig without a name has that of the dataset. Raises `UnknownNameError`."""
        rig = "" if name == self.name and name not in self.rigs else name
        if rig not in self.rigs:
            raise UnknownNameError.of("rig", name, (one or self.name for one in self.rigs))
        return self.only([run for run in self.runs if run.rig == rig], name=rig or self.name)

    @validate_arguments()
    def split(self, split: Split) -> tuple[Run, ...]:
        """Return the runs of one split; raises `UnknownNameError`."""
        if split not in SPLITS:
            raise UnknownNameError.of("split", split, SPLITS)
        return tuple(run for run in self.runs if run.split == split)

    @validate_arguments()
    def only(self, runs: Iterable[Run], name: str | None = None) -> Dataset:
        """Return the same dataset with these runs only."""
        return Dataset(tuple(runs), name or self.name)
