"""Damper models, one file each: a new file here, or a package with the entry point `mrdamper.models`, is found."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mrdamper.discovery import ExtensionPart, Registry
from mrdamper.models.base import Model, Scale, SearchAxis

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["Model", "Scale", "SearchAxis", "all_models", "model_parts", "model_type"]


_registry = Registry("mrdamper.models", Model, "model")


def all_models() -> Mapping[str, type[Model]]:
    """Every model by its name."""
    return _registry.types


def model_parts() -> tuple[ExtensionPart, ...]:
    """Every model with the package that provides it."""
    return _registry.parts


def model_type(name: str) -> type[Model]:
    """Return the model of that name.

    Raises
    ------
    UnknownNameError
        With the near matches.
    """
    return _registry.type_named(name)


def __getattr__(name: str) -> Any:
    # `from mrdamper.models import Bingham`: every registered class, without a second list of them.
    if name[:1].isupper():
        for cls in all_models().values():
            if cls.__name__ == name:
                return cls
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, *(cls.__name__ for cls in all_models().values())])
