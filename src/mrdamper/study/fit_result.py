"""A damper identified from runs, and its identification from some of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import JointFit
from mrdamper.dampers.modified import ModifiedFit


@dataclass(frozen=True, eq=False)
class FitResult:
    """Damper that a recipe identified from runs."""

    damper: Damper
    refit: Callable[[Sequence[int]], Damper]  # identifies the damper again from the runs at some indices only
    fit: ModifiedFit | JointFit | None = None  # details of its functions or its search
