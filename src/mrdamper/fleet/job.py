"""What is done for one damper: a pure function of its records, the settings and the line's plan.

It speaks JSON on both sides, so that it runs here, in a process that can be killed, or on a cluster.
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from mrdamper.dampers.joint import JointFit, JointProblem
from mrdamper.data import Condition, Dataset, Floats, Run
from mrdamper.errors import InputError
from mrdamper.fleet.items import FleetError, Item, digest_of
from mrdamper.motion import equivalent_sine

ROUNDS = 1  # no reweighting: the optimum is then that of one least squares, whatever the search starts from
_SPEED_STEPS = (0.25, 0.5, 0.75, 1.0)  # of the velocity ladder, over the line's highest test speed


@dataclass(frozen=True)
class Settings:
    """What changes a result, and so belongs to the key it is kept under.

    Attributes
    ----------
    model : str
        Identified jointly from all runs of a damper.
    rig_profile : str
        Of rig files, as TOML text.
    """

    model: str = "play-bypass"
    rig_profile: str = ""


@dataclass(frozen=True)
class Plan:
    """What a line's reference dampers say: where to start, what to compare with.

    Made once from dampers that depend on the serial numbers alone and kept in the journal, so
    that no result depends on the order in which dampers are finished.

    Attributes
    ----------
    start, spread : tuple of float
        Median of the search axes, and 1.48 times the median deviation from it.
    axes : tuple of str
    error, error_spread : float
        The same of the median nrmse_pp.
    conditions : tuple of (current [A], frequency [Hz], amplitude [m])
        The line's test matrix.
    speeds : tuple of float
        Velocity ladder [m/s].
    references : tuple of str
        Serial numbers it was made from.
    """

    start: tuple[float, ...]
    spread: tuple[float, ...]
    axes: tuple[str, ...]
    error: float
    error_spread: float
    conditions: tuple[tuple[float, float, float], ...]
    speeds: tuple[float, ...]
    references: tuple[str, ...] = field(default=())


def measure(job: dict[str, Any]) -> dict[str, Any]:
    """The row of one damper; `job` holds an item, its digest, settings and the plan, if there is one.

    Raises
    ------
    InputError
        If its records cannot be used.
    """
    begin = time.perf_counter(), time.process_time()
    item = item_of(job)
    settings = Settings(**job["settings"])
    plan = None if job["plan"] is None else Plan(**job["plan"])
    if job["digest"] and digest_of(item) != job["digest"]:
        raise FleetError(
            "the records changed since the run began, or differ on this machine", where=item.paths[0],
            mend="run the same command again", code="E_FLEET_CHANGED",
        )  # fmt: skip
    dataset, findings = read(item, settings)
    row = {**_identify(dataset, settings, plan), "findings": " ".join(findings)}
    row["wall_time_s"] = time.perf_counter() - begin[0]
    row["cpu_time_s"] = time.process_time() - begin[1]
    return row


def attempt(job: dict[str, Any]) -> dict[str, Any]:
    """`measure`, with what is wrong with the records as a row too."""
    try:
        return {"status": "done", "code": "", "reason": "", **measure(job)}
    except InputError as error:
        return refused(error)


def refused(error: InputError) -> dict[str, Any]:
    """The row of a damper that cannot be used, or whose job failed."""
    # Neither says anything about the records that would be true the next time.
    passing = error.code.startswith("E_JOB") or error.code in ("E_EXTRA", "E_FLEET_CHANGED")
    return {"status": "failed" if passing else "refused", "code": error.code, "reason": str(error)}


def read(item: Item, settings: Settings) -> tuple[Dataset, tuple[str, ...]]:
    """The records of one damper, and the codes of what was found in them.

    Raises
    ------
    InputError
        If they cannot be read, or come from several rigs.
    """
    findings: list[str] = []
    if item.kind == "lake":
        from mrdamper.fleet.lake import lake_dataset

        dataset = lake_dataset(item)
    elif item.kind == "dataset":
        from mrdamper.files.dataset import load_dataset

        dataset = load_dataset(item.paths[0])
        if item.column:
            dataset = dataset.only([r for r in dataset if r.notes.get(item.column, "").strip() == item.serial])
    else:
        from mrdamper.rig_files.profile import parse_profile
        from mrdamper.rig_files.rig_import import import_files, to_dataset

        result = import_files(item.paths, parse_profile(settings.rig_profile))
        findings += [refusal.error.code for refusal in result.refusals]
        if not result.records:
            raise result.refusals[0].error
        dataset = to_dataset(result.records, item.serial)
    if len(dataset.rigs) > 1:
        raise FleetError(
            f"records of {len(dataset.rigs)} rigs: {', '.join(dataset.rigs)}", where=item.name, code="E_FLEET_RIGS",
            mend="one damper is tested on one rig a session; state the session of each, or split it",
        )  # fmt: skip
    findings += [code for run in dataset for code in run.findings]
    return dataset, tuple(dict.fromkeys(findings))


def _identify(dataset: Dataset, settings: Settings, plan: Plan | None) -> dict[str, Any]:
    train = _usable(dataset)
    problem = JointProblem(train, settings.model)
    start = None if plan is None else np.array(plan.start)
    fit = problem.fit(start=start, rounds=ROUNDS)
    lane = "fast" if plan is not None else "reference"
    if plan is not None and _stands_out(fit, plan):
        cold = problem.fit(rounds=ROUNDS)
        fit, lane = min(fit, cold, key=lambda f: float(np.sum(f.nrmse_pp**2))), "full"
    conditions = [equivalent_sine(run).condition for run in train]
    row: dict[str, Any] = {
        "rig": dataset.rigs[0],
        "lane": lane,
        "model": settings.model,
        "runs": len(train),
        "nrmse_pp": float(np.median(fit.nrmse_pp)),
        "nrmse_pp_worst": float(np.max(fit.nrmse_pp)),
        "at_bounds": " ".join(fit.at_bounds),
        "parameters": dict(fit.damper.model.values()),
        "point": fit.point.tolist(),
        "axes": [axis.name for axis in problem.axes],
        "conditions": [(c.current_A, c.frequency_Hz, c.amplitude_m) for c in conditions],
    }
    return row


def _usable(dataset: Dataset) -> list[Run]:
    """Train runs with a steady motion; a damper with none raises what was wrong with the first."""
    runs, first = [], None
    for run in dataset.split("train"):
        try:
            equivalent_sine(run)
            runs.append(run)
        except InputError as error:
            first = first or error
    if runs:
        return runs
    raise first or FleetError("no train run", where=dataset.name, mend="check the column split", code="E_FLEET_EMPTY")


def _stands_out(fit: JointFit, plan: Plan) -> bool:
    """Whether a damper lies so far from the line that its search should begin from nothing."""
    away = np.abs(fit.point - np.array(plan.start)) > 6 * np.maximum(np.array(plan.spread), 0.05)
    poor = float(np.median(fit.nrmse_pp)) > plan.error + 6 * max(plan.error_spread, 0.1 * plan.error)
    return bool(away.any() or poor or not fit.ending.converged)


def make_plan(rows: dict[str, dict[str, Any]]) -> Plan:
    """The plan from the rows of the reference dampers by name."""
    points = np.array([row["point"] for row in rows.values()])
    errors = np.array([row["nrmse_pp"] for row in rows.values()])
    matrix = _matrix([tuple(c) for row in rows.values() for c in row["conditions"]], len(rows))
    top = max(Condition(*c).peak_velocity for c in matrix)
    return Plan(
        start=_median(points),
        spread=_spread(points),
        axes=tuple(next(iter(rows.values()))["axes"]),
        error=float(np.median(errors)),
        error_spread=float(1.4826 * np.median(np.abs(errors - np.median(errors)))),
        conditions=matrix,
        speeds=tuple(float(f"{step * top:.2g}") for step in _SPEED_STEPS),
        references=tuple(rows),
    )


def _median(points: Floats) -> tuple[float, ...]:
    return tuple(np.median(points, axis=0).tolist())


def _spread(points: Floats) -> tuple[float, ...]:
    return tuple((1.4826 * np.median(np.abs(points - np.median(points, axis=0)), axis=0)).tolist())


def _matrix(conditions: list[tuple[float, float, float]], dampers: int) -> tuple[tuple[float, float, float], ...]:
    """Conditions that half the dampers or more were tested at, each the median of its like."""
    from mrdamper.data import same_condition

    groups = same_condition([Condition(*c) for c in conditions])
    common = [g for g in groups if 2 * len(g) >= dampers] or groups
    return tuple(sorted(_median(np.array([conditions[i] for i in g])) for g in common))  # type: ignore[arg-type]


def as_job(item: Item, digest: str, settings: Settings, plan: Plan | None) -> dict[str, Any]:
    """The argument of `measure`."""
    bare = asdict(replace(item, error=None))
    return {
        "item": bare,
        "digest": digest,
        "settings": asdict(settings),
        "plan": None if plan is None else asdict(plan),
    }


def item_of(job: dict[str, Any]) -> Item:
    """The item of a job that came as JSON."""
    fields: dict[str, Any] = dict(job["item"])
    return Item(**{**fields, "paths": tuple(fields["paths"]), "rows": tuple((a, b) for a, b in fields["rows"])})
