"""The paper's identification, literally: c and m in closed form, alpha and beta searched.

[Qian et al. 2024, Eq. 16–22] Every point the text leaves open is a named switch. The recipe
counts the hysteretic force twice, once inside c and m and once more as alpha z: it is here to
be reproduced, and each result says how much of its c is not viscous. `Balance` is the
consistent counterpart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal

import numpy as np

from mrdamper.data import Floats
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
from mrdamper.paper.generation import GENERATIONS_OF_MANY, GeneticSettings
from mrdamper.paper.genetic import GeneticMinimum, genetic
from mrdamper.physics.hysteresis import Shape, steady_loop
from mrdamper.statistics.ending import Ending
from mrdamper.statistics.levenberg_marquardt import least_squares

_SEARCH_SAMPLES = 400  # two numbers are searched; more samples change them by less than the search does
_TINY = float(np.finfo(float).tiny)  # a beta above zero
_SMALL = 0.05  # share of c that may be hysteretic before the reader is warned


@dataclass(frozen=True)
class Paper(Method):
    """First-order harmonic balance for c and m, then a search for alpha and beta.

    Attributes
    ----------
    force_amplitude : {"first-harmonic", "half-peak-to-peak", "maximum"}
        What F0 is.
    phase : {"harmonic", "peaks"}
        What phi is.
    offset : {"extremes", "mean"}
        What f0 is; the paper takes maximum and minimum.
    quadratic_stiffness : {"kept", "dropped"}
        Whether k2 is part of the gas spring.
    search : {"genetic", "optimum"}
        "genetic" is the paper's algorithm; "optimum" finds the minimum that it approaches, from
        a grid over beta with alpha solved for.
    genetic : GeneticSettings
    bounds : ((float, float), (float, float))
        Of alpha [N/m] and beta [m^-n], the paper's [0, 1e8].
    explain : bool
        Say how much of c is hysteretic; takes a consistent balance besides.
    """

    name: ClassVar[str] = "paper"
    summary: ClassVar[str] = "Qian et al. 2024 as described: c and m from the first harmonic, alpha and beta by search"

    force_amplitude: AmplitudeReading = "first-harmonic"
    phase: PhaseReading = "harmonic"
    offset: OffsetReading = "extremes"
    quadratic_stiffness: Literal["kept", "dropped"] = "kept"
    search: Literal["genetic", "optimum"] = "genetic"
    genetic: GeneticSettings = field(default_factory=GeneticSettings)
    bounds: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 1e8), (0.0, 1e8))
    explain: bool = True

    def for_many_runs(self) -> Method:
        """Return the method with a short genetic search, where the paper takes 500 generations."""
        return replace(self, genetic=replace(self.genetic, generations=GENERATIONS_OF_MANY))

    def solve(self, problem: Problem) -> Solution:
        """Determine the free parameters of a problem.

        Raises
        ------
        IdentificationError
            If the model is not Bouc–Wen, or alpha or beta are held.
        ExcitationError
            If the motion is no sine.
        """
        if self.search == "genetic":
            return self.solution(problem, self.genetic_search(problem))
        _require_bouc_wen(problem)
        return self._solution(problem, self._by_optimum(self._rest(problem)))

    def solution(self, problem: Problem, found: GeneticMinimum) -> Solution:
        """What a genetic search found of a problem."""
        searched = _Searched(float(found.point[0]), float(found.point[1]), found.evaluations, found.ending)
        return self._solution(problem, searched)

    def _solution(self, problem: Problem, searched: _Searched) -> Solution:
        known, notes = self._closed_forms(problem, SineRecord.of(problem.run))
        values = {"alpha": searched.alpha, "beta": searched.beta}
        return Solution(
            model=BoucWen.build({**known, **values}),
            delay=0.0,
            at_bounds=tuple(
                name
                for (name, value), (low, high) in zip(values.items(), self.bounds, strict=True)
                if min(value - low, high - value) < 1e-6 * (high - low)
            ),
            start={},
            end={"beta": searched.beta},
            evaluations=searched.evaluations,
            ending=searched.ending,
            seed=self.genetic.seed if self.search == "genetic" else None,
            notes=(*notes, *(_counted_twice(problem, known) if self.explain else ())),
        )

    def genetic_search(self, problem: Problem) -> GeneticMinimum:
        """Run the genetic search alone: its history and its boxes."""
        _require_bouc_wen(problem)
        lower, upper = zip(*self.bounds, strict=True)
        return genetic(self._rest(problem).thinned(_SEARCH_SAMPLES).costs, lower, upper, self.genetic)

    def cost(self, problem: Problem) -> Callable[[Floats], Floats]:
        """RMS error [N] over all samples of (P, 2) points (alpha, beta), once c, m and f0 are known [Eq. 21]."""
        return self._rest(problem).costs

    def _rest(self, problem: Problem) -> _Rest:
        record = SineRecord.of(problem.run)
        return _Rest.of(problem, record, self._closed_forms(problem, record)[0])

    def _closed_forms(self, problem: Problem, record: SineRecord) -> tuple[dict[str, float], tuple[str, ...]]:
        """Every parameter but alpha and beta."""
        X, omega = record.condition.amplitude_m, record.omega
        reading = read_force(record, self.force_amplitude, self.phase, self.offset)
        known, notes = dict(problem.fixed), ()
        k3 = known.setdefault("k3", 0.0)
        if "k1" in problem.free:
            # Without a gas spring the whole in-phase force is stiffness: at one frequency mass is part of it.
            _, apparent = damping_and_mass(reading, X, omega, 0.0, k3)
            known["k1"] = (known.get("m", 0.0) - apparent) * omega**2
            notes = (
                "no gas spring is given: k1 was taken from the in-phase force with the mass held, k2 = k3 = 0 "
                "unless fixed",
            )
        c, m = damping_and_mass(reading, X, omega, known["k1"], k3)
        known |= {name: value for name, value in {"c": c, "m": m}.items() if name in problem.free}
        if self.quadratic_stiffness == "dropped":
            known["k2"] = 0.0
        if "f0" in problem.free:
            lift = known.get("k2", 0.0) * X**2 / 2 if self.offset == "mean" else 0.0
            known["f0"] = reading.offset - lift
        return known, notes

    def _by_optimum(self, rest: _Rest) -> _Searched:
        """Grid over the yield displacement, then refinement; alpha is linear and solved for."""
        (low, high), (_, steepest) = self.bounds
        X = rest.record.condition.amplitude_m
        edge = np.log([max(rest.length(steepest), 1e-6 * X), min(20 * X, rest.longest)])

        def explained(z: Floats) -> Floats:
            return np.clip(z @ rest.force / (z @ z), low, high) * z - rest.force

        def residual(u: Floats) -> Floats:
            return explained(rest.states([rest.beta(float(np.exp(u[0])))])[0])

        grid = np.linspace(edge[0], edge[1], 24)
        costs = [float(np.sum(explained(z) ** 2)) for z in rest.states([rest.beta(float(u)) for u in np.exp(grid)])]
        best = least_squares(residual, np.array([grid[int(np.argmin(costs))]]), edge[:1], edge[1:])
        beta = rest.beta(float(np.exp(best.point[0])))
        (z,) = rest.states([beta])
        alpha = float(np.clip(z @ rest.force / (z @ z), low, high))
        return _Searched(alpha, beta, best.evaluations + grid.size, best.ending)


@dataclass(frozen=True)
class _Searched:
    alpha: float
    beta: float
    evaluations: int
    ending: Ending


@dataclass(frozen=True, eq=False)
class _Rest:
    """What the closed forms leave of the force, for alpha z to explain [Qian et al. 2024, Eq. 21–22]."""

    problem: Problem
    record: SineRecord
    force: Floats
    _products: dict[float, tuple[float, float]] = field(default_factory=dict)

    @classmethod
    def of(cls, problem: Problem, record: SineRecord, known: dict[str, float]) -> _Rest:
        bare = BoucWen.build({**known, "alpha": 0.0, "beta": 1.0})
        return cls(problem, record, record.force - bare.force(record.motion, np.zeros(record.theta.size)))

    def thinned(self, most: int) -> _Rest:
        pick = np.unique(np.linspace(0, self.force.size - 1, most).round().astype(int))
        record = SineRecord(self.record.run_id, self.record.condition, self.record.theta[pick], self.record.force[pick])
        return _Rest(self.problem, record, self.force[pick])

    def states(self, betas: Sequence[float]) -> Floats:
        """Z [m] on the exact loops of B betas, (B, N)."""
        shape = self._shape(np.array(betas))
        zeta = steady_loop(shape, self.record.condition.amplitude_m, self.record.theta)
        return np.reshape(shape.yield_displacement, (-1, 1)) * zeta

    def costs(self, points: Floats) -> Floats:
        """RMS error [N] of many (alpha, beta) at once.

        The error is quadratic in alpha, so each beta needs its loop once; children inherit
        most betas unchanged.
        """
        total = float(self.force @ self.force)
        new = [beta for beta in dict.fromkeys(points[:, 1].tolist()) if beta not in self._products]
        for beta, z in zip(new, self.states([max(beta, _TINY) for beta in new]) if new else (), strict=True):
            self._products[beta] = float(z @ self.force), float(z @ z)
        linear, square = np.array([self._products[beta] for beta in points[:, 1].tolist()]).T
        alpha = points[:, 0]
        return np.sqrt(np.maximum(total - 2 * alpha * linear + alpha**2 * square, 0.0) / self.force.size)

    def beta(self, length: float) -> float:
        """Beta that gives a yield displacement [m]."""
        fixed = {name: self.problem.fixed[name] for name in ("gamma", "n") if name in self.problem.fixed}
        return BoucWen.build({**fixed, "c": 0.0, "alpha": 0.0, "yield_displacement": length}).beta

    def length(self, beta: float) -> float:
        """Yield displacement [m] of a beta."""
        return float(self._shape(beta).yield_displacement)

    @property
    def longest(self) -> float:
        """Yield displacement [m] at which a gamma that is held leaves nothing for beta."""
        gamma = self.problem.fixed.get("gamma", 0.0)
        return 0.999 * gamma ** (-1 / self.problem.fixed["n"]) if gamma > 0 else np.inf

    def _shape(self, beta: float | Floats) -> Shape:
        fixed = self.problem.fixed
        return Shape.from_bouc_wen(beta, fixed.get("gamma", beta), fixed.get("n", BoucWen.n))


def _require_bouc_wen(problem: Problem) -> None:
    if not issubclass(problem.model_type, BoucWen):
        raise IdentificationError(
            f"method paper identifies the Bouc–Wen model, not {problem.model_type.title}",
            mend="use model bouc-wen, or another method",
        )
    if problem.with_delay:
        raise IdentificationError("method paper determines no delay", mend="leave out the delay")
    for name in ("alpha", "beta"):
        if name not in problem.free:
            raise IdentificationError(f"{name} is held, but the method searches it", mend=f"leave {name} free")
    for name in ("gamma", "n"):
        if name in problem.free:
            raise IdentificationError(
                f"{name} is free, but the paper presets it", mend=f"leave {name} preset, or use method balance"
            )


def _counted_twice(problem: Problem, known: dict[str, float]) -> tuple[str, ...]:
    """Warn if much of c is hysteretic force, judged by the consistent balance."""
    consistent: Callable[[Problem], Solution] = Balance().solve
    found = consistent(problem).model
    if "c" not in problem.free or not isinstance(found, BoucWen) or not known["c"] > 0:
        return ()
    record = SineRecord.of(problem.run)
    surplus, _ = double_counted(found.shape, found.yield_force, record.condition.amplitude_m, record.omega)
    if surplus < _SMALL * known["c"]:
        return ()
    return (
        f"counted twice: {100 * min(surplus / known['c'], 1):.0f} % of c = {known['c']:.4g} N s/m is "
        f"the first harmonic of "
        "the hysteretic force, which alpha z holds too, and m is shifted likewise; method balance separates them",
    )
