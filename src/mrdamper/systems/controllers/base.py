"""Base class of controllers: a law from sensor signals to a current.

The law runs on a tape, so that interpreted, compiled and exported programs come from the same code.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

from mrdamper.dampers.base import Damper
from mrdamper.data.parameters import ParameterInfo, parameters_of
from mrdamper.systems.inverse import check_monotone, invert_on
from mrdamper.systems.structure import Link, System
from mrdamper.tracing import Program, Tape, program

_UNITS = {
    **{"position": "m", "velocity": "m/s", "acceleration": "m/s2"},
    **{"stroke": "m", "stroke_rate": "m/s", "force": "N"},
}


@dataclass(frozen=True)
class Sensors:
    """Sensor signals and currents of one damper, as its control law uses them."""

    tape: Tape  # for memory: `remember`, `update`, `select`
    link: Link  # index of the damper
    damper: Damper
    low: float  # lowest current it may be given [A]
    high: float  # highest [A]
    period: float  # between two samples [s]
    shared: dict[str, Any]  # shared data of the laws of several dampers

    def __call__(self, point: str, quantity: str) -> Any:
        """Return the absolute "position", "velocity" or "acceleration" of a point, or "above" or "below" the damper."""
        name = {"above": self.link.above, "below": self.link.below}.get(point, point)
        return self.signal(f"{name}.{quantity}")

    @property
    def stroke(self) -> Any:
        """[m]"""
        return self.signal(f"{self.link.name}.stroke")

    @property
    def stroke_rate(self) -> Any:
        """[m/s]"""
        return self.signal(f"{self.link.name}.stroke_rate")

    @property
    def force(self) -> Any:
        """Force of the damper as measured [N]."""
        return self.signal(f"{self.link.name}.force")

    @property
    def dt(self) -> Any:
        """Time since the last sample [s]."""
        return self.signal("dt")

    def on_off(self, on: Any) -> Any:
        """Return the highest current where a condition holds, the lowest elsewhere."""
        high = self.tape.parameter(identifier(f"{self.link.name}.highest_current"), self.high)  # one program for all
        return self.tape.select(on, high, self.low)

    def current_for(self, force: Any) -> Any:
        """Calculate the current for a required force [N], positive against extension: see `invert`."""
        rate, place = self.stroke_rate, identifier(self.link.name) + "_"
        motion = {
            "displacement": self.stroke,
            "velocity": rate,
            "acceleration": (rate - self.tape.previous(rate, f"{place}rate")) / self.dt,
            "dt": self.dt,
        }
        self.shared.setdefault("limits", {})[self.link.name] = self.high
        width = check_monotone(self.damper, self.high)
        return invert_on(self.tape, self.damper, place, motion, force, width, self.high).current

    def signal(self, name: str) -> Any:
        """Return a signal by name: POINT.position, .velocity, .acceleration; DAMPER.stroke, .stroke_rate, .force."""
        signals: dict[str, Any] = self.shared.setdefault("signals", {})
        if name not in signals:
            signals[name] = self.tape.input(identifier(name, self.tape.inputs))
        return signals[name]


def identifier(name: str, taken: Container[str] = ()) -> str:
    """Convert the name of a signal or damper to an identifier of every language."""
    word = re.sub(r"\W", "_", name, flags=re.ASCII)
    word = word if word[:1].isalpha() else f"s_{word}"
    return word if word not in taken else next(f"{word}_{i}" for i in range(2, 1000) if f"{word}_{i}" not in taken)


@dataclass(frozen=True, eq=False)
class Control:
    """A controller prepared for a system."""

    program: Program | None  # from signals and dt to one current a link; None where currents never change
    signals: tuple[str, ...]  # its inputs but dt
    start: tuple[float, ...]  # current of each link before the first sample [A]
    # largest current [A] by damper with a force command: at either end, the force is not reachable
    limits: Mapping[str, float] = field(default_factory=dict)

    @property
    def units(self) -> dict[str, str]:
        """Unit of every input but dt, and of every output, by its name in the program."""
        assert self.program is not None
        inputs = zip(self.program.tape.inputs, self.signals, strict=False)  # dt comes last and is no signal
        return {name: _UNITS[signal.rpartition(".")[2]] for name, signal in inputs} | dict.fromkeys(
            self.program.outputs, "A"
        )


class Controller(ABC):
    """A law for the current. Subclasses are final, frozen dataclasses of `param` fields, one file each."""

    name: ClassVar[str]
    title: ClassVar[str]
    source: ClassVar[str] = ""  # where it was published
    calms: ClassVar[str] = ""  # "above" or "below", where it controls the motion of one end of the damper

    @classmethod
    def parameters(cls) -> tuple[ParameterInfo, ...]:
        """Describe each parameter."""
        return parameters_of(cls)

    @abstractmethod
    def law(self, see: Sensors) -> Any:
        """Calculate the current [A] of one damper from the present sensor signals."""

    def designed(self, system: System, links: Sequence[Link], period: float) -> Controller:
        """Return the controller adapted to the system; it is evaluated every `period` [s]."""
        return self

    def prepare(
        self,
        system: System,
        links: Sequence[Link],
        dampers: Mapping[str, Damper],
        period: float,
        highest: float | None = None,
    ) -> Control:
        """Trace the law of every damper into one program; `highest` caps the current [A]."""
        ready, tape, outputs, shared = self.designed(system, links, period), Tape(), {}, {}
        for link in links:
            command: Any = 0.0
            if link.role == "damper":
                damper = dampers[link.name]
                most = damper.envelope.current_A[1] if highest is None else highest
                see = Sensors(tape, link, damper, 0.0, most, period, shared)
                command = ready.law(see)
            outputs[identifier(f"{link.name}.current", outputs)] = command
        if not tape.inputs and not tape.memory:
            return Control(None, (), tuple(float(value) for value in outputs.values()))
        signals = shared.setdefault("signals", {})
        dt = signals.pop("dt", None)
        tape.inputs.pop("dt", None)
        tape.inputs["dt"] = tape.input("dt") if dt is None else dt  # comes last
        return Control(program(tape, outputs), tuple(signals), (0.0,) * len(links), shared.get("limits", {}))
