"""Firm in compression only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from mrdamper.systems.controllers.base import Controller, Sight


@dataclass(frozen=True)
class FirmInwards(Controller):
    """I high where the stroke shortens."""

    name: ClassVar[str] = "firm-inwards"
    title: ClassVar[str] = "firm in compression"
    source: ClassVar[str] = "tests"

    def law(self, see: Sight) -> Any:
        return see.on_off(see.stroke_rate < 0)
