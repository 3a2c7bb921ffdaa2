"""The equations of a damper, read off its own code: the force, the laws of its state, its parameters.

The model's array code runs on symbols, as for streams, but writes laws instead of steps. So
what a report prints is what is computed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import JointDamper
from mrdamper.dampers.modified import ModifiedModel
from mrdamper.dampers.published import ConditionedDamper
from mrdamper.data import Condition
from mrdamper.errors import ParameterError
from mrdamper.models import Model
from mrdamper.parameters import ParameterInfo
from mrdamper.streaming import TracedMotion, TracedStep
from mrdamper.tracing import Expression, Tape
from mrdamper.tracing.tape import Law

MOTION = ("x", "v", "a", "I")


@dataclass(frozen=True, eq=False)
class Formulas:
    """Equations of a damper.

    Attributes
    ----------
    title, source : str
    laws : tuple of Law
        In the order in which they are needed.
    force : Expression
    parameters : mapping of ParameterInfo to float
        Parameters with their values; those that are functions are among the laws.
    """

    title: str
    source: str
    laws: tuple[Law, ...]
    force: Any
    parameters: Mapping[ParameterInfo, float]


def formulas(damper: Damper | Model) -> Formulas:
    """Equations of a model, a joint damper, a modified model or a published condition-dependent damper.

    Raises
    ------
    ParameterError
        If the damper is of another kind.
    """
    tape = Tape(readable=True)
    x, v, a, I = (tape.input(name, 0.0 if name == "I" else None) for name in MOTION)
    motion = TracedMotion(tape, x, v, a, I, TracedStep(tape, None), TracedStep(tape, None, v))
    if isinstance(damper, ModifiedModel):
        source, parameters = damper.parameters.model_type.source, {}
        model = _of_functions(tape, damper, I)
    elif isinstance(damper, ConditionedDamper) and damper.has_model:
        source, parameters = damper.source, {}
        model = _of_laws(tape, damper, I)
    elif isinstance(damper, Model | JointDamper):
        given = damper if isinstance(damper, Model) else damper.model
        source = given.source
        parameters = {info: getattr(given, info.name) for info in given.parameters()}
        model = type(given)(**{info.name: _shown(tape, info, value) for info, value in parameters.items()})
    else:
        raise ParameterError("no equations to print", where=damper.title, mend="export a joint or a modified model")
    force = model.force(motion, model.state(motion))  # type: ignore[arg-type]
    return Formulas(damper.title, source, tuple(tape.laws), force, parameters)


def _shown(tape: Tape, info: ParameterInfo, value: float) -> Any:
    """A symbol, or the number where the parameter is preset: terms that are off do not show."""
    return value if info.preset and value == info.default else tape.parameter(info.name, value)


def _of_functions(tape: Tape, damper: ModifiedModel, current: Expression) -> Model:
    """The model of symbols, each defined by its function of current, frequency and amplitude."""
    middle, condition = _condition(tape, damper, current)
    made = {}
    for name, function in damper.parameters.functions.items():
        value = function(condition.current_A, condition.frequency_Hz, condition.amplitude_m)
        symbol = tape.symbol(name, float(function(middle.current_A, middle.frequency_Hz, middle.amplitude_m)))
        made[name] = tape.law("is", symbol, value)
    return damper.parameters.model_type.build(made)


def _of_laws(tape: Tape, damper: ConditionedDamper, current: Expression) -> Model:
    """The same for a damper whose model is written down for every condition."""
    middle, condition = _condition(tape, damper, current)
    laws, there = damper.model_at(condition), damper.model_at(middle)
    return type(laws)(
        **{
            name: tape.law("is", tape.symbol(name, float(getattr(there, name))), value)
            if isinstance(value, Expression)
            else value
            for name, value in laws.values().items()
        }
    )


def _condition(tape: Tape, damper: Damper, current: Expression) -> tuple[Condition, Condition]:
    """The middle of the tests, and a condition of symbols that have its values."""
    e = damper.envelope
    middle = Condition(*(sum(span) / 2 for span in (e.current_A, e.frequency_Hz, e.amplitude_m)))
    current.value = middle.current_A
    f, A = tape.input("f", middle.frequency_Hz), tape.input("A", middle.amplitude_m)
    return middle, Condition(current, f, A)  # type: ignore[arg-type]
