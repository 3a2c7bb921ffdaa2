"""A velocity channel must be the derivative of displacement: on time, of its size and of its sign."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.quality.view import View

SAMPLES = 1.5  # a velocity formed by backward differences and one filter step is this late
OF_PERIOD = 0.0025  # and this much of a period cannot be seen in any loop
GAIN = 0.2  # a velocity this much too large or too small is in another unit
UNLIKE = 0.5  # more of the channel left unexplained, and it is another quantity
_ROWS = 4_000  # samples compared at most


class Delay(NamedTuple):
    """One signal against another, as offset + gain · reference(t − delay)."""

    delay: float  # [s], positive where the signal is late
    gain: float
    unexplained: float  # share of the signal's variance


def velocity_channel(view: View) -> None:
    """Refuse a velocity channel that is not the derivative of displacement."""
    channel, run = view.record.velocity, view.run
    if channel is None:
        return
    measured = channel[view.index]
    there = np.isfinite(measured)
    if np.count_nonzero(there) < 0.5 * there.size:
        return
    measured = np.interp(run.time, run.time[there], measured[there])
    period = view.strokes.period or float(np.ptp(run.time))  # a record without two reversals is a cycle at most
    delay = delay_between(run.time, view.moving.velocity, measured, period)
    late = abs(delay.delay) > max(SAMPLES * view.step, OF_PERIOD * period)
    sign = f"set [channels.velocity] sign = {1 if view.has_changed_sign('velocity') else -1} in a profile"
    remedy = sign if delay.gain < 0 else "correct its unit in a profile"
    if delay.unexplained > UNLIKE:
        what = "is not the derivative of displacement, at any delay"
    elif delay.gain < 0:
        what = "runs against the derivative of displacement"
    elif late:
        side = "behind" if delay.delay > 0 else "ahead of"
        what = f"is {1e3 * abs(delay.delay):.4g} ms {side} the derivative of displacement"
        remedy = f"set [channels.velocity] delay_ms = {1e3 * delay.delay:.4g} in a profile"
    elif abs(delay.gain - 1) > GAIN:
        what = f"is {delay.gain:.3g} times the derivative of displacement"
    else:
        return
    raise view.refused("E_CHANNEL_LAG", f"velocity {what}", f"{remedy}, or leave the column out")


def delay_between(time: Floats, reference: Floats, signal: Floats, period: float) -> Delay:
    """Find the delay of a signal against a reference, within half a period [s] either way.

    A signal that is the reference's negative, to a twentieth of its variance, is called that
    rather than half a period late. Otherwise the best of a grid of delays is refined by
    Gauss–Newton on delay, gain and offset.
    """
    few = slice(None, None, max(1, time.size // 500))
    turned = _at(0.0, time[few], signal[few], time, reference)
    if turned.gain < 0 and turned.unexplained < 0.05:
        return turned
    grid = np.linspace(-0.5, 0.5, 81)[1:-1] * period
    trials = [_at(delay, time[few], signal[few], time, reference) for delay in grid]
    rising = [trial for trial in trials if trial.gain > 0] or trials
    delay = min(rising, key=lambda trial: trial.unexplained).delay
    rows = slice(None, None, max(1, time.size // _ROWS))
    t, s, slope = time[rows], signal[rows], np.gradient(reference, time)
    for _ in range(6):
        inside = (t - delay >= time[0]) & (t - delay <= time[-1])
        shifted = t[inside] - delay
        columns = [np.ones(shifted.size), np.interp(shifted, time, reference), -np.interp(shifted, time, slope)]
        _, gain, moved = np.linalg.lstsq(np.column_stack(columns), s[inside], rcond=None)[0]
        if gain == 0 or abs(moved / gain) > 0.1 * period:
            break
        delay += float(moved / gain)
    return _at(delay, t, s, time, reference)


def _at(delay: float, t: Floats, signal: Floats, time: Floats, reference: Floats) -> Delay:
    inside = (t - delay >= time[0]) & (t - delay <= time[-1])
    r, s = np.interp(t[inside] - delay, time, reference), signal[inside]
    r, s = r - np.mean(r), s - np.mean(s)
    size = float(r @ r)
    gain = float(r @ s) / size if size > 0 else 0.0
    left = float(np.mean((s - gain * r) ** 2)) / max(float(np.mean(s**2)), np.finfo(float).tiny)
    return Delay(float(delay), gain, left)
