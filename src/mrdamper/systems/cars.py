"""Cars as a system file states them: bodies on springs and dampers, wheels on tyres that lift off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mrdamper.data import Floats
from mrdamper.systems.structure import GRAVITY, Link, System

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Pair = tuple[Positive, Positive]


class SystemPart(BaseModel):
    """A table of a system file."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


@dataclass(frozen=True)
class _Axle:
    """A wheel with its suspension and tyre; `load` of the body on it [kg], other units SI."""

    suffix: str  # suffix of the names of its links and spans
    above: str
    wheel: str
    road: str
    mass: float
    spring: float
    tyre: float
    load: float
    damping: float = 0.0
    behind: float = 0.0


class Car(SystemPart):
    """Body, tyres and bump stops."""

    body_kg: Positive
    tyre_damping_N_s_m: NotNegative = 0.0
    stop_gap_m: Positive | None = None  # free travel of the bump stops in each direction
    stop_N_m: NotNegative = 0.0

    def _system(
        self, name: str, title: str, masses: Mapping[str, float], corners: Mapping[str, Floats], axles: Sequence[_Axle]
    ) -> System:
        n, q = len(masses), len(axles)
        C, K, push = np.zeros((n, n)), np.zeros((n, n)), (np.zeros((n, q)), np.zeros((n, q)))
        links, spans = [], {}
        for i, axle in enumerate(axles):
            at, ends, ground = n - q + i, (axle.above, axle.wheel), (axle.wheel, axle.road)
            travel = np.array(corners.get(axle.above, np.eye(n)[0]))
            travel[at] = -1.0
            C[at, at], K[at, at] = C[at, at] + self.tyre_damping_N_s_m, K[at, at] + axle.tyre
            C, K = C + axle.damping * np.outer(travel, travel), K + axle.spring * np.outer(travel, travel)
            push[0][at, i], push[1][at, i] = axle.tyre, self.tyre_damping_N_s_m
            links.append(Link(f"damper{axle.suffix}", *ends))
            if self.stop_gap_m is not None:
                links.append(Link(f"stop{axle.suffix}", *ends, "stop", self.stop_N_m, 0.0, self.stop_gap_m))
            sunk = (axle.load + axle.mass) * GRAVITY / axle.tyre
            links.append(Link(f"tyre{axle.suffix}", *ground, "tyre", axle.tyre, self.tyre_damping_N_s_m, sunk))
            spans |= {f"travel{axle.suffix}": ends, f"tyre{axle.suffix}": ground}
        M, channels = np.diag(list(masses.values())), tuple(axle.road for axle in axles)
        behind = tuple(axle.behind for axle in axles)
        return System(name, title, tuple(masses), M, C, K, channels, None, push, behind, tuple(links), corners, spans)


class QuarterCar(Car):
    """A quarter of a car; its damping is that of a passive damper parallel to the controlled one."""

    wheel_kg: Positive
    spring_N_m: Positive
    tyre_N_m: Positive
    damping_N_s_m: NotNegative = 0.0

    def build(self, name: str, title: str = "") -> System:
        """Make the structure."""
        wheel = (self.wheel_kg, self.spring_N_m, self.tyre_N_m)
        axle = _Axle("", "body", "wheel", "road", *wheel, self.body_kg, self.damping_N_s_m)
        return self._system(name, title or "quarter car", {"body": self.body_kg, "wheel": self.wheel_kg}, {}, [axle])


class HalfCar(Car):
    """Half a car seen from the side: heave and pitch on two axles; pairs are front and rear."""

    pitch_inertia_kg_m2: Positive
    front_arm_m: Positive  # from the centre of gravity to the axle
    rear_arm_m: Positive
    wheel_kg: Pair
    spring_N_m: Pair
    tyre_N_m: Pair

    def build(self, name: str, title: str = "") -> System:
        """Make the structure."""
        front, rear = self.front_arm_m, self.rear_arm_m
        corners = {"body_front": np.array([1.0, -front, 0, 0]), "body_rear": np.array([1.0, rear, 0, 0])}
        masses = {"body": self.body_kg, "pitch": self.pitch_inertia_kg_m2}
        axles = []
        for i, (end, arm) in enumerate((("front", rear), ("rear", front))):  # the load is larger on the shorter arm
            masses[f"wheel_{end}"] = self.wheel_kg[i]
            parts = (self.wheel_kg[i], self.spring_N_m[i], self.tyre_N_m[i])
            load = arm / (front + rear) * self.body_kg
            behind = i * (front + rear)
            axles.append(_Axle(f"_{end}", f"body_{end}", f"wheel_{end}", end, *parts, load, behind=behind))
        return self._system(name, title or "half car", masses, corners, axles)
