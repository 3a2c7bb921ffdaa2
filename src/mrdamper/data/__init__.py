"""Test data: a `Condition` of the test matrix, a recorded `Run`, a `Dataset` of runs; and how notebooks show them."""

from mrdamper.data.runs import (
    Condition,
    Dataset,
    Floats,
    Run,
    Split,
    current_levels,
    held_current,
    once_per_run,
    require_name,
    same_condition,
    same_motion,
)
from mrdamper.data.shown import Shown

__all__ = [
    "Condition",
    "Dataset",
    "Floats",
    "Run",
    "Shown",
    "Split",
    "current_levels",
    "held_current",
    "once_per_run",
    "require_name",
    "same_condition",
    "same_motion",
]
