"""Identification of the paper, literally: c and m in closed form, alpha and beta by a search.

[Qian et al. 2024, Eq. 16–22] Every point that the text leaves open is a named option. The method counts the hysteretic
force twice, in c and m and as alpha z; each result states how much of its c is hysteretic. `Balance` is the consistent
counterpart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.wording import number
from mrdamper.errors import IdentificationError
from mrdamper.identification.harmonic_balance import (
    AmplitudeReading,
    OffsetReading,
    PhaseReading,
    SineRecord,
    damping_and_mass,
    double_counted,
    read_force,
)
from mrdamper.identification.methods.balance import Balance
from mrdamper.identification.problem import Method, Problem, Solution
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper.genetic import GENERATIONS_OF_MANY, GeneticMinimum, GeneticSettings, genetic
from mrdamper.physics.hysteresis import Shape, steady_loop
from mrdamper.statistics.levenberg_marquardt import least_squares

_SEARCH_SAMPLES = 400  # samples of a cycle in the search for two parameters
_TINY = float(np.finfo(float).tiny)  # smallest beta [m^-n]
_MAX_HYSTERETIC_SHARE = 0.05  # share of c that may be hysteretic without a note

Box = tuple[float, float]


@dataclass(frozen=True)
class Paper(Method):
    """First-order harmonic balance for c and m, then a search for alpha and beta."""

    name: ClassVar[str] = "paper"
    summary: ClassVar[str] = "Qian et al. 2024 as described: c and m from the first harmonic, alpha and beta by search"

    force_amplitude: AmplitudeReading = "first-harmonic"  # definition of F0
    phase: PhaseReading = "harmonic"  # definition of phi
    offset: OffsetReading = "extremes"  # definition of f0; the paper takes maximum and minimum
    quadratic_stiffness: Literal["kept", "dropped"] = "kept"  # whether k2 is part of the gas spring [Eq. 7]
    # the paper's algorithm, or the least error that it approaches: a grid over beta with alpha solved for
    search: Literal["genetic", "optimum"] = "genetic"
    genetic: GeneticSettings = field(default_factory=GeneticSettings)
    bounds: tuple[Box, Box] = ((0.0, 1e8), (0.0, 1e8))  # of alpha [N/m] and beta [m^-n], the paper's [0, 1e8]
    explain: bool = True  # note how much of c is hysteretic, by an additional consistent balance

    def for_many_runs(self) -> Method:
        """Return the method with a short genetic search, where the paper takes 500 generations."""
        return replace(self, genetic=replace(self.genetic, generations=GENERATIONS_OF_MANY))

    def solve(self, problem: Problem) -> Solution:
        """Determine the free parameters; raises `IdentificationError`, or `ExcitationError` if there is no sine."""
        return self.solution(
            problem, self.genetic_search(problem) if self.search == "genetic" else _optimum(self, problem)
        )

    def genetic_search(self, problem: Problem) -> GeneticMinimum:
        """Run the genetic search alone; errors as `solve`."""
        rest = _Remainder.of(self, problem).thinned(_SEARCH_SAMPLES)
        lower, upper = zip(*self.bounds, strict=True)
        return genetic(rest.costs, lower, upper, self.genetic)

    def cost(self, problem: Problem) -> Callable[[Floats], Floats]:
        """Return the RMS error [N] over all samples as a function of (P, 2) points (alpha, beta) [Eq. 21]."""
        return _Remainder.of(self, problem).costs

    def solution(self, problem: Problem, minimum: GeneticMinimum) -> Solution:
        """Complete the end of a search to a solution."""
        determined, notes = self.closed_forms(problem, SineRecord.of(problem.run))
        values = dict(zip(("alpha", "beta"), minimum.point.tolist(), strict=True))
        at_bounds = tuple(
            name
            for (name, value), (low, high) in zip(values.items(), self.bounds, strict=True)
            if min(value - low, high - value) < 1e-6 * (high - low)
        )
        return Solution(
            BoucWen.build({**determined, **values}), 0.0, at_bounds, {}, {"beta": values["beta"]},
            minimum.evaluations, minimum.ending, self.genetic.seed if self.search == "genetic" else None,
            notes=(*notes, *(_hysteretic_share(problem, determined) if self.explain else ())),
        )  # fmt: skip

    def closed_forms(self, problem: Problem, record: SineRecord) -> tuple[dict[str, float], tuple[str, ...]]:
        """Return every parameter but alpha and beta, and notes [Eq. 16–20]."""
        X, omega = record.condition.amplitude_m, record.omega
        reading = read_force(record, self.force_amplitude, self.phase, self.offset)
        values, notes = dict(problem.fixed), ()
        k3 = values.setdefault("k3", 0.0)
        if "k1" in problem.free:
            # Without a gas spring the whole in-phase force is stiffness: at one frequency mass is part of it.
            _, apparent = damping_and_mass(reading, X, omega, 0.0, k3)
            values["k1"] = (values.get("m", 0.0) - apparent) * omega**2
            notes = ("no gas spring is given: k1 was taken from the in-phase force with the mass held, k2 = k3 = 0 "
                     "unless fixed",)  # fmt: skip
        c, m = damping_and_mass(reading, X, omega, values["k1"], k3)
        values |= {name: value for name, value in {"c": c, "m": m}.items() if name in problem.free}
        if self.quadratic_stiffness == "dropped":
            values["k2"] = 0.0
        if "f0" in problem.free:
            values["f0"] = reading.offset - (values.get("k2", 0.0) * X**2 / 2 if self.offset == "mean" else 0.0)
        return values, notes


@dataclass(frozen=True, eq=False)
class _Remainder:
    """Remainder of the force after the closed forms, to be described by alpha z [Qian et al. 2024, Eq. 21–22]."""

    problem: Problem
    record: SineRecord
    force: Floats
    _products: dict[float, tuple[float, float]] = field(default_factory=dict)

    @classmethod
    def of(cls, method: Paper, problem: Problem) -> _Remainder:
        _require_bouc_wen(problem)
        record = SineRecord.of(problem.run)
        model = BoucWen.build({**method.closed_forms(problem, record)[0], "alpha": 0.0, "beta": 1.0})
        return cls(problem, record, record.force - model.force(record.motion, np.zeros(record.theta.size)))

    def thinned(self, most: int) -> _Remainder:
        pick = np.unique(np.linspace(0, self.force.size - 1, most).round().astype(int))
        record = replace(self.record, theta=self.record.theta[pick], force=self.record.force[pick])
        return _Remainder(self.problem, record, self.force[pick])

    def states(self, betas: Sequence[float]) -> Floats:
        """Return z [m] on the exact loops of B betas, (B, N)."""
        shape = self.shape(np.array(betas))
        zeta = steady_loop(shape, self.record.condition.amplitude_m, self.record.theta)
        return np.reshape(shape.yield_displacement, (-1, 1)) * zeta

    def costs(self, points: Floats) -> Floats:
        """Return the RMS error [N] of many (alpha, beta) at once.

        The error is quadratic in alpha, so each beta needs its loop once; children inherit most betas unchanged.
        """
        new = [beta for beta in dict.fromkeys(points[:, 1].tolist()) if beta not in self._products]
        if new:
            z = self.states([max(beta, _TINY) for beta in new])
            products = (z @ self.force).tolist(), np.einsum("bn,bn->b", z, z).tolist()
            self._products.update(zip(new, zip(*products, strict=True), strict=True))
        linear, square = np.array([self._products[beta] for beta in points[:, 1].tolist()]).T
        alpha, total = points[:, 0], float(self.force @ self.force)
        return np.sqrt(np.maximum(total - 2 * alpha * linear + alpha**2 * square, 0.0) / self.force.size)

    def beta(self, length: float) -> float:
        """Return the beta that gives a yield displacement [m]."""
        fixed = {name: self.problem.fixed[name] for name in ("gamma", "n") if name in self.problem.fixed}
        return BoucWen.build({**fixed, "c": 0.0, "alpha": 0.0, "yield_displacement": length}).beta

    @property
    def longest(self) -> float:
        """Yield displacement [m] at which beta is zero for the given gamma."""
        gamma = self.problem.fixed.get("gamma", 0.0)
        return 0.999 * gamma ** (-1 / self.problem.fixed["n"]) if gamma > 0 else np.inf

    def shape(self, beta: float | Floats) -> Shape:
        fixed = self.problem.fixed
        return Shape.from_bouc_wen(beta, fixed.get("gamma", beta), fixed.get("n", BoucWen.n))


def _optimum(method: Paper, problem: Problem) -> GeneticMinimum:
    """Search a grid over the yield displacement and refine; alpha is linear and solved for."""
    rest = _Remainder.of(method, problem)
    (low, high), (_, steepest) = method.bounds
    X, shortest = rest.record.condition.amplitude_m, float(rest.shape(steepest).yield_displacement)
    edge = np.log([max(shortest, 1e-6 * X), min(20 * X, rest.longest)])

    def scale(z: Floats) -> float:
        return float(np.clip(z @ rest.force / (z @ z), low, high))

    def residual(u: Floats) -> Floats:
        (z,) = rest.states([rest.beta(float(np.exp(u[0])))])
        return scale(z) * z - rest.force

    grid = np.linspace(edge[0], edge[1], 24)
    states = rest.states([rest.beta(float(u)) for u in np.exp(grid)])
    costs = [float(np.sum((scale(z) * z - rest.force) ** 2)) for z in states]
    best = least_squares(residual, np.array([grid[int(np.argmin(costs))]]), edge[:1], edge[1:])
    beta = rest.beta(float(np.exp(best.point[0])))
    point = np.array([scale(rest.states([beta])[0]), beta])
    return GeneticMinimum(point, best.cost, best.evaluations + grid.size, np.array([]), (), best.ending)


def _require_bouc_wen(problem: Problem) -> None:
    if not issubclass(problem.model_type, BoucWen):
        raise IdentificationError(
            f"method paper identifies the Bouc–Wen model, not {problem.model_type.title}",
            remedy="use model bouc-wen, or another method",
        )
    if problem.with_delay:
        raise IdentificationError("method paper determines no delay", remedy="leave out the delay")
    for name in ("alpha", "beta"):
        if name not in problem.free:
            raise IdentificationError(f"{name} is held, but the method searches it", remedy=f"leave {name} free")
    for name in ("gamma", "n"):
        if name in problem.free:
            raise IdentificationError(
                f"{name} is free, but the paper presets it", remedy=f"leave {name} preset, or use method balance"
            )


def _hysteretic_share(problem: Problem, values: dict[str, float]) -> tuple[str, ...]:
    """Note how much of c is hysteretic force according to the consistent balance, if it is much."""
    model = Balance().solve(problem).model
    if "c" not in problem.free or not isinstance(model, BoucWen) or not values["c"] > 0:
        return ()
    record = SineRecord.of(problem.run)
    surplus, _ = double_counted(model.shape, model.yield_force, record.condition.amplitude_m, record.omega)
    if surplus < _MAX_HYSTERETIC_SHARE * values["c"]:
        return ()
    return (
        f"counted twice: {100 * min(surplus / values['c'], 1):.0f} % of c = {number(values['c'])} N s/m is the first "
        "harmonic of the hysteretic force, which alpha z holds too, and m is shifted likewise; method balance "
        "separates them",
    )
