"""Identified dampers, by kind, and their identification from runs."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mrdamper.dampers.base import Damper


@cache
def all_kinds() -> Mapping[str, type[Damper]]:
    """Every kind of damper that can be saved, by its name in a saved model."""
    from mrdamper.dampers.base import Damper

    for module in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{module.name}")
    kinds = (cls for cls in Damper.__subclasses__() if cls.__module__.startswith(f"{__name__}."))
    return MappingProxyType({cls.kind: cls for cls in sorted(kinds, key=lambda cls: cls.kind)})


def kind_named(name: str) -> type[Damper] | None:
    """Return the kind that a saved model names; if a module has its name, no other is imported."""
    from mrdamper.dampers.base import Damper

    if any(module.name == name for module in pkgutil.iter_modules(__path__)):
        own = importlib.import_module(f"{__name__}.{name}").__name__
        for cls in Damper.__subclasses__():
            if (cls.kind, cls.__module__) == (name, own):
                return cls
    return all_kinds().get(name)
