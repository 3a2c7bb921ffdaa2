"""Laws that set the current from what sensors see, one file each, found by discovery."""

from __future__ import annotations

from collections.abc import Mapping

from mrdamper.discovery import Registry
from mrdamper.systems.controllers.base import Controller

__all__ = ["Controller", "controller_type", "controller_types"]


_registry = Registry("mrdamper.controllers", Controller, "controller")


def controller_types() -> Mapping[str, type[Controller]]:
    """Every controller by its name."""
    return _registry.types


def controller_type(name: str) -> type[Controller]:
    """Return the controller of that name; raises `UnknownNameError` with the near matches."""
    return _registry.type_named(name)
