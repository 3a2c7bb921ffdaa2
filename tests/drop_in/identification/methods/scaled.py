"""The projection, and every linear parameter a little less."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from mrdamper.identification.methods.projection import Projection
from mrdamper.identification.problem import Method, Problem, Solution


@dataclass(frozen=True)
class Scaled(Method):
    """What the projection finds, times `share`.

    Parameters
    ----------
    share : float
    """

    name: ClassVar[str] = "scaled"
    share: float = 0.9

    def solve(self, problem: Problem) -> Solution:
        found = Projection().solve(problem)
        less = {i.name: self.share * getattr(found.model, i.name) for i in found.model.parameters() if i.linear}
        return replace(found, model=replace(found.model, **less))
