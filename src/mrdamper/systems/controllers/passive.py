"""Constant current."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from mrdamper.data.parameters import param
from mrdamper.systems.controllers.base import Controller, Sensors


@dataclass(frozen=True)
class Passive(Controller):
    """I constant."""

    name: ClassVar[str] = "passive"
    title: ClassVar[str] = "passive, constant current"

    current_A: float = param("A", "coil current", bounds=(0, math.inf), default=0.0)

    def law(self, see: Sensors) -> Any:
        return self.current_A
