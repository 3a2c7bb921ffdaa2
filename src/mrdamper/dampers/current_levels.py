"""Levels of the coil current in the runs of a rig, and the parameters that they determine."""

from __future__ import annotations

from collections.abc import Sequence

from mrdamper.models.base import Model

_LEVEL_TOLERANCE, _LEVEL_TOLERANCE_A = 5e-3, 1e-3  # currents closer than this, as a share of the largest, are one level
_PASSED_LEVELS = 5  # levels that a current that changes counts for: it passes through all


def levels_of(currents: Sequence[float | None]) -> list[list[int]]:
    """Return indices of the runs of constant current, by level from the lowest; None: the current changes."""
    sizes = {i: abs(current) for i, current in enumerate(currents) if current is not None}
    tolerance = max(_LEVEL_TOLERANCE * max(sizes.values(), default=0.0), _LEVEL_TOLERANCE_A)
    levels: list[list[int]] = []
    for i in sorted(sizes, key=sizes.__getitem__):
        if levels and sizes[i] - sizes[levels[-1][0]] <= tolerance:
            levels[-1].append(i)
        else:
            levels.append([i])
    return levels


def level_count(currents: Sequence[float | None]) -> int:
    """Count the levels of the current."""
    return _PASSED_LEVELS if None in currents else len(levels_of(currents))


def undetermined(model: type[Model], currents: Sequence[float | None]) -> tuple[str, ...]:
    """Return the parameters of effects of the current that runs of too few levels cannot tell from others."""
    levels = level_count(currents)
    return tuple(name for name, needed in model.current_levels.items() if levels < needed)
