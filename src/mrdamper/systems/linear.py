"""Linear structure for the design of controllers, and the objectives of control."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrdamper.data import Floats
from mrdamper.systems.structure import GRAVITY, Link, System

_TRAVEL, _TYRE = 0.5, 0.5  # weight of a car's travel and tyre deflection relative to its acceleration


@dataclass(frozen=True)
class Aim:
    """An objective: an acceleration, or a relative displacement times a frequency squared."""

    kind: str  # "acceleration" or "span"
    name: str  # of a point, or of a span
    weight: float  # 1, or [1/s²]


def aims(system: System) -> tuple[Aim, ...]:
    """List the objectives of control, all in m/s².

    In a building: absolute accelerations of the floors, and storey drifts times the square of the
    lowest frequency. In a car: accelerations above the dampers, travel times half of that square,
    and half of each tyre's load over its static load, times g.
    """
    lowest = 2 * math.pi * float(system.frequencies_Hz()[0])
    if system.ground is not None:
        quantities = [Aim("acceleration", name, 1.0) for name in system.coordinates]
        return (*quantities, *(Aim("span", name, lowest**2) for name in system.spans))
    tyres = {(link.above, link.below): GRAVITY / link.gap for link in system.links if link.role == "tyre"}
    quantities = [Aim("acceleration", link.above, 1.0) for link in system.dampers]
    for name, ends in system.spans.items():
        quantities.append(Aim("span", name, _TYRE * tyres[ends] if ends in tyres else _TRAVEL * lowest**2))
    return tuple(quantities)


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """z' = A z + B f + E w, z = (x, v), f the forces of the dampers, w the input."""

    A: Floats  # (2n, 2n)
    B: Floats  # (2n, E)
    E: Floats  # (2n, q)
    # ((S, 2n), (S, E)) accelerations of the coordinates, then strokes of the dampers, from z and f
    seen: tuple[Floats, Floats]
    # ((P, 2n), (P, E)) `aims`, weighted, from z and f, without the contribution of the input
    aim: tuple[Floats, Floats]
    mass: float  # of all translating masses [kg]


def linear_system(system: System, dampers: Sequence[Link]) -> LinearSystem:
    """Linearise about rest, dampers as forces, tyres on the ground, stops out of reach."""
    n = len(system.coordinates)
    inverse = np.linalg.inv(system.M)
    rows, _ = system.extensions(dampers)
    a, b = -inverse @ np.hstack([system.K, system.C]), -inverse @ rows.T
    if system.ground is not None:
        e = -system.ground[:, None]
    else:
        assert system.push is not None
        e = inverse @ system.push[0]
    nothing = np.zeros((len(dampers), len(dampers)))
    still = np.zeros((len(dampers), n))
    outputs = (np.vstack([a, np.hstack([rows, still])]), np.vstack([b, nothing]))
    states, forces = [], []
    for aim in aims(system):
        if aim.kind == "acceleration":
            row = system.point(aim.name)[0]
            states.append(aim.weight * row @ a)
            forces.append(aim.weight * row @ b)
        else:
            row = system.span(*system.spans[aim.name])[0]
            states.append(np.concatenate([aim.weight * row, np.zeros(n)]))
            forces.append(np.zeros(len(dampers)))
    mass = float(sum(system.M[i, i] for i, name in enumerate(system.coordinates) if name != "pitch"))
    return LinearSystem(
        np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), a]),
        np.vstack([np.zeros((n, len(dampers))), b]),
        np.vstack([np.zeros((n, e.shape[1])), e]),
        outputs,
        (np.array(states), np.array(forces)),
        mass,
    )
