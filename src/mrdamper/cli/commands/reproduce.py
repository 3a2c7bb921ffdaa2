"""`mrdamper reproduce`: the study of Qian et al. 2024 on the virtual rig, or on a dataset."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from mrdamper.cli.output import aligned, parse_gas, parse_pairs, percent
from mrdamper.cli.progress import in_two, progress_on_stderr
from mrdamper.errors import InputError

if TYPE_CHECKING:
    from mrdamper.data import Dataset

app = typer.Typer()


@app.command(epilog="Example: mrdamper reproduce --out result/")
def reproduce(
    out: Path = typer.Option(..., help="Folder for reproduction.html, tables and figures."),
    data: Path | None = typer.Option(None, help="Dataset folder; default: the virtual rig, synthetic."),
    rig: str | None = typer.Option(None, help="Rig of the dataset; required if it has several."),
    comparators: bool = typer.Option(
        True, "--comparators/--no-comparators", help="The direct genetic search and Ali's model (half the time)."
    ),
    with_models: bool = typer.Option(False, "--with-models", help="Also the other models of the literature."),
    seeds: int = typer.Option(0, min=0, help="Noise seeds of the virtual rig; about 2 processor seconds each."),
    gas: str | None = typer.Option(
        None, help="Known gas spring of the data: pressure MPa, volume cm3, rod area mm2, as P,V,A."
    ),
    setting: list[str] = typer.Option(
        [], "--set", help="OPTION=VALUE of the method, as for study --model paper; may be repeated."
    ),
    jobs: int | None = typer.Option(None, min=1, help="Number of processes; default: one per core."),
    png: bool = typer.Option(False, "--png", help="Also write the figures as PNG."),
    as_json: bool = typer.Option(False, "--json", help="Print the verdicts and claims for a program."),
) -> None:
    """Reproduce the study of Qian et al. (2024).

    On the virtual rig (synthetic data) or on a dataset.
    """
    from mrdamper.data.atomic import require_writable
    from mrdamper.paper.options import PaperOptions
    from mrdamper.paper.output import summary, write_reproduction
    from mrdamper.paper.study import reproduce as run_reproduction
    from mrdamper.study.processes import several
    from mrdamper.study.recipe import study_method

    require_writable(out, "reproduce")
    if gas is not None and data is None:
        raise InputError("--gas without --data: the virtual rig has its own gas spring", remedy="give --data DATASET")
    options = study_method("paper", parse_pairs(setting, "--set"), parse_gas(gas))
    assert isinstance(options, PaperOptions)
    dataset = _one_rig(data, rig)
    with progress_on_stderr() as progress, several(jobs or os.cpu_count() or 1) as processes:
        reproducing, writing = in_two(progress, 0.85)
        study = run_reproduction(
            dataset,
            options,
            with_comparators=comparators,
            with_models=with_models,
            seeds=seeds,
            processes=processes,
            progress=reproducing,
        )
        written = write_reproduction(study, out, writing, png=png, processes=processes)
    text = summary(study)
    if as_json:
        print(json.dumps(text | {"files": [str(p) for p in written]}, indent=1))
    else:
        if study.rig is not None:
            print("virtual rig: all data are synthetic")
        _print(text)
        print(f"page: {written[0]}")


def _one_rig(data: Path | None, rig: str | None) -> Dataset | None:
    from mrdamper.rig_files.dataset_folder import load_dataset

    if data is None:
        if rig is not None:
            raise InputError("--rig without --data", remedy="give --data DATASET, or leave --rig out")
        return None
    dataset = load_dataset(data)
    if rig is None and len(dataset.rigs) > 1:
        names = " or ".join(dataset.rigs)
        raise InputError(f"the dataset holds {len(dataset.rigs)} rigs", remedy=f"choose --rig {names}")
    return dataset.rig(rig or next(iter(dataset.rigs)))


def _print(text: dict[str, Any]) -> None:
    rows: list[tuple[str, ...]] = [("validation runs, nrmse_pp", "median", "worst", "time, s")]
    for row, took in zip(text["verdicts"], text["times"], strict=False):
        errors = (math.nan if row[name] is None else row[name] for name in ("nrmse_pp", "worst_nrmse_pp"))
        rows.append((row["method"], *map(percent, errors), f"{took['seconds']:.1f}"))
    claims = aligned([(claim["said"], claim["claim"]) for claim in text["claims"]], (0, 1))
    print("\n".join(f"  {line}" for line in (*aligned(rows), *claims)))
