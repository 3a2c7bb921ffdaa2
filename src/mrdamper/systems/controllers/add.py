"""Acceleration-driven damper: best for comfort above the body's resonance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from mrdamper.systems.controllers.base import Controller, Sight


@dataclass(frozen=True)
class AccelerationDriven(Controller):
    """I high where a_above · stroke rate > 0, low elsewhere.

    References
    ----------
    Savaresi, Silani and Bittanti (2005), "Acceleration-driven-damper (ADD): an optimal control algorithm
    for comfort-oriented semiactive suspensions", ASME J. Dynamic Systems, Measurement and Control 127,
    218–229.
    """

    name: ClassVar[str] = "add"
    title: ClassVar[str] = "acceleration-driven damper (ADD)"
    source: ClassVar[str] = "Savaresi, Silani and Bittanti 2005"

    def law(self, see: Sight) -> Any:
        return see.on_off(see("above", "acceleration") * see.stroke_rate > 0)
