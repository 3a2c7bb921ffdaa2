"""`mrdamper study`: identification, validation and report of a dataset."""

from __future__ import annotations

import json
import os
from pathlib import Path

import typer


def register(app: typer.Typer) -> None:
    """Add the command."""

    @app.command(epilog="Example: mrdamper study rig/ --out result/")
    def study(
        data: Path | None = typer.Argument(None, help="Dataset folder; default: the bundled tests of two dampers."),
        out: Path = typer.Option(..., "--out", help="Folder for report.html, model.json, tables and figures."),
        model: str | None = typer.Option(
            None, "--model", help="Save this model instead of the best one; paper: the method of Qian et al. 2024."
        ),
        gas: str | None = typer.Option(
            None, "--gas", help="Known gas spring for --model paper: pressure MPa, volume cm3, rod area mm2, as P,V,A."
        ),
        setting: list[str] = typer.Option(
            [], "--set", help="OPTION=VALUE of --model paper (n, gamma, mass_law, search, ...); may be repeated."
        ),
        about: Path | None = typer.Option(
            None, "--about", help="TOML file with customer, specimen, logo (mrdamper init about)."
        ),
        limits: Path | None = typer.Option(
            None, "--limits", help="TOML file with force limits (mrdamper init limits)."
        ),
        pdf: bool = typer.Option(False, "--pdf", help="Also write report.pdf and every figure as PDF."),
        png: bool = typer.Option(False, "--png", help="Also write every figure as PNG."),
        lag: bool = typer.Option(False, "--lag", help="Require tests from which the coil lag can be identified."),
        keep: list[str] = typer.Option(
            [], "--keep", help="Use this run although it contradicts the others; repeatable."
        ),
        as_json: bool = typer.Option(False, "--json", help="Print the summary as JSON."),
    ) -> None:
        """Identify, validate and report a dataset in one step.

        Every run is identified, models of the whole damper are fitted and cross-validated, and the
        best is saved with a report.
        """
        from mrdamper.cli.output import parse_gas, parse_pairs, percent, spread
        from mrdamper.cli.progress import progress_on_stderr
        from mrdamper.dampers.certainty import table, unsure
        from mrdamper.errors import IdentificationError, InputError
        from mrdamper.files.atomic import require_writable
        from mrdamper.files.dataset import load_dataset
        from mrdamper.report.about import load_about, load_limits
        from mrdamper.report.study import study_and_draw, write_study
        from mrdamper.study.parallel import several
        from mrdamper.study.recipe import study_method, study_methods

        chosen = model
        if model in study_methods():
            chosen = study_method(str(model), parse_pairs(setting, "--set"), parse_gas(gas))
        elif gas or setting:
            raise InputError(
                "--gas and --set are options of a published method", mend="add --model paper, or omit them"
            )
        head, bands = load_about(about) if about else None, load_limits(limits) if limits else ()
        also = [kind for kind, wanted in (("pdf", pdf or about is not None), ("png", png)) if wanted]
        require_writable(out)
        dataset = load_dataset(data)
        if lag and not any(run.current_changes for run in dataset.split("train")):
            raise IdentificationError(
                "the current is constant in every identification run, so the coil lag cannot be identified",
                mend="record a run in which the current is switched, or omit --lag",
                code="E_LAG",
            )
        workers = min(os.cpu_count() or 1, len(dataset.rigs))
        with progress_on_stderr() as progress, several(workers) as processes:
            result, drawn = study_and_draw(
                dataset,
                lambda what, share: progress(what, 0.97 * share),
                model=chosen,
                keep=keep,
                also=also,
                processes=processes,
            )
            written = write_study(
                result,
                out,
                lambda what, share: progress(what, 0.97 + 0.03 * share),
                about=head,
                limits=bands,
                also=also,
                drawn=drawn,
            )
        for rig in result.rigs:
            aside = {one.run_id for one in rig.contradictions}
            for name, why in rig.not_identified.items():
                typer.echo(f"{'set aside' if name in aside else 'not identified'}: {name}: {why}", err=True)
            for note in rig.chosen.recipe.notes:
                typer.echo(f"note: {note}", err=True)
        if as_json:
            print(json.dumps(_summary(result, [str(p) for p in written]), indent=1))
            return
        for rig in result.rigs:
            print(f"{rig.rig or dataset.name}: {rig.damper.title} ({rig.damper.parameter_count} numbers)")
            print(f"  {'nrmse_pp, median (worst) of the runs':38}{'left out':>19}{'held out':>19}{'one by one':>12}")
            for candidate in rig.candidates:
                left_out, held_out = (spread(scores) for scores in (candidate.cross_validated, candidate.validation))
                print(f"  {candidate.title:38}{left_out:>19}{held_out:>19}{percent(candidate.per_run):>12}")
            if rig.calibration is not None:
                print(f"  {rig.calibration.found}")
            numbers = (f"{row['name']} {row['written']}" for row in table(rig.damper))
            print(f"  numbers, 95 %: {'; '.join(numbers)}")
            for doubt in unsure(rig.damper):
                print(f"  {doubt}")
        print(f"report: {written[0]}")


def _summary(result, written: list[str]) -> dict:
    return {
        "rigs": {
            rig.rig: {
                "chosen": rig.chosen.title,
                "candidates": {
                    c.title: {
                        "parameters": c.damper.parameter_count,
                        "per_run_nrmse_pp": c.per_run if c.identifications else None,
                        "cv_nrmse_pp": c.cross_validated.median(),
                        "cv_worst_nrmse_pp": c.cross_validated.worst_error(),
                        "validation_nrmse_pp": c.validation.median() if c.validation.runs else None,
                        "validation_worst_nrmse_pp": c.validation.worst_error() if c.validation.runs else None,
                    }
                    for c in rig.candidates
                },
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
