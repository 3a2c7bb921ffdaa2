"""`mrdamper validate`: errors of a saved model on measured runs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from mrdamper.cli.output import put, warn
from mrdamper.cli.progress import watched
from mrdamper.errors import InputError, UnknownNameError

if TYPE_CHECKING:
    from mrdamper.dampers.base import Damper
    from mrdamper.data import Dataset
    from mrdamper.study.validation import RunScore, Validation

app = typer.Typer()


@app.command(epilog="Example: mrdamper validate model.json rig/ --out scores.csv")
def validate(
    model: Path = typer.Argument(..., help="model.json written by mrdamper study."),
    data: Path | None = typer.Argument(None, help="Dataset folder; default: the bundled tests."),
    rig: str | None = typer.Option(None, help="Use the runs of this rig instead of the model's."),
    split: str | None = typer.Option(None, help="Only identification (train) or only validation (validate) runs."),
    check_run: list[str] = typer.Option([], help="Check run that corrects its session; may be repeated."),
    own_sessions: bool = typer.Option(
        False, "--own-sessions", help="Correct for the sessions of the identification runs."
    ),
    level: float = typer.Option(0.9, help="Coverage of the prediction interval of the peak force."),
    out: Path | None = typer.Option(None, help="CSV to write; default: standard output."),
    as_json: bool = typer.Option(False, "--json", help="Print JSON instead of CSV."),
) -> None:
    """Calculate the errors of a saved model on measured runs.

    Per run: nrmse_pp, nrmse_std, wape, errors of peak force and dissipated energy.
    """
    from mrdamper.dampers.model_file import load_model
    from mrdamper.dampers.sessions import RecordingTime, sessions_known
    from mrdamper.data import SPLITS
    from mrdamper.data.atomic import require_writable
    from mrdamper.data.encoding import csv_text
    from mrdamper.identification.intervals import student
    from mrdamper.report.tables import score_row
    from mrdamper.rig_files.dataset_folder import load_dataset
    from mrdamper.study.validation import peak_band
    from mrdamper.study.validation import validate as score

    if split not in (None, *SPLITS):
        raise UnknownNameError.of("split", str(split), SPLITS)
    student(level, 1.0)  # refuses an invalid level
    require_writable(out)
    damper = load_model(model)
    whole = _rig(load_dataset(data), rig, damper.rig)
    name = whole.rigs[0] or whole.name
    runs = [run for run in whole if split in (None, run.split)]
    if not runs:
        raise InputError(f"no {split} runs", where=f"rig {name}", remedy="leave out --split")
    sessions = (
        sessions_known(damper, [whole[n] for n in check_run], own_sessions) if check_run or own_sessions else None
    )
    validation = score(damper, watched([run for run in runs if run.id not in check_run], "run"), sessions=sessions)
    warn(f"not scored: {run_id}: {why}" for run_id, why in validation.refused.items())
    if not validation.runs:
        raise InputError("no run could be scored", where=f"rig {name}", remedy="see the lines above")
    by_id = {run.id: run for run in runs}
    expected = {
        run.run_id: sessions and sessions.expected(RecordingTime.of(by_id[run.run_id]), run.run_id)
        for run in validation.runs
    }
    peaks = {name: peak_band(damper, by_id[name], level, session) for name, session in expected.items()}
    put([{**score_row(run), **peaks[run.run_id]} for run in validation.runs], out, as_json, csv_text)
    _note_identification_runs(damper, [run for run in validation.runs if by_id[run.run_id].split == "train"])
    _print_summary(damper, validation, name, peaks.values(), level)


def _rig(dataset: Dataset, asked: str | None, of_model: str) -> Dataset:
    model = f"rig {of_model!r}" if of_model else "a rig without a name"
    names = [rig or dataset.name for rig in dataset.rigs]
    if asked is None and of_model not in dataset.rigs and len(names) == 1:
        asked = names[0]
        typer.echo(f"the model is of {model}; scoring the dataset's only rig, {asked!r}", err=True)
    if asked is None and of_model not in dataset.rigs:
        raise UnknownNameError(
            f"the model is of {model}, which is not in {dataset.name}",
            remedy=f"give a dataset folder after the model, or --rig NAME: {', '.join(names)}",
        )
    return dataset.rig(of_model if asked is None else asked)


def _note_identification_runs(damper: Damper, runs: Sequence[RunScore]) -> None:
    """Tell how many runs of the split train have the names of those that the model was identified from."""
    fitted = damper.uncertainty.information if damper.uncertainty else {}
    if count := sum(run.run_id in fitted for run in runs):
        typer.echo(
            f"note: runs with names of the model's identification runs: {count}; if they are these, their errors are "
            "those of the fit, and --split validate omits them",
            err=True,
        )


def _chance(inside: int, runs: int, level: float) -> float:
    """Probability that no more than some of a number of independent runs lie inside a band of a level."""
    return sum(math.comb(runs, k) * level**k * (1 - level) ** (runs - k) for k in range(inside + 1))


def _print_summary(
    damper: Damper, validation: Validation, rig: str, peaks: Iterable[dict[str, float]], level: float
) -> None:
    from mrdamper.dampers.sessions import KNOWN
    from mrdamper.data.wording import counted

    inside = [
        p["peak_force_low_N"] <= p["peak_force_measured_N"] <= p["peak_force_high_N"]
        for p in peaks
        if "peak_force_low_N" in p
    ]
    if inside:
        note = " (too few runs to tell a share)" if len(inside) < 20 else ""
        if _chance(sum(inside), len(inside), level) < 0.01:
            note = ": the band does not hold for these runs, of another state or session of the damper, or another rig"
        typer.echo(
            f"peak force inside its {100 * level:g} % prediction interval in {sum(inside)} of {len(inside)} runs{note}",
            err=True,
        )
    floors = [run.floor for run in validation.runs if run.floor is not None]
    outside = sum(bool(run.extrapolation) for run in validation.runs)
    typer.echo(
        f"{damper.title} on {counted(len(validation.runs), 'run')} of {rig}: median nrmse_pp "
        f"{100 * validation.median():.2f} %, worst {100 * validation.worst().scores.nrmse_pp:.2f} % "
        f"({validation.worst().run_id}), median energy error {100 * validation.median('energy_error'):.1f} %"
        + (f", scatter of the rig {100 * sorted(floors)[len(floors) // 2]:.2f} %" if floors else "")
        + (f"; extrapolation in {counted(outside, 'run')}" if outside else "")
        + f"; runs corrected for their session: {sum(run.session == KNOWN for run in validation.runs)}",
        err=True,
    )
