"""`mrdamper init`: template of a file that other commands read."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import typer

from mrdamper.cli.output import put_text
from mrdamper.errors import OutputError, UnknownNameError

_FILES = {"about": "about.toml", "limits": "limits.toml", "profile": "profile.toml", "tests": "tests.csv"}

app = typer.Typer()


@app.command(epilog="Example: mrdamper init limits --out limits.toml")
def init(
    kind: str = typer.Argument(..., help=f"Kind of file: {', '.join(_FILES)}."),
    out: Path | None = typer.Option(None, help="File to write; default: standard output."),
) -> None:
    """Write a commented template: about, limits, profile or tests.

    about: head of a report. limits: force limits, limits of the test rig, limits of fleet columns.
    profile: columns and units of rig files. tests: table of tests with their currents.
    """
    text = template(kind)
    if out is not None and out.exists():
        raise OutputError("this file exists", where=str(out), remedy="choose another name, or delete it first")
    put_text(text, out)
    if out is not None:
        typer.echo(f"template: {out}")


def template(kind: str) -> str:
    """Return the text of a template; raises `UnknownNameError` if there is none of that name."""
    if kind not in _FILES:
        raise UnknownNameError.of("template", kind, _FILES)
    return files("mrdamper.cli").joinpath("templates", _FILES[kind]).read_text(encoding="utf-8")
