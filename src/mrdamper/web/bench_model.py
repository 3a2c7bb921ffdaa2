"""A damper under the sliders: its model at a condition, with some parameters held by hand."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from mrdamper.dampers.base import Damper, Prediction
from mrdamper.dampers.joint import JointDamper
from mrdamper.dampers.modified import ModifiedModel
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.dampers.published import ConditionedDamper
from mrdamper.data import Condition
from mrdamper.errors import InputError, ParameterError
from mrdamper.functions.forms import ParameterFunction
from mrdamper.models import Model
from mrdamper.parameters import ParameterInfo
from mrdamper.simulation import steady_loop

_DECADES = 10.0  # a slider without bounds reaches this factor up and down, or twice the value


def model_at(damper: Damper, condition: Condition) -> Model | None:
    """The model behind a damper at a condition; None where it has no parameters to move."""
    if isinstance(damper, JointDamper):
        return damper.model
    if isinstance(damper, ModifiedModel) or (isinstance(damper, ConditionedDamper) and damper.has_model):
        return damper.model_at(condition)
    return None


def follows_condition(damper: Damper) -> bool:
    """Whether the parameters differ from condition to condition; a joint damper has one set for all."""
    return not isinstance(damper, JointDamper)


def held_model(damper: Damper, condition: Condition, held: Mapping[str, float]) -> Model | None:
    """The model at a condition with some parameters held.

    Raises
    ------
    ParameterError
        If the model has no such parameter, or the value is outside its bounds.
    """
    model = model_at(damper, condition)
    if not held:
        return model
    known = model.values() if model else {}
    for name in held:
        if name not in known:
            raise ParameterError(f"this damper has no parameter {name!r}", mend="load the page again")
    return replace(model, **held)  # type: ignore[type-var]


def predict_held(damper: Damper, condition: Condition, held: Mapping[str, float]) -> Prediction:
    """Steady loop at a condition; raises as `held_model`."""
    if not held:
        return damper.predict(condition)
    model = held_model(damper, condition, held)
    assert model is not None  # held parameters are parameters of a model
    response = steady_loop(model, condition)
    return Prediction(response.excitation, response.force, condition, damper.envelope.flags(condition))


def as_damper(damper: Damper, held: Mapping[str, float]) -> Damper:
    """The damper with the held parameters made its own.

    Raises
    ------
    InputError
        If a held parameter is not one the damper is made of: a function of the condition gives
        another coordinate, from which it follows.
    """
    if not held:
        return damper
    about = {**damper.provenance, "held by hand": ", ".join(f"{n} = {v!r}" for n, v in sorted(held.items()))}
    if isinstance(damper, JointDamper):
        return replace(damper, model=replace(damper.model, **held), provenance=about)
    functions = dict(damper.parameters.functions) if isinstance(damper, ModifiedModel) else {}
    missing = [name for name in held if name not in functions]
    if missing or not isinstance(damper, ModifiedModel):
        raise InputError(
            f"{', '.join(missing)} cannot be held in a saved model of this kind",
            where=damper.title,
            mend="release it on the Model page, or save the state of the bench instead",
            code="E_HELD",
        )
    for name, value in held.items():
        log = functions[name].log
        functions[name] = ParameterFunction("constant", (math.log(value) if log else value,), log=log)
    return replace(damper, parameters=ParameterMap(damper.parameters.model_type, functions), provenance=about)


def sliders(damper: Damper) -> list[dict[str, Any]]:
    """One slider a parameter, at the middle of the tested conditions."""
    model = model_at(damper, middle(damper))
    if model is None:
        return []
    return [
        {
            "name": info.name,
            "unit": info.unit,
            "meaning": info.meaning,
            "preset": info.preset,
            "value": value,
            "scale": "log" if info.scale == "log" and value > 0 else "linear",
            "low": low,
            "high": high,
            "bounds": [b if math.isfinite(b) else None for b in info.bounds],
        }
        for info in model.parameters()
        for value in (float(getattr(model, info.name)),)
        for low, high in (reach(info, value),)
    ]


def reach(info: ParameterInfo, value: float) -> tuple[float, float]:
    """Ends of a parameter's slider [its unit]: its bounds, or as far as a look makes sense."""
    low, high = info.bounds
    if info.scale == "log" and value > 0:
        return max(low, value / _DECADES), min(high, value * _DECADES)
    span = 2 * abs(value) or 1.0
    return max(low, value - span), min(high, value + span)


def middle(damper: Damper) -> Condition:
    """The condition in the middle of those a damper was identified from."""
    e = damper.envelope
    return Condition(
        *(0.5 * (low + high) for low, high in (e.current_A, e.frequency_Hz, e.amplitude_m)),
    )
