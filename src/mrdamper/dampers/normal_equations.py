"""Global fit of parameter functions, for models whose loop has one shape coordinate.

Given the shape coordinate (the yield displacement), a run's squared error is a quadratic form in the linear parameters.
Each run is therefore reduced once to small Gram matrices on a grid of shape values; fits to all runs, other parameter
functions and leave-one-condition-out then take milliseconds, because no sample is evaluated again.

Runs count by their own force scale, and the sum of run RMSEs is minimised, not of squares:
a run from a drifting session then has less weight (iteratively reweighted least squares).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from itertools import islice, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.condensed_runs import GRID_RATIO, Condensed
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.data import Condition, Floats
from mrdamper.errors import IdentificationError
from mrdamper.statistics.functions.fitting import fit_function, require_determined
from mrdamper.statistics.functions.forms import FORMS, Form, ParameterFunction, features
from mrdamper.statistics.functions.selection import broken_law, rises, smaller_wins, supported
from mrdamper.statistics.linear import inverse_of_triangle, on_one_blas_thread, robust_weights, solve_weighted
from mrdamper.statistics.stacked_least_squares import Products, least_squares_of_each, newton_refine_each, solve_each

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
    forms: Sequence[Mapping[str, Law]],
    starts: Sequence[ParameterFunction | None],
    kept: NDArray[np.bool_],
    *,
    reweightings: int = 6,
    most_steps: int = 12,
    polish: bool = True,
) -> list[JointFunctionFit]:
    """Fit the coefficients of all parameter functions to all runs, with some form of each coordinate: B fits at once.

    They are of several forms and starts, or of several sets of the runs: `forms` and `starts` are B, or one for all;
    `kept` (B, R) marks the runs of each fit. A start is a function of the shape coordinate, whose form and rates are
    used; None for models without one. `reweightings` and `most_steps` are the rounds of robust weights and the steps of
    the search in each. `polish`: refine to the last digits at the end, so that results do not depend on rounding.
    """
    design = _Design(data, forms)
    if not data.shape:
        solution = _reweighted(design, data.gram[:, 0], kept, reweightings)
        return [_finish(design, solution, k, {}) for k in range(len(kept))]
    search = _ShapeSearch(design, [start for start in starts if start], kept)
    centre = search.start
    box, rows = (centre - _SEARCH_RANGE, centre + _SEARCH_RANGE), np.arange(len(kept))
    for left in range(reweightings - 1, -1, -1):
        centre[rows] = least_squares_of_each(
            search, rows, centre[rows], box[0][rows], box[1][rows], most_steps, _SEARCH_TOLERANCE
        )
        weights = kept[rows] * robust_weights(search.at(rows, centre[rows]).solution.nrmse_pp, _MIN_ERROR_PP)
        change = np.abs(weights / np.where(kept[rows], search.weights[rows], 1.0) - kept[rows])
        unsettled = np.max(change, axis=1) >= _WEIGHT_TOLERANCE
        rows = rows[unsettled]
        if not left or not rows.size:
            break
        search.weights[rows] = weights[unsettled]
    if polish:
        centre = newton_refine_each(search, centre, *box)
    at, ends, fits = search.at(np.arange(len(kept)), centre), data.ladder[[0, -1]], list[JointFunctionFit]()
    reached = np.exp(at.logs)
    outside = (reached <= ends[0] * GRID_RATIO**0.01) | (reached >= ends[1] / GRID_RATIO**0.01)
    for k, (point, at_end) in enumerate(zip(centre / search.scale, np.any(outside & kept, axis=1), strict=True)):
        start = search.starts[k if len(starts) > 1 else 0]
        coefficients = tuple(point[: len(start.coefficients)].tolist())
        function = ParameterFunction(start.form, coefficients, start.rates, log=True)
        fit = _finish(design, at.solution, k, {data.shape: function})
        fits.append(replace(fit, at_bounds=(data.shape,)) if at_end else fit)
    return fits


@on_one_blas_thread
def leave_out_errors(data: Condensed, fit: JointFunctionFit, forms: Mapping[str, Law]) -> dict[str, Floats]:
    """Calculate nrmse_pp of the runs of every fold, cross-validated in the linear coefficients, by kind of fold.

    The shape function is that of the fit to all runs: fast enough to select forms, but no final score.
    """
    design = _Design(data, [forms])
    shapes = (
        fit.parameters.functions[data.shape](*features(data.conditions))
        if data.shape
        else np.full(data.scale.size, data.ladder[0])
    )
    table, _ = design.table(data.at(shapes)[0])
    rows, weights = table.reshape(-1, table.shape[-1]), robust_weights(fit.nrmse_pp, _MIN_ERROR_PP)
    errors: dict[str, Floats] = {}
    for kind, groups in data.folds.items():
        kept = np.tile(weights, (len(groups), 1))
        for fold, group in zip(kept, groups, strict=True):
            fold[group] = 0.0
        solutions = solve_weighted(rows[:, :-1], rows[:, -1], np.repeat(kept, table.shape[-2], axis=1), _RANK_LIMIT)
        nrmse_pp = _Solution.of(table, solutions).nrmse_pp
        errors[kind] = np.concatenate([of[group] for of, group in zip(nrmse_pp, groups, strict=True)])
    return errors


@dataclass(frozen=True)
class _Solution:
    coefficients: Floats  # (B, P)
    error: Floats  # (B, R, L+1)

    @classmethod
    def of(cls, table: Floats, coefficients: Floats) -> _Solution:
        """Errors of tables (R, L+1, P+1), or (B, R, L+1, P+1), with coefficients (B, P)."""
        rows = table.reshape(*table.shape[:-3], -1, table.shape[-1])
        error = (rows[..., :-1] @ coefficients[:, :, None])[..., 0] - rows[..., -1]
        return cls(coefficients, error.reshape(len(error), *table.shape[-3:-1]))

    @property
    def nrmse_pp(self) -> Floats:
        return np.sqrt(np.sum(self.error**2, axis=-1))


class _Design:
    """Linear coordinates of every run as a matrix times the coefficients of all functions, for each set of forms."""

    def __init__(self, data: Condensed, forms: Sequence[Mapping[str, Law]]):
        self.data = data
        self.forms = [{name: each[name] for name in data.linear} for each in forms]
        point, runs = features(data.conditions), data.scale.size
        blocks = [[law.form.columns(*point, law.rates) for law in each.values()] for each in self.forms]
        width = max(sum(block.shape[1] for block in each) for each in blocks)
        self.matrix = np.zeros((len(forms), runs, len(data.linear) + 1, width + 1))
        for matrix, each in zip(self.matrix, blocks, strict=True):
            at = 0
            for row, block in enumerate(each):
                # The Gram matrices hold forces over each run's peak-to-peak value.
                matrix[:, row, at : at + block.shape[1]] = block / data.scale[:, None]
                at += block.shape[1]
        self.matrix[..., -1, -1] = 1.0
        self.ridge = _RIDGE * np.eye(len(data.linear) + 1)

    def table(self, gram: Floats, rows: NDArray[np.intp] | slice = slice(None)) -> tuple[Floats, Floats]:
        """Rows that represent a run's samples, and the factors of their Gram matrices, of the fits at some indices.

        (B, R, L+1, P+1), by coefficient and, last, the measured force; (B, R, L+1, L+1).
        """
        size = np.sqrt(np.maximum(gram.diagonal(0, -2, -1), 1e-300))
        factor = _factor(gram / (size[..., :, None] * size[..., None, :]) + self.ridge) * size[..., None, :]
        return factor @ (self.matrix[rows] if len(self.matrix) > 1 else self.matrix), factor


class _ShapeSearch:
    """Weighted errors of B sets of runs over the coefficients of the shape function, all others solved for."""

    def __init__(self, design: _Design, starts: Sequence[ParameterFunction], kept: NDArray[np.bool_]):
        data, self.design, self.starts, self.weights = design.data, design, starts, kept.astype(float)
        width = max(len(start.coefficients) for start in starts)
        columns, first = np.zeros((len(starts), data.scale.size, width)), np.zeros((len(starts), width))
        for k, start in enumerate(starts):
            size = len(start.coefficients)
            columns[k, :, :size] = FORMS[start.form].columns(*features(data.conditions), start.rates)
            first[k, :size] = start.coefficients
        size = np.sqrt((self.weights[:, None, :] @ columns**2)[:, 0] / kept.sum(axis=1)[:, None])
        self.scale = np.where(size > 0, size, 1.0)  # with runs at 0 A alone, a column over the current is zero
        self.columns = columns / self.scale[:, None, :]  # (B, R, D)
        self.start = first * self.scale
        self.ends: tuple[float, float] = np.log(data.ladder[[0, -1]]).tolist()

    def __call__(self, rows: NDArray[np.intp], u: Floats) -> tuple[Floats, Products]:
        """Costs of some of the sets at a point each, and the function of their products."""
        point = self.at(rows, u)
        return np.sum((point.weights * point.solution.nrmse_pp) ** 2, axis=1), point.products

    def at(self, rows: NDArray[np.intp], u: Floats) -> _ShapePoint:
        """Evaluate some of the sets at a point each."""
        low, high = self.ends
        columns, weights = self.columns[rows], self.weights[rows]
        logs = (columns @ u[:, :, None])[:, :, 0]
        inside = np.minimum(np.maximum(logs, low), high)
        gram, slope = self.design.data.at(np.exp(inside))
        table, factor = self.design.table(gram, rows)
        solution = _solve(table, weights)
        return _ShapePoint(columns * (inside == logs)[:, :, None], weights, inside, slope, table, factor, solution)


class _ShapePoint(NamedTuple):
    """Sets of runs at a point each."""

    columns: Floats  # (B, R, D) derivatives of the logarithm of the shape coordinate
    weights: Floats  # (B, R)
    logs: Floats  # (B, R) logarithm of the shape coordinate
    slope: Floats  # (B, R, L+1, L+1) derivatives of the Gram matrices by it
    table: Floats
    factor: Floats
    solution: _Solution

    def products(self, some: NDArray[np.bool_]) -> tuple[Floats, Floats]:
        """Jᵀr and JᵀJ of the residual r and its derivatives J, the others moving along [Kaufman 1975, BIT 15, 49]."""
        columns, weights, error = self.columns[some], self.weights[some], self.solution.error[some]
        inverse = inverse_of_triangle(self.factor[some].swapaxes(-1, -2))
        # A triangle whose square moves by `slope` moves by the upper half of this, times itself.
        moved = (inverse @ self.slope[some] @ inverse.swapaxes(-1, -2)) * _upper_half(inverse.shape[-1])
        by_shape = (moved @ error[..., None]) * weights[:, :, None, None]
        slopes = (by_shape * columns[:, :, None, :]).reshape(len(error), -1, columns.shape[2])
        held = (weights[:, :, None, None] * self.table[some][..., :-1]).reshape(*slopes.shape[:2], -1)
        residual = (weights[:, :, None] * error).reshape(len(error), 1, -1)
        rest = slopes - held @ solve_each(held, slopes)
        return (residual @ slopes)[:, 0], rest.transpose(0, 2, 1) @ rest


@cache
def _upper_half(size: int) -> Floats:
    """Factors of the elements of a matrix that leave half of its diagonal, and all above."""
    return np.triu(np.ones((size, size))) - np.eye(size) / 2


def _solve(table: Floats, weights: Floats) -> _Solution:
    """Coefficients of least weighted squares (B, P); errors are those of the condensed runs."""
    weighted = (weights[:, :, None, None] * table).reshape(len(weights), -1, table.shape[-1])
    return _Solution.of(table, solve_each(weighted[:, :, :-1], weighted[:, :, -1:])[:, :, 0])


def _factor(gram: Floats) -> Floats:
    """(..., K, K) upper triangles T with Tᵀ T the given ones, or the nearest that have such."""
    try:
        return np.asarray(np.linalg.cholesky(gram).swapaxes(-1, -2), dtype=float)
    except np.linalg.LinAlgError:  # a model that fits to rounding: the interpolation error exceeds the ridge
        values, vectors = np.linalg.eigh(gram)
        return np.linalg.qr(np.sqrt(np.maximum(values, _RIDGE))[..., :, None] * vectors.swapaxes(-1, -2))[1]


def _reweighted(design: _Design, gram: Floats, kept: NDArray[np.bool_], reweightings: int) -> _Solution:
    table, _ = design.table(gram)
    solution = _solve(table, kept.astype(float))
    for _ in range(reweightings):
        solution = _solve(table, kept * robust_weights(solution.nrmse_pp, _MIN_ERROR_PP))
    return solution


def _finish(design: _Design, solution: _Solution, k: int, functions: dict[str, ParameterFunction]) -> JointFunctionFit:
    values: Iterator[float] = iter(solution.coefficients[k].tolist())
    for name, law in design.forms[k if len(design.forms) > 1 else 0].items():
        if coefficients := tuple(islice(values, len(law.form.terms))):
            functions[name] = ParameterFunction(law.name, coefficients, law.rates)
    order = [*design.data.model_type.map_forms(), *functions]
    ordered = {name: functions[name] for name in dict.fromkeys(order) if name in functions}
    return JointFunctionFit(ParameterMap(design.data.model_type, ordered), solution.nrmse_pp[k])


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
            _try_all(data, [{**forms, name: law} for law in laws], start)
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
    every = np.ones((1, data.scale.size), dtype=bool)
    fits = fit_jointly(data, [forms], [fit.parameters.functions.get(data.shape)], every)
    return FormChoice(forms, fits[0], refused)


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
    _try_all(data, [forms], shape_values)
    trial = data.trials[*forms.items(), shape_values]
    if isinstance(trial, IdentificationError):
        raise trial
    return trial


def _try_all(data: Condensed, trials: Sequence[Mapping[str, Law]], shape_values: tuple[float, ...]) -> None:
    """Fit with each of several forms, all at once, and keep the fits, or why there is none."""
    # Of all forms and of those over the current alone, and in the second pass, many are the same.
    able, starts = list[Mapping[str, Law]](), list[ParameterFunction | None]()
    for forms in trials:
        if (key := (*forms.items(), shape_values)) in data.trials:
            continue
        try:
            for name in data.linear:
                if not forms[name].rates and forms[name].form.terms:
                    require_determined(forms[name].name, data.conditions)
            starts.append(_start(forms[data.shape].name, data.conditions, shape_values) if data.shape else None)
            able.append(forms)
        except IdentificationError as error:
            data.trials[key] = error
    kept = np.ones((len(able), data.scale.size), dtype=bool)
    fits = fit_jointly(data, able, starts, kept, reweightings=2, most_steps=5, polish=False) if able else []
    for forms, fit in zip(able, fits, strict=True):
        data.trials[*forms.items(), shape_values] = fit, leave_out_errors(data, fit, forms)


@lru_cache(maxsize=16)  # the same for all forms of the other coordinates
def _start(form: str, conditions: Sequence[Condition], shape_values: tuple[float, ...]) -> ParameterFunction:
    return fit_function(form, conditions, shape_values, log=True).function
