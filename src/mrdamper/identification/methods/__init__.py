"""Identification methods, one file each. A file dropped in here is found; there is no list."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING

from mrdamper.errors import UnknownNameError
from mrdamper.identification.problem import Method

if TYPE_CHECKING:
    from collections.abc import Mapping


@cache
def all_methods() -> Mapping[str, type[Method]]:
    """Every method by its name."""
    for module in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{module.name}")
    return MappingProxyType({cls.name: cls for cls in sorted(Method.__subclasses__(), key=lambda c: c.name)})


def method_named(name: str) -> Method:
    """The method of that name, with its default settings.

    Raises
    ------
    UnknownNameError
        With the near matches.
    """
    methods = all_methods()
    if name not in methods:
        raise UnknownNameError.of("method", name, methods)
    return methods[name]()
