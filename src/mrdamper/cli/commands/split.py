"""`mrdamper split`: choice of the validation runs of a dataset."""

from __future__ import annotations

from pathlib import Path

import typer

app = typer.Typer()


@app.command(epilog="Example: mrdamper split rig; mrdamper split rig --current 0.5; mrdamper split rig --every 4")
def split(
    data: Path = typer.Argument(..., help="Dataset folder."),
    run: list[str] = typer.Option([], help="Use this run for validation; may be repeated."),
    current: list[float] = typer.Option([], help="Use every run at this current for validation [A]."),
    condition: list[str] = typer.Option([], help="Use this condition for validation: A,Hz,mm."),
    every: int | None = typer.Option(None, min=2, help="Use every n-th run for validation."),
    none: bool = typer.Option(False, "--none", help="Use all runs for identification."),
    replace: bool = typer.Option(False, "--replace", help="Replace the present split of the dataset."),
) -> None:
    """Choose the validation runs of a dataset.

    Without options a stratified fifth of the runs is chosen. Validation runs are never used for
    identification; reports state the error on them.
    """
    from mrdamper.rig_files.dataset_folder import load_dataset, store_split
    from mrdamper.study.split import hold_out

    dataset = load_dataset(data)
    chosen = hold_out(
        dataset, runs=run, currents=current, conditions=condition, every=every, none=none, replace=replace
    )
    store_split(data, chosen.held_out)
    for item in dataset:
        print(f"{'validate' if item.id in chosen.held_out else 'train':8}  {item.id}  {chosen.shown[item.id]}")
    print(f"{len(chosen.held_out)} of {len(dataset)} runs are validation runs: {chosen.reason}")
