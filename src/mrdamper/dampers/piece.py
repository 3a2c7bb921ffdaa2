"""The last cycle of a run, on which a condition-dependent damper is refined."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrdamper.data import Condition, Floats, Run, index_at
from mrdamper.models import Model
from mrdamper.models.recorded import CHANNELS, channel, compiled_outputs, traced_motion
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.sines import centred_motion, equivalent_sine
from mrdamper.tracing import Tape
from mrdamper.tracing.compiled.record import Channels
from mrdamper.tracing.tangent import with_tangents

_REFERENCE = ("I_r", "f_r", "A_r")  # names of a reference condition among the numbers of a damper
_SINE = {"current": "current_A", "frequency": "frequency_Hz", "amplitude": "amplitude_m"}  # inputs that a sine gives
_SAMPLES = 150  # a cycle


@dataclass(frozen=True, eq=False)
class Piece:
    """The last cycle of a run, thinned, and the motion that leads up to it."""

    condition: Condition
    motion: Excitation
    scored: slice
    force: Floats
    scale: float
    # by the shape parameters of a model
    states: dict[tuple[float, ...], Floats] = field(default_factory=dict[tuple[float, ...], Floats])

    @classmethod
    def of(cls, run: Run) -> Piece:
        """Take the last cycle of a run."""
        sine = equivalent_sine(run)
        last = int(np.flatnonzero(run.in_window)[-1])
        period = 1 / sine.condition.frequency_Hz
        begin = index_at(run.time, run.time[last] - period)
        lead = index_at(run.time, run.time[last] - 1.75 * period)
        step = max(1, (last - begin) // _SAMPLES)
        motion = centred_motion(run).part(slice(lead, last + 1, step))
        force = run.force[lead : last + 1 : step]
        scored = slice((begin - lead) // step, None)
        scale = float(np.ptp(force[scored])) * np.sqrt(force[scored].size)
        return cls(sine.condition, motion, scored, force[scored], scale)

    def residual(self, model: Model) -> Floats:
        """Predicted minus measured force over the force scale; its squares sum to nrmse_pp²."""
        shape = tuple(getattr(model, info.name) for info in model.parameters() if not info.linear)
        if shape not in self.states:
            self.states[shape] = model.state(self.motion)
        return (model.force(self.motion, self.states[shape])[self.scored] - self.force) / self.scale


class Pieces:
    """Last cycles of runs, evaluated in one compiled pass, each from rest.

    The dampers are condition-dependent: coefficients, a reference, and a model at a condition.
    """

    def __init__(self, runs: Sequence[Run]):
        self.pieces = [Piece.of(run) for run in runs]
        sizes = [len(piece.motion) for piece in self.pieces]
        self.begins = np.cumsum([0, *sizes])[:-1]
        scored = [np.arange(size)[piece.scored] for piece, size in zip(self.pieces, sizes, strict=True)]
        self.picked: NDArray[np.intp] = np.concatenate(
            [rows + at for rows, at in zip(scored, self.begins, strict=True)]
        )
        self.force = np.concatenate([piece.force for piece in self.pieces])
        self._channels: dict[str, Floats] = {}
        self._read: dict[tuple[str, ...], Channels] = {}
        self.scale = np.repeat([piece.scale for piece in self.pieces], [rows.size for rows in scored])

    def residual(self, damper: Any) -> Floats:
        """(N,) predicted minus measured force over the force scales; its squares sum to each run's nrmse_pp²."""
        if (values := self._along(damper, ())) is not None:
            return (values[0] - self.force) / self.scale
        return np.concatenate([piece.residual(damper.model_at(piece.condition)) for piece in self.pieces])

    def slopes(self, damper: Any) -> Floats | None:
        """(N, D) derivatives of the residual by the coefficients; None without a compiler."""
        values = self._along(damper, tuple(damper.coefficients))
        return None if values is None else (values[1:] / self.scale).T

    def _along(self, damper: Any, names: tuple[str, ...]) -> Floats | None:
        def traced(tape: Tape, free: Mapping[str, Any], inputs: Sequence[Any]) -> Mapping[str, Any]:
            *motion, frequency, amplitude = inputs
            along = traced_motion(tape, motion)
            sine = zip((along.current, frequency, amplitude), astuple(damper.reference), strict=True)
            kept = {name: value for name, value in free.items() if name not in _REFERENCE}
            one = replace(damper, coefficients=kept, reference=Condition(*(free[name] for name in _REFERENCE)))
            model = one.model_at(Condition(*(tape.assume(symbol, example) for symbol, example in sine)))
            return with_tangents(tape, model.force(along, model.state(along)), names)

        kind: type = damper.__class__
        return compiled_outputs(
            (kind, names),
            damper.numbers,
            traced,
            tuple(dict.fromkeys((*CHANNELS, *_SINE))),
            self._read,
            self._channel,
            self.picked,
            self.begins,
        )

    def _channel(self, name: str) -> Floats:
        """(N,) channel of the motions, or of the sine each of them is."""
        if name not in self._channels:
            sine = _SINE.get(name)
            self._channels[name] = np.concatenate(
                [
                    channel(piece.motion, name)
                    if sine is None
                    else np.full(len(piece.motion), getattr(piece.condition, sine))
                    for piece in self.pieces
                ]
            )
        return self._channels[name]
