"""The verdict on every record of a set, with the figures behind it: one row a record."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mrdamper.data import Condition, Run, once_per_run
from mrdamper.errors import QualityError
from mrdamper.rig_files.quality import check_record, checked
from mrdamper.rig_files.quality.current import held_in
from mrdamper.rig_files.quality.follow import force_follows
from mrdamper.rig_files.quality.force_lag import force_channel
from mrdamper.rig_files.quality.loop import repeatability
from mrdamper.rig_files.quality.motion import cycles_of, drift_of, steady_window
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import FURTHER, Finding, Record

NOT_IDENTIFIED = ("W_CLIPPED", "W_SHORT", "W_CURRENT_VARIES")  # what identification refuses by default


@dataclass(frozen=True, eq=False)
class Quality:
    """One record's verdict; its figures are NaN for a refused record."""

    record: Record  # as judged
    condition: Condition | None = None  # measured; None for a motion without a period and for a refused record
    current: float = np.nan  # magnitude of its mean over the steady window [A]; NaN where it changes there
    cycles: float = np.nan
    sample_rate_Hz: float = np.nan
    repeatability: float = np.nan  # scatter of the cycles over the peak-to-peak force; NaN under two cycles
    offset_force: float = np.nan  # mean over whole cycles [N]; reported, never taken off
    centre: float = np.nan  # mean displacement over whole cycles [m]; reported, never taken off
    drift: float = np.nan  # change of the mean displacement over the record [m]
    distortion: float = np.nan  # THD of the motion; NaN for a motion without a period
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
    """Judge records, judged or not, and measure them; a refused one does not stop the others."""
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
    condition = quality.condition
    return {
        "run_id": quality.record.id,
        "rig": quality.record.rig,
        "current_A": _rounded(quality.current, 4),
        "frequency_Hz": None if condition is None else _rounded(condition.frequency_Hz, 4),
        "amplitude_mm": None if condition is None else float(f"{1e3 * condition.amplitude_m:.4g}"),
        "cycles": _rounded(quality.cycles, 2),
        "sample_rate_Hz": _rounded(quality.sample_rate_Hz, 1),
        "repeatability_percent": _rounded(100 * quality.repeatability, 2),
        "offset_force_N": _rounded(quality.offset_force, 1),
        "centre_mm": _rounded(1e3 * quality.centre, 3),
        "drift_mm": _rounded(1e3 * quality.drift, 3),
        "distortion_percent": _rounded(100 * quality.distortion, 2),
        "verdict": quality.verdict,
        "findings": " ".join(quality.codes),
    }


def _quality(record: Record) -> Quality:
    view = View(replace(record, findings=()) if record.segments else record)
    try:
        judged = record if record.segments else checked(view)
    except QualityError as refusal:
        return Quality(record, refusal=refusal)
    motion, scatter = view.motion, repeatability(view)
    current, change = held_in(judged, steady_window(view))
    steady = view.steady
    whole = slice(None)
    if motion is not None:
        count = max(1, int(motion.cycles + 0.02))
        whole = steady.time >= steady.time[-1] - count / motion.condition.frequency_Hz
    return Quality(
        judged,
        condition=None if motion is None else motion.condition,
        current=np.nan if change else abs(current),
        cycles=cycles_of(view),
        sample_rate_Hz=1 / view.step,
        repeatability=np.nan if scatter is None else scatter[0],
        offset_force=float(np.mean(steady.force[whole])),
        centre=float(np.mean(steady.displacement[whole])),
        drift=drift_of(view)[0],
        distortion=np.nan if motion is None else motion.distortion,
    )


def _rounded(value: float, digits: int) -> float | None:
    return round(float(value), digits) + 0.0 if np.isfinite(value) else None
