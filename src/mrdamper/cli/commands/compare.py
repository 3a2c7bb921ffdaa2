"""`mrdamper compare`: several models identified from the same data."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from mrdamper.cli.output import aligned, parse_gas, parse_pairs, shortened, warn
from mrdamper.cli.progress import progress_on_stderr

if TYPE_CHECKING:
    from mrdamper.study.comparison import Comparison

_ERRORS = ("per_run", "train", "cv", "cv_worst", "validation", "validation_worst")
_NOTES, _ROWS = 3, 12  # lines of notes, and of the tables of all rigs together, without --verbose

app = typer.Typer()


@app.command(epilog="Example: mrdamper compare rig/ --out comparison/ --models bouc-wen --models kwok")
def compare(
    data: Path | None = typer.Argument(None, help="Dataset folder; default: the bundled tests of two dampers."),
    out: Path = typer.Option(..., help="Folder for comparison.html, tables and figures."),
    models: list[str] = typer.Option(
        [],
        help="Only this model in all its ways (bouc-wen), or one of them (bouc-wen:individual, bouc-wen:joint); "
        "may be repeated.",
    ),
    genetic: bool = typer.Option(
        False, "--genetic", help="Also identify by genetic algorithm, 60 generations (minutes)."
    ),
    gas: str | None = typer.Option(
        None, help="Known gas spring, for the model paper: pressure MPa, volume cm3, rod area mm2 as P,V,A."
    ),
    setting: list[str] = typer.Option(
        [], "--set", help="OPTION=VALUE of the model paper, as for study --model paper; may be repeated."
    ),
    jobs: int | None = typer.Option(None, min=1, help="Number of processes; default: one per core."),
    png: bool = typer.Option(False, "--png", help="Also write every figure as PNG."),
    verbose: bool = typer.Option(False, "--verbose", help="Print every model, and why one was not determined."),
    as_json: bool = typer.Option(False, "--json", help="Print the table as JSON."),
) -> None:
    """Compare models identified from the same data.

    Reported per model: cross-validated and validation error, number of parameters, number of
    runs needed, computing time.
    """
    from mrdamper.data.atomic import require_writable
    from mrdamper.report.comparison import summary_rows, write_comparison
    from mrdamper.rig_files.dataset_folder import load_dataset
    from mrdamper.study import comparison as comparing
    from mrdamper.study.recipe import recipes, recipes_of_models, study_method

    require_writable(out, "compare")
    names = [name.strip() for entry in models for name in entry.split(",") if name.strip()]
    options = (parse_pairs(setting, "--set"), parse_gas(gas)) if setting or gas else ()
    method = study_method("paper", *options) if options else None
    recipes(recipes_of_models(names), genetic, method)  # refuses what cannot be compared before anything is read
    dataset = load_dataset(data)
    with progress_on_stderr() as progress:
        result = comparing.compare(
            dataset,
            names,
            genetic=genetic,
            method=method,
            jobs=jobs,
            progress=lambda what, share: progress(what, 0.9 * share),
        )
        written = write_comparison(result, out, lambda what, share: progress(what, 0.9 + 0.1 * share), png=png)
    rows = summary_rows(result)
    if as_json:
        print(json.dumps({"rows": rows, "files": [str(p) for p in written], "seconds": result.seconds}, indent=1))
        return
    _print(result, rows, dataset.name, verbose)
    print(f"report: {written[0]}")


def _print(result: Comparison, rows: list[dict[str, Any]], name: str, verbose: bool) -> None:
    from mrdamper.report.summary import omission_lines
    from mrdamper.study import comparison as comparing

    notes = [
        line
        for rig in result.rigs
        for line in omission_lines(rig.entries, rig.not_identified, len(rig.dataset) if verbose else 3)
    ]
    notes += [f"not determined: {model}: {why}" for rig in result.rigs for model, why in rig.refused.items()]
    warn(shortened(notes, _NOTES, verbose))
    for rig in result.rigs:
        print(f"{rig.dataset.name}: nrmse_pp [%], median and largest")
        head, *models = _ranking([row for row in rows if row["rig"] == rig.dataset.name])
        print("\n".join([head, *shortened(models, _ROWS // len(result.rigs), verbose)]))
    print(comparing.RANKING)


def _ranking(rows: list[dict[str, Any]]) -> list[str]:
    cells = [["", "model", "per run", "ident.", "CV", "worst", "valid.", "worst", "parameters", "time, s"]]
    for row in rows:
        errors = [row[f"{name}_nrmse_pp"] for name in _ERRORS]
        shown = ("–" if error is None else f"{100 * error:.2f}" for error in errors)
        cells.append([str(row["rank"]), row["title"], *shown, str(row["parameters"]), f"{row['seconds']:.1f}"])
    return aligned(cells, (1,))
