"""`mrdamper predict`: the force at a condition, or along a motion."""

from __future__ import annotations

import math
from pathlib import Path

import typer

WARNINGS = {
    "not a sine": "the motion is no sine; a model over frequency and amplitude uses running estimates of them",
    "sampling": "fewer than two samples fall into the knee after a reversal; sample the motion faster",
}


def register(app: typer.Typer) -> None:
    """Add the command."""

    @app.command(
        epilog="Example: mrdamper predict model.json --current 0.5 --frequency 2 --amplitude 10 --out force.csv"
    )
    def predict(
        model: Path = typer.Argument(..., help="model.json written by mrdamper study."),
        current: float | None = typer.Option(None, "--current", help="Coil current [A]."),
        frequency: float | None = typer.Option(None, "--frequency", help="Frequency of a sine [Hz]."),
        amplitude: float | None = typer.Option(None, "--amplitude", help="Amplitude of a sine [mm]."),
        motion: Path | None = typer.Option(
            None, "--motion", help="CSV with time_s, displacement_m and optionally current_A."
        ),
        coil_lag: float | None = typer.Option(
            None, "--coil-lag", help="Time constant of the coil [ms], in place of the model's own."
        ),
        out: Path | None = typer.Option(None, "--out", help="CSV to write; default: standard output."),
        as_json: bool = typer.Option(False, "--json", help="Print JSON instead of CSV."),
    ) -> None:
        """Predict the force of a saved model at a condition, or along a motion from a file."""
        from dataclasses import replace

        from mrdamper.cli.output import put
        from mrdamper.dampers.coil import Coil
        from mrdamper.data import Condition
        from mrdamper.errors import ConditionError, InputError
        from mrdamper.files.atomic import require_writable
        from mrdamper.files.encoding import csv_text
        from mrdamper.files.model_file import load_model
        from mrdamper.files.motion import load_motion
        from mrdamper.report.tables import prediction_rows

        for name, value in (("--current", current), ("--frequency", frequency), ("--amplitude", amplitude)):
            if value is not None and not 0 <= value < math.inf:
                raise ConditionError(f"{name} {value:g}", mend="give zero or more; a field does not know a sign")
        if out is not None:
            require_writable(out)
        damper = load_model(model)
        if coil_lag is not None:
            driver = damper.coil.driver if damper.coil else None
            damper = replace(damper, coil=Coil(1e-3 * coil_lag, 1e-3 * coil_lag, driver))  # type: ignore[type-var]
        if motion is not None:
            if frequency is not None or amplitude is not None:
                raise InputError("--motion beside --frequency or --amplitude", mend="give one or the other")
            prediction = damper.predict_run(load_motion(motion, current))
        else:
            if current is None or frequency is None or amplitude is None:
                raise InputError(
                    "no condition", mend="give --current A --frequency Hz --amplitude mm, or --motion FILE"
                )
            prediction = damper.predict(Condition(current, frequency, 1e-3 * amplitude))
        for flag in prediction.extrapolation:
            typer.echo(
                f"warning: {WARNINGS.get(flag, f'{flag} lies outside the tests this model was identified from')}",
                err=True,
            )
        put(prediction_rows(prediction), out, as_json, csv_text)
