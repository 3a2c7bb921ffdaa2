"""`mrdamper reproduce`: the study of Qian et al. 2024 on the virtual rig, or on a dataset."""

from __future__ import annotations

from pathlib import Path

import typer


def register(app: typer.Typer) -> None:
    """Add the command."""

    @app.command(
        help="Reproduce the study of Qian et al. 2024, claim by claim, on the (synthetic) virtual rig or on data."
    )
    def reproduce(
        out: Path = typer.Option(..., "--out", help="Folder for reproduction.html, tables and figures."),
        data: Path | None = typer.Option(None, "--data", help="Dataset folder; default: the virtual rig, synthetic."),
        rig: str | None = typer.Option(None, "--rig", help="Rig of the dataset; needed where it holds several."),
        with_direct_genetic: bool = typer.Option(
            False,
            "--with-direct-genetic",
            help="Also identify all parameters at once by the genetic algorithm (minutes).",
        ),
        with_models: bool = typer.Option(False, "--with-models", help="Also the other models of the literature."),
        seeds: int = typer.Option(20, "--seeds", min=0, help="Noise seeds of the virtual rig."),
        as_json: bool = typer.Option(False, "--json", help="Print the verdicts and claims for a program."),
    ) -> None:
        """Example: mrdamper reproduce --out result/"""
        import json

        from mrdamper.cli.progress import progress_on_stderr
        from mrdamper.errors import InputError
        from mrdamper.files.atomic import require_writable
        from mrdamper.files.dataset import load_dataset
        from mrdamper.reproduction import reproduce as run_reproduction
        from mrdamper.reproduction.claims import judge
        from mrdamper.reproduction.output import verdicts, write_reproduction

        require_writable(out)
        dataset = None if data is None else load_dataset(data)
        if dataset is None and rig is not None:
            raise InputError("--rig without --data", mend="give --data DATASET, or leave --rig out")
        if dataset is not None:
            if rig is None and len(dataset.rigs) > 1:
                names = " or ".join(dataset.rigs)
                raise InputError(f"the dataset holds {len(dataset.rigs)} rigs", mend=f"choose --rig {names}")
            dataset = dataset.rig(rig or next(iter(dataset.rigs)))
        with progress_on_stderr() as progress:
            study = run_reproduction(
                dataset,
                with_direct_genetic=with_direct_genetic,
                with_models=with_models,
                seeds=seeds,
                progress=lambda what, share: progress(what, 0.85 * share),
            )
            written = write_reproduction(study, out, lambda what, share: progress(what, 0.85 + 0.15 * share))
        if as_json:
            claims = [{"claim": c.text, "verdict": c.verdict, "evidence": c.evidence} for c in judge(study)]
            found = {"synthetic": study.rig is not None, "verdicts": verdicts(study), "claims": claims}
            print(json.dumps(found | {"seconds": study.seconds, "files": [str(p) for p in written]}, indent=1))
            return
        if study.rig is not None:
            print("virtual rig: every number is synthetic")
        for row in verdicts(study):
            print(f"  {row['method']:56} held out nrmse_pp {100 * row['nrmse_pp']:5.2f} %  {row['seconds']:6.1f} s")
        print(f"page: {written[0]}")
