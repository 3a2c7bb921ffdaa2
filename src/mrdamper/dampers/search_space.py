"""Search axes of a global fit, and the model at each of their points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mrdamper.dampers.coil import Coil
from mrdamper.data import Floats, level_groups
from mrdamper.data.parameters import ParameterInfo
from mrdamper.models import Model, SearchAxis
from mrdamper.models.base import box_of, values_at

RISE, FALL = "coil.rise_s", "coil.fall_s"  # names of the coil's lags on the search axes
_DIFFERENCE_RATIO = 1e-6  # of the box, over which parameters are differentiated by the search axes
_PASSED_LEVELS = 5  # number of levels of a changing current, which passes through all


@dataclass(frozen=True, eq=False)
class SearchSpace:
    """Coordinates of a global fit: search axes, linear parameters, and the model of each point."""

    model_type: type[Model]
    fixed: Mapping[str, float]  # parameters held at a value
    linear: Sequence[ParameterInfo]  # parameters that enter the force linearly, solved for at each point
    axes: Sequence[SearchAxis]  # length D, those of the coil's lags last, if they are searched
    coil: Coil | None  # known lags of the field

    def box(self) -> tuple[Floats, Floats]:
        """Lower and upper ends of the search axes."""
        return self._box

    @cached_property
    def _box(self) -> tuple[Floats, Floats]:
        return box_of(self.axes)

    def coil_at(self, point: Floats) -> Coil | None:
        """Return the coil at a point of the search axes."""
        if all(axis.name != RISE for axis in self.axes):
            return self.coil
        lags = values_at(self.axes, point)
        return Coil(lags[RISE], lags[FALL])

    def at_bounds(self, point: Floats) -> list[str]:
        """Return the names of parameters whose search axis ended at a limit."""
        own = {info.name for info in self.model_type.parameters()}
        names: list[str] = []
        middle = np.mean(self.box(), axis=0)
        for i, axis in enumerate(self.axes):
            if not axis.at_bound(float(point[i])):
                continue
            inward = np.where(np.arange(point.size) == i, middle, point)
            here, there = self.without_linear(point).values(), self.without_linear(inward).values()
            stands_for = [n for n in here if here[n] != there[n]]
            names += [axis.name] if axis.name in own or not stands_for else stands_for
        return names

    def inside(self, point: Floats) -> Model:
        """Return the model at a point of the search axes or, of one at a bound, just inside it."""
        lower, upper = self.box()
        reach = _DIFFERENCE_RATIO * (upper - lower)
        return self.without_linear(np.clip(point, lower + reach, upper - reach))

    def along_axes(self, point: Floats, names: Sequence[str]) -> Floats:
        """(D, K) derivatives of parameters of some names by the search axes."""
        moved = np.zeros((point.size, len(names)))
        for i, axis in enumerate(self.axes):
            if i in self._entangled_axes:
                moved[i] = self._moved_along(i, point, names)
            else:
                moved[i, names.index(axis.name)] = axis.value(float(point[i])) if axis.log else 1.0
        return moved

    @cached_property
    def _entangled_axes(self) -> frozenset[int]:
        """Axes that change further parameters than that of their name."""
        names = [info.name for info in self.model_type.parameters()]
        middle = np.mean(self.box(), axis=0)
        moved = np.array([self._moved_along(i, middle, names) != 0 for i in range(len(self.axes))])
        own = np.array([[name == axis.name for name in names] for axis in self.axes])
        return frozenset(np.flatnonzero((moved != own).any(axis=1)).tolist())

    def _moved_along(self, i: int, point: Floats, names: Sequence[str]) -> Floats:
        """(K,) derivatives of parameters by an axis."""
        lower, upper = self.box()
        step = np.where(np.arange(point.size) == i, _DIFFERENCE_RATIO * (upper - lower), 0.0)
        ends = np.clip(point - step, lower, upper), np.clip(point + step, lower, upper)
        models = [self.without_linear(end) for end in ends]
        low, high = (np.array([getattr(model, name) for name in names]) for model in models)
        return (high - low) / (ends[1][i] - ends[0][i])

    def without_linear(self, point: Floats) -> Model:
        """Return the model at a point of the search axes, its linear parameters zero."""
        values = values_at(self._own_axes, point[: len(self._own_axes)])
        return self.model_type.build({**self._held, **values})

    @cached_property
    def _own_axes(self) -> list[SearchAxis]:
        return [axis for axis in self.axes if axis.name not in (RISE, FALL)]

    @cached_property
    def _held(self) -> dict[str, float]:
        return {**self.fixed, **{info.name: 0.0 for info in self.linear}}

    def with_linear_of(self, model: Model, point: Floats) -> Model:
        """Return the model at a point of the search axes with the linear parameters of another."""
        return replace(self.without_linear(point), **{info.name: getattr(model, info.name) for info in self.linear})


def level_count(currents: Sequence[float | None]) -> int:
    """Count the levels of the current in the runs of a rig; None is a current that changes."""
    return _PASSED_LEVELS if None in currents else len(level_groups(currents))


def undetermined(model: type[Model], currents: Sequence[float | None]) -> tuple[str, ...]:
    """Return the parameters of effects of the current that runs of too few levels do not determine."""
    levels = level_count(currents)
    return tuple(name for name, needed in model.current_levels.items() if levels < needed)
