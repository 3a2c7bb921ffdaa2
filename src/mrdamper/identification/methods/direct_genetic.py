"""Every parameter at once by the genetic algorithm: what the paper compares its method with.

[Qian et al. 2024, section 5] The box is laid from the run itself, in yield force and yield
displacement: on [0, 1e8] for alpha and beta, with c, k and f0 free beside them, the search
ends anywhere. A = 1: with alpha, beta and gamma free it changes no force.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import IdentificationError
from mrdamper.harmonic_balance import SineRecord
from mrdamper.identification.methods.balance import steady_state
from mrdamper.identification.problem import Method, Problem, Solution
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.optimizers.genetic import GeneticSettings, genetic

_SAMPLES = 200


@dataclass(frozen=True)
class DirectGenetic(Method):
    """RMSE of the force on the measured sine over all free parameters of the Bouc–Wen model.

    Attributes
    ----------
    genetic : GeneticSettings
    bounds : mapping of str to (float, float)
        Replace the box of a coordinate: c, f0, k1, k3, m, yield_force, yield_displacement, n,
        asymmetry [SI].
    """

    name: ClassVar[str] = "direct-genetic"
    summary: ClassVar[str] = "all parameters of the Bouc–Wen model by the genetic algorithm"

    genetic: GeneticSettings = field(default_factory=lambda: GeneticSettings(narrowings=3))
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=lambda: MappingProxyType({}))

    def solve(self, problem: Problem) -> Solution:
        """Determine the free parameters of a problem.

        Raises
        ------
        IdentificationError
            If the model is not Bouc–Wen.
        ExcitationError
            If the motion is no sine.
        """
        if not issubclass(problem.model_type, BoucWen) or problem.with_delay:
            raise IdentificationError(
                f"method {self.name} identifies the Bouc–Wen model, without a delay",
                mend="use model bouc-wen, or another method",
            )
        record = _thinned(SineRecord.of(problem.run))
        box = {**_box(problem, record), **self.bounds}
        names = list(box)
        found = genetic(
            lambda points: np.array([_error(problem, record, names, point) for point in points]),
            [box[name][0] for name in names],
            [box[name][1] for name in names],
            self.genetic,
        )
        end = dict(zip(names, found.point.tolist(), strict=True))
        at_bounds = tuple(
            name
            for name, value in end.items()
            if min(value - box[name][0], box[name][1] - value) < 1e-3 * np.ptp(box[name])
        )
        model = BoucWen.build({**problem.fixed, **end})
        searched = {name: end[name] for name in ("yield_displacement", "asymmetry", "n") if name in end}
        return Solution(model, 0.0, at_bounds, {}, searched, found.evaluations, found.message, self.genetic.seed)


def _thinned(record: SineRecord) -> SineRecord:
    pick = np.unique(np.linspace(0, record.theta.size - 1, _SAMPLES).round().astype(int))
    return SineRecord(record.run_id, record.condition, record.theta[pick], record.force[pick])


def _box(problem: Problem, record: SineRecord) -> dict[str, tuple[float, float]]:
    """Twice what the largest force would take, parameter by parameter."""
    peak, X = 2 * float(np.max(np.abs(record.force))), record.condition.amplitude_m
    speed = X * record.omega
    sizes = {"f0": peak, "k1": peak / X, "k2": peak / X**2, "k3": peak / X**3, "m": peak / (speed * record.omega)}
    box = {"c": (0.0, peak / speed)} if "c" in problem.free else {}
    box |= {name: (-size, size) for name, size in sizes.items() if name in problem.free}
    axes = problem.model_type.search_axes(X, problem.free)
    # The paper searches on a linear scale; a hundredth of an amplitude is a usual yield displacement.
    box |= {a.name: ((1e-4 * X, 0.5 * X) if a.name == "yield_displacement" else (a.lower, a.upper)) for a in axes}
    return box | ({"yield_force": (0.0, peak)} if "alpha" in problem.free else {})


def _error(problem: Problem, record: SineRecord, names: list[str], point: Floats) -> float:
    model = BoucWen.build({**problem.fixed, **dict(zip(names, point.tolist(), strict=True))})
    predicted = model.force(record.motion, steady_state(model, record))
    return float(np.sqrt(np.mean((predicted - record.force) ** 2)))
