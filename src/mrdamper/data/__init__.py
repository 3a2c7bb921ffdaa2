"""Test data: a `Condition` of the test matrix, a recorded `Run`, a `Dataset` of runs; display in notebooks."""

from mrdamper.data.arrays import Floats, index_at
from mrdamper.data.conditions import (
    Condition,
    condition_groups,
    current_levels,
    level_groups,
    same_condition,
    same_motion,
)
from mrdamper.data.datasets import Dataset
from mrdamper.data.displayable import Displayable
from mrdamper.data.runs import Run, Split, held_current, once_per_run, require_name
from mrdamper.data.sessions import SESSIONS_NEEDED, hour_of, session_folds, session_groups, session_of

__all__ = [
    "SESSIONS_NEEDED",
    "Condition",
    "Dataset",
    "Displayable",
    "Floats",
    "Run",
    "Split",
    "condition_groups",
    "current_levels",
    "held_current",
    "hour_of",
    "index_at",
    "level_groups",
    "once_per_run",
    "require_name",
    "same_condition",
    "same_motion",
    "session_folds",
    "session_groups",
    "session_of",
]
