"""Channels cut off before noise or a filter: no two samples are equal, but the mean cycle has a flat top.

From the flat top's edges on, a smooth extreme goes down as a parabola: at a depth four times as large
it is twice as wide. A cut-off one is hardly wider, and has corners: the width grows with the depth. A force
may have a plateau of its own, which ends where the motion turns, or with a shoulder, as a hyperbolic tangent
of the velocity has it: the width grows with the logarithm of the depth. A motion may dwell, but then the
force does not go on.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.quality.cycles import NOTED, POINTS, CycleChannel, percent, steady_cycles
from mrdamper.rig_files.quality.view import View, sample_noise
from mrdamper.rig_files.record import Finding

_DEPTH = 0.006  # of the peak-to-peak value; at four times this depth the width is measured again
_DEEPEST = 0.02  # of it: deeper, where noise asks for that, the steep sides of hysteresis are no wider either
_FORCE_WIDER, _WIDER, _WIDER_ONE_SIDED = 1.45, 1.3, 1.47  # times as wide there: a parabola 2, bundled rigs 1.57, 1.34
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
    ends = ends_of(force, count, view.force_noise)
    one_sided = any(top.wider > _ROUND for top in ends)
    tops = [top for top in ends if _is_cut_off(top, speed, one_sided)]
    yield from _finding("force", "N", 1.0, tops, force.span)
    ends = ends_of(motion, count, sample_noise(view.steady.displacement))
    one_sided = any(top.wider > _ROUND for top in ends)
    limit = _WIDER_ONE_SIDED if one_sided else _WIDER
    tops = [top for top in ends if top.wider < limit and _force_goes_on(top, force)]
    yield from _finding("displacement", "mm", 1e3, tops, motion.span)


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


def _finding(name: str, unit: str, scale: float, tops: list[Top], span: float) -> Iterator[Finding]:
    tops = [top for top in tops if _WIDTH[0] < top.width < _WIDTH[1] and top.beyond > 0.5 * NOTED * span]
    if tops:
        levels = " and ".join(f"{scale * top.level:.4g} {unit}" for top in tops)
        beyond = max(top.beyond for top in tops)
        yield Finding(
            "W_CLIPPED",
            f"{name} is cut off near {levels}, before noise was added or a filter acted: {percent(2 * beyond / span)} "
            "of its amplitude is missing; identification leaves the record out",
        )


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
