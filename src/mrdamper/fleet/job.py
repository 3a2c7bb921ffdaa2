"""Job of one damper: a pure function of its records, the settings and the plan of the population.

Its argument and result are JSON, so that it runs in this process, in a child process or on a cluster.
"""

from __future__ import annotations

import socket
import time
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Any

import numpy as np

from mrdamper.dampers.joint import JointFit, JointProblem
from mrdamper.data import Dataset, Floats, Run
from mrdamper.errors import InputError
from mrdamper.fleet.item import FleetError, Item, digest_of
from mrdamper.fleet.loops import by_test, deviation, gas_and_friction, measured_loop, shape_deviation, velocity_ladder
from mrdamper.fleet.plan import Plan
from mrdamper.identification.covariance import spread
from mrdamper.models import Model
from mrdamper.physics.motion import equivalent_sine
from mrdamper.statistics.linear import on_one_blas_thread
from mrdamper.study.usable_runs import accepted_runs, runs_for_global_fit, without_contradictions
from mrdamper.study.workflow import study_rig

VERSION = version("mrdamper")  # asked once: the answer takes a millisecond
OTHER_RIG = "W_OTHER_RIG"  # tested on another rig than most of the population: compared regardless
_KILLED, _READER_TRIES = "E_READER_KILLED", 8  # of a job whose reading process was killed
_PASSING = ("E_EXTRA", "E_FLEET_CHANGED", "E_CLUSTER_VERSION", _KILLED)
# One least squares without reweighting, searched to its end: the optimum is the same to 1e-6 from any near start.
_ROUNDS, _MAX_STEPS, _COST_TOLERANCE = 1, 40, 1e-8
_AVERAGED_SAMPLES = 4  # samples that are averaged for the standard errors
_DIFFERENCE_STEP = 1e-4  # of a search axis's coordinate, for slopes of parameters
_OUTLIER_DEVIATIONS = 6.0  # robust standard deviations from the population at which a damper is studied in full


@dataclass(frozen=True)
class Settings:
    """Settings that change a result and are part of its key."""

    model: str = "play-bypass"  # identified jointly from all runs of a damper
    rig_profile: str = ""  # of rig files, as TOML text
    cold: bool = False  # start every search from the model's start values, not from the plan


@on_one_blas_thread
def measure(job: dict[str, Any]) -> dict[str, Any]:
    """Calculate the row of one damper from a job of `as_job`; raises `InputError` if its records cannot be used."""
    begin = time.perf_counter(), time.process_time()
    if job["version"] != VERSION:
        raise FleetError(
            f"mrdamper {VERSION} here, {job['version']} where the fleet was started",
            where=socket.gethostname(), remedy="install the same version on every machine", code="E_CLUSTER_VERSION",
        )  # fmt: skip
    item = item_of(job)
    settings = Settings(**job["settings"])
    plan = None if job["plan"] is None else Plan(**job["plan"])
    if job["digest"] and digest_of(item) != job["digest"]:
        raise FleetError(
            "the records changed since the run began, or differ on this machine", where=item.paths[0],
            remedy="run the same command again", code="E_FLEET_CHANGED",
        )  # fmt: skip
    dataset, findings = read(item, settings)
    if plan is not None and plan.rig and dataset.rigs[0] != plan.rig:
        findings = (*findings, OTHER_RIG)
    row = {**_identify(dataset, settings, plan), "findings": " ".join(findings)}
    row["host_name"] = socket.gethostname()
    row["wall_time_s"] = time.perf_counter() - begin[0]
    row["cpu_time_s"] = time.process_time() - begin[1]
    return row


def attempt(job: dict[str, Any]) -> dict[str, Any]:
    """`measure`, with errors of the records as a row; repeated once if the reading process is killed."""
    row: dict[str, Any] = {}
    for _ in range(_READER_TRIES):
        try:
            return {"status": "done", "code": "", "reason": "", **measure(job)}
        except InputError as error:
            row = refused(error)
        if row["code"] != _KILLED:
            break
    return row


def refused(error: InputError) -> dict[str, Any]:
    """Write the row of a damper that cannot be used, or whose job failed."""
    # Neither is a property of the records.
    passing = error.code.startswith("E_JOB") or error.code in _PASSING
    return {"status": "failed" if passing else "refused", "code": error.code, "reason": str(error)}


def read(item: Item, settings: Settings) -> tuple[Dataset, tuple[str, ...]]:
    """Read the records of one damper, and codes of their findings; raises `InputError` unless they are of one rig."""
    findings: list[str] = []
    if item.kind == "lake":
        from mrdamper.fleet.parquet_folder import parquet_dataset

        dataset = parquet_dataset(item)
    elif item.kind == "dataset":
        from mrdamper.rig_files.dataset_folder import load_dataset

        dataset = load_dataset(item.paths[0])
        if item.picks:
            dataset = dataset.only([r for r in dataset if all(r.notes.get(c, "").strip() == x for c, x in item.picks)])
    else:
        from mrdamper.rig_files.profile import parse_profile
        from mrdamper.rig_files.rig_import import import_files, to_dataset

        result = import_files(item.paths, parse_profile(settings.rig_profile))
        findings += [refusal.error.code for refusal in result.refusals]
        for refusal in result.refusals:
            if refusal.error.code == _KILLED or not result.records:
                raise refusal.error
        dataset = to_dataset(result.records, item.serial)
    if len(dataset.rigs) > 1:
        raise FleetError(
            f"records of {len(dataset.rigs)} rigs: {', '.join(dataset.rigs)}", where=item.name, code="E_FLEET_RIGS",
            remedy="one damper is tested on one rig a session; state the session of each, or split it",
        )  # fmt: skip
    findings += [code for run in dataset for code in run.findings]
    return dataset, tuple(dict.fromkeys(findings))


def _identify(dataset: Dataset, settings: Settings, plan: Plan | None) -> dict[str, Any]:
    train = _usable(dataset)
    problem = JointProblem(train, settings.model, {} if plan is None else plan.held).determined()
    axes = tuple(axis.name for axis in problem.space.axes)
    lane = "reference" if plan is None else "cold" if settings.cold or axes != tuple(plan.axes) else "fast"
    start = np.array(plan.start) if plan is not None and lane == "fast" else None
    fit = _fit(problem, start)
    conditions = [equivalent_sine(run).condition for run in train]
    tests = [(c.current_A, c.frequency_Hz, c.amplitude_m) for c in conditions]
    loops = np.array([measured_loop(run) for run in train])
    more: dict[str, Any] = {}
    if plan is not None:
        # The measured loop of each test of the plan; None where the damper has no such test.
        own = [None if not like else np.mean(loops[like], axis=0) for like in by_test(tests, plan.matrix)]
        pairs = [(a, np.array(b)) for a, b in zip(own, plan.loops, strict=True) if a is not None]
        more["loop_deviation"] = max((deviation(*pair) for pair in pairs), default=0.0)
        more["shape_deviation"] = max((shape_deviation(*pair) for pair in pairs), default=0.0)
        if _stands_out(fit, more["loop_deviation"], plan):
            problem, lane = JointProblem(train, settings.model).determined(), "full"
            fit = _fit(problem, None)
            more |= _study(dataset)
        more |= _beside_the_line(fit, own, plan)
        if plan.draft:
            more |= {
                # a relevant change of each search axis
                "changes": [0.2 if axis.log else 0.05 * (axis.upper - axis.lower) for axis in problem.space.axes],
                "stands_for": [_stands_for(fit.damper.model, axis.name) for axis in problem.space.axes],
                "curvature": _curvature(problem, fit),
            }
    return {
        "rig": dataset.rigs[0],
        "lane": lane,
        "model": settings.model,
        "runs": len(train),
        "cost": float(np.sum(fit.nrmse_pp**2)),
        "nrmse_pp": float(np.median(fit.nrmse_pp)),
        "nrmse_pp_worst": float(np.max(fit.nrmse_pp)),
        "at_bounds": " ".join(fit.at_bounds),
        "parameters": dict(fit.damper.model.values()),
        "standard_errors": _standard_errors(problem, fit),
        "axes": axes,
        "point": fit.point.tolist(),
        "tests": tests,
        "loops": np.round(loops, 3).tolist(),
        **more,
    }


def _fit(problem: JointProblem, start: Floats | None) -> JointFit:
    return problem.fit(start=start, rounds=_ROUNDS, most_steps=_MAX_STEPS, settled=_COST_TOLERANCE)


def _beside_the_line(fit: JointFit, own: list[Floats | None], plan: Plan) -> dict[str, Any]:
    """Calculate forces at the population's velocities, and the loops of its tests."""
    ladder = velocity_ladder(fit.damper.model, plan.currents, plan.speeds, plan.amplitude)
    gas, friction = gas_and_friction(ladder, plan.speeds)
    return {
        "ladder": ladder.ravel().tolist(),
        "gas_force_N": gas,
        "friction_N": friction,
        "tests_missing": sum(loop is None for loop in own),
        "loops": [None if loop is None else np.round(loop, 3).tolist() for loop in own],
    }


def _curvature(problem: JointProblem, fit: JointFit) -> list[list[float]]:
    """Second derivatives of the squared error along the search axes, linear parameters following, over that error."""
    linearised = problem.linearised(fit)
    residual, jacobian = linearised.residual, linearised.jacobian
    own, linear = np.split(jacobian, [len(problem.space.axes)], axis=1)
    own = own - linear @ np.linalg.lstsq(linear, own, rcond=1e-10)[0]
    return (own.T @ own / (residual @ residual)).tolist()


def _standard_errors(problem: JointProblem, fit: JointFit) -> dict[str, float]:
    """Estimate standard errors of the parameters that the records of this damper determine, given the held ones."""
    linearised = problem.linearised(fit)
    residual, jacobian = linearised.residual, linearised.jacobian
    model, held = fit.damper.model, set(fit.at_bounds)
    values = model.values()
    slopes = np.zeros((len(values), jacobian.shape[1]))
    axes = [axis for axis in problem.space.axes if hasattr(model, axis.name)]
    point = list(zip(problem.space.axes, fit.point.tolist(), strict=True))
    own = {axis.name: axis.value(u) for axis, u in point if axis in axes}
    for i, (axis, u) in enumerate(point):
        if axis in axes:
            step = _DIFFERENCE_STEP if axis.value(u + _DIFFERENCE_STEP) <= axis.upper else -_DIFFERENCE_STEP
            moved = type(model).build({**values, **own, axis.name: axis.value(u + step)}).values()
            slopes[:, i] = [(moved[name] - values[name]) / step for name in values]
    for i, info in enumerate(problem.space.linear):
        slopes[list(values).index(info.name), len(problem.space.axes) + i] = 1.0
    # Errors that are correlated over several samples dominate the standard errors.
    kept = residual.size // _AVERAGED_SAMPLES * _AVERAGED_SAMPLES
    means = (a[:kept].reshape(-1, _AVERAGED_SAMPLES, *a.shape[1:]).mean(axis=1) for a in (jacobian, residual))
    covariance = spread(*means).covariance
    errors = {}
    for name, slope in zip(values, slopes, strict=True):
        of = np.flatnonzero(slope)
        variance = float(slope[of] @ covariance[np.ix_(of, of)] @ slope[of])
        if of.size and name not in held and 0 < variance < np.inf:
            errors[name] = float(np.sqrt(variance))
    return errors


def _stands_for(model: Model, axis: str) -> list[str]:
    """Parameters that a search axis is made of: one by its name, or those of a ratio."""
    values = model.values()
    if axis in values or not hasattr(model, axis):
        return [axis]
    own = getattr(model, axis)
    return [name for name, value in values.items() if getattr(replace(model, **{name: 0.9 * value}), axis) != own]


def _study(dataset: Dataset) -> dict[str, Any]:
    try:
        chosen = study_rig(dataset).chosen
    except InputError as error:
        return {"study": str(error)}
    return {"study": chosen.title, "study_cv_nrmse_pp": float(chosen.cross_validated.median())}


def _usable(dataset: Dataset) -> list[Run]:
    """Return the identification runs that are accepted, agree and move; raise the first cause if there is none."""
    agreed, comparison = without_contradictions(dataset.only(dataset.split("train")))
    kept, refused = accepted_runs(agreed)
    refused |= {one.run_id: str(one) for one in comparison.contradictions}
    runs, unusable = runs_for_global_fit(kept)
    if runs:
        return runs
    why = next(iter({**refused, **unusable}.values()), "no identification run; check the column split")
    raise FleetError(why, where=dataset.name, code="E_FLEET_EMPTY")


def _stands_out(fit: JointFit, away: float, plan: Plan) -> bool:
    if plan.draft:
        return False
    poor = float(np.median(fit.nrmse_pp)) > plan.error + _OUTLIER_DEVIATIONS * max(plan.error_spread, 0.1 * plan.error)
    odd = away > plan.deviation + _OUTLIER_DEVIATIONS * max(plan.deviation_spread, 0.5 * plan.deviation)
    return bool(poor or odd or not fit.ending.converged)


def as_job(item: Item, digest: str, settings: Settings, plan: Plan | None) -> dict[str, Any]:
    """Write the argument of `measure`."""
    return {
        "item": {k: v for k, v in vars(item).items() if k != "error"},
        "digest": digest,
        "version": VERSION,
        "settings": vars(settings),
        "plan": None if plan is None else plan.document,
    }


def item_of(job: dict[str, Any]) -> Item:
    """Read the item of a job that came as JSON."""
    fields: dict[str, Any] = {**job["item"], "paths": tuple(job["item"]["paths"])}
    fields |= {name: tuple(map(tuple, fields[name])) for name in ("rows", "picks")}
    return Item(**fields)
