"""Stretches of equal samples that no motion makes: clipped at the end of a range, or frozen inside it.

A coarse channel repeats itself at every slow turn, and a table may stick there; a rig at
rest repeats itself for seconds. So a stretch counts only if the samples around it say that
the channel would have gone on (`_kink`), if its noise would have shown (`_too_quiet`), if
the samples pile up at the very end of the range (`_piled_up`), or if another channel made
much of a stroke meanwhile. Stretches are (K, 2) arrays of half-open sample ranges.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mrdamper.data import Floats, once_per_run
from mrdamper.rig_files.quality.cycles import steady_cycles
from mrdamper.rig_files.quality.view import View, runs_of, sample_noise
from mrdamper.rig_files.record import Finding

FLAT = 5  # samples in a row that make a flat top or a frozen stretch
_BEND = 1.5e-4  # of the channel's range: a channel that would have moved less may have stood still
_LEVELS = 6  # resolution steps it must have missed
_COARSE = 1e-5  # a resolution step of this share of the range shows in a force that is held by friction
_LEAP = 0.03  # of the range: a channel that leaves a flat top with such a step was not clipped but frozen
_NEAR = 100  # samples on either side from which the noise is taken
_ROUNDING = 1e-9  # of the channel's range: less is no noise
_CHANCE = 1e-4  # that noise repeats itself as often anywhere in the record
_MOST = 20_000  # stretches looked at
_CHUNK = 1_000_000  # samples looked at together
_OTHER = {"displacement": "force", "force": "displacement"}


def clipped(view: View) -> Iterator[Finding]:
    """Report displacement or force that reach the end of their range."""
    for name, unit, scale in (("displacement", "mm", 1e3), ("force", "N", 1.0)):
        tops = flat_tops(view, name)
        if tops:
            levels = " and ".join(f"{scale * level:.5g} {unit}" for level in tops)
            first = min(int(top[0, 0]) for top in tops.values())
            yield Finding(
                "W_CLIPPED",
                f"{name} is cut off at {levels}: {sum(map(_samples, tops.values()))} samples in flat tops, "
                f"the first {view.place(first)}; identification leaves the record out",
            )


def frozen(view: View) -> Iterator[Finding]:
    """Report a channel that stands still while the other goes on."""
    for name, other in _OTHER.items():
        stretches = frozen_stretches(view, name)
        if len(stretches):
            yield Finding(
                "W_FROZEN",
                f"{name} stands still in {len(stretches)} place{'s' * (len(stretches) > 1)} while {other} goes on: "
                f"{_samples(stretches)} samples, the first {view.place(int(stretches[0, 0]))}",
            )


def _samples(stretches: np.ndarray) -> int:
    return int(np.sum(np.diff(stretches)))


def flat_tops(view: View, name: str) -> dict[float, np.ndarray]:
    """Flat tops of a channel by their level: at least five equal samples at an end of its range."""
    channel = _channels(view)[name]
    kinks = channel.smooth or _scatters(view)  # else plateaus may be the damper's own, or `flattened` finds corners
    tops = {}
    if not len(channel.equal):
        return tops
    for level in (channel.high, channel.low):
        at = channel.equal[(channel.values[channel.equal[:, 0]] == level) & ~channel.leaps(channel.equal)]
        if len(at) and channel.piled_up(level):
            at = at[channel.odd(at, kinks=kinks) | ((at[:, 0] > 0) & (at[:, 1] < channel.values.size))]
        else:
            at = at[channel.odd(at, kinks=kinks)]
        if len(at):
            tops[level] = at
    return tops


def _scatters(view: View) -> bool:
    """Check that the force differs from cycle to cycle: calculated forces do not."""
    cycles = steady_cycles(view)
    if cycles is None or len(cycles.starts) == 1:
        return True
    return float(np.sqrt(np.mean(cycles.force.rest**2))) > _COARSE * cycles.force.span


def frozen_stretches(view: View, name: str) -> np.ndarray:
    """Find stretches in which a channel repeats one sample inside its range while the other channel moves."""
    channel, other, time = _channels(view)[name], view.channels[_OTHER[name]], view.record.time
    if not len(channel.equal):
        return channel.equal
    at_end = np.isin(channel.values[channel.equal[:, 0]], (channel.low, channel.high))
    stretches = channel.equal[~at_end | channel.leaps(channel.equal)]
    bounds = stretches.reshape(-1)
    high, low = (extreme.reduceat(other, bounds[bounds < other.size])[::2] for extreme in (np.fmax, np.fmin))
    stretches, spread = stretches[high - low > 0], (high - low)[high - low > 0]
    # The other channel went through a third of its range, for longer than a reversal takes.
    period = np.inf if view.strokes.period is None else view.strokes.period
    long_while = (time[stretches[:, 1] - 1] - time[stretches[:, 0]] > period / 6) & (
        spread > (np.nanmax(other) - np.nanmin(other)) / 3
    )
    return stretches[channel.odd(stretches, long_while)]


def flagged_samples(view: View) -> np.ndarray:
    """(N,) mask of the samples in flat tops and frozen stretches of displacement or force."""
    mask = np.zeros(view.record.time.size, dtype=bool)
    for name in _OTHER:
        for start, stop in np.concatenate([*flat_tops(view, name).values(), frozen_stretches(view, name)]):
            mask[start:stop] = True
    return mask


@once_per_run
def _channels(view: View) -> dict[str, _Channel]:
    channels = {}
    for name in _OTHER:
        values = view.channels[name]
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        channels[name] = _Channel(values, _equal_stretches(values), low, high, name == "displacement")
    return channels


@dataclass(frozen=True, eq=False)
class _Channel:
    """A channel, its stretches of equal samples, and how fine it is."""

    values: Floats
    equal: np.ndarray
    low: float
    high: float
    smooth: bool  # a position: a kink in it is evidence even at coarse resolution

    @cached_property
    def level(self) -> float:
        """Resolution step; zero where there is none."""
        return _resolution(self.values)

    @property
    def span(self) -> float:
        return self.high - self.low

    def odd(self, stretches: np.ndarray, sure: np.ndarray | bool = False, kinks: bool = True) -> np.ndarray:
        """(K,) mask of the stretches that are sure, or that neither motion nor noise makes."""
        if not len(stretches):
            return np.zeros(0, dtype=bool)
        fine = self.level < _COARSE * self.span
        kinks = kinks and (self.smooth or fine)
        frozen_ones = sure | (self._kink(stretches) if kinks else np.zeros(len(stretches), dtype=bool))
        if fine or not self.smooth:
            for i in np.flatnonzero(~frozen_ones):
                frozen_ones[i] = self._too_quiet(*stretches[i].tolist())
        return frozen_ones

    def leaps(self, stretches: np.ndarray) -> np.ndarray:
        """(K,) mask of the stretches that end with a step much larger than the next ones."""
        if not self.smooth:  # a force leaves its plateau that way when the motion turns
            return np.zeros(len(stretches), dtype=bool)
        x, stop = self.values, stretches[:, 1]
        inside = stop + 2 < x.size
        stop = np.where(inside, stop, 2)
        step, next_step = np.abs(x[stop] - x[stop - 1]), np.abs(x[stop + 2] - x[stop]) / 2
        return inside & (step > _LEAP * self.span) & (step > 3 * next_step)

    def piled_up(self, level: float) -> bool:
        """Check that the end of the range holds far more samples than the levels next to it, despite noise."""
        if self.level == 0 or not sample_noise(self.values[:100_000]) > self.level / 2:
            return False  # friction without noise holds a level too
        near = self.values[np.abs(self.values - level) < 20 * self.level]
        levels, counts = np.unique(near, return_counts=True)
        at = int(np.argmin(np.abs(levels - level)))
        beside = np.delete(counts, at)
        return bool(counts[at] > 4 * np.max(beside, initial=1) + 4)

    def _kink(self, stretches: np.ndarray) -> np.ndarray:
        """Find the stretches whose curve through the samples before and after would have left the level by far.

        The curve is the cubic with the value and the slope at either side; slopes are those of
        parabolas through three samples, so that a motion which comes to rest smoothly has none.
        """
        x, (start, stop) = self.values, stretches.T
        length = stop - start
        # Wide enough for a coarse channel.
        apart = np.maximum(1, np.minimum(length // 6, np.minimum(start // 2, (x.size - 1 - stop) // 2)))
        inside = (start >= 2 * apart) & (stop + 2 * apart < x.size)
        start, stop, apart, length = (part[inside] for part in (start, stop, apart, length))
        into = (3 * x[start] - 4 * x[start - apart] + x[start - 2 * apart]) / (2 * apart)
        out = (-3 * x[stop] + 4 * x[stop + apart] - x[stop + 2 * apart]) / (2 * apart)
        rise, farthest = x[stop] - x[start], np.zeros(start.size)
        for tau in np.linspace(0, 1, 9):
            curve = rise * tau**2 * (3 - 2 * tau) + length * tau * (1 - tau) * (into * (1 - tau) - out * tau)
            farthest = np.maximum(farthest, np.abs(curve))
        inside[inside] = farthest > _BEND * self.span + (_LEVELS + 1.5 * length / apart) * self.level
        return inside

    def _too_quiet(self, start: int, stop: int) -> bool:
        """Check that the noise around would have shown in the stretch."""
        sides = [self.values[max(0, start - _NEAR) : start], self.values[stop : stop + _NEAR]]
        sides = [here for side in sides if (here := side[np.isfinite(side)]).size >= _NEAR // 4]
        steps = [np.diff(side) for side in sides]
        chances = [(np.count_nonzero(step == 0) + 1) / (step.size + 2) for step in steps]
        if not chances or self.values.size * max(chances) ** (stop - start - 1) >= _CHANCE:
            return False
        # Below the resolution, a slow plateau of a coarse channel is as quiet.
        return all(
            sample_noise(side) > max(self.level, 0.02 * float(np.median(np.abs(step))), _ROUNDING * self.span)
            for side, step in zip(sides, steps, strict=True)
        )


def _equal_stretches(values: Floats) -> np.ndarray:
    """Stretches of at least five equal samples, found a piece at a time to keep memory small."""
    stretches: list[list[int]] = []
    for start in range(0, values.size, _CHUNK):
        equal = np.diff(values[start : start + _CHUNK + FLAT - 1]) == 0
        size = equal.size - FLAT + 2
        if size <= 0:
            break
        begins = np.all([equal[i : i + size] for i in range(FLAT - 1)], axis=0)  # a stretch begins or goes on here
        for a, b in zip(*runs_of(begins), strict=True):
            a, b = int(start + a), int(start + b + FLAT - 1)
            if stretches and a <= stretches[-1][1] - FLAT + 1:
                stretches[-1][1] = b
            else:
                stretches.append([a, b])
        if len(stretches) > _MOST:
            break
    return np.array(stretches, dtype=int).reshape(-1, 2)


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
