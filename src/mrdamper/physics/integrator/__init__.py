"""Error-controlled integration of a model's state along a sampled motion.

For models that are not rate independent and so have no closed form between reversals. The method is linearly implicit
and L-stable, so a time scale a thousand times shorter than a sample needs a few steps and causes no instability; the
error of every step is estimated and kept below the tolerance, else the result is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.wording import number
from mrdamper.errors import ExcitationError, ParameterError
from mrdamper.physics.integrator.streamed import Rate, integrate_step
from mrdamper.physics.motion.traced import TracedStep
from mrdamper.tracing import Tape, program, streamed
from mrdamper.tracing.compiled import RecordProgram

_RUNAWAY = 1e6  # state over its scale
_MAX_STEPS_PER_SAMPLE = 20_000  # between two samples of a record


@streamed(integrate_step)
def integrate(
    rate: Rate,
    parameters: Sequence[float],
    motion: tuple[Floats, Floats, Floats, Floats],
    start: Sequence[float],
    scale: Sequence[float],
    *,
    tolerance: float = 1e-5,
) -> Floats:
    """(N, S) state along a motion: (N,) time [s], displacement [m], velocity [m/s], current [A]; from a start (S,).

    `rate`, a function (x, v, current, state, parameters, out), writes d(state)/dt into `out`, with operators and
    NumPy's functions. It runs once on symbols (`mrdamper.tracing`), and the program is compiled. Between samples the
    displacement is the cubic with the given values and slopes, the velocity its derivative, and the current straight.

    `scale` (S,) is the typical size of each state: errors are measured against the larger of it and the state, and the
    error allowed per step is the relative `tolerance`. Raises `ExcitationError` if time does not increase, and
    `ParameterError` if the tolerance cannot be kept: the model is too stiff, or it diverges.

    Rodas3: Sandu et al. (1997), "Benchmarking stiff ODE solvers for atmospheric chemistry problems II: Rosenbrock
    solvers", Atmospheric Environment 31, 3459–3472; coefficients recalled, order and stability tested here.
    """
    time, x, v, current = (np.asarray(channel, dtype=float) for channel in motion)
    if not np.all(np.diff(time) > 0):
        raise ExcitationError("time does not increase", remedy="sort the samples and drop the repeated ones")
    given = (*map(float, parameters), *map(float, scale), float(tolerance))
    record, derived = _record(rate, len(start), given)
    steps = np.concatenate([[1.0], np.diff(time)])
    begin = {f"state{i}": float(value) for i, value in enumerate(start)}
    memory = [begin.get(name, value) for name, value in record.program.tape.starts.items()]
    states_along = record.along(given, derived, memory, (x, v, current, steps))
    out = states_along.outputs.T
    limit = _RUNAWAY * np.asarray(scale, dtype=float)
    lost = np.flatnonzero(
        ~(np.abs(out[: states_along.failed if states_along.failed >= 0 else None]) <= limit).all(axis=1)
    )
    if lost.size or states_along.failed >= 0:
        at = int(lost[0]) if lost.size else states_along.failed
        why = "runs away" if lost.size else f"needs more than {_MAX_STEPS_PER_SAMPLE:_} steps".replace("_", " ")
        raise ParameterError(
            f"the model's state {why} between samples {at - 1} and {at} ({number(time[at])} s)",
            remedy="its parameters are too stiff or unstable; bring them nearer to the data's scales",
        )
    return out


def _record(rate: Rate, states: int, given: tuple[float, ...]) -> tuple[RecordProgram, tuple[float, ...]]:
    """Return the program of a rate for some parameters, and the constants derived from them."""
    programs = _programs(rate, states, len(given))
    for record in programs:
        if (derived := record.prepare(given)) is not None:
            return record, derived
    programs.append(RecordProgram(_traced(rate, states, given)))
    derived = programs[-1].prepare(given)
    if derived is None:
        raise ParameterError(f"parameters {given}", remedy="give finite numbers")
    return programs[-1], derived


@lru_cache(maxsize=64)
def _programs(rate: Rate, states: int, given: int) -> list[RecordProgram]:
    """Return the cached programs of a rate, one for each result of its conditions on parameters."""
    return []


def _traced(rate: Rate, states: int, given: tuple[float, ...]) -> Any:
    """Trace the program of one sample; its parameters are those of the rate, the scale and the tolerance."""
    tape = Tape()
    x, v, current, dt = (tape.input(name) for name in ("displacement", "velocity", "current", "dt"))
    numbers = [tape.parameter(f"p{i}", value) for i, value in enumerate(given)]
    own = len(given) - states - 1
    out = integrate_step(
        tape,
        rate,
        numbers[:own],
        (TracedStep(tape, dt), x, v, current),
        (0.0,) * states,
        numbers[own:-1],
        tolerance=numbers[-1],
        most=_MAX_STEPS_PER_SAMPLE,
    )
    return program(tape, {f"state{i}": value for i, value in enumerate(out)})
