"""The motion of a recorded run: smooth displacement, velocity and acceleration at the right phase.

Calculations use the measured motion and not the commanded one.
"""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np

from mrdamper.data.arrays import Floats, blocks
from mrdamper.data.runs import Run, once_per_run
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.path import memoize_per_path

_UNIFORM = 1e-8  # spread of the sampling interval, relative, up to which it counts as one
_ROUNDING = 4 * float(np.finfo(float).eps)  # of the largest value: a smaller slope per sample is rounding
_CELLS = 4_000_000  # largest number of values of all windows in memory
_CACHED_SAMPLES = 4_000  # samples whose sums fit the processor's cache


@once_per_run
def measured_motion(run: Run) -> Excitation:
    """Smooth motion of a run, from its measured displacement.

    A quadratic is fitted around each sample over a fortieth of the motion's period (at least five samples); its value,
    slope and curvature are displacement, velocity and acceleration. The fit is centred, without a phase shift, and does
    not cross a gap in time. A constant current has no noise.
    """
    if len(run.segments) == 1:
        x, v, a = smooth(run.time, run.displacement)
    else:
        x, v, a = np.concatenate([smooth(run.time[a:b], run.displacement[a:b]) for a, b in run.segments], axis=1)
    return Excitation(run.time, x, v, a, run.coil_current)


@memoize_per_path
def smooth(time: Floats, signal: Floats, span: float | None = None) -> Floats:
    """(3, N) value, slope and curvature of local quadratics through a signal (N,); sampling need not be uniform.

    `span` is the width of the fit [s]; default a fortieth of the signal's characteristic period 2π
    rms(signal)/rms(slope). Never under five samples.
    """
    size, time = time.size, whole_clock(time)
    if span is None:
        span = _characteristic_period(time, signal) / 40
    spacing = float(time[-1] - time[0]) / (size - 1)
    half = min(max(round(span / spacing / 2), 2), max((size - 1) // 2, 1))
    width = min(2 * half + 1, size)
    uniform = width == 2 * half + 1 and np.ptp(np.diff(time)) < _UNIFORM * spacing
    c = _fits_uniform(signal, half) if uniform else _fits(time, signal, half, width, spacing)
    slope = c[1]
    slope[np.abs(slope) <= _ROUNDING * np.max(np.abs(signal), initial=0.0)] = 0.0  # else its sign is rounding
    return np.stack([signal + c[0], slope / spacing, 2 * c[2] / spacing**2])


def _fits(time: Floats, signal: Floats, half: int, width: int, spacing: float) -> Floats:
    """(3, N) quadratics about each sample, in steps of the spacing, their values less the sample."""
    size = signal.size
    windows = np.lib.stride_tricks.sliding_window_view
    c = np.empty((3, size))
    for rows in blocks(size, _CELLS // width):
        start = np.clip(np.arange(size)[rows] - half, 0, size - width)
        tau = (windows(time, width)[start] - time[rows, None]) / spacing
        values = windows(signal, width)[start] - signal[rows, None]
        moments = [np.ones_like(tau), tau, tau * tau]
        normal = np.stack([[np.sum(p * q, axis=1) for q in moments] for p in moments])
        right = np.stack([np.sum(p * values, axis=1) for p in moments])
        c[:, rows] = np.linalg.solve(normal.transpose(2, 0, 1), right.T[..., None])[..., 0].T
    return c


def whole_clock(time: Floats) -> Floats:
    """Time stamps without their rounding, if the whole record has constant steps.

    With stamps to 0.1 ms, 3004.8 samples per second appear as 3333 between two of them, but not over the record. An
    uneven clock is unchanged.
    """
    steps = np.diff(time)
    rounding = float(np.ptp(steps))
    even = np.linspace(float(time[0]), float(time[-1]), time.size)
    spacing = float(even[1] - even[0])
    rounded = _UNIFORM * spacing < rounding < 0.5 * spacing and np.max(np.abs(time - even)) <= 1.01 * rounding
    return even if rounded else time


def _fits_uniform(signal: Floats, half: int) -> Floats:
    """Fit equal windows (Savitzky and Golay).

    Samples are taken relative to the middle and the two sides in pairs, so that a signal at rest, or
    one that turns symmetrically about a sample, has a slope of exactly zero there.
    """
    tau, fit = _quadratic(half)
    last = signal.size - half
    c = np.zeros((3, signal.size))
    for rows in blocks(last - half, _CACHED_SAMPLES):
        inside = slice(half + rows.start, half + rows.stop)
        middle, (value, slope, curvature) = signal[inside], c[:, inside]
        pair, other = np.empty((2, middle.size))
        for step, (even, odd, bent) in enumerate(fit[half + 1 :].tolist(), start=1):
            after, before = (
                signal[inside.start + step : inside.stop + step],
                signal[inside.start - step : inside.stop - step],
            )
            np.subtract(after, before, out=pair)
            slope += np.multiply(pair, odd, out=pair)
            np.subtract(after, middle, out=pair)
            pair += np.subtract(before, middle, out=other)
            value += np.multiply(pair, even, out=other)
            curvature += np.multiply(pair, bent, out=pair)
    ends = (signal[: tau.size], slice(0, half)), (signal[-tau.size :], slice(last, None))
    for window, away in ends:
        d0, d1, d2 = ((window - signal[away, None]) @ fit).T  # outside the middle of the window
        at = tau[:half] if away.start == 0 else tau[half + 1 :]
        c[:, away] = d0 + at * (d1 + at * d2), d1 + 2 * at * d2, d2
    return c


@lru_cache(maxsize=64)
def _quadratic(half: int) -> tuple[Floats, Floats]:
    """Return the steps of a window from its middle, and (width, 3) weights of the quadratic through it."""
    tau = np.arange(-half, half + 1.0)
    fit = np.linalg.pinv(np.column_stack([np.ones_like(tau), tau, tau**2]))
    return tau, np.asarray(fit.T, dtype=float)


def _characteristic_period(time: Floats, signal: Floats) -> float:
    spacing = float(time[-1] - time[0]) / (time.size - 1)

    @cache
    def period(step: int) -> float:
        t, s = time[::step], signal[::step]
        slope = np.diff(s) / np.diff(t)
        moving = np.sqrt(np.mean(slope**2))
        return float(2 * np.pi * np.std(s) / moving) if moving > 0 else 0.0

    # Slopes over about 1/200 of the record keep sample noise out of the estimate.
    step = max(1, time.size // 2000)
    # For hundreds of cycles the step is reduced from single samples up, where noise ends before the motion.
    fine = 1
    while fine < step and fine * spacing < period(fine) / 40:
        fine *= 2
    return period(fine if step * spacing > period(fine) / 4 else step)
