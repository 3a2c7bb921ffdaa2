"""A recorded `Run`, and its coil current: constant but for noise, or changing.

SI units. Displacement and force are positive in the same direction: a positive velocity causes a positive force. Runs
are checked when they are created.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, wraps
from typing import Any, Literal, TypeVar, get_args
from weakref import ref

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrdamper.data.arrays import Floats, chunks, index_at, take
from mrdamper.data.conditions import Condition
from mrdamper.data.displayable import Displayable
from mrdamper.data.wording import counted, number, span
from mrdamper.errors import (
    NonFiniteError,
    RunError,
    TimeOrderError,
    check_fields,
    is_a,
    printable,
    require,
    shown,
    validate_arguments,
)

K = TypeVar("K")
T = TypeVar("T")
Split = Literal["train", "validate"]
SPLITS: tuple[str, ...] = get_args(Split)
_MAX_NAME_CHARACTERS = 255


@dataclass(frozen=True, eq=False, repr=False)
class Run(Displayable):
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
        Kind of motion, named by the rig: "sine", "chirp", ...
    split : "train" or "validate"
        Validate runs are not used for identification.
    nominal : Condition, optional
        The commanded condition, which is not used for calculations.
    window : (float, float), optional
        Start and end [s] of steady motion; scores use it. Default: the whole record.
    repeatability : float, optional
        Cycle-to-cycle scatter of the force over its peak-to-peak value, the lower limit of the error of any model.
    segments : tuple of (int, int), optional
        Half-open sample ranges without a gap in time. Default: one range.
    further : mapping of str to (N,) array
        Further channels by name and unit, as "temperature_C" or "pressure_Pa"; NaN where a sample
        is missing. No model is identified from them.
    notes : mapping
        Licence, provenance and remarks, by name.

    Raises
    ------
    RunError, TimeOrderError, NonFiniteError
        If the channels differ in length, time is not increasing, or values are not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from mrdamper import Run
    >>> t = np.linspace(0.0, 2.0, 401)  # [s]
    >>> x = 0.01 * np.sin(2 * np.pi * t)  # [m]
    >>> Run("r1", time=t, displacement=x, force=5e4 * x, current=0.5, rig="bench")
    <run r1 of rig bench: 401 samples, 2 s, 0.5 A, train>
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
    further: Mapping[str, Floats] = field(default_factory=dict[str, Floats])
    notes: Mapping[str, str] = field(default_factory=dict[str, str])

    def __post_init__(self) -> None:
        check_fields(self, "excitation", "nominal", "window", "repeatability", "segments", "notes")
        require(self.further, Mapping, "further channels", 'give {"temperature_C": array, ...}')
        for what, name in (("id", self.id), ("rig", self.rig)):
            require_name(what, name)
        time = self._channel("time", self.time)
        size = time.size
        if size < 3:
            raise RunError(f"{size} samples", where=self._where, remedy="a run needs at least 3")
        for at, piece in chunks(time, overlap=1):
            backwards = np.flatnonzero(np.diff(piece) <= 0)
            if not backwards.size:
                continue
            i = at + int(backwards[0]) + 1
            raise TimeOrderError(
                f"time goes from {time[i - 1]:.6g} s to {time[i]:.6g} s at sample {i}",
                where=self._where,
                remedy="sort the samples or drop the repeated ones",
            )
        channels = {name: self._channel(name, getattr(self, name), size) for name in ("displacement", "force")}
        channels["current"] = self._channel("current", self.current, size)
        if self.velocity is not None:
            channels["velocity"] = self._channel("velocity", self.velocity, size)
        for name, value in {"time": time, **channels}.items():
            object.__setattr__(self, name, value)
        for name, values in self.further.items():
            if np.shape(values) != (size,):
                raise RunError(
                    f"{name} has {np.size(values)} samples, time has {size}", where=self._where,
                    remedy="trim or resample the run",
                )  # fmt: skip
        object.__setattr__(self, "further", {name: np.asarray(v, dtype=float) for name, v in self.further.items()})
        if not is_a(self.split, str) or self.split not in SPLITS:
            raise RunError(f"split is {shown(self.split)}", where=self._where, remedy="use train or validate")
        object.__setattr__(self, "segments", tuple(self.segments) or ((0, size),))
        object.__setattr__(self, "notes", dict(self.notes))

    def __eq__(self, other: object) -> bool:
        """Tell if two runs have the same values: one that was saved and loaded equals itself."""
        if self is other or not isinstance(other, Run) or hash(self) != hash(other):
            return self is other
        return all(_equal(getattr(self, name), getattr(other, name)) for name in self.__dataclass_fields__)

    def __hash__(self) -> int:
        return hash((self.id, self.rig, self.time.size))

    @property
    def headline(self) -> str:
        """Id, rig, length, current and split."""
        low, high = float(np.min(self.current)), float(np.max(self.current))
        current = span(low, high, "A") if self.current_changes else f"{number(self.mean_current, 3)} A"
        seconds = self.time[-1] - self.time[0]
        rig = f" of rig {self.rig}" if self.rig else ""
        return f"run {self.id}{rig}: {counted(self.time.size, 'sample')}, {number(seconds)} s, {current}, {self.split}"

    @property
    def table(self) -> Mapping[str, Floats]:
        """One row per sample, SI."""
        channels = {"time_s": self.time, "displacement_m": self.displacement, "force_N": self.force}
        velocity = {} if self.velocity is None else {"velocity_m_s": self.velocity}
        return {**channels, **velocity, "current_A": self.current}

    @property
    def current_A(self) -> float:
        """The run's one coil current [A]: the mean over the steady window.

        Raises `RunError` (E_CURRENT_VARIES) if the current changes within the run.
        """
        current, change = _held_current(self)
        if change:
            raise RunError(
                change,
                where=self._where,
                remedy="use a global model, which takes a current channel",
                code="E_CURRENT_VARIES",
            )
        return current

    @property
    def mean_current(self) -> float:
        """Mean current over the steady window [A], also of a current that changes."""
        return _held_current(self)[0]

    @property
    def current_changes(self) -> bool:
        """True if the current changes within the run, by more than noise, ripple and drift."""
        return bool(_held_current(self)[1])

    @property
    def coil_current(self) -> Floats:
        """(N,) magnitude of the current [A] for models: without noise where it is constant.

        The direction of the current in the coil does not change the force.
        """
        if self.current_changes:
            return np.abs(self.current)
        return np.broadcast_to(np.float64(abs(self.mean_current)), self.time.shape)

    @property
    def findings(self) -> tuple[str, ...]:
        """Codes of the findings of the import, for example W_CLIPPED."""
        return tuple(self.notes.get("findings", "").split())

    @cached_property
    def in_window(self) -> NDArray[np.bool_]:
        """(N,) mask of the samples inside the steady window."""
        if self.window is None:
            return np.ones(self.time.size, dtype=bool)
        inside = np.zeros(self.time.size, dtype=bool)
        inside[np.searchsorted(self.time, self.window[0]) : np.searchsorted(self.time, self.window[1], "right")] = True
        return inside

    def steady(self) -> Run:
        """Return the part of the run inside its steady window."""
        inside = np.flatnonzero(self.in_window)
        if inside.size < 3:
            raise RunError(
                f"the steady window {self.window} s holds {counted(inside.size, 'sample')}",
                where=self._where,
                remedy="correct steady_t0_s and steady_t1_s",
            )
        return self.part(int(inside[0]), int(inside[-1]) + 1)

    @validate_arguments()
    def part(self, start: int, stop: int) -> Run:
        """Return the samples start..stop-1 as a run of their own; the run itself where these are all."""
        if start == 0 and stop == self.time.size:
            return self
        time = self.time[start:stop]
        if time.size < 3:
            raise RunError(counted(time.size, "sample"), where=self._where, remedy="a run needs at least 3")
        inner = [(max(a, start) - start, min(b, stop) - start) for a, b in self.segments]
        part: Run = object.__new__(type(self))  # samples that were checked with the whole run
        values = {name: getattr(self, name) for name in self.__dataclass_fields__} | dict(
            time=time,
            displacement=self.displacement[start:stop],
            force=self.force[start:stop],
            current=self.current[start:stop],
            velocity=None if self.velocity is None else self.velocity[start:stop],
            further={name: values[start:stop] for name, values in self.further.items()},
            segments=tuple((a, b) for a, b in inner if b > a) or ((0, time.size),),
        )
        for name, value in values.items():
            object.__setattr__(part, name, value)
        return part

    def thinned(self, step: int, window: tuple[float, float]) -> Run:
        """Return every `step`-th sample as one segment without further channels, with another steady window [s]."""
        names = ("time", "displacement", "force", "current", *(("velocity",) if self.velocity is not None else ()))
        channels = {name: getattr(self, name)[::step] for name in names}
        return replace(self, **channels, further={}, segments=(), window=window)

    @property
    def _where(self) -> str:
        return f"run {self.id}"

    def _channel(self, name: str, values: ArrayLike, size: int | None = None) -> Floats:
        try:
            given = np.asarray(values)
            if given.dtype.kind not in "biuf":
                raise ValueError
            array = given.astype(np.float64, copy=False)
            if name == "current" and given.ndim == 0 and size is not None:
                array = np.full(size, array)
        except (TypeError, ValueError):
            raise RunError(f"{name} is no array of numbers", where=self._where, remedy="pass 1-D arrays") from None
        if array.ndim != 1:
            raise RunError(f"{name} has {array.ndim} dimensions", where=self._where, remedy="pass 1-D arrays")
        if size is not None and array.size != size:
            raise RunError(
                f"{name} has {counted(array.size, 'sample')}, time has {size}",
                where=self._where,
                remedy="trim or resample the run",
            )
        bad = [at + i for at, piece in chunks(array) for i in np.flatnonzero(~np.isfinite(piece))]
        if bad:
            raise NonFiniteError(
                f"{name} has {len(bad)} values that are not finite, the first at sample {bad[0]}",
                where=self._where,
                remedy="remove these samples",
            )
        if array.flags.writeable:  # else the same array: what is remembered of it holds
            array = array.view()
            array.flags.writeable = False
        return array


def _equal(one: Any, other: Any) -> bool:
    """Tell if two values of a field are equal; missing samples of a further channel are."""
    if is_a(one, np.ndarray) and is_a(other, np.ndarray):
        return np.array_equal(one, other, equal_nan=True)
    if is_a(one, dict):
        return one.keys() == other.keys() and all(_equal(one[name], other[name]) for name in one)
    return type(one) is type(other) and bool(one == other)


def require_name(what: str, name: object) -> None:
    """Refuse, by `RunError`, a name that is not printable text of one line, as a page, terminal or table needs it."""
    if not isinstance(name, str) or len(name) > _MAX_NAME_CHARACTERS or printable(name) != name:
        raise RunError(
            f"the {what} is {shown(name)}",
            remedy=f"name it in printable text on one line, at most {_MAX_NAME_CHARACTERS} characters",
        )


def once_per_run(function: Callable[[K], T]) -> Callable[[K], T]:
    """Cache the result of a function of a run, or of a view or study of runs, with its object.

    A study uses the motion of a run dozens of times; runs are frozen, so the result cannot change.
    """
    results: dict[int, tuple[ref[K], T]] = {}

    @wraps(function)
    def remembered(run: K) -> T:
        key = id(run)  # runs of equal values are not compared
        entry = results.get(key)
        if entry is None:
            entry = results[key] = ref(run, lambda _: results.pop(key, None)), function(run)
        return entry[1]

    return remembered


_MAX_CURRENT_SAMPLES = 2_000_000  # samples of a current that are checked
_BLOCKS = 64  # stretches of a record whose mean currents are compared
# A current may differ by so much from begin to end: [A], and of its mean.
_MAX_TREND_A, _MAX_RELATIVE_TREND = 0.01, 0.03
# RMS of its slow part: a rectifier's or a chopper's ripple, seen at a slow rate.
_MAX_WANDER_A, _MAX_RELATIVE_WANDER = 0.016, 0.01
_MAX_RMS_A, _MAX_RELATIVE_RMS = 0.03, 0.02  # RMS of all of it
_LEVEL_STEP = 5e-3  # step of currents in a test plan [A]
# Measured means may differ from a level by so much: [A], and of the mean.
_LEVEL_TOLERANCE_A, _LEVEL_TOLERANCE = 5e-4, 2e-3
_MAX_RESOLUTION_A = 0.1  # [A]: a channel of such resolution varies by half a step
_WHITE_NOISE_FACTOR = 4  # factor of the limit for uncorrelated samples, which no coil current has
_MAX_RELATIVE_RIPPLE = 0.6  # RMS of a chopper's ripple from sample to sample, of the mean, about which it averages
_VON_NEUMANN_RATIO = 1.0  # von Neumann's ratio: two for white noise, near zero for a current that keeps its levels


@once_per_run
def _held_current(run: Run) -> tuple[float, str]:
    first, last = run.window or (-math.inf, math.inf)
    start, stop = index_at(run.time, first), index_at(run.time, last, "right")
    start, stop = (start, stop) if stop - start >= 3 else (0, run.time.size)
    return held_current(take(run.current, np.arange(start, stop, 1 + (stop - start) // _MAX_CURRENT_SAMPLES)))


def as_written(current: float) -> float:
    """Round the mean of a noisy current channel as in a test plan [A].

    Values within 0.5 mA + 0.2 % of a multiple of 5 mA are that multiple: −0.0003 A is 0 A, 0.4997 A is 0.5 A.
    """
    level = _LEVEL_STEP * round(current / _LEVEL_STEP)
    near = abs(current - level) <= _LEVEL_TOLERANCE_A + _LEVEL_TOLERANCE * abs(current)
    return round(level if near else current, 4) + 0.0


def held_current(current: Floats) -> tuple[float, str]:
    """Mean of a current [A], and how it changes; empty if it is constant but for noise.

    A channel is a constant with noise if its trend and slow variation are within those of a supply. The slow variation
    is the variance of the means of blocks of the record, less that of white noise, so that white noise of any size has
    none.

    `current` (N,): at least three samples [A].
    """
    low, high = float(current.min()), float(current.max())
    if low == high:
        return (0.0 if abs(low) <= _LEVEL_TOLERANCE_A else round(low, 9)), ""
    mean, size = float(np.mean(current)), current.size
    count = min(_BLOCKS, max(3, size // 8))
    bounds = np.linspace(0, size, count, endpoint=False).astype(int)
    sizes = np.diff(np.append(bounds, size))
    levels = np.add.reduceat(current, bounds) / sizes
    within = float(np.sum((current - np.repeat(levels, sizes)) ** 2)) / max(1, size - count)
    wander = float(np.sqrt(max(0.0, np.var(levels, ddof=1) - within * count / size)))
    trend = abs(float(np.mean(current[: size // 3]) - np.mean(current[size - size // 3 :])))
    total = float(np.std(current))
    white = float(np.mean(np.diff(current) ** 2)) > _VON_NEUMANN_RATIO * total**2
    noise = (_MAX_RMS_A + _MAX_RELATIVE_RMS * abs(mean)) * (_WHITE_NOISE_FACTOR if white else 1)
    noise = max(noise, _MAX_RELATIVE_RIPPLE * abs(mean)) if white else noise
    allowed = noise + 0.5 * _resolution(current)
    steady = (
        trend <= _MAX_TREND_A + _MAX_RELATIVE_TREND * abs(mean) + 4 * float(np.sqrt(6 * within / size))
        and wander <= _MAX_WANDER_A + _MAX_RELATIVE_WANDER * abs(mean)
        and total <= allowed
    )
    if steady:
        return as_written(mean), ""
    return round(mean, 4) + 0.0, f"the current changes within the run, between {low:.4g} A and {high:.4g} A"


def _resolution(current: Floats) -> float:
    """Resolution of a coarse channel [A]; zero if it is fine, or coarser than any channel of currents."""
    levels = np.unique(current[:: max(1, current.size // 2000)])
    step = float(np.min(np.diff(levels))) if 1 < levels.size < 10 else 0.0
    return step if step <= _MAX_RESOLUTION_A * 1.001 else 0.0
