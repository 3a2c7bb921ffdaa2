"""`mrdamper split`: which runs of a dataset are held out for validation."""

from __future__ import annotations

from pathlib import Path

import typer


def register(app: typer.Typer) -> None:
    """Add the command."""

    @app.command(epilog="Example: mrdamper split rig; mrdamper split rig --current 0.5; mrdamper split rig --every 4")
    def split(
        data: Path = typer.Argument(..., help="Dataset folder."),
        run: list[str] = typer.Option([], "--run", help="Hold this run out; may be repeated."),
        current: list[float] = typer.Option([], "--current", help="Hold every run at this current out [A]."),
        condition: list[str] = typer.Option([], "--condition", help="Hold this condition out: A,Hz,mm."),
        every: int | None = typer.Option(None, "--every", min=2, help="Hold every n-th run out."),
        none: bool = typer.Option(False, "--none", help="Hold nothing out."),
        replace: bool = typer.Option(False, "--replace", help="Give up the split that the dataset has."),
    ) -> None:
        """Hold runs out: by hand, by condition, a whole current, every n-th, or a stratified fifth.

        Held-out runs are never identified from; every report scores the model on them.
        """
        from mrdamper.files.dataset import load_dataset, store_split
        from mrdamper.study.split import hold_out

        dataset = load_dataset(data)
        chosen = hold_out(
            dataset, runs=run, currents=current, conditions=condition, every=every, none=none, replace=replace
        )
        store_split(data, chosen.held_out)
        for item in dataset:
            print(f"{'validate' if item.id in chosen.held_out else 'train':8}  {item.id}  {chosen.shown[item.id]}")
        print(f"{len(chosen.held_out)} of {len(dataset)} runs held out: {chosen.reason}")
