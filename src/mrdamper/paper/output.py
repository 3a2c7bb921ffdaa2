"""The study as files, written atomically: reproduction.html, tables and figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from mrdamper.dampers.modified import ModifiedFit
from mrdamper.dampers.published import all_published
from mrdamper.data import Condition
from mrdamper.data.atomic import ResultRecord, publish
from mrdamper.data.encoding import csv_text, finite
from mrdamper.data.progress import Progress, silent
from mrdamper.errors import InputError
from mrdamper.identification.harmonic_balance import SineRecord
from mrdamper.models import Model, model_type
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper.claims import Claim, check_claims
from mrdamper.paper.figures import FIGURES, NO_SEEDS, caption, pictures
from mrdamper.paper.options import ALI, CONSISTENT, DIRECT, LITERAL, TRADITIONAL
from mrdamper.paper.results import Reproduction, cost_per_run, rate_rows
from mrdamper.report.page import made_from, render_page
from mrdamper.report.plots.style import Picture, picture_files
from mrdamper.report.tables import identification_rows
from mrdamper.study.processes import IN_PROCESS, Processes

Rows = list[dict[str, Any]]
_GROUPS = {"paper": "paper (literal)"}  # names of groups of methods in tables


def write_reproduction(
    study: Reproduction,
    folder: str | Path,
    progress: Progress = silent,
    *,
    png: bool = False,
    processes: Processes = IN_PROCESS,
) -> list[Path]:
    """Write reproduction.html, tables/ and figures/ atomically, drawn in `processes`; return the paths, page first."""
    claims, names, parts = check_claims(study), tuple(FIGURES), 2 * processes.count
    drawn: dict[str, Picture | str] = {}
    draw = partial(pictures, study, ("png",) if png else ())
    for part in processes.map(draw, [names[n::parts] for n in range(parts)], progress):
        drawn |= part
    tables, absent = all_tables(study, claims)
    notes = [f"Figure {name} is not drawn: {drawn[name]}." for name in names if isinstance(drawn[name], str)]
    notes += [f"Table {name} is not made: {why}." for name, why in absent.items()]
    shown = {name: picture for name in names if not isinstance(picture := drawn[name], str)}
    page = render_page(
        "reproduction.html.j2",
        "The method of Qian et al. 2024, claim by claim",
        f"{made_from(study.dataset)}. Reference: Qian, Wang, Jiang, Zhang, Zhai, Wang (2024), Actuators 13(8), 297.",
        study=study,
        claims=claims,
        tables=tables,
        numbered=[(name, NUMBERED[name]) for name in NUMBERED if name in tables],
        pictures={name: (caption(name), picture["svg"]) for name, picture in shown.items()},
        notes=(*study.notes, *notes),
        best=study.best,
        synthetic=study.rig is not None,
    )
    every = tables | {"seconds": time_rows(study)}
    files = {"reproduction.html": page, **{f"tables/{name}.csv": csv_text(rows) for name, rows in every.items()}}
    took = {method.recipe.title: method.seconds for method in study.contenders}
    record = ResultRecord("reproduce", seconds={"in all": study.seconds, **took})
    written = publish(folder, {**files, **picture_files(shown)}, record)
    progress("written", 1.0)
    return written


def summary(study: Reproduction) -> dict[str, Any]:
    """Return methods, claims, notes and times for JSON."""
    names = {"claim": "text"} | {n: n for n in ("verdict", "said", "evidence", "threshold", "seeds")}
    return {
        "synthetic": study.rig is not None,
        "verdicts": method_rows(study),
        "claims": [{key: getattr(c, name) for key, name in names.items()} for c in check_claims(study)],
        "notes": list(study.notes),
        "times": time_rows(study),
    }


def all_tables(study: Reproduction, claims: Sequence[Claim]) -> tuple[dict[str, Rows], dict[str, str]]:
    """Return the tables by name, those of the paper by its numbers, and why others are missing."""
    tables = {name: rows(study) for name, rows in _TABLES.items()}
    tables["claims"] = [dict(vars(claim)) for claim in claims]
    reasons = _REASONS if study.held_out else {**_REASONS, **_NEED_VALIDATION}
    absent = {name: reasons.get(name, "the data allow no row of it") for name, rows in tables.items() if not rows}
    return {name: rows for name, rows in tables.items() if rows}, absent


def method_rows(study: Reproduction) -> Rows:
    """List accuracy on the validation runs and cost, one row per method."""
    rows = []
    for method in study.contenders:
        validation, title = method.validation, method.recipe.title
        seeds = study.seed_errors.get(title)
        row = {
            "verdict": _GROUPS.get(method.recipe.way, method.recipe.way),
            "method": title,
            "parameters": method.damper.parameter_count,
            "nrmse_pp": None,
            "worst_nrmse_pp": validation.worst().scores.nrmse_pp if validation.runs else None,
        }
        names = ("nrmse_pp", "nrmse_std", "wape", "mean_relative_error")
        row |= {name: validation.median(name) if validation.runs else None for name in names}
        row["per_run_nrmse_pp"] = method.per_run
        row["forces_a_run"] = cost_per_run(study, method)[0] if method.identifications else None
        row["seeds"] = None if seeds is None else seeds.size
        for name, take in (("median", np.median), ("lowest", np.min), ("highest", np.max)):
            row[f"seed_{name}_nrmse_pp"] = None if seeds is None else float(take(seeds))
        rows.append(row)
    return rows


def time_rows(study: Reproduction) -> Rows:
    """List seconds by method and by search: no other table differs from run to run."""
    rows = [(c.recipe.title, len(c.identifications), c.seconds, cost_per_run(study, c)[1]) for c in study.contenders]
    rows += [
        (f"genetic search {number}, {check.condition}", 1, check.seconds, check.seconds)
        for number, check in enumerate(study.genetic, 1)
    ]
    names = ("what", "runs", "seconds", "seconds_a_run")
    return [dict(zip(names, row, strict=True)) for row in (*rows, ("in all", len(study.train), study.seconds, None))]


def _identified_rows(place: int, study: Reproduction) -> Rows:
    """List the identified parameters at the smaller (0) or larger (-1) amplitude [Tables 1 and 2]."""
    literal = study.contender(LITERAL)
    by_run = {i.run_id: i for i in (literal.identifications if literal else ())}
    readings = dict(zip((run.id for run in study.train), study.readings, strict=False))
    rows = []
    for run in study.amplitude_group(place) if by_run else ():
        if one := by_run.get(run.id):
            first = {"F0 [N]": readings[run.id].amplitude, "phi [rad]": readings[run.id].phase}
            rows.append({"run_id": run.id, **asdict(one.condition), **first, **_parameters(study, one.model)})
    return sorted(rows, key=lambda row: (round(row["frequency_Hz"], 2), row["current_A"]))


def _error_rows(study: Reproduction) -> Rows:
    """List the mean relative error at every current, method by method, and the mean over the currents [Table 4]."""
    rows: Rows = []
    for method in study.named(LITERAL, TRADITIONAL, DIRECT, ALI):
        errors = sorted((r.condition.current_A, r.scores.mean_relative_error) for r in method.validation.runs)
        if errors:
            row = {f"{current:.2f} A": error for current, error in errors}
            rows.append({"method": method.recipe.title, **row, "mean": float(np.mean([error for _, error in errors]))})
    return rows


def _model_rows(study: Reproduction) -> Rows:
    """List the modified model beside the models the paper names: parameters, data needed, limits [Table 5]."""
    literal = study.contender(LITERAL)
    rows: list[tuple[Any, ...]] = [
        ("modified model of Qian et al.", 2, len(literal.identifications[0].free) if literal else None,
         "sines at 3 currents, 3 frequencies and 2 amplitudes; the gas spring",
         "sines; double counting of the hysteretic force in c and m")
    ]  # fmt: skip
    for cls in all_published().values():
        free = [i for i in model_type(cls.basis).parameters() if not i.preset] if cls.basis else []
        data = "sines over currents, frequencies and amplitudes" if cls.basis else "any motion"
        searched = sum(not info.linear for info in free) if free else None
        rows.append((cls.heading, searched, len(free) or None, data, cls.limits))
    names = ("model", "searched_per_run", "identified_per_run", "data_needed", "limits")
    return [dict(zip(names, row, strict=True)) for row in rows]


def parameter_rows(study: Reproduction) -> Rows:
    """List parameter values at every validation condition (80 mm, 1 Hz on the virtual rig), method by method.

    "By the functions" are predicted; "identified there" are identified from the validation run for comparison only.
    """
    rows: Rows = []

    def add(title: str, values: str, run_id: str, condition: Condition, model: object) -> None:
        if isinstance(model, BoucWen):
            row = {"method": title, "values": values, "run_id": run_id, **asdict(condition)}
            rows.append({**row, **_parameters(study, model)})

    for run in study.held_out:
        condition = SineRecord.of(run).condition
        for method in study.contenders:
            try:
                model = method.damper.model_at(condition)
            except InputError:
                continue
            add(method.recipe.title, "by the functions", run.id, condition, model)
        for title in (LITERAL, CONSISTENT):
            one = study.there.get((title, run.id), "")
            if study.contender(title) is not None and not isinstance(one, str):
                add(title, "identified there", run.id, condition, one.model)
    return rows


def _parameters(study: Reproduction, model: Model) -> dict[str, float]:
    """Return parameters by name and unit, scaled to the preset A."""
    values = {
        f"{info.name} [{info.unit}]": study.options.scaled(info.name, float(getattr(model, info.name)))
        for info in model.parameters()
    }
    return {**values, "A [-]": study.options.A}


def _function_rows(study: Reproduction) -> Rows:
    rows = []
    for method in study.contenders:
        if not isinstance(fit := method.fit, ModifiedFit):
            continue
        for name, one in fit.functions.items():
            rows.append(
                {"method": method.recipe.title, "parameter": name, "form": one.function.form,
                 "function": one.function.formula, "r2": finite(one.r2),
                 "coefficients": " ".join(map(repr, one.function.coefficients)),
                 "rates": " ".join(map(repr, one.function.rates))}
            )  # fmt: skip
    return rows


def _sensitivity_rows(study: Reproduction) -> Rows:
    rows, indices = [], study.sobol
    for effect in study.sensitivity:
        row = {"parameter": effect.name, "change": effect.change, "effect": effect.effect,
               "left_after_identifying_anew": effect.left if np.isfinite(effect.left) else None}  # fmt: skip
        if indices is not None and effect.name in indices.names:
            at = indices.names.index(effect.name)
            columns = (indices.first, indices.first_confidence, indices.total, indices.total_confidence)
            names = ("sobol_first", "sobol_first_half_width", "sobol_total", "sobol_total_half_width")
            row |= {name: float(column[at]) for name, column in zip(names, columns, strict=True)}
        rows.append(row)
    return rows


def _scores(score: Any) -> dict[str, float]:
    names = ("mean_relative_error", "wape", "nrmse_pp", "nrmse_std")
    return {"run_id": score.run_id, **asdict(score.condition), **{n: getattr(score.scores, n) for n in names}}


NUMBERED = MappingProxyType({
    "table1": "Identified parameters at the smaller amplitude",
    "table2": "Identified parameters at the larger amplitude",
    "table3": "Parameter values at the prediction motion, from the functions",
    "table4": "Mean relative error (Eq. 44) of the predictions at every current, in %",
    "table5": "The modified model beside the models the paper names",
})  # fmt: skip
_NEED_VALIDATION = dict.fromkeys(("table3", "table4", "rate", "parameters", "errors"), "there is no validation run")
_REASONS = {
    "genetic": "no genetic search was made",
    "genetic_runs": "no genetic search was made",
    "seeds": NO_SEEDS,
    "virtual_rig": "the data are not of the virtual rig",
}
_TABLES: Mapping[str, Callable[[Reproduction], Rows]] = MappingProxyType({
    "table1": partial(_identified_rows, 0),
    "table2": partial(_identified_rows, -1),
    "table3": lambda study: [
        row for row in parameter_rows(study) if (row["method"], row["values"]) == (LITERAL, "by the functions")
    ],
    "table4": _error_rows,
    "table5": _model_rows,
    "rate": rate_rows,
    "methods": method_rows,
    "tests": lambda study: [
        {"run_id": loop.run_id, "split": loop.split, **asdict(loop.condition), "peak_force_N": loop.peak_force,
         "dissipated_energy_J": loop.dissipated_energy}
        for loop in study.loops
    ],
    "identifications": lambda study: [
        {"way": c.recipe.title, **row} for c in study.contenders for row in identification_rows(c.identifications)
    ],
    "parameters": parameter_rows,
    "errors": lambda study: [
        {"method": c.recipe.title, **_scores(score)} for c in study.contenders for score in c.validation.runs
    ],
    "functions": _function_rows,
    "sensitivity": _sensitivity_rows,
    "genetic": lambda study: [
        {**asdict(g.condition), "reached_rmse_N": g.reached, "least_rmse_N": g.optimum,
         "evaluations": g.minimum.evaluations, "alpha": float(g.minimum.point[0]), "beta": float(g.minimum.point[1])}
        for g in study.genetic
    ],
    "genetic_runs": lambda study: [
        {"run_id": e.run_id, "seed": e.seed, "alpha_over_optimum": e.alpha, "beta_over_optimum": e.beta,
         "error_over_least": e.error, "forces": e.forces, "forces_to_settle": e.to_settle}
        for e in study.ended
    ],
    "seeds": lambda study: [
        {"method": title, "seed": number, "nrmse_pp": float(value)}
        for title, errors in study.seed_errors.items()
        for number, value in enumerate(errors, 1)
    ],
    "virtual_rig": lambda study: [
        {"parameter": i.name, "value": getattr(study.rig, i.name), "unit": i.unit, "meaning": i.meaning}
        for i in (study.rig.parameters() if study.rig else ())
    ],
})  # fmt: skip
