"""Stretches of equal samples that no motion makes: clipped at the end of a range, or frozen inside it.

A coarse channel repeats itself at every slow turn, and a table may stick there; a rig at
rest repeats itself for seconds. So a stretch counts only if the samples around it say that
the channel would have gone on (`_kink`), if its noise would have shown (`_too_quiet`), if
the samples pile up at the very end of the range (`_piled_up`), or if another channel made
much of a stroke meanwhile (`_long_while`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.quality.noise import sample_noise
from mrdamper.rig_files.quality.presence import runs_of
from mrdamper.rig_files.quality.view import View, place
from mrdamper.rig_files.record import Finding

FLAT = 5  # samples in a row that make a flat top or a frozen stretch
_BEND = 1.5e-4  # of the channel's range: a channel that would have moved less may have stood still
_LEVELS = 6  # resolution steps it must have missed
_COARSE = 1e-5  # a resolution step of this share of the range shows in a force that is held by friction
_LEAP = 0.03  # of the range: a channel that leaves a flat top with such a step was not clipped but frozen
_NEAR = 100  # samples on either side from which the noise is taken
_CHANCE = 1e-4  # that noise repeats itself as often anywhere in the record
_MOST = 20_000  # stretches looked at
_CHUNK = 1_000_000  # samples looked at together


@dataclass(frozen=True)
class Stretches:
    """Equal samples in a row.

    Attributes
    ----------
    starts, stops : (K,) int arrays
        Half-open sample ranges.
    """

    starts: np.ndarray
    stops: np.ndarray

    def __len__(self) -> int:
        return self.starts.size

    @property
    def samples(self) -> int:
        """Samples in all stretches together."""
        return int(np.sum(self.stops - self.starts))

    def only(self, keep: Callable[[int, int], bool]) -> Stretches:
        """Those that pass a test of start and stop."""
        chosen = np.array([keep(int(a), int(b)) for a, b in zip(self.starts, self.stops, strict=True)], dtype=bool)
        return Stretches(self.starts[chosen], self.stops[chosen])


def clipped(view: View) -> Iterator[Finding]:
    """Say where displacement or force hit the end of their range."""
    for name, unit, scale in (("displacement", "mm", 1e3), ("force", "N", 1.0)):
        tops = flat_tops(view.channels[name], smooth=name == "displacement")
        if tops:
            levels = " and ".join(f"{scale * level:.5g} {unit}" for level in tops)
            first = min(int(top.starts[0]) for top in tops.values())
            yield Finding(
                "W_CLIPPED",
                f"{name} is cut off at {levels}: {sum(top.samples for top in tops.values())} samples in flat tops, "
                f"the first {place(view.record, first)}; identification leaves the record out",
            )


def frozen(view: View) -> Iterator[Finding]:
    """Say where a channel stands still while the other goes on."""
    for name, other in (("displacement", "force"), ("force", "displacement")):
        found = frozen_stretches(view, name, other)
        if len(found):
            yield Finding(
                "W_FROZEN",
                f"{name} stands still in {len(found)} place{'s' * (len(found) > 1)} while {other} goes on: "
                f"{found.samples} samples, the first {place(view.record, int(found.starts[0]))}",
            )


def flat_tops(values: Floats, *, smooth: bool) -> dict[float, Stretches]:
    """Flat tops by their level: at least five equal samples at an end of the channel's range.

    Parameters
    ----------
    values : (N,) array
    smooth : bool
        The channel is a position: a kink in it is evidence even at coarse resolution.
    """
    channel = _Channel.of(values, smooth)
    tops = {}
    for level in (channel.high, channel.low):
        at = channel.equal.only(lambda a, b, level=level: values[a] == level and not channel.leaps(a, b))
        piled_up = channel.piled_up(level)
        at = at.only(lambda a, b, sure=piled_up: channel.odd(a, b) or (sure and a > 0 and b < values.size))
        if len(at):
            tops[level] = at
    return tops


def frozen_stretches(view: View, name: str, other: str) -> Stretches:
    """Where a channel repeats one sample, not at the end of its range, while another channel moves."""
    values, beside = view.channels[name], view.channels[other]
    channel = _Channel.of(values, name == "displacement")
    inside = channel.equal.only(lambda a, b: values[a] not in (channel.low, channel.high) or channel.leaps(a, b))
    return inside.only(lambda a, b: _spread(beside[a:b]) > 0 and (channel.odd(a, b) or _long_while(view, beside, a, b)))


@dataclass(frozen=True, eq=False)
class _Channel:
    """A channel, its stretches of equal samples, and how fine it is."""

    values: Floats
    equal: Stretches
    low: float
    high: float
    level: float  # resolution step; zero where there is none
    smooth: bool

    @staticmethod
    def of(values: Floats, smooth: bool) -> _Channel:
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        return _Channel(values, _equal_stretches(values), low, high, _resolution(values), smooth)

    @property
    def span(self) -> float:
        return self.high - self.low

    def odd(self, start: int, stop: int) -> bool:
        """Whether neither motion nor noise makes this stretch."""
        fine = self.level < _COARSE * self.span
        return ((self.smooth or fine) and self._kink(start, stop)) or (
            (fine or not self.smooth) and self._too_quiet(start, stop)
        )

    def leaps(self, start: int, stop: int) -> bool:
        """Whether the stretch ends with a step much larger than the next ones."""
        after = self.values[stop : stop + 3]
        if not self.smooth or after.size < 3:
            return False  # a force leaves its plateau that way when the motion turns
        step, next_step = abs(after[0] - self.values[stop - 1]), abs(after[2] - after[0]) / 2
        return bool(step > _LEAP * self.span and step > 3 * next_step)

    def piled_up(self, level: float) -> bool:
        """Whether the end of the range holds far more samples than the levels next to it, despite noise."""
        if self.level == 0 or not sample_noise(self.values[:100_000]) > self.level / 2:
            return False  # friction without noise holds a level too
        near = self.values[np.abs(self.values - level) < 20 * self.level]
        levels, counts = np.unique(near, return_counts=True)
        at = int(np.argmin(np.abs(levels - level)))
        beside = np.delete(counts, at)
        return bool(counts[at] > 4 * np.max(beside, initial=1) + 4)

    def _kink(self, start: int, stop: int) -> bool:
        """Whether a curve through the samples before and after would have left the level by far.

        The curve is the cubic with the value and the slope at either side; slopes are those of
        parabolas through three samples, so that a motion which comes to rest smoothly has none.
        """
        x, length = self.values, stop - start
        apart = max(1, min(length // 6, start // 2, (x.size - 1 - stop) // 2))  # wide enough for a coarse channel
        if start < 2 * apart or stop + 2 * apart >= x.size:
            return False
        into = (3 * x[start] - 4 * x[start - apart] + x[start - 2 * apart]) / (2 * apart)
        out = (-3 * x[stop] + 4 * x[stop + apart] - x[stop + 2 * apart]) / (2 * apart)
        rise, tau = x[stop] - x[start], np.linspace(0, 1, 9)
        curve = rise * tau**2 * (3 - 2 * tau) + length * tau * (1 - tau) * (into * (1 - tau) - out * tau)
        return bool(np.max(np.abs(curve)) > _BEND * self.span + (_LEVELS + 1.5 * length / apart) * self.level)

    def _too_quiet(self, start: int, stop: int) -> bool:
        """Whether the noise around would have shown in the stretch."""
        sides = [self.values[max(0, start - _NEAR) : start], self.values[stop : stop + _NEAR]]
        sides = [here for side in sides if (here := side[np.isfinite(side)]).size >= _NEAR // 4]
        steps = [np.diff(side) for side in sides]
        chances = [(np.count_nonzero(step == 0) + 1) / (step.size + 2) for step in steps]
        if not chances or self.values.size * max(chances) ** (stop - start - 1) >= _CHANCE:
            return False
        # Below the resolution, a slow plateau of a coarse channel is as quiet.
        return all(
            sample_noise(side) > max(self.level, 0.02 * float(np.median(np.abs(step))))
            for side, step in zip(sides, steps, strict=True)
        )


def _equal_stretches(values: Floats) -> Stretches:
    """Stretches of at least five equal samples, found a piece at a time to keep memory small."""
    found: list[list[int]] = []
    for start in range(0, values.size, _CHUNK):
        equal = np.diff(values[start : start + _CHUNK + FLAT - 1]) == 0
        size = equal.size - FLAT + 2
        if size <= 0:
            break
        begins = np.all([equal[i : i + size] for i in range(FLAT - 1)], axis=0)  # a stretch begins or goes on here
        for a, b in zip(*runs_of(begins), strict=True):
            a, b = int(start + a), int(start + b + FLAT - 1)
            if found and a <= found[-1][1] - FLAT + 1:
                found[-1][1] = b
            else:
                found.append([a, b])
        if len(found) > _MOST:
            break
    stretches = np.array(found, dtype=int).reshape(-1, 2)
    return Stretches(stretches[:, 0], stretches[:, 1])


def _resolution(values: Floats) -> float:
    """Step of which the channel's values are multiples; zero where they are none."""
    present = values[np.isfinite(values)][:100_000]
    gaps = np.diff(np.unique(present)[1:-1])  # a clipped end need not lie on the grid
    gaps = gaps[gaps > 1e-7 * np.ptp(present)] if present.size else gaps  # less is rounding
    if not gaps.size:
        return 0.0
    step = float(np.min(gaps))
    counts = gaps / step
    # Where there is no step, these are as far from whole numbers as chance has it: 0.25.
    return step if np.mean(np.abs(counts - np.round(counts))) < 0.1 else 0.0


def _long_while(view: View, other: Floats, start: int, stop: int) -> bool:
    """Whether the other channel went through a third of its range, for longer than a reversal takes."""
    period, time = view.strokes.period, view.record.time
    if period is None or not time[stop - 1] - time[start] > period / 6:
        return False
    return _spread(other[start:stop]) > (np.nanmax(other) - np.nanmin(other)) / 3


def _spread(values: Floats) -> float:
    """Peak-to-peak value of the samples that are there."""
    return float(np.ptp(values[np.isfinite(values)], axis=None)) if np.isfinite(values).any() else 0.0


def flagged_samples(view: View) -> np.ndarray:
    """(N,) mask of the samples in flat tops and frozen stretches of displacement or force."""
    mask = np.zeros(view.record.time.size, dtype=bool)
    for name, other in (("displacement", "force"), ("force", "displacement")):
        tops = flat_tops(view.channels[name], smooth=name == "displacement")
        for found in (*tops.values(), frozen_stretches(view, name, other)):
            for start, stop in zip(found.starts, found.stops, strict=True):
                mask[start:stop] = True
    return mask
