"""Evaluation of a damper sample by sample: its array code traced on symbols.

The traced program is streamed, exported as C and FMU, and predicts other motions than sines with parameters that depend
on frequency and amplitude: one definition, which uses past samples only.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from mrdamper.dampers.envelope import SLACK
from mrdamper.data import Condition, Floats
from mrdamper.errors import ExcitationError, ParameterError
from mrdamper.physics.motion.traced import TracedMotion, TracedStep
from mrdamper.tracing import Program, Tape, program
from mrdamper.tracing.compiled.record import Along, RecordProgram

if TYPE_CHECKING:
    from mrdamper.dampers.protocols import DamperLike as Damper
    from mrdamper.physics.motion.excitation import Excitation

_STEADY = 1e-18  # mean square displacement below which the damper is at rest [m²]


def free_name(number: str) -> str:
    """Return the name of a parameter of the damper in a program that keeps it free."""
    return number.replace(".", "_")


def trace(damper: Damper, free: bool = False) -> Program:
    """Return the program of one sample; with `free`, all parameters of the damper can be set.

    From displacement [m], velocity [m/s], acceleration [m/s²], current [A] and the step of time [s] to force [N] and a
    flag of 8 where the frequency was not tested. One model for all conditions keeps its parameters free to be set.
    Where parameters depend on the condition, frequency and amplitude follow from the past motion, averaged over about a
    cycle of the slowest tested frequency, within the tested frequencies and `Damper.followed_amplitudes`. Raises
    `ParameterError` if the damper is of a kind that has no form for one sample.
    """
    if not damper.streams:
        raise ParameterError(
            "no form for one sample", where=damper.title, remedy="stream a damper with a model behind it"
        )
    tape = Tape()
    currents: tuple[float, ...] = damper.envelope.current_A
    middle = float(np.mean(currents)) if damper.envelope.tested else 0.0
    x, v, a = (tape.input(name) for name in ("displacement", "velocity", "acceleration"))
    asked, dt = tape.input("current", middle), tape.input("dt")
    moved = x - tape.previous(x, "displacement")
    field_current = damper.coil.step(tape, dt, abs(asked)) if damper.coil else abs(asked)
    motion = TracedMotion(
        tape, x, v, a, tape.assume(field_current, middle), TracedStep(tape, dt), TracedStep(tape, moved)
    )
    outside: Any = 0.0
    if damper.one_model is not None:
        one = damper.one_model
        model = type(one)(**{i.name: tape.parameter(i.name, getattr(one, i.name)) for i in one.parameters()})
    else:
        if free:
            own: Any = {name: tape.parameter(free_name(name), n.value) for name, n in damper.fitted_parameters.items()}
            damper = damper.with_parameters(own)
        running, outside = _running_condition(damper, motion)
        model = damper.model_at(running)
    force = model.force(motion, model.state(motion))  # type: ignore[arg-type]
    return program(tape, {"force": force, "flags": _flags(motion, abs(asked), damper) + outside})


def _running_condition(damper: Damper, motion: TracedMotion) -> tuple[Condition, Any]:
    """Return the equivalent sine of the past motion, and whether its frequency was not tested.

    ω² is the mean square velocity over the mean square displacement, A² twice the latter; the means have two lags of
    one slowest period each, and are corrected for their start.
    """
    tape, envelope = motion.tape, damper.envelope
    low, high = envelope.frequency_Hz
    keep = np.exp(-low * motion.time.step)

    def faded(value: Any, name: str) -> Any:
        for stage in ("once", "twice"):
            held = tape.remember(f"{name}_{stage}")
            value = keep * held + (1 - keep) * value
            tape.update(held, value)
        return value

    weight = faded(1.0, "weight")
    x2 = faded(motion.displacement**2, "displacement_squared") / weight
    v2 = faded(motion.velocity**2, "velocity_squared") / weight
    moving = x2 > _STEADY
    frequency = tape.select(moving, np.sqrt(v2 / x2) / (2 * math.pi), math.sqrt(low * high))
    amplitude = tape.select(moving, np.sqrt(2 * x2), math.sqrt(math.prod(envelope.amplitude_m)))
    flag = tape.select((frequency < low * (1 - SLACK)) | (frequency > high * (1 + SLACK)), 8.0, 0.0)
    f = tape.assume(np.clip(frequency, low, high), math.sqrt(low * high))
    A = tape.assume(np.clip(amplitude, *damper.followed_amplitudes), math.sqrt(math.prod(envelope.amplitude_m)))
    return Condition(motion.current, f, A), flag


def _flags(motion: TracedMotion, current: Any, damper: Damper) -> Any:
    """Extrapolation in current, amplitude and velocity as bits 0 to 2."""
    envelope = damper.envelope
    if not envelope.tested:
        return 0.0
    tape, (low, high) = motion.tape, envelope.current_A
    outside = (
        (current < low - SLACK * high) | (current > high * (1 + SLACK)),
        abs(motion.displacement) > envelope.amplitude_m[1] * (1 + SLACK),
        abs(motion.velocity) > envelope.peak_velocity_m_s[1] * (1 + SLACK),
    )
    total: Any = 0.0
    for bit, question in enumerate(outside):
        total = total + tape.select(question, float(2**bit), 0.0)
    return total


def causal_force(damper: Damper, motion: Excitation) -> Floats:
    """(N,) force [N] along any motion, sample by sample, as a stream of the damper gives it.

    Raises `ExcitationError` if there is no force at a sample.
    """
    record = RecordProgram(trace(damper))
    given = tuple(float(e.value) for e in record.program.tape.parameters.values())
    derived = record.prepare(given) or ()
    channels = (motion.displacement, motion.velocity, motion.acceleration, motion.current, steps_of(motion.time))
    return force_of(record.along(given, derived, record.starts, channels), motion.time, damper.title)


def force_of(along: Along, time: Floats, title: str) -> Floats:
    """(N,) force [N] of a program along a record of times [s]; raises `ExcitationError` if a sample has none."""
    force = along.outputs[0]
    without = [along.failed] if along.failed >= 0 else np.flatnonzero(~np.isfinite(force))
    if len(without):
        raise ExcitationError(
            f"no force at {time[without[0]]:.6g} s", where=title, remedy="bring the motion nearer to the tests"
        )
    return force


def steps_of(time: Floats) -> Floats:
    """(N,) steps [s] to each sample, the first as long as the second.

    Raises `ExcitationError` unless time increases, over two samples at least.
    """
    steps = np.diff(time, prepend=2 * time[0] - time[1]) if time.size > 1 else np.zeros(1)
    if not np.all(steps > 0):
        raise ExcitationError("time does not increase", remedy="sort the samples; two are the fewest")
    return steps
