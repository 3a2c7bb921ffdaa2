"""Published dampers over current, frequency and amplitude, one file each; there is no list.

Where the published equations were not seen, the title says "-type": the form is the best
reading of descriptions, not a reproduction.
"""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING

from mrdamper.conditioned.base import ConditionedDamper
from mrdamper.errors import UnknownNameError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["ConditionedDamper", "all_conditioned", "conditioned_type"]


@cache
def all_conditioned() -> Mapping[str, type[ConditionedDamper]]:
    """Every condition-dependent damper by its name."""
    for module in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{module.name}")
    return MappingProxyType({cls.name: cls for cls in sorted(ConditionedDamper.__subclasses__(), key=lambda c: c.name)})


def conditioned_type(name: str) -> type[ConditionedDamper]:
    """The condition-dependent damper of that name.

    Raises
    ------
    UnknownNameError
        With the near matches.
    """
    known = all_conditioned()
    if name not in known:
        raise UnknownNameError.of("condition-dependent damper", name, known)
    return known[name]
