"""Elimination of linear parameters where all columns but one stay what they are in the search.

In the Bouc–Wen family and many other models the state fills one column, and no search
coordinate touches the others. They are factored once; a point of the search then costs its
state and one projection. Whether a model is of this kind is found by trying, not declared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from mrdamper.data import Floats
from mrdamper.errors import ParameterError
from mrdamper.hysteresis.batch import follow_quickly, follow_with_slope
from mrdamper.identification.columns import bounds_of, linear_table
from mrdamper.identification.problem import DELAY, Problem
from mrdamper.models import Model, SearchAxis
from mrdamper.motion import Excitation
from mrdamper.parameters import ParameterInfo

if TYPE_CHECKING:
    from mrdamper.hysteresis.compiled import Strokes

_DEPENDENT = 1e-10  # share of a squared column below which the others explain all of it
_LENGTH, _ASYMMETRY, _SHARPNESS = "yield_displacement", "asymmetry", "n"  # search coordinates of a shape


@dataclass(frozen=True, eq=False)
class Elimination:
    """A problem whose state fills one column: what stays the same however the search moves.

    Attributes
    ----------
    problem : Problem
    columns : (N, L) array
        Columns that stay, at the scored samples.
    right : (N,) array
        Measured force less the force without linear parameters [N].
    kind : Kind
    compiled : bool
        Follow the states of a shape in machine code.
    """

    problem: Problem
    columns: Floats
    right: Floats
    kind: Kind
    compiled: bool = False

    @classmethod
    def of(cls, problem: Problem, axes: Sequence[SearchAxis], *, compiled: bool = False) -> Self | None:
        """Evaluate the columns that stay; None where the model or the search is of another kind."""
        if any(axis.name == DELAY for axis in axes):
            return None
        kind = kind_of(problem.model_type, problem.free, tuple(sorted(problem.fixed.items())))
        if kind is None or kind.coordinates != tuple(axis.name for axis in axes):
            return None
        base, columns = linear_table(kind.bare, kind.others, problem.seen, np.zeros(len(problem.seen)))
        return cls(problem, columns, problem.force - base, kind, compiled)

    @cached_property
    def projector(self) -> Projector | None:
        """The columns factored; None where they depend on each other."""
        return Projector.of(self.columns, self.right, self.kind.others, self.kind.state)

    def residual(self, point: Mapping[str, float]) -> Floats | None:
        """Residual at a point of the search; None where it takes the general way."""
        return None if self.projector is None else self.projector.residual(self._state(point))

    def residual_and_slope(self, length: float) -> tuple[Floats, Floats] | None:
        """Residual at a yield displacement that is searched alone, and its derivative with ln length."""
        shape = self.kind.shape({_LENGTH: length})
        if self.projector is None or shape is None:
            return None
        state, by_kappa = follow_with_slope(*shape, self.problem.motion.path, self.problem.scored)
        return self.projector.residual_and_slope(state, -by_kappa)

    def solved(self, point: Mapping[str, float]) -> Model | None:
        """Model at a point of the search; None where it takes the general way."""
        found = self.projector.solve(self._state(point)) if self.projector else None
        if found is None:
            return None
        shape, (size, others) = self.kind.shape(point), found
        values = dict(zip((i.name for i in self.kind.others), others, strict=True))
        values[self.kind.state.name] = size * shape[0] if shape else size  # the state is zeta/kappa
        return self.problem.model_type.build({**self.problem.fixed, **point, **values})

    def _state(self, point: Mapping[str, float]) -> Floats:
        # Its size does not matter to the residual.
        shape = self.kind.shape(point)
        if shape is None:
            return self._bare(point).state(self.problem.motion)[self.problem.scored]
        if self.compiled:
            from mrdamper.hysteresis.compiled import follow_strokes

            return follow_strokes(*shape, self._strokes)[self.problem.scored]
        return follow_quickly(*shape, self.problem.motion.path, self.problem.scored)

    @cached_property
    def _strokes(self) -> Strokes:
        from mrdamper.hysteresis.compiled import Strokes

        return Strokes.of(self.problem.motion.path)

    def _bare(self, point: Mapping[str, float]) -> Model:
        zero = {i.name: 0.0 for i in (*self.kind.others, self.kind.state)}
        return self.problem.model_type.build({**self.problem.fixed, **point, **zero})


@dataclass(frozen=True)
class Kind:
    """What trying a model showed.

    Attributes
    ----------
    coordinates : tuple of str
        Names of the search coordinates.
    state : ParameterInfo
        Parameter whose column the state is.
    others : tuple of ParameterInfo
        The other linear parameters.
    bare : Model
        With all linear parameters at zero, anywhere on the search: the columns of `others` are its.
    rho, n : float
        Of a Bouc–Wen shape of length 1/kappa, where they are not searched.
    has_shape : bool
        The state is zeta/kappa of such a shape, and the coordinates are its length, asymmetry and n.
    """

    coordinates: tuple[str, ...]
    state: ParameterInfo
    others: tuple[ParameterInfo, ...]
    bare: Model
    rho: float = 0.0
    n: float = 2.0
    has_shape: bool = False

    def shape(self, point: Mapping[str, float]) -> tuple[float, float, float] | None:
        """(kappa, rho, n) at a point of the search."""
        if not self.has_shape:
            return None
        return 1 / point[_LENGTH], point.get(_ASYMMETRY, self.rho), point.get(_SHARPNESS, self.n)


@lru_cache
def kind_of(model_type: type[Model], free: tuple[str, ...], fixed: tuple[tuple[str, float], ...]) -> Kind | None:
    """Try a model on a few samples, with two states at two places of the search.

    Parameters
    ----------
    model_type : type of Model
    free : tuple of str
        Parameters to be determined.
    fixed : tuple of (str, float)
        Parameters held at a value.

    Returns
    -------
    Kind or None
        None where the state fills no column of its own, or others change with it.
    """
    linear = tuple(i for i in model_type.parameters() if i.linear and i.name in free)
    axes = model_type.search_axes(_AMPLITUDE, free)
    if model_type.integrated or not linear or not axes:
        return None
    points = [{**dict(fixed), **{axis.name: at(axis) for axis in axes}} for at in (_first, _other)]
    try:
        bare = [model_type.build({**point, **{i.name: 0.0 for i in linear}}) for point in points]
    except ParameterError:  # what is held leaves no room at one of the places
        return None
    if any(model.state(_MOTION).shape != (len(_MOTION),) for model in bare):
        return None
    tables = [(*linear_table(model, linear, _MOTION, state), state) for model in bare for state in _STATES]
    base, columns, _ = tables[0]
    moving = [j for j in range(len(linear)) if not all(_same(t[1][:, j], columns[:, j]) for t in tables)]
    if len(moving) != 1 or not all(_same(b, base) and _same(c[:, moving[0]], z) for b, c, z in tables):
        return None
    state = linear[moving[0]]
    found = Kind(tuple(axis.name for axis in axes), state, tuple(i for i in linear if i is not state), bare[0])
    shape = getattr(bare[0], "shape", None)
    if shape is None or not {_LENGTH} <= set(found.coordinates) <= {_LENGTH, _ASYMMETRY, _SHARPNESS}:
        return found
    shaped = replace(found, rho=float(shape.rho), n=float(shape.n), has_shape=True)
    return shaped if all(_has_shape(shaped, *pair) for pair in zip(bare, points, strict=True)) else found


def _has_shape(kind: Kind, model: Model, point: Mapping[str, float]) -> bool:
    kappa, rho, n = kind.shape(point) or (0.0, 0.0, 0.0)
    shape = model.shape  # type: ignore[attr-defined]
    return np.allclose((shape.kappa, shape.rho, shape.n), (kappa, rho, n), rtol=1e-9, atol=1e-12) and _same(
        model.state(_MOTION), follow_quickly(kappa, rho, n, _MOTION.path) / kappa
    )


_AMPLITUDE = 0.02  # of the search a model is tried on [m]
_STATES = np.array([[0.31, -0.57, 0.93, -0.12, 0.71], [-0.83, 0.44, 0.27, 0.65, -0.38]])
_MOTION = Excitation(np.arange(5.0), 1e-2 * _STATES[0], 0.1 * _STATES[1], _STATES[0] - _STATES[1], np.abs(_STATES[0]))


def _same(a: Floats, b: Floats) -> bool:
    return bool(np.allclose(a, b, rtol=1e-9, atol=0))


def _first(axis: SearchAxis) -> float:
    return axis.grid[0]


def _other(axis: SearchAxis) -> float:
    return (
        axis.grid[-1] if len(axis.grid) > 1 else axis.value(0.4 * sum(map(axis.coordinate, (axis.lower, axis.upper))))
    )


@dataclass(frozen=True, eq=False)
class Projector:
    """Least squares on columns that stay and one that moves: the ones that stay are solved once.

    Attributes
    ----------
    basis : (N, L) array
        Orthonormal, of the columns that stay.
    inverse : (L, L) array
        coefficients = inverse · (along − size · basisᵀ state).
    along : (L,) array
        basisᵀ · right.
    rest : (N,) array
        The right side less its projection.
    lower, upper : (L,) arrays
        Bounds of the coefficients.
    size_bounds : (float, float)
        Bounds of the coefficient of the state.
    """

    basis: Floats
    inverse: Floats
    along: Floats
    rest: Floats
    lower: Floats
    upper: Floats
    size_bounds: tuple[float, float]

    @classmethod
    def of(cls, columns: Floats, right: Floats, still: Sequence[ParameterInfo], moving: ParameterInfo) -> Self | None:
        """Factor the columns that stay; None where they depend on each other."""
        scale = np.sqrt(np.mean(columns**2, axis=0))
        if not np.all(scale > 0):
            return None
        basis, triangle = np.linalg.qr(columns / scale)
        pivots = np.abs(np.diag(triangle))
        if not pivots.min(initial=1.0) > 1e-5 * pivots.max(initial=1.0):
            return None
        inverse = np.linalg.inv(triangle) / scale[:, None]
        along = basis.T @ right
        return cls(basis, inverse, along, right - basis @ along, *bounds_of(still), moving.bounds)

    def residual(self, state: Floats) -> Floats | None:
        """Fitted minus right side for the best coefficients; None where a bound or dependence interferes."""
        found = self._fit(state)
        return None if found is None else found[0] * found[1] - self.rest

    def residual_and_slope(self, state: Floats, change: Floats) -> tuple[Floats, Floats] | None:
        """`residual`, and its derivative where the state changes at a rate [Golub and Pereyra 1973]."""
        found = self._fit(state)
        if found is None:
            return None
        size, beside, _ = found
        moved = change - self.basis @ (change @ self.basis)
        growth = (float(moved @ self.rest) - 2 * size * float(moved @ beside)) / float(beside @ beside)
        return size * beside - self.rest, size * moved + growth * beside

    def solve(self, state: Floats) -> tuple[float, list[float]] | None:
        """Best coefficients of the state and of the columns; None as `residual`."""
        found = self._fit(state)
        return None if found is None else (found[0], found[2].tolist())

    def _fit(self, state: Floats) -> tuple[float, Floats, Floats] | None:
        along = state @ self.basis
        beside = state - self.basis @ along
        square = float(beside @ beside)
        if not square > _DEPENDENT * float(state @ state):
            return None
        size = float(beside @ self.rest) / square
        others = self.inverse @ (self.along - size * along)
        low, high = self.size_bounds
        limited = self._limited
        found = others[limited]
        if not (low <= size <= high and ((found >= self.lower[limited]) & (found <= self.upper[limited])).all()):
            return None
        return size, beside, others

    @cached_property
    def _limited(self) -> NDArray[np.intp]:
        return np.flatnonzero(np.isfinite(self.lower) | np.isfinite(self.upper))
