"""A force behind a low-pass filter, by the colour of its noise.

A filter rounds the corners of a loop as hysteresis does, so the loop itself does not show it. But noise that
passed it falls octave by octave from the filter's corner on, and noise that did not is white.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.quality.cycles import POINTS, steady_cycles
from mrdamper.rig_files.quality.effects import percent
from mrdamper.rig_files.quality.force_lag import effect_of_delay
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding

_FALLS, _FALLS_ON_AVERAGE = 3.0, 5.0  # [dB] from octave to octave; a first-order filter has 6, white noise 0
_OCTAVES = 2  # at least, over which the noise falls
_FLOOR = 3.0  # [dB] above the noise of the converter's steps: below, its own white noise is seen
_CORNER = 25.0  # times the frequency of the motion; a filter above it is late by under 0.7 % of the period
_LOWEST = 3.0  # times that frequency: below, cycles differ by more than noise
_FEWEST = 4  # cycles
_COLOURED = ("W_LAG", "W_CLIPPED", "W_FROZEN", "W_DRIFT", "W_DISTURBED", "W_HELD", "W_UNSTEADY", "W_REPEATABILITY")
_LINES = 12  # of a spectrum, in the lowest octave


def force_is_unfiltered(view: View) -> Iterator[Finding]:
    """Report a force whose noise falls from a frequency on that is low enough to delay it."""
    cycles = steady_cycles(view)
    if cycles is None or len(cycles.starts) < _FEWEST or len(view.segments) > 1:
        return
    if view.noticed(
        "W_LAG", "W_CLIPPED", "W_FROZEN", "W_DRIFT", "W_DISTURBED", "W_HELD", "W_UNSTEADY", "W_REPEATABILITY"
    ):
        return
    levels, highest = noise_by_octave(view)
    falls = np.diff(levels)
    count = int(np.argmin(np.append(falls >= _FALLS, False)))
    if count < _OCTAVES or float(np.sum(falls[:count])) < _FALLS_ON_AVERAGE * count:
        return
    corner = highest / 2**count
    if corner * cycles.period > _CORNER:
        return
    late = 1 / (2 * np.pi * corner * cycles.period)
    yield Finding(
        "W_FILTERED",
        f"noise of the force falls by {float(np.mean(falls[:count])):.2g} dB an octave from about {corner:.3g} Hz "
        f"on: a filter of this corner makes the force late by {100 * late:.2g} % of the period and moves the damping "
        f"by {percent(effect_of_delay(cycles, late))}; filter both channels alike, or neither",
    )


def noise_by_octave(view: View) -> tuple[Floats, float]:
    """Median power of the force's noise in octaves from the highest above the converter's floor on down.

    Returns
    -------
    levels : (K,) array
        [dB]
    highest : float
        Upper end of the first octave [Hz].
    """
    cycles, run = steady_cycles(view), view.steady
    assert cycles is not None
    place = (run.time - cycles.starts[0]) / cycles.period % 1.0 * POINTS
    loop = np.append(cycles.force.loop, cycles.force.loop[0])
    rest = run.force - np.interp(place, np.arange(POINTS + 1), loop)
    window = np.hanning(rest.size + 2)[1:-1]
    power = np.abs(np.fft.rfft((rest - np.mean(rest)) * window)) ** 2
    gaps = np.diff(np.unique(run.force))
    step = float(np.min(gaps, initial=np.inf, where=gaps > 1e-9 * cycles.force.span)) if gaps.size else 0.0
    floor = 10 * np.log10(step**2 / 12 * float(np.sum(window**2)) * np.log(2)) if 0 < step < np.inf else -np.inf
    nyquist, levels, tops = 0.5 / view.step, [], []
    high = power.size
    while high // 2 >= _LINES and nyquist * high / power.size > _LOWEST / cycles.period:
        level = 10 * np.log10(float(np.median(power[high // 2 : high])) + np.finfo(float).tiny)
        if levels or level > floor + _FLOOR:
            levels.append(level)
            tops.append(nyquist * high / power.size)
        high //= 2
    return np.array(levels), tops[0] if tops else nyquist
