"""Force over velocity in the sections and columns of TYDEX, the format that tyre and vehicle laboratories exchange.

The layout is that of TYDEX release 1.3 (Unrau and Zamow, 1997), as public programs read and write it. TYDEX defines
channels of tyres only, so that the names of these channels are this program's; no vehicle tool was tried.
"""

from __future__ import annotations

from typing import ClassVar

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import damper_of
from mrdamper.data.encoding import c_comment
from mrdamper.export.base import Exporter, Written
from mrdamper.export.curves import ForceVelocity, force_velocity
from mrdamper.models import Model

_CHANNELS = (  # name, description, unit
    ("CURRENT", "coil current", "A"),
    ("AMPLIT", "amplitude of the sine", "m"),
    ("VELOCITY", "positive in extension", "m/s"),
    ("FORCE", "at mid-stroke, pos. in ext.", "N"),
    ("PEAKFORC", "largest of the loop", "N"),
    ("TESTED", "1: inside the tested ranges", "-"),
)


class TydexExporter(Exporter):
    """One TYDEX-style file with the curves of all currents."""

    name: ClassVar[str] = "tydex"
    title: ClassVar[str] = "TYDEX-style table of force over velocity"
    suffix: ClassVar[str] = ".tdx"

    def export(self, damper: Damper | Model, name: str) -> Written:
        rig = c_comment(damper_of(damper).rig or name)
        parts = [
            ["**HEADER", _entry("RELEASE", "TYDEX release", "", "1.3"), _entry("MEASID", "damper", "", rig)],
            ["**COMMENTS", "Computed by mrdamper from an identified model, not measured; no hysteresis."],
            ["**MEASURCHANNELS", *(_entry(*channel, "1") for channel in _CHANNELS)],
            ["**MEASURDATA", *(row for curve in force_velocity(damper) for row in _rows(curve))],
            ["**END", ""],
        ]
        text = "\n\n".join("\n".join(part) for part in parts)
        note = "channel names are not part of the TYDEX standard; such a table has no hysteresis"
        return Written({f"{name}.tdx": text.encode("ascii", "replace")}, (note,))


def _entry(name: str, description: str, unit: str, value: str) -> str:
    """Columns 1 to 10, 11 to 40, 41 to 50 and from 51."""
    return f"{name:<10}{description:<30}{unit:<10}{value}".rstrip()


def _rows(curve: ForceVelocity) -> list[str]:
    return [
        "".join(f"{value:>16.8g}" for value in (curve.current_A, curve.amplitude_m, v, force, peak, tested))
        for v, force, peak, tested in zip(curve.velocity, curve.force, curve.peak_force, curve.tested, strict=True)
    ]
