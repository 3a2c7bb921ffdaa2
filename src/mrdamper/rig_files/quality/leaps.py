"""Leaps that no damper makes: a counter that wraps, a channel set to zero in between, a single wild sample."""

from __future__ import annotations

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.quality.view import View

_OF_RANGE = {"displacement": 0.3, "force": 0.5}  # of the channel's range: a leap that stays
OFF_BY = {"displacement": 0.3, "force": 0.3}  # of the range without it: a sample that stands alone
_FAR = 10.0  # times as far as the channel moves by itself between two samples
_WIDEST = 3  # samples of a spike
_MOST = 0.01  # of the samples
_CHUNK = 2_000_000  # samples looked at
_SAMPLE = 20_000  # samples from which a channel's own range and steps are taken


def spikes(view: View) -> None:
    """Refuse single samples far from their neighbours on both sides, which agree with each other."""
    for name in ("displacement", "force"):
        values = view.channels[name][:_CHUNK]
        positions = spikes_in(values, OFF_BY[name])
        if positions.size:
            raise view.refused(
                "E_SPIKE",
                f"{name} has {positions.size} sample{'s' * (positions.size > 1)} far off between ordinary ones, "
                f"first {view.place(int(positions[0]))}: a glitch of the logger",
                "leave these cells empty: up to 2 % are taken",
            )


def spikes_in(values: Floats, off_by: float) -> np.ndarray:
    """First samples of the spikes of a channel."""
    if values.size < 20:
        return np.empty(0, dtype=int)
    some = values[:: max(1, values.size // _SAMPLE)]
    low, high = np.quantile(some[np.isfinite(some)], [0.01, 0.99])
    steps = np.diff(values)
    if not np.nanmax(np.abs(steps)) > 0.5 * off_by * float(high - low):
        return np.empty(0, dtype=int)
    at = np.arange(1, values.size - 1)[:: max(1, values.size // _SAMPLE)]
    bends = np.abs(values[at] - 0.5 * (values[at - 1] + values[at + 1]))
    usual = float(np.quantile(bends[np.isfinite(bends)], 0.95))
    far = max(off_by * float(high - low), _FAR * usual)
    enters = np.flatnonzero(np.abs(steps[:-1]) > 0.5 * far) + 1
    # Only where the channel comes back within so many samples: a steep flank does not.
    after = np.minimum(enters[:, None] + np.arange(1, _WIDEST + 1), values.size - 1)
    enters = enters[np.any(np.abs(values[after] - values[enters - 1, None]) < 0.2 * far, axis=1)]
    if enters.size > _MOST * values.size + 3:
        return np.empty(0, dtype=int)  # a channel that leaps all the time
    return np.array([i for i in enters if _stands_alone(values, int(i), far)], dtype=int)


def _stands_alone(values: Floats, at: int, far: float) -> bool:
    """Check for up to three samples from here on that lie far off, on one side, from neighbours that agree."""
    for width in range(1, _WIDEST + 1):
        if at + width >= values.size:
            return False
        before, after, inner = values[at - 1], values[at + width], values[at : at + width]
        away = inner - 0.5 * (before + after)
        one_side = abs(float(np.sum(away))) == float(np.sum(np.abs(away)))
        if abs(after - before) < 0.2 * far and one_side and float(np.min(np.abs(away))) > far:
            return True
    return False


def wraps(view: View) -> None:
    """Refuse a displacement that leaps, and a force that leaps against the way it goes before and after."""
    starts = {start for start, _ in view.segments}
    for name in ("displacement", "force"):
        values = view.channels[name][:_CHUNK]
        leaps = [i for i in leaps_in(values, _OF_RANGE[name], against=name == "force") if i + 1 not in starts]
        if leaps:
            size = abs(float(values[leaps[0] + 1] - values[leaps[0]]))
            unit, scale = ("mm", 1e3) if name == "displacement" else ("N", 1.0)
            raise view.refused(
                "E_LEAP",
                f"{name} leaps by {scale * size:.4g} {unit} {view.place(int(leaps[0]) + 1)}: a counter that "
                "wraps, or a channel set to zero while it was recorded",
                "export it with a wider number format, or cut the record there",
            )


def leaps_in(values: Floats, of_range: float, *, against: bool) -> np.ndarray:
    """Return samples after which a channel leaps by a share of its range, ten times as far as it ever goes in a step.

    Maybe only leaps against the way the channel goes before and after them: friction leaps too.
    """
    there = np.flatnonzero(np.isfinite(values))
    if there.size < 20:
        return np.empty(0, dtype=int)
    finite = values if there.size == values.size else values[there]
    steps = np.diff(finite)
    large = of_range * float(np.ptp(finite))
    if max(float(np.max(steps)), -float(np.min(steps))) < large:
        return np.empty(0, dtype=int)
    big = np.abs(steps) >= large
    count = int(np.count_nonzero(big))
    if not count or count > _MOST * finite.size:
        return np.empty(0, dtype=int)
    own = float(np.max(np.abs(steps), where=~big, initial=0.0))
    at = np.flatnonzero(big & (np.abs(steps) > _FAR * own))
    at = at[(at >= 3) & (at < steps.size - 3)]
    # A channel that stood still leaps to where it would have been: it was frozen, which is said elsewhere.
    at = at[(steps[at - 1] != 0) & (steps[at + 1] != 0)]
    if against:
        signs = np.sign(steps)
        around = np.array([-3, -2, -1, 1, 2, 3])
        at = at[np.all(signs[at[:, None] + around] == -signs[at][:, None], axis=1)]
    return there[at]
