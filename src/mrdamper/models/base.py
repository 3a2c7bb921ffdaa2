"""Base class of damper models: frozen parameters, and the force along a motion.

A model is one file with one class. Its fields are its parameters (`param()` states unit, bounds and meaning); `force`
is pure arithmetic on them. A model with memory also computes its internal state along a motion (`state`) from its
nonlinear parameters only: given the state, the force is linear in the parameters marked linear, and identification
solves for these instead of searching.
"""

from __future__ import annotations

import math
import sys
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from typing import Any, ClassVar, Self

import numpy as np

from mrdamper.data.arrays import Floats
from mrdamper.data.parameters import ParameterInfo, is_number, parameters_of
from mrdamper.errors import ParameterError, shown
from mrdamper.physics.hysteresis.shape import Shape
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.tracing.expression import plain

GENERAL_FORMS = (
    "constant",
    "linear-current",
    "quadratic-current",
    "linear-current-speed",
    "quadratic-current-linear-speed",
    "quadratic-current-speed",
    "plane",
)
_SMALLEST, _LARGEST = 1e-4, 2.0  # of a searched length or velocity, over that of the motion
_STARTS = 100  # of a search over all parameters
YIELD_DISPLACEMENTS = np.geomspace(1e-4, 2.0, 14)  # over the amplitude: where the search of one starts


@dataclass(frozen=True, slots=True)
class SearchAxis:
    """Coordinate of a nonlinear search."""

    name: str  # name in results
    # lower, upper: limits in search units (the logarithm's argument for a log scale)
    lower: float
    upper: float
    grid: tuple[float, ...]  # start points, in the same units
    log: bool = False  # the search moves in the logarithm

    def coordinate(self, value: float) -> float:
        """Return the position of a value on the axis."""
        return math.log(value) if self.log else value

    def value(self, coordinate: float) -> float:
        """Return the value at a position on the axis."""
        if not self.log:
            return coordinate
        value = math.exp(coordinate)
        for end in (self.lower, self.upper):  # where a parameter may end, and rounding must not move it beyond
            if math.isclose(value, end, rel_tol=1e-12):
                return end
        return value

    def below(self, limit: float) -> SearchAxis:
        """Return the part of a logarithmic axis below a value."""
        if limit >= self.upper:
            return self
        lower = min(self.lower, 1e-3 * limit)
        grid = tuple(value for value in self.grid if lower < value < limit) or (math.sqrt(lower * limit),)
        return replace(self, lower=lower, upper=limit, grid=grid)

    def at_bound(self, coordinate: float) -> bool:
        """Tell if a position lies within a thousandth of the axis from one of its ends."""
        low, high = self.coordinate(self.lower), self.coordinate(self.upper)
        return min(coordinate - low, high - coordinate) < 1e-3 * (high - low)


def box_of(axes: Sequence[SearchAxis]) -> tuple[Floats, Floats]:
    """Lower and upper ends of search axes."""
    lower, upper = ([axis.coordinate(getattr(axis, end)) for axis in axes] for end in ("lower", "upper"))
    return np.array(lower), np.array(upper)


def grid_of(axes: Sequence[SearchAxis]) -> list[Floats]:
    """Every combination of the start points of search axes."""
    return [np.array(u) for u in product(*([axis.coordinate(g) for g in axis.grid] for axis in axes))]


def values_at(axes: Sequence[SearchAxis], point: Floats) -> dict[str, float]:
    """Values at a point of search axes, by name."""
    return {axis.name: axis.value(float(u)) for axis, u in zip(axes, point, strict=True)}


def names_at_bounds(axes: Sequence[SearchAxis], point: Floats) -> tuple[str, ...]:
    """Names of the search axes at whose ends a point lies."""
    return tuple(axis.name for axis, u in zip(axes, point, strict=True) if axis.at_bound(float(u)))


def axes_of(free: Sequence[str], *axes: SearchAxis) -> tuple[SearchAxis, ...]:
    """Return the axes of the parameters that are free."""
    return tuple(axis for axis in axes if axis.name in free)


@dataclass(frozen=True, slots=True)
class Scale:
    """Sizes of the data for a search."""

    amplitude: float  # displacement amplitude [m]
    speed: float  # peak velocity [m/s]
    force: float = 1.0  # largest force in either direction from the middle [N]
    current: float = 0.0  # largest current [A]; 0 without current

    @classmethod
    def of(cls, motion: Excitation, force: Floats, amplitude: float) -> Self:
        """Take the sizes from a motion and the force measured along it."""
        speed, current = (float(np.max(np.abs(channel))) for channel in (motion.velocity, motion.current))
        return cls(amplitude, speed, float(np.ptp(force)) / 2, current)


@dataclass(frozen=True)
class Model(ABC):
    """A damper model. Subclasses are final: vary one with `dataclasses.replace`."""

    name: ClassVar[str]
    title: ClassVar[str]
    equation: ClassVar[str] = ""  # LaTeX
    source: ClassVar[str] = ""  # publication
    coordinates: ClassVar[Mapping[str, tuple[str, str, str]]] = {}  # coordinates of `build`: symbol, relation, unit
    integrated: ClassVar[bool] = False  # the state is integrated, which takes a hundred times longer
    # Linear parameter whose column is the state, if the search changes no other column; None: no such parameter.
    state_column: ClassVar[str | None] = None
    # Levels of the current that determine each parameter of its effects; a model with such parameters describes a whole
    # damper by one set of them.
    current_levels: ClassVar[Mapping[str, int]] = {}

    def __post_init__(self) -> None:
        for name, low, high in _finite_bounds(type(self)):
            value = getattr(self, name)
            if type(value) is not float or not low <= value <= high:
                break
        else:
            return  # searches create thousands of models
        for info in self.parameters():
            value = getattr(self, info.name)
            low, high = info.bounds
            no_float = isinstance(value, int) and value.bit_length() > 1023
            if no_float or not is_number(value):
                raise ParameterError(f"{info.name} = {shown(value)}", where=self.title, remedy="give a number")
            if not (low <= value <= high and -math.inf < value < math.inf):
                raise ParameterError(
                    f"{info.name} = {value:g} {info.unit}",
                    where=self.title,
                    remedy=f"{info.meaning} lies between {low:g} and {high:g} {info.unit}",
                )

    @abstractmethod
    def force(self, motion: Excitation, state: Floats) -> Floats:
        """Force [N] at the samples of a motion, given the internal state there."""

    def state(self, motion: Excitation) -> Floats:
        """Calculate the internal state (N,) along a motion; models without memory have none."""
        return np.zeros(len(motion))

    @property
    def shape(self) -> Shape | None:
        """Bouc–Wen shape whose zeta/kappa is the state; None: another memory, or none.

        A model with a shape is also built from `yield_force` [N], the factor of zeta, in place of the parameter of its
        state column.
        """
        return None

    @property
    def yield_length(self) -> float | None:
        """Displacement after a reversal in which the force changes its sign [m]; None without such a length."""
        return None

    @classmethod
    def parameters(cls) -> tuple[ParameterInfo, ...]:
        """Describe each parameter, in order."""
        return parameters_of(cls)

    @classmethod
    def search_axes(cls, scale: Scale, free: Sequence[str]) -> tuple[SearchAxis, ...]:
        """Search coordinates of the `free` nonlinear parameters, their boxes and starts by the sizes of the data.

        Unless a model states others: between finite bounds, and lengths and velocities between a ten-thousandth and
        twice the size of the motion. Raises `ParameterError` if a parameter has neither.
        """
        infos = [info for info in cls.parameters() if info.name in free and not info.linear]
        return tuple(_axis(info, scale, _STARTS ** (1 / len(infos))) for info in infos)

    @classmethod
    def within(cls, axes: tuple[SearchAxis, ...], fixed: Mapping[str, float]) -> tuple[SearchAxis, ...]:
        """Limit search coordinates so that the other parameters are inside their bounds, given the held ones.

        Raises `IdentificationError` if that cannot be decided beforehand.
        """
        return axes

    @classmethod
    def build(cls, values: Mapping[str, float]) -> Self:
        """Make the model from its parameters or from its search coordinates."""
        return cls(**cls.resolved(values))

    @classmethod
    def resolved(cls, values: Mapping[str, float]) -> dict[str, float]:
        """Parameters from parameters and coordinates, without checks."""
        return dict(values)

    @classmethod
    def nearest(cls, values: Mapping[str, float]) -> Self:
        """Make the model as `build` does, with every parameter limited to its bounds."""
        bounds = {info.name: info.bounds for info in cls.parameters()}
        inside = {name: _limited(value, *bounds[name]) for name, value in values.items() if name in bounds}
        model = cls.resolved({**values, **inside})
        return cls(**{n: _limited(value, *bounds[n]) if n in bounds else value for n, value in model.items()})

    @classmethod
    def map_forms(cls) -> Mapping[str, tuple[str, ...]]:
        """Candidate parameter functions by parameter or coordinate, for the modified model."""
        return {info.name: GENERAL_FORMS for info in cls.parameters() if not info.preset}

    @classmethod
    def log_coordinates(cls) -> frozenset[str]:
        """Coordinates whose logarithm is mapped."""
        return frozenset(info.name for info in cls.parameters() if info.scale == "log")

    def values(self) -> dict[str, float]:
        """Parameter values by name."""
        return {info.name: getattr(self, info.name) for info in self.parameters()}


@cache
def _finite_bounds(kind: type[Model]) -> tuple[tuple[str, float, float], ...]:
    """Names of the parameters and their bounds, infinite ones as the largest finite numbers."""
    most = sys.float_info.max
    return tuple((info.name, max(info.bounds[0], -most), min(info.bounds[1], most)) for info in kind.parameters())


def _axis(info: ParameterInfo, scale: Scale, starts: float) -> SearchAxis:
    """Return the search coordinate of a parameter by its bounds and unit, with about so many start points."""
    low, high = info.bounds
    if (size := {"m": scale.amplitude, "m/s": scale.speed}.get(info.unit)) is not None:
        low, high = max(low, _SMALLEST * size), min(high, _LARGEST * size)
    if not -math.inf < low < high < math.inf:
        remedy = "mark it linear=True, give it finite bounds, or define search_axes"
        raise ParameterError(f"{info.name} has no limits for a search", where=info.meaning, remedy=remedy)
    log = low > 0 and (info.scale == "log" or size is not None)
    grid = (np.geomspace if log else np.linspace)(low, high, max(3, round(starts)) + 2)[1:-1]
    return SearchAxis(info.name, low, high, tuple(grid.tolist()), log)


def _limited(value: Any, low: float, high: float) -> Any:
    return min(max(float(value), low), high) if isinstance(value, float) else plain(np.clip(value, low, high))
