"""Control laws, which calculate the current from sensor signals; one file each, found by discovery."""

from __future__ import annotations

from mrdamper.discovery import Registry
from mrdamper.systems.controllers.base import Controller

__all__ = ["Controller", "controller_type", "controller_types"]


_registry = Registry("mrdamper.controllers", Controller, "controller")
controller_types = _registry.all
controller_type = _registry.type_named
