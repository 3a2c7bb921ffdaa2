"""Traces of a logger or its converter: samples held, samples stored on change only, a bit that is stuck."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.rig_files.quality.cycles import steady_cycles
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding

_HELD = 3  # samples; held for as long all the time, a channel was recorded at a slower rate
_HELD_LATE = 0.005  # of the period
_STRAIGHT = 0.25  # of the samples on a line through their neighbours: clean 16-bit records reach 0.14
_EXACT, _SLOPE = 1e-9, 1e-6  # of the range: a bend that is none, and a step that is one
_BENDS = 6  # per cycle, at least: a triangular motion has two
_UNEVEN = 0.55  # standard deviation over mean of the lengths of the lines; those of a slower clock are alike
_SLOPES = 0.6  # different slopes, of the number of lines: a coarse converter has fewer
_SHORT_LINE = 2  # samples: shorter ones are the two sides of a bend between samples
_LEAP, _STANDS_OUT = 0.02, 6.0  # of the peak-to-peak force; times the steps around it
_FAST = 0.3  # of the peak velocity: slower, friction makes a force leap
_LEAPS, _LEAPS_A_CYCLE = 6, 2.0  # at least; bundled rigs reach 0.5 a cycle
_AROUND = (-4, -3, -2, 2, 3, 4)  # samples


def changes_at_every_sample(view: View) -> Iterator[Finding]:
    """Report a channel whose values are held for several samples all the time: it lags by half of that."""
    motion = view.motion
    if motion is None or view.noticed("W_FROZEN"):
        return
    for name in ("displacement", "force"):
        moved = np.flatnonzero(np.diff(getattr(view.steady, name))) + 1
        if not 20 <= moved.size <= view.steady.time.size / 2:
            continue
        apart = np.diff(moved)
        usual = int(np.median(apart))
        if usual < _HELD:
            continue
        even = float(np.mean(apart % usual == 0))
        late = 0.5 * (usual - 1) * view.step * motion.condition.frequency_Hz
        if even > 0.9 and float(np.mean(apart == usual)) > 0.6 and late > _HELD_LATE:
            yield Finding(
                "W_HELD",
                f"the {name} changes at every {usual}th sample only: it was recorded at a slower rate and is late by "
                f"{1e3 * late / motion.condition.frequency_Hz:.3g} ms, {100 * late:.2g} % of the period",
            )


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
        if slopes < _SLOPES * lines.size:
            continue
        if lines.size > _BENDS * motion.cycles and float(np.std(lines)) > _UNEVEN * float(np.mean(lines)):
            yield Finding(
                "W_HELD",
                f"{100 * straight:.2g} % of the {name} lies on straight lines of uneven length: it was stored on "
                "change only; export the samples as they were recorded",
            )


def no_bit_is_stuck(view: View) -> Iterator[Finding]:
    """Report a force that leaps in full motion, several times a cycle: levels of its converter are skipped."""
    cycles = steady_cycles(view)
    if cycles is None or view.noticed("W_FROZEN", "W_CLIPPED", "W_NOISE", "W_HELD"):
        return
    steps = np.abs(np.diff(view.steady.force))
    if float(np.max(steps)) < _LEAP * cycles.force.span:
        return
    start, stop = view.strokes.steady or (0, view.run.time.size)
    velocity = view.moving.velocity[start:stop][1:]
    around = np.max([np.roll(steps, shift) for shift in _AROUND], axis=0)
    at = np.flatnonzero((steps > _STANDS_OUT * around) & (steps > _LEAP * cycles.force.span))
    beside = velocity[np.clip(at[:, None] + np.arange(-4, 5), 0, velocity.size - 1)]  # a reversal is not near
    limit = _FAST * float(np.max(np.abs(velocity)))
    leaps = at[(np.min(beside, axis=1) > limit) | (np.max(beside, axis=1) < -limit)]
    count = leaps.size
    if count >= max(_LEAPS, _LEAPS_A_CYCLE * len(cycles.starts)):
        size = float(np.median(steps[leaps]))
        yield Finding(
            "W_COARSE",
            f"the force leaps by about {size:.3g} N in full motion, {count} times: a bit of its converter is stuck, "
            "or ranges are switched",
        )
