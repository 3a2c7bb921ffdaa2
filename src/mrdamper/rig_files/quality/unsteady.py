"""Changes over the cycles of a record: gain and offset of the force, its timing, and that of the motion."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.wording import number
from mrdamper.rig_files.quality.cycles import Cycles, percent, steady_cycles
from mrdamper.rig_files.quality.motion import current_changes
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding

# Changes over the record up to which a channel is steady. Bundled rigs reach 0.041 in gain, 0.023 in
# offset and 0.009 of the period in timing; clean synthetic records less.
GAIN = 0.05  # of the force
OFFSET = 0.04  # of its peak-to-peak value
LATE = 0.012  # of the period
STROKE = 0.06  # of the amplitude: a step that the force does not follow
_EVEN_STROKES = 0.02  # strokes before and after a step differ by at most so much
_FOLLOWS = 0.1  # of such a step, by which the force follows
_FEWEST_CYCLES = 3  # cycles


def stroke_steps(view: View) -> Iterator[Finding]:
    """Report strokes of two lengths at one force: the displacement's gain was changed."""
    strokes, force = view.strokes, view.run.force
    if strokes.lengths.size < 5 or view.noticed("W_FROZEN", "W_CLIPPED"):
        return
    if np.ptp(strokes.lengths) < STROKE * float(np.min(strokes.lengths)):
        return
    forces = np.maximum.reduceat(force, strokes.reversals)[:-1] - np.minimum.reduceat(force, strokes.reversals)[:-1]
    for at in range(2, strokes.lengths.size - 2):
        before, after = strokes.lengths[:at], strokes.lengths[at + 1 :]
        after = after[1:] if after.size > 2 else after  # a stroke or two hold the step
        step = float(np.mean(after) / np.mean(before)) - 1
        if max(np.ptp(before) / np.mean(before), np.ptp(after) / np.mean(after)) > _EVEN_STROKES or abs(step) < STROKE:
            continue
        change = float(np.mean(forces[-after.size :]) / np.mean(forces[:at])) - 1
        if abs(change) < _FOLLOWS * abs(step):
            text = f"the stroke changes by {100 * step:+.3g} % at {view.run.time[strokes.reversals[at]]:.4g} s and the"
            more = f"force does not: damping is uncertain by {percent(abs(step))}; check the displacement sensor"
            yield Finding("W_UNSTEADY", f"{text} {more}")
        return


def cycles_are_steady(view: View) -> Iterator[Finding]:
    """Report changes over the cycles of one motion: of the amplitude alone, of the clock, and of the force."""
    cycles = steady_cycles(view)
    if cycles is None or len(cycles.starts) < _FEWEST_CYCLES:
        return
    force, motion, period = cycles.force, cycles.displacement, 1e3 * cycles.period
    stroke, jump = _largest(motion.gain), _step(motion.late)
    if abs(_largest(force.gain)) >= 0.2 * abs(stroke) or view.noticed("W_DRIFT"):
        stroke = 0.0  # the force follows, or the drift is reported
    gain = _largest(np.log(np.maximum(1 + force.gain, 1e-3)) - _followed(cycles))
    offset, late = _largest(force.offset) / force.span, _largest(force.late - motion.late)
    if current_changes(view):
        gain = offset = late = 0.0  # of the current
    changes = (
        (stroke, STROKE, f"the amplitude changes by {100 * stroke:+.3g} % over the record and the force does not: "
         f"damping is uncertain by {percent(abs(stroke) / 2)}; check the displacement sensor"),
        (jump, LATE, f"the motion shifts by {number(jump * period, 3, sign='+')} ms ({100 * jump:+.2g} % of the "
         "period) against its clock within the record: samples are lost, or the clock does not run evenly"),
        (gain, GAIN, f"the force changes by {number(100 * np.expm1(gain), 3, sign='+')} % over the record at one "
         f"motion: damping and force are uncertain by {percent(abs(gain) / 2)}; warm the damper up, or check the "
         "amplifier and the current"),
        (offset, OFFSET, f"the mean force changes by {number(force.span * offset, 3, sign='+')} N over the record, "
         f"{percent(abs(offset))} of its peak-to-peak value: check the load cell's zero and its temperature"),
        (late, LATE, f"the force shifts by {number(late * period, 3, sign='+')} ms ({100 * late:+.2g} % of the period) "
         "against the motion over the record: the channels have clocks of their own, or samples of one are lost"),
    )  # fmt: skip
    for change, limit, text in changes:
        if abs(change) > limit:
            yield Finding("W_UNSTEADY", text)


def _followed(cycles: Cycles) -> Floats:
    """(K,) change of the force's logarithm that the change of the amplitude explains: at most in proportion."""
    stroke, gain = cycles.displacement.gain, cycles.force.gain
    size = float(stroke @ stroke)
    share = float(np.clip(stroke @ gain / size, 0.0, 1.0)) if size > 1e-6 * stroke.size else 0.0
    return share * stroke


def _largest(values: Floats) -> float:
    """Change over the record: of a line through the cycles, or of a step between two of them, whichever is more."""
    count = np.arange(values.size) - 0.5 * (values.size - 1)
    line = float(count @ values / (count @ count)) * (values.size - 1)
    return max(line, _step(values), key=abs)


def _step(values: Floats) -> float:
    """Largest step: the mean of the cycles after it less that of the cycles before, two or more of each."""
    least = 2 if values.size > 3 else 1
    at = np.arange(least, values.size - least + 1)
    total = np.concatenate([[0.0], np.cumsum(values)])
    steps = (total[-1] - total[at]) / (values.size - at) - total[at] / at
    return float(max(steps, key=abs, default=0.0))
