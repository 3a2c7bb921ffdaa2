"""One identification over all runs at once, for models whose loop has one shape coordinate.

Given the shape coordinate (the yield displacement), a run's squared error is a quadratic
form in the linear parameters. Each run is therefore condensed once into small Gram matrices
on a ladder of shape values; after that, fits over all runs, other parameter functions and
leave-one-condition-out cost milliseconds, because no sample is touched again.

Runs count by their own force scale, and the sum of run RMSEs is minimised, not of squares:
a run from a drifting session then pulls less (iteratively reweighted least squares).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import IdentificationError
from mrdamper.functions.fitting import fit_function, require_determined
from mrdamper.functions.forms import FORMS, ParameterFunction, features
from mrdamper.hysteresis import Shape
from mrdamper.hysteresis.batch import follow_alike
from mrdamper.identification import Problem
from mrdamper.models import Model, Scale
from mrdamper.optimizers.levenberg_marquardt import least_squares
from mrdamper.optimizers.linear import on_one_blas_thread, robust_weights, solve_linear

_RUNG = 1500 ** (1 / 40)  # from one yield displacement to the next; between them Gram matrices are interpolated
_LATTICE = 2e-6  # m, one of the rungs, whatever the data
_SHORTEST = 5e-4  # yield displacement looked for, in the smallest amplitude; the longest is the largest amplitude
_AT_ONCE = 2**17  # states held at a time
_SETTLED = 1e-6  # relative gain of a step at which a search ends
_SAME_WEIGHTS = 1e-3  # change of the robust weights below which another round changes nothing
_BEST = 1e-4  # nrmse_pp below which a run gains no more weight
_RIDGE = 1e-7  # interpolated Gram matrices of nearly parallel columns may lose positivity by less


@dataclass(frozen=True, eq=False)
class Condensed:
    """Runs of one rig, condensed for one model type.

    Attributes
    ----------
    model_type : type of Model
    linear : tuple of str
        Coordinates the force is linear in, in the order of the Gram matrices.
    shape : str
        The one shape coordinate.
    run_ids : tuple of str, length R
    conditions : tuple of Condition, length R
    scale : (R,) array
        Peak-to-peak force [N].
    ladder : (K,) array
        Values of the shape coordinate, evenly in the logarithm.
    gram : (R, K, L+1, L+1) array
        Mean products of the columns and, last, the measured force over its peak-to-peak
        value, at each value of the ladder.
    """

    model_type: type[Model]
    linear: tuple[str, ...]
    shape: str
    run_ids: tuple[str, ...]
    conditions: tuple[Condition, ...]
    scale: Floats
    ladder: Floats
    gram: Floats

    def only(self, rows: Sequence[int]) -> Condensed:
        """The same for some of the runs."""
        index = list(rows)
        return replace(
            self,
            run_ids=tuple(self.run_ids[i] for i in index),
            conditions=tuple(self.conditions[i] for i in index),
            scale=self.scale[index],
            gram=self.gram[index],
        )

    def at(self, shape_values: Floats) -> Floats:
        """(R, L+1, L+1) Gram matrices at one shape value a run: cubic in its logarithm."""
        size = self.ladder.size
        logs = np.log(self.ladder)
        u = np.clip((np.log(shape_values) - logs[0]) / (logs[1] - logs[0]), 0, size - 1)
        first = np.clip(np.floor(u).astype(int) - 1, 0, size - 4)
        t = u - first
        weights = np.stack(
            [
                -(t - 1) * (t - 2) * (t - 3) / 6,
                t * (t - 2) * (t - 3) / 2,
                -t * (t - 1) * (t - 3) / 2,
                t * (t - 1) * (t - 2) / 6,
            ]
        )
        nodes = self.gram[np.arange(t.size)[:, None], first[:, None] + np.arange(4)]  # (R, 4, L+1, L+1)
        return np.einsum("jr,rjkl->rkl", weights, nodes)


@on_one_blas_thread
def condense(runs: Sequence[Run], model_type: type[Model]) -> Condensed:
    """Condense runs for a model type whose search has one axis.

    Raises
    ------
    IdentificationError
        If the model has no such single axis, or there are no runs.
    """
    if not runs:
        raise IdentificationError("no runs", mend="give at least one")
    problems = [Problem.of(run, model_type) for run in runs]
    axes = model_type.search_axes(Scale(1.0, 1.0), problems[0].free)
    coordinates = tuple(model_type.map_forms())
    if len(axes) > 1 or not {axis.name for axis in axes} <= set(coordinates):
        raise IdentificationError(
            f"{model_type.title} is searched along {len(axes)} axes", mend="fix all shape parameters but one"
        )
    shape = axes[0].name if axes else ""
    linear = tuple(name for name in coordinates if name != shape)
    conditions = tuple(problem.analysis.condition for problem in problems)
    ladder = _ladder([c.amplitude_m for c in conditions]) if shape else np.geomspace(1.0, 8.0, 4)
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
    )


def _ladder(amplitudes: Sequence[float]) -> Floats:
    """Rungs [m] from far inside the smallest amplitude to the largest."""
    low, high = (np.log(v / _LATTICE) / np.log(_RUNG) for v in (_SHORTEST * min(amplitudes), max(amplitudes)))
    return _LATTICE * _RUNG ** np.arange(np.floor(low), np.ceil(high) + 1)


def _gram(problem: Problem, linear: tuple[str, ...], shape: str, ladder: Floats) -> Floats:
    target = problem.force / np.ptp(problem.force)
    if not shape:
        table, _ = _columns(problem, linear, {})
        table = np.column_stack([table, target])
        return np.stack([table.T @ table / target.size] * ladder.size)
    table, bare = _columns(problem, linear, {shape: float(ladder[0])})
    if bare.shape is not None and "yield_force" in linear:  # its column is zeta, the only one the ladder changes
        table = np.column_stack([table, target])
        return _gram_of_shapes(problem, table, linear.index("yield_force"), bare.shape, ladder)
    tables = [np.column_stack([_columns(problem, linear, {shape: float(v)})[0], target]) for v in ladder]
    return np.stack([table.T @ table / target.size for table in tables])


def _columns(problem: Problem, linear: tuple[str, ...], shape: Mapping[str, float]) -> tuple[Floats, Model]:
    """(N, L) force per unit of every linear coordinate, and the model without them."""
    point = {**problem.fixed, **shape, **dict.fromkeys(linear, 0.0)}
    bare = problem.model_type.build(point)
    state = bare.state(problem.motion)[problem.scored]
    base = bare.force(problem.seen, state)
    columns = [problem.model_type.build({**point, name: 1.0}).force(problem.seen, state) - base for name in linear]
    return np.column_stack(columns), bare


def _gram_of_shapes(problem: Problem, table: Floats, moving: int, shape: Shape, ladder: Floats) -> Floats:
    """The same matrices, all shapes followed at once; only the rows of the moving column differ."""
    grams = np.stack([table.T @ table] * ladder.size)
    few = max(1, _AT_ONCE // len(problem.motion))
    for begin in range(0, ladder.size, few):
        part = slice(begin, begin + few)
        zeta = follow_alike(shape.n, float(shape.rho), 1 / ladder[part], problem.motion.path)[:, problem.scored]
        grams[part, moving, :] = grams[part, :, moving] = zeta @ table
        grams[part, moving, moving] = np.einsum("kn,kn->k", zeta, zeta)
    return grams / len(table)


@dataclass(frozen=True, eq=False)
class JointFit:
    """A parameter map fitted to all runs at once.

    Attributes
    ----------
    parameters : ParameterMap
    nrmse_pp : (R,) array
        Error of each run (of the condensed runs; the linear parameters unbounded).
    at_bounds : tuple of str
        The shape coordinate, where its function leaves what was looked for.
    """

    parameters: ParameterMap
    nrmse_pp: Floats
    at_bounds: tuple[str, ...] = ()


@on_one_blas_thread
def fit_jointly(
    data: Condensed,
    forms: Mapping[str, str],
    start: ParameterFunction | None,
    *,
    reweightings: int = 6,
    most_steps: int = 12,
) -> JointFit:
    """Fit the coefficients of all parameter functions to all runs at once.

    Parameters
    ----------
    data : Condensed
    forms : mapping of str to str
        Form of each coordinate.
    start : ParameterFunction or None
        Of the shape coordinate, to start from; its form and rates are used. None for models
        without one.
    reweightings, most_steps : int
        Effort: rounds of robust weights, steps of the search in each.
    """
    design = _Design(data, forms)
    if start is None:
        solution = _reweighted(design, data.at(np.full(data.scale.size, data.ladder[0])), reweightings)
        return _finish(design, solution, {})
    columns = FORMS[start.form].columns(*features(data.conditions), start.rates)
    scale = np.linalg.norm(columns, axis=0) / np.sqrt(columns.shape[0])

    def shape_values(u: Floats) -> Floats:
        return np.exp(np.clip(columns @ (u / scale), np.log(data.ladder[0]), np.log(data.ladder[-1])))

    centre = np.array(start.coefficients) * scale
    reach = np.full(centre.size, 6.0)
    weights = np.ones(data.scale.size)
    solution = design.solve(data.at(shape_values(centre)), weights)
    for _ in range(reweightings):

        def residual(u: Floats, weights: Floats = weights) -> Floats:
            return design.solve(data.at(shape_values(u)), weights).residual

        found = least_squares(residual, centre, centre - reach, centre + reach, most_steps, _SETTLED)
        centre = found.point
        solution = design.solve(data.at(shape_values(centre)), weights)
        before, weights = weights, robust_weights(solution.nrmse_pp, _BEST)
        if np.max(np.abs(weights / before - 1)) < _SAME_WEIGHTS:
            break
    function = ParameterFunction(start.form, tuple((centre / scale).tolist()), start.rates, log=True)
    made = _finish(design, solution, {data.shape: function})
    reached, ends = shape_values(centre), data.ladder[[0, -1]]
    outside = np.any((reached <= ends[0] * _RUNG**0.01) | (reached >= ends[1] / _RUNG**0.01))
    return replace(made, at_bounds=(data.shape,)) if outside else made


@on_one_blas_thread
def leave_out_errors(
    data: Condensed, fit: JointFit, groups: Sequence[Sequence[int]], forms: Mapping[str, str]
) -> Floats:
    """(R,) nrmse_pp of runs whose group was left out of the linear coefficients.

    The shape function stays that of the whole fit: quick, for choosing forms, not a final score.
    """
    design = _Design(data, forms)
    shapes = (
        fit.parameters.functions[data.shape](*features(data.conditions))
        if data.shape
        else np.full(data.scale.size, data.ladder[0])
    )
    table = design.table(data.at(shapes))
    weights = robust_weights(fit.nrmse_pp, _BEST)
    errors = np.zeros(data.scale.size)
    for group in groups:
        kept = weights.copy()
        kept[list(group)] = 0.0
        solution = _solve(table, kept)
        errors[list(group)] = solution.nrmse_pp[list(group)]
    return errors


@dataclass(frozen=True)
class _Solution:
    coefficients: Floats
    residual: Floats
    nrmse_pp: Floats


class _Design:
    """Linear coordinates of every run as a matrix times the coefficients of all functions."""

    def __init__(self, data: Condensed, forms: Mapping[str, str]):
        self.data = data
        self.forms = {name: FORMS[forms[name]] for name in data.linear}
        blocks = [form.columns(*features(data.conditions), ()) for form in self.forms.values()]
        self.sizes = [block.shape[1] for block in blocks]
        runs, total = data.scale.size, sum(self.sizes)
        self.matrix = np.zeros((runs, len(blocks) + 1, total + 1))
        at = 0
        for row, block in enumerate(blocks):
            # The Gram matrices hold forces over each run's peak-to-peak value.
            self.matrix[:, row, at : at + block.shape[1]] = block / data.scale[:, None]
            at += block.shape[1]
        self.matrix[:, -1, -1] = 1.0

    def table(self, gram: Floats) -> Floats:
        """(R, L+1, P+1) rows that stand for a run's samples: by coefficient and, last, the measured force."""
        size = np.sqrt(np.maximum(np.einsum("rii->ri", gram), 1e-300))
        scaled = gram / size[:, :, None] / size[:, None, :]
        factor = _factor(scaled + _RIDGE * np.eye(gram.shape[1])) * size[:, None, :]
        return np.asarray(factor @ self.matrix, dtype=float)

    def solve(self, gram: Floats, weights: Floats) -> _Solution:
        """Coefficients of least weighted squares; residuals are those of the condensed runs."""
        return _solve(self.table(gram), weights)


def _solve(table: Floats, weights: Floats) -> _Solution:
    weighted = (weights[:, None, None] * table).reshape(-1, table.shape[2])
    solution = solve_linear(weighted[:, :-1], weighted[:, -1], rank_limit=1e-10)
    error = table[:, :, :-1] @ solution - table[:, :, -1]
    return _Solution(solution, (weights[:, None] * error).ravel(), np.sqrt(np.sum(error**2, axis=1)))


def _factor(gram: Floats) -> Floats:
    """(R, K, K) matrices T with Tᵀ T the given ones, or the nearest that have such."""
    try:
        return np.asarray(np.linalg.cholesky(gram).transpose(0, 2, 1), dtype=float)
    except np.linalg.LinAlgError:  # a model that fits to rounding: interpolation took more than the ridge gave
        values, vectors = np.linalg.eigh(gram)
        return np.asarray(np.sqrt(np.maximum(values, _RIDGE))[:, :, None] * vectors.transpose(0, 2, 1), dtype=float)


def _reweighted(design: _Design, gram: Floats, reweightings: int) -> _Solution:
    weights = np.ones(gram.shape[0])
    solution = design.solve(gram, weights)
    for _ in range(reweightings):
        weights = robust_weights(solution.nrmse_pp, _BEST)
        solution = design.solve(gram, weights)
    return solution


def _finish(design: _Design, solution: _Solution, functions: dict[str, ParameterFunction]) -> JointFit:
    parts = np.split(solution.coefficients, np.cumsum(design.sizes)[:-1])
    for (name, form), values in zip(design.forms.items(), parts, strict=True):
        functions[name] = ParameterFunction(form.name, tuple(values.tolist()))
    ordered = {name: functions[name] for name in design.data.model_type.map_forms()}
    return JointFit(ParameterMap(design.data.model_type, ordered), solution.nrmse_pp)


def choose_forms(
    data: Condensed, candidates: Mapping[str, Sequence[str]], groups: Sequence[Sequence[int]], shape_values: Floats
) -> tuple[dict[str, str], JointFit]:
    """Choose every coordinate's form by how well left-out conditions are predicted.

    Starting from the shortest forms, one coordinate at a time tries its candidates; a change
    must lower the mean left-out error by a fiftieth. Two passes.

    Parameters
    ----------
    data : Condensed
    candidates : mapping of str to sequence of str
        Forms by coordinate, shortest first.
    groups : sequence of sequences of int
        Runs that are left out together.
    shape_values : (R,) array
        Shape coordinate identified run by run, to start from.

    Returns
    -------
    forms : dict
    fit : JointFit
    """
    forms = {name: options[0] for name, options in candidates.items()}
    fit, best = _tried(data, forms, groups, shape_values)
    for _ in range(2):
        before = dict(forms)
        for name, options in candidates.items():
            for option in options:
                if option == forms[name]:
                    continue
                try:
                    trial_fit, error = _tried(data, {**forms, name: option}, groups, shape_values)
                except IdentificationError:
                    continue  # the tests cannot tell this form's terms apart
                if error < 0.98 * best:
                    forms, fit, best = {**forms, name: option}, trial_fit, error
        if forms == before:
            break
    return forms, fit_jointly(data, forms, fit.parameters.functions.get(data.shape))


def _tried(
    data: Condensed, forms: Mapping[str, str], groups: Sequence[Sequence[int]], shape_values: Floats
) -> tuple[JointFit, float]:
    for name in data.linear:
        require_determined(forms[name], data.conditions)
    start = fit_function(forms[data.shape], data.conditions, shape_values, log=True).function if data.shape else None
    fit = fit_jointly(data, forms, start, reweightings=2, most_steps=5)
    return fit, float(np.mean(leave_out_errors(data, fit, groups, forms)))
