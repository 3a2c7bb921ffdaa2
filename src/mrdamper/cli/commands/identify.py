"""`mrdamper identify`: one model identified from each run."""

from __future__ import annotations

from pathlib import Path

import typer

from mrdamper.cli.output import parse_gas, parse_numbers, parse_pairs, put, warn
from mrdamper.cli.progress import watched

_MAX_WARNINGS = 10  # number of lines on the terminal

app = typer.Typer()


@app.command(epilog="Example: mrdamper identify rig/ --model bouc-wen --free n --out identifications.csv")
def identify(
    data: Path | None = typer.Argument(None, help="Dataset folder; default: the bundled tests."),
    model: str = typer.Option("bouc-wen", help="Name of the model."),
    method: str = typer.Option("projection", help="Name of the identification method."),
    free: list[str] = typer.Option([], help="Also identify this preset parameter; may be repeated."),
    fix: list[str] = typer.Option([], help="NAME=VALUE [SI]: fix a parameter; may be repeated."),
    setting: list[str] = typer.Option([], "--set", help="SETTING=VALUE of the method; may be repeated."),
    gas: str | None = typer.Option(None, help="Gas spring as P,V,A: pressure [MPa], volume [cm3], rod area [mm2]."),
    delay: bool = typer.Option(False, "--delay", help="Also identify a delay of the force up to 3 ms."),
    clipped: bool = typer.Option(False, "--clipped", help="Also use runs with a clipped channel."),
    run: list[str] = typer.Option([], help="Identify only this run; may be repeated."),
    out: Path | None = typer.Option(None, help="CSV to write; default: standard output."),
    as_json: bool = typer.Option(False, "--json", help="Print JSON instead of CSV."),
) -> None:
    """Identify one model from every sine run, one run at a time."""
    from mrdamper import identification
    from mrdamper.data.atomic import require_writable
    from mrdamper.data.encoding import csv_text
    from mrdamper.identification.methods import method_named
    from mrdamper.models import model_type
    from mrdamper.physics.motion.sines import analyse_motion
    from mrdamper.report.limitations import short_records
    from mrdamper.report.tables import identification_rows
    from mrdamper.rig_files.dataset_folder import load_dataset
    from mrdamper.study.usable_runs import usable_sines

    chosen_model, chosen_method = model_type(model), method_named(method, parse_pairs(setting, "--set"))
    spring = parse_gas(gas)
    fixed = parse_numbers(fix, "--fix", "write --fix NAME=VALUE with a number in SI units")
    require_writable(out)
    dataset = load_dataset(data)
    if run:
        dataset = dataset.only([dataset[name] for name in run])
    sines, refused = usable_sines(dataset, clipped)
    options = {"free": free, "fixed": fixed, "gas": spring, "with_delay": delay, "clipped": clipped}
    identifications = [
        identification.identify(entry, chosen_model, chosen_method, **options) for entry in watched(sines, "run")
    ]
    warn(f"not identified: {name}: {why}" for name, why in refused.items())
    put(identification_rows(identifications, dataset.name), out, as_json, csv_text)
    doubts = [f"warning: run {one.run_id}: {doubt}" for one in identifications for doubt in one.doubts]
    warn(short_records({entry.id: analyse_motion(entry).cycles for entry in sines}))
    warn(doubts[:_MAX_WARNINGS])
    if len(doubts) > _MAX_WARNINGS:
        typer.echo(f"warning: {len(doubts) - _MAX_WARNINGS} more of this kind in the column notes", err=True)
