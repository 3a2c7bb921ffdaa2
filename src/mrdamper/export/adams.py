"""Force–velocity property files in the block format that Adams reads, one for each current."""

from __future__ import annotations

from typing import ClassVar

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import damper_of
from mrdamper.export.base import Exporter, Written
from mrdamper.export.curves import force_velocity
from mrdamper.export.templates import render
from mrdamper.models import Model


class AdamsExporter(Exporter):
    """Damper property files: mm/s and N, velocity and force positive in extension.

    The layout of the blocks is recalled from public examples, not tried in Adams.
    """

    name: ClassVar[str] = "adams"
    title: ClassVar[str] = "Adams-style damper property files"

    def export(self, damper: Damper | Model, name: str) -> Written:
        files = {}
        for curve in force_velocity(damper):
            half = curve.velocity.size // 2
            at_rest = float(curve.force[half - 1 : half + 1].mean())
            points = [*zip(1e3 * curve.velocity[:half], curve.force[:half], strict=True), (0.0, at_rest)]
            points += zip(1e3 * curve.velocity[half:], curve.force[half:], strict=True)
            text = render(
                "damper.dmp.j2",
                rig=damper_of(damper).rig,
                current=curve.current_A,
                amplitude=curve.amplitude_m,
                points=points,
            )
            files[f"{name}_{curve.current_A:.3g}A.dmp".replace("-", "minus")] = text.encode("ascii", "replace")
        return Written(files, ("such a curve knows no hysteresis; c and fmu do",))
