"""The result of the checks of every record of a set, with the figures behind it: one row a record."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from mrdamper.data import Run, once_per_run
from mrdamper.errors import QualityError
from mrdamper.rig_files.quality import check_record, checked
from mrdamper.rig_files.quality.lag import force_channel
from mrdamper.rig_files.quality.loop import force_follows, repeatability
from mrdamper.rig_files.quality.motion import cycles_of, drift_of, held_in, steady_window
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import FURTHER, Finding, Record

NOT_IDENTIFIED = ("W_CLIPPED", "W_SHORT", "W_CURRENT_VARIES")  # what identification refuses by default


FIGURES = MappingProxyType(
    {  # of a record, by columns of the table, and the digits they are shown with
        "current_A": ".4f",  # magnitude of its mean over the steady window; none where it changes there
        "frequency_Hz": ".4f",  # none, as of the amplitude and the distortion, for a motion without a period
        "amplitude_mm": ".4g",
        "cycles": ".2f",
        "sample_rate_Hz": ".1f",
        "repeatability_percent": ".2f",  # scatter of the cycles over the peak-to-peak force; none under two cycles
        "offset_force_N": ".1f",  # mean over whole cycles; reported, never taken off
        "centre_mm": ".3f",  # mean displacement over whole cycles; reported, never taken off
        "drift_mm": ".3f",  # change of the mean displacement over the record
        "distortion_percent": ".2f",  # THD of the motion
    }
)


@dataclass(frozen=True, eq=False)
class Quality:
    """One record's verdict and figures; a refused record has none."""

    record: Record  # with its findings
    figures: Mapping[str, float] = field(default_factory=dict)  # by the columns of `FIGURES`, NaN where there is none
    refusal: QualityError | None = None

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings without the one that refused the record."""
        return self.record.findings

    @property
    def codes(self) -> tuple[str, ...]:
        """Codes of all findings and of the refusal, each once."""
        refusal = () if self.refusal is None else (self.refusal.code,)
        return tuple(dict.fromkeys((*refusal, *(finding.code for finding in self.findings))))

    @property
    def verdict(self) -> str:
        """refused, not identified, noted or good."""
        if self.refusal is not None:
            return "refused"
        if any(code in NOT_IDENTIFIED for code in self.codes):
            return "not identified"
        return "noted" if self.codes else "good"


def quality_table(records: Iterable[Record]) -> tuple[Quality, ...]:
    """Check records, checked or not, and measure them; a refused one does not stop the others."""
    return tuple(_quality(record) for record in records)


def record_of(run: Run) -> Record:
    """Return a stored run as a record, to be checked again."""
    own = ("id", "time", "displacement", "force", "velocity", "current", "rig", "excitation", "split", "window")
    fields: dict[str, Any] = {name: getattr(run, name) for name in own}
    fields |= {name: run.further.get(f"{name}_{FURTHER[name]}") for name in ("temperature", "pressure")}
    return Record(**fields, provenance=run.notes)


@once_per_run
def check_run(run: Run) -> tuple[QualityError | None, tuple[Finding, ...]]:
    """Check a stored run as if it were imported now: the reason for its rejection, or None, and other findings.

    The search for a late force, which refuses nothing and takes as long as all other checks, is left out.
    """
    try:
        record = check_record(record_of(run), without=(force_channel,))
        if any(finding.code == "W_FROZEN" for finding in record.findings):
            force_follows(View(replace(record, findings=())))  # of a channel that died there may be nothing to identify
        return None, record.findings
    except QualityError as error:
        return error, ()


def with_findings(run: Run) -> Run:
    """Return the run with the codes of what is noticed today: a dataset written elsewhere, or arrays, state none."""
    codes = dict.fromkeys([*run.findings, *(finding.code for finding in check_run(run)[1])])
    return replace(run, notes={**run.notes, "findings": " ".join(codes)}) if len(codes) > len(run.findings) else run


def row(quality: Quality) -> dict[str, Any]:
    """Return a verdict as a row of numbers and words, in engineers' units; None where there is no figure."""
    figures = {name: value for name, value in quality.figures.items() if np.isfinite(value)}
    shown = {
        name: float(f"{figures[name]:{form}}") + 0.0 if name in figures else None for name, form in FIGURES.items()
    }
    names = {"run_id": quality.record.id, "rig": quality.record.rig}
    return {**names, **shown, "verdict": quality.verdict, "findings": " ".join(quality.codes)}


def _quality(record: Record) -> Quality:
    view = View(replace(record, findings=()) if record.segments else record)
    try:
        result = record if record.segments else checked(view)
    except QualityError as refusal:
        return Quality(record, refusal=refusal)
    motion, scatter = view.motion, repeatability(view)
    current, change = held_in(result, steady_window(view))
    steady = view.steady
    whole = slice(None)
    if motion is not None:
        count = max(1, int(motion.cycles + 0.02))
        whole = steady.time >= steady.time[-1] - count / motion.condition.frequency_Hz
    figures = {
        "current_A": np.nan if change else abs(current),
        "frequency_Hz": np.nan if motion is None else motion.condition.frequency_Hz,
        "amplitude_mm": np.nan if motion is None else 1e3 * motion.condition.amplitude_m,
        "cycles": cycles_of(view),
        "sample_rate_Hz": 1 / view.step,
        "repeatability_percent": np.nan if scatter is None else 100 * scatter[0],
        "offset_force_N": float(np.mean(steady.force[whole])),
        "centre_mm": 1e3 * float(np.mean(steady.displacement[whole])),
        "drift_mm": 1e3 * drift_of(view)[0],
        "distortion_percent": np.nan if motion is None else 100 * motion.distortion,
    }
    return Quality(result, figures)
