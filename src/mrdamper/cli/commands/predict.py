"""`mrdamper predict`: damper force at a test condition or along a motion."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from mrdamper.cli.output import figure_kind, json_rows, put_figure, put_text
from mrdamper.errors import ConditionError, InputError

if TYPE_CHECKING:
    from mrdamper.dampers.bands import Band
    from mrdamper.dampers.base import Damper
    from mrdamper.dampers.prediction import Prediction

WARNINGS = {
    "combination": "current, frequency and amplitude lie in their tested ranges, but not their combination",
    "not a sine": "the motion is no sine, as the tested ones are; its frequency and amplitude are estimates",
    "sampling": "fewer than two samples within the yield displacement after a reversal; increase the sampling rate",
}

_OFF_CENTRE = 0.1  # of the peak-to-peak motion: distance of its middle from mid-stroke that is told

app = typer.Typer()


@app.command(epilog="Example: mrdamper predict model.json --current 0.5 --frequency 2 --amplitude 10 --out force.csv")
def predict(
    model: Path = typer.Argument(..., help="model.json written by mrdamper study."),
    current: float | None = typer.Option(None, help="Coil current [A]."),
    frequency: float | None = typer.Option(None, help="Frequency of a sine [Hz]."),
    amplitude: float | None = typer.Option(None, help="Amplitude of a sine [mm]."),
    motion: Path | None = typer.Option(None, help="CSV with time, displacement from mid-stroke, optionally current."),
    coil_lag: float | None = typer.Option(None, help="Time constant of the coil [ms]; default: the model's value."),
    check_run: list[str] = typer.Option([], help="Check run of --data: correct gain and offset for its test session."),
    data: Path | None = typer.Option(None, help="Dataset with the check runs; default: bundled tests."),
    level: float = typer.Option(0.9, help="Coverage of the prediction interval."),
    out: Path | None = typer.Option(None, help="CSV to write; default: standard output."),
    plot: Path | None = typer.Option(None, help="Figure of the force to write (.png, .svg or .pdf)."),
    as_json: bool = typer.Option(False, "--json", help="Print JSON instead of CSV, with peak force, energy, damping."),
) -> None:
    """Predict the force at a test condition or along a motion.

    The prediction interval of the peak force, the dissipated energy and the equivalent damping
    are printed on standard error; of a motion without cycles, its whole dissipated energy.

    The columns of --motion have a name and a unit, such as time_s, displacement_m or
    Displacement [mm], current_A. The displacement is used as it stands and counts from mid-stroke.
    """
    from mrdamper.dampers.bands import band, no_band, scope
    from mrdamper.data.atomic import require_writable
    from mrdamper.data.encoding import csv_text, finite
    from mrdamper.identification.intervals import student
    from mrdamper.report.tables import prediction_rows

    if current is not None and not 0 <= current < math.inf:
        raise ConditionError(f"--current {current:g}", remedy="give zero or more; the sign does not matter")
    for name, value in (("--frequency", frequency), ("--amplitude", amplitude)):
        if value is not None and not 0 < value < math.inf:
            raise ConditionError(f"{name} {value:g}", remedy="give a positive number")
    student(level, 1.0)  # refuses an invalid level
    require_writable(out, makes_folders=False)
    require_writable(plot, makes_folders=False)
    if plot is not None:
        figure_kind(plot)
    damper = _load(model, coil_lag)
    prediction = _predict(damper, motion, current, frequency, amplitude)
    asked = (prediction.motion, prediction.condition)
    beyond = {b.quantity: f"{b} (extrapolation)" for one in asked for b in damper.envelope.outside(one)}
    for flag in prediction.extrapolation:
        typer.echo(f"warning: {(WARNINGS | beyond)[flag]}", err=True)
    interval = band(damper, prediction, level)
    if check_run:
        prediction, interval = _session_known(damper, prediction, check_run, data, level)
    summary = _summary(prediction, interval)
    typer.echo(_in_words(summary, interval, level, scope(damper, level)), err=True)
    if interval is None:
        typer.echo(f"note: {no_band(damper)}", err=True)
    if plot is not None:
        from mrdamper.report.plots.loops import predicted_force

        put_figure(predicted_force(prediction, interval, level), plot)
    rows = prediction_rows(prediction, interval)
    if not as_json:
        put_text(csv_text(rows), out)
        return
    numbers = {name: dict(zip(("value", "low", "high"), map(finite, of), strict=True)) for name, of in summary.items()}
    put_text(json.dumps({**numbers, "level": level, "samples": json_rows(rows)}, indent=1) + "\n", out)


def _load(model: Path, coil_lag: float | None) -> Damper:
    """Load the model; a coil lag [ms] replaces its own."""
    from mrdamper.dampers.coil import Coil
    from mrdamper.dampers.model_file import load_model

    damper = load_model(model)
    if coil_lag is None:
        return damper
    driver = damper.coil.driver if damper.coil else None
    return replace(damper, coil=Coil(1e-3 * coil_lag, 1e-3 * coil_lag, driver))


def _predict(
    damper: Damper, motion: Path | None, current: float | None, frequency: float | None, amplitude: float | None
) -> Prediction:
    """Predict along the motion of a file, or at a condition [A, Hz, mm]."""
    import numpy as np

    from mrdamper.data import Condition
    from mrdamper.data.wording import number
    from mrdamper.physics.motion import measured_motion

    if motion is not None:
        from mrdamper.rig_files.motion_file import load_motion

        if frequency is not None or amplitude is not None:
            raise InputError("--motion together with --frequency or --amplitude", remedy="give one of them")
        run = load_motion(motion, current)
        if replaced := run.notes.get("replaced"):
            typer.echo(f"note: --current {current:g} replaces {replaced} of {motion}", err=True)
        lowest, highest = np.min(run.displacement), np.max(run.displacement)
        if abs(middle := (lowest + highest) / 2) > _OFF_CENTRE * (highest - lowest):
            typer.echo(f"note: the middle of the motion lies {number(1e3 * middle, 3)} mm from mid-stroke", err=True)
        return damper.predict(measured_motion(run))
    if current is None or frequency is None or amplitude is None:
        raise InputError("no condition", remedy="give --current A --frequency Hz --amplitude mm, or --motion FILE")
    return damper.predict(Condition(current, frequency, 1e-3 * amplitude))


def _session_known(
    damper: Damper, prediction: Prediction, check_run: list[str], data: Path | None, level: float
) -> tuple[Prediction, Band | None]:
    """Correct gain and offset of a prediction for the session of the check runs; its band."""
    from mrdamper.dampers.bands import session_band
    from mrdamper.dampers.sessions import RecordingTime, sessions_known
    from mrdamper.data.wording import number
    from mrdamper.rig_files.dataset_folder import load_dataset

    dataset = load_dataset(data)
    runs = [dataset[name] for name in check_run]
    expected = sessions_known(damper, runs).expected(RecordingTime.of(runs[-1]))
    assert expected is not None  # the last check run's own session
    typer.echo(
        f"session known by {', '.join(check_run)}: gain {expected.gain:.3f} ± {expected.gain_spread:.3f}, "
        f"offset {number(expected.offset, 3)} ± {number(expected.offset_spread, 2)} N",
        err=True,
    )
    return prediction.corrected(expected.gain, expected.offset), session_band(expected, damper, prediction, level)


def _summary(prediction: Prediction, interval: Band | None) -> dict[str, tuple[float, float, float]]:
    """Peak force, energy per cycle and equivalent damping, each with the ends of its interval, or NaN.

    A motion without cycles has the energy of the whole record instead, without an interval.
    """
    import numpy as np

    from mrdamper.statistics.metrics import dissipated_power, peak_force

    motion, c, cycles = prediction.motion, prediction.condition, prediction.whole_cycles
    inside = cycles or slice(None)
    time = motion.time[inside]
    power = dissipated_power(prediction.force[inside], motion.velocity[inside], time)
    peak = (peak_force(prediction.force), *(interval.peak if interval else (math.nan, math.nan)))
    if cycles is None:
        return {"peak_force_N": peak, "dissipated_energy_J": (power * float(np.ptp(time)), math.nan, math.nan)}
    energy = power / c.frequency_Hz
    # Of the linear damper with the same dissipation on this sine: C = E/(π ω X²).
    damping = 2 * power / c.peak_velocity**2
    low, high = (1 + share for share in interval.energy) if interval else (math.nan, math.nan)
    return {
        "peak_force_N": peak,
        "energy_per_cycle_J": (energy, energy * low, energy * high),
        "equivalent_damping_N_s_per_m": (damping, damping * low, damping * high),
    }


def _in_words(summary: dict[str, tuple[float, float, float]], interval: Band | None, level: float, where: str) -> str:
    from mrdamper.data.wording import number, span

    peak, *others = summary.values()
    lines = [f"peak force (half the peak-to-peak force) {number(peak[0])} N"]
    if "dissipated_energy_J" in summary:
        lines.append(f"dissipated energy {number(summary['dissipated_energy_J'][0])} J over the record")
    else:
        energy, damping = (value for value, _, _ in others)
        lines += [f"dissipated energy {number(energy)} J per cycle", f"equivalent damping {number(damping)} N s/m"]
    if interval is None:
        return "\n".join(lines)
    parts = ", ".join(
        f"{name} {number(float((part**2).mean() ** 0.5), 3)} N"
        for name, part in (("parameters", interval.parameter), ("session", interval.session), ("model", interval.model))
        if part.any()  # without three known sessions the variation between sessions is unknown
    )
    corrected = ""
    if interval.session.any():
        corrected = f"; with gain and offset of the session corrected {span(*interval.known_session, 'N', 4, ' to ')}"
    ends = (
        f", {100 * level:g} % prediction interval {span(*peak[1:], 'N', 4, ' to ')} {where}{corrected}",
        *(f" ({number(low)} to {number(high)})" if math.isfinite(low) else "" for _, low, high in others),
    )
    lines = [line + end for line, end in zip(lines, ends, strict=True)]
    return "\n".join([*lines, f"standard deviation of the force: {parts}"])
