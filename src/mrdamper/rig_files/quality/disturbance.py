"""Motion and force that are no part of the damper's periodic answer: hum, noise, coarse steps; and filtered channels.

What counts is what identification is given: the velocity of the smoothed displacement. Its part that the periodic
motion does not explain lowers the damping by its share of the velocity's power, as errors of a regressor do.

The colour of its noise shows a channel behind a low-pass filter. A filter rounds the corners of a loop as hysteresis
does, so the loop itself does not show it. But noise that passed it falls octave by octave from the filter's corner
on, and noise that did not is white. Noise is what a sample differs by from the one a period earlier, corners of the
loop omitted. The motion itself differs from cycle to cycle, and less the faster, so that a channel counts as
filtered only if its noise falls below what a load cell or a converter has.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.wording import number
from mrdamper.physics.motion import SINE_DISTORTION_LIMIT
from mrdamper.rig_files.quality.cycles import POINTS, REFUSED, effect_on, percent, percent_of, steady_cycles
from mrdamper.rig_files.quality.motion import current_changes
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding

_VELOCITY = 0.008  # power of the velocity that is no part of the motion, of all: bundled rigs reach 0.004
_LINE_POWER = 0.002  # of the velocity's, in one line that is no harmonic: bundled rigs reach 0.0003
_BURST, _BURST_STANDS_OUT = 0.003, 8.0  # of the velocity's power in an eighth of the record; times the median: 0.004, 3
_PARTS = 8  # of the record, in which bursts are looked for
_LINE = 0.03  # amplitude of a line in the force, of half its peak-to-peak value
_LOWEST_ORDER = 20.0  # times the frequency of the motion: of a line in the force while the current changes
_ABOVE = 12.0  # times the median line around it; noise reaches 8
_AROUND = 60  # lines on either side
_NOISE = 0.026  # RMS noise of the force, of its peak-to-peak value: bundled rigs have up to 0.011
_EXTREME = 4.0  # RMS noise by which the extremes of a cycle's samples widen its peak-to-peak value
_FALLS, _FALLS_ON_AVERAGE = 3.0, 5.0  # [dB] from octave to octave; a first-order filter has 6, white noise 0
_LEAKAGE = 15.0  # [dB] from octave to octave, on average: a slow change of a channel without noise has 18
_OCTAVES = 2  # at least, over which the noise falls
_CONVERTER = -106.0  # [dB] of the peak-to-peak value: noise of the steps of 16 bits over twice the range
_LOUDEST = {"force": -80.0, "displacement": _CONVERTER}  # [dB] in the highest octave: bundled rigs have -66 at least
_SURELY_LOUD = 4e-4  # noise from sample to sample, of the peak-to-peak value: 12 dB above that level
_NO_NOISE = -160.0  # [dB] of the peak-to-peak value: less is rounding, of single precision too
_CORNER = 20.0  # times the frequency of the motion; a filter above it is late by under 0.8 % of the period
_LOWEST = 3.0  # times that frequency: below, cycles differ by more than noise
_FEWEST = 2  # cycles
_CORNER_BENDS, _BESIDE = 8.0, 3  # times the median third difference: a corner, and the samples omitted beside it
_UNEVEN = 0.4  # of a step that a stamp may be off, as rounded ones are
_TINY = 1e-30  # of the peak-to-peak value squared
_COLOURED = ("W_LAG", "W_CLIPPED", "W_FROZEN", "W_DRIFT", "W_DISTURBED", "W_HELD", "W_UNSTEADY", "W_REPEATABILITY")
_HARMONICS = 20  # of the mean cycle that a filter is taken off: beyond, noise
_LINES = 12  # of a spectrum, in the lowest octave
_SAMPLES, _MOST = 64, 2**14  # at least and at most, that have one a period earlier


class Line(NamedTuple):
    """The strongest line of a spectrum."""

    frequency: float  # [Hz]
    amplitude: float
    above: float  # times the median amplitude around it


def motion_is_one(view: View) -> Iterator[Finding]:
    """Report or refuse a velocity in which another motion than the periodic one runs."""
    motion = view.motion
    if motion is None or view.noticed("W_DRIFT", "W_CLIPPED", "W_FROZEN") or len(view.segments) > 1:
        return
    velocity = view.moving.velocity[view.steady_samples]
    rest = velocity - _periodic_velocity(view, velocity)
    inside = slice(velocity.size // 40, -(velocity.size // 40) or None)  # fits at the ends are wider of the mark
    size = float(np.var(velocity[inside]))
    share = float(np.var(rest[inside])) / size
    power = rest[inside] ** 2
    starts = np.linspace(0, power.size, _PARTS, endpoint=False).astype(int)
    parts = np.add.reduceat(power, starts) / np.diff(starts, append=power.size) / size
    burst = float(np.max(parts)) > max(_BURST, _BURST_STANDS_OUT * float(np.median(parts)))
    if share < _LINE_POWER and not burst:
        return
    line = strongest_line(view.steady.time, rest, 1.5 * motion.condition.frequency_Hz)
    if line is not None and (line.above < _ABOVE or 0.5 * line.amplitude**2 < 0.3 * float(np.var(rest))):
        line = None
    if share < _VELOCITY and not burst and (line is None or 0.5 * line.amplitude**2 < _LINE_POWER * size):
        return
    what = "the displacement is disturbed: check the sensor's cable and supply"
    if line is not None:
        stroke = line.amplitude / (2 * np.pi * line.frequency)
        other = f"another motion of {line.frequency:.4g} Hz and {1e3 * stroke:.2g} mm runs on the displacement"
        what = f"{other} (mains hum, if 50 or 60 Hz): shield the sensor's cable"
    effect = "is no part of the periodic motion, which moves the damping by"
    spectrum = f"{100 * share:.2g} % of the velocity's power {effect} "
    if share > REFUSED:
        raise view.refused("E_DISTURBED", spectrum + f"{percent(share)}: {what}", "record again, or smooth the channel")
    yield Finding("W_DISTURBED", spectrum + f"{percent(share)}; {what}")


def _periodic_velocity(view: View, velocity: Floats) -> Floats:
    """Return the velocity of the periodic motion at the steady samples, by harmonics or by the mean cycle."""
    motion, cycles, time = view.motion, steady_cycles(view), view.steady.time
    assert motion is not None
    if cycles is None:
        return motion.series(time, 1)
    phases = np.arange(POINTS) / POINTS
    if motion.distortion < SINE_DISTORTION_LIMIT or len(cycles.starts) < _FEWEST:
        return cycles.read(motion.series(cycles.starts[0] + phases * cycles.period, 1), time)
    bins = ((time - cycles.starts[0]) / cycles.period % 1.0 * POINTS).astype(int) % POINTS
    mean = np.bincount(bins, velocity, POINTS) / np.maximum(np.bincount(bins, minlength=POINTS), 1)
    return mean[bins]


def force_lines(view: View) -> Iterator[Finding]:
    """Report a line of the force that is no answer to the motion: mains hum, a resonance, a pump."""
    cycles, motion = steady_cycles(view), view.motion
    if cycles is None or motion is None or len(view.segments) > 1:
        return
    time, force = view.steady.time, view.steady.force
    rest = force - cycles.read(cycles.force.loop, time)
    order = _LOWEST_ORDER if current_changes(view) else 1.5  # harmonics change with the current
    lines = [strongest_line(time, rest, order * motion.condition.frequency_Hz)]
    lines.append(_odd_harmonic(cycles.force.loop, 1 / cycles.period))
    strong = [line for line in lines if line is not None and line.above > _ABOVE]
    half = 0.5 * cycles.force.span
    if not strong:
        return
    line = max(strong, key=lambda line: line.amplitude)
    if line.amplitude > _LINE * half:
        text = f"a line of {line.frequency:.4g} Hz and {number(line.amplitude, 3)} N runs on the force and is no answer"
        more = f"to the motion (mains hum, if 50 or 60 Hz): it moves the peak force by {percent(line.amplitude / half)}"
        yield Finding("W_DISTURBED", f"{text} {more}")


def strongest_line(time: Floats, rest: Floats, above: float) -> Line | None:
    """Return the strongest line [Hz] of what is left of a channel, above a frequency; None with too few lines."""
    size = rest.size
    length = float(time[-1] - time[0]) * size / (size - 1)
    window = np.hanning(size + 2)[1:-1]
    lines = np.abs(np.fft.rfft((rest - np.mean(rest)) * window)) * (2 / float(np.sum(window)))
    low = max(4, int(np.ceil(above * length)))
    if low >= lines.size - 10:
        return None
    at = low + int(np.argmax(lines[low:]))
    around = np.concatenate([lines[max(low, at - _AROUND) : max(low, at - 3)], lines[at + 4 : at + _AROUND]])
    usual = float(np.median(around)) if around.size else 0.0
    return Line(at / length, float(lines[at]), float(lines[at]) / usual) if usual > 0 else None


def _odd_harmonic(loop: Floats, frequency: float) -> Line | None:
    """Return a harmonic of the loop that stands out of its neighbours: a line in step with the motion."""
    lines = np.abs(np.fft.rfft(loop)) * (2 / POINTS)
    order = np.arange(8, lines.size - 4)
    beside = np.max([lines[order + shift] for shift in (-4, -3, -2, -1, 1, 2, 3, 4)], axis=0)
    above = lines[order] / np.maximum(beside, np.finfo(float).tiny)
    best = int(np.argmax(np.where(above > 4, lines[order], 0)))
    return Line(order[best] * frequency, float(lines[order[best]]), 3 * float(above[best])) if above[best] > 4 else None


def force_is_fine(view: View) -> Iterator[Finding]:
    """Report a force of much noise or of few steps: its peaks are those of the noise."""
    cycles = steady_cycles(view)
    if cycles is None or cycles.force.span == 0.0:
        return
    noise = view.force_noise / cycles.force.span
    if noise > _NOISE:
        text = f"noise of the force {100 * noise:.2g} % of its peak-to-peak value: single samples exceed the peak force"
        yield Finding("W_NOISE", f"{text} by {percent(_EXTREME * noise)}; filter before sampling, or use a finer range")


def channels_are_unfiltered(view: View) -> Iterator[Finding]:
    """Report a channel whose noise falls from a frequency on that is low enough to delay it."""
    cycles = steady_cycles(view)
    if cycles is None or len(cycles.starts) < _FEWEST or len(view.segments) > 1 or view.noticed(*_COLOURED):
        return
    loud = view.force_noise > _SURELY_LOUD * cycles.force.span
    for name in ("displacement",) if loud else ("force", "displacement"):
        levels, highest = noise_by_octave(view, name)
        if levels.size <= _OCTAVES:
            continue
        falls = np.diff(levels)
        count = int(np.argmin(np.append(falls >= _FALLS, False)))
        average = float(np.mean(falls[:count])) if count else 0.0
        corner = highest / 2**count
        if count < _OCTAVES or average < _FALLS_ON_AVERAGE or levels[count] < _CONVERTER:
            continue
        if levels[0] > _LOUDEST[name] or (name == "displacement" and average > _LEAKAGE):
            continue
        late = 1 / (2 * np.pi * corner * cycles.period)
        before = _before(cycles.force.loop, late if name == "force" else -late)
        if corner * cycles.period < _CORNER:
            yield Finding(
                "W_FILTERED",
                f"noise of the {name} falls by {number(average, 2)} dB an octave from about {corner:.3g} Hz on: a "
                f"filter of this corner makes the {name} late by {100 * late:.2g} % of the period and moves "
                f"{percent_of(*effect_on(cycles, before))}; filter both channels alike, or neither",
            )


def noise_by_octave(view: View, name: str) -> tuple[Floats, float]:
    """Median power of a channel's noise in octaves from the highest on down, and the upper end of the first [Hz].

    As (K,) levels of the RMS, if it were white, over the channel's peak-to-peak value [dB]; empty where it is no noise,
    or too short.
    """
    motion, values = view.motion, _at_every_step(view, name)
    assert motion is not None
    nyquist = 0.5 * (values.size - 1) / float(np.ptp(view.steady.time))
    period = 2 * nyquist / motion.condition.frequency_Hz
    lag = int(np.ceil(period)) + 2
    values = values[-(lag + _MOST) :]
    if values.size - lag < _SAMPLES:
        return np.empty(0), nyquist
    place = np.arange(lag, values.size, dtype=np.float64) - period
    changes = np.diff(values[lag:] - _between(values, place))
    third = np.abs(values[3:] - values[:-3] - 3 * (values[2:-1] - values[1:-2]))
    corners = np.concatenate([[False], third > _CORNER_BENDS * np.median(third), [False, False]])
    bends = np.convolve(corners, np.ones(2 * _BESIDE + 1), "same") > 0.5
    bends = bends[lag:] | bends[place.astype(int)] | bends[place.astype(int) + 1]
    window = np.hanning(changes.size + 2)[1:-1] * ~(bends[1:] | bends[:-1])
    weight = 4 * float(np.sum(window**2)) * float(np.ptp(values)) ** 2
    if not weight:
        return np.empty(0), nyquist
    length = 1 << (changes.size - 1).bit_length()  # a transform of a length with large factors takes ten times as long
    power = np.abs(np.fft.rfft(changes * window, length)) ** 2 / weight
    power = power / np.maximum(4 * np.sin(np.pi * np.arange(power.size) / length) ** 2, _TINY) + _TINY
    lowest = int(np.ceil(_LOWEST * motion.condition.frequency_Hz / nyquist * power.size))
    high, levels = power.size, []
    while high // 2 >= _LINES and high > lowest:
        levels.append(10 * np.log10(float(np.median(power[high // 2 : high])) / np.log(2)))
        high //= 2
    return np.array(levels if levels and levels[0] > _NO_NOISE else []), nyquist


def _at_every_step(view: View, name: str) -> Floats:
    """Return a channel's steady part, lines through missing samples; nothing where its clock is uneven."""
    run, values = view.steady, getattr(view.steady, name)
    steps = np.diff(run.time) / view.step
    whole = np.round(steps)
    if np.any(np.abs(steps - whole) > _UNEVEN) or np.min(whole) < 1:
        return np.empty(0)
    place = np.concatenate([[0.0], np.cumsum(whole)])
    return values if place[-1] + 1 == values.size else np.interp(np.arange(int(place[-1]) + 1), place, values)


def _between(values: Floats, place: Floats) -> Floats:
    """Values between samples, by the cubic through a sample and its slope on either side."""
    before = place.astype(int)
    t = place - before
    a, b, c, d = (values[before + shift] for shift in (-1, 0, 1, 2))
    return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))


def _before(loop: Floats, constant: float) -> Floats:
    """(P,) cycle before a first-order low-pass of a time constant [periods]; behind one, if it is negative."""
    change = 1 + 2j * np.pi * abs(constant) * np.arange(loop.size // 2 + 1)
    spectrum = np.fft.rfft(loop)
    if constant > 0:
        return np.fft.irfft(np.where(np.arange(spectrum.size) < _HARMONICS, spectrum * change, spectrum), loop.size)
    return np.fft.irfft(spectrum / change, loop.size)
