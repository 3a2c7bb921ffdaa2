"""`mrdamper plugins`: the parts that installed packages provide."""

from __future__ import annotations

import json
import warnings
from dataclasses import asdict
from itertools import groupby

import typer

from mrdamper.discovery import PluginWarning, all_parts

app = typer.Typer()


@app.command(epilog="Example: mrdamper plugins")
def plugins(as_json: bool = typer.Option(False, "--json", help="Print JSON.")) -> None:
    """List models, readers and other parts by their package."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PluginWarning)  # the list contains skipped parts
        parts = all_parts()
    if as_json:
        print(json.dumps([asdict(part) for part in parts], indent=1))
        return
    used = sorted((part for part in parts if not part.problem), key=lambda part: (not part.own, part.package))
    for package, provided in groupby(used, key=lambda part: part.package):
        print(package)
        for group, members in groupby(provided, key=lambda part: part.group):
            print(f"  {group.removeprefix('mrdamper.'):12} {', '.join(part.name for part in members)}")
    for part in parts:
        if part.problem:
            print(f"skipped: {part.name} of {part.package} ({part.group}): {part.problem}")
