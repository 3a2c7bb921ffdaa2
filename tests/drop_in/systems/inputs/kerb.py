"""A straight ramp."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.systems.inputs.base import Input


@dataclass(frozen=True)
class Kerb(Input):
    """Up in a tenth of a second, and no way down."""

    name: ClassVar[str] = "kerb"
    title: ClassVar[str] = "kerb"
    kind: ClassVar[Any] = "road"
    duration: ClassVar[float] = 1.0
    step: ClassVar[float] = 0.01

    height_m: float = param("m", "of the kerb", bounds=(0, 1), default=0.03)

    def value(self, time: Floats) -> Floats:
        return self.height_m * np.clip(time / 0.1, 0, 1)

    def rate(self, time: Floats) -> Floats:
        return np.where((time >= 0) & (time < 0.1), self.height_m / 0.1, 0.0)
