"""Flat stretches that no motion makes: clipped at the end of a range, frozen inside it, or cut off before noise.

A coarse channel repeats itself at every slow turn, and a table may stick there; a rig at
rest repeats itself for seconds. So a stretch counts only if the samples around it say that
the channel would have gone on (`_kink`), if its noise would have shown (`_too_quiet`), if
the samples pile up at the very end of the range (`_piled_up`), or if another channel made
much of a stroke meanwhile. Stretches are (K, 2) arrays of half-open sample ranges.

Where no two samples are equal, the mean cycle may have a flat top.
From the flat top's edges on, a smooth extreme goes down as a parabola: at a depth four times as large
it is twice as wide. A cut-off one is hardly wider, and has corners: the width grows with the depth. A force
may have a plateau of its own, which ends where the motion turns, or with a shoulder, as a hyperbolic tangent
of the velocity has it: the width grows with the logarithm of the depth. A motion may dwell, but then the
force does not go on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mrdamper.data import Floats, once_per_run
from mrdamper.data.wording import counted
from mrdamper.physics.motion.strokes import runs_of
from mrdamper.rig_files.quality.cycles import NOTED, POINTS, CycleChannel, percent, steady_cycles
from mrdamper.rig_files.quality.view import View, shown
from mrdamper.rig_files.record import Finding
from mrdamper.statistics.peaks import sample_noise

FLAT = 5  # samples in a row that make a flat top or a frozen stretch
_BEND = 1.5e-4  # of the channel's range: a channel that would have moved less may have stood still
_LEVELS = 6  # resolution steps it must have missed
_COARSE = 1e-5  # a resolution step of this share of the range shows in a force that is held by friction
_FINE, _MOSTLY = 2e-3, 0.25  # resolution step over the range, and share of the samples at either of its ends
_LEAP = 0.03  # of the range: a channel that leaves a flat top with such a step was not clipped but frozen
_NEAR = 100  # samples on either side from which the noise is taken
_ROUNDING = 1e-9  # of the channel's range: less is no noise
_CHANCE = 1e-4  # that noise repeats itself as often anywhere in the record
_OTHER = {"displacement": "force", "force": "displacement"}
_DEPTH = 0.006  # of the peak-to-peak value; at four times this depth the width is measured again
_DEEPEST = 0.02  # of it: deeper, where noise asks for that, the steep sides of hysteresis are no wider either
_FORCE_WIDER, _WIDER, _WIDER_ONE_SIDED = 1.45, 1.3, 1.47  # times as wide there: a parabola 2, bundled rigs 1.57, 1.34
_OPPOSITE = 0.03  # sum of the levels at both ends of a range, of the peak-to-peak force
_ROUND = 1.75  # times as wide: an end that is not cut off
_LEVEL = 1.25  # times as wide: a plateau on which the force does not depend on velocity
_SHOULDER = 0.75  # least growth of the width from the depth to twice the depth [phases]: a smaller one is noise
_CORNER = 1.3  # times as much as from twice to four times the depth: a corner 2, a parabola 1.4, a shoulder 1
_WIDTH = (0.04, 0.6)  # of the cycle
_REST = 0.05  # of the peak velocity: slower, a displacement rests
_DWELL = 0.022  # of the cycle, beyond what a sine has
_JOLT = 0.18  # of the peak velocity, two phases after the rest: a motion that dwells begins gently
_MOVES = 0.2  # of the peak velocity, beyond both edges of a cut-off force
_STILL_MOVES = 0.15  # of the peak velocity, at both edges of a level one: a plateau of friction ends at the reversal
_GOES_ON = 0.04  # of the peak-to-peak force, while a displacement that is cut off or sticks rests


def clipped(view: View) -> Iterator[Finding]:
    """Report displacement or force that reach the end of their range."""
    for name in _OTHER:
        tops = flat_tops(view, name)
        if tops:
            levels = " and ".join(shown(name, level, ".5g") for level in tops)
            first = min(int(top[0, 0]) for top in tops.values())
            text = f"{name} is cut off at {levels}: {sum(map(_samples, tops.values()))} samples in flat tops, the first"
            yield Finding("W_CLIPPED", f"{text} {view.place(first)}; identification leaves the record out")


def frozen(view: View) -> Iterator[Finding]:
    """Report a channel that stands still while the other goes on."""
    for name, other in _OTHER.items():
        stretches = frozen_stretches(view, name)
        if len(stretches):
            text = f"{name} stands still in {counted(len(stretches), 'place')} while {other} goes on:"
            more = f"{_samples(stretches)} samples, the first {view.place(int(stretches[0, 0]))}"
            yield Finding("W_FROZEN", f"{text} {more}")


def _samples(stretches: np.ndarray) -> int:
    return int(np.sum(np.diff(stretches)))


def flat_tops(view: View, name: str) -> dict[float, np.ndarray]:
    """Flat tops of a channel by their level: at least five equal samples at an end of its range."""
    channel = _channels(view)[name]
    kinks = channel.smooth or _scatters(view)  # else plateaus may be the damper's own, or `flattened` finds corners
    tops = {}
    for level in (channel.high, channel.low):
        at = channel.equal[(channel.values[channel.equal[:, 0]] == level) & ~channel.leaps(channel.equal)]
        inner = (at[:, 0] > 0) & (at[:, 1] < channel.values.size)
        piled_up = inner & channel.piled_up(level) if len(at) else inner
        at = at[channel.odd(at, kinks and channel.mostly_at_its_ends, kinks) | piled_up]
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
    at_end = np.isin(channel.values[channel.equal[:, 0]], (channel.low, channel.high))
    stretches = channel.equal[~at_end | channel.leaps(channel.equal)]
    bounds = stretches.reshape(-1)
    high, low = (extreme.reduceat(other, bounds[bounds < other.size])[::2] for extreme in (np.fmax, np.fmin))
    stretches, spread = stretches[high - low > 0], (high - low)[high - low > 0]
    # The other channel went through a third of its range, for longer than a reversal takes.
    period = np.inf if view.strokes.period is None else view.strokes.period
    third = (np.nanmax(other) - np.nanmin(other)) / 3
    long_while = (time[stretches[:, 1] - 1] - time[stretches[:, 0]] > period / 6) & (spread > third)
    return stretches[channel.odd(stretches, long_while)]


def force_stops(view: View) -> bool:
    """Tell whether the force stands still for half a period: its sensor failed, and its changes are no damper's."""
    if not view.noticed("W_FROZEN") or view.strokes.period is None:
        return False
    lengths = np.diff(view.record.time[np.minimum(frozen_stretches(view, "force"), view.record.time.size - 1)])
    return bool(np.any(lengths > 0.5 * view.strokes.period))


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
        starts, stops = runs_of(values[1:] == values[:-1])
        equal = np.column_stack([starts, stops + 1])[stops + 1 - starts >= FLAT]
        channels[name] = _Channel(values, equal, low, high, name == "displacement")
    return channels


@dataclass(frozen=True, eq=False)
class _Channel:
    """A channel, its stretches of equal samples, and how fine it is."""

    values: Floats
    equal: np.ndarray  # of at least `FLAT` samples
    low: float
    high: float
    smooth: bool  # a position: a kink in it is evidence even at coarse resolution

    @cached_property
    def level(self) -> float:
        """Step of which the values are multiples, also where decimals round them; zero where there is none."""
        present = self.values[np.isfinite(self.values)][:100_000]
        gaps = np.diff(np.unique(present)[1:-1])  # a clipped end need not lie on the grid
        gaps = gaps[gaps > 1e-7 * np.ptp(present)] if present.size else gaps  # less is rounding
        step = float(np.mean(gaps[gaps < 1.5 * np.min(gaps)])) if gaps.size else np.inf
        # Where there is no step, the counts are as far from whole numbers as chance has it: 0.25.
        return step if gaps.size and np.mean(np.abs(gaps / step - np.round(gaps / step))) < 0.1 else 0.0

    @property
    def span(self) -> float:
        return self.high - self.low

    @cached_property
    def mostly_at_its_ends(self) -> bool:
        """Most samples of a fine channel are exactly those at its two ends: friction repeats no reading as often."""
        shares = [np.mean(self.values == end) for end in (self.low, self.high)]
        return 0 < self.level < _FINE * self.span and min(shares) > _MOSTLY

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
        limits = [max(self.level, 0.02 * float(np.median(np.abs(step))), _ROUNDING * self.span) for step in steps]
        return all(sample_noise(side) > limit for side, limit in zip(sides, limits, strict=True))


class Top(NamedTuple):
    """One end of a channel's range in the mean cycle."""

    level: float
    width: float  # of the cycle
    wider: float  # at four times the depth, the side that is more so
    edges: tuple[int, int]  # phases, the first may be negative
    beyond: float  # estimate of what is cut off
    shoulders: bool  # instead of corners, at both edges


def cut_off_before_noise(view: View) -> Iterator[Finding]:
    """Report a force or a displacement that was cut off before noise was added or a filter acted."""
    cycles = steady_cycles(view)
    if cycles is None or view.noticed("W_CLIPPED", "W_FROZEN"):
        return
    motion, force = cycles.displacement, cycles.force
    speed = np.abs(motion.slope)
    count = len(cycles.starts)
    ends = ends_of(force, count, view.force_noise) if _channels(view)["force"].level < _DEEPEST * force.span else ()
    one_sided = any(top.wider > _ROUND for top in ends)
    tops = [top for top in ends if _is_cut_off(top, speed, one_sided)]
    # Both ends of a range are as far from zero; plateaus of a damper are from its offset force.
    levels = np.array([top.level for top in ends])
    if one_sided or any(top.wider < _LEVEL for top in tops) or abs(np.sum(levels)) < _OPPOSITE * force.span:
        yield from _finding("force", force.span, tops)
    ends = ends_of(motion, count, sample_noise(view.steady.displacement))
    limit = _WIDER_ONE_SIDED if any(top.wider > _ROUND for top in ends) else _WIDER
    tops = [top for top in ends if top.wider < limit and _force_goes_on(top, force)]
    yield from _finding("displacement", motion.span, tops)


def rests_at_its_ends(view: View) -> Iterator[Finding]:
    """Report a displacement that rests at its reversals while the force goes on: backlash, or a sensor that sticks."""
    cycles = steady_cycles(view)
    if cycles is None or view.noticed("W_CLIPPED", "W_FROZEN", "W_DISTURBED"):
        return
    motion, force = cycles.displacement, cycles.force
    speed = np.abs(motion.slope) / np.max(np.abs(motion.slope))
    rests = [_rest(speed, force, int(extreme)) for extreme in (np.argmax(motion.loop), np.argmin(motion.loop))]
    if min(rests) > _DWELL:
        lost = 0.5 * (1 - np.cos(2 * np.pi * np.mean(rests)))
        yield Finding(
            "W_BACKLASH",
            f"the displacement rests for {100 * np.mean(rests):.2g} % of the cycle at either end while the force goes "
            f"on, and leaves it with a jolt: up to {100 * lost:.2g} % of the stroke is lost in the sensor's mounting",
        )


def _rest(speed: Floats, force: CycleChannel, extreme: int) -> float:
    """Share of the cycle for which a displacement rests about a reversal, 0 where the force rests too."""
    still = np.roll(speed < _REST, POINTS // 2 - extreme)
    before = int(np.argmin(np.append(still[POINTS // 2 :: -1], False)))
    after = int(np.argmin(np.append(still[POINTS // 2 :], False)))
    jolt = max(speed[(extreme + after + 2) % POINTS], speed[(extreme - before - 2) % POINTS])
    late = force.loop[np.arange(extreme - before + (before + after) // 2, extreme + after) % POINTS]
    if jolt < _JOLT or late.size < 3 or float(np.ptp(late)) < _GOES_ON * force.span:
        return 0.0
    return (before + after) / POINTS - np.arcsin(_REST) / np.pi


def flat_ends(view: View) -> list[float]:
    """Return the levels [N] at which the mean cycle of the force is as flat as one that is cut off, by its form alone.

    A plateau of the damper is as flat.
    """
    if (cycles := steady_cycles(view)) is None:
        return []
    ends = ends_of(cycles.force, len(cycles.starts), view.force_noise)
    return [top.level for top in ends if top.wider < _FORCE_WIDER and _WIDTH[0] < top.width < _WIDTH[1]]


def _finding(name: str, span: float, tops: list[Top]) -> Iterator[Finding]:
    tops = [top for top in tops if _WIDTH[0] < top.width < _WIDTH[1] and top.beyond > 0.5 * NOTED * span]
    if tops:
        levels = " and ".join(shown(name, top.level) for top in tops)
        beyond = max(top.beyond for top in tops)
        text = f"{name} is cut off near {levels}, before noise was added or a filter acted:"
        more = f"{percent(2 * beyond / span)} of its amplitude is missing; identification leaves the record out"
        yield Finding("W_CLIPPED", f"{text} {more}")


def ends_of(channel: CycleChannel, count: int, noise: float) -> tuple[Top, ...]:
    """Measure the upper and the lower end of the mean of a number of cycles; neither where noise hides their form.

    One cycle alone shows no scatter: its noise from sample to sample counts.
    """
    scatter = float(np.sqrt(np.mean(channel.rest**2))) if count > 1 else noise
    depth = max(3 * scatter / np.sqrt(count), _DEPTH * channel.span)
    if depth > _DEEPEST * channel.span:
        return ()
    loop = (np.roll(channel.loop, 1) + channel.loop + np.roll(channel.loop, -1)) / 3
    upper, lower = (_top(sign * loop, depth) for sign in (1.0, -1.0))
    return upper, lower._replace(level=-lower.level)


def _top(loop: Floats, depth: float) -> Top:
    level = float(np.mean(np.sort(loop)[-4:]))
    middle = int(np.argmax(loop))
    turned = np.roll(loop, POINTS // 2 - middle)  # the top in the middle
    sides = turned[POINTS // 2 :: -1], turned[POINTS // 2 :]
    reach = np.array([[_reach(side, level - times * depth) for times in (1, 2, 4, 8, 16)] for side in sides])
    left, right = reach[:, 0]
    half = max(0.5 * (left + right), 0.5)
    wider = 1 + float(np.max(reach[:, 2] - reach[:, 0])) / half
    slope = 3 * depth / max(0.5 * float(np.sum(reach[:, 2])) - half, 0.25)
    growth = np.diff(reach)  # with the logarithm of the depth, also far down: a filter rounds corners near the top only
    shoulders = bool(np.all(growth[:, 0] > _SHOULDER) and np.all(growth[:, 1:] < _CORNER * growth[:, :-1]))
    edges = round(middle - left), round(middle + right)
    return Top(level, 2 * half / POINTS, wider, edges, 0.5 * slope * half, shoulders)


def _reach(values: Floats, level: float) -> float:
    """Measure the width over which a curve stays above a level, in phases, between two by interpolation."""
    below = np.flatnonzero(values <= level)
    if not below.size:
        return float(values.size)
    if below[0] == 0:
        return 0.0
    before, after = values[below[0] - 1] - level, level - values[below[0]]
    return float(below[0] - 1 + before / (before + after))


def _is_cut_off(top: Top, speed: Floats, one_sided: bool) -> bool:
    """Tell an end of the force that is cut off from a plateau of the damper's own."""
    if top.shoulders:
        return False
    start, stop = top.edges
    edges = speed[np.array(top.edges) % POINTS]
    if top.wider < _LEVEL and (one_sided or float(np.min(edges)) > _STILL_MOVES * float(np.max(speed))):
        return True
    beyond = np.concatenate([np.arange(start - 3, start + 1), np.arange(stop, stop + 4)]) % POINTS
    return top.wider < _FORCE_WIDER and bool(np.min(speed[beyond]) > _MOVES * np.max(speed))


def _force_goes_on(top: Top, force: CycleChannel) -> bool:
    start, stop = top.edges
    quarter = (stop - start) // 4
    middle = force.loop[np.arange(start + quarter, stop - quarter + 1) % POINTS]
    return float(np.ptp(middle)) > _GOES_ON * force.span
