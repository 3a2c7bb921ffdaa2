"""Clipped-optimal control: the force of a linear optimal controller, switched on where the damper can provide it.

LQG on the structure alone: a Kalman filter uses the accelerations of the coordinates, the strokes of the dampers and
their measured forces.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.systems.controllers.base import Controller, Sensors
from mrdamper.systems.linear import aims, linear_system
from mrdamper.systems.structure import Link, System


@dataclass(frozen=True, eq=False)
class Design:
    """z⁺ = A z + B f + L (y − C z − D f), f* = −G z, each sample time."""

    A: Floats  # to D: of the sampled structure
    B: Floats
    C: Floats
    D: Floats
    L: Floats  # of its observer
    G: Floats  # of its feedback
    size: Floats  # (S,) weights of the sensor signals
    coordinates: tuple[str, ...]  # of measured accelerations
    dampers: tuple[str, ...]  # of measured strokes


@dataclass(frozen=True)
class ClippedOptimal(Controller):
    """I high where (f* − f) f > 0, low elsewhere, f* the force of an LQG controller."""

    name: ClassVar[str] = "clipped-optimal"
    title: ClassVar[str] = "clipped-optimal (LQG)"
    source: ClassVar[str] = "Dyke, Spencer, Sain and Carlson 1996, Smart Materials and Structures 5, 565–575"

    effort: float = param(
        "-", "weight of the forces, in accelerations of the whole mass", bounds=(1e-12, math.inf), default=1e-3
    )
    span_weight: float = param("-", "of drifts beside accelerations", bounds=(0, math.inf), default=1.0)
    noise_ratio: float = param("-", "input over sensor noise, as densities", bounds=(1e-9, math.inf), default=50.0)
    design: Design | None = None

    def designed(self, system: System, links: Sequence[Link], period: float) -> Controller:
        from scipy.linalg import expm, solve_discrete_are

        dampers = [link for link in links if link.role == "damper"]
        linear = linear_system(system, dampers)
        n, count = linear.B.shape
        coupled = np.hstack([linear.A, linear.B, linear.E])
        still = np.zeros((coupled.shape[1] - n, coupled.shape[1]))
        sampled: Any = expm(period * np.vstack([coupled, still]))
        A, B, E = sampled[:n, :n], sampled[:n, n : n + count], sampled[:n, n + count :]
        weights = [self.span_weight if aim.kind == "span" else 1.0 for aim in aims(system)]
        z, f = (part * np.array(weights)[:, None] for part in linear.aim)
        R = f.T @ f + self.effort * np.eye(count) / linear.mass**2
        P = solve_discrete_are(A, B, z.T @ z, R, s=z.T @ f)
        G = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A + f.T @ z)
        C, D = linear.seen
        # A stroke is scaled to an acceleration by the square of the lowest frequency, as in the objectives.
        lowest = 2 * math.pi * system.frequencies_Hz()[0]
        size = np.append(np.ones(len(system.coordinates)), np.full(count, lowest**2))
        C, D = C * size[:, None], D * size[:, None]
        V = np.eye(size.size) / self.noise_ratio / period
        W = E @ E.T / period + 1e-15 * np.eye(n)
        S = solve_discrete_are(A.T, C.T, W, V)
        L = np.linalg.solve(C @ S @ C.T + V, C @ S @ A.T).T
        names = tuple(link.name for link in dampers)
        return replace(self, design=Design(A, B, C, D, L, G, size, system.coordinates, names))

    def law(self, see: Sensors) -> Any:
        if "wanted" not in see.shared:
            see.shared["wanted"] = self._optimal(see)
        return see.on_off((see.shared["wanted"][see.link.name] - see.force) * see.force > 0)

    def _optimal(self, see: Sensors) -> dict[str, Any]:
        """f* of every damper, from an observer of the structure."""
        design, tape = self.design, see.tape
        assert design is not None
        z = np.array([tape.remember(f"estimate{i}") for i in range(len(design.A))], dtype=object)
        f = np.array([see.signal(f"{name}.force") for name in design.dampers], dtype=object)
        y = [see(name, "acceleration") for name in design.coordinates]
        y += [see.signal(f"{name}.stroke") for name in design.dampers]
        gap = design.size * np.array(y, dtype=object) - design.C @ z - design.D @ f
        for memory, value in zip(z, design.A @ z + design.B @ f + design.L @ gap, strict=True):
            tape.update(memory, value)
        return dict(zip(design.dampers, -(design.G @ z), strict=True))
