"""A model type with one function per parameter: the modified model of the paper."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from mrdamper.data import Condition
from mrdamper.functions.forms import ParameterFunction
from mrdamper.models import Model


@dataclass(frozen=True, eq=False)
class ParameterMap:
    """A model type with one function per parameter: the modified model.

    Attributes
    ----------
    model_type : type of Model
    functions : mapping of str to ParameterFunction
        By parameter, or by a coordinate the model can be built from.
    """

    model_type: type[Model]
    functions: Mapping[str, ParameterFunction]

    def __post_init__(self) -> None:
        object.__setattr__(self, "functions", dict(self.functions))

    def at(self, condition: Condition) -> Model:
        """The model at a condition; values a function drives past a parameter's bounds stop there."""
        point = (condition.current_A, condition.frequency_Hz, condition.amplitude_m)
        return self.model_type.nearest({name: function(*point) for name, function in self.functions.items()})

    @property
    def parameter_count(self) -> int:
        """Coefficients and rates over all functions."""
        return sum(len(f.coefficients) + len(f.rates) for f in self.functions.values())
