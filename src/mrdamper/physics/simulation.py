"""The force of a model for a motion, and its steady loop."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Protocol, runtime_checkable

import numpy as np

from mrdamper.data import Condition, Floats
from mrdamper.data.parameters import ParameterInfo
from mrdamper.errors import ExcitationError, require
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.made import sine

_CLOSURE = 1e-9  # relative gap at which a loop counts as closed
_MOST_CYCLES = 512
_CREEP = 1e-3  # change of the force after the most cycles, over its range


@runtime_checkable
class ForceLaw(Protocol):
    """Protocol of an object with the force of a `Model`."""

    def parameters(self) -> tuple[ParameterInfo, ...]:
        """Describe each parameter."""
        ...

    def values(self) -> dict[str, float]:
        """Parameter values by name."""
        ...

    def state(self, motion: Excitation) -> Floats:
        """Calculate the internal state along a motion."""
        ...

    def force(self, motion: Excitation, state: Floats) -> Floats:
        """Force [N] along a motion, given the state there."""
        ...


@dataclass(frozen=True, eq=False)
class Response:
    """The response of a model to an excitation."""

    excitation: Excitation
    # force, state: (N,) force [N] and internal state of the model
    force: Floats
    state: Floats


def simulate(model: ForceLaw, excitation: Excitation) -> Response:
    """Force of a model along any motion, from rest.

    Parameters
    ----------
    model : Model
        Or any other force law.
    excitation : Excitation
        Time [s], displacement [m], velocity [m/s], acceleration [m/s²], current [A], (N,) each.

    Returns
    -------
    Response
        Force [N] (N,) and the model's internal state.

    Raises
    ------
    ParameterError
        If an integrated model is too stiff or diverges.

    Examples
    --------
    >>> from mrdamper import Condition, simulate
    >>> from mrdamper.models.bingham import Bingham
    >>> from mrdamper.physics.motion import sine
    >>> motion = sine(Condition(current_A=0.0, frequency_Hz=1.0, amplitude_m=0.01), 2, 200)
    >>> response = simulate(Bingham(c=1000.0, fy=300.0), motion)
    >>> round(float(response.force.max()))  # 300 N + 1000 N s/m · 0.0628 m/s
    363
    """
    require(
        excitation, Excitation, "a motion", "mrdamper.physics.motion makes them: sine, sweep, triangle, random_motion"
    )
    if not _is_force_law(type(model)):
        require(model, ForceLaw, "a model", "of a damper, damper.predict(motion) gives the force")
    if (respond := getattr(model.state, "response", None)) is not None:  # of a recorded state: both in one pass
        return Response(excitation, *respond(model, excitation))
    state = model.state(excitation)
    return Response(excitation, model.force(excitation, state), state)


@cache
def _is_force_law(kind: type) -> bool:
    """Tell if objects of a class are force laws; the protocol of an object takes longer than a short simulation."""
    return issubclass(kind, ForceLaw)


def steady_loop(model: ForceLaw, condition: Condition, samples_per_cycle: int = 1000) -> Response:
    """One closed loop of the steady response to a sine.

    Cycles are run until the state closes on itself to 1e-9 of its range. Where a state creeps (Spencer's with a soft
    k0), the loop after 512 cycles counts if the force changes by less than 1e-3 of its range after it. Raises
    `ExcitationError` if it does not.
    """
    cycles = 2
    while cycles <= _MOST_CYCLES:
        motion = sine(condition, cycles, samples_per_cycle)
        response = simulate(model, motion)
        last = slice(-samples_per_cycle - 1, None)
        state = response.state[last]
        gap, span = np.abs(state[-1] - state[0]), np.ptp(state, axis=0)
        closed = np.all(gap <= _CLOSURE * np.maximum(span, np.finfo(float).tiny))
        if closed or (cycles == _MOST_CYCLES and _change_to_come(response.force, samples_per_cycle) <= _CREEP):
            loop = motion.part(last)
            time = loop.time - loop.time[0]
            from_zero = Excitation(time, loop.displacement, loop.velocity, loop.acceleration, loop.current)
            return Response(from_zero, response.force[last], state)
        cycles *= 4
    raise ExcitationError(
        f"the loop does not close within {_MOST_CYCLES} cycles",
        where=str(condition),
        remedy="raise the amplitude if it is far below the yield displacement; otherwise predict along a motion",
    )


def _change_to_come(force: Floats, cycle: int) -> float:
    """Change of a periodic force after the last of three cycles, a geometric series, over its range."""
    first, second, third = (force[-(back * cycle) : len(force) - (back - 1) * cycle] for back in (3, 2, 1))
    before, last = float(np.abs(second - first).max()), float(np.abs(third - second).max())
    if last >= before:
        return 0.0 if last == 0 else np.inf
    return last * last / (before - last) / max(float(np.ptp(third)), np.finfo(float).tiny)
