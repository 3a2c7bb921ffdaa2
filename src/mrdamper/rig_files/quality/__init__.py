"""Quality checks of a record in their order: findings are added, or the record is refused; the table of a set; runs.

A check is a function of a `View` that yields findings or raises `QualityError`. The order
matters: a check relies on those before it. A further module of this folder with a function
`check` is run last. A record that does not fit into memory is checked part by part.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np

from mrdamper.data import Run, once_per_run
from mrdamper.data.arrays import chunks, drop_pages
from mrdamper.discovery import modules_with
from mrdamper.errors import ColumnError, InputError, QualityError, RunError
from mrdamper.rig_files.quality import disturbance, flat, lag, loop, motion, samples, sentinel
from mrdamper.rig_files.quality.view import SHORTEST, View
from mrdamper.rig_files.record import FURTHER, Finding, Record, part_of_record

Check = Callable[[View], Iterable[Finding] | None]
PART = 2**19  # samples: a minute of a test at 10 kHz, some megabytes a channel
_AT_ONCE = 2  # parts: their checks are sums and sorts of long arrays, which need no turn of the interpreter
_MAY_REST = ("E_NO_EXCITATION",)  # a long test may pause; it may not be one long pause
_OF_THE_WHOLE = ("W_SHORT", "W_DRIFT")
_ONCE = ("W_CURRENT_VARIES",)  # checked over the whole record: parts may each hold another current
_Verdict = tuple[tuple[Finding, ...], tuple[tuple[int, int], ...], InputError | None]
CHECKS: tuple[Check, ...] = (
    samples.long_enough,
    samples.finite,
    sentinel.missing_value_codes,
    samples.missing,
    samples.order_of_time,
    samples.gaps_in_time,
    motion.moves,
    motion.exchanged_or_out_of_range,
    sentinel.spikes,
    sentinel.wraps,
    loop.dissipates,
    loop.motion_is_told,
    lag.velocity_channel,
    flat.clipped,
    flat.frozen,
    loop.keeps_its_sign,
    loop.force_follows,
    motion.unusual,
    motion.enough_cycles,
    motion.is_a_sine,
    motion.drifts,
    motion.agrees_with_its_name,
    samples.changes_at_every_sample,
    samples.is_not_stored_on_change,
    disturbance.motion_is_one,
    disturbance.force_lines,
    disturbance.force_is_fine,
    samples.no_bit_is_stuck,
    flat.cut_off_before_noise,
    flat.rests_at_its_ends,
    samples.lost_or_doubled,
    samples.copied,
    loop.stroke_steps,
    loop.motion_is_steady,
    loop.force_is_steady,
    lag.force_channel,
    disturbance.channels_are_unfiltered,
    loop.repeats,
    motion.changes,
)
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


@cache
def _dropped_in() -> tuple[Check, ...]:
    return tuple(module.check for _, module in modules_with("mrdamper.checks", "check"))


def check_record(record: Record, without: Collection[Check] = ()) -> Record:
    """Run every check but some on a record as a reader left it: SI units, NaN where a sample is missing.

    Returns it with the findings of the checks and its segments (sample ranges without a gap in time).

    Raises `QualityError` if the record cannot be used; the code says why: E_NO_DATA, E_NONFINITE, E_SENTINEL,
    E_MISSING, E_TIME_ORDER, E_TIME_DUPLICATE, E_RANGE, E_NO_EXCITATION, E_SPIKE, E_LEAP, E_NOISE, E_UNRESOLVED,
    E_DISSIPATION_SIGN, E_RECTIFIED, E_NO_ENERGY, E_UNRELATED, E_CHANNEL_LAG, E_DISTURBED, E_SAMPLES_LOST, E_COPIED.
    """
    return checked(View(record), without)


def checked(view: View, without: Collection[Check] = ()) -> Record:
    """Run every check on a view of a record, which goes on to hold what they have analysed; else `check_record`."""
    record = view.record
    for check in (*CHECKS, *_dropped_in()):
        view.found.extend((check(view) if check not in without else None) or ())
    findings = (*record.findings, *view.found)
    return replace(record, findings=findings, segments=view.segments, steady=loop.steady_part(view))


def check_long_record(record: Record) -> Record:
    """Judge a record, whose channels may be memory-mapped, part by part; one of a few parts' length as one.

    Raises as `check_record`; that nothing moves, only if nothing moves in any part.
    """
    if record.time.size <= 2 * PART:
        return check_record(record)
    finding_of: dict[str, tuple[Finding, int]] = {}
    segments: list[tuple[int, int]] = []
    moving, resting, count = 0, None, 0
    for start, (noticed, inside, error) in _checked_parts(record):
        count += 1
        moving += error is None
        resting = resting or error
        for finding in noticed:
            first, times = finding_of.get(finding.code, (finding, 0))
            finding_of[finding.code] = first, times + 1
        _extend(segments, inside, start)
    if resting is not None and not moving:
        raise resting
    findings = (*record.findings, *_summed(finding_of, count, moving), *motion.change_of(record, None))
    return replace(record, findings=findings, segments=tuple(segments))


def _checked_parts(record: Record) -> Iterator[tuple[int, _Verdict]]:
    """Start of every part and what came of it, in order, two checked at once."""

    def one(part: Record) -> _Verdict:
        try:
            with np.errstate(all="ignore"):  # each thread has its own
                part = check_record(part)
            return part.findings, part.segments, None
        except InputError as error:
            if error.code not in _MAY_REST:
                raise
            return (), ((0, part.time.size),), error

    waiting: deque[tuple[int, Future[_Verdict]]] = deque()
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        for start, part in _parts(record):
            waiting.append((start, pool.submit(one, part)))
            if len(waiting) >= _AT_ONCE:
                at, done = waiting.popleft()
                yield at, done.result()
        for at, done in waiting:
            yield at, done.result()


def _parts(record: Record) -> Iterator[tuple[int, Record]]:
    """Parts that share one sample, so that steps of time between them are seen."""
    for at in range(0, record.time.size - 1, PART):
        part = part_of_record(record, slice(at, min(at + PART, record.time.size - 1) + 1))
        channels = {name: np.array(values) for name, values in part.channels.items()}
        for values in record.channels.values():
            drop_pages(values)
        yield at, replace(part, findings=(), segments=(), **channels)


def _extend(segments: list[tuple[int, int]], new: tuple[tuple[int, int], ...], start: int) -> None:
    for a, b in new:
        if segments and segments[-1][1] == start + a + 1:
            segments[-1] = segments[-1][0], start + b
        else:
            segments.append((start + a, start + b))


def _summed(findings: dict[str, tuple[Finding, int]], parts: int, moving: int) -> Iterator[Finding]:
    for finding, times in findings.values():
        if finding.code in _ONCE or (finding.code in _OF_THE_WHOLE and times < moving):
            continue
        more = f" (first of {times} parts out of {parts})" if times > 1 else ""
        yield Finding(finding.code, finding.text + more)


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
        record = check_record(record_of(run), without=(lag.force_channel,))
        if any(finding.code == "W_FROZEN" for finding in record.findings):
            loop.force_follows(
                View(replace(record, findings=()))
            )  # of a channel that died there may be nothing to identify
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
    analysis, scatter = view.motion, loop.repeatability(view)
    current, change = motion.held_in(result, motion.steady_window(view))
    steady = view.steady
    whole = slice(None)
    if analysis is not None:
        count = max(1, int(analysis.cycles + 0.02))
        whole = steady.time >= steady.time[-1] - count / analysis.condition.frequency_Hz
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

    Missing samples are left out, as are segments of under five samples. Where the motion is
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
    count = np.count_nonzero(keep)
    sizes = [int(np.count_nonzero(keep[start:stop])) for start, stop in record.segments]
    bounds = np.cumsum([0, *(size for size in sizes if size)]).tolist()
    if count == keep.size:
        keep = slice(None)  # nothing is copied: a long record lies in a file
    if count < 3:
        raise RunError(f"{count} samples", where=f"run {record.id}", remedy="a run needs at least 3")
    steady = record.steady or loop.steady_part(View(record))
    codes = " ".join(dict.fromkeys(finding.code for finding in record.findings))
    further = {f"{name}_{unit}": getattr(record, name) for name, unit in FURTHER.items()} | dict(record.further)
    own: dict[str, Any] = {name: getattr(record, name) for name in ("id", "rig", "excitation", "split")}
    own |= {name: values[keep] for name, values in record.channels.items() if name in samples.USED}
    run = Run(
        **own,
        further={name: values[keep] for name, values in further.items() if values is not None},
        window=steady.window,
        repeatability=steady.repeatability,
        segments=tuple(pairwise(bounds)),
        notes={**record.provenance, **({"findings": codes} if codes else {})},
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
