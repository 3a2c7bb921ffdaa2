"""Groundhook with two states: hard while the damper slows the wheel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from mrdamper.systems.controllers.base import Controller, Sight


@dataclass(frozen=True)
class Groundhook(Controller):
    """I high where v_below · stroke rate < 0, low elsewhere.

    References
    ----------
    Valášek, Novák, Šika and Vaculín (1997), "Extended ground-hook: new concept of semi-active control
    of truck's suspension", Vehicle System Dynamics 27, 289–303.
    """

    name: ClassVar[str] = "groundhook"
    title: ClassVar[str] = "groundhook, on and off"
    source: ClassVar[str] = "Valášek, Novák, Šika and Vaculín 1997"
    calms: ClassVar[str] = "below"

    def law(self, see: Sight) -> Any:
        return see.on_off(see("below", "velocity") * see.stroke_rate < 0)
