"""Leaps that no damper makes: a counter that wraps, a channel set to zero in between, a single wild sample."""

from __future__ import annotations

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import QualityError
from mrdamper.rig_files.quality.view import View, place

_OF_RANGE = {"displacement": 0.3, "force": 0.5}  # of the channel's range: a leap that stays
_OFF_BY = {"displacement": 0.3, "force": 1.0}  # of the range without it: a sample that stands alone
_FAR = 10.0  # times as far as the channel moves by itself between two samples
_WIDEST = 3  # samples of a spike
_MOST = 0.01  # of the samples
_CHUNK = 2_000_000  # samples looked at


def spikes(view: View) -> None:
    """Refuse single samples far from their neighbours on both sides, which agree with each other."""
    for name in ("displacement", "force"):
        values = view.channels[name][:_CHUNK]
        found = spikes_in(values, _OFF_BY[name])
        if found.size:
            raise QualityError(
                f"{name} has {found.size} sample{'s' * (found.size > 1)} far off between ordinary ones, "
                f"first {place(view.record, int(found[0]))}: a glitch of the logger",
                where=view.where, mend="leave these cells empty: up to 2 % are taken", code="E_SPIKE",
            )  # fmt: skip


def spikes_in(values: Floats, off_by: float) -> np.ndarray:
    """First samples of the spikes of a channel."""
    if values.size < 20:
        return np.empty(0, dtype=int)
    low, high = np.nanquantile(values, [0.01, 0.99])
    if not np.any((values < 2 * low - high) | (values > 2 * high - low)) and off_by >= 1:
        return np.empty(0, dtype=int)  # nothing stands outside the range
    own = np.abs(values[1:-1] - 0.5 * (values[:-2] + values[2:]))
    usual = float(np.nanquantile(own, 0.95))
    far = max(off_by * float(high - low), _FAR * usual)
    found: list[np.ndarray] = []
    for width in range(1, _WIDEST + 1):
        before, after = values[: -width - 1], values[width + 1 :]
        inner = np.lib.stride_tricks.sliding_window_view(values[1:-1], width)
        away = inner - 0.5 * (before + after)[:, None]
        alike = np.abs(after - before) < 0.2 * far
        same_side = np.abs(away.sum(axis=1)) == np.abs(away).sum(axis=1)
        found.append(np.flatnonzero(alike & same_side & (np.abs(away).min(axis=1) > far)) + 1)
    places = np.unique(np.concatenate(found))
    return places if places.size <= max(3, _MOST * values.size) else np.empty(0, dtype=int)


def wraps(view: View) -> None:
    """Refuse a displacement that leaps, and a force that leaps against the way it goes before and after."""
    starts = {start for start, _ in view.segments}
    for name in ("displacement", "force"):
        values = view.channels[name][:_CHUNK]
        leaps = [i for i in leaps_in(values, _OF_RANGE[name], against=name == "force") if i + 1 not in starts]
        if leaps:
            size = abs(float(values[leaps[0] + 1] - values[leaps[0]]))
            unit, scale = ("mm", 1e3) if name == "displacement" else ("N", 1.0)
            raise QualityError(
                f"{name} leaps by {scale * size:.4g} {unit} {place(view.record, int(leaps[0]) + 1)}: a counter that "
                "wraps, or a channel set to zero while it was recorded",
                where=view.where, mend="export it with a wider number format, or cut the record there", code="E_LEAP",
            )  # fmt: skip


def leaps_in(values: Floats, of_range: float, *, against: bool) -> np.ndarray:
    """Samples after which a channel leaps by a share of its range, ten times as far as it ever goes in a step.

    Parameters
    ----------
    values : (N,) array
    of_range : float
    against : bool
        Only leaps against the way the channel goes before and after them: friction leaps too.
    """
    there = np.flatnonzero(np.isfinite(values))
    if there.size < 20:
        return np.empty(0, dtype=int)
    known = values[there]
    steps = np.diff(known)
    big = np.abs(steps) >= of_range * float(np.ptp(known))
    count = int(np.count_nonzero(big))
    if not count or count > _MOST * known.size:
        return np.empty(0, dtype=int)
    own = float(np.max(np.abs(steps), where=~big, initial=0.0))
    at = np.flatnonzero(big & (np.abs(steps) > _FAR * own))
    at = at[(at >= 3) & (at < steps.size - 3)]
    # A channel that stood still leaps to where it would have been: it was frozen, which is said elsewhere.
    at = at[(steps[at - 1] != 0) & (steps[at + 1] != 0)]
    if against:
        at = np.array([i for i in at if _against(steps, int(i))], dtype=int)
    return there[at]


def _against(steps: Floats, at: int) -> bool:
    leap = np.sign(steps[at])
    return bool(np.all(np.sign(steps[at - 3 : at]) == -leap) and np.all(np.sign(steps[at + 1 : at + 4]) == -leap))
