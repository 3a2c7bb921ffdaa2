"""The samples of a record as a logger wrote them: infinite, repeated, missing, held, lost, doubled or copied ones."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.arrays import odd_steps
from mrdamper.data.wording import counted, number
from mrdamper.physics.motion.strokes import longest_run, runs_of
from mrdamper.rig_files.quality.cycles import REFUSED, percent, steady_cycles
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import COARSE_CLOCK, Finding
from mrdamper.statistics.peaks import sample_noise

_HELD = 3  # samples; held for as long all the time, a channel was recorded at a slower rate
_HELD_LATE = 0.005  # of the period
_STRAIGHT = 0.25  # of the samples on a line through their neighbours: clean 16-bit records reach 0.14
_EXACT, _SLOPE = 1e-9, 1e-6  # of the range: a bend that is none, and a step that is one
_BENDS = 6  # per cycle, at least: a triangular motion has two
_UNEVEN = 0.55  # standard deviation over mean of the lengths of the lines; those of a slower clock are alike
_SLOPES = 0.6  # different slopes, of the number of lines: a coarse converter has fewer
_SHORT_LINE = 2  # samples: shorter ones are the two sides of a bend between samples
_LEAP, _STANDS_OUT = 0.02, 6.0  # of the peak-to-peak force; times the steps around it
_STEPS = 1.5  # steps of a converter: less is one of them
_FAST = 0.3  # of the peak velocity: slower, friction makes a force leap
_LEAPS, _LEAPS_A_CYCLE = 6, 2.0  # at least; bundled rigs reach 0.5 a cycle
_EDGE = 0.05  # of two bands: what samples leave of the band between skipped ones
_AROUND = (-4, -3, -2, 2, 3, 4)  # samples
_BEND = 8.0  # times the noise of a second difference
_WHOLE = 0.3  # steps by which a stretch may differ from a whole number of usual ones
_FEW = 0.004  # of the samples
_COPY = 24  # samples in a row equal to others a number of cycles earlier
_NOISY = 3e-5  # of the peak-to-peak value: without noise cycles repeat themselves
MOST_MISSING = 0.02  # share of the samples
MOST_IN_A_ROW = 5
_OVERFLOW = 1e100  # squares of larger numbers leave double precision
_FEWEST = 5  # samples
USED = ("time", "displacement", "force", "current", "velocity")  # what a run is made of
_IN_TURN = 0.3  # share of missing samples of a channel that is logged in turn with others
GAP = 5.5  # steps this many times the usual one are a gap: up to 4 samples lost are none
_DAY, _HOUR, _NEAR = 86_400.0, 3600.0, 60.0  # [s]


def changes_at_every_sample(view: View) -> Iterator[Finding]:
    """Report a channel whose values are held for several samples all the time: it lags by half of that."""
    motion = view.motion
    if motion is None or view.noticed("W_FROZEN"):
        return
    for name in ("displacement", "force"):
        apart = np.diff(np.flatnonzero(np.diff(getattr(view.steady, name))))
        if not 20 <= apart.size + 1 <= view.steady.time.size / 2:
            continue
        usual = int(np.median(apart))
        even = np.mean(apart % usual == 0) > 0.9 and np.mean(apart == usual) > 0.6
        late = 0.5 * (usual - 1) * view.step * motion.condition.frequency_Hz
        if usual >= _HELD and even and late > _HELD_LATE:
            text = f"the {name} changes at every {usual}th sample only: it was recorded at a slower rate and is late by"
            more = f"{number(1e3 * late / motion.condition.frequency_Hz, 3)} ms, {100 * late:.2g} % of the period"
            yield Finding("W_HELD", f"{text} {more}")


def is_not_stored_on_change(view: View) -> Iterator[Finding]:
    """Report a channel of straight lines of uneven length: only samples that had changed were stored."""
    motion = view.motion
    if motion is None or view.noticed("W_FROZEN", "W_HELD"):
        return
    for name in ("displacement", "force"):
        values = getattr(view.steady, name)
        steps, span = np.diff(values), float(np.ptp(values))
        bends = np.abs(np.diff(steps)) >= _EXACT * span
        on_line = ~bends & (np.abs(steps[1:]) > _SLOPE * span)
        straight = float(np.mean(on_line))
        if straight < _STRAIGHT:
            continue
        lines = np.diff(np.flatnonzero(bends))
        lines = lines[lines > _SHORT_LINE]
        slopes = np.unique(np.round(steps[1:][on_line] / (_SLOPE * span))).size
        many = slopes >= _SLOPES * lines.size and lines.size > _BENDS * motion.cycles
        if many and float(np.std(lines)) > _UNEVEN * float(np.mean(lines)):
            text = f"{100 * straight:.2g} % of the {name} lies on straight lines of uneven length: it was stored on"
            yield Finding("W_HELD", f"{text} change only; export the samples as they were recorded")


def no_bit_is_stuck(view: View) -> Iterator[Finding]:
    """Report a force that skips levels which it crosses in full motion, or leaves its course for single samples."""
    cycles = steady_cycles(view)
    if cycles is None or view.noticed("W_FROZEN", "W_CLIPPED", "W_NOISE", "W_HELD"):
        return
    force, least = view.steady.force, _LEAP * cycles.force.span
    if not np.any(np.abs(np.diff(force)) >= least):
        return
    levels = np.unique(force)
    width = _every_second_band(levels, least) or _crossed_in_motion(view, levels, least, len(cycles.starts))
    step = float(np.percentile(np.diff(levels), 25))
    if width > _STEPS * step:
        text = f"the force leaps by about {number(width, 3)} N in full motion, over levels that no sample has or for a"
        yield Finding("W_COARSE", f"{text} single sample: a bit of its converter is stuck or flips")
    elif width:
        text = f"the force changes in steps of {number(step, 3)} N, {percent(step / cycles.force.span)} of the"
        yield Finding("W_COARSE", f"{text} peak-to-peak force: a smaller range of its converter resolves it better")


def _every_second_band(levels: Floats, least: float) -> float:
    """Width of the bands of equal width and spacing in which no level lies, while levels fill those between [N]."""
    wide = np.flatnonzero(np.diff(levels) > least)
    if wide.size < 2:
        return 0.0
    middles = 0.5 * (levels[wide] + levels[wide + 1])
    period = float(np.median(np.diff(middles)))
    phases = np.sort((levels - middles[0]) / period % 1)
    low, high = phases[0], 1 - phases[-1]
    even = max(abs(low - 0.25), abs(high - 0.25)) < _EDGE and float(np.max(np.diff(phases))) < _EDGE
    return 0.5 * period if even else 0.0


def _crossed_in_motion(view: View, levels: Floats, least: float, cycles: int) -> float:
    """Median leap of the force in full motion over bands without a level, or for one sample [N]; 0 for few of them."""
    force = view.steady.force
    changes = np.diff(force)
    steps = np.abs(changes)
    velocity = view.moving.velocity[view.steady_samples][1:]
    around = np.max([np.roll(steps, shift) for shift in _AROUND], axis=0)
    at = np.flatnonzero((steps > _STANDS_OUT * around) & (steps > least))
    beside = velocity[np.clip(at[:, None] + np.arange(-4, 5), 0, velocity.size - 1)]  # a reversal is not near
    limit = _FAST * float(np.max(np.abs(velocity)))
    at = at[(np.min(beside, axis=1) > limit) | (np.max(beside, axis=1) < -limit)]
    middles, size = 0.5 * (force[at] + force[at + 1]), steps[at]

    def skipped(place: float) -> np.ndarray:
        """Mask of the leaps with no level within a quarter of the leap's size of a place, in sizes from its middle."""
        ends = (np.searchsorted(levels, middles + (place + side) * size) for side in (-0.25, 0.25))
        return np.equal(*ends)

    returns = [np.abs(changes[at] + np.roll(changes, shift)[at]) < 0.25 * size for shift in (-1, 1)]
    # Over a band, from the edge of one to that of the next, or to a sample and back; a damper's own leap is none.
    leaps = size[skipped(0) | (skipped(-1) & skipped(1)) | returns[0] | returns[1]]
    return float(np.median(leaps)) if leaps.size >= max(_LEAPS, _LEAPS_A_CYCLE * cycles) else 0.0


def lost_or_doubled(view: View) -> Iterator[Finding]:
    """Report or refuse a displacement with steps a whole number of times, or none of, those around them."""
    motion = view.motion
    if motion is None or view.noticed("W_FROZEN", "W_DISTURBED", "W_HELD"):
        return
    run = view.steady
    x, uneven = run.displacement, np.diff(run.time)
    if x.size < 50 or np.ptp(uneven) > 0.2 * float(np.median(uneven)):
        return
    steps = np.diff(x)
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(steps, 2, mode="wrap"), 5)
    usual = np.partition(windows, 2, axis=1)[:, 2]  # their medians
    noise = max(sample_noise(x) * np.sqrt(6), 1e-9 * float(np.ptp(x)))
    fast = np.abs(usual) > _FAST * float(np.max(np.abs(usual)))
    odd = fast & (np.abs(steps - usual) > np.maximum(_BEND * noise, 0.5 * np.abs(usual)))
    odd[:3] = odd[-3:] = False
    ratio = np.divide(steps, usual, out=np.ones_like(steps), where=fast)
    whole = odd & (np.abs(ratio - np.round(ratio)) < _WHOLE) & (ratio > -_WHOLE)
    count, of = int(np.count_nonzero(whole)), int(np.count_nonzero(fast))
    if count < max(2, _FEW * of) or count < 0.7 * np.count_nonzero(odd):
        return
    lost = float(np.sum(np.round(ratio[whole]) - 1)) / of
    share = count / of
    what = "lost and the rest numbered anew" if lost > 0 else "written twice"
    problem = f"{percent(share)} of the samples are {what}: speed and damping are off by as much or more"
    if share > REFUSED:
        raise view.refused("E_SAMPLES_LOST", problem, "export the samples with their own time stamps")
    yield Finding("W_SAMPLES_LOST", f"{problem}; export the samples with their own time stamps")


def copied(view: View) -> Iterator[Finding]:
    """Report or refuse a record in which cycles are copies of others: noise does not repeat itself."""
    motion = view.motion
    if motion is None:
        return
    run = view.steady
    if view.force_noise < _NOISY * float(np.ptp(run.force)):
        return
    period = 1 / motion.condition.frequency_Hz / view.step
    lags = {int(n * period) + shift for n in range(1, int(motion.cycles) + 1) for shift in range(-2, 4)}
    alike: dict[int, np.ndarray] = {}
    for lag in sorted(lag for lag in lags if 2 < lag < run.time.size - _COPY):
        equal = run.force[lag:] == run.force[:-lag]
        if np.count_nonzero(equal) >= _COPY:
            equal &= run.displacement[lag:] == run.displacement[:-lag]
            alike |= {lag: equal} if np.count_nonzero(equal) >= _COPY else {}
    if not alike:
        return
    chance = max(float(np.mean(np.diff(run.force) == 0)), 0.5 * _level_share(run.force))
    least = _COPY if chance < 0.3 else int(np.ceil(-16 / np.log(min(chance, 0.97))))
    copies = np.zeros(run.time.size, dtype=bool)
    for lag, equal in alike.items():
        for start, stop in zip(*runs_of(equal), strict=True):
            copies[lag + start : lag + stop] |= stop - start >= least
    share = float(np.mean(copies))
    if not share:
        return
    problem = (
        f"{percent(share)} of the samples repeat earlier cycles exactly, noise included: the record holds "
        f"{number(motion.cycles * (1 - share), 2)} measured cycles of {number(motion.cycles, 2)}, and its scatter "
        "means nothing"
    )
    if share > REFUSED:
        raise view.refused("E_COPIED", problem, "export the cycles that were measured")
    yield Finding("W_COPIED", problem)


def _level_share(values: Floats) -> float:
    """Chance that two noisy samples of one expectation are equal, from the converter's steps."""
    noise = sample_noise(values)
    gaps = np.diff(np.unique(values[:2000]))
    return float(min(1.0, np.median(gaps) / (2 * np.sqrt(np.pi) * noise))) if gaps.size and noise else 0.0


def long_enough(view: View) -> None:
    """Refuse a record of a few samples."""
    size = view.record.time.size
    if size < _FEWEST:
        raise view.refused("E_NO_DATA", f"{size} samples", "export the whole record: a cycle or more")


def finite(view: View) -> Iterator[Finding]:
    """Refuse infinite values, an overflow in the logger or the file; say so of a channel no run needs."""
    for name, values in view.channels.items():
        infinite = np.abs(values) > _OVERFLOW
        if infinite.any():
            at = int(np.argmax(infinite))
            count = int(np.count_nonzero(infinite))
            text = f"{name} is infinite in {counted(count, 'sample')}, first {view.place(at)}"
            if name in USED:
                remedy = "export the channel again with a wider number format"
                raise view.refused("E_NONFINITE", text, remedy)
            yield Finding("W_MISSING", f"{text}; the channel is not used")


def missing(view: View) -> Iterator[Finding]:
    """Accept a few missing samples, refuse more than 2 % or more than 5 in a row."""
    for name, values in view.channels.items():
        absent = np.isnan(values)
        count = int(np.count_nonzero(absent))
        if not count:
            continue
        longest, start = longest_run(absent)
        share = count / absent.size
        text = f"{name}: {count} of {absent.size} samples missing ({100 * share:.3g} %), {longest} in a row at most"
        if name in USED and (share > MOST_MISSING or longest > MOST_IN_A_ROW):
            remedy = f"record again, or cut the record; up to 2 % and {MOST_IN_A_ROW} in a row are taken"
            if share > _IN_TURN and longest < absent.size / 10:
                remedy = "export the channels with one clock: each has rows of its own"
            raise view.refused("E_MISSING", f"{text}, {view.place(start)}", remedy)
        yield Finding("W_MISSING", f"{text}; they are omitted, not filled")
    longest, start = longest_run(~view.record.present)
    if longest > MOST_IN_A_ROW:
        problem = f"{longest} samples in a row of which one channel or another is missing, {view.place(start)}"
        remedy = f"record again, or cut the record; up to {MOST_IN_A_ROW} in a row are taken"
        raise view.refused("E_MISSING", problem, remedy)


def order_of_time(view: View) -> None:
    """Refuse time stamps that repeat or run backwards."""
    wrong = list(odd_steps(view.record.time, lambda steps: steps <= 0))
    if not wrong:
        return
    sample, before, after = wrong[0]
    where = view.place(sample)
    more = f" ({len(wrong)} such places)" if len(wrong) > 1 else ""
    if before == after:
        remedy = "drop the repeated rows"
        if len(wrong) > COARSE_CLOCK * view.record.time.size:
            remedy = "set [file] sample_rate_Hz = ... in a profile if the clock is too coarse"
        problem = f"time stamp {before:.9g} s is repeated {where}{more}"
        raise view.refused("E_TIME_DUPLICATE", problem, f"write time with more decimals, or {remedy}")
    problem = f"time runs backwards {where}, from {before:.9g} s to {after:.9g} s{more}"
    remedy = "sort the rows, or split the file where the logger started again"
    if abs(before - after - _DAY) < _NEAR:
        remedy = "export the time of day with its date: the test went on past midnight"
    elif abs(before - after - _HOUR) < _NEAR:
        remedy = "export the stamps with their offset from UTC: the clocks were put back an hour"
    raise view.refused("E_TIME_ORDER", problem, remedy)


def gaps_in_time(view: View) -> Iterator[Finding]:
    """Cut the record where time leaps: nothing is differentiated across a gap."""
    gaps = list(odd_steps(view.record.time, lambda steps: steps > GAP * view.step))
    if not gaps:
        return
    bounds = [0, *(sample for sample, _, _ in gaps), view.record.time.size]
    view.segments = tuple(pairwise(bounds))
    _, before, after = max(gaps, key=lambda gap: gap[2] - gap[1])
    yield Finding(
        "W_TIME_GAP",
        f"{counted(len(gaps), 'gap')} in time, the widest {number(after - before)} s after {before:.6g} s "
        f"(usual step {number(view.step)} s): split into {len(gaps) + 1} segments",
    )
