"""The last cycle of a run: what a condition-dependent damper is refined on."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mrdamper.data import Condition, Floats, Run, index_at
from mrdamper.models import Model
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.sines import centred_motion, equivalent_sine

_SAMPLES = 150  # a cycle


@dataclass(frozen=True, eq=False)
class Piece:
    """The last cycle of a run, thinned, and the motion that leads up to it."""

    condition: Condition
    motion: Excitation
    scored: slice
    force: Floats
    scale: float
    # by what of a model shapes them
    states: dict[tuple[float, ...], Floats] = field(default_factory=dict[tuple[float, ...], Floats])

    @classmethod
    def of(cls, run: Run) -> Piece:
        """Cut it from a run."""
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
