"""Finding what was dropped into a package: there is no list to keep."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import TypeVar

from mrdamper.errors import UnknownNameError

N = TypeVar("N", bound=type)


def subclasses_in(package: str, path: Iterable[str], base: N) -> Mapping[str, N]:
    """Import every module of a package; the direct subclasses of `base` by their `name`, sorted."""
    for module in pkgutil.iter_modules(path):
        importlib.import_module(f"{package}.{module.name}")
    found = sorted(base.__subclasses__(), key=lambda cls: cls.name)
    return MappingProxyType({cls.name: cls for cls in found})


def named(kind: str, name: str, known: Mapping[str, N]) -> N:
    """The one of that name.

    Raises
    ------
    UnknownNameError
        With the near matches.
    """
    if name not in known:
        raise UnknownNameError.of(kind, name, known)
    return known[name]
