"""The links of a system as stages of the loop: dampers, bump stops, tyres that lift off."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from mrdamper.dampers.base import Damper
from mrdamper.dampers.causal import trace
from mrdamper.systems.kernel import Stage
from mrdamper.systems.structure import Link
from mrdamper.tracing import Program
from mrdamper.tracing.python import python_functions, python_source


def stage_of(program: Program) -> Stage:
    """A traced program as a stage; its parameters as they were traced."""
    prepare, step = python_functions(program)
    given = tuple(float(e.value) for e in program.tape.parameters.values())
    derived = prepare(given)[1]

    def compiled() -> Any:
        from mrdamper.tracing.compiled import compiled_step

        return compiled_step(program)

    lines, tape = python_source(program).count("\n"), program.tape
    memory, names = tuple(tape.starts.values()), tuple(tape.parameters)
    return Stage(step, given, tuple(derived), memory, compiled, lines, prepare, len(tape.inputs), names)


@lru_cache(maxsize=32)  # a loop is made again for every law
def damper_stage(damper: Damper, free: bool = False) -> Stage:
    """A damper as a stage, its own numbers free to change if asked for; raises as `stream`."""
    return stage_of(trace(damper, free))


@lru_cache(maxsize=32)
def contact_stage(link: Link) -> Stage:
    """A bump stop, or the part of a tyre's force that is missing while it is in the air."""
    step = _stop if link.role == "stop" else _tyre
    return Stage(step, (link.stiffness, link.damping, link.gap), (), (), lambda: _machine(step))


def _machine(step: Callable[..., Any]) -> Any:
    from numba import njit

    return njit(error_model="numpy")(step)


def _stop(p: Any, d: Any, memory: Any, u: Any) -> Any:
    stiffness, damping, gap = p
    x, v, _, _, _ = u
    if x > gap:
        return 0, (max(stiffness * (x - gap) + damping * v, 0.0), 1.0), memory
    if x < -gap:
        return 0, (min(stiffness * (x + gap) + damping * v, 0.0), 1.0), memory
    return 0, (0.0, 0.0), memory


def _tyre(p: Any, d: Any, memory: Any, u: Any) -> Any:
    """The structure holds the tyre as a spring that also pulls; what it would pull is given back here."""
    stiffness, damping, gap = p
    x, v, _, _, _ = u
    pull = stiffness * (x - gap) + damping * v
    return 0, (-pull if pull > 0 else 0.0, 1.0 if pull > 0 else 0.0), memory
