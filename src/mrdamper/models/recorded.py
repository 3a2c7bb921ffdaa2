"""States of models along whole records, and tangents of their force, compiled from the models' own array code."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial, wraps
from typing import Any, TypeVar, cast
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from mrdamper.data import Floats
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.path import memoize_per_path
from mrdamper.physics.motion.traced import TracedMotion, TracedStep
from mrdamper.tracing import Tape, TraceError, program
from mrdamper.tracing.compiled.record import Channels, RecordProgram
from mrdamper.tracing.program import postorder
from mrdamper.tracing.tangent import with_tangents

_MOVES = ("turn", "turn_back", "move")
CHANNELS = ("displacement", "velocity", "acceleration", "current", "dt", *_MOVES)
S = TypeVar("S", bound=Callable[..., Floats])
_MIN_STROKE_SAMPLES = 200  # of a stroke, in the mean, from which array code computes it faster
_MIN_COMPILED_SAMPLES = 2_000  # samples of a motion, from which compiled code is used, independent of earlier calls


def recorded(state: S) -> S:
    """Compute a model's `state` by compiled code, where there is a compiler.

    The array code runs once on symbols; without a compiler, and for few samples, it runs unchanged. Both agree to
    rounding. For models whose state is one number per sample.
    """

    @wraps(state)
    def along(self: Any, motion: Excitation | TracedMotion) -> Floats:
        if not isinstance(motion, Excitation) or _has_long_strokes(self, motion):
            return state(self, motion)
        outputs = _along(self, motion, None, lambda free, traced, tape: {"state": state(free, traced)})
        return state(self, motion) if outputs is None else outputs[0]

    along.response = response  # type: ignore[attr-defined]  # `simulate` asks for it
    return cast(S, along)


def response(model: Any, motion: Excitation) -> tuple[Floats, Floats]:
    """(N,) force and state of a model along a motion, in one compiled pass where there is a compiler."""
    if _has_long_strokes(model, motion):
        return _response(model, motion)
    names = ("force", "state")
    both = _along(model, motion, names, lambda free, traced, _: dict(zip(names, _response(free, traced), strict=True)))
    return _response(model, motion) if both is None else (both[0], both[1])


def _has_long_strokes(model: Any, motion: Excitation) -> bool:
    """Tell if the array code is faster: it computes few strokes at once where the state is one curve along each."""
    return model.shape is not None and len(motion) > _MIN_STROKE_SAMPLES * len(motion.path.lengths)


def _response(model: Any, motion: Any) -> tuple[Any, Any]:
    state = model.state(motion)
    return model.force(motion, state), state


def force_tangents(
    model: Any, motion: Excitation, names: Sequence[str], picked: NDArray[np.intp] | None = None
) -> Floats | None:
    """(1 + K, N) force and its derivatives by K parameters along a motion, memory included, in one compiled pass.

    Of all samples, or of those at some ascending indices. None where there is no compiler, the motion is short, or
    the model has no derivative of this kind.
    """
    return _along(
        model,
        motion,
        tuple(names),
        lambda free, traced, tape: with_tangents(tape, _response(free, traced)[0], names),
        picked,
    )


_PROGRAMS: dict[tuple[object, ...], list[RecordProgram]] = {}
# Channels by the names of the inputs of programs: a search runs programs along one motion hundreds of times.
_READ: WeakKeyDictionary[Excitation, dict[tuple[str, ...], Channels]] = WeakKeyDictionary()


def _along(
    model: Any,
    motion: Excitation,
    names: tuple[str, ...] | None,
    outputs: Callable[[Any, Any, Tape], Mapping[str, Any]],
    picked: NDArray[np.intp] | None = None,
) -> Floats | None:
    """(K, N) outputs of a program of the model along a motion."""
    kind: Any = model.__class__
    values = model.values()
    short = len(motion) < _MIN_COMPILED_SAMPLES and not kind.integrated
    if short or not all(isinstance(value, (float, int)) for value in values.values()):
        return None

    def traced(tape: Tape, free: Mapping[str, Any], inputs: Sequence[Any]) -> Mapping[str, Any]:
        return outputs(kind(**free), traced_motion(tape, inputs), tape)

    read = _READ.setdefault(motion, {})
    return compiled_outputs((kind, names), values, traced, CHANNELS, read, partial(channel, motion), picked)


def compiled_outputs(
    key: tuple[type, tuple[str, ...] | None],
    values: Mapping[str, float],
    traced: Callable[[Tape, Mapping[str, Any], Sequence[Any]], Mapping[str, Any]],
    inputs: Sequence[str],
    read: dict[tuple[str, ...], Channels],
    channel: Callable[[str], Floats],
    picked: NDArray[np.intp] | None = None,
    begins: NDArray[np.intp] | None = None,
) -> Floats | None:
    """(K, N) outputs of a compiled program along a record, or None: no compiler, derivative or solution.

    `key` is that of the cached programs: traced model type, and parameters of the tangents. `traced` writes the outputs
    at one sample on a tape, from parameters, whose values are `values`, and inputs. `channel` returns the (N,) array of
    an input; `read` caches those that programs use. Outputs are those at the samples `picked`, and the memory is reset
    at `begins`.
    """
    given = tuple(map(float, values.values()))
    # Values are given by position: another order is another program.
    programs = _PROGRAMS.setdefault((*key, *values), [])
    for record in programs:
        if (derived := record.prepare(given)) is not None:
            break
    else:
        tape = Tape()
        symbols = [tape.input(name) for name in inputs]
        free = {name: tape.parameter(name, value) for name, value in values.items()}
        try:
            record = RecordProgram(program(tape, _without_unread(tape, traced(tape, free, symbols))))
        except TraceError:
            if key[1] is None:
                raise
            return None
        derived = record.prepare(given)
        programs.append(record)
    if (used := tuple(record.program.tape.inputs)) not in read:
        read[used] = Channels.of(map(channel, used))
    result = derived is not None and record.compiled_along(given, derived, record.starts, read[used], picked, begins)
    return result.outputs if result and result.failed < 0 else None


def _without_unread(tape: Tape, outputs: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the outputs, and remove unused inputs from the tape; the first stays and gives the length."""
    questions = [question for question, _ in tape.guards]
    read = {id(node) for node in postorder([*outputs.values(), *tape.updates.values(), *questions])}
    for place, (name, symbol) in enumerate([*tape.inputs.items()]):
        if place and id(symbol) not in read:
            del tape.inputs[name]
    return outputs


def channel(motion: Excitation, name: str) -> Floats:
    """Return an input of a program that follows a motion: a channel, the time steps, or the moves of its path."""
    if name == "dt":
        return _steps(motion.time)
    return motion.path.moves[_MOVES.index(name)] if name in _MOVES else getattr(motion, name)


@memoize_per_path
def _steps(time: Floats) -> Floats:
    """(N,) time steps, equal where they differ by rounding only, so that results of one step are cached."""
    if time.size < 2:
        return np.ones(1)
    steps = np.diff(time, prepend=2 * time[0] - time[1])
    rounding = 4 * float(np.spacing(np.max(np.abs(time))))
    return np.maximum(rounding * np.round(steps / rounding), rounding)


def traced_motion(tape: Tape, inputs: Sequence[Any]) -> TracedMotion:
    """Return the motion at one sample from the symbols of its channels."""
    x, v, a, current, dt, turn, back, move = inputs
    return TracedMotion(tape, x, v, a, current, TracedStep(tape, dt), TracedStep(tape, move, (turn, back)))
