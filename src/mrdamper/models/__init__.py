"""Damper models, one file each, found here and in packages with the entry point `mrdamper.models`."""

from __future__ import annotations

from typing import Any

from mrdamper.data.parameters import param
from mrdamper.discovery import Registry
from mrdamper.models.base import Model, Scale, SearchAxis

__all__ = ["Model", "Scale", "SearchAxis", "all_models", "model_parts", "model_type", "param"]


_registry = Registry("mrdamper.models", Model, "model")
all_models = _registry.all
model_parts = _registry.parts
model_type = _registry.type_named


def __getattr__(name: str) -> Any:
    # `from mrdamper.models import Bingham`: every registered class, without a second list of them.
    if name[:1].isupper():
        for cls in all_models().values():
            if cls.__name__ == name:
                return cls
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, *(cls.__name__ for cls in all_models().values())])
