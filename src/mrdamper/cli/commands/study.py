"""`mrdamper study`: identification, validation and report of a dataset."""

from __future__ import annotations

import json
import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from mrdamper.cli.output import parse_gas, parse_pairs, warn
from mrdamper.cli.progress import in_two, progress_on_stderr
from mrdamper.errors import IdentificationError, InputError

if TYPE_CHECKING:
    from mrdamper.data import Dataset
    from mrdamper.study.recipe import StudyMethod

app = typer.Typer()


@app.command(epilog="Example: mrdamper study rig/ --out result/")
def study(
    data: Path | None = typer.Argument(None, help="Dataset folder; default: the bundled tests of two dampers."),
    out: Path = typer.Option(..., help="Folder for report.html, model.json, tables and figures."),
    model: str | None = typer.Option(
        None,
        help="Save this model in the best of its ways, or in one of them (dahl:joint), instead of the best model; "
        "paper: the method of Qian et al. 2024.",
    ),
    gas: str | None = typer.Option(
        None, help="Known gas spring for --model paper: pressure MPa, volume cm3, rod area mm2, as P,V,A."
    ),
    setting: list[str] = typer.Option(
        [], "--set", help="OPTION=VALUE of --model paper (n, gamma, mass_law, search, ...); may be repeated."
    ),
    about: Path | None = typer.Option(None, help="TOML file with customer, type, serial, logo (mrdamper init about)."),
    limits: Path | None = typer.Option(None, help="TOML file with force limits (mrdamper init limits)."),
    pdf: bool = typer.Option(False, "--pdf", help="Also write report.pdf and every figure as PDF."),
    paper: str = typer.Option("a4", help="Page size of report.pdf: a4 or letter."),
    png: bool = typer.Option(False, "--png", help="Also write every figure as PNG."),
    lag: bool = typer.Option(False, "--lag", help="Require tests from which the coil lag can be identified."),
    keep: list[str] = typer.Option([], help="Use this run although it contradicts the others; may be repeated."),
    verbose: bool = typer.Option(False, "--verbose", help="Print every model, parameter and limitation."),
    as_json: bool = typer.Option(False, "--json", help="Print the summary as JSON."),
) -> None:
    """Identify, validate and report a dataset in one step.

    Every run is identified, models of the whole damper are fitted and cross-validated, and the
    best is saved with a report.
    """
    from mrdamper.data.atomic import require_writable
    from mrdamper.report.about import load_about, load_limits
    from mrdamper.report.page import paper_size
    from mrdamper.report.study import write_study
    from mrdamper.report.summary import omission_lines, study_lines
    from mrdamper.rig_files.dataset_folder import load_dataset
    from mrdamper.study.processes import several
    from mrdamper.study.workflow import run_study

    chosen = _model(model, gas, setting)
    head, bands = load_about(about) if about else None, load_limits(limits) if limits else ()
    also = [kind for kind, wanted in (("pdf", pdf or about is not None), ("png", png)) if wanted]
    require_writable(out, "study")
    page_size = paper_size(paper)
    dataset = load_dataset(data)
    if lag:
        _require_switched_current(dataset)
    workers = min(os.cpu_count() or 1, len(dataset.rigs))
    with progress_on_stderr() as progress, several(workers) as processes:
        studying, writing = in_two(progress, 0.85)
        result = run_study(dataset, studying, model=chosen, keep=keep, processes=processes)
        options = {"also": also, "paper": page_size, "processes": processes}
        written = write_study(result, out, writing, about=head, limits=bands, **options)
    for rig in result.rigs:
        lines = [f"excluded: {one.run_id}: {one}" for one in rig.contradictions]
        lines += omission_lines(rig.candidates, rig.omitted, len(dataset) if verbose else 3)
        warn([*lines, *(f"note: {note}" for note in rig.chosen.recipe.notes)])
    if as_json:
        print(json.dumps(_summary(result, [str(p) for p in written]), indent=1))
        return
    models = ", ".join(str(path) for path in written if path.name.startswith("model"))
    where = f" {shlex.quote(str(data))}" if data else ""
    further = f"further models (Spencer, LuGre, published ones): mrdamper compare{where} --out comparison"
    files = [f"model: {models}", f"report: {written[0]}", further]
    print("\n".join(study_lines(result, files, verbose=verbose)))


def _model(name: str | None, gas: str | None, setting: list[str]) -> str | StudyMethod | None:
    from mrdamper.study.recipe import study_method, study_methods

    if name in study_methods():
        return study_method(str(name), parse_pairs(setting, "--set"), parse_gas(gas))
    if gas or setting:
        raise InputError("--gas and --set are options of a published method", remedy="add --model paper, or omit them")
    return name


def _require_switched_current(dataset: Dataset) -> None:
    if not any(run.current_changes for run in dataset.split("train")):
        raise IdentificationError(
            "the current is constant in every identification run, so the coil lag cannot be identified",
            remedy="add a run in which the current is switched, or omit --lag",
            code="E_LAG",
        )


def _summary(result, written: list[str]) -> dict:
    return {
        "rigs": {
            rig.dataset.name: {
                "chosen": rig.chosen.title,
                "candidates": {c.title: {"parameters": c.damper.parameter_count, **c.errors} for c in rig.candidates},
                "interval_coverage": rig.interval_coverage,
                "set_aside": {
                    one.run_id: {"code": one.code, "cause": one.cause, "value": one.value, "message": str(one)}
                    for one in rig.contradictions
                },
                "left_out_session_known": rig.session_known if isinstance(rig.session_known, float) else None,
            }
            for rig in result.rigs
        },
        "files": written,
        "seconds": result.seconds,
    }
