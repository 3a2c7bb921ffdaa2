"""Codes that loggers write for a missing value: −9999 and the like, scattered among real samples."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import QualityError
from mrdamper.rig_files.quality.presence import USED, runs_of
from mrdamper.rig_files.quality.view import UNITS, View, place
from mrdamper.rig_files.record import Finding

# Leading digits of the codes in use: 999, 9999, ..., 999.25, 9.91e37, and the ends of 16-, 24- and 32-bit counts.
# Only digits are compared: a unit prefix moves the decimal point.
_NINES = (9.99, 9.999, 9.9999, 9.99999, 9.999999, 9.9925, 9.91)
_ENDS = (3.2767, 3.2768, 6.5535, 8.388607, 8.388608, 2.147483647, 2.147483648, 4.294967295)
_DIGITS = np.array([*_NINES, *_ENDS])
_LEAP = 0.25  # of the channel's range: a code stands that far from the samples around it
_FAR = 2.0  # times as far as all but a hundredth of the channel's own leaps
_PULSES = 9  # times as far, a value that no logger writes for missing ones is no pulse of a supply
COARSEST = {"current": 0.1}  # leaps below are a supply's own [A]: ripple and a chopper's pulses
_RARE = 0.1  # of the samples: a value held more often is the channel's own
_FEW = 50  # distinct values of a channel that does not vary
_CHUNK = 1_000_000  # samples looked at together
_LONG = 20  # a value held longer than this on average is a plateau, no code
_OFTEN, _MORE = 2, 4  # times, and times more for each that a level beside it comes again
_AROUND, _APART = 20, 0.4  # levels on either side, share that leaps
_ENOUGH = 50  # of a channel's own samples, below which its leaps say nothing


def missing_value_codes(view: View) -> Iterator[Finding]:
    """Refuse a channel in which one exact value stands for missing samples; say so of one no run needs."""
    for name, values in view.channels.items():
        code = None if np.isinf(values).any() else code_in(values, COARSEST.get(name, 0.0))
        if code is not None:
            at = np.flatnonzero(values == code)
            text = (
                f"{name} is {code:g} {UNITS[name]} in {at.size} sample{'s' * (at.size > 1)} among others it does not "
                f"fit, first {place(view.record, int(at[0]))}: it reads like a logger's code for a missing value"
            )
            if name in USED:
                raise QualityError(text, where=view.where, mend="leave these cells empty", code="E_SENTINEL")
            yield Finding("W_MISSING", f"{text}; the channel is not used")


def code_in(values: Floats, coarsest: float) -> float | None:
    """The value that stands for missing samples in a channel; None if there is none.

    Parameters
    ----------
    values : (N,) array
    coarsest : float
        Leaps below are the channel's own, in its unit.
    """
    present = np.isfinite(values)
    if not present.any():
        return None
    extremes = {float(np.nanmin(values)), float(np.nanmax(values)), 0.0}
    counts = {value: int(np.count_nonzero(values == value)) for value in extremes}
    rare = [value for value, count in counts.items() if 0 < count < _RARE * values.size]
    for value in rare:
        present &= values != value
    low = float(np.min(values, where=present, initial=np.inf))
    high = float(np.max(values, where=present, initial=-np.inf))
    scale = (high - low) + 0.05 * max(abs(low), abs(high)) + coarsest
    varies = np.unique(values[present][:10_000]).size >= _FEW
    for value in sorted(rare, key=abs, reverse=True):
        away = max(low - value, value - high)
        if away > scale and (_known(value) or (varies and counts[value] > 1 and away > scale + _PULSES * coarsest)):
            return value
    if not varies:
        return None  # a channel that flickers between a few levels leaps there and back all the time
    leap = max(_LEAP * (high - low), coarsest)
    for value, count in _repeated_leaps(values, leap):
        usual = _known(value) or value == 0.0
        if count < (1 if _known(value) else 2 if usual else 3):
            continue
        off, share = _scattered(values, value, leap)
        scattered = share >= 0.5 or off >= 2 if usual else share >= 0.8
        if scattered and _stands_out(values, value, leap):
            return value
    return _too_often(values, extremes - {0.0})


def _too_often(values: Floats, ends: set[float]) -> float | None:
    """A code in use, or zero, that a fine channel holds far more often than the values around it.

    Among samples of its own size a code does not stand off; but a channel passes each of its
    levels about as often, and its samples are smooth.
    """
    some = values[np.isfinite(values)][:_CHUNK]
    levels, counts = np.unique(some, return_counts=True)
    if levels.size < _FEW:
        return None
    for at in np.flatnonzero(counts >= _OFTEN):
        value = float(levels[at])
        if value in ends or not (value == 0.0 or _known(value)):
            continue
        around = np.r_[counts[max(0, at - _AROUND) : at], counts[at + 1 : at + 1 + _AROUND]]
        if counts[at] < _OFTEN + _MORE * (int(np.max(around, initial=1)) - 1):
            continue
        steps = np.abs(values[1:-1] - 0.5 * (values[:-2] + values[2:]))[:_CHUNK]
        same = values[1:-1][:_CHUNK] == value
        own = steps[~same & np.isfinite(steps)]
        apart = steps[same & np.isfinite(steps)]
        if apart.size and np.mean(apart > 3 * np.quantile(own, 0.9)) > _APART:
            return value
    return None


def _repeated_leaps(values: Floats, leap: float) -> list[tuple[float, int]]:
    """Values, each with its count, at which a channel leaps there and back: twice, or once to a code in use."""
    leaps = []
    for start in range(0, values.size, _CHUNK):
        piece = values[start : start + _CHUNK + 2]
        steps = np.abs(np.diff(piece)) > leap
        leaps.append(piece[1:-1][steps[1:] & steps[:-1]][: _CHUNK // 100])
    found, counts = np.unique(np.concatenate(leaps), return_counts=True)
    most = np.argsort(counts)[::-1][:200]
    return [(float(found[i]), int(counts[i])) for i in most if counts[i] > 1 or _known(float(found[i]))]


def _known(value: float) -> bool:
    size = abs(value)
    if size >= 1e20:
        return True
    if size == 0.0:
        return False
    digits = size / 10.0 ** np.floor(np.log10(size))
    return bool(np.any(np.abs(digits / _DIGITS - 1) < 1e-9))


def _scattered(values: Floats, value: float, leap: float) -> tuple[int, float]:
    """Number and share of a value's occurrences that stand off from the samples on both sides."""
    starts, stops = runs_of(values == value)
    inner = (starts > 0) & (stops < values.size)
    starts, stops = starts[inner], stops[inner]
    if not starts.size or np.mean(stops - starts) > _LONG:
        return 0, 0.0
    off = (np.abs(values[starts - 1] - value) > leap) & (np.abs(values[stops] - value) > leap)
    return int(np.count_nonzero(off)), float(np.mean(off))


def _stands_out(values: Floats, value: float, leap: float) -> bool:
    """Whether a channel leaps to a value from much further than it leaps by itself.

    A leap is how far a sample lies from the middle of its neighbours.
    """
    for_all = np.abs(values[1:-1] - 0.5 * (values[:-2] + values[2:]))[:_CHUNK]
    same = values == value
    near = (same[:-2] | same[1:-1] | same[2:])[:_CHUNK]
    own = for_all[~near & np.isfinite(for_all)]
    at = for_all[same[1:-1][:_CHUNK] & np.isfinite(for_all) & (for_all > leap)]
    if own.size < _ENOUGH or not at.size:
        return False
    return bool(np.median(at) > _FAR * np.quantile(own, 0.99))
