"""The largest force at the tested currents."""

from __future__ import annotations

from typing import ClassVar

from mrdamper.exporters.base import Exporter, Written
from mrdamper.exporters.curves import force_velocity


class PeakExporter(Exporter):
    """A table of current and largest force."""

    name: ClassVar[str] = "peaks"
    title: ClassVar[str] = "peak forces"
    suffix: ClassVar[str] = ".csv"

    def export(self, damper: object, name: str) -> Written:
        rows = [f"{curve.current_A:g},{curve.force.max():.6g}\n" for curve in force_velocity(damper)]
        return Written({f"{name}.csv": "".join(["current_A,force_N\n", *rows]).encode()})
