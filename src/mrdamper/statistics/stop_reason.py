"""Reasons for which a search stopped."""

from __future__ import annotations

from enum import StrEnum


class StopReason(StrEnum):
    """Reason for which a search stopped, as a sentence; programs compare the member itself."""

    SOLVED = "solved: every parameter is linear"
    SETTLED = "converged: the cost no longer changes"
    NO_STEP = "converged: no step lowers the cost"
    AT_BOUNDS = "every coordinate ended at a bound"
    STEPS_SPENT = "stopped at the limit of steps, the cost still falling"
    GENERATIONS_SPENT = "ended after the given number of generations"

    @property
    def converged(self) -> bool:
        """True if a minimum was reached, inside the bounds or on them."""
        return self in (StopReason.SOLVED, StopReason.SETTLED, StopReason.NO_STEP, StopReason.AT_BOUNDS)
