"""Skyhook, groundhook and hybrid control."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from mrdamper.data.parameters import param
from mrdamper.systems.controllers.base import Controller, Sensors


@dataclass(frozen=True)
class Skyhook(Controller):
    """I high where v_above · stroke rate > 0, low elsewhere."""

    name: ClassVar[str] = "skyhook"
    title: ClassVar[str] = "skyhook, on and off"
    source: ClassVar[str] = "Karnopp, Crosby and Harwood 1974, J. Engineering for Industry 96, 619–626"
    calms: ClassVar[str] = "above"

    def law(self, see: Sensors) -> Any:
        return see.on_off(see("above", "velocity") * see.stroke_rate > 0)


@dataclass(frozen=True)
class SkyhookContinuous(Controller):
    """F = c_sky v_above, as far as the damper can."""

    name: ClassVar[str] = "skyhook-continuous"
    title: ClassVar[str] = "skyhook, continuous"
    source: ClassVar[str] = Skyhook.source
    calms: ClassVar[str] = "above"

    c_sky: float = param("N s/m", "damping to the sky", bounds=(0, math.inf), default=2000.0)

    def law(self, see: Sensors) -> Any:
        return see.current_for(self.c_sky * see("above", "velocity"))


@dataclass(frozen=True)
class Groundhook(Controller):
    """I high where v_below · stroke rate < 0, low elsewhere."""

    name: ClassVar[str] = "groundhook"
    title: ClassVar[str] = "groundhook, on and off"
    source: ClassVar[str] = "Valášek, Novák, Šika and Vaculín 1997, Vehicle System Dynamics 27, 289–303"
    calms: ClassVar[str] = "below"

    def law(self, see: Sensors) -> Any:
        return see.on_off(see("below", "velocity") * see.stroke_rate < 0)


@dataclass(frozen=True)
class Hybrid(Controller):
    """F = share c v_above − (1 − share) c v_below, as far as the damper can."""

    name: ClassVar[str] = "hybrid"
    title: ClassVar[str] = "hybrid of skyhook and groundhook"
    source: ClassVar[str] = "Ahmadian 1997, A hybrid semiactive control, ASME Symp. Advanced Automotive Technologies"

    c_hook: float = param("N s/m", "damping to the sky and to the road", bounds=(0, math.inf), default=2000.0)
    share: float = param("-", "of the skyhook; the rest is groundhook", bounds=(0, 1), default=0.5)

    def law(self, see: Sensors) -> Any:
        above, below = see("above", "velocity"), see("below", "velocity")
        return see.current_for(self.c_hook * (self.share * above - (1 - self.share) * below))
