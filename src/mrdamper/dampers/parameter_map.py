"""A model type with one function per parameter: the modified model of the paper."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from mrdamper.data import Condition
from mrdamper.models.base import Model
from mrdamper.statistics.functions.forms import ParameterFunction, form_named
from mrdamper.statistics.functions.motion_hull import MotionHull


@dataclass(frozen=True, eq=False)
class ParameterMap:
    """A model type with one function per parameter: the modified model."""

    model_type: type[Model]
    functions: Mapping[str, ParameterFunction]  # by parameter, or by a coordinate the model can be built from
    # tested motions: outside them the functions are those of the nearest one. Without, they follow any motion, as the
    # functions of a publication do
    motions: MotionHull | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "functions", dict(self.functions))

    def at(self, condition: Condition) -> Model:
        """Return the model at a condition; values of a function beyond a parameter's bounds are limited to these."""
        motion = condition.frequency_Hz, condition.amplitude_m
        if self.motions is not None and self.follows_motion:
            motion = self.motions.nearest(*motion)
        point = (condition.current_A, *motion)
        return self.model_type.nearest({name: function(*point) for name, function in self.functions.items()})

    @property
    def units(self) -> dict[str, str]:
        """Unit of each parameter of the model, and of each coordinate it can be built from."""
        coordinates = {name: unit for name, (_, _, unit) in self.model_type.coordinates.items()}
        return coordinates | {info.name: info.unit for info in self.model_type.parameters()}

    @property
    def follows_motion(self) -> bool:
        """True where a function depends on the frequency or the amplitude."""
        return any(form_named(function.form).follows_motion for function in self.functions.values())

    @property
    def parameter_count(self) -> int:
        """Coefficients and rates over all functions."""
        return sum(len(f.coefficients) + len(f.rates) for f in self.functions.values())
