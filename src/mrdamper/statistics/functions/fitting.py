"""Fitting parameter functions to identified values, and choosing among their forms."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrdamper.data import Condition, Floats
from mrdamper.data.wording import counted
from mrdamper.errors import IdentificationError
from mrdamper.statistics.functions.forms import Form, ParameterFunction, features, form_named
from mrdamper.statistics.functions.selection import broken_law, fold_groups, rises, smaller_wins, supported
from mrdamper.statistics.levenberg_marquardt import least_squares, newton_refine
from mrdamper.statistics.linear import products_of_rest, solve_linear
from mrdamper.statistics.metrics import explained_variance

# Below this share of the largest singular value the tests do not separate the terms: a rig repeats a motion to 1e-6.
_RANK_LIMIT = 1e-5


@dataclass(frozen=True)
class FunctionFit:
    """A fitted parameter function and how well it describes the identified values."""

    function: ParameterFunction
    # share of the variance it explains (in the logarithm, where the parameter is logarithmic); NaN without variance
    r2: float
    # RMS cross-validation error at omitted conditions, over the parameter's spread: below 1 the function predicts
    # better than the mean; infinite where one condition alone determines a term
    left_out: float
    # forms that were no candidates, and why
    refused: Mapping[str, str] = field(default_factory=dict[str, str], compare=False)


@dataclass(frozen=True, eq=False)
class _Fitted:
    """A fitted function with the data for its cross-validation."""

    fit: FunctionFit
    basis: Floats  # (N, terms), orthonormal, of the weighted columns
    residual: Floats  # (N,), weighted

    @property
    def penalty(self) -> float:
        """Factor on the errors for the rates, which are fitted to the omitted values, too."""
        return self.residual.size / (self.residual.size - len(self.fit.function.rates))


def fit_function(
    form: str | Form,
    conditions: Sequence[Condition],
    values: ArrayLike,
    *,
    log: bool = False,
    uncertainty: ArrayLike | None = None,
) -> FunctionFit:
    """Fit one form to a parameter's identified values (N,), or to their logarithm.

    `uncertainty` (N,) are standard errors of the values (of the logarithm, with `log`): values with smaller errors have
    more weight, up to those of the best quarter. Raises `IdentificationError` if the conditions do not separate the
    terms of the form: too few currents, frequencies or amplitudes.
    """
    return _fitted(form, conditions, values, log, _weights(uncertainty, len(conditions))).fit


def _fitted(form: str | Form, conditions: Sequence[Condition], values: ArrayLike, log: bool, weight: Floats) -> _Fitted:
    chosen = form_named(form) if isinstance(form, str) else form
    I, f, A = features(conditions)
    target = np.asarray(values, dtype=float)
    if log:
        target = np.log(target)
    if target.size < len(chosen.terms) + len(chosen.rate_bounds):
        raise _undetermined(chosen, counted(target.size, "condition"), I, f, A)
    rates = _best_rates(chosen, I, f, A, target, weight)
    columns = chosen.columns(I, f, A, rates) if rates else _fixed_columns(chosen, tuple(conditions))
    if columns is None or (rates and not _determined(columns)):
        raise _undetermined(chosen, "they do not tell its terms apart", I, f, A)
    coefficients, left_out, basis, residual = _solved(columns, target, weight, len(rates))
    function = ParameterFunction(chosen.name, tuple(coefficients.tolist()), tuple(float(r) for r in rates), log)
    size = float(np.std(target)) or 1.0
    fit = FunctionFit(function, r2=explained_variance(target, columns @ coefficients), left_out=left_out / size)
    return _Fitted(fit, basis, residual)


def choose_function(
    forms: Iterable[str],
    conditions: Sequence[Condition],
    values: ArrayLike,
    *,
    log: bool = False,
    uncertainty: ArrayLike | None = None,
    dissipating: str = "",
) -> FunctionFit:
    """Choose the form by cross-validation over conditions, currents and motions (`selection.smaller_wins`).

    Other parameters are those of `fit_function`; forms that the conditions do not determine are skipped, and so are
    those with too many parameters for the tested currents and motions. `dissipating` is the unit of a parameter that
    must not be negative: forms that violate a physical law are refused (`selection.broken_law`). Raises
    `IdentificationError` if the conditions determine none.
    """
    able: list[_Fitted] = []
    refusal: IdentificationError | None = None
    refused: dict[str, str] = {}
    ordered = sorted((form_named(name) for name in forms), key=lambda f: len(f.terms) + len(f.rate_bounds))
    weight = _weights(uncertainty, len(conditions))
    for form in ordered:
        if able and not supported(form, conditions):
            refused[form.name] = "too many parameters for the tested currents and motions"
            continue
        try:
            tried = _fitted(form, conditions, values, log, weight)
        except IdentificationError as error:
            refusal = error
            refused[form.name] = str(error)
            continue
        reason = broken_law(tried.fit.function, conditions, dissipating) if dissipating else ""
        if reason and able:
            refused[form.name] = reason
        else:
            able.append(tried)
    if not able:
        raise refusal or IdentificationError("no form to choose from", remedy="name at least one")
    errors, best = _errors(able, tuple(conditions)), 0
    for k in range(1, len(able)):
        risen = rises(able[best].fit.function, able[k].fit.function, dissipating, conditions)
        if risen or not smaller_wins(errors[best], errors[k]):
            best = k
    return replace(able[best].fit, refused=refused)


def _errors(fits: Sequence[_Fitted], conditions: tuple[Condition, ...]) -> list[Mapping[str, Floats]]:
    """(N,) cross-validation errors of the values, of every fit by kind of fold."""
    if len(fits) < 2:
        return [{} for _ in fits]
    residuals = np.array([fit.residual for fit in fits])
    bases = np.zeros((*residuals.shape, max(fit.basis.shape[1] for fit in fits)))
    for k, fit in enumerate(fits):
        bases[k, :, : fit.basis.shape[1]] = fit.basis
    penalty = np.array([[fit.penalty] for fit in fits])
    by_kind = {kind: penalty * _fold_errors(bases, residuals, *rows) for kind, rows in _folds(conditions).items()}
    return [{kind: errors[k] for kind, errors in by_kind.items()} for k in range(len(fits))]


def assess(function: ParameterFunction, conditions: Sequence[Condition], values: ArrayLike) -> FunctionFit:
    """Calculate the errors of a function from a global fit for values of individual fits."""
    target, fitted = np.asarray(values, dtype=float), function(*features(conditions))
    if function.log:
        target, fitted = np.log(target), np.log(fitted)
    return FunctionFit(function, explained_variance(target, fitted), left_out=float("nan"))


def require_determined(form: str, conditions: Sequence[Condition]) -> None:
    """Refuse a form without rates whose terms the conditions do not separate.

    Raises `IdentificationError`, also if the form has rates, which need a fit.
    """
    chosen = form_named(form)
    I, f, A = features(conditions)
    if chosen.rate_bounds:
        raise IdentificationError(f"{form} has rates to search", remedy="choose a form without")
    if len(conditions) < len(chosen.terms) or _fixed_columns(chosen, tuple(conditions)) is None:
        raise _undetermined(chosen, f"{counted(len(conditions), 'condition')} do not tell its terms apart", I, f, A)


def _best_rates(form: Form, I: Floats, f: Floats, A: Floats, target: Floats, weight: Floats) -> tuple[float, ...]:
    """Search the rates in their logarithm: a grid, then refinement from its three best points."""
    if not form.rate_bounds:
        return ()
    bounds = np.log(np.array(form.rate_bounds))
    lower, upper = bounds[:, 0], bounds[:, 1]
    right = target * weight

    last: tuple[Floats, Floats, Floats] = (np.empty(0), np.empty(0), np.empty(0))

    def fitted(u: Floats) -> tuple[Floats, Floats]:
        """Columns and coefficients at some rates; cached for the last, which residual and slopes share."""
        nonlocal last
        if not np.array_equal(last[0], u):
            columns = form.columns(I, f, A, tuple(np.exp(u))) * weight[:, None]
            last = u, columns, solve_linear(columns, right)
        return last[1:]

    def residual(u: Floats) -> Floats:
        columns, fit = fitted(u)
        return columns @ fit - right

    def slopes(u: Floats) -> Floats:
        columns, fit = fitted(u)
        return (form.slopes(columns, I, f, tuple(np.exp(u))) @ fit).T

    def products(u: Floats) -> tuple[Floats, Floats]:
        by_rate = slopes(u)
        return residual(u) @ by_rate, products_of_rest(fitted(u)[0], by_rate)  # coefficients move along [Kaufman 1975]

    grid: Floats = np.array(list(product(*np.linspace(lower, upper, 6).T)))
    tables = np.stack([form.columns(I, f, A, tuple(rates)) for rates in np.exp(grid)]) * weight[:, None]
    explained = np.sum((right @ np.linalg.qr(tables)[0]) ** 2, axis=-1)
    starts = grid[np.argsort(-explained, kind="stable")[:3]]
    fit = [least_squares(residual, u, lower, upper, most_steps=15, products=products) for u in starts]
    best = min(fit, key=lambda minimum: minimum.cost)
    settled = newton_refine(lambda u: residual(u) @ slopes(u), best.point, lower, upper)
    return tuple(np.exp(settled).tolist())


@lru_cache(maxsize=128)
def _fixed_columns(form: Form, conditions: tuple[Condition, ...]) -> Floats | None:
    """Terms of a form without rates, the same for every parameter; None if they are not separable."""
    columns = form.columns(*features(conditions), ())
    columns.flags.writeable = False
    return columns if _determined(columns) else None


def _solved(columns: Floats, target: Floats, weight: Floats, rates: int) -> tuple[Floats, float, Floats, Floats]:
    """Coefficients; weighted RMS of leave-one-out errors, exact for the linear part; basis and weighted residual."""
    weighted, right = columns * weight[:, None], target * weight
    scale = np.linalg.norm(weighted, axis=0)
    q, triangle = np.linalg.qr(weighted / scale)
    along = q.T @ right
    residual = right - q @ along
    spare = 1.0 - np.sum(q**2, axis=1)  # share of a value that the others determine
    left_out = float("inf")
    if spare.min() > _RANK_LIMIT:  # otherwise one value alone determines a term
        penalty = target.size / (target.size - rates)
        left_out = float(np.sqrt(np.sum((residual / spare) ** 2) / np.sum(weight**2)) * penalty)
    return np.linalg.solve(triangle, along) / scale, left_out, q, residual


@lru_cache(maxsize=128)
def _folds(conditions: tuple[Condition, ...]) -> dict[str, tuple[list[NDArray[np.intp]], NDArray[np.intp]]]:
    """Rows of the folds by kind, those of one size in one array (M, size), and the rows of all folds in order."""
    kinds = fold_groups(conditions)
    alike = {
        kind: [np.array([g for g in groups if len(g) == size]) for size in {len(group) for group in groups}]
        for kind, groups in kinds.items()
    }
    return {kind: (alike[kind], np.concatenate(groups)) for kind, groups in kinds.items()}


def _fold_errors(
    bases: Floats, residuals: Floats, groups: Sequence[NDArray[np.intp]], order: NDArray[np.intp]
) -> Floats:
    """(M, N) sizes of cross-validated errors of values omitted in groups, exact for the linear part by the hat matrix.

    Of M fits: (M, N, terms) bases, and (M, N) residuals.
    """
    errors = np.full(residuals.shape, np.inf)
    for rows in groups:
        own, left = bases[:, rows], residuals[:, rows]
        if rows.shape[1] == 1:
            share = 1.0 - np.sum(own[:, :, 0] ** 2, axis=2)
            missed, determined = left / np.where(share > _RANK_LIMIT, share, 1.0)[:, :, None], share > _RANK_LIMIT
        else:
            spare = np.eye(rows.shape[1]) - own @ own.transpose(0, 1, 3, 2)
            determined = np.linalg.eigvalsh(spare)[:, :, 0] > _RANK_LIMIT
            spare[~determined] = np.eye(rows.shape[1])
            missed = np.linalg.solve(spare, left[:, :, :, None])[:, :, :, 0]
        errors[:, rows] = np.where(determined[:, :, None], np.abs(missed), np.inf)
    return errors[:, order]


def _weights(uncertainty: ArrayLike | None, count: int) -> Floats:
    errors = np.full(count, np.inf) if uncertainty is None else np.asarray(uncertainty, dtype=float)
    finite = errors[np.isfinite(errors)]
    floor = float(np.quantile(finite, 0.25)) if finite.size else 0.0
    if not floor:
        return np.ones(count)
    return floor / np.maximum(np.where(np.isfinite(errors), errors, finite.max()), floor)


def _determined(columns: Floats) -> bool:
    scale = np.linalg.norm(columns, axis=0)
    if np.any(scale == 0):
        return False
    singular = np.linalg.svd(columns / scale, compute_uv=False)
    return bool(singular[-1] > _RANK_LIMIT * singular[0])


def _undetermined(form: Form, reason: str, I: Floats, f: Floats, A: Floats) -> IdentificationError:
    levels = [len(np.unique(np.round(column, 3))) for column in (I, f, 1e3 * A)]
    return IdentificationError(
        f"{form.name} has {len(form.terms) + len(form.rate_bounds)} coefficients and {reason}: "
        f"{levels[0]} currents, {levels[1]} frequencies, {levels[2]} amplitudes",
        remedy="test more conditions or choose a shorter form",
    )
