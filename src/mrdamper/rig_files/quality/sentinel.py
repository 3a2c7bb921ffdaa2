"""Values that are no samples: codes of loggers for a missing value, single wild samples, a counter that wraps."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.wording import counted
from mrdamper.physics.motion.strokes import runs_of
from mrdamper.rig_files.column_names import SI
from mrdamper.rig_files.quality.samples import USED
from mrdamper.rig_files.quality.view import View, shown
from mrdamper.rig_files.record import Finding

# Leading digits of the codes in use: 999, 9999, ..., 999.25, 9.91e37, and the ends of 16-, 24- and 32-bit counts.
# Only digits are compared: a unit prefix moves the decimal point.
_NINES = (9.99, 9.999, 9.9999, 9.99999, 9.999999, 9.9925, 9.91)
_ENDS = (3.2767, 3.2768, 6.5535, 8.388607, 8.388608, 2.147483647, 2.147483648, 4.294967295)
_DIGITS = np.sort([*_NINES, *_ENDS])
_LEAP = 0.25  # of the channel's range: a code stands that far from the samples around it
_PULSES = 9  # times as far, a value that no logger writes for missing ones is no pulse of a supply
COARSEST = {"current": 0.1, "voltage": 1.0}  # leaps below are a supply's own [A, V]: ripple and a chopper's pulses
_CLOCK = 3.0  # times the mean step: larger ones are none of an even clock
_RARE = 0.1  # of the samples: a value held more often is the channel's own
_FEW = 50  # distinct values of a channel that does not vary
_CHUNK, _MOST_LEAPS = 1_000_000, 10_000  # samples, and leaps to and fro, that are looked at
_SOME = 10_000  # samples that show a channel's levels
_BLOCK = 2**16  # samples compared at a time: a cache holds them
_LONG = 20  # a value held longer than this on average is a plateau, no code
_OFTEN, _SEVERAL = 2, 3  # times that a code comes, and that another value does
_MOST_TRIED = 200  # values
_OWN = 0.4  # of the coarsest leaps: a supply's own turns
_TURNS, _ONE_TURN, _SLOPES = 2.5, 8.0, 2.0  # times as far as the channel's own turns and slopes: twice, or once
_OF_RANGE = {"displacement": 0.3, "force": 0.5}  # of the channel's range: a leap that stays
OFF_BY = {"displacement": 0.3, "force": 0.3}  # of the range without it: a sample that stands alone
_FAR_STEPS = 10.0  # times as far as the channel moves by itself between two samples
_WIDEST = 3  # samples of a spike
_MOST = 0.01  # of the samples
_MOST_SAMPLES = 2_000_000  # samples looked at
_SHOWN = 20_000  # samples from which a channel's own range and steps are taken


def missing_value_codes(view: View) -> Iterator[Finding]:
    """Refuse a channel in which one exact value stands for missing samples; say so of one no run needs."""
    for name, values in view.channels.items():
        code = None if np.isinf(values).any() else code_in(values, COARSEST.get(name, 0.0))
        if code is not None:
            at = np.flatnonzero(values == code)
            text = (
                f"{name} is {code:g} {SI[name]} in {counted(at.size, 'sample')} among others it does not "
                f"fit, first {view.place(int(at[0]))}: it reads like a logger's code for a missing value"
            )
            if name in USED:
                raise view.refused("E_SENTINEL", text, "leave these cells empty")
            yield Finding("W_MISSING", f"{text}; the channel is not used")


def code_in(values: Floats, coarsest: float) -> float | None:
    """Return the value that stands for missing samples in a channel; None if there is none.

    Leaps below `coarsest` are the channel's own, in its unit.
    """
    present = np.isfinite(values)
    if not present.any() or _runs_evenly(values):
        return None
    extremes = {float(np.nanmin(values)), float(np.nanmax(values)), 0.0}
    counts = {value: int(np.count_nonzero(values == value)) for value in extremes}
    rare = [value for value, count in counts.items() if 0 < count < _RARE * values.size]
    for value in rare:
        present &= values != value
    low = float(np.min(values, where=present, initial=np.inf))
    high = float(np.max(values, where=present, initial=-np.inf))
    scale = (high - low) + 0.05 * max(abs(low), abs(high)) + coarsest
    levels = np.unique(values[:_SOME][present[:_SOME]])
    varies = levels.size >= _FEW
    for value in sorted(rare, key=abs, reverse=True):
        away = max(low - value, value - high)
        if away > scale and (_known(value) or (varies and counts[value] > 1 and away > scale + _PULSES * coarsest)):
            return value
    if levels.size < 2 or (coarsest > 0.0 and not varies):
        return None  # a supply that flickers between a few levels leaps there and back all the time
    some, step = values[:_CHUNK], max(float(np.min(np.diff(levels))), _OWN * coarsest)
    leap = max(_LEAP * (high - low), coarsest)
    candidates = _codes_among(some) | (_repeated_leaps(some, leap) if varies else set())
    return next((value for value in sorted(candidates, key=abs) if _drops_to(some, value, step)), None)


def _runs_evenly(values: Floats) -> bool:
    """Tell a clock, whose steps are alike and forwards."""
    if values.size < 3 or not values[-1] > values[0]:
        return False
    steps = np.diff(values[:_CHUNK])
    return bool(np.min(steps) > 0 and np.max(steps) < _CLOCK * np.mean(steps)) and values.size <= _CHUNK


def _drops_to(values: Floats, value: float, step: float) -> bool:
    """Check for leaps of a channel to a value and back, much further than it turns back anywhere else.

    A force that changes its sign leaps past zero, and a V turns at its tip: neither counts.
    """
    same = values == value
    starts, stops = runs_of(same)
    inner = (starts >= 2) & (stops <= values.size - 2)
    starts, stops = starts[inner], stops[inner]
    before, after = values[starts - 1] - value, values[stops] - value
    slope = np.maximum(np.abs(values[starts - 2] - values[starts - 1]), np.abs(values[stops + 1] - values[stops]))
    away = np.where(before * after > 0, np.minimum(np.abs(before), np.abs(after)) - _SLOPES * slope, 0.0)
    if not np.any(away > _TURNS * step) or np.sum(stops - starts) > _LONG * starts.size:
        return False
    steps, near = np.diff(values), same[:-2] | same[1:-1] | same[2:]
    turns = np.where(steps[1:] * steps[:-1] < 0, np.minimum(np.abs(steps[1:]), np.abs(steps[:-1])), 0.0)
    own = max(step, float(np.nanmax(turns, where=~near, initial=0.0)))
    return bool(np.count_nonzero(away > _TURNS * own) >= 2 or np.any(away > _ONE_TURN * own))


def _codes_among(values: Floats) -> set[float]:
    """Zero and codes in use that a channel holds more than once."""
    largest = float(np.max(np.abs(values), where=np.isfinite(values), initial=0.0))
    if not largest:
        return set()
    decades = 10.0 ** np.arange(np.floor(np.log10(largest)) - 6, np.floor(np.log10(largest)) + 1)
    codes = np.outer(decades, _DIGITS).reshape(-1)
    middles = 0.5 * (codes[1:] + codes[:-1])
    candidates = []
    for start in range(0, values.size, _BLOCK):
        piece = values[start : start + _BLOCK]
        size = np.abs(piece)
        near = np.abs(size - codes[np.searchsorted(middles, size)]) < 1e-9 * size
        candidates.append(piece[near | (size == 0.0)])
    repeated, counts = np.unique(np.concatenate(candidates), return_counts=True)
    return set(repeated[counts >= _OFTEN].tolist())


def _repeated_leaps(values: Floats, leap: float) -> set[float]:
    """Values at which a channel leaps there and back: three times, or once to a code in use."""
    steps = np.abs(np.diff(values)) > leap
    sizes, counts = np.unique(values[1:-1][steps[1:] & steps[:-1]][:_MOST_LEAPS], return_counts=True)
    most = np.argsort(counts)[::-1][:_MOST_TRIED].tolist()
    return {float(sizes[i]) for i in most if counts[i] >= _SEVERAL or _known(float(sizes[i]))}


def _known(value: float) -> bool:
    """Tell if a value is a code in use."""
    size = abs(value)
    if size == 0 or size >= 1e20:
        return size > 0
    digits = size / 10.0 ** np.floor(np.log10(size))
    return bool(np.min(np.abs(digits / _DIGITS - 1)) < 1e-9)


def spikes(view: View) -> None:
    """Refuse single samples far from their neighbours on both sides, which agree with each other."""
    for name in ("displacement", "force"):
        values = view.channels[name][:_MOST_SAMPLES]
        positions = spikes_in(values, OFF_BY[name])
        if positions.size:
            raise view.refused(
                "E_SPIKE",
                f"{name} has {counted(positions.size, 'sample')} far off between ordinary ones, "
                f"first {view.place(int(positions[0]))}: a glitch of the logger",
                "leave these cells empty: up to 2 % are taken",
            )


def spikes_in(values: Floats, off_by: float) -> np.ndarray:
    """First samples of the spikes of a channel."""
    if values.size < 20:
        return np.empty(0, dtype=int)
    some = values[:: max(1, values.size // _SHOWN)]
    low, high = np.quantile(some[np.isfinite(some)], [0.01, 0.99])
    steps = np.diff(values)
    at = np.arange(1, values.size - 1)[:: max(1, values.size // _SHOWN)]
    bends = np.abs(values[at] - 0.5 * (values[at - 1] + values[at + 1]))
    usual = float(np.quantile(bends[np.isfinite(bends)], 0.95))
    far = max(off_by * float(high - low), _FAR_STEPS * usual)
    enters = np.flatnonzero(np.abs(steps[:-1]) > 0.5 * far) + 1
    # Only where the channel comes back within so many samples: a steep flank does not.
    after = np.minimum(enters[:, None] + np.arange(1, _WIDEST + 1), values.size - 1)
    enters = enters[np.any(np.abs(values[after] - values[enters - 1, None]) < 0.2 * far, axis=1)]
    if enters.size > _MOST * values.size + 3:
        return np.empty(0, dtype=int)  # a channel that leaps all the time
    alone = np.zeros(enters.size, dtype=bool)
    for width in range(1, _WIDEST + 1):  # samples that lie far off, on one side, from neighbours that agree
        last = np.minimum(enters + width, values.size - 1)
        before, after = values[enters - 1], values[last]
        away = values[np.minimum(enters + np.arange(width)[:, None], last)] - 0.5 * (before + after)
        far_off = np.all(away > far, axis=0) | np.all(away < -far, axis=0)
        alone |= far_off & (np.abs(after - before) < 0.2 * far)
    return enters[alone]


def wraps(view: View) -> None:
    """Refuse a displacement that leaps, and a force that leaps against the way it goes before and after."""
    starts = {start for start, _ in view.segments}
    for name in ("displacement", "force"):
        values = view.channels[name][:_MOST_SAMPLES]
        leaps = [i for i in leaps_in(values, _OF_RANGE[name], against=name == "force") if i + 1 not in starts]
        if leaps:
            size = shown(name, abs(float(values[leaps[0] + 1] - values[leaps[0]])))
            reason = "a counter that wraps, or a channel set to zero while it was recorded"
            problem = f"{name} leaps by {size} {view.place(int(leaps[0]) + 1)}: {reason}"
            raise view.refused("E_LEAP", problem, "export it with a wider number format, or cut the record there")


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
    big = np.abs(steps) >= large
    if np.count_nonzero(big) > _MOST * finite.size:
        return np.empty(0, dtype=int)
    own = float(np.max(np.abs(steps), where=~big, initial=0.0))
    at = np.flatnonzero(big & (np.abs(steps) > _FAR_STEPS * own))
    at = at[(at >= 3) & (at < steps.size - 3)]
    # A channel that stood still leaps to where it would have been: it was frozen, which is said elsewhere.
    at = at[(steps[at - 1] != 0) & (steps[at + 1] != 0)]
    if against:
        signs = np.sign(steps)
        around = np.array([-3, -2, -1, 1, 2, 3])
        at = at[np.all(signs[at[:, None] + around] == -signs[at][:, None], axis=1)]
    return there[at]
