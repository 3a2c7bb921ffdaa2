"""The study as files: reproduction.html, tables and figures, whole or not at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from mrdamper.dampers.modified import ModifiedFit
from mrdamper.data import Condition
from mrdamper.errors import MissingExtraError
from mrdamper.files.atomic import publish
from mrdamper.files.encoding import csv_text
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.report.page import made_from, render_page
from mrdamper.report.plots.model import predicted_loops
from mrdamper.report.plots.rig_tests import measured_loops, test_analysis, test_matrix
from mrdamper.report.plots.style import save_figure
from mrdamper.report.tables import identification_rows
from mrdamper.reproduction.claims import Claim, judge
from mrdamper.reproduction.figures import (
    damping_and_mass_figure,
    errors_figure,
    first_harmonic_figure,
    friction_figure,
    functions_figure,
    genetic_figure,
    seeds_figure,
    sensitivity_figure,
)
from mrdamper.reproduction.sensitivity import OneAtATime, Sobol, one_at_a_time, sobol
from mrdamper.reproduction.study import Reproduction
from mrdamper.reproduction.ways import CONSISTENT, LITERAL, TRADITIONAL
from mrdamper.study.recipe import Progress

_GROUPS = {
    "paper": "paper (literal)",
    "consistent": "consistent",
    "joint": "joint",
    "traditional": "traditional",
    "literature": "literature",
}
_SOBOL_SAMPLES = 128
Rows = list[dict[str, Any]]


def write_reproduction(
    study: Reproduction, folder: str | Path, progress: Progress = lambda what, share: None
) -> list[Path]:
    """Write reproduction.html, tables/ and figures/.

    Parameters
    ----------
    study : Reproduction
    folder : path
        Made if missing; files of the same names are replaced together at the end.
    progress : callable
        Told what is being done and the share done.

    Returns
    -------
    list of Path
        What was written, the page first.

    Raises
    ------
    OutputError
        If the folder cannot be written to.
    """
    progress("claims and sensitivity", 0.0)
    claims = judge(study)
    single, indices, missing = _sensitivity(study)
    figures = _figures(study, single, indices)
    tables = _tables(study, claims, single, indices)

    def fill(work: Path) -> None:
        (work / "figures").mkdir()
        (work / "tables").mkdir()
        pictures = {}
        for number, (name, figure) in enumerate(figures.items()):
            progress(f"figure {name}", 0.2 + 0.8 * number / len(figures))
            pictures[name] = save_figure(figure, work / "figures" / name)
        for name, rows in tables.items():
            (work / "tables" / f"{name}.csv").write_text(csv_text(rows), encoding="utf-8")
        page = _page(study, claims, tables, pictures, (*study.notes, *missing))
        (work / "reproduction.html").write_text(page, encoding="utf-8")

    written = publish(folder, "reproduction.html", fill)
    progress("written", 1.0)
    return written


def verdicts(study: Reproduction) -> Rows:
    """One row a contender: accuracy on the held-out runs and time; the counterpart of Table 5."""
    rows = []
    for contender in study.contenders:
        held = contender.held_out
        spread = study.seed_errors.get(contender.recipe.title)
        rows.append(
            {
                "verdict": _GROUPS[contender.recipe.way],
                "method": contender.recipe.title,
                "numbers": contender.damper.parameter_count,
                "nrmse_pp": held.median(),
                "worst_nrmse_pp": held.worst().scores.nrmse_pp,
                "nrmse_std": held.median("nrmse_std"),
                "wape": held.median("wape"),
                "mean_relative_error": held.median("mean_relative_error"),
                "per_run_nrmse_pp": contender.per_run,
                "seconds": contender.seconds,
                "seeds": None if spread is None else spread.size,
                "seed_median_nrmse_pp": None if spread is None else float(np.median(spread)),
                "seed_lowest_nrmse_pp": None if spread is None else float(spread.min()),
                "seed_highest_nrmse_pp": None if spread is None else float(spread.max()),
            }
        )
    return rows


def _sensitivity(study: Reproduction) -> tuple[tuple[OneAtATime, ...], Sobol | None, tuple[str, ...]]:
    """At the run in the middle of the consistent identifications."""
    found = study.contender(CONSISTENT).identifications
    middle = sorted(found, key=lambda i: i.condition.current_A * i.condition.peak_velocity)[len(found) // 2]
    model, condition = middle.model, middle.condition
    assert isinstance(model, BoucWen)
    single = one_at_a_time(model, condition)
    try:
        return single, sobol(model, condition, samples=_SOBOL_SAMPLES), ()
    except MissingExtraError as error:
        return single, None, (f"Sobol indices were left out: {error}",)


def _figures(study: Reproduction, single: tuple[OneAtATime, ...], indices: Sobol | None) -> dict[str, Figure]:
    by_current = sorted(study.held_out, key=lambda run: run.mean_current)
    picks = np.unique(np.linspace(0, len(by_current) - 1, 3).round().astype(int))
    shown = [by_current[i] for i in picks]
    functions = ("c", "m", "alpha", "beta", "f0")
    figures = {} if study.friction is None else {"friction": friction_figure(study.friction)}
    figures |= {
        "matrix": test_matrix(study.loops),
        "loops": measured_loops(study.dataset, study.loops),
        "analysis": test_analysis(study.loops, ()),
        "first_harmonic": first_harmonic_figure(study),
        "c_m": damping_and_mass_figure(study),
        "functions": functions_figure(study.contender(LITERAL), functions),
        "functions_consistent": functions_figure(
            study.contender(CONSISTENT), ("c", "m", "yield_force", "yield_displacement", "k1", "f0")
        ),
        "sensitivity": sensitivity_figure(single, indices),
        "predicted": predicted_loops(study.contender(LITERAL).damper, shown),
        "predicted_consistent": predicted_loops(study.contender(CONSISTENT).damper, shown),
        "predicted_traditional": predicted_loops(study.contender(TRADITIONAL).damper, shown),
        "errors": errors_figure(study),
    }
    if study.genetic:
        figures["genetic"] = genetic_figure(study.genetic)
    if study.seed_errors:
        figures["seeds"] = seeds_figure(dict(study.seed_errors))
    return figures


def _tables(
    study: Reproduction, claims: tuple[Claim, ...], single: tuple[OneAtATime, ...], indices: Sobol | None
) -> dict[str, Rows]:
    tables: dict[str, Rows] = {
        "table1_tests": [
            {"run_id": loop.run_id, "split": loop.split, **_condition(loop.condition), "peak_force_N": loop.peak_force,
             "dissipated_energy_J": loop.dissipated_energy}
            for loop in study.loops
        ],
        "table2_identifications": [
            {"way": c.recipe.title, **row} for c in study.contenders for row in identification_rows(c.identifications)
        ],
        "table3_functions": _function_rows(study),
        "table4_errors": [
            {"method": c.recipe.title, "run_id": run.run_id, **_condition(run.condition),
             "mean_relative_error": run.scores.mean_relative_error,
             "wape": run.scores.wape,
             "nrmse_pp": run.scores.nrmse_pp, "nrmse_std": run.scores.nrmse_std}
            for c in study.contenders
            for run in c.held_out.runs
        ],
        "table5_methods": verdicts(study),
        "claims": [{n: getattr(c, n) for n in ("text", "source", "verdict", "evidence", "figure")} for c in claims],
        "sensitivity": _sensitivity_rows(single, indices),
    }  # fmt: skip
    if study.genetic:
        tables["genetic"] = [
            {**_condition(g.condition), "reached_rmse_N": g.reached, "least_rmse_N": g.optimum,
             "evaluations": g.minimum.evaluations, "seconds": g.seconds, "alpha": float(g.minimum.point[0]),
             "beta": float(g.minimum.point[1])}
            for g in study.genetic
        ]  # fmt: skip
    if study.seed_errors:
        tables["seeds"] = [
            {"method": title, "seed": number, "nrmse_pp": float(value)}
            for title, values in study.seed_errors.items()
            for number, value in enumerate(values, 1)
        ]
    if study.rig is not None:
        tables["virtual_rig"] = [
            {"parameter": i.name, "value": getattr(study.rig, i.name), "unit": i.unit, "meaning": i.meaning}
            for i in study.rig.parameters()
        ]
    return tables


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


def _sensitivity_rows(single: tuple[OneAtATime, ...], indices: Sobol | None) -> Rows:
    rows = []
    for effect in single:
        row = {"parameter": effect.name, "change": effect.change, "effect": effect.effect,
               "left_after_identifying_anew": effect.left if np.isfinite(effect.left) else None}  # fmt: skip
        if indices is not None:
            at = indices.names.index(effect.name)
            row |= {"sobol_first": float(indices.first[at]), "sobol_total": float(indices.total[at])}
        rows.append(row)
    return rows


def _condition(condition: Condition) -> dict[str, float]:
    return {name: float(getattr(condition, name)) for name in ("current_A", "frequency_Hz", "amplitude_m")}


def _page(
    study: Reproduction,
    claims: tuple[Claim, ...],
    tables: Mapping[str, Rows],
    pictures: Mapping[str, bytes],
    notes: tuple[str, ...],
) -> str:
    return render_page(
        "reproduction.html.j2",
        "The method of Qian et al. 2024, claim by claim",
        f"{made_from(study.dataset)}; computed in {study.seconds:.0f} s. "
        "Reference: Qian, Wang, Jiang, Zhang, Zhai, Wang (2024), Actuators 13(8), 297.",
        study=study,
        claims=claims,
        tables=tables,
        pictures=pictures,
        notes=notes,
        best=study.best,
        literal=study.contender(LITERAL),
        consistent=study.contender(CONSISTENT),
        synthetic=study.rig is not None,
    )


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else float("nan")
