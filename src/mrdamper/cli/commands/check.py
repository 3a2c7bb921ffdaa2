"""`mrdamper check`: quality checks of a stored dataset, or checks of an exported FMU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from mrdamper.cli.output import aligned, figure_kind, finding_lines, put, put_figure, warn
from mrdamper.cli.progress import watched
from mrdamper.errors import InputError

if TYPE_CHECKING:
    from mrdamper.cli.output import Rows
    from mrdamper.data import Run

app = typer.Typer()


@app.command(epilog="Example: mrdamper check rig/ --figure loops.png")
def check(
    data: Path | None = typer.Argument(None, help="Dataset folder, or an .fmu; default: the bundled tests."),
    figure: Path | None = typer.Option(None, help="Draw the loops with flagged samples: PNG, SVG or PDF."),
    verbose: bool = typer.Option(False, "--verbose", help="Print the findings of every run."),
    as_json: bool = typer.Option(False, "--json", help="Print JSON instead of a table."),
) -> None:
    """Check the quality of every run of a dataset.

    Sign, lag, clipping, distortion and drift are checked; the exit status is 2 if a run is refused.

    An exported FMU is loaded and compared with its reference force.
    """
    from mrdamper.data.atomic import require_writable
    from mrdamper.report.limitations import short_records
    from mrdamper.rig_files.dataset_folder import load_dataset
    from mrdamper.rig_files.mapping.comparisons import in_another_unit
    from mrdamper.rig_files.quality.table import quality_table, record_of, row

    if data is not None and data.suffix.lower() == ".fmu":
        if figure is not None:
            raise InputError("--figure for an FMU", remedy="omit --figure, which draws test runs", code="E_OPTION")
        _check_fmu(data, as_json)
        return
    if figure is not None:
        require_writable(figure)
        figure_kind(figure)
    runs = load_dataset(data).runs
    verdicts = quality_table(record_of(run) for run in watched(runs, "run"))
    put([row(verdict) for verdict in verdicts], None, as_json, _text_table)
    refused = [f"refused: {verdict.refusal}" for verdict in verdicts if verdict.refusal is not None]
    others = in_another_unit([v.record for v in verdicts])
    findings = ((v.record.id, f) for i, v in enumerate(verdicts) for f in (*v.findings, *filter(None, [others.get(i)])))
    repeats = _unequal_repeats([r for r, v in zip(runs, verdicts, strict=True) if v.refusal is None])
    short = short_records({v.record.id: v.figures["cycles"] for v in verdicts if "cycles" in v.figures})
    warn([*refused, *finding_lines(findings, verbose), *short, *repeats])
    if figure is not None:
        from mrdamper.report.plots.quality import quality_figure
        from mrdamper.rig_files.quality.flat import flagged_samples
        from mrdamper.rig_files.quality.view import View

        put_figure(quality_figure([(verdict, flagged_samples(View(verdict.record))) for verdict in verdicts]), figure)
    if refused:
        raise typer.Exit(2)


def _unequal_repeats(runs: Sequence[Run]) -> list[str]:
    from mrdamper.study.contradictions import REPEATS_CODE, tracks_of, unequal_repeats

    rigs = [[run for run in runs if run.rig == rig] for rig in dict.fromkeys(run.rig for run in runs)]
    return [f"{REPEATS_CODE}: {text}" for rig in rigs for text in unequal_repeats(tracks_of(rig))]


def _check_fmu(path: Path, as_json: bool) -> None:
    from mrdamper.exporters.fmu_check import check_fmu

    findings = check_fmu(path)
    rows = [asdict(finding) for finding in findings]
    put(rows, None, as_json, lambda _: "".join(f"{f.level}: {f}\n" for f in findings) or "nothing found\n")
    if any(finding.level == "error" for finding in findings):
        raise typer.Exit(2)


def _text_table(rows: Rows) -> str:
    from mrdamper.rig_files.quality.table import FIGURES

    headings = {"run_id": "run"} | {name: text for name, (text, _) in FIGURES.items() if text}
    headings |= {name: name for name in ("verdict", "findings")}
    cells = [["–" if row[name] is None else str(row[name]) for name in headings] for row in rows]
    lines = aligned([list(headings.values()), *cells], (0, len(headings) - 2, len(headings) - 1))
    return "".join(f"{line}\n" for line in lines)
