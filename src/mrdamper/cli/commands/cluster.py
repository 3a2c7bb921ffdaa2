"""`mrdamper cluster`: how to start a cluster for `mrdamper fleet`."""

from __future__ import annotations

from importlib.resources import files

import typer

app = typer.Typer()


@app.command(epilog="Example: mrdamper cluster --host 10.0.0.5")
def cluster(
    host: str = typer.Option("127.0.0.1", help="Address of the machine the scheduler will run on."),
    port: int = typer.Option(8786, min=1, max=65535, help="Its port."),
) -> None:
    """Show how to start a computing cluster for fleet."""
    text = files("mrdamper.cli").joinpath("templates", "cluster.txt").read_text(encoding="utf-8")
    print(text.format(host=host, port=port), end="")
