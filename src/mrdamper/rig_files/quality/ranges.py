"""Magnitudes that contradict a damper test, or the frequency and amplitude that a name or a heading states."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.rig_files.conditions import motions_in
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding

LONGEST_STROKE = 3.0  # [m] peak to peak; the longest test rigs have about 1.5 m
LARGEST_FORCE = 2e7  # [N]; the largest seismic test machines
SMALLEST_FORCE = 0.5  # [N] peak to peak; a load cell of a damper rig resolves about 1 N
LARGEST_CURRENT = 200.0  # [A]
FASTEST = 30.0  # [m/s]
SHORT_STROKE, LONG_STROKE = 0.15e-3, 0.9  # [m] peak to peak: beyond, a slip of the unit is likelier than a test
SMALL_FORCE, LARGE_FORCE = 8.0, 1.5e6  # [N] peak to peak
SLOW = 300.0  # [s] of a cycle
FEWEST_LEVELS, _MANY = 16, 8  # values of a channel, and samples for each
_SAME_FREQUENCY = 0.2  # relative difference of what is measured
# Measured amplitude over the one stated, which may be the stroke peak to peak: a machine falls short of its command.
_AMPLITUDES = (0.25, 1.6)


def exchanged_or_out_of_range(view: View) -> None:
    """Refuse channels whose size says that a unit is wrong or that columns are exchanged."""
    record, strokes = view.record, view.strokes
    stroke, force = _peak_to_peak(record.displacement), _peak_to_peak(record.force)
    largest, current = (
        0.0 if values is None else max(float(np.nanmax(values)), -float(np.nanmin(values)))
        for values in (record.force, record.current)
    )
    speed = float(np.median(strokes.lengths / strokes.durations)) if strokes.durations.size else 0.0
    unit = "set its unit in a profile: [channels.{}] unit{}"
    if stroke > LONGEST_STROKE:
        problem, remedy = f"displacement moves {stroke:.4g} m peak to peak", unit.format("displacement", ' = "mm"?')
        if force < LONGEST_STROKE:
            problem += f", force {force:.4g} N"
            remedy = "displacement and force look exchanged: name the columns the other way round"
    elif largest > LARGEST_FORCE:
        problem, remedy = f"force reaches {largest:.4g} N", unit.format("force", "")
    elif force < SMALLEST_FORCE:
        problem = f"force changes by {force:.3g} N in the whole record"
        remedy = "check the load cell, the unit of force (kN?), or whether columns are exchanged"
    elif current > LARGEST_CURRENT:
        problem, remedy = f"current reaches {current:.4g} A", unit.format("current", ' = "mA"?')
    elif speed > FASTEST:
        problem = f"the mean speed of the strokes is {speed:.4g} m/s"
        remedy = "check the units of time and displacement"
    else:
        return
    raise view.refused("E_RANGE", problem, remedy)


def unusual(view: View) -> Iterator[Finding]:
    """Report values that hardly occur in a damper test: sizes of a slipped unit, and channels of a few levels."""
    record, period = view.record, view.strokes.period
    stroke, force = _peak_to_peak(record.displacement), _peak_to_peak(record.force)
    sizes = (
        (stroke < SHORT_STROKE or stroke > LONG_STROKE, f"displacement moves {1e3 * stroke:.3g} mm peak to peak"),
        (force < SMALL_FORCE or force > LARGE_FORCE, f"force changes by {force:.3g} N in all"),
        (period is not None and period > SLOW, f"a cycle takes {period or 0:.3g} s"),
    )
    for odd, text in sizes:
        if odd:
            yield Finding("W_RANGE", f"{text}: is its unit right?")
    for name in ("displacement", "force"):
        values = getattr(view.run, name)
        levels = np.unique(values[: _MANY * FEWEST_LEVELS]).size
        levels = levels if levels >= FEWEST_LEVELS else np.unique(values).size
        if levels < FEWEST_LEVELS and view.run.time.size > _MANY * levels:
            yield Finding(
                "W_COARSE", f"{name} has {levels} different values only: a sensor of so few steps hides the loop"
            )


def _peak_to_peak(values: np.ndarray) -> float:
    return float(np.nanmax(values) - np.nanmin(values))


def agrees_with_its_name(view: View) -> Iterator[Finding]:
    """Report a motion of another frequency or amplitude than a name or heading states.

    One of both is refused, and one of another frequency where time is nothing but a sampling rate that is stated.
    """
    motion = view.motion
    if motion is None:
        return
    notes = view.record.provenance
    name = f"{notes.get('file', '')} {view.record.id} {notes.get('motion_stated', '')}"
    measured = motion.condition
    values = (motions_in(name, unit) for unit in ("Hz", "mm"))
    frequency, amplitude = (own.pop() if len(own) == 1 and 0.0 not in own else None for own in values)
    contradictions = []
    if frequency is not None and abs(measured.frequency_Hz / frequency - 1) > _SAME_FREQUENCY:
        contradictions.append((f"{frequency:g} Hz", f"{measured.frequency_Hz:.3g} Hz", "time"))
    if amplitude is not None and not _AMPLITUDES[0] < 1e3 * measured.amplitude_m / amplitude < _AMPLITUDES[1]:
        contradictions.append(
            (f"{amplitude:g} mm", f"an amplitude of {1e3 * measured.amplitude_m:.3g} mm", "displacement")
        )
    rate = notes.get("time_from", "")
    if len(contradictions) == 1 and rate and contradictions[0][2] == "time":
        stated, has, _ = contradictions[0]
        problem = f"the name or heading states {stated}, and by the sampling rate ({rate}) the motion has {has}"
        raise view.refused(
            "E_MOTION_CONTRADICTS", problem, "set [file] sample_rate_Hz = ... in a profile, or correct the name"
        )
    if len(contradictions) > 1:
        stated, has, channels = (" and ".join(words) for words in zip(*contradictions, strict=True))
        problem = f"the name or heading states {stated}, and the record has {has}: the record of another test?"
        raise view.refused("E_MOTION_CONTRADICTS", problem, f"correct the name or heading, or the units of {channels}")
    for stated, has, channel in contradictions:
        text = f"the name or heading states {stated} and the record has {has}: check the unit of {channel}, or the name"
        yield Finding("W_NAME", text)
