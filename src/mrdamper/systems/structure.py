"""Structures with dampers: masses, viscous dampers and springs as matrices, and links between points.

All quantities are relative to static equilibrium. The input enters through channels: the acceleration of the ground, or
the height of the road under each wheel and its rate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.wording import counted
from mrdamper.errors import StructureError, UnknownNameError, check_fields, validate_arguments

_MAX_FREQUENCY_HZ = 2e3  # natural frequency [Hz]: beyond, a unit is wrong, and a second requires over 80,000 steps
GRAVITY = 9.81  # acceleration of gravity [m/s²]
_SYMMETRY = 1e-9  # relative difference of K and K' that rounding may leave


@dataclass(frozen=True)
class Link:
    """Element between two points: a damper, a stop, or a tyre that may lift off."""

    name: str
    above: str  # a point
    below: str  # the other; extension is positive
    role: Literal["damper", "stop", "tyre"] = "damper"
    stiffness: float = 0.0  # of a bump stop beyond its gap; of a tyre in contact [N/m]
    damping: float = 0.0  # the same [N s/m]
    gap: float = 0.0  # free travel of a bump stop in each direction; static deflection of a tyre [m]


@dataclass(frozen=True, eq=False, repr=False)
class System:
    """A linear structure M x'' + C x' + K x = load − B' f, f the forces of links."""

    name: str
    title: str
    coordinates: tuple[str, ...]  # names of the (n,) coordinates: relative to the ground if that accelerates
    M: Floats  # (n, n) [kg]; moments of inertia [kg m²], of rotations [rad]
    C: Floats  # (n, n) [N s/m]
    K: Floats  # (n, n) [N/m]
    channels: tuple[str, ...] = ("ground",)  # of the input: the ground, or the road under each wheel
    ground: Floats | None = None  # (n,) participation of a coordinate in the ground's acceleration; None for a road
    # ((n, q), (n, q)) forces on the coordinates per metre of road height and per m/s of its rate
    push: tuple[Floats, Floats] | None = None
    behind: tuple[float, ...] = (0.0,)  # (q,) distance of each channel behind the first along the road [m]
    links: tuple[Link, ...] = ()
    # further points as (n,) combinations of coordinates, such as the corners of a body
    points: Mapping[str, Floats] = field(default_factory=dict)
    # relative displacements to report, between two points: storey drifts, suspension travel
    spans: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    def __repr__(self) -> str:
        links = ", ".join(f"{link.role} {link.name}" for link in self.links) or "no links"
        return f"<system {self.name}: {self.title}; {counted(len(self.coordinates), 'coordinate')}, {links}>"

    def __post_init__(self) -> None:
        check_fields(self)
        n = len(self.coordinates)
        for letter in "MCK":
            matrix = np.array(getattr(self, letter), dtype=float)
            problem = f"{letter} of shape {matrix.shape} for {n} coordinates, or not finite"
            fits = matrix.shape == (n, n) and bool(np.isfinite(matrix).all())
            self._require(fits, problem, "give one row and one column a coordinate", StructureError.code)
            equal = np.allclose(matrix, matrix.T, rtol=0, atol=_SYMMETRY * max(np.abs(matrix).max(), 1e-300))
            self._require(equal, f"{letter} is not symmetric", "forces between two points are equal", _CODES[letter])
            object.__setattr__(self, letter, matrix)
        lowest = np.linalg.eigvalsh(self.M).min()
        self._require(lowest > 0, "M is not positive definite", "every coordinate needs a mass", _CODES["M"])
        for letter in "CK":
            matrix = getattr(self, letter)
            keeps = np.linalg.eigvalsh(matrix).min() >= -_SYMMETRY * max(np.abs(matrix).max(), 1e-300)
            problem = f"{letter} has a negative eigenvalue: it gives energy away"
            self._require(keeps, problem, "check the signs off the diagonal", _CODES[letter])
        highest = float(self.frequencies_Hz().max(initial=0.0))
        problem = f"a natural frequency of {highest:.3g} Hz"
        self._require(highest < _MAX_FREQUENCY_HZ, problem, "check the units of masses and stiffnesses", _CODES["K"])
        for link in self.links:
            for end in (link.above, link.below):
                problem = f"{link.role} {link.name} hangs on {end!r}, which does not exist"
                self._require(end in self.known, problem, f"known: {', '.join(self.known)}", "E_POINT")
            problem = f"{link.role} {link.name} hangs on {link.above!r} twice"
            self._require(link.above != link.below, problem, "give two points", "E_POINT")

    def _require(self, good: Any, problem: str, remedy: str, code: str) -> None:
        if not good:
            raise StructureError(problem, where=self.name, remedy=remedy, code=code)

    @property
    def known(self) -> tuple[str, ...]:
        """Points that a link can be attached to."""
        return (*self.coordinates, *self.points, *self.channels)

    @property
    def dampers(self) -> tuple[Link, ...]:
        """Links that are dampers."""
        return tuple(link for link in self.links if link.role == "damper")

    @validate_arguments()
    def point(self, name: str) -> tuple[Floats, Floats]:
        """Return a point as a combination of the coordinates (n,) and of the channels' heights (q,)."""
        row, road = np.zeros(len(self.coordinates)), np.zeros(len(self.channels))
        if name in self.coordinates:
            row[self.coordinates.index(name)] = 1.0
        elif name in self.points:
            row = np.array(self.points[name], dtype=float)
        elif name in self.channels:
            road[self.channels.index(name)] = 0.0 if self.ground is not None else 1.0
        else:
            raise UnknownNameError.of("point", name, self.known)
        return row, road

    def span(self, above: str, below: str) -> tuple[Floats, Floats]:
        """Return the displacement of one point relative to another, as `point`."""
        (a, road_a), (b, road_b) = self.point(above), self.point(below)
        return a - b, road_a - road_b

    def extensions(self, links: Sequence[Link]) -> tuple[Floats, Floats]:
        """Return the extensions of links by coordinate (E, n) and by height of a channel (E, q)."""
        spans = [self.span(link.above, link.below) for link in links]
        widths = len(self.coordinates), len(self.channels)
        rows, roads = (np.array([s[k] for s in spans]).reshape(len(spans), w) for k, w in enumerate(widths))
        return rows, roads

    def frequencies_Hz(self) -> Floats:
        """(n,) undamped natural frequencies without links, lowest first."""
        whitened = np.linalg.inv(np.linalg.cholesky(self.M))
        return np.sqrt(np.maximum(np.linalg.eigvalsh(whitened @ self.K @ whitened.T), 0.0)) / (2 * np.pi)


_CODES = {"M": "E_MASS", "C": "E_DAMPING", "K": "E_STIFFNESS"}


def shear_building(
    name: str,
    masses: Sequence[float],
    stiffnesses: Sequence[float],
    dampings: Sequence[float],
    links: Sequence[Link] = (),
    title: str = "",
) -> System:
    """Storeys one above the other, by masses [kg], stiffnesses [N/m] and dampings [N s/m] from below."""
    floors = tuple(f"floor{i + 1}" for i in range(len(masses)))
    M = np.diag(np.array(masses, dtype=float))
    return building(name, floors, M, _chain(dampings), _chain(stiffnesses), links, title)


def building(
    name: str, floors: Sequence[str], M: Floats, C: Floats, K: Floats, links: Sequence[Link] = (), title: str = ""
) -> System:
    """Make a structure on ground that accelerates, by its matrices; drifts are from floor to floor."""
    below = ("ground", *floors[:-1])
    spans = dict(zip(floors, zip(floors, below, strict=True), strict=True))
    return System(
        name, title or name, tuple(floors), M, C, K, ("ground",), np.ones(len(floors)), links=tuple(links), spans=spans
    )


def _chain(values: Sequence[float]) -> Floats:
    k = np.array([*values, 0.0], dtype=float)
    return np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
