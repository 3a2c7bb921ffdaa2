"""Quality of checked records as a table, and stored runs as records and back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np

from mrdamper.data import Run, once_per_run
from mrdamper.data.arrays import chunks, drop_pages
from mrdamper.data.wording import counted
from mrdamper.errors import ColumnError, QualityError, RunError
from mrdamper.rig_files.quality import check_record, checked, lag, loop, motion, samples
from mrdamper.rig_files.quality.view import SHORTEST, View
from mrdamper.rig_files.record import FURTHER, HEAD, Finding, Record

NOT_IDENTIFIED = ("W_CLIPPED", "W_SHORT", "W_CURRENT_VARIES")  # what identification refuses by default
FIGURES = MappingProxyType(
    {  # of a record, by columns of the table: their headings, and the digits they are shown with
        "current_A": ("A", ".4f"),  # magnitude of its mean over the steady window; none where it changes there
        "frequency_Hz": ("Hz", ".4f"),  # none, as of amplitude and distortion, for a motion without a period
        "amplitude_mm": ("mm", ".4g"),
        "cycles": ("cycles", ".2f"),
        "sample_rate_Hz": ("samples/s", ".1f"),
        "repeatability_percent": ("scatter %", ".2f"),  # of the cycles over the peak-to-peak force; none under two
        "offset_force_N": ("offset N", ".1f"),  # mean over whole cycles; reported, never taken off
        "centre_mm": ("centre mm", ".3f"),  # mean displacement over whole cycles; reported, never taken off
        "drift_mm": ("drift mm", ".3f"),  # change of the mean displacement over the record
        "distortion_percent": ("", ".2f"),  # THD of the motion
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

    The search for a delayed force is omitted: it rejects no run and takes as long as all other checks.
    """
    try:
        record = check_record(record_of(run), without=(lag.force_channel,))
        if any(finding.code == "W_FROZEN" for finding in record.findings):
            loop.force_follows(View(replace(record, findings=())))  # a channel that failed early identifies nothing
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
        key: float(f"{figures[key]:{form}}") + 0.0 if key in figures else None for key, (_, form) in FIGURES.items()
    }
    names = {"run_id": quality.record.id, "rig": quality.record.rig}
    return {**names, **shown, "verdict": quality.verdict, "findings": " ".join(quality.codes)}


def _quality(record: Record) -> Quality:
    view = View(replace(record, findings=()) if record.segments else record)
    try:
        result = record if record.segments else checked(view)
    except QualityError as refusal:
        return Quality(record, refusal=refusal)
    analysis, scatter = view.motion, loop.repeatability(view)
    current, change = motion.held_in(result, motion.steady_window(view))
    steady, whole = view.steady, slice(None)
    if analysis is not None:
        whole = steady.time >= steady.time[-1] - max(1, view.whole_cycles) / analysis.condition.frequency_Hz
    figures = {
        "current_A": np.nan if change else abs(current),
        "frequency_Hz": np.nan if analysis is None else analysis.condition.frequency_Hz,
        "amplitude_mm": np.nan if analysis is None else 1e3 * analysis.condition.amplitude_m,
        "cycles": motion.cycles_of(view),
        "sample_rate_Hz": 1 / view.step,
        "repeatability_percent": np.nan if scatter is None else 100 * scatter[0],
        "offset_force_N": float(np.mean(steady.force[whole])),
        "centre_mm": 1e3 * float(np.mean(steady.displacement[whole])),
        "drift_mm": 1e3 * motion.drift_of(view)[0],
        "distortion_percent": np.nan if analysis is None else 100 * analysis.distortion,
    }
    return Quality(result, figures)


def to_run(record: Record) -> Run:
    """Return the run a record holds; one that was not checked is checked first.

    Missing samples are omitted, as are segments of under five samples. Where the motion is
    periodic, the steady window is the largest whole number of its last steady cycles. The
    codes of the findings stand in the notes under "findings", separated by spaces. Nothing
    is zeroed, filtered or resampled.

    Raises `QualityError` if the record cannot be used; `ColumnError` if it has no current; `RunError` if under three
    samples are left.
    """
    if not record.segments:
        record = check_record(record)
    if record.current is None:
        raise ColumnError("no current", where=f"run {record.id}", remedy="name its column or value in the rig profile")
    keep = _kept(record)
    sizes = [int(np.count_nonzero(keep[start:stop])) for start, stop in record.segments]
    bounds = np.cumsum([0, *filter(None, sizes)]).tolist()
    if sum(sizes) < 3:
        raise RunError(counted(sum(sizes), "sample"), where=f"run {record.id}", remedy="a run needs at least 3")
    keep = slice(None) if sum(sizes) == keep.size else keep  # nothing is copied: a long record lies in a file
    steady = record.steady or loop.steady_part(View(record))
    codes = " ".join(dict.fromkeys(finding.code for finding in record.findings))
    further = {f"{name}_{unit}": getattr(record, name) for name, unit in FURTHER.items()} | dict(record.further)
    own: dict[str, Any] = {name: getattr(record, name) for name in ("id", "rig", "excitation", "split")}
    notes = {key: text for key, text in record.provenance.items() if key != HEAD}
    own |= {name: values[keep] for name, values in record.channels.items() if name in samples.USED}
    run = Run(
        **own,
        further={name: values[keep] for name, values in further.items() if values is not None},
        window=steady.window,
        repeatability=steady.repeatability,
        segments=tuple(pairwise(bounds)),
        notes={**notes, **({"findings": codes} if codes else {})},
    )
    for values in (record.time, record.displacement, record.force, record.current):
        if values is not None:
            drop_pages(values)
    return run


def _kept(record: Record) -> np.ndarray:
    keep = record.present
    for at, piece in () if record.velocity is None else chunks(record.velocity):
        keep[at : at + piece.size] &= np.isfinite(piece)
    for start, stop in record.segments:
        if np.count_nonzero(keep[start:stop]) < SHORTEST:
            keep[start:stop] = False
    return keep
