"""A damper under the sliders: its model at a condition, with some parameters held by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from mrdamper.dampers.base import Damper
from mrdamper.dampers.prediction import Prediction
from mrdamper.data import Condition
from mrdamper.data.encoding import finite
from mrdamper.data.parameters import ParameterInfo
from mrdamper.errors import ParameterError
from mrdamper.physics.simulation import ForceLaw, Response, steady_loop

_DECADES = 10.0  # a slider without bounds reaches this factor up and down, or twice the value


def held_model(damper: Damper, condition: Condition, held: Mapping[str, float]) -> ForceLaw:
    """Return the model at a condition with some parameters held.

    Raises `ParameterError` if the model has no such parameter, or the value is outside its bounds.
    """
    model = damper.model_at(condition)
    if not held:
        return model
    values = model.values()
    for name in held:
        if name not in values:
            raise ParameterError(f"this damper has no parameter {name!r}", remedy="load the page again")
    return replace(model, **held)  # type: ignore[type-var]


def loop_held(damper: Damper, condition: Condition, held: Mapping[str, float]) -> Response:
    """Steady loop at a condition; raises as `held_model`."""
    return steady_loop(held_model(damper, condition, held), condition) if held else damper.loop(condition)


def predict_held(damper: Damper, condition: Condition, held: Mapping[str, float]) -> Prediction:
    """Steady loop at a condition with its flags; raises as `held_model`."""
    loop = loop_held(damper, condition, held)
    return Prediction(loop.excitation, loop.force, condition, damper.envelope.flags(condition), steady=True)


def as_damper(damper: Damper, held: Mapping[str, float]) -> Damper:
    """Return the damper with the held parameters made its own.

    Raises `InputError` if a held parameter is not one the damper is made of: a function of the condition gives
    another coordinate, from which it follows.
    """
    if not held:
        return damper
    about = {**damper.provenance, "held by hand": ", ".join(f"{n} = {v!r}" for n, v in sorted(held.items()))}
    return replace(damper.holding(held), provenance=about)


def sliders(damper: Damper) -> list[dict[str, Any]]:
    """One slider a parameter, at the middle of the tested conditions."""
    model = damper.model_at(damper.envelope.middle)
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
            "bounds": [finite(bound) for bound in info.bounds],
        }
        for info in model.parameters()
        for value in (float(model.values()[info.name]),)
        for low, high in (reach(info, value),)
    ]


def reach(info: ParameterInfo, value: float) -> tuple[float, float]:
    """Return ends of a parameter's slider [its unit]: its bounds, or as far as a look makes sense."""
    low, high = info.bounds
    if info.scale == "log" and value > 0:
        return max(low, value / _DECADES), min(high, value * _DECADES)
    span = 2 * abs(value) or 1.0
    return max(low, value - span), min(high, value + span)
