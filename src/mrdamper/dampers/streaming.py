"""Evaluation of a damper sample by sample, for closed loops.

`stepper(damper)` traces the damper's array code to a program for one sample and runs it, in the interpreter or
compiled. The same program is exported as C.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mrdamper.dampers.bands import PortableBand, portable_band
from mrdamper.dampers.base import Damper
from mrdamper.dampers.causal import force_of, steps_of, trace
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.joint import damper_of
from mrdamper.data import Floats
from mrdamper.errors import ExcitationError, ParameterError, UnknownNameError, numbers, require, series
from mrdamper.models import Model
from mrdamper.tracing import Program, Tape, program
from mrdamper.tracing.compiled import RecordProgram
from mrdamper.tracing.python import python_functions, python_source

FLAGS = ("current", "amplitude", "velocity", "frequency")  # bit 0, 1, 2, 3


@dataclass(frozen=True, eq=False)
class Stream:
    """A damper as programs for one sample."""

    title: str  # title for the reader
    # from displacement [m], velocity [m/s], acceleration [m/s²], current [A] and the step of time [s] to force [N]
    # and extrapolation flags (bits in the order of `FLAGS`)
    step: Program
    drives: Mapping[str, Program]  # motion from "displacement" or "velocity" alone
    envelope: Envelope | None  # tested ranges
    model: Model | None  # the model whose parameters can be set; None where they are functions
    damper: Damper  # traced damper

    @cached_property
    def band(self) -> PortableBand | None:
        """Prediction interval of the force in three parameters; None where there is none."""
        return portable_band(self.damper)


def stream(damper: Damper | Model) -> Stream:
    """Trace a damper, or a model, into programs for one sample.

    A model and a joint damper keep their parameters free to be set. Dampers whose parameters follow the condition
    take frequency and amplitude from the motion so far (`mrdamper.dampers.causal`). Raises `ParameterError` if the
    damper is of a kind that has no form for one sample.
    """
    damper = damper_of(damper)
    drives = {"displacement": _from_displacement(), "velocity": _from_velocity()}
    tested = damper.envelope if damper.envelope.tested else None
    return Stream(damper.title, trace(damper), drives, tested, damper.one_model, damper)


def _from_displacement() -> Program:
    """Velocity and acceleration as backward differences, zero until they are known."""
    tape = Tape()
    x, dt = tape.input("displacement"), tape.input("dt")
    count = tape.remember("count")
    tape.update(count, np.minimum(count + 1, 2.0))
    v = tape.select(count < 0.5, 0.0, (x - tape.previous(x, "displacement")) / dt)
    a = tape.select(count < 1.5, 0.0, (v - tape.previous(v, "velocity")) / dt)
    return program(tape, {"displacement": x, "velocity": v, "acceleration": a})


def _from_velocity() -> Program:
    """Displacement by the trapezoidal rule from zero, acceleration as a backward difference."""
    tape = Tape()
    v, dt = tape.input("velocity"), tape.input("dt")
    last = tape.previous(v, "velocity")
    held = tape.remember("displacement")
    x = tape.select(tape.first, 0.0, held + 0.5 * dt * (v + last))
    tape.update(held, x)
    return program(tape, {"displacement": x, "velocity": v, "acceleration": (v - last) / dt})


class Stepper:
    """A damper that is evaluated sample by sample.

    Made by `stepper`. `step` takes the displacement, `step_velocity` the velocity, `step_motion` the whole motion; all
    return the force [N]. A sample that cannot be used raises an error without changing the state.
    """

    def __init__(self, stream: Stream):
        self.stream = stream
        self._prepare, self._advance = python_functions(stream.step)
        self._drives = {name: python_functions(drive)[1] for name, drive in stream.drives.items()}
        self._parameters = {name: float(e.value) for name, e in stream.step.tape.parameters.items()}
        self._given, self._derived = (), ()
        self.set_parameters()
        self.reset()

    def __repr__(self) -> str:
        return f"<{self.stream.title}, sample by sample>"

    def reset(self) -> None:
        """Return to the state at rest."""
        self._memory = tuple(self.stream.step.tape.starts.values())
        self._drive_memory = {name: tuple(d.tape.starts.values()) for name, d in self.stream.drives.items()}
        self._flags = 0

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters by name; empty where they are functions of the condition."""
        return dict(self._parameters)

    def set_parameters(self, **values: float) -> None:
        """Change parameters between two samples; the state is kept.

        Raises `UnknownNameError` if there is no parameter of that name, and `ParameterError` if a value is outside its
        bounds, or needs another program.
        """
        for name in values:
            if name not in self._parameters:
                raise UnknownNameError.of("parameter", name, self._parameters)
        wanted = {**self._parameters, **dict(zip(values, numbers(*values.values()), strict=True))}
        given = tuple(wanted.values())
        try:
            status, derived = self._prepare(given) if all(map(math.isfinite, given)) else (1, ())
        except (ValueError, ArithmeticError):
            status, derived = 1, ()
        if status:
            raise ParameterError(
                ", ".join(f"{name} = {value:g}" for name, value in (values or wanted).items()),
                where=self.stream.title,
                remedy="keep within the bounds and on the branch (n, symmetry) it was traced for, or trace again",
            )
        self._parameters, self._given, self._derived = wanted, given, derived

    @property
    def state(self) -> dict[str, float]:
        """The state by name: set it again to return to this sample."""
        names = dict(zip(self.stream.step.tape.memory, self._memory, strict=True))
        for drive, memory in self._drive_memory.items():
            names |= {f"{drive}.{n}": m for n, m in zip(self.stream.drives[drive].tape.memory, memory, strict=True)}
        return names

    @state.setter
    def state(self, values: Mapping[str, float]) -> None:
        require(values, Mapping, "a state", "set what `state` gave")
        present, changed = self.state, dict(zip(values, numbers(*values.values()), strict=True))
        if values.keys() != present.keys() or not all(map(math.isfinite, changed.values())):
            raise ParameterError(
                "a state of other names, or not finite", where=self.stream.title, remedy="set what `state` gave"
            )
        self._memory = tuple(changed[name] for name in self.stream.step.tape.memory)
        self._drive_memory = {
            drive: tuple(changed[f"{drive}.{name}"] for name in drive_program.tape.memory)
            for drive, drive_program in self.stream.drives.items()
        }

    @property
    def extrapolation(self) -> tuple[str, ...]:
        """Quantities of the last sample that lie outside the tested ranges."""
        return tuple(name for bit, name in enumerate(FLAGS) if self._flags >> bit & 1)

    def step(self, displacement: float, current: float, dt: float) -> float:
        """Force [N] at the next displacement [m] from mid-stroke, current [A], `dt` [s] later.

        Velocity and acceleration are backward differences: smooth a noisy displacement first,
        or use `step_motion`.
        """
        return self._driven("displacement", displacement, current, dt)

    def step_velocity(self, velocity: float, current: float, dt: float) -> float:
        """Force [N] at the next velocity [m/s]; the displacement is integrated from zero."""
        return self._driven("velocity", velocity, current, dt)

    def step_motion(
        self, displacement: float, velocity: float, acceleration: float, current: float, dt: float
    ) -> float:
        """Force [N] at the next sample of a given motion.

        Raises `ExcitationError` if a value is not finite, dt is not positive, or the model has no solution there.
        """
        inputs = numbers(displacement, velocity, acceleration, current, dt)
        self._check(inputs, inputs[-1])
        try:
            status, (force, flags), memory = self._advance(self._given, self._derived, self._memory, inputs)
        except (ValueError, ArithmeticError):
            status, force, flags, memory = 1, math.nan, 0.0, self._memory
        if status or not (math.isfinite(force) and all(map(math.isfinite, memory))):
            raise ExcitationError(
                f"no force at x = {inputs[0]:g} m, v = {inputs[1]:g} m/s, I = {inputs[3]:g} A, dt = {inputs[4]:g} s",
                where=self.stream.title,
                remedy="bring the sample nearer to the last one and into the tested ranges",
            )
        self._memory, self._flags = memory, int(flags)
        return force

    def _driven(self, drive: str, value: float, current: float, dt: float) -> float:
        given = numbers(value, dt, current)
        self._check(given, given[1])
        inputs = given[:2]
        _, (x, v, a), memory = self._drives[drive]((), (), self._drive_memory[drive], inputs)
        force = self.step_motion(x, v, a, current, dt)
        self._drive_memory[drive] = memory
        return force

    def _check(self, inputs: Sequence[float], dt: float) -> None:
        if not (all(map(math.isfinite, inputs)) and dt > 0):
            raise ExcitationError(
                f"sample {tuple(inputs)}, time step {dt:g} s",
                where=self.stream.title,
                remedy="give finite numbers and a positive time step",
            )

    def run(
        self, time: Floats, displacement: Floats, velocity: Floats, acceleration: Floats, current: Floats
    ) -> Floats:
        """Force [N] along a sampled motion, from the present state; compiled where there is a C compiler.

        Time, displacement, velocity, acceleration and current (N,) [s], [m], [m/s], [m/s²], [A].
        """
        t, *channels = series(
            time=time, displacement=displacement, velocity=velocity, acceleration=acceleration, current=current
        )
        along = self._record.along(self._given, self._derived, self._memory, (*channels, steps_of(t)))
        force = force_of(along, t, self.stream.title)
        self._memory, self._flags = along.memory, int(along.outputs[1, -1])
        return force

    @cached_property
    def _record(self) -> RecordProgram:
        return RecordProgram(self.stream.step)

    @property
    def source(self) -> str:
        """The program as Python."""
        return python_source(self.stream.step)


def stepper(damper: Damper | Model) -> Stepper:
    """Prepare a damper or model for evaluation sample by sample.

    Parameters
    ----------
    damper : Damper or Model

    Raises
    ------
    ParameterError
        If it has no form for one sample.

    Examples
    --------
    >>> from mrdamper import stepper
    >>> from mrdamper.models.bingham import Bingham
    >>> damper = stepper(Bingham(c=1000.0, fy=300.0))
    >>> [damper.step(displacement=x, current=0.0, dt=1e-3) for x in (0.0, 1e-4, 3e-4)]  # [m], [A], [s] to [N]
    [0.0, 400.0, 500.0]
    """
    return Stepper(stream(damper))
