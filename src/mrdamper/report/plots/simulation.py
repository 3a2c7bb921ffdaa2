"""Figures of a simulation: histories, spectra, loops of the damper, comparison of controllers."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import islice

import numpy as np

from mrdamper.data import Floats
from mrdamper.report.plots.figure import Figure, new_figure
from mrdamper.report.plots.style import MM, PALETTE
from mrdamper.systems.result import Simulation

_SMALL = 6.5  # type size of legends [pt]
_POINTS = 4000  # of a history that are drawn
_LOOP_POINTS = 20_000  # points of a loop, which crosses its chart more often
_LOOP_S = 2.0  # of the loops about the largest force: longer ones cover each other
MOST_DRAWN = 4  # runs


def histories(runs: Mapping[str, Simulation]) -> Figure:
    """Acceleration of the last coordinate's end, the widest span, and damper force over time."""
    shown, first, point = _drawn(runs)
    span = list(first.system.spans)[int(np.argmax(first.peaks["drift_m"]))]
    figure, top, middle, bottom = new_figure(3, 1, 6.4, right=2.2 if len(shown) > 1 else 0.12)
    for colour, (title, run) in zip(PALETTE, shown.items(), strict=False):
        every = slice(None, None, max(1, run.time.size // _POINTS))
        top.plot(run.time[every], run.a[every, point], color=colour, lw=0.8, label=title)
        middle.plot(run.time[every], MM * run.span(span)[every], color=colour, lw=0.8)
        for i in run.damper_columns:
            bottom.plot(run.time[every], run.force[every, i], color=colour, lw=0.8)
    if len(shown) > 1:
        top.legend("right", size=_SMALL)
    top.label("", "acceleration (m/s²)", first.system.coordinates[point])
    middle.label("", "relative displacement (mm)", span)
    bottom.label("time (s)", "damper force (N)")
    return figure


def spectra(runs: Mapping[str, Simulation]) -> Figure:
    """Draw the power spectral density of the accelerations among the objectives, and loops about the largest force."""
    shown, first, point = _drawn(runs)
    figure, left, right = new_figure(1, 2, 3.0)
    left.x.log = left.y.log = True
    for colour, (title, run) in zip(PALETTE, shown.items(), strict=False):
        size = min(run.time.size, int(4 / run.step))
        f, density = power_spectral_density(run.a[:, point], run.step, size)
        inside = (f > 0) & (f < 60)
        left.plot(f[inside], density[inside], color=colour, lw=0.9, label=title)
        at = int(np.argmax(np.abs(first.force[:, first.damper_columns]).max(axis=1))) if first.dampers else 0
        near = slice(max(0, at - int(_LOOP_S / 2 / run.step)), at + int(_LOOP_S / 2 / run.step))
        every = slice(near.start, near.stop, -(-(near.stop - near.start) // _LOOP_POINTS))
        for i in run.damper_columns:
            right.plot(1e3 * run.stroke[every, i], run.force[every, i], color=colour, lw=0.5)
    left.legend("lower left", size=_SMALL)
    left.label("frequency (Hz)", "PSD of acceleration (m²/s³)", first.system.coordinates[point])
    right.label("stroke (mm)", "force (N)", f"damper, {_LOOP_S:g} s about the largest force")
    return figure


def _drawn(runs: Mapping[str, Simulation]) -> tuple[dict[str, Simulation], Simulation, int]:
    """Return the runs that are drawn, the first, and its coordinate of the largest acceleration; of a car the body."""
    first = next(iter(runs.values()))
    point = int(np.argmax(first.peaks["acceleration_m_s2"])) if first.system.ground is not None else 0
    return dict(islice(runs.items(), MOST_DRAWN)), first, point


def power_spectral_density(signal: Floats, step: float, size: int) -> tuple[Floats, Floats]:
    """Frequencies [Hz] and one-sided density by Welch's method: segments of `size` samples, half overlapping, Hann.

    As `scipy.signal.welch`, whose import takes as long as a simulation, between zero and half the sampling rate.
    """
    segments = np.lib.stride_tricks.sliding_window_view(signal, size)[:: size - size // 2]
    window = np.hanning(size + 1)[:-1]
    lines = np.fft.rfft((segments - segments.mean(axis=1, keepdims=True)) * window)
    density = 2 * step * np.mean(np.abs(lines) ** 2, axis=0) / np.sum(window**2)
    frequencies: Floats = np.fft.rfftfreq(size, step).astype(float)
    return frequencies, density
