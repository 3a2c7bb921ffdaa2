"""`mrdamper report`: test report of one damper, or comparison of several."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from mrdamper.cli.output import warn
from mrdamper.cli.progress import progress_on_stderr

if TYPE_CHECKING:
    from mrdamper.data import Dataset

app = typer.Typer()


@app.command(epilog="Example: mrdamper report before/ after/ --about about.toml --out report/")
def report(
    specimens: list[str] = typer.Argument(help="Dataset folders, one per damper; FOLDER:RIG if it holds several."),
    out: Path = typer.Option(..., help="Folder for report.html, report.pdf, tables and figures."),
    about: Path | None = typer.Option(None, help="TOML file with customer, type, serial, logo (mrdamper init about)."),
    limits: Path | None = typer.Option(None, help="TOML file with force limits (mrdamper init limits)."),
    velocities: str = typer.Option("", help="Velocities of the force table [m/s], such as 0.05,0.1,0.2."),
    paper: str = typer.Option("a4", help="Page size of report.pdf: a4 or letter."),
    png: bool = typer.Option(False, "--png", help="Also write every figure as PNG."),
) -> None:
    """Write a test report of one or several dampers.

    It holds forces at set velocities, peak force over velocity, cycles, friction and gas force.
    No model is identified.
    """
    from mrdamper.data.atomic import require_writable
    from mrdamper.report.about import load_about, load_limits, parse_ladder
    from mrdamper.report.damper_tests import write_test_report
    from mrdamper.report.page import paper_size

    ladder, page_size = parse_ladder(velocities), paper_size(paper)
    head = load_about(about) if about else None
    bands = load_limits(limits) if limits else ()
    require_writable(out, "report")
    with progress_on_stderr() as progress:
        progress("reading", 0.0)
        loaded = dict(_specimen(text) for text in specimens)
        progress("report", 0.4)
        aside: list[str] = []
        written = write_test_report(
            loaded, out, about=head, limits=bands, ladder=ladder, png=png, paper=page_size, tell=aside.append
        )
        progress("written", 1.0)
    warn(aside)
    print(f"report: {written[0]}")


def _specimen(text: str) -> tuple[str, Dataset]:
    from mrdamper.rig_files.dataset_folder import load_dataset

    folder, _, rig = text.rpartition(":") if not Path(text).is_dir() and ":" in text else (text, "", "")
    dataset = load_dataset(folder)
    if rig:
        return rig, dataset.rig(rig)
    return dataset.name, dataset
