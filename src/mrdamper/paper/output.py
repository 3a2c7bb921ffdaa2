"""The study as files: reproduction.html, tables and figures, whole or not at all."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mrdamper.dampers.modified import ModifiedFit
from mrdamper.dampers.published import all_published
from mrdamper.data import Condition
from mrdamper.data.atomic import publish
from mrdamper.data.encoding import csv_text
from mrdamper.errors import InputError
from mrdamper.identification.harmonic_balance import SineRecord
from mrdamper.models import Model, model_type
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper.claims import Claim, judge_all
from mrdamper.paper.figures import FIGURES, SECONDS, pictures
from mrdamper.paper.recipes import ALI, CONSISTENT, DIRECT, LITERAL, TRADITIONAL
from mrdamper.paper.results import Reproduction, forces_a_run, rate_rows, seconds_a_run
from mrdamper.report.page import made_from, render_page
from mrdamper.report.plots.style import Picture
from mrdamper.report.tables import identification_rows
from mrdamper.study.parallel import HERE, Processes
from mrdamper.study.recipe import Progress

_GROUPS = {
    "paper": "paper (literal)",
    "consistent": "consistent",
    "joint": "joint",
    "traditional": "traditional",
    "literature": "literature",
}
Rows = list[dict[str, Any]]


def write_reproduction(
    study: Reproduction,
    folder: str | Path,
    progress: Progress = lambda what, share: None,
    *,
    png: bool = False,
    processes: Processes = HERE,
) -> list[Path]:
    """Write reproduction.html, tables/ and figures/.

    Parameters
    ----------
    study : Reproduction
    folder : path
        FitResult if missing; files of the same names are replaced together at the end.
    progress : callable
        Told what is being done and the share done.
    png : bool
        Every figure as PNG beside the SVG.
    processes : Processes
        Where figures are drawn.

    Returns
    -------
    list of Path
        What was written, the page first.

    Raises
    ------
    OutputError
        If the folder cannot be written to.
    """
    claims = judge_all(study)
    names, each = tuple(FIGURES), 2 * processes.count
    drawn: dict[str, Picture | str] = {}
    for part in processes.map(
        partial(pictures, study, ("png",) if png else ()), [names[n::each] for n in range(each)], progress
    ):
        drawn |= part
    tables, absent = _tables(study, claims)
    notes = [f"{name} is not drawn: {drawn[name]}" for name in names if isinstance(drawn[name], str)]
    notes += [f"{name} is not made: {why}" for name, why in absent.items()]

    def fill(work: Path) -> None:
        (work / "figures").mkdir()
        (work / "tables").mkdir()
        shown = {}
        for name in names:
            picture = drawn[name]
            if isinstance(picture, Picture):
                shown[name] = FIGURES[name][0], picture.save(work / "figures" / name)
        shown.pop(SECONDS, None)
        for name, rows in (tables | {"seconds": time_rows(study)}).items():
            (work / "tables" / f"{name}.csv").write_text(csv_text(rows), encoding="utf-8")
        page = render_page(
            "reproduction.html.j2",
            "The method of Qian et al. 2024, claim by claim",
            f"{made_from(study.dataset)}. "
            "Reference: Qian, Wang, Jiang, Zhang, Zhai, Wang (2024), Actuators 13(8), 297.",
            study=study,
            claims=claims,
            tables=tables,
            pictures=shown,
            notes=(*study.notes, *notes),
            best=study.best,
            synthetic=study.rig is not None,
        )
        (work / "reproduction.html").write_text(page, encoding="utf-8")

    took = {contender.recipe.title: contender.seconds for contender in study.contenders}
    written = publish(folder, "reproduction.html", fill, {"seconds": {"in all": study.seconds, **took}})
    progress("written", 1.0)
    return written


def summary(study: Reproduction) -> dict[str, Any]:
    """Verdicts and claims, for a program."""
    claims = [
        {
            "claim": c.text,
            "verdict": c.verdict,
            "said": c.said,
            "evidence": c.evidence,
            "threshold": c.threshold,
            "seeds": c.seeds,
        }
        for c in judge_all(study)
    ]
    return {
        "synthetic": study.rig is not None,
        "verdicts": verdicts(study),
        "claims": claims,
        "notes": list(study.notes),
        "times": time_rows(study),
    }


def verdicts(study: Reproduction) -> Rows:
    """One row a contender: accuracy on the held-out runs and time; the counterpart of Table 5."""
    rows = []
    for contender in study.contenders:
        held = contender.validation
        median = held.median if held.runs else lambda name="": None
        spread = study.seed_errors.get(contender.recipe.title)
        rows.append(
            {
                "verdict": _GROUPS[contender.recipe.way],
                "method": contender.recipe.title,
                "parameters": contender.damper.parameter_count,
                "nrmse_pp": median("nrmse_pp"),
                "worst_nrmse_pp": held.worst().scores.nrmse_pp if held.runs else None,
                "nrmse_std": median("nrmse_std"),
                "wape": median("wape"),
                "mean_relative_error": median("mean_relative_error"),
                "per_run_nrmse_pp": contender.per_run,
                "forces_a_run": forces_a_run(study, contender) if contender.identifications else None,
                "seeds": None if spread is None else spread.size,
                "seed_median_nrmse_pp": None if spread is None else float(np.median(spread)),
                "seed_lowest_nrmse_pp": None if spread is None else float(spread.min()),
                "seed_highest_nrmse_pp": None if spread is None else float(spread.max()),
            }
        )
    return rows


def time_rows(study: Reproduction) -> Rows:
    """What the study took here, way by way and search by search: no other table differs from run to run."""
    rows = [
        {"what": c.recipe.title, "runs": len(c.identifications), "seconds": c.seconds,
         "seconds_a_run": seconds_a_run(study, c)}
        for c in study.contenders
    ]  # fmt: skip
    for number, check in enumerate(study.genetic, 1):
        rows.append(
            {"what": f"genetic search {number}, {check.condition}", "runs": 1, "seconds": check.seconds,
             "seconds_a_run": check.seconds}
        )  # fmt: skip
    return [*rows, {"what": "in all", "runs": len(study.train), "seconds": study.seconds, "seconds_a_run": None}]


def _tables(study: Reproduction, claims: tuple[Claim, ...]) -> tuple[dict[str, Rows], dict[str, str]]:
    """The paper's tables by their numbers and those only this study has; and why others are not made."""
    names = ("key", "text", "source", "verdict", "said", "evidence", "threshold", "figure", "seeds")
    tables: dict[str, Rows] = {
        "table1": _identified_rows(study, 0),
        "table2": _identified_rows(study, -1),
        "table3": [
            row for row in parameter_rows(study) if (row["method"], row["values"]) == (LITERAL, "by the functions")
        ],
        "table4": _error_rows(study),
        "table5": _model_rows(study),
        "rate": rate_rows(study),
        "methods": verdicts(study),
        "tests": [
            {"run_id": loop.run_id, "split": loop.split, **_condition(loop.condition), "peak_force_N": loop.peak_force,
             "dissipated_energy_J": loop.dissipated_energy}
            for loop in study.loops
        ],
        "identifications": [
            {"way": c.recipe.title, **row} for c in study.contenders for row in identification_rows(c.identifications)
        ],
        "parameters": parameter_rows(study),
        "errors": [
            {"method": c.recipe.title, "run_id": run.run_id, **_condition(run.condition),
             "mean_relative_error": run.scores.mean_relative_error, "wape": run.scores.wape,
             "nrmse_pp": run.scores.nrmse_pp, "nrmse_std": run.scores.nrmse_std}
            for c in study.contenders
            for run in c.validation.runs
        ],
        "functions": _function_rows(study),
        "claims": [{name: getattr(c, name) for name in names} for c in claims],
        "sensitivity": _sensitivity_rows(study),
        "genetic": [
            {**_condition(g.condition), "reached_rmse_N": g.reached, "least_rmse_N": g.optimum,
             "evaluations": g.minimum.evaluations, "alpha": float(g.minimum.point[0]),
             "beta": float(g.minimum.point[1])}
            for g in study.genetic
        ],
        "genetic_runs": [
            {"run_id": e.run_id, "seed": e.seed, "alpha_over_optimum": e.alpha, "beta_over_optimum": e.beta,
             "error_over_least": e.error, "forces": e.forces, "forces_to_settle": e.to_settle}
            for e in study.ended
        ],
        "seeds": [
            {"method": title, "seed": number, "nrmse_pp": float(value)}
            for title, values in study.seed_errors.items()
            for number, value in enumerate(values, 1)
        ],
        "virtual_rig": [
            {"parameter": i.name, "value": getattr(study.rig, i.name), "unit": i.unit, "meaning": i.meaning}
            for i in (study.rig.parameters() if study.rig else ())
        ],
    }  # fmt: skip
    reasons = {
        "genetic": "no genetic search was made",
        "genetic_runs": "no genetic search was made",
        "seeds": "noise seeds need the virtual rig",
        "virtual_rig": "the data are not of the virtual rig",
    }
    if not study.held_out:
        reasons |= dict.fromkeys(("table3", "table4", "rate", "parameters", "errors"), "there is no validation run")
    absent = {name: reasons.get(name, "the data allow no row of it") for name, rows in tables.items() if not rows}
    return {name: rows for name, rows in tables.items() if rows}, absent


def _identified_rows(study: Reproduction, place: int) -> Rows:
    """List the identified parameters at the smaller (0) or larger (-1) amplitude [Tables 1 and 2]."""
    literal = study.contender(LITERAL)
    known = {i.run_id: i for i in (literal.identifications if literal else ())}
    readings = dict(zip((run.id for run in study.train), study.readings, strict=False))
    rows = []
    for run in study.amplitude_group(place) if known else ():
        if run.id not in known:
            continue
        found, reading = known[run.id], readings[run.id]
        row = {"run_id": run.id, **_condition(found.condition), "F0 [N]": reading.amplitude, "phi [rad]": reading.phase}
        rows.append(row | _parameters(study, found.model))
    return sorted(rows, key=lambda row: (round(row["frequency_Hz"], 2), row["current_A"]))


def _error_rows(study: Reproduction) -> Rows:
    """List the mean relative error at every current, method by method, and the mean over the currents [Table 4]."""
    rows: Rows = []
    for method in study.named(LITERAL, TRADITIONAL, DIRECT, ALI):
        errors = sorted((r.condition.current_A, r.scores.mean_relative_error) for r in method.validation.runs)
        row = {f"{current:.2f} A": error for current, error in errors}
        if errors:
            rows.append({"method": method.recipe.title, **row, "mean": float(np.mean([error for _, error in errors]))})
    return rows


def _model_rows(study: Reproduction) -> Rows:
    """List the modified model beside the models the paper names: parameters, data needed, limits [Table 5]."""
    literal = study.contender(LITERAL)
    rows: Rows = [
        {"model": "modified model of Qian et al.", "searched_per_run": 2,
         "identified_per_run": len(literal.identifications[0].free) if literal else None,
         "data_needed": "sines at 3 currents, 3 frequencies and 2 amplitudes; the gas spring",
         "limits": "sines; double counting of the hysteretic force in c and m"}
    ]  # fmt: skip
    for cls in all_published().values():
        free = [i for i in model_type(cls.basis).parameters() if not i.preset] if cls.basis else []
        rows.append(
            {"model": cls.heading, "searched_per_run": sum(not info.linear for info in free) if free else None,
             "identified_per_run": len(free) or None,
             "data_needed": "sines over currents, frequencies and amplitudes" if cls.basis else "any motion",
             "limits": cls.limits}
        )  # fmt: skip
    return rows


def parameter_rows(study: Reproduction) -> Rows:
    """Parameter values at every held-out condition (80 mm, 1 Hz on the virtual rig), way by way.

    "By the functions" are predicted; "identified there" come from the held-out run itself and serve
    to compare, never to fit.
    """
    rows: Rows = []
    for run in study.held_out:
        condition = SineRecord.of(run).condition
        for contender in study.contenders:
            try:
                model = contender.damper.model_at(condition)
            except InputError:
                continue
            if not isinstance(model, BoucWen):
                continue
            rows.append(_parameter_row(study, contender.recipe.title, "by the functions", run.id, condition, model))
        for title in (LITERAL, CONSISTENT):
            found = study.there.get((title, run.id), "")
            if study.contender(title) is not None and not isinstance(found, str):
                rows.append(_parameter_row(study, title, "identified there", run.id, condition, found.model))
    return rows


def _parameter_row(
    study: Reproduction, method: str, values: str, run_id: str, condition: Condition, model: Model
) -> dict[str, Any]:
    row: dict[str, Any] = {"method": method, "values": values, "run_id": run_id, **_condition(condition)}
    return row | _parameters(study, model)


def _parameters(study: Reproduction, model: Model) -> dict[str, float]:
    """Parameters by name and unit, as they read with the preset A."""
    values = {
        f"{info.name} [{info.unit}]": study.options.scaled(info.name, float(getattr(model, info.name)))
        for info in model.parameters()
    }
    return {**values, "A [-]": study.options.A}


def _function_rows(study: Reproduction) -> Rows:
    rows = []
    for contender in study.contenders:
        if not isinstance(contender.fit, ModifiedFit):
            continue
        for name, found in contender.fit.functions.items():
            # A parameter that was held has nothing to explain.
            varies = np.ptp(contender.fit.values[name]) > 1e-9 * np.max(np.abs(contender.fit.values[name]), initial=0.0)
            rows.append(
                {
                    "method": contender.recipe.title,
                    "parameter": name,
                    "form": found.function.form,
                    "function": found.function.formula,
                    "r2": found.r2 if varies else None,
                    "coefficients": " ".join(map(repr, found.function.coefficients)),
                    "rates": " ".join(map(repr, found.function.rates)),
                }
            )
    return rows


def _sensitivity_rows(study: Reproduction) -> Rows:
    rows, indices = [], study.sobol
    for effect in study.sensitivity:
        row = {"parameter": effect.name, "change": effect.change, "effect": effect.effect,
               "left_after_identifying_anew": effect.left if np.isfinite(effect.left) else None}  # fmt: skip
        if indices is not None and effect.name in indices.names:
            at = indices.names.index(effect.name)
            row |= {
                "sobol_first": float(indices.first[at]),
                "sobol_first_half_width": float(indices.first_confidence[at]),
                "sobol_total": float(indices.total[at]),
                "sobol_total_half_width": float(indices.total_confidence[at]),
            }
        rows.append(row)
    return rows


def _condition(condition: Condition) -> dict[str, float]:
    return {name: float(getattr(condition, name)) for name in ("current_A", "frequency_Hz", "amplitude_m")}
