"""Inverse model: the current for a required force, from the program of the damper.

The inverse contains the memory of the damper. At each sample it evaluates the damper at the lowest and the highest
current (the reachable interval), searches between them, and compensates for the lag of the coil. Where the force hardly
depends on the current, as at a reversal, it keeps the current, because the result of a search would jump.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.causal import steps_of
from mrdamper.dampers.coil import Coil
from mrdamper.dampers.envelope import SLACK
from mrdamper.dampers.streaming import stream
from mrdamper.data import Floats
from mrdamper.data.wording import number
from mrdamper.errors import ParameterError, numbers, series, validate_arguments
from mrdamper.tracing import Program, Tape, program
from mrdamper.tracing.graft import ProgramCopy
from mrdamper.tracing.python import python_functions

_ROUNDS = 2  # evaluations of the search after the two ends
_BLUNT = 0.01  # of the widest reachable interval: below, the current is kept
_FIELD_TIME_RATIO = 0.1  # share of the coil's lag in which the field reaches its command
_TURNS_BACK = 5e-3  # share of the interval by which a force may decrease with current
_GRID, _MOTION = 6, 960  # numbers of currents, and of samples of the motion on which they are tried
_MAX_FORCE_N = 1e150  # largest force whose square is finite [N]


@dataclass(frozen=True)
class Demand:
    """Current, force and reachable interval of an inverse; expressions on a tape, or numbers.

    The interval holds the forces that currents give at this motion once the coil has followed; a wanted force outside
    it is answered by its nearer end, and `force` is what the present field gives.
    """

    current: Any  # to command [A]
    force: Any  # at the present field [N]
    lowest: Any  # end of the reachable interval [N]
    highest: Any  # its other end [N]


def check_monotone(damper: Damper, highest: float | None = None) -> float:
    """Widest reachable interval [N] along a tested sine; raises `ParameterError` where the force falls with current."""
    if highest is not None and not highest > 0:
        raise ParameterError(
            f"highest is {highest:g} A", where=damper.title, remedy="give a current above 0 A", code="E_ARGUMENT"
        )
    low, high = 0.0, damper.envelope.current_A[1] if highest is None else highest
    if not high > low:
        raise ParameterError(
            "no range of currents", where=damper.title, remedy="tests at several currents", code="E_NOT_MONOTONE"
        )
    grid = np.linspace(low, high, _GRID)
    try:
        table = _forces(damper, grid)
    except ArithmeticError as error:
        raise ParameterError(f"no force at {high:g} A", where=damper.title, remedy="stay within the tests") from error
    width = np.ptp(table, axis=1)
    if not 0 < width.max() < _MAX_FORCE_N:
        raise ParameterError(
            "the force does not follow the current, or runs away", where=damper.title,
            remedy="identify it from tests at several currents", code="E_NOT_MONOTONE",
        )  # fmt: skip
    wide = width > 0.2 * width.max()
    rises = np.where(table[wide, -1] < table[wide, 0], -1.0, 1.0)  # also if the force increases again
    back = np.diff(table[wide], axis=1) * -rises[:, None] / width[wide][:, None]
    if back.max() > _TURNS_BACK:
        at = grid[back.max(axis=0).argmax()]
        raise ParameterError(
            f"the force falls back by {number(100 * back.max(), 2)} % of its range above {at:.3g} A",
            where=damper.title,
            remedy="cap the current there, or identify with forms that rise with current",
            code="E_NOT_MONOTONE",
        )
    return float(width.max())


def _forces(damper: Damper, grid: Floats) -> Floats:
    """Calculate (samples, currents) forces [N] along the second half of a tested sine."""
    stepping = stream(replace(damper, coil=None))
    prepare, step = python_functions(stepping.step)
    given = stepping.step.given
    derived, memory = prepare(given)[1], tuple(stepping.step.tape.starts.values())
    amplitude = damper.envelope.amplitude_m[1]
    omega = min(2 * math.pi * damper.envelope.frequency_Hz[1], damper.envelope.peak_velocity_m_s[1] / amplitude)
    forces, dt = [], 2 * math.pi / omega / _MOTION * 2
    for phase in omega * dt * np.arange(_MOTION):
        x, v = amplitude * math.sin(phase), amplitude * omega * math.cos(phase)
        sample = (x, v, -(omega**2) * x)
        forces.append([step(given, derived, memory, (*sample, float(I), dt))[1][0] for I in grid])
        memory = step(given, derived, memory, (*sample, float(grid[_GRID // 2]), dt))[2]
    return np.array(forces[_MOTION // 2 :])


def invert_on(
    tape: Tape, damper: Damper, prefix: str, motion: dict[str, Any], wanted: Any, width: float, highest: float
) -> Demand:
    """Write the inverse of a damper on a tape.

    The names of its memory begin with `prefix`; the motion contains displacement, velocity, acceleration and dt; the
    required force and the width from `check_monotone` are in N, the highest current in A.
    """
    bare = stream(replace(damper, coil=None)).step
    copy = ProgramCopy(bare, tape, prefix, "current", **motion)
    last = tape.remember(f"{prefix}wanted_current")
    coil = damper.coil or Coil(0.0, 0.0)
    ends = [(0.0, copy.answer(0.0)["force"]), (highest, copy.answer(highest)["force"])]
    lowest, most = np.minimum(ends[0][1], ends[1][1]), np.maximum(ends[0][1], ends[1][1])
    target = np.minimum(np.maximum(wanted, lowest), most)
    current = _searched(tape, copy, ends, target)
    span = most - lowest
    trust = span * span / (span * span + (_BLUNT * width) ** 2)
    steady = last + trust * (current - last)
    tape.update(last, steady)
    if coil.rise_s <= 0 and coil.fall_s <= 0:
        return Demand(steady, copy.settle(steady)["force"], lowest, most)
    field = tape.remember(f"{prefix}field")
    lag = tape.select(steady > field, coil.rise_s, coil.fall_s)
    before = tape.select(tape.first, steady, field)  # a coil starts in the steady state of its first command
    ahead = steady + (steady - before) * lag / np.maximum(_FIELD_TIME_RATIO * lag, 2 * motion["dt"])
    command = np.minimum(np.maximum(ahead, 0.0), highest)
    field_current = coil.step(tape, motion["dt"], command)
    tape.update(field, field_current)
    return Demand(command, copy.settle(field_current)["force"], lowest, most)


def _searched(tape: Tape, copy: ProgramCopy, ends: list[tuple[Any, Any]], target: Any) -> Any:
    """Regula falsi between the ends; one end's weight halved when it stays (Illinois)."""
    (i0, f0), (i1, f1) = ends
    g0, g1 = f0 - target, f1 - target
    current: Any = 0.0
    for round_ in range(_ROUNDS + 1):
        across = g1 - g0
        flat = abs(across) <= 1e-300
        current = i0 - g0 * (i1 - i0) / tape.select(flat, 1.0, across)
        current = tape.select(flat, i0, np.minimum(np.maximum(current, np.minimum(i0, i1)), np.maximum(i0, i1)))
        if round_ == _ROUNDS:
            break
        g = copy.answer(current)["force"] - target
        changed = g * g1 < 0
        i0, g0 = tape.select(changed, i1, i0), tape.select(changed, g1, 0.5 * g0)
        i1, g1 = current, g
    return current


class Inverse:
    """Inverse model of a damper, sample by sample; made by `invert`.

    Its program computes current [A], force [N] and the reachable interval [N] from displacement [m], velocity [m/s],
    acceleration [m/s²], required force [N] and dt [s]. `extrapolation` lists what lies outside the tested ranges, as
    that of a prediction; `scope` states the range of the currents and those of the tests.
    """

    units: ClassVar[Mapping[str, str]] = {
        **{"displacement": "m", "velocity": "m/s", "acceleration": "m/s2", "wanted": "N"},
        **{"current": "A", "force": "N", "lowest": "N", "highest": "N"},
    }

    def __init__(self, program: Program, title: str, scope: str = "", extrapolation: tuple[str, ...] = ()):
        self.program, self.title, self.scope, self.extrapolation = program, title, scope, extrapolation
        prepare, self._advance = python_functions(program)
        self._derived = prepare(())[1]
        self.reset()

    def __repr__(self) -> str:
        return f"<{self.title}, {self.scope}>"

    def reset(self) -> None:
        """Return to the state at rest."""
        self._memory = tuple(self.program.tape.starts.values())

    def step(self, displacement: float, velocity: float, acceleration: float, wanted: float, dt: float) -> Demand:
        """Calculate the current for a required force at the next sample of a motion.

        Raises `ParameterError` if a value is not finite, dt is not positive, or the damper has no solution there.
        """
        sample = numbers(displacement, velocity, acceleration, wanted, dt)
        if not (all(map(math.isfinite, sample)) and sample[-1] > 0):
            raise ParameterError(f"sample {sample}", where=self.title, remedy="finite numbers, a positive time step")
        try:
            status, outputs, memory = self._advance((), self._derived, self._memory, sample)
        except (ValueError, ArithmeticError):
            status, outputs, memory = 1, (), self._memory
        if status or not all(map(math.isfinite, outputs)):
            raise ParameterError(f"no force at {sample}", where=self.title, remedy="come nearer to the last sample")
        self._memory = memory
        return Demand(*outputs)

    def along(
        self, time: Floats, displacement: Floats, velocity: Floats, acceleration: Floats, wanted: Floats
    ) -> tuple[Floats, Floats, Floats, Floats]:
        """Calculate current [A], force and reachable interval [N] (N,) along a motion, from the present state."""
        named = {"displacement": displacement, "velocity": velocity, "acceleration": acceleration, "wanted": wanted}
        t, *motion = series(time=time, **named)
        rows = [self.step(*sample) for sample in zip(*(c.tolist() for c in (*motion, steps_of(t))), strict=True)]
        current, force, lowest, highest = np.array([list(vars(row).values()) for row in rows]).T
        return current, force, lowest, highest


@validate_arguments()
def invert(damper: Damper, highest: float | None = None) -> Inverse:
    """Prepare the calculation of the current for a required force.

    Parameters
    ----------
    damper : Damper
        With its coil, if it has one: its lag is compensated.
    highest : float, optional
        Largest current [A]. Default: the largest tested; beyond it, the inverse has "current" in its `extrapolation`.

    Raises
    ------
    ParameterError
        E_NOT_MONOTONE if more current somewhere gives less force, E_ARGUMENT if `highest` is not above zero, or as
        `stream`.

    Examples
    --------
    >>> from mrdamper import invert, load_system
    >>> damper = load_system("dyke1996").dampers["mr"]
    >>> inverse = invert(damper)
    >>> asked = [inverse.step(1e-5 * i, 0.01, 0.0, 200.0, 1e-3) for i in range(200)]  # 200 N at 10 mm/s
    >>> 0.0 < asked[-1].current < 0.75  # [A]
    True
    """
    width = check_monotone(damper, highest)
    tape = Tape()
    names = ("displacement", "velocity", "acceleration", "wanted", "dt")
    inputs = {name: tape.input(name) for name in names}
    wanted = inputs.pop("wanted")
    most = damper.envelope.current_A[1] if highest is None else highest
    demand = invert_on(tape, damper, "", inputs, wanted, width, most)
    scope = f"currents 0 to {number(most, 3)} A"
    outside = ("current",) if most > damper.envelope.current_A[1] * (1 + SLACK) else ()
    if damper.envelope.tested:
        scope += f"; tested {', '.join(f'{name} {span}' for name, span in damper.envelope.ranges(' to ').items())}"
    scope += "; outside the tested range in current" if outside else ""
    return Inverse(program(tape, vars(demand)), f"inverse of {damper.title}", scope, outside)
