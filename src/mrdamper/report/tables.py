"""Results as rows: what the command line and the pages print.

Nothing here draws: a command that writes a table loads no plotting library.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mrdamper.dampers.bands import Band
from mrdamper.dampers.base import Prediction
from mrdamper.identification import Identification
from mrdamper.study.validation import RunScore


def identification_rows(identifications: Sequence[Identification]) -> list[dict[str, Any]]:
    """One row an identification: condition, parameters, scores, standard errors, message."""
    rows = []
    for found in identifications:
        row: dict[str, Any] = {
            "run_id": found.run_id,
            "rig": found.rig,
            "model": found.model.name,
            "method": found.method,
            "current_A": found.condition.current_A,
            "frequency_Hz": found.condition.frequency_Hz,
            "amplitude_m": found.condition.amplitude_m,
            "nrmse_pp": found.scores.nrmse_pp,
            "repeatability_nrmse_pp": found.floor,
            "wape": found.scores.wape,
            **{f"{name} [{unit}]": value for name, unit, value in _values(found)},
            **{f"standard error {name}": value for name, value in found.standard_errors.items()},
            **_ends(found),
            **{f"effective samples {name}": value for name, value in found.uncertainty.effective.items()},
            "delay_s": found.delay,
            "at_bounds": " ".join(found.at_bounds),
            "evaluations": found.evaluations,
            "message": str(found.ending),
            "notes": "; ".join((*found.notes, *found.doubts)),
        }
        rows.append(row)
    return rows


def prediction_rows(prediction: Prediction, band: Band | None = None) -> list[dict[str, Any]]:
    """One row a sample, in the columns of the command-line contract; the band where there is one; the flags."""
    motion = prediction.motion
    columns = {
        "time_s": motion.time,
        "displacement_m": motion.displacement,
        "velocity_m_s": motion.velocity,
        "current_A": motion.current,
        "force_N": prediction.force,
    }
    if band is not None:
        columns |= {"force_low_N": band.low, "force_high_N": band.high}
    flag = " ".join(prediction.extrapolation)
    names = list(columns)
    return [
        {**dict(zip(names, values, strict=True)), "extrapolation": flag}
        for values in zip(*(c.tolist() for c in columns.values()), strict=True)
    ]


def score_row(run: RunScore) -> dict[str, Any]:
    """The columns of the command-line contract for one scored run."""
    s = run.scores
    return {
        "run_id": run.run_id,
        "nrmse_pp": s.nrmse_pp,
        "nrmse_std": s.nrmse_std,
        "wape": s.wape,
        "energy_error": s.energy_error,
        "peak_error": s.peak_error,
        "rest_nrmse_pp": run.rest,
        "session": run.session,
        "extrapolation": " ".join(run.extrapolation),
    }


def _ends(found: Identification) -> dict[str, float | None]:
    """Ends of the 95 % intervals of the free parameters."""
    columns: dict[str, float | None] = {}
    for name in (info.name for info in found.model.parameters() if info.name in found.free):
        columns[f"{name} low 95 %"], columns[f"{name} high 95 %"] = found.interval(name) or (None, None)
    return columns


def _values(found: Identification) -> list[tuple[str, str, float]]:
    return [(info.name, info.unit, getattr(found.model, info.name)) for info in found.model.parameters()]
