"""`mrdamper fleet`: identification of a population of dampers."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from mrdamper.cli.output import shortened, warn
from mrdamper.cli.progress import progress_on_stderr

if TYPE_CHECKING:
    from mrdamper.fleet.run import Fleet

app = typer.Typer()


@app.command(epilog="Example: mrdamper fleet records/ --out line/ --workers 8")
def fleet(
    source: Path = typer.Argument(
        ..., metavar="SRC", help="Folder of datasets or rig files, one per damper, or of Parquet files."
    ),
    out: Path = typer.Option(..., help="Folder for dampers.parquet and the journal."),
    workers: int | None = typer.Option(None, min=1, help="Number of processes; default: one per core."),
    scheduler: str | None = typer.Option(None, help="Address of a Dask scheduler (see mrdamper cluster)."),
    tls: Path | None = typer.Option(None, help="Folder with ca.pem, cert.pem and key.pem, for a tls:// scheduler."),
    profile: Path | None = typer.Option(
        None, help="Fleet profile (TOML): serial numbers, master dampers, rig profile."
    ),
    limits: Path | None = typer.Option(
        None, help="TOML file with limits of the result columns (mrdamper init limits)."
    ),
    model: str = typer.Option("play-bypass", help="Model fitted to all runs of each damper."),
    cold: bool = typer.Option(
        False, "--cold", help="Start every search without a previous result (slower, for checking)."
    ),
    verbose: bool = typer.Option(False, "--verbose", help="Print every damper that was not identified."),
    as_json: bool = typer.Option(False, "--json", help="Print the summary as JSON."),
) -> None:
    """Identify many dampers and write one table.

    An interrupted run continues when the same command is given again.
    """
    from mrdamper.fleet.page import write_page
    from mrdamper.fleet.profile import load_fleet_profile, load_limits
    from mrdamper.fleet.run import run_fleet

    bounds = {} if limits is None else load_limits(limits)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with progress_on_stderr() as progress:
            outcome = run_fleet(
                source,
                out,
                profile=load_fleet_profile(profile),
                model=model,
                cold=cold,
                workers=workers or os.cpu_count() or 1,
                scheduler=scheduler,
                tls=tls,
                progress=progress,
            )
            progress("page", 1.0)
            page = outcome.table.with_name("fleet.html")
            text = write_page(outcome.table, outcome.plan, bounds, page)
    except KeyboardInterrupt:
        typer.echo("stopped; finished dampers are saved: run the same command again to continue", err=True)
        raise typer.Exit(130) from None
    _print(outcome, page, text, verbose, as_json)
    if not outcome.done:
        raise typer.Exit(2)


def _print(outcome: Fleet, page: Path, messages: list[str], verbose: bool, as_json: bool) -> None:
    warn(shortened([f"{status}: {name}: {reason}" for name, status, reason in outcome.troubled], 8, verbose))
    if as_json:
        summary = {name: getattr(outcome, name) for name in ("dampers", "done", "already")}
        troubled = [dict(zip(("name", "status", "reason"), one, strict=True)) for one in outcome.troubled]
        summary |= {"troubled": troubled, "table": str(outcome.table), "page": str(page), "messages": messages}
        print(json.dumps(summary, indent=1, ensure_ascii=False))
        return
    print(f"{outcome.done} of {outcome.dampers} dampers identified ({outcome.already} in an earlier run)")
    print("".join(f"{line}\n" for line in shortened(messages, 8, verbose)), end="")
    print(f"table: {outcome.table}\npage: {page}")
