"""Links of a system as elements of the time integration: dampers, bump stops, tyres that lift off."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.causal import trace
from mrdamper.systems.kernel import LoopElement
from mrdamper.systems.structure import Link
from mrdamper.tracing import Tape, program


@lru_cache(maxsize=32)  # a loop is prepared for every law
def damper_stage(damper: Damper, free: bool = False) -> LoopElement:
    """Return a damper as a stage, with variable parameters on request; raises as `stream`."""
    return LoopElement.of(trace(damper, free))


@lru_cache(maxsize=32)
def contact_stage(link: Link) -> LoopElement:
    """Return a bump stop, or the part of a tyre's force that is missing while the wheel is lifted off."""
    tape = Tape()
    stiffness, damping = (tape.parameter(name, getattr(link, name)) for name in ("stiffness", "damping"))
    gap = tape.parameter("gap", link.gap)
    x, v = tape.input("displacement"), tape.input("velocity")
    for name in ("acceleration", "current", "dt"):
        tape.input(name)
    force, touching = (_stop if link.role == "stop" else _tyre)(tape, x, v, stiffness, damping, gap)
    return LoopElement.of(program(tape, {"force": force, "flags": tape.select(touching, 1.0, 0.0)}))


def _stop(tape: Tape, x: Any, v: Any, stiffness: Any, damping: Any, gap: Any) -> tuple[Any, Any]:
    above = np.maximum(stiffness * (x - gap) + damping * v, 0.0)
    below = np.minimum(stiffness * (x + gap) + damping * v, 0.0)
    return tape.select(x > gap, above, tape.select(x < -gap, below, 0.0)), (x > gap) | (x < -gap)


def _tyre(tape: Tape, x: Any, v: Any, stiffness: Any, damping: Any, gap: Any) -> tuple[Any, Any]:
    """Calculate the correction of the force: in the structure the tyre is a spring that also transmits tension."""
    pull = stiffness * (x - gap) + damping * v
    return tape.select(pull > 0, -pull, 0.0), pull > 0
