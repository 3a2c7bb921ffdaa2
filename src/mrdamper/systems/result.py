"""Result of a system simulation: histories, peaks, energies, and the time of each damper outside its tested range."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.streaming import FLAGS
from mrdamper.data import Displayable, Floats
from mrdamper.data.wording import number
from mrdamper.errors import UnknownNameError, validate_arguments
from mrdamper.systems.controllers import Controller
from mrdamper.systems.controllers.passive import Passive
from mrdamper.systems.structure import Link, System

PART = 4096  # steps per block, whose arrays fit the processor's cache
HALVING = 5e-3  # change of a peak on halving the step up to which it has converged


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Displayable):
    """Result of a system simulation."""

    PEAKS: ClassVar = ("displacement_m", "drift_m", "acceleration_m_s2", "force_N")

    system: System
    time: Floats  # (N,) [s]
    x: Floats  # (N, n) coordinates [m]
    v: Floats  # (N, n) their rates [m/s]
    a: Floats  # (N, n) absolute accelerations [m/s²]
    links: tuple[Link, ...]  # as simulated: without dampers that were removed
    force: Floats  # (N, E) of each link [N]
    current: Floats  # (N, E) commanded to each link [A]; zero for stops and tyres
    # (N, E) of dampers: bits of `streaming.FLAGS`; of stops: contact; of tyres: lift-off
    flags: NDArray[np.uint8]
    road: Floats  # (N, q) height of the road by channel [m]; zero on the ground
    road_rate: Floats  # (N, q) [m/s]
    load: Floats  # (N, n) force of the input on each coordinate [N]
    controller: Controller
    limits: Mapping[str, float]  # largest current [A] of dampers with a force command
    halving: float = math.nan  # largest relative change of a peak against steps twice as long; NaN where not checked

    @property
    def headline(self) -> str:
        """System and law, with the current where it is constant, or that there are no dampers."""
        law = type(self.controller).title if self.dampers else "without dampers"
        constant = self.controller.current_A if self.dampers and isinstance(self.controller, Passive) else None
        return f"{self.system.title}, {law}{'' if constant is None else f' {number(constant, 3)} A'}"

    @property
    def details(self) -> list[str]:
        """Duration, step and peaks."""
        largest = ((name.partition("_"), float(np.max(rows, initial=0.0))) for name, rows in self.peaks.items())
        peaks = ", ".join(f"{name} {number(value)} {unit.replace('_s2', '/s²')}" for (name, _, unit), value in largest)
        return [f"{number(float(self.time[-1]))} s in steps of {number(1e3 * self.step, 3)} ms", f"largest {peaks}"]

    @property
    def table(self) -> dict[str, Floats]:
        """One row per time step, SI units: motion of the coordinates, stroke, force and current of the links."""
        columns = {"time_s": self.time}
        for i, name in enumerate(self.system.coordinates):
            columns |= {f"{name}.x": self.x[:, i], f"{name}.v": self.v[:, i], f"{name}.a": self.a[:, i]}
        for i, link in enumerate(self.links):
            columns |= {f"{link.name}.stroke": self.stroke[:, i], f"{link.name}.force": self.force[:, i]}
            if link.role == "damper":
                columns[f"{link.name}.current_A"] = self.current[:, i]
        return columns

    @property
    def step(self) -> float:
        """Time step [s]."""
        return float(self.time[1])

    @property
    def settled(self) -> bool:
        """True if halving the step changed no peak by more than 0.5 %; False where this was not checked."""
        return self.halving <= HALVING

    @property
    def dampers(self) -> tuple[Link, ...]:
        """The dampers of the simulation."""
        return tuple(link for link in self.links if link.role == "damper")

    @property
    def damper_columns(self) -> list[int]:
        """Columns of the dampers among those of the links."""
        return [i for i, link in enumerate(self.links) if link.role == "damper"]

    @cached_property
    def stroke(self) -> Floats:
        """(N, E) relative displacement of each link [m]."""
        B, D = self.system.extensions(self.links)
        return self.x @ B.T + self.road @ D.T

    @cached_property
    def stroke_rate(self) -> Floats:
        """(N, E) relative velocity of each link [m/s]."""
        B, D = self.system.extensions(self.links)
        return self.v @ B.T + self.road_rate @ D.T

    @property
    def outside(self) -> dict[str, dict[str, float]]:
        """Share of the time of each damper outside its tested range, by quantity; bump-stop contact, wheel lift-off."""
        shares_by_link: dict[str, dict[str, float]] = {}
        for i, link in enumerate(self.links):
            words = {"damper": FLAGS, "stop": ("bump-stop contact",), "tyre": ("wheel lift-off",)}[link.role]
            shares = {word: float(np.mean(self.flags[:, i] >> bit & 1)) for bit, word in enumerate(words)}
            if kept := {word: share for word, share in shares.items() if share > 0}:
                shares_by_link[link.name] = kept
        return shares_by_link

    @cached_property
    def peaks(self) -> dict[str, Floats]:
        """Largest magnitudes: displacement, drift, acceleration, force, by coordinate, span, damper."""
        series = (self.x.T, map(self.span, self.system.spans), self.a.T, self.force.T[self.damper_columns])
        return dict(zip(self.PEAKS, map(_largest, series), strict=True))

    @validate_arguments()
    def span(self, name: str) -> Floats:
        """(N,) relative displacement [m] of a span of the system."""
        if name not in self.system.spans:
            raise UnknownNameError.of("span", name, self.system.spans)
        row, road = self.system.span(*self.system.spans[name])
        return self.x @ row + self.road @ road

    @validate_arguments()
    def acceleration_of(self, point: str) -> Floats:
        """(N,) absolute acceleration [m/s²] of a point that moves with the coordinates."""
        return self.a @ self.system.point(point)[0]

    @property
    def unreachable(self) -> dict[str, float]:
        """Share of the time in which the force command of a damper was not reachable: its current at an end."""
        shares = {}
        for i, link in enumerate(self.links):
            if link.name in self.limits:
                most, current = self.limits[link.name], self.current[1:, i]
                shares[link.name] = float(np.mean((current <= 0.01 * most) | (current >= 0.99 * most)))
        return shares

    @property
    def timing(self) -> dict[str, float]:
        """Correlation of each damper's current with the power that it takes from the controlled mass.

        A negative value shows a wrong sign: the force is high when the damper excites that mass. Dampers with a
        constant current are omitted.
        """
        times = {}
        for i in self.damper_columns:
            link, current = self.links[i], self.current[:, i]
            if np.ptp(current) > 0:
                end, sign = (link.below, -1.0) if self.controller.calms == "below" else (link.above, 1.0)
                row, road = self.system.point(end)
                power = sign * self.force[:, i] * (self.v @ row + self.road_rate @ road)
                if np.ptp(power) > 0:
                    times[link.name] = float(np.corrcoef(current, power)[0, 1])
        return times

    @cached_property
    def energy(self) -> dict[str, Floats]:
        """(N,) energies since the start [J], by trapezoids: of the input, stored, lost in the structure, by link."""
        system, names = self.system, [link.name for link in self.links]
        (B, D), series = self.system.extensions(self.links), np.zeros((3 + len(names), self.time.size))
        for begin in range(0, self.time.size - 1, PART):
            part = slice(begin, begin + PART + 1)
            x, v, force, road, load = (a[part] for a in (self.x, self.v, self.force, self.road, self.load))
            moved, middle, mean_force, mean_load = np.diff(x, axis=0), _mean(v), _mean(force), _mean(load)
            of_road = mean_force * (np.diff(road, axis=0) @ D.T)
            after = series[:, begin + 1 : begin + PART + 1]
            after[0] = np.einsum("ij,ij->i", mean_load, moved) + of_road.sum(axis=1)
            after[2] = self.step * np.einsum("ij,ij->i", middle @ system.C, middle)
            after[3:] = (mean_force * (moved @ B.T) + of_road).T
            stored = np.einsum("ij,ij->i", v @ system.M, v) + np.einsum("ij,ij->i", x @ system.K, x)
            series[1, part] = 0.5 * stored
        for k in (0, *range(2, series.shape[0])):
            np.cumsum(series[k], out=series[k])
        return dict(zip(("input", "stored", "structure", *names), series, strict=True))

    @property
    def energy_gap(self) -> float:
        """Largest imbalance of energy over the largest of these energies."""
        spent = sum(series for name, series in self.energy.items() if name != "input")
        most = max(max(float(np.abs(series).max()) for series in self.energy.values()), np.finfo(float).tiny)
        return float(np.abs(self.energy["input"] - spent).max()) / most


def _largest(series: Iterable[Floats]) -> Floats:
    return np.array([max(float(one.max()), -float(one.min())) for one in series])


def _mean(series: Floats) -> Floats:
    return 0.5 * (series[1:] + series[:-1])
