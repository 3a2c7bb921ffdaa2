"""A channel behind a low-pass filter, by the colour of its noise.

A filter rounds the corners of a loop as hysteresis does, so the loop itself does not show it. But noise that
passed it falls octave by octave from the filter's corner on, and noise that did not is white. Noise is what a
sample differs by from the one a period earlier. The motion itself differs from cycle to cycle, and less the
faster: a displacement counts as filtered only if its noise falls below that of any converter.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.quality.cycles import steady_cycles
from mrdamper.rig_files.quality.effects import percent
from mrdamper.rig_files.quality.force_lag import effect_of_delay
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding

_FALLS, _FALLS_ON_AVERAGE = 3.0, 5.0  # [dB] from octave to octave; a first-order filter has 6, white noise 0
_LEAKAGE = 15.0  # [dB] from octave to octave, on average: a slow change of a channel without noise has 18
_OCTAVES = 2  # at least, over which the noise falls
_CONVERTER = -106.0  # [dB] of the peak-to-peak value: noise of the steps of 16 bits over twice the range
_CORNER = 20.0  # times the frequency of the motion; a filter above it is late by under 0.8 % of the period
_LOWEST = 3.0  # times that frequency: below, cycles differ by more than noise
_FEWEST = 3  # cycles
_UNLIKE = -0.2  # correlation of a change with the one a period later: noise has -0.5, errors of interpolation more
_COLOURED = ("W_LAG", "W_CLIPPED", "W_FROZEN", "W_DRIFT", "W_DISTURBED", "W_HELD", "W_UNSTEADY", "W_REPEATABILITY")
_LINES = 12  # of a spectrum, in the lowest octave
_SAMPLES = 64  # at least, that have one a period earlier


def channels_are_unfiltered(view: View) -> Iterator[Finding]:
    """Report a channel whose noise falls from a frequency on that is low enough to delay it."""
    cycles = steady_cycles(view)
    if cycles is None or len(cycles.starts) < _FEWEST or len(view.segments) > 1 or view.noticed(*_COLOURED):
        return
    for name in ("force", "displacement"):
        levels, highest = noise_by_octave(view, name)
        if levels.size <= _OCTAVES:
            continue
        falls = np.diff(levels)
        count = int(np.argmin(np.append(falls >= _FALLS, False)))
        average = float(np.mean(falls[:count])) if count else 0.0
        corner = highest / 2**count
        if count < _OCTAVES or average < _FALLS_ON_AVERAGE or levels[count] < _CONVERTER:
            continue
        if name == "displacement" and (levels[0] > _CONVERTER or average > _LEAKAGE):
            continue
        late = 1 / (2 * np.pi * corner * cycles.period)
        effect = effect_of_delay(cycles, late if name == "force" else -late)
        if corner * cycles.period < _CORNER:
            yield Finding(
                "W_FILTERED",
                f"noise of the {name} falls by {average:.2g} dB an octave from about {corner:.3g} Hz on: a filter of "
                f"this corner makes the {name} late by {100 * late:.2g} % of the period and moves the damping by "
                f"{percent(effect)}; filter both channels alike, or neither",
            )


def noise_by_octave(view: View, name: str) -> tuple[Floats, float]:
    """Median power of a channel's noise in octaves from the highest on down.

    Returns
    -------
    levels : (K,) array
        RMS, if it were white, over the channel's peak-to-peak value [dB]; empty where it is no noise, or too short.
    highest : float
        Upper end of the first octave [Hz].
    """
    motion, values = view.motion, getattr(view.steady, name)
    assert motion is not None
    period = 1 / motion.condition.frequency_Hz / view.step
    lag, nyquist = int(np.ceil(period)) + 2, 0.5 / view.step
    if values.size - lag < _SAMPLES:
        return np.empty(0), nyquist
    changes = values[lag:] - _between(values, np.arange(lag, values.size) - period)
    window = np.hanning(changes.size + 2)[1:-1]
    power = np.abs(np.fft.rfft((changes - np.mean(changes)) * window)) ** 2 / (2 * float(np.sum(window**2)))
    power = power / float(np.ptp(values)) ** 2 + np.finfo(float).tiny
    lowest = int(np.ceil(_LOWEST * motion.condition.frequency_Hz / nyquist * power.size))
    later = np.cos(2 * np.pi * np.arange(lowest, power.size) * period / changes.size)
    if float(power[lowest:] @ later) > _UNLIKE * float(np.sum(power[lowest:])):
        return np.empty(0), nyquist
    high, levels = power.size, []
    while high // 2 >= _LINES and high > lowest:
        levels.append(10 * np.log10(float(np.median(power[high // 2 : high])) / np.log(2)))
        high //= 2
    return np.array(levels), nyquist


def _between(values: Floats, place: Floats) -> Floats:
    """Values between samples, by the cubic through a sample and its slope on either side."""
    before = place.astype(int)
    t = place - before
    a, b, c, d = (values[before + shift] for shift in (-1, 0, 1, 2))
    return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
