"""The motion of a record: its cycles and form, the current in it, and magnitudes that contradict a test or its name."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mrdamper.data import Floats, held_current, once_per_run
from mrdamper.data.arrays import take
from mrdamper.data.wording import counted, number
from mrdamper.physics.motion.sines import SINE_DISTORTION_LIMIT
from mrdamper.rig_files.conditions import currents_in, motions_in
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding, Record

LEAST_MOTION = 20e-6  # [m] peak to peak: below it a displacement sensor's noise
NOISE_MOTION = 500e-6  # [m]: up to here a motion without memory from sample to sample is noise
LEAST_CYCLES = 0.95  # one cycle, less what a cut at a sample takes away
_FEW = 1.5  # cycles under which drift and a slow harmonic cannot be told apart
DRIFT = 0.1  # of the amplitude over the record, for a short one
DRIFT_A_CYCLE = 0.015  # of the amplitude a cycle: less does not open a loop
DRIFT_AT_MOST = 0.3  # of the amplitude over the record, however long
_MOST = 1_000_000  # samples looked at
_ANY = (0.0, np.inf)
FEWEST_LEVELS, _MANY = 16, 8  # values of a channel, and samples for each
_SAME_FREQUENCY = 0.2  # relative difference of what is measured
# Measured amplitude over the one stated, which may be the stroke peak to peak: a machine falls short of its command.
_AMPLITUDES = (0.25, 1.6)
_SHARE = 0.1  # of the samples, at the current that a name states
_HEATING = 0.2  # of the current at most, by which a heated coil lowers it in a test
_UNITS = np.array([2.54, 10, 25.4, 39.37, 100, 1000])  # factors between units of length
_SAME_FACTOR = 0.015  # relative difference from it: 2.5 and 25 are none


def moves(view: View) -> None:
    """Refuse a record without motion."""
    x = view.run.displacement
    if x.size < 3:
        raise view.refused(
            "E_NO_EXCITATION", f"{counted(x.size, 'sample')} without gaps", "record again: a cycle or more"
        )
    span = float(np.ptp(x))
    # Von Neumann's ratio: one for white noise, near zero for any motion sampled finely enough.
    noise = span < NOISE_MOTION and np.mean(np.diff(x) ** 2) > np.var(x)
    if span < LEAST_MOTION or noise:
        problem = f"the displacement moves {1e3 * span:.3g} mm" + (", which is noise" if noise else "")
        raise view.refused("E_NO_EXCITATION", problem, "check the channel, its unit and the drive")


def cycles_of(view: View) -> float:
    """Length of the steady motion in cycles; for a motion without a period, half its strokes."""
    if view.motion is not None:
        return view.motion.cycles
    return 0.5 * view.strokes.lengths.size


def steady_window(view: View) -> tuple[float, float] | None:
    """Start and end [s] of the last whole steady cycles; None for a motion without a period."""
    if view.record.window is not None:
        return view.record.window
    if view.motion is None:
        return None
    first, last = float(view.steady.time[0]), float(view.steady.time[-1])
    return max(first, last - max(1, view.whole_cycles) / view.motion.condition.frequency_Hz), last


def is_a_sine(view: View) -> Iterator[Finding]:
    """Report a record shorter than a cycle, which has no frequency, and a motion that is no sine."""
    motion, use = view.motion, "only identification in time can use it"
    if cycles_of(view) < LEAST_CYCLES:
        text = "the record holds less than one cycle: no frequency or amplitude is stated"
        yield Finding("W_SHORT", f"{text}, nothing is identified from it")
    elif motion is None:
        yield Finding("W_NOT_SINE", f"the motion has no period: {use}")
    elif motion.distortion > SINE_DISTORTION_LIMIT:
        limit = f"(limit {100 * SINE_DISTORTION_LIMIT:g} %)"
        yield Finding("W_NOT_SINE", f"distortion of the motion {100 * motion.distortion:.1f} % {limit}: {use}")


def drifts(view: View) -> Iterator[Finding]:
    """Report a periodic motion whose amplitude or mean drifts."""
    if view.motion is None:
        return
    amplitude = view.motion.condition.amplitude_m
    limit = amplitude * float(np.clip(DRIFT_A_CYCLE * view.motion.cycles, DRIFT, DRIFT_AT_MOST))
    mean, size = drift_of(view)
    for what, drift in (("mean position", mean), ("amplitude", size)):
        if abs(drift) > limit:
            text = f"the {what} drifts by {number(1e3 * drift, 3, sign='+')} mm within the steady motion,"
            yield Finding("W_DRIFT", f"{text} {100 * abs(drift) / amplitude:.0f} % of the amplitude")


def drift_of(view: View) -> tuple[float, float]:
    """Change of mean and of amplitude over the steady motion [m].

    By robust lines through the strokes; of a record with few strokes only the mean, from the
    harmonic fit.
    """
    inside, reversals = view.steady_samples, view.strokes.reversals
    chosen = reversals[(reversals >= inside.start) & (reversals < inside.stop)]
    length = float(np.ptp(view.steady.time))
    if chosen.size < 4:
        return (0.0 if view.motion is None or view.motion.cycles < _FEW else view.motion.drift * length), 0.0
    t, x = view.run.time[chosen], view.run.displacement[chosen]
    centre = (x[:-2] + 2 * x[1:-1] + x[2:]) / 4  # half way between a reversal and the mean of its neighbours
    size = np.abs(x[:-2] - 2 * x[1:-1] + x[2:]) / 4
    sound = view.without_leap(t[:-2], t[2:])  # a reversal may be lost in a gap
    if np.count_nonzero(sound) < 2:
        return 0.0, 0.0
    middle = t[1:-1][sound]
    return length * _slope(middle, centre[sound]), length * _slope(middle, size[sound])


def _slope(t: Floats, y: Floats) -> float:
    """Theil and Sen's slope, of at most 200 points."""
    step = max(1, t.size // 200)
    t, y = t[::step], y[::step]
    i, j = np.triu_indices(t.size, 1)
    return float(np.median((y[j] - y[i]) / (t[j] - t[i])))


def changes(view: View) -> Iterator[Finding]:
    """Report a current that changes within the steady motion."""
    yield from change_of(view.record, steady_window(view))


def change_of(record: Record, window: tuple[float, float] | None) -> Iterator[Finding]:
    """Yield the finding that a record's current changes within a window of time."""
    change = held_in(record, window)[1]
    if change and record.current is not None:
        use = "a global model uses the run; to identify it alone, hold the current, or export each level as a test"
        named = [of for of in currents_in(record.id) if np.mean(np.isclose(record.current, of, 0.05, 0.02)) < _SHARE]
        other = "".join(
            f" (its name states {of:g} A: check that the channel is the coil's current)" for of in named[:1]
        )
        yield Finding("W_CURRENT_VARIES", f"{change}{other}: {use}")


@once_per_run
def current_changes(view: View) -> bool:
    """Tell if the current changes by more than heat explains in the steady motion: then cycles of the force differ."""
    window = steady_window(view)
    if not held_in(view.record, window)[1]:
        return False
    low, high = np.quantile(np.abs(current_in(view.record, window)), (0.02, 0.98))
    return bool(high - low > _HEATING * high)


def held_in(record: Record, window: tuple[float, float] | None) -> tuple[float, str]:
    """Mean of a record's current within a window of time [A], NaN without three samples, and how it changes there."""
    current = np.empty(0) if record.current is None else current_in(record, window)
    return held_current(current) if current.size >= 3 else (np.nan, "")


def current_in(record: Record, window: tuple[float, float] | None) -> Floats:
    """Return the current's samples that are there within a window of time, thinned where they are many."""
    assert record.current is not None
    thinned = np.arange(0, record.time.size, max(1, record.time.size // _MOST))
    time, current = take(record.time, thinned), take(record.current, thinned)
    there = np.isfinite(current)
    if window is not None:
        there &= (time >= window[0]) & (time <= window[1])
    return current[there]


class Size(NamedTuple):
    """A figure of a record beside the lowest and highest that a test can have, and that most tests have."""

    text: str
    value: float
    possible: tuple[float, float]
    usual: tuple[float, float]  # beyond, a slip of the unit is likelier than a test
    remedy: str


def _other_unit(view: View, role: str, unit: str = "") -> str:
    """Return the remedy for a channel that is too large: its unit or, where it has the smaller one, a scale."""
    if unit and re.search(rf"(?:^|, ){role} = .*? in {unit}(?:, |$)", view.record.provenance.get("columns", "")):
        return f"if these are counts, set their scale in a profile, in {unit} per count: [channels.{role}] scale"
    return f"set its unit in a profile: [channels.{role}] unit" + (f' = "{unit}"?' if unit else "")


def _sizes(view: View) -> tuple[Size, ...]:
    record, strokes = view.record, view.strokes
    stroke, force = (float(np.nanmax(values) - np.nanmin(values)) for values in (record.displacement, record.force))
    largest, current = (
        0.0 if values is None else max(float(np.nanmax(values)), -float(np.nanmin(values)))
        for values in (record.force, record.current)
    )
    speed = float(np.median(strokes.lengths / strokes.durations)) if strokes.durations.size else 0.0
    length = f"displacement moves {f'{number(stroke)} m' if stroke > 0.9 else f'{1e3 * stroke:.3g} mm'} peak to peak"
    remedy = _other_unit(view, "displacement", "mm")
    if force < 3.0 < stroke:
        length += f", force {number(force)} N"
        remedy = "displacement and force look exchanged: name the columns the other way round"
    check = "check the load cell, the unit of force (kN?), or whether columns are exchanged"
    return (  # [m] of test rigs, [N] of seismic test machines, [N] that load cells resolve, [A], [m/s] and [s]
        Size(length, stroke, (0.0, 3.0), (0.15e-3, 0.9), remedy),
        Size(f"force reaches {number(largest)} N", largest, (0.0, 2e7), _ANY, _other_unit(view, "force")),
        Size(f"force changes by {number(force, 3)} N in the whole record", force, (0.5, np.inf), (8.0, 1.5e6), check),
        Size(f"current reaches {current:.4g} A", current, (0.0, 200.0), _ANY, _other_unit(view, "current", "mA")),
        Size(f"the mean speed of the strokes is {number(speed)} m/s", speed, (0.0, 30.0), _ANY,
             "check the units of time and displacement"),
        Size(f"a cycle takes {number(strokes.period or 0, 3)} s", strokes.period or 0.0, _ANY, (0.0, 300.0), ""),
    )  # fmt: skip


def exchanged_or_out_of_range(view: View) -> None:
    """Refuse channels whose size says that a unit is wrong or that columns are exchanged."""
    for size in _sizes(view):
        if not size.possible[0] <= size.value <= size.possible[1]:
            raise view.refused("E_RANGE", size.text, size.remedy)


def unusual(view: View) -> Iterator[Finding]:
    """Report values that hardly occur in a damper test: sizes of a slipped unit, and channels of a few levels."""
    for size in _sizes(view):
        if not size.usual[0] <= size.value <= size.usual[1]:
            yield Finding("W_RANGE", f"{size.text}: is its unit right?")
    for name in ("displacement", "force"):
        values = getattr(view.run, name)
        levels = np.unique(values[: _MANY * FEWEST_LEVELS]).size
        levels = levels if levels >= FEWEST_LEVELS else np.unique(values).size
        if levels < FEWEST_LEVELS and view.run.time.size > _MANY * levels:
            text = f"{name} has {levels} different values only: a sensor of so few steps hides the loop"
            yield Finding("W_COARSE", text)


def stated_motion(record: Record, unit: str) -> float | None:
    """Return the one frequency in Hz, or the one length in mm, that a name or heading of a record states."""
    notes = record.provenance
    stated = motions_in(f"{notes.get('file', '')} {record.id} {notes.get('motion_stated', '')}", unit)
    return stated.pop() if len(stated) == 1 and 0.0 not in stated else None


def agrees_with_its_name(view: View) -> Iterator[Finding]:
    """Report a motion of another frequency or amplitude than a name or heading states.

    One of both is refused, one of another frequency where time is nothing but a sampling rate that is stated, and one
    of an amplitude that differs by the factor of a unit.
    """
    motion = view.motion
    if motion is None:
        return
    measured = motion.condition
    frequency, amplitude = (stated_motion(view.record, unit) for unit in ("Hz", "mm"))
    contradictions = []
    if frequency is not None and abs(measured.frequency_Hz / frequency - 1) > _SAME_FREQUENCY:
        contradictions.append((f"{frequency:g} Hz", f"{measured.frequency_Hz:.3g} Hz", "time"))
    size = 1e3 * measured.amplitude_m
    if amplitude is not None and not _AMPLITUDES[0] < size / amplitude < _AMPLITUDES[1]:
        contradictions.append((f"{amplitude:g} mm", f"an amplitude of {size:.3g} mm", "displacement"))
    if not contradictions:
        return
    # A length that is larger than the motion may be that of the damper.
    factors = np.array([size, 2 * size])[:, None] / (amplitude * _UNITS) if amplitude else np.empty(0)
    stated, has, channels = (" and ".join(words) for words in zip(*contradictions, strict=True))
    states, rate = f"the name or heading states {stated}", view.record.provenance.get("time_from", "")
    if len(contradictions) > 1:
        problem = f"{states}, and the record has {has}: the record of another test?"
        raise view.refused("E_MOTION_CONTRADICTS", problem, f"correct the name or heading, or the units of {channels}")
    if rate and channels == "time":
        problem = f"{states}, and by the sampling rate ({rate}) the motion has {has}"
        remedy = "set [file] sample_rate_Hz = ... in a profile, or correct the name"
        raise view.refused("E_MOTION_CONTRADICTS", problem, remedy)
    if channels == "displacement" and np.any(alike := np.abs(factors - 1) <= _SAME_FACTOR):
        factor = _UNITS[np.any(alike, axis=0)][0]
        problem = f"{states}, and the record has {has}: they differ by {factor:g}, as units of length do"
        remedy = 'correct the name or heading, or set [channels.displacement] unit = "..." in a profile'
        raise view.refused("E_MOTION_CONTRADICTS", problem, remedy)
    yield Finding("W_NAME", f"{states} and the record has {has}: check the unit of {channels}, or the name")
