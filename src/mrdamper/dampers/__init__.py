"""Identified dampers: what each kind can do, and how it comes from runs."""

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
    """Every kind of damper that can be saved, by what a saved model calls it."""
    from mrdamper.dampers.base import Damper

    for module in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{module.name}")
    kinds = (cls for cls in Damper.__subclasses__() if cls.__module__.startswith(f"{__name__}."))
    return MappingProxyType({cls.kind: cls for cls in sorted(kinds, key=lambda cls: cls.kind)})
