"""Points of the test matrix, and groups of equal ones, by current, frequency and amplitude."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, wraps
from itertools import pairwise
from numbers import Real
from typing import TypeVar

import numpy as np

from mrdamper.errors import ConditionError, shown

_MOST_CURRENT = 1e6  # largest current of a coil [A]
LONGEST = 2.0  # largest amplitude of a damper [m]; beyond, the unit is wrong
_SLOWEST, _FASTEST = 1e-100, 1e100  # [Hz]; beyond, times or accelerations of a cycle are not finite
_SAME = 0.03  # frequencies and amplitudes this close are one condition of the test matrix
_NO_NUMBERS = (type(None), str, bytes, complex, list, tuple, dict, set)


_Class = TypeVar("_Class", bound=type)


def _named_with_units(owner: _Class) -> _Class:
    """Refuse unknown and missing names and list those with a unit, because an amplitude may be in mm or m."""
    initialise = owner.__init__

    @wraps(initialise)
    def init(self: object, *given: object, **named: object) -> None:
        try:
            initialise(self, *given, **named)
        except TypeError as error:
            problem = str(error).removeprefix("Condition.__init__() ").partition(". Did you mean")[0]
            raise ConditionError(problem, remedy="write Condition(current_A=, frequency_Hz=, amplitude_m=)") from error

    owner.__init__ = init
    return owner


@_named_with_units
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

    Raises
    ------
    ConditionError
        If a value is not finite, the frequency or the amplitude negative, the amplitude over 2 m,
        the current over 1e6 A, or the frequency neither zero nor in 1e-100...1e100 Hz.

    Examples
    --------
    >>> from mrdamper import Condition
    >>> print(Condition(current_A=0.5, frequency_Hz=2.0, amplitude_m=0.01))
    0.5 A, 2 Hz, 10 mm
    >>> round(Condition(0.5, 2.0, 0.01).peak_velocity, 4)  # [m/s]
    0.1257
    """

    current_A: float
    frequency_Hz: float
    amplitude_m: float

    def __post_init__(self) -> None:
        current, frequency, amplitude = self.current_A, self.frequency_Hz, self.amplitude_m
        floats = type(current) is type(frequency) is type(amplitude) is float
        sized = floats and abs(current) <= _MOST_CURRENT and 0 <= amplitude <= LONGEST
        if sized and (not frequency or _SLOWEST <= frequency <= _FASTEST):
            return  # a study makes thousands of them
        # A traced model is evaluated at symbols, which have no size.
        given = (("current", self.current_A, -math.inf), ("frequency", self.frequency_Hz, 0.0))
        for name, value, least in (*given, ("amplitude", self.amplitude_m, 0.0)):
            no_number = isinstance(value, _NO_NUMBERS) or (isinstance(value, np.ndarray) and value.ndim > 0)
            if no_number or (isinstance(value, Real) and not (least < value < math.inf or value == 0.0)):
                raise ConditionError(f"{name} is {shown(value)}", remedy="give a number, zero or more")
        if isinstance(self.current_A, Real) and abs(self.current_A) > _MOST_CURRENT:
            raise ConditionError(f"current is {shown(self.current_A)} A", remedy="give amperes: 500 mA are 0.5")
        if isinstance(self.amplitude_m, Real) and self.amplitude_m > LONGEST:
            raise ConditionError(f"amplitude is {shown(self.amplitude_m)} m", remedy="give metres: 10 mm are 0.01")
        if isinstance(self.frequency_Hz, Real) and self.frequency_Hz and not _SLOWEST <= self.frequency_Hz <= _FASTEST:
            raise ConditionError(f"frequency is {shown(self.frequency_Hz)} Hz", remedy="give hertz; zero for none")

    @classmethod
    def of_text(cls, text: str) -> Condition:
        """Read "A,Hz,mm", as "0.5,1,20"; raises `ConditionError` if it is not three numbers of a condition."""
        try:
            current, frequency, amplitude = (float(part) for part in text.split(","))
        except ValueError as error:
            raise ConditionError(f"{text!r} is no condition", remedy="write A,Hz,mm: 0.5,1,20") from error
        return cls(current, frequency, 1e-3 * amplitude)

    @property
    def peak_velocity(self) -> float:
        """Largest velocity of a sine at this condition [m/s]."""
        return 2 * np.pi * self.frequency_Hz * self.amplitude_m

    def __str__(self) -> str:
        return f"{self.current_A + 0.0:g} A, {self.frequency_Hz:.3g} Hz, {1e3 * self.amplitude_m:.3g} mm"


def current_levels(currents: Sequence[float]) -> list[float]:
    """Assign each current to a level of the test matrix [A].

    Measured currents of one level differ by noise; those within 5 mA + 2 % of their neighbour are
    one level, named by its median to three digits.
    """
    return list(_levels(tuple(currents)))


@lru_cache(maxsize=256)
def _levels(currents: tuple[float, ...]) -> tuple[float, ...]:
    order = np.argsort(currents)
    values = np.asarray(currents, dtype=float)[order]
    begins = np.diff(values, prepend=-np.inf) > 5e-3 + 0.02 * np.abs(values)
    level = np.cumsum(begins) - 1
    ends = np.append(np.flatnonzero(begins), values.size)
    middle = [(values[(a + b - 1) // 2] + values[(a + b) // 2]) / 2 for a, b in pairwise(ends)]  # medians
    names = [float(f"{value:.3g}") for value in middle]
    levels = np.empty(values.size)
    levels[order] = np.array([0.0 if abs(name) < 5e-3 else name for name in names])[level]
    return tuple(levels.tolist())


def level_groups(currents: Sequence[float | None]) -> dict[float, list[int]]:
    """Group the indices of currents by level [A], rising, in either direction; None, a changing current, is of none."""
    constant = {i: abs(current) for i, current in enumerate(currents) if current is not None}
    groups: dict[float, list[int]] = {}
    for i, level in zip(constant, current_levels([*constant.values()]), strict=True):
        groups.setdefault(level, []).append(i)
    return dict(sorted(groups.items()))


def condition_groups(conditions: Sequence[Condition | None]) -> list[list[int]]:
    """Group the indices of runs by condition; each run of none, as a record that is no sine, is a group by itself."""
    rows = [i for i, condition in enumerate(conditions) if condition is not None]
    groups = same_condition([condition for condition in conditions if condition is not None])
    alone = [[i] for i, condition in enumerate(conditions) if condition is None]
    return [[rows[k] for k in group] for group in groups] + alone


def same_condition(conditions: Sequence[Condition]) -> list[list[int]]:
    """Group the indices of conditions that agree in current and, to 3 %, in frequency and amplitude."""
    return [list(group) for group in _grouped(tuple(conditions), _SAME, True)]


def same_motion(conditions: Sequence[Condition], tolerance: float = 0.05) -> list[list[int]]:
    """Group the indices of conditions whose frequency and amplitude agree to a tolerance, at any current."""
    return [list(group) for group in _grouped(tuple(conditions), tolerance, False)]


@lru_cache(maxsize=256)
def _grouped(conditions: tuple[Condition, ...], tolerance: float, by_current: bool) -> list[list[int]]:
    def agree(a: Condition, b: Condition) -> bool:
        if by_current and abs(a.current_A - b.current_A) > 1e-3 + tolerance * abs(b.current_A):
            return False
        ratios = a.frequency_Hz / b.frequency_Hz, a.amplitude_m / b.amplitude_m
        return all(abs(ratio - 1) <= tolerance for ratio in ratios)

    groups: list[list[int]] = []
    for index, condition in enumerate(conditions):
        for group in groups:
            if agree(condition, conditions[group[0]]):
                group.append(index)
                break
        else:
            groups.append([index])
    return groups
