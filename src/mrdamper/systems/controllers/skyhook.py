"""Skyhook with two states: hard while the damper slows what stands on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from mrdamper.systems.controllers.base import Controller, Sight


@dataclass(frozen=True)
class Skyhook(Controller):
    """I high where v_above · stroke rate > 0, low elsewhere.

    References
    ----------
    Karnopp, Crosby and Harwood (1974), "Vibration control using semi-active force generators",
    ASME J. Engineering for Industry 96, 619–626.
    """

    name: ClassVar[str] = "skyhook"
    title: ClassVar[str] = "skyhook, on and off"
    source: ClassVar[str] = "Karnopp, Crosby and Harwood 1974"
    calms: ClassVar[str] = "above"

    def law(self, see: Sight) -> Any:
        return see.on_off(see("above", "velocity") * see.stroke_rate > 0)
