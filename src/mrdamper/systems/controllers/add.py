"""Acceleration-driven dampers: comfort control above the body's resonance, mixed with skyhook below."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from mrdamper.data.parameters import param
from mrdamper.systems.controllers.base import Controller, Sensors


@dataclass(frozen=True)
class AccelerationDriven(Controller):
    """I high where a_above · stroke rate > 0, low elsewhere."""

    name: ClassVar[str] = "add"
    title: ClassVar[str] = "acceleration-driven damper (ADD)"
    source: ClassVar[str] = "Savaresi, Silani and Bittanti 2005, J. Dyn. Systems, Measurement and Control 127, 218–229"

    def law(self, see: Sensors) -> Any:
        return see.on_off(see("above", "acceleration") * see.stroke_rate > 0)


@dataclass(frozen=True)
class MixedSkyhookADD(Controller):
    """Skyhook where a² < α² v² of the point above the damper, ADD elsewhere; α = 2π f."""

    name: ClassVar[str] = "sh-add"
    title: ClassVar[str] = "mixed skyhook and ADD"
    source: ClassVar[str] = "Savaresi and Spelta 2007, J. Dyn. Systems, Measurement and Control 129, 382–392"

    crossover_Hz: float = param("Hz", "frequency at which the two rules change over", bounds=(0, math.inf), default=1.8)

    def law(self, see: Sensors) -> Any:
        v, a = see("above", "velocity"), see("above", "acceleration")
        slow = a * a <= (2 * math.pi * self.crossover_Hz) ** 2 * v * v
        return see.on_off(see.tape.select(slow, v, a) * see.stroke_rate > 0)
