"""Parameters that the levels of the coil current in the runs of a rig determine."""

from __future__ import annotations

from collections.abc import Sequence

from mrdamper.data import current_levels
from mrdamper.models.base import Model

_PASSED_LEVELS = 5  # number of levels of a changing current, which passes through all


def levels_of(currents: Sequence[float | None]) -> list[list[int]]:
    """Return indices of the runs of constant current, by level from the lowest; None: the current changes."""
    sizes = {i: abs(current) for i, current in enumerate(currents) if current is not None}
    levels = dict(zip(sizes, current_levels([*sizes.values()]), strict=True)) if sizes else {}
    return [[i for i in levels if levels[i] == level] for level in sorted({*levels.values()})]


def level_count(currents: Sequence[float | None]) -> int:
    """Count the levels of the current."""
    return _PASSED_LEVELS if None in currents else len(levels_of(currents))


def undetermined(model: type[Model], currents: Sequence[float | None]) -> tuple[str, ...]:
    """Return the parameters of effects of the current that runs of too few levels do not determine."""
    levels = level_count(currents)
    return tuple(name for name, needed in model.current_levels.items() if levels < needed)
