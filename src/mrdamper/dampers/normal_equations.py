"""Global fit of parameter functions, for models whose loop has one shape coordinate.

Given the shape coordinate (the yield displacement), a run's squared error is a quadratic form in the linear parameters.
Each run is therefore reduced once to small Gram matrices on a grid of shape values; fits to all runs, other parameter
functions and leave-one-condition-out then take milliseconds, because no sample is evaluated again.

Runs count by their own force scale, and the sum of run RMSEs is minimised, not of squares:
a run from a drifting session then has less weight (iteratively reweighted least squares).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from mrdamper.dampers.condensed_runs import GRID_RATIO, Condensed
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.data import Condition, Floats
from mrdamper.errors import IdentificationError
from mrdamper.statistics.functions.fitting import fit_function, require_determined
from mrdamper.statistics.functions.forms import FORMS, Form, ParameterFunction, features
from mrdamper.statistics.functions.selection import broken_law, rises, smaller_wins, supported
from mrdamper.statistics.levenberg_marquardt import least_squares, newton_refine
from mrdamper.statistics.linear import (
    on_one_blas_thread,
    products_of_rest,
    robust_weights,
    solve_linear,
    solve_weighted,
)

_SEARCH_TOLERANCE = 1e-6  # relative gain of a step at which a search ends
_WEIGHT_TOLERANCE = 1e-3  # change of the robust weights below which the rounds end
_SEARCH_RANGE = 6.0  # of a search, in units of a function's terms
_MIN_ERROR_PP = 1e-4  # nrmse_pp below which a run gains no more weight
_PASSES = 2  # over all coordinates in the choice of forms
_RATE_FACTORS = (0.85, 1 / 0.85)  # steps of the rate of a law, after the choice of the law at the rates of a grid
_MIN_RATE_GAIN = 1e-3  # relative gain of the error by such a step
_RANK_LIMIT = 1e-10  # singular value over the largest below which a coefficient is not determined
_RIDGE = 1e-7  # interpolated Gram matrices of nearly parallel columns may lose positivity by less

ABSENT = "absent"  # in place of a form: the coordinate stays zero
_NO_TERMS = Form(ABSENT, ())


class Law(NamedTuple):
    """Name of a form, and the rates it is held at."""

    name: str
    rates: tuple[float, ...] = ()

    @property
    def form(self) -> Form:
        """The form of that name; without terms if the coordinate is absent."""
        return _NO_TERMS if self.name == ABSENT else FORMS[self.name]

    @property
    def size(self) -> int:
        """Number of terms and rates."""
        return len(self.form.terms) + len(self.form.rate_bounds)


@dataclass(frozen=True, eq=False)
class FormChoice:
    """Forms chosen for a joint fit."""

    forms: Mapping[str, Law]
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
    forms: Mapping[str, Law],
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
            search.residual, centre, *box, most_steps, _SEARCH_TOLERANCE, products=search.products, curved=True
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
    outside = np.any((reached <= ends[0] * GRID_RATIO**0.01) | (reached >= ends[1] / GRID_RATIO**0.01))
    return replace(fit, at_bounds=(data.shape,)) if outside else fit


@on_one_blas_thread
def leave_out_errors(data: Condensed, fit: JointFunctionFit, forms: Mapping[str, Law]) -> dict[str, Floats]:
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

    def __init__(self, data: Condensed, forms: Mapping[str, Law]):
        self.data = data
        self.forms = {name: forms[name].form for name in data.linear}
        self.rates = {name: forms[name].rates for name in data.linear}
        point = features(data.conditions)
        blocks = [form.columns(*point, self.rates[n]) for n, form in self.forms.items()]
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

    def products(self, u: Floats) -> tuple[Floats, Floats]:
        """Jᵀr and JᵀJ of the residual r and its derivatives J, the others moving along [Kaufman 1975, BIT 15, 49]."""
        slopes = self._slopes(u)
        columns = (self.weights[:, None, None] * self._at(u)[2][:, :, :-1]).reshape(len(slopes), -1)
        return self.residual(u) @ slopes, products_of_rest(columns, slopes)

    def _slopes(self, u: Floats) -> Floats:
        """Return derivatives of the residual, the other coefficients held."""
        slope, factor, _, solution = self._at(u)
        inverse = np.linalg.inv(factor)
        # A triangle whose square moves by `slope` moves by the upper half of this, times itself.
        moved = (inverse.transpose(0, 2, 1) @ slope @ inverse) * self.design.upper
        s, (low, high) = self.columns @ u, self.ends
        by_shape = (moved @ solution.error[:, :, None])[:, :, 0] * (self.weights * ((s > low) & (s < high)))[:, None]
        return (by_shape[:, :, None] * self.columns[:, None, :]).reshape(-1, u.size)

    def gradient(self, u: Floats) -> Floats:
        """Gradient of half the squared residual: exact, as the residual is stationary in the others."""
        return self.residual(u) @ self._slopes(u)

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


_Trial = tuple[JointFunctionFit, dict[str, Floats]]  # and its errors by kind of fold


def choose_forms(
    data: Condensed,
    candidates: Mapping[str, Sequence[Law]],
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
        name: [law for law in laws if supported(law.form, data.conditions)] or [laws[0]]
        for name, laws in candidates.items()
    }
    forms = {name: laws[0] for name, laws in options.items()}
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
                larger = law.size >= forms[name].size
                better = not smaller_wins(errors, other) if larger else smaller_wins(other, errors)
                better = _risen(fit, trial, name, data.conditions, units, better)
                checked = trial.parameters.functions.get(name) if better and name in units else None
                reason = broken_law(checked, data.conditions, units[name]) if checked else ""
                if reason:
                    refused[f"{name}: {law.name}"] = reason
                elif better:
                    forms, fit, errors = {**forms, name: law}, trial, other
        if forms == before:
            break
    forms, fit = _with_nearer_rates(data, forms, start, units)
    return FormChoice(forms, fit_jointly(data, forms, fit.parameters.functions.get(data.shape)), refused)


def _with_nearer_rates(
    data: Condensed, forms: dict[str, Law], start: tuple[float, ...], units: Mapping[str, str]
) -> tuple[dict[str, Law], JointFunctionFit]:
    """Return the chosen forms with the rates of smallest error near those of the grid, and their fit."""
    fit, _ = _tried(data, forms, start)
    for name, factor in product([name for name, law in forms.items() if law.rates], _RATE_FACTORS):
        low, high = forms[name].form.rate_bounds[0]
        while low < (rate := forms[name].rates[0] * factor) < high:
            trial = {**forms, name: Law(forms[name].name, (rate,))}
            other, _ = _tried(data, trial, start)
            function, gain = other.parameters.functions[name], 1 - np.mean(other.nrmse_pp) / np.mean(fit.nrmse_pp)
            if gain < _MIN_RATE_GAIN or (name in units and broken_law(function, data.conditions, units[name])):
                break
            forms, fit = trial, other
    return forms, fit


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


def _tried(data: Condensed, forms: Mapping[str, Law], shape_values: tuple[float, ...]) -> _Trial:
    """Return a fit with some forms, and its errors by kind of fold."""
    # Of all forms and of those over the current alone, and in the second pass, many are the same.
    trial = *forms.items(), shape_values
    if trial not in data.trials:
        data.trials[trial] = _fitted(data, forms, shape_values)
    return data.trials[trial]


def _fitted(data: Condensed, forms: Mapping[str, Law], shape_values: tuple[float, ...]) -> _Trial:
    for name in data.linear:
        if not forms[name].rates and forms[name].form.terms:
            require_determined(forms[name].name, data.conditions)
    start = _start(forms[data.shape].name, data.conditions, shape_values) if data.shape else None
    fit = fit_jointly(data, forms, start, reweightings=2, most_steps=5, polish=False)
    return fit, leave_out_errors(data, fit, forms)


@lru_cache(maxsize=16)  # the same for all forms of the other coordinates
def _start(form: str, conditions: Sequence[Condition], shape_values: tuple[float, ...]) -> ParameterFunction:
    return fit_function(form, conditions, shape_values, log=True).function
