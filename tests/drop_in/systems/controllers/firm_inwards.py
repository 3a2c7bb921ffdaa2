"""Firm in compression only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mrdamper.systems.controllers.base import Controller, Sensors


@dataclass(frozen=True)
class FirmInwards(Controller):
    """The current rises with the speed at which the stroke shortens; it does not switch, so coarse steps do."""

    name: ClassVar[str] = "firm-inwards"
    title: ClassVar[str] = "firm in compression"
    source: ClassVar[str] = "tests"

    def law(self, see: Sensors) -> Any:
        return 2.0 * abs(np.minimum(see.stroke_rate, 0.0))
