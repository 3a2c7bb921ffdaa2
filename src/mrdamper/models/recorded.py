"""States of models along whole records, compiled from the models' own array code."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, cast

import numpy as np

from mrdamper.data import Floats
from mrdamper.physics.motion import Excitation
from mrdamper.physics.motion.path import memoize_per_path
from mrdamper.physics.motion.traced import TracedMotion, TracedStep
from mrdamper.tracing import Tape, program
from mrdamper.tracing.compiled import RecordProgram

_CHANNELS = ("displacement", "velocity", "acceleration", "current", "dt", "turn", "turn_back", "move")
S = TypeVar("S", bound=Callable[..., Floats])
_MIN_COMPILED_SAMPLES = 2_000  # samples of a motion, from which compiled code is used; never the history of the process


def recorded(state: S) -> S:
    """Have a model's `state` follow records compiled, where there is a compiler.

    The array code runs once on symbols; without a compiler, and for few samples, it runs as it is written. Both
    agree to rounding. For models whose state is one number a sample.
    """
    records_of: dict[type, list[RecordProgram]] = {}

    @wraps(state)
    def along(self: Any, motion: Excitation) -> Floats:
        if not isinstance(motion, Excitation):
            return state(self, motion)
        values = self.values()
        if len(motion) < _MIN_COMPILED_SAMPLES or not all(isinstance(value, float | int) for value in values.values()):
            return state(self, motion)
        given = tuple(map(float, values.values()))
        records = records_of.setdefault(type(self), [])
        for record in records:
            if (derived := record.prepare(given)) is not None:
                break
        else:
            record = RecordProgram(_traced(type(self), values, state))
            derived = record.prepare(given)
            records.append(record)
        states = derived is not None and record.compiled_along(given, derived, record.starts, channels(motion))
        return states.outputs[0] if states and states.failed < 0 else state(self, motion)

    return cast(S, along)


def channels(motion: Excitation) -> tuple[Floats, ...]:
    """Name the inputs of a program that follows a motion: its channels, the time steps and the moves of its path."""
    steps = _steps(motion.time)
    arrays = (motion.displacement, motion.velocity, motion.acceleration, motion.current)
    return (*arrays, steps, *motion.path.moves)


@memoize_per_path
def _steps(time: Floats) -> Floats:
    """(N,) steps of time to what its rounding leaves: steps that differ by it are one, and what hangs on it is kept."""
    if time.size < 2:
        return np.ones(1)
    steps = np.diff(time, prepend=2 * time[0] - time[1])
    rounding = 4 * float(np.spacing(np.max(np.abs(time))))
    return np.maximum(rounding * np.round(steps / rounding), rounding)


def _traced(model: type, values: dict[str, float], state: Callable[[Any, Any], Any]) -> Any:
    """Trace the program of a model's state at one sample, its parameters free."""
    tape = Tape()
    x, v, a, current, dt, turn, back, move = (tape.input(name) for name in _CHANNELS)
    motion = TracedMotion(tape, x, v, a, current, TracedStep(tape, dt), TracedStep(tape, move, (turn, back)))
    free = model(**{name: tape.parameter(name, value) for name, value in values.items()})
    return program(tape, {"state": state(free, motion)})
