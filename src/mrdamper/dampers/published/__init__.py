"""Published dampers over current, frequency and amplitude, one file each, found by discovery.

"-type" in a title: the published equations were not available, and the form follows descriptions of them.
"""

from __future__ import annotations

from collections.abc import Mapping

from mrdamper.dampers.kernel import KernelDamper
from mrdamper.dampers.published.base import ConditionedDamper
from mrdamper.discovery import Registry

__all__ = ["ConditionedDamper", "Published", "all_conditioned", "all_published", "conditioned_type"]

Published = type[ConditionedDamper] | type[KernelDamper]


_registry = Registry("mrdamper.dampers", ConditionedDamper, "condition-dependent damper")
all_conditioned = _registry.all
conditioned_type = _registry.type_named


def all_published() -> Mapping[str, Published]:
    """Return the published dampers by name: the condition-dependent ones, and a regression without physics."""
    types = {**all_conditioned(), KernelDamper.name: KernelDamper}
    return {name: types[name] for name in sorted(types)}
