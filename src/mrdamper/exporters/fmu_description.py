"""Description of an FMU: its variables, their units, its serialized state."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal

from mrdamper.dampers.streaming import FLAGS, Stepper, Stream
from mrdamper.data.parameters import ParameterInfo
from mrdamper.errors import ParameterError

DRIVES = (
    ("displacement", 1, "displacement; its differences are the velocity"),
    ("velocity", 2, "velocity; integrated from zero it is the displacement"),
    ("motion", 3, "displacement and velocity, both as given"),
)
STATUSES = (  # the numbers of the C source's status
    ("ok", 0, "a force was found"),
    ("not_ready", 1, "the model was not started"),
    ("bad_input", 2, "an input is not finite"),
    ("bad_time_step", 3, "the step is not positive, or holds too many internal steps"),
    ("bad_parameter", 4, "parameters outside their bounds, or off the branch the source was made for"),
    ("bad_state", 5, "a state that is not finite"),
    ("no_answer", 6, "the model has no finite force there"),
)
SHORTEST = 1e-6  # s; the least an internal step may be set to
_DISPLAY = {"m": (("mm", "1000"),), "m/s": (("mm/s", "1000"),), "N": (("kN", "0.001"),), "s": (("ms", "1000"),)}
_SHOWN = {"m": "mm", "m/s": "mm/s"}  # N is shown as N
_BASE = {"[mass]": "kg", "[length]": "m", "[time]": "s", "[current]": "A"}


@dataclass(frozen=True)
class Variable:
    """One variable of the model description."""

    name: str
    description: str
    kind: Literal["real", "flag", "choice"]
    causality: str  # as the standard names them
    variability: str
    unit: str = ""
    start: float | None = None
    low: float = -math.inf
    high: float = math.inf
    declared_type: str = ""  # of a choice
    symbol: str = ""  # of its value reference in the C source; default: its name
    reference: int = 0  # of its value
    index: int = 0  # among the variables, from one

    @property
    def initial(self) -> str:
        """Origin of its first value, as the standard names it."""
        return {"output": "calculated", "parameter": "exact", "local": "exact"}.get(self.causality, "")

    @property
    def attributes(self) -> list[tuple[str, str]]:
        """Declared type, unit, bounds and start."""
        bounds = (("min", self.low), ("max", self.high))
        texts = (("declaredType", self.declared_type), ("unit", self.unit), ("displayUnit", _SHOWN.get(self.unit)))
        limits = [(word, repr(float(bound))) for word, bound in bounds if math.isfinite(bound)]
        start = [("start", repr(self.start))] if self.start is not None else []
        return [*((word, text) for word, text in texts if text), *limits, *start]

    def type_in(self, fmi: int) -> str:
        """Return its type as a version of the standard names it."""
        return {"real": "Real" if fmi == 2 else "Float64", "flag": "Boolean", "choice": "Enumeration"}[self.kind]


def numbered(variables: Sequence[Variable], fmi: int) -> list[Variable]:
    """Give variables their value references, in this order, and their indices; time exists in FMI 3 only."""
    shown = [replace(v, reference=at) for at, v in enumerate(variables) if fmi == 3 or v.name != "time"]
    return [replace(v, index=index) for index, v in enumerate(shown, 1)]


def description_facts(stepping: Stream, fmi: int, internal_step: float, members: Sequence[str]) -> dict[str, Any]:
    """Collect the template values of an FMU beyond those of the C source, whose memory has these members."""
    current = stepping.envelope.current_A[0] if stepping.envelope else 0.0
    parameters = parameters_of_stream(stepping)
    variables = numbered(
        [
            Variable("time", "Time", "real", "independent", "continuous", "s"),
            Variable("displacement", "Displacement from mid-stroke", "real", "input", "continuous", "m", 0.0),
            Variable("velocity", "Velocity; used with drive 2 and 3", "real", "input", "continuous", "m/s", 0.0),
            Variable("current", "Coil current", "real", "input", "continuous", "A", current),
            Variable("force", "Damper force", "real", "output", "continuous", "N"),
            *(Variable(f"outside_{f}", f"The {f} lies outside the tested range", "flag", "output", "discrete")
              for f in FLAGS),
            Variable("status", "Outcome of the last step", "choice", "output", "discrete", declared_type="Status"),
            Variable("drive", "What makes the motion", "choice", "parameter", "fixed", "", 1, declared_type="Drive"),
            Variable("internal_step", "Longest internal step", "real", "parameter", "tunable", "s", internal_step,
                     SHORTEST),
            *(_parameter(stepping, info, tunable) for info, tunable in parameters),
        ],
        fmi,
    )  # fmt: skip
    return {
        "variables": variables,
        "units": units_of(v.unit for v in variables if v.unit),
        "types": (
            {"name": "Drive", "description": "What makes the motion", "choices": DRIVES},
            {"name": "Status", "description": "Outcome of the last step", "choices": STATUSES},
        ),
        "parameters": [{"name": i.name, "tunable": tunable, "bounds": _c_bounds(i)} for i, tunable in parameters],
        "drive_items": [(word, number) for word, number, _ in DRIVES],
        "status_texts": [text for _, _, text in STATUSES],
        "flags": FLAGS,
        "shortest": repr(SHORTEST),
        "current_start": repr(current),
        "internal_step": repr(internal_step),
        **_serial_fields(members, [info.name for info, _ in parameters]),
    }


def _parameter(stepping: Stream, info: ParameterInfo, tunable: bool) -> Variable:
    """Describe a parameter of the model; one that must keep its value is a constant."""
    meaning = info.meaning[:1].upper() + info.meaning[1:]
    kind = ("parameter", "tunable") if tunable else ("local", "constant")
    low, high = info.bounds if tunable else (-math.inf, math.inf)
    value, unit = getattr(stepping.model, info.name), unit_name(info, stepping)
    return Variable(info.name, meaning, "real", *kind, unit, value, low, high, symbol=f"p_{info.name}")


def parameters_of_stream(stepping: Stream) -> list[tuple[ParameterInfo, bool]]:
    """List the parameters of the model, and whether each may change, which a guard of the trace may exclude."""
    if stepping.model is None:
        return []
    return [(info, _is_free(stepping, info.name)) for info in stepping.model.parameters()]


def _is_free(stepping: Stream, name: str) -> bool:
    value = getattr(stepping.model, name)
    for near in (value * 1.01, value * 0.99) if value else (1e-3, -1e-3):
        try:
            Stepper(stepping).set_parameters(**{name: near})
        except ParameterError:
            continue
        return True
    return False


def unit_name(info: ParameterInfo, stepping: Stream) -> str:
    """Write the unit of a parameter; an exponent that is a parameter is replaced by its value if it is an integer."""
    if info.unit == "-":
        return "1"
    if info.unit.endswith("^-n"):
        n = float(getattr(stepping.model, "n", math.nan))
        return f"1/m^{n:.0f}" if n.is_integer() else info.unit
    return info.unit


def units_of(names: Iterable[str]) -> list[Mapping[str, Any]]:
    """Return units by name, their powers of SI base units, and display units."""
    return [
        {"name": name, "base": base_powers(name), "displays": _DISPLAY.get(name, ())} for name in dict.fromkeys(names)
    ]


def base_powers(unit: str) -> list[tuple[str, int]] | None:
    """Return the powers of the SI base units of a unit; None if they are no integers."""
    from pint.errors import PintError

    if re.search(r"\^-?[a-z]", unit):  # the power is itself a parameter
        return None
    try:
        quantity = _registry().Quantity(1.0, "" if unit == "1" else unit)
    except (PintError, ValueError):
        return None
    return [(_BASE[str(d)], int(power)) for d, power in quantity.dimensionality.items()]


@cache
def _registry() -> Any:
    from pint import UnitRegistry

    return UnitRegistry()


def _serial_fields(members: Sequence[str], parameters: Sequence[str]) -> dict[str, Any]:
    """List the serialized state: how each number is read from the state and written to it."""
    fields: list[tuple[str, str, str]] = []  # get, set to, kept when
    inputs = [f"{group}.{name}" for group in ("set", "last") for name in ("displacement", "velocity", "current")]
    fields += [(f"s->{name}", f"s.{name} = #", "") for name in (*inputs, "time")]
    fields.append(("s->internal_step", "s.internal_step = #", f"# >= {SHORTEST!r}"))
    choices: list[tuple[str, object, object]] = [
        ("phase", "PHASE_INSTANTIATED", "PHASE_TERMINATED"),
        ("drive", "DRIVE_DISPLACEMENT", "DRIVE_MOTION"),
        ("started", 0, 1),
        ("status", 0, STATUSES[-1][1]),
    ]
    choices += [("changed", 0, 1)] if parameters else []
    fields += [(f"(double)s->{n}", f"s.{n} = (int)#", f"is_between(#, {low}, {high})") for n, low, high in choices]
    fields += [(f"s->model.p.{name}", f"p.{name} = #", "") for name in parameters]
    fields += [(f"s->wanted.{name}", f"s.wanted.{name} = #", "") for name in parameters]
    fields += [(f"s->model.s.{name}", f"memory.{name} = #", "") for name in (*members, "force")]
    fields.append(
        ("(double)s->model.s.flags", "memory.flags = (unsigned)#", f"is_between(#, 0, {2 ** len(FLAGS) - 1})")
    )
    placed = [
        (get, put.replace("#", f"v[{i}]"), kept.replace("#", f"v[{i}]")) for i, (get, put, kept) in enumerate(fields)
    ]
    return {
        "serial": [{"read": get, "write": f"{put};"} for get, put, _ in placed],
        "serial_count": len(fields),
        "ranges": " && ".join(kept for _, _, kept in placed if kept),
    }


def _c_bounds(info: ParameterInfo) -> str:
    """Write the bounds of a value as a condition in C; empty without bounds."""
    low, high = info.bounds
    checks = [f"value >= {float(low)!r}"] if math.isfinite(low) else []
    return " && ".join(checks + ([f"value <= {float(high)!r}"] if math.isfinite(high) else []))
