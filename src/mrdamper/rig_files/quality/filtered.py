"""A channel behind a low-pass filter, by the colour of its noise.

A filter rounds the corners of a loop as hysteresis does, so the loop itself does not show it. But noise that
passed it falls octave by octave from the filter's corner on, and noise that did not is white. Noise is what a
sample differs by from the one a period earlier, corners of the loop left out. The motion itself differs from cycle
to cycle, and less the faster, so that a channel counts as filtered only if its noise falls below what a load cell or
a converter has.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.quality.cycles import steady_cycles
from mrdamper.rig_files.quality.effects import effect_on, percent_of
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding

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
_CORNER_BENDS, _BESIDE = 8.0, 3  # times the median third difference: a corner, and the samples left out beside it
_UNEVEN = 0.4  # of a step that a stamp may be off, as rounded ones are
_TINY = 1e-30  # of the peak-to-peak value squared
_COLOURED = ("W_LAG", "W_CLIPPED", "W_FROZEN", "W_DRIFT", "W_DISTURBED", "W_HELD", "W_UNSTEADY", "W_REPEATABILITY")
_HARMONICS = 20  # of the mean cycle that a filter is taken off: beyond, noise
_LINES = 12  # of a spectrum, in the lowest octave
_SAMPLES, _MOST = 64, 2**14  # at least and at most, that have one a period earlier


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
                f"noise of the {name} falls by {average:.2g} dB an octave from about {corner:.3g} Hz on: a filter of "
                f"this corner makes the {name} late by {100 * late:.2g} % of the period and moves "
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
