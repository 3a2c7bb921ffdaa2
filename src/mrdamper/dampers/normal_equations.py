"""Global fit of parameter functions, for models whose loop has one shape coordinate.

Given the shape coordinate (the yield displacement), a run's squared error is a quadratic form in the linear parameters.
Each run is therefore reduced once to small Gram matrices on a grid of shape values; fits to all runs, other parameter
functions and leave-one-condition-out then take milliseconds, because no sample is evaluated again.

Runs count by their own force scale, and the sum of run RMSEs is minimised, not of squares:
a run from a drifting session then has less weight (iteratively reweighted least squares).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, TypeAlias

import numpy as np

from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import IdentificationError
from mrdamper.identification import Problem
from mrdamper.models import Model, Scale
from mrdamper.physics.hysteresis import Shape
from mrdamper.physics.hysteresis.batch import follow_alike
from mrdamper.statistics.functions.fitting import fit_function, require_determined
from mrdamper.statistics.functions.forms import FORMS, Form, ParameterFunction, features
from mrdamper.statistics.functions.selection import broken_law, fold_groups, rises, smaller_wins, supported
from mrdamper.statistics.levenberg_marquardt import least_squares, newton_refine
from mrdamper.statistics.linear import (
    on_one_blas_thread,
    project_out_columns,
    robust_weights,
    solve_linear,
    solve_weighted,
)

_GRID_RATIO = 1500 ** (1 / 40)  # from one yield displacement to the next; between them Gram matrices are interpolated
_GRID_ORIGIN_M = 2e-6  # m, a grid point for any data
# yield displacement looked for, in the smallest amplitude; the longest is the largest amplitude
_MIN_LENGTH_RATIO = 5e-4
_MAX_STATES = 2**17  # states held at a time
_SEARCH_TOLERANCE = 1e-6  # relative gain of a step at which a search ends
_WEIGHT_TOLERANCE = 1e-3  # change of the robust weights below which the rounds end
_SEARCH_RANGE = 6.0  # of a search, in units of a function's terms
_MIN_ERROR_PP = 1e-4  # nrmse_pp below which a run gains no more weight
_PASSES = 2  # over all coordinates in the choice of forms
_RANK_LIMIT = 1e-10  # singular value over the largest below which a coefficient is not determined
_RIDGE = 1e-7  # interpolated Gram matrices of nearly parallel columns may lose positivity by less

# Six times the weights of the values at both ends of an interval and of the second derivatives there, for a cubic
# spline and its slope in the interval: a row for each power of the share of the interval
_SPLINE = np.array(
    [[6, 0, 0, 0, -6, 6, -2, -1], [-6, 6, -2, -1, 0, 0, 6, 0], [0, 0, 3, 0, 0, 0, -3, 3], [0, 0, -1, 1, 0, 0, 0, 0]]
)

_Trial: TypeAlias = "tuple[JointFunctionFit, dict[str, Floats]]"  # and its errors by kind of fold


@dataclass(frozen=True, eq=False)
class Condensed:
    """Runs of one rig, condensed for one model type."""

    model_type: type[Model]
    linear: tuple[str, ...]  # coordinates the force is linear in, in the order of the Gram matrices
    shape: str  # the one shape coordinate
    run_ids: tuple[str, ...]  # length R
    conditions: tuple[Condition, ...]  # length R
    scale: Floats  # (R,) peak-to-peak force [N]
    ladder: Floats  # (K,) values of the shape coordinate, evenly in the logarithm
    # (R, K, L+1, L+1) mean products of the columns and, last, the measured force over its peak-to-peak value, at each
    # value of the ladder
    gram: Floats
    # (R, K, L+1, L+1) their second derivatives along the ladder, counted in rungs, as a cubic spline has them
    bend: Floats
    # of the choice of forms, by these and where the shape starts
    trials: dict[tuple[Any, ...], _Trial] = field(default_factory=lambda: {}, init=False, repr=False)

    @cached_property
    def folds(self) -> dict[str, list[list[int]]]:
        """Runs that each fold omits in the choice of forms, by kind of fold."""
        return fold_groups(self.conditions)

    def only(self, rows: Sequence[int]) -> Condensed:
        """Return the same for some of the runs."""
        index = list(rows)
        return replace(
            self,
            run_ids=tuple(self.run_ids[i] for i in index),
            conditions=tuple(self.conditions[i] for i in index),
            scale=self.scale[index],
            gram=self.gram[index],
            bend=self.bend[index],
        )

    def at(self, shape_values: Floats) -> tuple[Floats, Floats]:
        """Gram matrices at one shape value a run, and their slopes by its logarithm, on the spline through the ladder.

        Both (R, L+1, L+1).
        """
        logs = np.log(self.ladder)
        u = np.minimum(np.maximum((np.log(shape_values) - logs[0]) / (logs[1] - logs[0]), 0), logs.size - 1)
        first = np.minimum(u.astype(int), logs.size - 2)
        weights = ((u - first)[:, None] ** np.arange(4) @ _SPLINE).reshape(-1, 2, 4) / 6
        both = (weights @ self._cells[np.arange(u.size), first]).reshape(u.size, 2, *self.gram.shape[2:])
        return both[:, 0], both[:, 1] / (logs[1] - logs[0])

    @cached_property
    def _cells(self) -> Floats:
        """(R, K-1, 4, (L+1)²) matrices and derivatives at both ends of every interval of the ladder."""
        both = (values.reshape(*values.shape[:2], -1) for values in (self.gram, self.bend))
        return np.stack([end for values in both for end in (values[:, :-1], values[:, 1:])], axis=2)


@on_one_blas_thread
def condense(runs: Sequence[Run], model_type: type[Model], more: Sequence[str] = ()) -> Condensed:
    """Condense runs for a model type whose search has one axis.

    `more` are preset linear parameters to determine as well: one run may not separate them, all together may. Raises
    `IdentificationError` if the model has no such single axis, or there are no runs.
    """
    if not runs:
        raise IdentificationError("no runs", remedy="give at least one")
    problems = [Problem.of(run, model_type) for run in runs]
    axes = model_type.search_axes(Scale(1.0, 1.0), problems[0].free)
    coordinates = tuple(model_type.map_forms())
    if len(axes) > 1 or not {axis.name for axis in axes} <= set(coordinates):
        raise IdentificationError(
            f"{model_type.title} is searched along {len(axes)} axes", remedy="fix all shape parameters but one"
        )
    shape = axes[0].name if axes else ""
    linear = (*(name for name in coordinates if name != shape), *more)
    conditions = tuple(problem.analysis.condition for problem in problems)
    ladder = _length_grid([c.amplitude_m for c in conditions]) if shape else np.geomspace(1.0, 8.0, 4)
    gram = np.stack([_gram(problem, linear, shape, ladder) for problem in problems])
    return Condensed(
        model_type,
        linear,
        shape,
        tuple(run.id for run in runs),
        conditions,
        np.array([np.ptp(problem.force) for problem in problems]),
        ladder,
        gram,
        _spline_curvature(gram),
    )


def _spline_curvature(gram: Floats) -> Floats:
    """Second derivatives of the cubic spline along the second axis that goes on unbroken over its outer knots."""
    size = gram.shape[1]
    second = np.eye(size, k=-1) - 2 * np.eye(size) + np.eye(size, k=1)
    system, right = second + 6 * np.eye(size), 6 * second
    system[0, :3] = system[-1, -3:] = (1, -2, 1)
    right[[0, -1]] = 0.0
    return np.einsum("jk,rk...->rj...", np.linalg.solve(system, right), gram)


def _length_grid(amplitudes: Sequence[float]) -> Floats:
    """Rungs [m] from far inside the smallest amplitude to the largest."""
    low, high = (
        float(np.log(v / _GRID_ORIGIN_M) / np.log(_GRID_RATIO))
        for v in (_MIN_LENGTH_RATIO * min(amplitudes), max(amplitudes))
    )
    return _GRID_ORIGIN_M * _GRID_RATIO ** np.arange(math.floor(low), math.ceil(high) + 1.0)


def _gram(problem: Problem, linear: tuple[str, ...], shape: str, ladder: Floats) -> Floats:
    target = problem.force / np.ptp(problem.force)
    if not shape:
        table, _ = _columns(problem, linear, {})
        table = np.column_stack([table, target])
        return np.stack([table.T @ table / target.size] * ladder.size)
    table, reduced = _columns(problem, linear, {shape: float(ladder[0])})
    if reduced.shape is not None and "yield_force" in linear:  # its column is zeta, the only one the ladder changes
        table = np.column_stack([table, target])
        return _gram_of_shapes(problem, table, linear.index("yield_force"), reduced.shape, ladder)
    tables = [np.column_stack([_columns(problem, linear, {shape: float(v)})[0], target]) for v in ladder]
    return np.stack([table.T @ table / target.size for table in tables])


def _columns(problem: Problem, linear: tuple[str, ...], shape: Mapping[str, float]) -> tuple[Floats, Model]:
    """(N, L) force per unit of every linear coordinate, and the model without them."""
    point = {**problem.fixed, **shape, **dict.fromkeys(linear, 0.0)}
    reduced = problem.model_type.build(point)
    state = reduced.state(problem.motion)[problem.scored]
    base = reduced.force(problem.seen, state)
    columns = [problem.model_type.build({**point, name: 1.0}).force(problem.seen, state) - base for name in linear]
    return np.column_stack(columns), reduced


def _gram_of_shapes(problem: Problem, table: Floats, moving: int, shape: Shape, ladder: Floats) -> Floats:
    """Return the same matrices, all shapes followed at once; only the rows of the moving column differ."""
    grams = np.stack([table.T @ table] * ladder.size)
    few = max(1, _MAX_STATES // len(problem.motion))
    for begin in range(0, ladder.size, few):
        part = slice(begin, begin + few)
        zeta = follow_alike(shape.n, float(shape.rho), 1 / ladder[part], problem.motion.path)[:, problem.scored]
        grams[part, moving, :] = grams[part, :, moving] = zeta @ table
        grams[part, moving, moving] = np.einsum("kn,kn->k", zeta, zeta)
    return grams / len(table)


Law = tuple[str, tuple[float, ...]]  # a form, and the rates it is held at


ABSENT = "absent"  # in place of a form: the coordinate stays zero
_NO_TERMS = Form(ABSENT, ())


def _form(law: str | Law) -> Form:
    name = law_of(law)[0]
    return _NO_TERMS if name == ABSENT else FORMS[name]


def _size(law: str | Law) -> int:
    return len(_form(law).terms) + len(_form(law).rate_bounds)


def law_of(form: str | Law) -> Law:
    """Return a form with its rates; a name alone has none."""
    return (form, ()) if isinstance(form, str) else form


@dataclass(frozen=True, eq=False)
class FormChoice:
    """Forms chosen for a joint fit."""

    forms: Mapping[str, str | Law]
    fit: JointFunctionFit
    refused: Mapping[str, str]  # forms that broke a law of physics, and which


@dataclass(frozen=True, eq=False)
class JointFunctionFit:
    """A parameter map fitted to all runs at once."""

    parameters: ParameterMap
    nrmse_pp: Floats  # (R,) error of each run (of the condensed runs; the linear parameters unbounded)
    at_bounds: tuple[str, ...] = ()  # the shape coordinate, where its function leaves the search range


@on_one_blas_thread
def fit_jointly(
    data: Condensed,
    forms: Mapping[str, str | Law],
    start: ParameterFunction | None,
    *,
    reweightings: int = 6,
    most_steps: int = 12,
    polish: bool = True,
) -> JointFunctionFit:
    """Fit the coefficients of all parameter functions to all runs at once, with some form of each coordinate.

    `start` is the function of the shape coordinate to start from; its form and rates are used. It is None for models
    without one. `reweightings` and `most_steps` are the rounds of robust weights and the steps of the search in each.
    `polish`: refine to the last digits at the end, so that results do not depend on rounding.
    """
    design = _Design(data, forms)
    if start is None:
        return _finish(design, _reweighted(design, data.gram[:, 0], reweightings), {})
    search = _ShapeSearch(design, start, np.ones(data.scale.size))
    centre = np.array(start.coefficients) * search.scale
    box = centre - _SEARCH_RANGE, centre + _SEARCH_RANGE
    last = search
    for _ in range(reweightings):
        centre = least_squares(
            search.residual, centre, *box, most_steps, _SEARCH_TOLERANCE, slopes=search.slopes, curved=True
        ).point
        weights = robust_weights(search.solution(centre).nrmse_pp, _MIN_ERROR_PP)
        settled = np.max(np.abs(weights / search.weights - 1)) < _WEIGHT_TOLERANCE
        last, search = search, search.weighted(weights)
        if settled:
            break
    if polish:
        centre = newton_refine(last.gradient, centre, *box)
    solution = last.solution(centre)
    function = ParameterFunction(start.form, tuple((centre / search.scale).tolist()), start.rates, log=True)
    fit = _finish(design, solution, {data.shape: function})
    reached, ends = search.shape_values(centre), data.ladder[[0, -1]]
    outside = np.any((reached <= ends[0] * _GRID_RATIO**0.01) | (reached >= ends[1] / _GRID_RATIO**0.01))
    return replace(fit, at_bounds=(data.shape,)) if outside else fit


@on_one_blas_thread
def leave_out_errors(data: Condensed, fit: JointFunctionFit, forms: Mapping[str, str | Law]) -> dict[str, Floats]:
    """Calculate nrmse_pp of the runs of every fold, cross-validated in the linear coefficients, by kind of fold.

    The shape function is that of the fit to all runs: fast enough to select forms, but no final score.
    """
    design = _Design(data, forms)
    shapes = (
        fit.parameters.functions[data.shape](*features(data.conditions))
        if data.shape
        else np.full(data.scale.size, data.ladder[0])
    )
    table, _ = design.table(data.at(shapes)[0])
    rows, weights = table.reshape(-1, table.shape[2]), robust_weights(fit.nrmse_pp, _MIN_ERROR_PP)
    errors: dict[str, Floats] = {}
    for kind, groups in data.folds.items():
        kept = np.tile(weights, (len(groups), 1))
        for fold, group in zip(kept, groups, strict=True):
            fold[group] = 0.0
        solutions = solve_weighted(rows[:, :-1], rows[:, -1], np.repeat(kept, table.shape[1], axis=1), _RANK_LIMIT)
        left_out = [_Solution.of(table[group], solution) for group, solution in zip(groups, solutions, strict=True)]
        errors[kind] = np.concatenate([solution.nrmse_pp for solution in left_out])
    return errors


@dataclass(frozen=True)
class _Solution:
    coefficients: Floats
    error: Floats  # (R, L+1)

    @classmethod
    def of(cls, table: Floats, coefficients: Floats) -> _Solution:
        return cls(coefficients, table[:, :, :-1] @ coefficients - table[:, :, -1])

    @property
    def nrmse_pp(self) -> Floats:
        return np.sqrt(np.sum(self.error**2, axis=1))


class _Design:
    """Linear coordinates of every run as a matrix times the coefficients of all functions."""

    def __init__(self, data: Condensed, forms: Mapping[str, str | Law]):
        self.data = data
        laws = {name: law_of(forms[name]) for name in data.linear}
        self.forms = {name: _form(law) for name, law in laws.items()}
        self.rates = {name: rates for name, (_, rates) in laws.items()}
        blocks = [form.columns(*features(data.conditions), self.rates[n]) for n, form in self.forms.items()]
        self.sizes = [block.shape[1] for block in blocks]
        runs, total = data.scale.size, sum(self.sizes)
        self.matrix = np.zeros((runs, len(blocks) + 1, total + 1))
        at = 0
        for row, block in enumerate(blocks):
            # The Gram matrices hold forces over each run's peak-to-peak value.
            self.matrix[:, row, at : at + block.shape[1]] = block / data.scale[:, None]
            at += block.shape[1]
        self.matrix[:, -1, -1] = 1.0
        self.ridge = _RIDGE * np.eye(len(blocks) + 1)
        self.upper = np.triu(np.ones_like(self.ridge)) - np.eye(len(blocks) + 1) / 2

    def table(self, gram: Floats) -> tuple[Floats, Floats]:
        """Rows that represent a run's samples, and the factors of their Gram matrices.

        (R, L+1, P+1), by coefficient and, last, the measured force; (R, L+1, L+1).
        """
        size = np.sqrt(np.maximum(gram.diagonal(0, 1, 2), 1e-300))
        factor = _factor(gram / (size[:, :, None] * size[:, None, :]) + self.ridge) * size[:, None, :]
        return factor @ self.matrix, factor


class _ShapeSearch:
    """Weighted errors of all runs over the coefficients of the shape function, all others solved for."""

    def __init__(self, design: _Design, start: ParameterFunction, weights: Floats):
        data, self.design, self.start, self.weights = design.data, design, start, weights
        columns = FORMS[start.form].columns(*features(data.conditions), start.rates)
        size = np.linalg.norm(columns, axis=0) / np.sqrt(columns.shape[0])
        self.scale = np.where(size > 0, size, 1.0)  # with runs at 0 A alone, a column over the current is zero
        self.columns = columns / self.scale
        self._tables: tuple[bytes, Floats, Floats, Floats] = b"", columns, columns, columns
        self._solved: _Solution | None = None
        self.ends: tuple[float, float] = np.log(data.ladder[[0, -1]]).tolist()

    def weighted(self, weights: Floats) -> _ShapeSearch:
        """Return the same with other weights, which do not change the cached tables."""
        other = copy(self)
        other.weights, other._solved = weights, None
        return other

    def shape_values(self, u: Floats) -> Floats:
        """(R,) values of the shape coordinate."""
        return np.exp(np.minimum(np.maximum(self.columns @ u, self.ends[0]), self.ends[1]))

    def solution(self, u: Floats) -> _Solution:
        """Return the other functions' coefficients at a point."""
        return self._at(u)[-1]

    def residual(self, u: Floats) -> Floats:
        return (self.weights[:, None] * self.solution(u).error).ravel()

    def slopes(self, u: Floats) -> Floats:
        """Return derivatives of the residual, the other coefficients moving along [Kaufman 1975, BIT 15, 49]."""
        slope, factor, table, solution = self._at(u)
        inverse = np.linalg.inv(factor)
        # A triangle whose square moves by `slope` moves by the upper half of this, times itself.
        moved = (inverse.transpose(0, 2, 1) @ slope @ inverse) * self.design.upper
        s, (low, high) = self.columns @ u, self.ends
        by_shape = (moved @ solution.error[:, :, None])[:, :, 0] * (self.weights * ((s > low) & (s < high)))[:, None]
        jacobian = (by_shape[:, :, None] * self.columns[:, None, :]).reshape(-1, u.size)
        weighted = (self.weights[:, None, None] * table[:, :, :-1]).reshape(jacobian.shape[0], -1)
        return project_out_columns(weighted, jacobian)

    def gradient(self, u: Floats) -> Floats:
        """Gradient of half the squared residual: exact, as the residual is stationary in the others."""
        return self.residual(u) @ self.slopes(u)

    def _at(self, u: Floats) -> tuple[Floats, Floats, Floats, _Solution]:
        if self._tables[0] != u.tobytes():
            gram, slope = self.design.data.at(self.shape_values(u))
            table, factor = self.design.table(gram)
            self._tables, self._solved = (u.tobytes(), slope, factor, table), None
        if self._solved is None:
            self._solved = _solve(self._tables[-1], self.weights)
        return *self._tables[1:], self._solved


def _solve(table: Floats, weights: Floats) -> _Solution:
    """Coefficients of least weighted squares; errors are those of the condensed runs."""
    weighted = (weights[:, None, None] * table).reshape(-1, table.shape[2])
    return _Solution.of(table, solve_linear(weighted[:, :-1], weighted[:, -1], _RANK_LIMIT))


def _factor(gram: Floats) -> Floats:
    """(R, K, K) upper triangles T with Tᵀ T the given ones, or the nearest that have such."""
    try:
        return np.asarray(np.linalg.cholesky(gram).transpose(0, 2, 1), dtype=float)
    except np.linalg.LinAlgError:  # a model that fits to rounding: the interpolation error exceeds the ridge
        values, vectors = np.linalg.eigh(gram)
        return np.linalg.qr(np.sqrt(np.maximum(values, _RIDGE))[:, :, None] * vectors.transpose(0, 2, 1))[1]


def _reweighted(design: _Design, gram: Floats, reweightings: int) -> _Solution:
    table, _ = design.table(gram)
    solution = _solve(table, np.ones(len(gram)))
    for _ in range(reweightings):
        solution = _solve(table, robust_weights(solution.nrmse_pp, _MIN_ERROR_PP))
    return solution


def _finish(design: _Design, solution: _Solution, functions: dict[str, ParameterFunction]) -> JointFunctionFit:
    parts = np.split(solution.coefficients, np.cumsum(design.sizes)[:-1])
    for (name, form), values in zip(design.forms.items(), parts, strict=True):
        if form.terms:
            functions[name] = ParameterFunction(form.name, tuple(values.tolist()), design.rates[name])
    order = [*design.data.model_type.map_forms(), *functions]
    ordered = {name: functions[name] for name in dict.fromkeys(order) if name in functions}
    return JointFunctionFit(ParameterMap(design.data.model_type, ordered), solution.nrmse_pp)


def choose_forms(
    data: Condensed,
    candidates: Mapping[str, Sequence[str | Law]],
    shape_values: Floats,
    dissipating: Mapping[str, str] | None = None,
) -> FormChoice:
    """Choose every coordinate's form by cross-validation over conditions, currents and motions.

    Starting from the shortest forms, one coordinate at a time tries its candidates: the smaller of two forms is kept if
    `selection.smaller_wins`. Two passes. `candidates`: forms by coordinate, shortest first; those with too many
    parameters for the tests are skipped. `shape_values` (R,): the shape coordinate of individual fits, as start.
    `dissipating`: units of the coordinates that must not be negative; forms that break a law of physics are refused.
    """
    start, units = tuple(shape_values.tolist()), dissipating or {}
    options = {
        name: [law for law in laws if supported(_form(law), data.conditions)] or [laws[0]]
        for name, laws in candidates.items()
    }
    forms: dict[str, str | Law] = {name: laws[0] for name, laws in options.items()}
    fit, errors = _tried(data, forms, start)
    refused: dict[str, str] = {}
    for _ in range(_PASSES):
        before = dict(forms)
        for name, laws in options.items():
            for law in laws:
                if law == forms[name]:
                    continue
                try:
                    trial, other = _tried(data, {**forms, name: law}, start)
                except IdentificationError:
                    continue  # the tests do not separate the terms of this form
                larger = _size(law) >= _size(forms[name])
                better = not smaller_wins(errors, other) if larger else smaller_wins(other, errors)
                better = _risen(fit, trial, name, data.conditions, units, better)
                checked = trial.parameters.functions.get(name) if better and name in units else None
                reason = broken_law(checked, data.conditions, units[name]) if checked else ""
                if reason:
                    refused[f"{name}: {law_of(law)[0]}"] = reason
                elif better:
                    forms, fit, errors = {**forms, name: law}, trial, other
        if forms == before:
            break
    return FormChoice(forms, fit_jointly(data, forms, fit.parameters.functions.get(data.shape)), refused)


def _risen(
    fit: JointFunctionFit,
    trial: JointFunctionFit,
    name: str,
    conditions: Sequence[Condition],
    dissipating: Mapping[str, str],
    better: bool,
) -> bool:
    """Tell if a trial replaces a fit; a yield force that rises with the current always replaces a constant one."""
    one, other = (each.parameters.functions.get(name) for each in (fit, trial))
    if one is None or other is None or name not in dissipating:
        return better
    if rises(other, one, dissipating[name], conditions):
        return False
    return better or rises(one, other, dissipating[name], conditions)


def _tried(data: Condensed, forms: Mapping[str, str | Law], shape_values: tuple[float, ...]) -> _Trial:
    """Return a fit with some forms, and its errors by kind of fold."""
    # Of all forms and of those over the current alone, and in the second pass, many are the same.
    trial = *forms.items(), shape_values
    if trial not in data.trials:
        data.trials[trial] = _fitted(data, forms, shape_values)
    return data.trials[trial]


def _fitted(data: Condensed, forms: Mapping[str, str | Law], shape_values: tuple[float, ...]) -> _Trial:
    for name in data.linear:
        if not law_of(forms[name])[1] and _form(forms[name]).terms:
            require_determined(law_of(forms[name])[0], data.conditions)
    start = _start(law_of(forms[data.shape])[0], data.conditions, shape_values) if data.shape else None
    fit = fit_jointly(data, forms, start, reweightings=2, most_steps=5, polish=False)
    return fit, leave_out_errors(data, fit, forms)


@lru_cache(maxsize=16)  # the same for all forms of the other coordinates
def _start(form: str, conditions: Sequence[Condition], shape_values: tuple[float, ...]) -> ParameterFunction:
    return fit_function(form, conditions, shape_values, log=True).function
