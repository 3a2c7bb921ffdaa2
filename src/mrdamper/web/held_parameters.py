"""Sliders of a damper: its model at a condition, with some parameters held by the user."""

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

_RANGE = 10.0  # factor from the value to the ends of a logarithmic slider


def held_model(damper: Damper, condition: Condition, held: Mapping[str, float]) -> ForceLaw:
    """Return the model at a condition, some parameters held; raises `ParameterError` on a bad name or value."""
    model = damper.model_at(condition)
    if not held:
        return model
    for name in held:
        if name not in model.values():
            raise ParameterError(f"this damper has no parameter {name!r}", remedy="load the page again")
    return replace(model, **held)  # type: ignore[type-var]


def held_loop(damper: Damper, condition: Condition, held: Mapping[str, float]) -> Response:
    """Return the steady loop at a condition; raises as `held_model`."""
    return steady_loop(held_model(damper, condition, held), condition) if held else damper.loop(condition)


def predict_held(damper: Damper, condition: Condition, held: Mapping[str, float]) -> Prediction:
    """Predict the steady loop at a condition with its flags; raises as `held_model`."""
    loop = held_loop(damper, condition, held)
    return Prediction(loop.excitation, loop.force, condition, damper.envelope.flags(condition), steady=True)


def as_damper(damper: Damper, held: Mapping[str, float]) -> Damper:
    """Return a damper with held parameters; raises `InputError` if one follows from a function of the condition."""
    if not held:
        return damper
    about = {**damper.provenance, "held by hand": ", ".join(f"{n} = {v!r}" for n, v in sorted(held.items()))}
    return replace(damper.holding(held), provenance=about)


def sliders(damper: Damper) -> list[dict[str, Any]]:
    """Describe a slider per parameter, at the middle of the tested conditions."""
    model = damper.model_at(damper.envelope.middle)
    described = []
    for info in model.parameters():
        value = float(model.values()[info.name])
        low, high = slider_ends(info, value)
        described.append({
            **{name: getattr(info, name) for name in ("name", "unit", "meaning", "preset")},
            "value": value, "low": low, "high": high, "bounds": [finite(bound) for bound in info.bounds],
            "scale": "log" if _logarithmic(info, value) else "linear",
        })  # fmt: skip
    return described


def slider_ends(info: ParameterInfo, value: float) -> tuple[float, float]:
    """Return the ends of a slider [unit of the parameter]: a range around the value inside the bounds."""
    low, high = info.bounds
    if _logarithmic(info, value):
        return max(low, value / _RANGE), min(high, value * _RANGE)
    span = 2 * abs(value) or 1.0
    return max(low, value - span), min(high, value + span)


def _logarithmic(info: ParameterInfo, value: float) -> bool:
    return info.scale == "log" and value > 0
