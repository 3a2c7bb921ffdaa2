"""Elimination of linear parameters if all columns but one are constant in the search.

In the Bouc–Wen family and many other models the state is one column, and the others do not depend on the search
coordinates. They are factored once; a point of the search then costs its state and one projection. A model declares
this by `Model.state_column` and `Model.shape`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Self

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import ParameterInfo
from mrdamper.errors import ParameterError
from mrdamper.identification.columns import bounds_of, linear_table
from mrdamper.identification.problem import DELAY, Problem
from mrdamper.models import Model, Scale, SearchAxis
from mrdamper.physics.hysteresis.response import follow_one, follow_with_slope
from mrdamper.statistics.linear import FixedColumns

_MIN_UNEXPLAINED_SHARE = 1e-10  # share of a squared column below which the others explain all of it
_LENGTH, _ASYMMETRY, _SHARPNESS = "yield_displacement", "asymmetry", "n"  # search coordinates of a shape


@dataclass(frozen=True, eq=False)
class Elimination:
    """A problem whose state is one column: the constant part of the search."""

    problem: Problem
    kind: LinearStructure

    @classmethod
    def of(cls, problem: Problem, axes: Sequence[SearchAxis]) -> Self | None:
        """Return None where the model or the search is of another kind."""
        if any(axis.name == DELAY for axis in axes):
            return None
        kind = linear_structure(problem.model_type, problem.free, tuple(sorted(problem.fixed.items())))
        if kind is None or kind.coordinates != tuple(axis.name for axis in axes):
            return None
        return cls(problem, kind)

    @cached_property
    def fixed_columns(self) -> FixedColumns:
        """Constant columns, and measured force less the force without linear parameters [N], factored once."""
        motion = self.problem.seen
        base, columns = linear_table(self.kind.bare, self.kind.others, motion, np.zeros(len(motion)))
        right = self.problem.force - base
        del base  # kept for long records, too
        return FixedColumns.of(columns, right)

    @cached_property
    def _fixed(self) -> FixedColumns | None:
        """The constant columns; None where they depend on each other."""
        return self.fixed_columns if self.fixed_columns.independent else None

    @cached_property
    def _bounds(self) -> tuple[Floats, Floats]:
        return bounds_of(self.kind.others)

    def residual(self, point: Mapping[str, float]) -> Floats | None:
        """Residual at a point of the search; None where the general method is needed."""
        fixed = self._fixed
        if fixed is None or (fit := self._fit(fixed, self._state(point))) is None:
            return None
        size, beside, _ = fit
        return size * beside - fixed.rest

    def residual_and_slope(self, length: float) -> tuple[Floats, Floats] | None:
        """Residual at a yield displacement that is searched alone, and its derivative with ln length.

        [Golub and Pereyra 1973]
        """
        shape, fixed = self.kind.shape({_LENGTH: length}), self._fixed
        if fixed is None or shape is None:
            return None
        state, change = follow_with_slope(*shape, self.problem.motion.path, self.problem.scored)
        if (fit := self._fit(fixed, state)) is None:
            return None
        size, beside, _ = fit
        np.negative(change, out=change)  # all in place, because these may be long
        moved = fixed.basis @ (change @ fixed.basis)
        np.subtract(change, moved, out=moved)
        growth = (float(moved @ fixed.rest) - 2 * size * float(moved @ beside)) / float(beside @ beside)
        residual = size * beside
        residual -= fixed.rest
        moved *= size
        beside *= growth
        moved += beside
        return residual, moved

    def solved(self, point: Mapping[str, float]) -> Model | None:
        """Model at a point of the search; None where the general method is needed."""
        if self._fixed is None or (fit := self._fit(self._fixed, self._state(point))) is None:
            return None
        shape, (size, _, others) = self.kind.shape(point), fit
        values = dict(zip((i.name for i in self.kind.others), others.tolist(), strict=True))
        values[self.kind.state.name] = size * shape[0] if shape else size  # the state is zeta/kappa
        return self.problem.model_type.build({**self.problem.fixed, **point, **values})

    def _fit(self, fixed: FixedColumns, state: Floats) -> tuple[float, Floats, Floats] | None:
        """Best coefficient of a state, the part of it beside the constant columns, and their coefficients.

        None where a bound or dependence interferes.
        """
        along = state @ fixed.basis
        beside = fixed.basis @ along
        np.subtract(state, beside, out=beside)
        square = float(beside @ beside)
        if not square > _MIN_UNEXPLAINED_SHARE * float(state @ state):
            return None
        size = float(beside @ fixed.rest) / square
        others = fixed.inverse @ (fixed.along - size * along)
        (low, high), (lower, upper) = self.kind.state.bounds, self._bounds
        if not (low <= size <= high and ((others >= lower) & (others <= upper)).all()):
            return None
        return size, beside, others

    def _state(self, point: Mapping[str, float]) -> Floats:
        # Its size has no effect on the residual.
        shape = self.kind.shape(point)
        if shape is None:
            return self._bare(point).state(self.problem.motion)[self.problem.scored]
        return follow_one(*shape, self.problem.motion.path, self.problem.scored)

    def _bare(self, point: Mapping[str, float]) -> Model:
        zero = {i.name: 0.0 for i in (*self.kind.others, self.kind.state)}
        return self.problem.model_type.build({**self.problem.fixed, **point, **zero})


@dataclass(frozen=True)
class LinearStructure:
    """Structure of the search: the linear and the nonlinear parameters of a model."""

    coordinates: tuple[str, ...]  # names of the search coordinates
    state: ParameterInfo  # parameter whose column is the state
    others: tuple[ParameterInfo, ...]  # the other linear parameters
    bare: Model  # with all linear parameters at zero, at any point of the search: source of the columns of `others`
    # rho, n: of a Bouc–Wen shape of length 1/kappa, where they are not searched
    rho: float = 0.0
    n: float = 2.0
    # the state is zeta/kappa of such a shape, and the coordinates are its length, asymmetry and n
    has_shape: bool = False

    def shape(self, point: Mapping[str, float]) -> tuple[float, float, float] | None:
        """(kappa, rho, n) at a point of the search."""
        if not self.has_shape:
            return None
        return 1 / point[_LENGTH], point.get(_ASYMMETRY, self.rho), point.get(_SHARPNESS, self.n)


@lru_cache
def linear_structure(
    model_type: type[Model], free: tuple[str, ...], fixed: tuple[tuple[str, float], ...]
) -> LinearStructure | None:
    """Determine the structure from a model at two points of the search.

    `free`: parameters to be determined; `fixed`: parameters held at a value. Returns None if the state is no column, or
    the parameter of that column is held.
    """
    linear = tuple(i for i in model_type.parameters() if i.linear and i.name in free)
    axes = model_type.search_axes(_SCALE, free)
    state = next((i for i in linear if i.name == model_type.state_column), None)
    if state is None or not axes:
        return None
    first = {axis.name: axis.grid[0] for axis in axes}
    other = {
        a.name: a.grid[-1] if len(a.grid) > 1 else a.value(0.4 * (a.coordinate(a.lower) + a.coordinate(a.upper)))
        for a in axes
    }
    points = [{**dict(fixed), **point} for point in (first, other)]
    try:
        bare = [model_type.build({**point, **{i.name: 0.0 for i in linear}}) for point in points]
    except ParameterError:  # held parameters exclude one of the points
        return None
    structure = LinearStructure(
        tuple(axis.name for axis in axes), state, tuple(i for i in linear if i is not state), bare[0]
    )
    shape = bare[0].shape
    if shape is None or not {_LENGTH} <= set(structure.coordinates) <= {_LENGTH, _ASYMMETRY, _SHARPNESS}:
        return structure
    shaped = replace(structure, rho=float(shape.rho), n=float(shape.n), has_shape=True)
    # With a held gamma the asymmetry depends on the length.
    return shaped if all(_has_shape(shaped, *pair) for pair in zip(bare, points, strict=True)) else structure


def _has_shape(kind: LinearStructure, model: Model, point: Mapping[str, float]) -> bool:
    shape, expected = model.shape, kind.shape(point)
    if shape is None or expected is None:
        return False
    return np.allclose((float(shape.kappa), float(shape.rho), shape.n), expected, rtol=1e-9, atol=1e-12)


_SCALE = Scale(amplitude=0.02, speed=0.1)  # points of the search at which a model is evaluated
