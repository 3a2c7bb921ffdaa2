"""Uncertainty of the parameters of one identified run, and parameters that its motion cannot determine."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mrdamper.data import Floats
from mrdamper.identification.columns import linear_table
from mrdamper.identification.covariance import ParameterCovariance, spread
from mrdamper.identification.intervals import weaknesses
from mrdamper.identification.problem import DELAY, Problem, RunUncertainty, Solution
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.statistics.linear import on_one_blas_thread

_DIFFERENCE_STEP = 1e-6  # relative step of a coordinate, for derivatives
_NOISE_FACTOR = 4.0  # factor of the part of noise that the columns of an absent hysteresis absorb
_AT_LEAST = 20.0  # independent samples that any record of a cycle has at least in this test
_MIN_LAGS = 3.0  # correlation times of its residual below which a record does not determine its noise


@on_one_blas_thread
def uncertainty_of_run(
    problem: Problem, solution: Solution, motion: Excitation, state: Floats, residual: Floats
) -> RunUncertainty:
    """Differentiate the force by each free coordinate; those at a bound have no error.

    `motion`: with the delay that was found; `state` (N,): of the solution inside the scored samples; `residual` (N,):
    predicted minus measured force there [N].
    """
    point, names, columns = _sensitivities(problem, solution, motion, state, residual)
    if not columns:
        return RunUncertainty()
    condition = problem.analysis.condition
    estimate = spread(np.column_stack(columns), residual, motion.part(problem.scored).time, condition.frequency_Hz)
    errors, dof, effective = (
        dict(zip(names, v.tolist(), strict=True)) for v in (estimate.errors, estimate.dof, estimate.effective)
    )
    for name, (variance, seen_by) in _of_parameters(problem, point, names, estimate.covariance).items():
        errors[name] = math.sqrt(variance)
        dof[name], effective[name] = (min(values[n] for n in seen_by) for values in (dof, effective))
    shown = {name: error for name, error in errors.items() if name != DELAY}
    doubts = weaknesses(names, estimate.covariance, estimate.alike, [condition])
    if unseen := _unseen(problem, names, np.column_stack(columns), residual, estimate):
        doubts = [f"no yielding in this motion: {', '.join(unseen)} not identifiable", *doubts]
        shown |= {name: float("inf") for name in shown if name in unseen or name not in problem.free}
    if estimate.memory < _MIN_LAGS and np.any(residual):
        doubts.append(
            f"the record is only {estimate.memory:.1f} times the correlation time of its noise: "
            "the intervals are rough, record longer"
        )
    return RunUncertainty(shown, dof, {name: effective[name] for name in shown}, tuple(doubts))


def _unseen(
    problem: Problem, names: Sequence[str], columns: Floats, residual: Floats, errors: ParameterCovariance
) -> list[str]:
    """Parameters of the hysteresis where the other columns alone explain the force as well [Davies 1987].

    Both fits determine every linear parameter again, because a method that computes some of them in closed form has a
    larger residual, independent of the motion.
    """
    hysteretic = problem.model_type.state_column
    searched = [i.name for i in problem.model_type.parameters() if i.name in problem.free and not i.linear]
    if hysteretic is None or hysteretic not in names or not searched:
        return []
    linear = {info.name for info in problem.model_type.parameters() if info.linear}
    others = columns[:, [i for i, name in enumerate(names) if name in linear and name != hysteretic]]
    table = np.column_stack([others, np.ones(len(others))])
    place = list(names).index(hysteretic)
    without, whole = (
        problem.force - some @ np.linalg.lstsq(some, problem.force, rcond=None)[0]
        for some in (table, np.column_stack([table, columns[:, place]]))
    )
    independent = max(float(errors.effective[place]), _AT_LEAST)
    least = min(float(residual @ residual), float(whole @ whole))
    gain = float(without @ without) / max(least, np.finfo(float).tiny) - 1
    return searched if gain < _NOISE_FACTOR * (1 + len(searched)) / independent else []


def _sensitivities(
    problem: Problem, solution: Solution, motion: Excitation, state: Floats, residual: Floats
) -> tuple[dict[str, float], list[str], list[Floats]]:
    """Calculate the point, its free coordinates, and derivatives of the force by them."""
    scored = motion.part(problem.scored)
    linear = {i.name: getattr(solution.model, i.name) for i in solution.model.parameters() if i.linear}
    searched = {name: value for name, value in solution.end.items() if name != DELAY}
    point = {**problem.fixed, **searched, **linear}
    names = [n for n in (*linear, *searched) if (n in problem.free or n in searched) and n not in solution.at_bounds]
    infos = [info for info in solution.model.parameters() if info.name in names and info.name in linear]
    bare = replace(solution.model, **{info.name: 0.0 for info in infos})
    linear_columns = dict(
        zip([info.name for info in infos], linear_table(bare, infos, scored, state)[1].T, strict=True)
    )
    base = residual + problem.force
    columns: list[Floats] = []
    for name in names:
        if name in linear_columns:
            columns.append(linear_columns[name])
            continue
        step = _DIFFERENCE_STEP * abs(point[name]) or _DIFFERENCE_STEP
        moved = problem.model_type.build({**point, name: point[name] + step})
        columns.append((moved.force(scored, moved.state(motion)[problem.scored]) - base) / step)
    if DELAY in solution.end and DELAY not in solution.at_bounds:
        names.append(DELAY)
        columns.append(-np.gradient(base, scored.time))
    return point, names, columns


def _of_parameters(
    problem: Problem, point: Mapping[str, float], names: Sequence[str], covariance: Floats
) -> dict[str, tuple[float, list[str]]]:
    """Variances of parameters that are searched in other coordinates, as beta in the yield displacement, and these."""
    missing = [name for name in problem.free if name not in names]
    searched = [i for i, name in enumerate(names) if name in point and name not in problem.free]
    if not missing or not searched:
        return {}
    at = problem.model_type.build(point)
    slopes = np.zeros((len(missing), len(searched)))
    for k, i in enumerate(searched):
        step = _DIFFERENCE_STEP * abs(point[names[i]]) or _DIFFERENCE_STEP
        moved = problem.model_type.build({**point, names[i]: point[names[i]] + step})
        slopes[:, k] = [(getattr(moved, name) - getattr(at, name)) / step for name in missing]
    block, errors = covariance[np.ix_(searched, searched)], dict[str, tuple[float, list[str]]]()
    for name, row in zip(missing, slopes, strict=True):
        if (used := row != 0).any():
            variance = float(row[used] @ block[np.ix_(used, used)] @ row[used])
            seen_by = [names[i] for i, u in zip(searched, used, strict=True) if u]
            errors[name] = variance if np.isfinite(variance) else np.inf, seen_by
    return errors
