"""Skyhook: the force of a dashpot between what stands on the damper and the sky."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from mrdamper.parameters import param
from mrdamper.systems.controllers.base import Controller, Sight


@dataclass(frozen=True)
class SkyhookContinuous(Controller):
    """F = c_sky v_above, as far as the damper can.

    References
    ----------
    Karnopp, Crosby and Harwood (1974), "Vibration control using semi-active force generators",
    ASME J. Engineering for Industry 96, 619–626.
    """

    name: ClassVar[str] = "skyhook-continuous"
    title: ClassVar[str] = "skyhook, continuous"
    source: ClassVar[str] = "Karnopp, Crosby and Harwood 1974"
    calms: ClassVar[str] = "above"

    c_sky: float = param("N s/m", "damping to the sky", bounds=(0, math.inf), default=2000.0)

    def law(self, see: Sight) -> Any:
        return see.current_for(self.c_sky * see("above", "velocity"))
