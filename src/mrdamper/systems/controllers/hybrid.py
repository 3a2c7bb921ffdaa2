"""Skyhook and groundhook in shares."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from mrdamper.parameters import param
from mrdamper.systems.controllers.base import Controller, Sight


@dataclass(frozen=True)
class Hybrid(Controller):
    """F = share c v_above − (1 − share) c v_below, as far as the damper can.

    References
    ----------
    Ahmadian (1997), "A hybrid semiactive control for secondary suspension applications", ASME
    Symposium on Advanced Automotive Technologies.
    """

    name: ClassVar[str] = "hybrid"
    title: ClassVar[str] = "hybrid of skyhook and groundhook"
    source: ClassVar[str] = "Ahmadian 1997"

    c_hook: float = param("N s/m", "damping to the sky and to the road", bounds=(0, math.inf), default=2000.0)
    share: float = param("-", "of the skyhook; the rest is groundhook", bounds=(0, 1), default=0.5)

    def law(self, see: Sight) -> Any:
        above, below = see("above", "velocity"), see("below", "velocity")
        return see.current_for(self.c_hook * (self.share * above - (1 - self.share) * below))
