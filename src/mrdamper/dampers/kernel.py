"""A baseline without physics: kernel ridge regression of the force on motion and current."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from mrdamper.dampers.base import Damper, Saved
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.piece import Piece
from mrdamper.data import Condition, Floats, Run
from mrdamper.data.parameters import ParameterInfo
from mrdamper.data.wording import counted
from mrdamper.errors import IdentificationError, ParameterError
from mrdamper.identification.problem import Identification
from mrdamper.physics.motion import Excitation

_MAX_CENTRES = 200
_WIDTH = 1.2  # of a kernel, in standard deviations of the inputs
_RIDGE = 1e-3
_LINEAR_VELOCITY_M_S = 5e-3  # m/s; below, the velocity enters linearly, above, by its logarithm
_SEED = 20240813
_INPUTS = 4


@dataclass(frozen=True, eq=False)
class KernelLaw:
    """A memoryless force: Gaussian kernels about centres."""

    centres: Floats  # (K, 4) displacement, scaled velocity, acceleration and current, each over its spread
    weights: Floats  # (K,)
    spread: Floats  # (4,)
    # mean and size: of the force [N]
    mean: float
    size: float

    def parameters(self) -> tuple[ParameterInfo, ...]:
        """No parameters with a meaning."""
        return ()

    def values(self) -> dict[str, float]:
        """None either."""
        return {}

    def state(self, motion: Excitation) -> Floats:
        """No memory."""
        return np.zeros(len(motion))

    def force(self, motion: Excitation, state: Floats) -> Floats:
        """Force [N] (N,) along a motion."""
        return self.mean + self.size * (_kernel(_inputs(motion) / self.spread, self.centres) @ self.weights)


@dataclass(frozen=True)
class SavedKernel(Saved):
    """A kernel regression in a saved model."""

    centres: list[list[float]]
    weights: list[float]
    spread: list[float]
    mean: float
    size: float


@dataclass(frozen=True, eq=False, repr=False)
class KernelDamper(Damper):
    """Gaussian kernels over displacement, velocity, acceleration and current; no model of a damper.

    Reference for a smooth memoryless function: a physical model should have a smaller error inside the tested range.
    Outside, the kernels decay to the mean.

    References
    ----------
    Kernel ridge regression on a subset of centres; Rasmussen and Williams (2006), "Gaussian
    Processes for Machine Learning", chapter 8.
    """

    kind: ClassVar[str] = "kernel"
    saved: ClassVar[type[Saved]] = SavedKernel
    streams: ClassVar[bool] = False
    name: ClassVar[str] = "kernel"
    heading: ClassVar[str] = "kernel regression (no physics)"
    source: ClassVar[str] = "Rasmussen and Williams 2006, chapter 8"  # type: ignore[assignment]
    basis: ClassVar[str] = ""
    basis_free: ClassVar[tuple[str, ...]] = ()
    limits: ClassVar[str] = "no memory, no extrapolation, hundreds of numbers"

    law: KernelLaw

    @property
    def title(self) -> str:
        return self.heading

    @property
    def parameter_count(self) -> int:
        return self.law.weights.size + 2 + self.law.spread.size

    def model_at(self, condition: Condition) -> KernelLaw:
        return self.law

    @classmethod
    def fit(
        cls, runs: Sequence[Run], identifications: Sequence[Identification], provenance: Mapping[str, str] | None = None
    ) -> Self:
        """Fit to the last cycle of every run, each run by its own force scale."""
        if len(runs) < 2:
            raise IdentificationError(counted(len(runs), "run"), where=cls.heading, remedy="give two or more")
        pieces = [Piece.of(run) for run in runs]
        raw = np.concatenate([_inputs(piece.motion.part(piece.scored)) for piece in pieces])
        spread = np.where(raw.std(axis=0) > 1e-12, raw.std(axis=0), 1.0)
        inputs = raw / spread
        force = np.concatenate([piece.force for piece in pieces])
        trust = np.concatenate([np.full(piece.force.size, 1 / piece.scale) for piece in pieces])
        trust /= trust.mean()
        mean = float(np.average(force, weights=trust**2))
        size = float(np.std(force))
        pick = np.random.default_rng(_SEED).choice(len(inputs), min(_MAX_CENTRES, len(inputs)), replace=False)
        centres = inputs[np.sort(pick)]
        table = _kernel(inputs, centres) * trust[:, None]
        normal = table.T @ table / len(inputs) + _RIDGE * _kernel(centres, centres) / len(centres)
        stiff: Floats = normal + 1e-10 * np.trace(normal) / len(centres) * np.eye(len(centres))
        right: Floats = table.T @ ((force - mean) / size * trust) / len(inputs)
        weights = np.asarray(np.linalg.solve(stiff, right), dtype=float)
        conditions = [piece.condition for piece in pieces]
        law = KernelLaw(centres, weights, spread, mean, size)
        return cls(law, rig=runs[0].rig, envelope=Envelope.of(conditions), provenance=dict(provenance or {}))

    def to_saved(self) -> SavedKernel:
        law = self.law
        return SavedKernel(law.centres.tolist(), law.weights.tolist(), law.spread.tolist(), law.mean, law.size)

    @classmethod
    def from_saved(cls, saved: SavedKernel, **shared: Any) -> Self:
        try:
            centres, weights, spread = (np.array(v, dtype=float) for v in (saved.centres, saved.weights, saved.spread))
        except ValueError:
            centres, weights, spread = np.zeros((0, 0)), np.zeros(0), np.zeros(0)
        if spread.shape != (_INPUTS,) or centres.shape != (weights.size, _INPUTS) or not np.all(spread > 0):
            raise ParameterError("centres, weights and spreads do not fit together", remedy="write the model again")
        return cls(KernelLaw(centres, weights, spread, saved.mean, saved.size), **shared)


def _inputs(motion: Excitation) -> Floats:
    """Displacement, scaled velocity, acceleration, current, one row per sample."""
    bent = np.arcsinh(motion.velocity / _LINEAR_VELOCITY_M_S)
    return np.column_stack([motion.displacement, bent, motion.acceleration, motion.current])


def _kernel(rows: Floats, centres: Floats) -> Floats:
    table = 2 * rows @ centres.T  # in place, because the table is larger than the processor's cache
    table -= np.sum(rows**2, axis=1)[:, None]
    table -= np.sum(centres**2, axis=1)
    np.minimum(table, 0.0, out=table)
    table /= 2 * _WIDTH**2
    return np.exp(table, out=table)
