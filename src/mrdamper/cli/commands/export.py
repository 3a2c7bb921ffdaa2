"""`mrdamper export`: a saved model in other formats."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from mrdamper.cli.output import warn
from mrdamper.cli.progress import progress_soon
from mrdamper.errors import InputError

if TYPE_CHECKING:
    from mrdamper.dampers.base import Damper
    from mrdamper.exporters.base import Exporter

app = typer.Typer()


@app.command(epilog="Example: mrdamper export model.json --to fmu --out damper.fmu")
def export(
    model: Path = typer.Argument(..., help="model.json written by mrdamper study."),
    to: str = typer.Option(..., help="c, fmu, page, latex, markdown, table, adams, tydex, dyna4."),
    out: Path = typer.Option(..., help="Folder; for fmu, page, latex, markdown, tydex and dyna4 a file."),
    name: str | None = typer.Option(None, help="Name of files and symbols; default: the rig."),
    inverse: bool = typer.Option(
        False, "--inverse", help="For c and fmu: the inverse model, current from demanded force."
    ),
    fmi: int | None = typer.Option(None, help="For fmu: FMI version, 2 (default) or 3."),
) -> None:
    """Export a model as C, FMU, web page, equations or tables."""
    from mrdamper.dampers.model_file import load_model
    from mrdamper.data.atomic import require_writable
    from mrdamper.exporters import exporter
    from mrdamper.exporters.base import identifier, write_export

    kind = exporter(to)
    if fmi is not None and to != "fmu":
        raise InputError(f"--fmi {fmi} with --to {to}", remedy="leave --fmi out, or export --to fmu", code="E_OPTION")
    options = {} if fmi is None else {"fmi": fmi}
    format_writer = kind(**options)
    require_writable(out)
    damper = load_model(model)
    called = identifier(name or damper.rig or "damper")
    with progress_soon(f"making {to}{' and checking it' if to == 'fmu' else ''}"):
        if inverse:
            paths, notes = _inverse(damper, f"{called}_inverse", to, format_writer, out)
        else:
            written = format_writer.export(damper, called)
            paths, notes = write_export(written, out, kind.suffix), written.notes
    for path in paths:
        typer.echo(path)
    warn(f"note: {note}" for note in notes)


def _inverse(damper: Damper, name: str, to: str, exporter: Exporter, out: Path) -> tuple[list[Path], tuple[str, ...]]:
    from mrdamper.exporters.c import write_program
    from mrdamper.exporters.fmu import FMUExporter
    from mrdamper.exporters.fmu_program import write_program_fmu
    from mrdamper.systems.inverse import invert

    turned = invert(damper)
    title = (
        f"{turned.title}, {turned.scope}; a wanted force outside lowest to highest is answered by the nearer of them"
    )
    if to == "c":
        return write_program(turned.program, name, title, turned.units, out), ()
    if isinstance(exporter, FMUExporter):
        return write_program_fmu(turned.program, name, title, turned.units, out, exporter=exporter)
    raise InputError(f"--inverse with --to {to}", remedy="export --to c or fmu", code="E_OPTION")
