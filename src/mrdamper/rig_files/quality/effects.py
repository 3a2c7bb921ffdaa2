"""Estimated effect of a fault on the result: the damping that a record gives with the fault and without it."""

from __future__ import annotations

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.quality.cycles import Cycles

NOTED, WARNED, REFUSED = 0.02, 0.05, 0.30  # effect on damping or force: no finding below, and refused from there on
_YIELD = np.geomspace(0.004, 1.0, 14)  # yield displacements tried, of half the stroke


def elastic_plastic(x: Floats, rising: np.ndarray, yields: Floats) -> Floats:
    """(P, Y) steady states, in -1...1, of elastic–plastic elements over one cycle of two strokes.

    Of displacements x (P,) [m], rising where the velocity is positive, and yield displacements (Y,) [m], of which at
    most half the stroke acts.
    """
    low, high = float(np.min(x)), float(np.max(x))
    bend = np.minimum(yields, 0.5 * (high - low))
    state = np.where(rising[:, None], x[:, None] - low - bend, x[:, None] - high + bend)
    return np.clip(state, -bend, bend) / bend


def damping(x: Floats, v: Floats, force: Floats) -> float:
    """Fit F = f0 + k x + c v + an elastic–plastic force of free yield displacement to one cycle of equal phases (P,).

    Returns c, in the units given; NaN where the motion determines none.
    """
    half, fastest = 0.5 * float(np.ptp(x)), float(np.max(np.abs(v)))
    if half == 0 or fastest == 0:
        return np.nan
    base = np.column_stack([np.ones_like(x), (x - np.mean(x)) / half, v / fastest])
    elements = elastic_plastic(x, v > 0, _YIELD * half)
    tables = np.concatenate([np.broadcast_to(base, (_YIELD.size, *base.shape)), elements.T[:, :, None]], axis=2)
    normal = tables.transpose(0, 2, 1) @ tables
    normal[:, range(4), range(4)] *= 1 + 1e-9
    right = tables.transpose(0, 2, 1) @ force
    solution = np.linalg.solve(normal, right[..., None])[..., 0]
    explained = np.sum(right * solution, axis=1)
    return float(solution[int(np.argmax(explained)), 2]) / fastest


def effect_on(cycles: Cycles, clean: Floats) -> tuple[float, float]:
    """Relative change of damping and peak force by a fault, from the (P,) mean cycle of the force without it."""
    motion, force = cycles.displacement, cycles.force
    before, after = (damping(motion.loop, motion.slope, loop) for loop in (clean, force.loop))
    return change(before, after), change(float(np.ptp(clean)), force.span)


def percent_of(moved: float, peak: float) -> str:
    """Write an effect on damping and peak force for a message."""
    return f"the damping by {percent(moved)} and the peak force by {percent(peak)}"


def change(before: float, after: float) -> float:
    """Relative change of a figure; infinite where there is none to begin with."""
    return abs(after / before - 1) if before else np.inf


def percent(share: float) -> str:
    """Write an estimated share for a message."""
    return "over 100 %" if not share < 1 else f"about {100 * share:.2g} %"
