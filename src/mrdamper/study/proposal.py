"""Proposed records: motion, session and reason."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.data import Condition, Floats
from mrdamper.physics.motion import Excitation, sine
from mrdamper.study.limits import Limits


@dataclass(frozen=True)
class Proposal:
    """A proposed record."""

    session: int  # from 1
    condition: Condition
    minutes: float  # rig time without the set-up of the session
    reason: str
    # the uncertainty to reduce, without and with this record, after those before it; NaN without a model
    before: float = math.nan
    after: float = math.nan

    def record(self, limits: Limits, damper: Damper | None) -> tuple[Excitation, Floats]:
        """Return the motion to play, with smooth ends of a cycle, and the expected force [N] for the load cell."""
        condition = self.condition
        per_cycle = max(20, round(limits.sample_rate_Hz / condition.frequency_Hz))
        motion = sine(condition, math.ceil(limits.cycles) + 2, per_cycle)
        ease = np.clip(np.minimum(motion.time, motion.time[-1] - motion.time) * condition.frequency_Hz, 0, 1)
        displacement = motion.displacement * ease**2 * (3 - 2 * ease)
        velocity = np.gradient(displacement, motion.time)
        acceleration = np.gradient(velocity, motion.time)
        eased = replace(motion, displacement=displacement, velocity=velocity, acceleration=acceleration)
        if damper is not None:
            return eased, damper.force_along(eased, condition)
        share = 0.2 + 0.8 * condition.current_A / max(limits.current_A[1], 1e-9)  # of the rated force; an assumption
        return eased, limits.force_N * share * np.tanh(velocity / (0.05 * condition.peak_velocity))


@dataclass(frozen=True)
class PlanRow:
    """One row of plan.csv; empty standard deviations without a model.

    They are those of the force over half its peak-to-peak value, or of the parameter over its value.
    """

    order: int
    session: int
    file: str
    current_A: float
    frequency_Hz: float
    amplitude_mm: float
    minutes: float
    standard_deviation_before: float | None
    standard_deviation_after: float | None
    reason: str

    @classmethod
    def of(cls, order: int, item: Proposal, file: str) -> PlanRow:
        """Take the row of a record whose motion is in a file."""
        c, (before, after) = item.condition, (None if math.isnan(b) else b for b in (item.before, item.after))
        return cls(
            order, item.session, file, c.current_A, float(f"{c.frequency_Hz:.6g}"),
            float(f"{1e3 * c.amplitude_m:.6g}"), round(item.minutes, 2),
            before, after, item.reason,
        )  # fmt: skip
