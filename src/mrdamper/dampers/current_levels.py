"""Parameters that the levels of the coil current in the runs of a rig determine."""

from __future__ import annotations

from collections.abc import Sequence

from mrdamper.data import level_groups
from mrdamper.models.base import Model

_PASSED_LEVELS = 5  # number of levels of a changing current, which passes through all


def level_count(currents: Sequence[float | None]) -> int:
    """Count the levels of the current."""
    return _PASSED_LEVELS if None in currents else len(level_groups(currents))


def undetermined(model: type[Model], currents: Sequence[float | None]) -> tuple[str, ...]:
    """Return the parameters of effects of the current that runs of too few levels do not determine."""
    levels = level_count(currents)
    return tuple(name for name, needed in model.current_levels.items() if levels < needed)
