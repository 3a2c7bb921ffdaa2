"""`mrdamper rigs`: the rigs of a dataset."""

from __future__ import annotations

from pathlib import Path

import typer

app = typer.Typer()


@app.command(epilog="Example: mrdamper rigs")
def rigs(data: Path | None = typer.Argument(None, help="Dataset folder; default: the bundled tests.")) -> None:
    """List the rigs of a dataset."""
    from mrdamper.rig_files.dataset_folder import load_dataset

    print("\n".join(load_dataset(data).rigs))
