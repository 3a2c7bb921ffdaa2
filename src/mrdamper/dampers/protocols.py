"""Interface of dampers for the modules below them, which must not import them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Protocol

from mrdamper.data.arrays import Floats
from mrdamper.data.conditions import Condition


class DamperLike(Protocol):
    """Properties and methods of a `Damper` that its parts use."""

    __dataclass_fields__: ClassVar[dict[str, Any]]  # required by `dataclasses.replace`
    streams: ClassVar[bool]  # it has a form for one sample

    @property
    def title(self) -> str:
        """Name of the damper."""
        ...

    @property
    def envelope(self) -> Any:
        """Tested ranges."""
        ...

    @property
    def coil(self) -> Any:
        """Response of the field to the current."""
        ...

    @property
    def uncertainty(self) -> Any:
        """Uncertainty of the parameters, or None."""
        ...

    @property
    def one_model(self) -> Any:
        """Model for all conditions, or None."""
        ...

    @property
    def fitted_parameters(self) -> Mapping[str, Any]:
        """Parameters determined from data."""
        ...

    @property
    def followed_amplitudes(self) -> tuple[float, float]:
        """Amplitudes within which the parameters follow the motion [m]."""
        ...

    def with_parameters(self, values: Mapping[str, float]) -> Any:
        """Return the damper with other parameters."""
        ...

    def model_at(self, condition: Condition) -> Any:
        """Return the model at a condition."""
        ...

    def loop(self, condition: Condition) -> Any:
        """Return the steady loop at a condition."""
        ...

    def force_along(self, motion: Any, condition: Condition) -> Floats:
        """Force along a motion that amounts to a condition [N]."""
        ...

    def with_field_current(self, motion: Any) -> Any:
        """Return the motion with the current whose field is there."""
        ...

    def predict(self, at: Any) -> Any:
        """Predict the steady loop at a condition, or the force along a run."""
        ...
