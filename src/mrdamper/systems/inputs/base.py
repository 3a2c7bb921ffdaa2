"""Base class of inputs: a function of time, and its rate where it is a road."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np

from mrdamper.data import Floats


class Input(ABC):
    """A ground motion or a road. Subclasses are final, frozen dataclasses of `param` fields."""

    name: ClassVar[str]
    title: ClassVar[str]
    # "ground" or "road"; the value is the acceleration of the ground [m/s²], or the height of the road [m]
    kind: Literal["ground", "road"]
    speed_m_s: float = np.inf  # of travel along a road; without it all wheels have the same road at once
    length_s: float  # of a synthetic input; a record has its own `duration`

    @classmethod
    def variants(cls) -> Mapping[str, Mapping[str, float]]:
        """Further names, each with its parameters."""
        return {}

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.length_s

    @property
    @abstractmethod
    def step(self) -> float:
        """Longest time step that resolves it [s]."""

    @abstractmethod
    def value(self, time: Floats) -> Floats:
        """(N,) acceleration [m/s²] or height [m] at times [s]; as at the ends outside."""

    def rate(self, time: Floats) -> Floats:
        """(N,) rate of a road's height [m/s]."""
        raise NotImplementedError(f"{self.name} is no road")
