"""Runs of a rig that contradict the others, each with the explanation that fits best.

The runs of a damper are compared with each other before a model is selected. Where one explanation of a run (a unit, an
offset, another current, another damper, a copy) is far better than none, the run is set aside.
"""

from mrdamper.study.contradictions.findings import Contradiction
from mrdamper.study.contradictions.repeats import REPEATS_CODE, unequal_repeats
from mrdamper.study.contradictions.rig import MIN_RUNS, ContradictionError, RunComparison, compare_runs
from mrdamper.study.contradictions.tracks import tracks_of

__all__ = [
    "MIN_RUNS", "REPEATS_CODE", "Contradiction", "ContradictionError", "RunComparison", "compare_runs", "tracks_of",
    "unequal_repeats",
]  # fmt: skip
