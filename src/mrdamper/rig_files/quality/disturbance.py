"""Motion and force that are no part of the damper's periodic answer: mains hum, noise, steps of coarse converters.

What counts is what identification is given: the velocity of the smoothed displacement. Its part that
the periodic motion does not explain lowers the damping by its share of the velocity's power, as
errors of a regressor do.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mrdamper.data import Floats
from mrdamper.physics.motion import SINE_DISTORTION_LIMIT
from mrdamper.rig_files.quality.cycles import POINTS, steady_cycles
from mrdamper.rig_files.quality.effects import REFUSED, percent
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding

_VELOCITY = 0.008  # power of the velocity that is no part of the motion, of all: bundled rigs reach 0.004
_LINE_POWER = 0.002  # of the velocity's, in one line that is no harmonic: bundled rigs reach 0.0003
_BURST, _BURST_STANDS_OUT = 0.003, 8.0  # of the velocity's power in an eighth of the record; times the median: 0.004, 3
_PARTS = 8  # of the record, in which bursts are looked for
_LINE = 0.03  # amplitude of a line in the force, of half its peak-to-peak value
_ABOVE = 12.0  # times the median line around it; noise reaches 8
_AROUND = 60  # lines on either side
_NOISE = 0.026  # RMS noise of the force, of its peak-to-peak value: bundled rigs have up to 0.011
_EXTREME = 4.0  # RMS noise by which the extremes of a cycle's samples widen its peak-to-peak value


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
    start, stop = view.strokes.steady or (0, view.run.time.size)
    velocity = view.moving.velocity[start:stop]
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
        what = (
            f"another motion of {line.frequency:.4g} Hz and {1e3 * stroke:.2g} mm runs on the displacement (mains hum, "
            "if 50 or 60 Hz): shield the sensor's cable"
        )
    spectrum = (
        f"{100 * share:.2g} % of the velocity's power is no part of the periodic motion, which moves the damping by "
    )
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
    if motion.distortion < SINE_DISTORTION_LIMIT or len(cycles.starts) < 3:
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
    lines = [strongest_line(time, rest, 1.5 * motion.condition.frequency_Hz)]
    lines.append(_odd_harmonic(cycles.force.loop, 1 / cycles.period))
    strong = [line for line in lines if line is not None and line.above > _ABOVE]
    half = 0.5 * cycles.force.span
    if not strong:
        return
    line = max(strong, key=lambda line: line.amplitude)
    if line.amplitude > _LINE * half:
        yield Finding(
            "W_DISTURBED",
            f"a line of {line.frequency:.4g} Hz and {line.amplitude:.3g} N runs on the force and is no answer to the "
            f"motion (mains hum, if 50 or 60 Hz): it moves the peak force by {percent(line.amplitude / half)}",
        )


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
        yield Finding(
            "W_NOISE",
            f"noise of the force {100 * noise:.2g} % of its peak-to-peak value: single samples exceed the peak force "
            f"by {percent(_EXTREME * noise)}; filter before sampling, or use a finer range",
        )
