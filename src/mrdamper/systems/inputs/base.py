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
    speed_m_s: float = np.inf  # of travel along a road; without one every wheel meets it at once
    length_s: float  # of a made input; a record has a `duration` of its own

    @classmethod
    def variants(cls) -> Mapping[str, Mapping[str, float]]:
        """Further names it goes by, each with its parameters."""
        return {}

    @property
    def duration(self) -> float:
        """Seconds it lasts."""
        return self.length_s

    @property
    @abstractmethod
    def step(self) -> float:
        """Longest time step that follows it [s]."""

    @abstractmethod
    def value(self, time: Floats) -> Floats:
        """(N,) acceleration [m/s²] or height [m] at times [s]; as at the ends outside."""

    def rate(self, time: Floats) -> Floats:
        """(N,) rate of a road's height [m/s]."""
        raise NotImplementedError(f"{self.name} is no road")
