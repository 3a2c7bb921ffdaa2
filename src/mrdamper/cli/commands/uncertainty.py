"""`mrdamper uncertainty`: confidence intervals and limitations of a saved model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from mrdamper.errors import InputError

if TYPE_CHECKING:
    from mrdamper.cli.output import Rows
    from mrdamper.dampers.likelihood import LikelihoodProfile
    from mrdamper.dampers.posterior import Samples
    from mrdamper.data import Run

app = typer.Typer()


@app.command(epilog="Example: mrdamper uncertainty model.json rig/ --profile c1 --out uncertainty/")
def uncertainty(
    model: Path = typer.Argument(..., help="model.json written by mrdamper study."),
    data: Path | None = typer.Argument(None, help="Dataset folder; default: the bundled tests."),
    level: float = typer.Option(0.95, help="Confidence level of the intervals."),
    profile: list[str] = typer.Option([], help="Parameter whose profile likelihood is computed; may be repeated."),
    samples: bool = typer.Option(False, "--samples", help="Sample the posterior by Markov chains; needs mrdamper[uq]."),
    steps: int = typer.Option(4000, help="Steps of each Markov chain."),
    out: Path | None = typer.Option(None, help="Folder for parameters.csv, profile.svg, corner.svg."),
) -> None:
    """Print confidence intervals and limitations of a model.

    Options add profile likelihoods of single parameters and samples of the posterior.
    """
    from mrdamper.dampers.covariance import estimate_uncertainty
    from mrdamper.dampers.model_file import load_model
    from mrdamper.dampers.uncertainty import table, uncertainty_warnings
    from mrdamper.data.atomic import require_writable
    from mrdamper.data.wording import span
    from mrdamper.identification.intervals import student

    student(level, 1.0)  # refuses an invalid level
    if steps < 10:
        raise InputError(f"--steps {steps}", remedy="give at least 10, usually some thousands")
    require_writable(out, "uncertainty")
    damper = load_model(model)
    runs = []
    if damper.uncertainty is None or profile or samples:
        runs = _used(data, damper.rig)
    if damper.uncertainty is None:
        damper = estimate_uncertainty(damper, runs)
    rows = table(damper, level)
    for row in rows:
        print(f"{row['name']} = {row['written']}")
    for doubt in uncertainty_warnings(damper):
        print(doubt)
    curves, drawn = [], None
    if profile or samples:
        from mrdamper.dampers.likelihood import Likelihood
        from mrdamper.dampers.likelihood import profile as profiled
        from mrdamper.dampers.posterior import posterior

        likelihood = Likelihood.of(damper, runs)
        for name in profile:
            curves.append(profiled(likelihood, name))
            low, high = curves[-1].interval
            print(f"profile of {name}: {curves[-1].kind}, 95 % from {span(low, high, curves[-1].unit, 4, ' to ')}")
        if samples:
            drawn = posterior(likelihood, steps)
            print(f"{drawn.steps} steps, autocorrelation time {drawn.time:.0f}, split-R̂ {drawn.split_rhat:.3f}")
    if out is not None:
        _write(out, rows, curves, drawn, level)
        print(out)


def _write(out: Path, rows: Rows, curves: list[LikelihoodProfile], drawn: Samples | None, level: float) -> None:
    from mrdamper.data.atomic import ResultRecord, publish
    from mrdamper.data.encoding import csv_text
    from mrdamper.report.plots.style import picture_files, picture_of
    from mrdamper.report.plots.uncertainty import corner, profile_curves, quantiles

    tables, pictures = {"parameters.csv": csv_text(rows)}, {}
    if curves:
        pictures["profile"] = picture_of(profile_curves(curves))
    if drawn is not None:
        pictures["corner"] = picture_of(corner(drawn))
        tables["samples.csv"] = csv_text(quantiles(drawn, level))
    publish(out, tables | picture_files(pictures, folder=""), ResultRecord("uncertainty"))


def _used(data: Path | None, rig: str) -> list[Run]:
    """Select the runs of the rig that a study identifies from: identification runs with a steady sine."""
    from mrdamper.rig_files.dataset_folder import load_dataset
    from mrdamper.study.usable_runs import usable_sines

    runs = [run for run in usable_sines(load_dataset(data).rig(rig))[0] if run.split == "train"]
    if not runs:
        raise InputError("no identification run with a steady sine", remedy="check the split column of runs.csv")
    return runs
