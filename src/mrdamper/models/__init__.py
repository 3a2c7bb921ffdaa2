"""Damper models, one file each. A file dropped in here is found; there is no list."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from mrdamper.discovery import named, subclasses_in
from mrdamper.models.base import Model, Scale, SearchAxis

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["Model", "Scale", "SearchAxis", "all_models", "model_type"]


@cache
def all_models() -> Mapping[str, type[Model]]:
    """Every model by its name."""
    return subclasses_in(__name__, __path__, Model)


def model_type(name: str) -> type[Model]:
    """The model of that name.

    Raises
    ------
    UnknownNameError
        With the near matches.
    """
    return named("model", name, all_models())
