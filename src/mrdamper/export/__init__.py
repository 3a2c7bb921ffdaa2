"""Ways a damper leaves the house, one file each. A file dropped in here is found; there is no list."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from mrdamper.discovery import named, subclasses_in
from mrdamper.export.base import Exporter, Written

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["Exporter", "Written", "all_exporters", "exporter"]


@cache
def all_exporters() -> Mapping[str, type[Exporter]]:
    """Every export format by its name."""
    return subclasses_in(__name__, __path__, Exporter)


def exporter(name: str) -> type[Exporter]:
    """The export format of that name; raises `UnknownNameError` with the near matches."""
    return named("export format", name, all_exporters())
