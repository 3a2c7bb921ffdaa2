"""Tasks of worker processes, with progress reports.

Imports of single tasks stand inside them: workers start sooner.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mrdamper.dampers.base import Damper
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.data import Dataset
from mrdamper.data.progress import Progress
from mrdamper.errors import IdentificationError, InputError
from mrdamper.identification import Identification
from mrdamper.identification.basis import Basis
from mrdamper.models import model_type
from mrdamper.study.recipe import (
    RecipeResult,
    fit_and_score,
    fit_functions_jointly,
    fit_per_run,
    identified,
    modified,
    whole_damper,
)
from mrdamper.study.usable_runs import usable_sines
from mrdamper.study.workflow import Study, run_study

if TYPE_CHECKING:
    from mrdamper.report.about import About

JOINT = "joint"
FUNCTIONS = "functions"


def study(dataset: Dataset, folder: Path, about: About | None, progress: Progress) -> tuple[Study, list[Path]]:
    """Run the whole study, and write its report, models, tables and figures into a folder."""
    from mrdamper.report.study import write_study

    result = run_study(dataset, lambda step, share: progress(step, 0.6 * share))
    report = lambda step, share: progress(step, 0.6 + 0.4 * share)  # noqa: E731
    return result, write_study(result, folder, report, about=about, also=("pdf",))


def identify_rig(
    dataset: Dataset,
    run_ids: Sequence[str],
    model: str,
    method: str,
    over: str,
    free: Sequence[str],
    fixed: Mapping[str, float],
    progress: Progress,
) -> tuple[tuple[Identification, ...], RecipeResult | str, dict[str, str]]:
    """Identify a model from runs of one rig, then over their conditions.

    `run_ids`: runs to identify from; empty for all identification runs with a steady sine. `over`: the fit over the
    conditions: "functions" through the identified values, or "joint", all forces at once. `free`: preset parameters
    to determine as well. `fixed`: parameters held at a value [SI].

    Returns the identifications, none for a model of one set of parameters; the damper over all conditions, or the
    reason why the runs allow none; and the reason for each refused run.
    """
    sines, refused = usable_sines(dataset)
    runs = [run for run in sines if (run.id in run_ids if run_ids else run.split == "train")]
    if not runs:
        reason = next((refused[i] for i in run_ids if i in refused), "no identification run is a steady sine")
        raise IdentificationError(reason, where=f"rig {dataset.name}", remedy="choose other runs")
    if model_type(model).current_levels:
        recipe = whole_damper(model)
    else:
        recipe = modified(model, method)
        basis = Basis(model, method, tuple(free), tuple(sorted(fixed.items())))
        recipe = replace(recipe, basis=basis, make=fit_functions_jointly if over == JOINT else fit_per_run)
    identifications, spent = identified(recipe.basis, runs, {}, lambda step, share: progress(step, 0.8 * share))
    progress("over all conditions", 0.8)
    try:
        scored = fit_and_score(recipe, runs, identifications, dataset.split("validate"), spent=spent, leave_out=False)
    except InputError as error:
        if not identifications:
            raise
        return tuple(identifications), str(error), refused
    progress("uncertainty", 0.95)
    return tuple(identifications), replace(scored, damper=estimate_uncertainty(scored.damper, runs)), refused


def export_damper(damper: Damper, form: str, folder: Path, progress: Progress) -> tuple[list[Path], tuple[str, ...]]:
    """Write a damper in an export format into a folder; returns the files and the notes of the exporter."""
    from mrdamper.exporters import exporter
    from mrdamper.exporters.base import write_export

    progress(f"exporting {form}", 0.1)
    kind, name = exporter(form), export_name(damper.rig)
    written = kind().export(damper, name)
    folder.mkdir()
    out = folder / f"{name}{kind.suffix}" if kind.suffix else folder / f"{name}-{form}"
    return write_export(written, out, kind.suffix), written.notes


def export_name(rig: str) -> str:
    """Return a name for files and symbols, from the rig where its letters allow one."""
    from mrdamper.exporters.base import identifier

    try:
        return identifier(rig)
    except InputError:
        return "damper"
