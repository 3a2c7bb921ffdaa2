"""A baseline without physics: kernel ridge regression of the force on motion and current."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np

from mrdamper.dampers.base import Envelope
from mrdamper.dampers.published.base import ConditionedDamper, Piece
from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import IdentificationError
from mrdamper.identification import Identification
from mrdamper.models import Model
from mrdamper.motion import Excitation, sine
from mrdamper.simulation import Response

_CENTRES = 200
_WIDTH = 1.2  # of a kernel, in standard deviations of the inputs
_RIDGE = 1e-3
_SLOW = 5e-3  # m/s; below it velocity counts straight, above it by its logarithm
_SEED = 20240813


@dataclass(frozen=True, eq=False)
class KernelBaseline(ConditionedDamper):
    """Gaussian kernels over displacement, velocity, acceleration and current; no model of a damper.

    What a smooth function of the instant can do. A physical model that is no better than this
    inside the tests has earned nothing there; outside the tests the kernels fade to the mean.

    References
    ----------
    Kernel ridge regression on a subset of centres; Rasmussen and Williams (2006), "Gaussian
    Processes for Machine Learning", chapter 8.
    """

    name: ClassVar[str] = "kernel"
    heading: ClassVar[str] = "kernel regression (no physics)"
    source: ClassVar[str] = "Rasmussen and Williams 2006, chapter 8"
    basis: ClassVar[str] = ""
    limits: ClassVar[str] = "no memory, no extrapolation, hundreds of numbers"

    centres: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    weights: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def parameter_count(self) -> int:
        return self.weights.size + len(self.coefficients)

    @classmethod
    def start(cls, identifications: Sequence[Identification], reference: Condition) -> dict[str, float]:
        return {}

    @classmethod
    def fit(
        cls, runs: Sequence[Run], identifications: Sequence[Identification], provenance: Mapping[str, str] | None = None
    ) -> Self:
        """Fit to the last cycle of every run, each run by its own force scale."""
        if len(runs) < 2:
            raise IdentificationError(f"{len(runs)} runs", where=cls.heading, mend="give two or more")
        pieces = [Piece.of(run) for run in runs]
        raw = np.concatenate([_inputs(piece.motion.part(piece.scored)) for piece in pieces])
        spread = np.where(raw.std(axis=0) > 1e-12, raw.std(axis=0), 1.0)
        inputs = raw / spread
        force = np.concatenate([piece.force for piece in pieces])
        trust = np.concatenate([np.full(piece.force.size, 1 / piece.scale) for piece in pieces])
        trust /= trust.mean()
        mean = float(np.average(force, weights=trust**2))
        size = float(np.std(force))
        pick = np.random.default_rng(_SEED).choice(len(inputs), min(_CENTRES, len(inputs)), replace=False)
        centres = inputs[np.sort(pick)]
        table = _kernel(inputs, centres) * trust[:, None]
        normal = table.T @ table / len(inputs) + _RIDGE * _kernel(centres, centres) / len(centres)
        normal += 1e-10 * np.trace(normal) / len(centres) * np.eye(len(centres))
        weights = np.linalg.solve(normal, table.T @ ((force - mean) / size * trust) / len(inputs))
        conditions = [piece.condition for piece in pieces]
        names = ("displacement", "velocity", "acceleration", "current")
        coefficients = {
            "mean": mean,
            "size": size,
            **{f"spread_{n}": float(s) for n, s in zip(names, spread, strict=True)},
        }
        return cls(
            runs[0].rig, coefficients, conditions[0], Envelope.of(conditions), dict(provenance or {}), centres, weights
        )

    def model_at(self, condition: Condition) -> Model:
        raise IdentificationError("there is no model behind it", where=self.heading, mend="use loop or force_along")

    def force_along(self, motion: Excitation, condition: Condition) -> Floats:
        given = self.coefficients
        spread = np.array([given[f"spread_{n}"] for n in ("displacement", "velocity", "acceleration", "current")])
        kernel = _kernel(_inputs(self.felt(motion)) / spread, self.centres)
        return given["mean"] + given["size"] * (kernel @ self.weights)

    def loop(self, condition: Condition) -> Response:
        motion = sine(condition, 1)
        return Response(motion, self.force_along(motion, condition), np.zeros(len(motion)))


def _inputs(motion: Excitation) -> Floats:
    """Displacement, bent velocity, acceleration, current, one row a sample."""
    bent = np.arcsinh(motion.velocity / _SLOW)
    return np.column_stack([motion.displacement, bent, motion.acceleration, motion.current])


def _kernel(rows: Floats, centres: Floats) -> Floats:
    distance = np.sum(rows**2, axis=1)[:, None] + np.sum(centres**2, axis=1) - 2 * rows @ centres.T
    return np.exp(-np.maximum(distance, 0.0) / (2 * _WIDTH**2))
