"""Test data: a `Condition` of the test matrix, a recorded `Run`, a `Dataset` of runs.

SI units. Displacement and force count positive in the same direction, so that a damper
resists: a positive velocity meets a positive force. What enters here has been checked;
code further up trusts it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import wraps
from typing import Literal, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrdamper.errors import NonFiniteError, RunError, TimeOrderError, UnknownNameError

Floats = NDArray[np.float64]
T = TypeVar("T")
Split = Literal["train", "validate"]
_SAME = 0.03  # frequencies and amplitudes this close are one condition of the test matrix


@dataclass(frozen=True, slots=True, order=True)
class Condition:
    """One point of the test matrix.

    Attributes
    ----------
    current_A : float
        Coil current [A].
    frequency_Hz : float
        Frequency of the motion [Hz].
    amplitude_m : float
        Displacement amplitude, half the peak-to-peak stroke [m].
    """

    current_A: float
    frequency_Hz: float
    amplitude_m: float

    @property
    def peak_velocity(self) -> float:
        """Largest velocity of a sine at this condition [m/s]."""
        return 2 * np.pi * self.frequency_Hz * self.amplitude_m

    def __str__(self) -> str:
        return f"{self.current_A:g} A, {self.frequency_Hz:.3g} Hz, {1e3 * self.amplitude_m:.3g} mm"


def same_condition(conditions: Sequence[Condition]) -> list[list[int]]:
    """Group the indices of conditions that agree in current and, to 3 %, in frequency and amplitude."""
    groups: list[list[int]] = []
    for index, condition in enumerate(conditions):
        for group in groups:
            if _agree(condition, conditions[group[0]]):
                group.append(index)
                break
        else:
            groups.append([index])
    return groups


def _agree(a: Condition, b: Condition) -> bool:
    return (
        abs(a.current_A - b.current_A) <= 1e-3 + _SAME * abs(b.current_A)
        and abs(a.frequency_Hz / b.frequency_Hz - 1) <= _SAME
        and abs(a.amplitude_m / b.amplitude_m - 1) <= _SAME
    )


@dataclass(frozen=True, eq=False)
class Run:
    """One recorded test.

    Attributes
    ----------
    id : str
        Name, unique in its dataset.
    time, displacement, force : (N,) arrays
        [s], [m], [N]; time strictly increasing, all finite.
    current : (N,) array or float
        Coil current [A]; a scalar holds for the whole run.
    velocity : (N,) array, optional
        Measured velocity channel [m/s], where the rig records one.
    rig : str
        Test rig and damper the run belongs to.
    excitation : str
        Kind of motion as the rig names it: "sine", "chirp", ...
    split : "train" or "validate"
        Models never see validate runs.
    nominal : Condition, optional
        The condition as commanded. Nothing is computed from it.
    window : (float, float), optional
        Start and end [s] of steady motion; scores use it. Default: the whole record.
    repeatability : float, optional
        Cycle-to-cycle scatter of the force over its peak-to-peak value: no model can beat it.
    segments : tuple of (int, int), optional
        Half-open sample ranges without a gap in time. Default: one range.
    notes : mapping
        Licence, provenance and remarks, by name.

    Raises
    ------
    RunError, TimeOrderError, NonFiniteError
        If the channels differ in length, time is not increasing, or values are not finite.
    """

    id: str
    time: Floats
    displacement: Floats
    force: Floats
    current: Floats
    velocity: Floats | None = None
    rig: str = ""
    excitation: str = "sine"
    split: Split = "train"
    nominal: Condition | None = None
    window: tuple[float, float] | None = None
    repeatability: float | None = None
    segments: tuple[tuple[int, int], ...] = ()
    notes: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        time = self._channel("time", self.time)
        size = time.size
        if size < 3:
            raise RunError(f"{size} samples", where=self._where, mend="a run needs at least 3")
        backwards = np.flatnonzero(np.diff(time) <= 0)
        if backwards.size:
            i = int(backwards[0]) + 1
            raise TimeOrderError(
                f"time goes from {time[i - 1]:.6g} s to {time[i]:.6g} s at sample {i}",
                where=self._where,
                mend="sort the samples or drop the repeated ones",
            )
        channels = {name: self._channel(name, getattr(self, name), size) for name in ("displacement", "force")}
        channels["current"] = self._channel("current", np.broadcast_to(self.current, size), size)
        if self.velocity is not None:
            channels["velocity"] = self._channel("velocity", self.velocity, size)
        for name, value in {"time": time, **channels}.items():
            object.__setattr__(self, name, value)
        if self.split not in ("train", "validate"):
            raise RunError(f"split is {self.split!r}", where=self._where, mend="use train or validate")
        object.__setattr__(self, "segments", tuple(self.segments) or ((0, size),))
        object.__setattr__(self, "notes", dict(self.notes))

    @property
    def current_A(self) -> float:
        """The run's one coil current [A].

        Raises
        ------
        RunError
            If the current varies by more than 1 mA + 1 % within the run.
        """
        mean = float(np.mean(self.current))
        if np.ptp(self.current) > 1e-3 + 0.01 * abs(mean):
            raise RunError(
                f"current varies between {self.current.min():g} A and {self.current.max():g} A",
                where=self._where,
                mend="use a joint model, which takes a current channel",
            )
        return round(mean, 9)

    @property
    def findings(self) -> tuple[str, ...]:
        """Codes of what the import noticed, for example W_CLIPPED."""
        return tuple(self.notes.get("findings", "").split())

    @property
    def in_window(self) -> NDArray[np.bool_]:
        """(N,) mask of the samples inside the steady window."""
        if self.window is None:
            return np.ones(self.time.size, dtype=bool)
        return (self.time >= self.window[0]) & (self.time <= self.window[1])

    def steady(self) -> Run:
        """The part of the run inside its steady window."""
        inside = np.flatnonzero(self.in_window)
        if inside.size < 3:
            raise RunError(
                f"the steady window {self.window} s holds {inside.size} samples",
                where=self._where,
                mend="correct steady_t0_s and steady_t1_s",
            )
        return self.part(int(inside[0]), int(inside[-1]) + 1)

    def part(self, start: int, stop: int) -> Run:
        """The samples start..stop-1 as a run of their own."""
        inner = [(max(a, start) - start, min(b, stop) - start) for a, b in self.segments]
        return replace(
            self,
            time=self.time[start:stop],
            displacement=self.displacement[start:stop],
            force=self.force[start:stop],
            current=self.current[start:stop],
            velocity=None if self.velocity is None else self.velocity[start:stop],
            segments=tuple((a, b) for a, b in inner if b > a),
        )

    @property
    def _where(self) -> str:
        return f"run {self.id}"

    def _channel(self, name: str, values: ArrayLike, size: int | None = None) -> Floats:
        array = np.asarray(values, dtype=np.float64)
        if array.ndim != 1:
            raise RunError(f"{name} has {array.ndim} dimensions", where=self._where, mend="pass 1-D arrays")
        if size is not None and array.size != size:
            raise RunError(
                f"{name} has {array.size} samples, time has {size}",
                where=self._where,
                mend="trim or resample the run",
            )
        bad = np.flatnonzero(~np.isfinite(array))
        if bad.size:
            raise NonFiniteError(
                f"{name} has {bad.size} values that are not finite, the first at sample {bad[0]}",
                where=self._where,
                mend="remove these samples",
            )
        array = array.view()
        array.flags.writeable = False
        return array


def once_per_run(function: Callable[[Run], T]) -> Callable[[Run], T]:
    """Remember what a function of a run found for as long as the run lives.

    A study asks for the same run's motion dozens of times; runs are frozen, so the answer
    cannot change.
    """
    known: WeakKeyDictionary[Run, T] = WeakKeyDictionary()

    @wraps(function)
    def remembered(run: Run) -> T:
        if run not in known:
            known[run] = function(run)
        return known[run]

    return remembered


@dataclass(frozen=True, eq=False)
class Dataset:
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
    """

    runs: tuple[Run, ...]
    name: str = "dataset"

    def __post_init__(self) -> None:
        object.__setattr__(self, "runs", tuple(self.runs))
        if not self.runs:
            raise RunError("no runs", where=f"dataset {self.name}", mend="give at least one")
        seen: set[str] = set()
        for run in self.runs:
            if run.id in seen:
                raise RunError(f"two runs are called {run.id}", where=f"dataset {self.name}", mend="rename one")
            seen.add(run.id)

    def __iter__(self) -> Iterator[Run]:
        return iter(self.runs)

    def __len__(self) -> int:
        return len(self.runs)

    def __getitem__(self, run_id: str) -> Run:
        for run in self.runs:
            if run.id == run_id:
                return run
        raise UnknownNameError.of("run", run_id, (run.id for run in self.runs))

    @property
    def rigs(self) -> tuple[str, ...]:
        """Names of the rigs, in order of appearance."""
        return tuple(dict.fromkeys(run.rig for run in self.runs))

    def rig(self, name: str) -> Dataset:
        """The runs of one rig."""
        if name not in self.rigs:
            raise UnknownNameError.of("rig", name, self.rigs)
        return self.only([run for run in self.runs if run.rig == name], name=name or self.name)

    def split(self, split: Split) -> tuple[Run, ...]:
        """The runs of one split."""
        return tuple(run for run in self.runs if run.split == split)

    def only(self, runs: Sequence[Run], name: str | None = None) -> Dataset:
        """The same dataset with these runs only."""
        return Dataset(tuple(runs), name or self.name)
